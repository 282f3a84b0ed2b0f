// Import of drawings: taken in, their scale set by two clicks or a known length, their rooms found.

import * as api from "./api.js";
import { byId, closeDialog, el, field, openDialog, select as choice, toast } from "./dom.js";
import { decodeFloor } from "./grid.js";
import { takeList } from "./panels.js";
import { change, page, save, tell } from "./store.js";
import { takeTable } from "./telemetry.js";
import { shown, told, typed, unitOf } from "./units.js";

const DRAWINGS = [".png", ".jpg", ".jpeg", ".pdf", ".dxf", ".csv", ".npy", ".npz"];
const LISTS = [".ttl", ".json", ".zinc"], TABLES = [".parquet", ".xlsx", ".txt"];
const sheets = []; // what is to be made floors of
let chosen = null;

const suffix = (name) => name.slice(name.lastIndexOf(".")).toLowerCase();
const used = (file) => page.draft.floors.some((floor) => floor.drawing?.file === file);

function freeFloor() {
  const taken = new Set([...page.draft.floors.map((f) => f.name), ...sheets.map((s) => s.floor)]);
  let n = page.draft.floors.length + 1;
  while (taken.has(`F${n}`)) n++;
  return `F${n}`;
}

function addSheet(found) {
  const old = sheets.findIndex((s) => s.file === found.file);
  if (old >= 0) sheets.splice(old, 1);
  const like = sheets.find((s) => s.points?.length === 2 && s.width === found.width && s.height === found.height);
  const sheet = {
    ...found, floor: freeFloor(), floorHeight: page.draft.floors[0]?.height || 3, method: found.dots_per_inch ? "paper" : "points", points: like ? like.points.map((p) => [...p]) : [], distance: like?.distance || "",
    paper: 100, pixelSize: "", page: 1, cell: 0.5, unit: "", wide: 1.3, small: 4, glass: 1.5, words: Boolean(found.read_text), include: found.kind !== "unreadable",
  };
  sheets.push(sheet);
  sheets.sort((a, b) => a.file.localeCompare(b.file, undefined, { numeric: true }));
  chosen = chosen && sheets.includes(chosen) ? chosen : sheets[0];
}

const isCodes = async (file) => /^[\s\d,;.eE+-]*$/.test((await file.slice(0, 400).text()).replace(/^\ufeff/, ""));

// Whether a CSV has a time stamp early in its second row: a table of telemetry, no list of devices.
const isTable = async (file) => /^[^\n]*\n([^\n,;\t]*[,;\t]){0,2}"?(\d{4}-\d\d?-\d\d?|\d\d?[./]\d\d?[./]\d{2,4}|\d{10,13}(?=[,;\t"]))/.test(await file.slice(0, 400_000).text());

// Files from the dialog, or dropped on the page: drawings become floors, lists become devices.
export async function importFiles(files) {
  let drawings = 0;
  for (const file of files) {
    const kind = suffix(file.name);
    try {
      if (TABLES.includes(kind) || (kind === ".csv" && (await isTable(file)))) { await takeTable(file); continue; }
      if (LISTS.includes(kind) || (kind === ".csv" && !(await isCodes(file)))) { await takeList(file); continue; }
      status(`Reading ${file.name}…`);
      addSheet(await api.upload("api/drawings", file));
      chosen = sheets.find((s) => s.file === file.name) && drawings ? chosen : sheets.find((s) => s.file === file.name);
      drawings++;
    } catch (error) {
      toast(`${error.refusal || error.name}: ${error.message}`, "error");
      status(`${error.refusal || error.name}: ${error.message}`, true);
    }
  }
  if (drawings) { draw(); status(""); }
}

function status(text, bad = false) {
  const line = byId("import-status");
  if (line) { line.textContent = told(text); line.className = bad ? "message" : "soft"; }
}

export async function openImport() {
  if (page.mode !== "edit") return;
  draw();
  try {
    const { drawings } = await api.get("api/drawings");
    for (const found of drawings) if (!used(found.file) && !sheets.some((s) => s.file === found.file)) addSheet(found);
    if (byId("dialog").open && byId("import-status")) draw(); // closed, or left for another, while the server was busy: so it stays
  } catch (error) {
    status(error.message, true);
  }
}

function ready(sheet) {
  if (!sheet.include) return true;
  if (sheet.kind === "unreadable" || !sheet.floor.trim()) return false;
  if (sheet.kind !== "raster") return sheet.kind === "vector" || sheet.cell > 0;
  if (sheet.method === "points") return sheet.points.length === 2 && sheet.distance > 0;
  return sheet.method === "paper" ? sheet.paper > 0 : sheet.pixelSize > 0;
}

function entryOf(sheet) {
  const entry = { name: sheet.floor.trim(), file: sheet.file, height: Number(sheet.floorHeight), widest_door: Number(sheet.wide), smallest_zone: Number(sheet.small) };
  if (sheet.kind === "codes") return { name: entry.name, file: entry.file, height: entry.height, smallest_zone: entry.smallest_zone, cell_size: Number(sheet.cell) };
  if (sheet.kind === "vector") return { ...entry, window_height: Number(sheet.glass), ...(sheet.unit ? { unit: Number(sheet.unit) } : {}) };
  const scale = {
    points: () => ({ points: sheet.points, distance: Number(sheet.distance) }), paper: () => ({ paper: Number(sheet.paper) }), pixel: () => ({ metres_per_pixel: Number(sheet.pixelSize) }),
  }[sheet.method]();
  return { ...entry, scale, page: Number(sheet.page), ...(sheet.words ? { read_text: true } : {}), ...(sheet.dots_per_inch ? { dots_per_inch: sheet.dots_per_inch } : {}) };
}

function draw() {
  const file = el("input", { type: "file", multiple: true, accept: DRAWINGS.join(","), id: "drawing-file", onchange: (e) => importFiles([...e.target.files]) });
  const todo = sheets.filter((s) => s.include), fine = todo.length > 0 && todo.every(ready);
  const list = el("ul", { class: "sheets", role: "listbox", "aria-label": "Drawings" }, sheets.map((sheet) => el("li", {
    role: "option", "aria-selected": String(sheet === chosen), tabindex: sheet === chosen ? "0" : "-1", class: ready(sheet) ? "ready" : "open",
    onclick: () => { chosen = sheet; draw(); }, onkeydown: (e) => sheetKey(e, sheet),
  }, el("strong", {}, sheet.include ? sheet.floor || "?" : "not used"), el("span", {}, sheet.file), el("em", {}, !sheet.include ? "" : ready(sheet) ? "ready" : sheet.kind === "unreadable" ? "unreadable" : "needs its scale"))));
  const body = el("div", { class: "importer" },
    el("div", { class: "side" },
      field("Drawings: PNG, JPEG, PDF, DXF; CSV or NumPy codes. One a floor, lowest first", file), list,
      el("p", { id: "import-status", class: "soft", role: "status", "aria-live": "polite" }, sheets.length ? "" : "Nothing leaves this machine: the files go to the case folder."),
      el("button", { type: "button", class: "primary wide", id: "find-rooms", disabled: !fine, onclick: findRooms }, `Find rooms on ${todo.length || "the"} drawing${todo.length === 1 ? "" : "s"}`)),
    el("div", { class: "main" }, chosen ? sheetPanel(chosen) : el("p", { class: "soft pad" }, "Choose files on the left, or drop them anywhere on the page.")));
  openDialog("Import drawings", body, { wide: true });
}

function sheetKey(event, sheet) {
  const next = sheets[sheets.indexOf(sheet) + ({ ArrowDown: 1, ArrowUp: -1 }[event.key] || 0)];
  if (!next || next === sheet) return;
  event.preventDefault();
  chosen = next;
  draw();
  byId("dialog").querySelector(".sheets [aria-selected=true]")?.focus();
}

const set = (sheet, key) => (event) => { sheet[key] = event.target.type === "checkbox" ? event.target.checked : event.target.value; refresh(); };

// Only what depends on the fields: the field that is written in keeps its caret.
function refresh() {
  const todo = sheets.filter((s) => s.include);
  const button = byId("find-rooms");
  if (button) { button.disabled = !(todo.length && todo.every(ready)); button.textContent = `Find rooms on ${todo.length} drawing${todo.length === 1 ? "" : "s"}`; }
  [...(byId("dialog").querySelectorAll(".sheets li") || [])].forEach((row, k) => {
    const sheet = sheets[k];
    row.className = ready(sheet) ? "ready" : "open";
    row.children[0].textContent = sheet.include ? sheet.floor || "?" : "not used";
    row.children[2].textContent = !sheet.include ? "" : ready(sheet) ? "ready" : "needs its scale";
  });
  drawMarks();
}

async function forget(sheet) {
  try {
    await api.remove(`api/drawings/${encodeURIComponent(sheet.file)}`);
    sheets.splice(sheets.indexOf(sheet), 1);
    chosen = sheets[0] || null;
    draw();
  } catch (error) {
    status(`${error.refusal || error.name}: ${error.message}`, true);
  }
}

const input = (sheet, key, type = "text", more = {}) => el("input", { type, id: `sheet-${key}`, value: sheet[key], step: "any", oninput: set(sheet, key), autocomplete: "off", ...more });

// A length or an area: kept in SI units, written and read in those that are shown.
function quantity(label, unit, sheet, key, note = "") {
  const take = (event) => { sheet[key] = typed(event.target.value, unit); refresh(); };
  return field(`${label} [${unitOf(unit)}]${note}`, input(sheet, key, "number", { min: 0, value: shown(sheet[key], unit), oninput: take }));
}

function sheetPanel(sheet) {
  const away = el("button", { type: "button", onclick: () => forget(sheet) }, "Remove this file");
  if (sheet.kind === "unreadable") return el("div", {}, el("p", { class: "message pad" }, sheet.message), away);
  const scale = sheet.kind === "raster" ? rasterScale(sheet) : sheet.kind === "codes" ? quantity("Side of a cell", "m", sheet, "cell")
    : quantity("A unit of the drawing", "m", sheet, "unit", " (empty: what the drawing says)");
  return el("div", {},
    el("div", { class: "grid four" }, field("Floor", input(sheet, "floor")), quantity("Clear height", "m", sheet, "floorHeight"),
      sheet.dots_per_inch ? field("Page of the PDF", input(sheet, "page", "number", { min: 1, onchange: () => draw() })) : null,
      el("label", { class: "check" }, el("input", { type: "checkbox", checked: sheet.include, onchange: set(sheet, "include") }), " use this drawing")),
    scale,
    el("details", {}, el("summary", {}, "More settings"), el("div", { class: "grid four" },
      quantity("Widest door", "m", sheet, "wide"), quantity("Smaller rooms join their neighbour", "m²", sheet, "small"),
      sheet.kind === "vector" && quantity("Height of the windows that it shows", "m", sheet, "glass"),
      sheet.kind === "raster" && el("label", { class: "check" }, el("input", { type: "checkbox", id: "sheet-words", checked: sheet.words, disabled: !sheet.read_text, onchange: set(sheet, "words") }), sheet.read_text ? " read the names of rooms from the picture" : " names of rooms in a picture: run apt install tesseract-ocr"), away)));
}

function rasterScale(sheet) {
  const method = choice([["points", "two points and their distance"], ...(sheet.dots_per_inch ? [["paper", "scale on paper"]] : []), ["pixel", "size of a pixel"]], sheet.method, { id: "sheet-method", onchange: (e) => { sheet.method = e.target.value; draw(); } });
  const picture = el("img", { alt: `Drawing ${sheet.file}`, draggable: "false", src: api.address(`api/drawings/${encodeURIComponent(sheet.file)}`, { page: sheet.page }) });
  const marks = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  marks.id = "marks";
  marks.setAttribute("viewBox", `0 0 ${sheet.width} ${sheet.height}`);
  const frame = el("div", { class: "drawing", id: "drawing", onclick: (event) => sheet.method === "points" && clickPoint(sheet, event) }, picture, marks);
  frame.style.aspectRatio = `${sheet.width} / ${sheet.height}`;
  const others = sheets.filter((s) => s !== sheet && s.kind === "raster" && s.include && s.width === sheet.width && s.height === sheet.height);
  const parts = {
    points: () => [el("p", { class: "soft" }, "Click two points whose distance you know, far apart: the ends of a dimension line, two outer corners. Click again to move the nearer one."),
      el("div", { class: "grid four" }, quantity("Their distance", "m", sheet, "distance"), pointField(sheet, 0), pointField(sheet, 1),
        others.length > 0 && el("button", { type: "button", onclick: () => { for (const o of others) Object.assign(o, { method: "points", points: sheet.points.map((p) => [...p]), distance: sheet.distance }); refresh(); toast("Same scale for the other drawings of this size."); } }, "Same for the others"))],
    paper: () => [field("Scale on paper, 1 to", input(sheet, "paper", "number"))],
    pixel: () => [quantity("Size of a pixel", "m", sheet, "pixelSize")],
  }[sheet.method]();
  setTimeout(drawMarks);
  return el("div", {}, field("Scale by", method), ...parts, frame);
}

// The points as numbers, for those who do not click.
function pointField(sheet, k) {
  const value = sheet.points[k] ? sheet.points[k].map((v) => Math.round(v)).join(", ") : "";
  return field(`Point ${k + 1} [px, px]`, el("input", { type: "text", id: `sheet-point-${k}`, value, placeholder: "column, row", onchange: (event) => {
    const numbers = event.target.value.split(/[,;\s]+/).filter(Boolean).map(Number);
    if (numbers.length === 2 && numbers.every(Number.isFinite)) { sheet.points[k] = numbers; sheet.points = sheet.points.filter(Boolean); refresh(); }
  } }));
}

function clickPoint(sheet, event) {
  const box = byId("drawing").getBoundingClientRect();
  const point = [((event.clientX - box.left) / box.width) * sheet.width - 0.5, ((event.clientY - box.top) / box.height) * sheet.height - 0.5];
  if (sheet.points.length < 2) sheet.points.push(point);
  else {
    const [a, b] = sheet.points.map((p) => Math.hypot(p[0] - point[0], p[1] - point[1]));
    sheet.points[a < b ? 0 : 1] = point;
  }
  sheet.points.forEach((p, k) => { const box = byId(`sheet-point-${k}`); if (box) box.value = p.map((v) => Math.round(v)).join(", "); });
  refresh();
  if (sheet.points.length === 2 && !sheet.distance) byId("sheet-distance")?.focus();
}

function drawMarks() {
  const marks = byId("marks");
  if (!marks || !chosen || chosen.method !== "points") { marks?.replaceChildren(); return; }
  const make = (tag, attributes) => { const e = document.createElementNS("http://www.w3.org/2000/svg", tag); for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v); return e; };
  const size = chosen.width / 60, [a, b] = chosen.points, children = [];
  if (a && b) children.push(make("line", { x1: a[0], y1: a[1], x2: b[0], y2: b[1] }));
  for (const [x, y] of chosen.points) children.push(make("circle", { cx: x, cy: y, r: size / 2 }), make("path", { d: `M${x - size} ${y}h${2 * size}M${x} ${y - size}v${2 * size}` }));
  marks.replaceChildren(...children);
}

async function findRooms() {
  const stop = new AbortController(), bar = el("progress", { max: 1 }), line = el("p", { role: "status", "aria-live": "polite" }, "Finding rooms…");
  const entries = sheets.filter((s) => s.include).map(entryOf);
  const side = byId("dialog").querySelector(".side");
  byId("find-rooms").replaceWith(el("div", { class: "working" }, line, bar, el("button", { type: "button", onclick: () => stop.abort() }, "Stop")));
  try {
    await save();
    const started = await api.send("api/floors", { floors: entries, cell_size: page.draft.floors.length ? page.draft.cell_size : null });
    const found = await api.job(started, (state) => {
      line.textContent = `${state.stage || "Finding rooms"} · ${Math.round(state.seconds)} s`;
      if (state.total) { bar.max = state.total; bar.value = state.done + 0.3; }
    }, stop.signal);
    take(found, entries);
  } catch (error) {
    draw();
    status(error.refusal === "Stopped" ? "Stopped." : `${error.refusal || error.name}: ${error.message}`, true);
    side?.scrollTo(0, 0);
  }
}

function take(found, entries) {
  const first = page.draft.floors.length === 0, [dx, dy] = found.shift, at = page.draft.floors.length;
  const devices = page.draft.devices.map((d) => (d.x !== null ? { ...d, x: d.x + dx, y: d.y + dy } : d));
  const turned = first && found.orientation ? { orientation: Math.round((((page.draft.orientation + found.orientation + 540) % 360) - 180) * 100) / 100 } : {};
  change("import drawings", { floors: found.floors.map(decodeFloor), cell_size: found.cell_size, devices, glazing: { ...page.draft.glazing, ...found.glazing }, ...turned });
  page.floor = at;
  const names = new Set(entries.map((entry) => entry.file));
  for (let k = sheets.length - 1; k >= 0; k--) if (names.has(sheets[k].file)) sheets.splice(k, 1);
  chosen = sheets[0] || null;
  closeDialog();
  tell("all");
  const zones = found.floors.slice(at).reduce((sum, floor) => sum + floor.legend.length - 3, 0);
  toast(`${zones} zones found on ${entries.length} floor${entries.length > 1 ? "s" : ""}. Compare them with the drawing.`);
  for (const remark of found.remarks) toast(remark);
}
