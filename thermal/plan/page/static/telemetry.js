// Telemetry: a table is given or named, its columns are matched and looked at, and it is put into the case.

import * as api from "./api.js";
import { byId, el, field, openDialog, select as choice, toast } from "./dom.js";
import { figure, short, spark } from "./plots.js";
import { make as makeReport, openReports } from "./reports.js";
import { page, reloadVerdict, save } from "./store.js";
import { shown, told, unitOf } from "./units.js";

const MOST = 150; // rows at once
const SURE = 0.7; // of the confidence of a match, below which a look is asked for
const STEPS = [["", "the table's own"], ["60", "1 minute"], ["300", "5 minutes"], ["600", "10 minutes"], ["900", "15 minutes"], ["1800", "30 minutes"], ["3600", "1 hour"]];
const now = { state: null, check: null, filter: "all", search: "", picked: null, working: "", trouble: "", open: false, source: { file: "", address: "", table: "", timezone: null, step: "" } };

const off = () => page.mode !== "edit" || now.working !== "";
const body = () => byId("telemetry-body");
const said = (error) => `${error.refusal || error.name}: ${error.message}`;

export async function openTelemetry() {
  openDialog("Telemetry", el("div", { id: "telemetry-body", class: "telemetry" }, "Loading…"), { wide: true });
  await work("", async () => {
    await save();
    now.state = await api.get("api/telemetry");
    if (page.telemetry) now.check = await api.job(await api.send("api/telemetry/check"), tellWork);
    else now.check = null;
  });
}

// Do something that takes a while; say what goes on and what goes wrong.
async function work(text, act) {
  Object.assign(now, { working: text || "Loading", trouble: "" });
  draw();
  try {
    await act();
  } catch (error) {
    now.trouble = said(error);
  }
  now.working = "";
  draw();
}

function tellWork(state) {
  const line = byId("telemetry-working");
  if (line) line.textContent = `${state.state === "waiting" ? "waiting" : state.stage || now.working} · ${Math.round(state.seconds)} s`;
}

export async function takeTable(file) {
  openDialog("Telemetry", el("div", { id: "telemetry-body", class: "telemetry" }), { wide: true });
  await work(`Reading ${file.name}`, async () => {
    await save();
    const given = await api.upload("api/telemetry/files", file);
    Object.assign(now.source, { file: given.file, address: "" });
    await look();
  });
}

async function look() {
  const { file, address, table, timezone, step } = now.source;
  const source = { file: address ? "" : file, address, table, timezone: timezone ?? page.draft.site.timezone, step: step ? Number(step) : null };
  now.picked = null;
  await api.job(await api.send("api/telemetry/look", source), tellWork);
  now.state = await api.get("api/telemetry");
}

async function correct(column, changes) {
  const match = now.state.table.columns.find((c) => c.column === column);
  const point = { column, entity: match.entity, point: match.point, unit: match.unit, ...changes };
  try {
    const { columns } = await api.send("api/telemetry/points", { points: [point] }, { method: "PUT" });
    const by = new Map(columns.map((c) => [c.column, c]));
    for (const row of now.state.table.columns) Object.assign(row, by.get(row.column));
    now.trouble = "";
  } catch (error) {
    now.trouble = said(error);
  }
  draw();
}

const take = () => work("Putting it into the case", async () => {
  now.check = await api.job(await api.send("api/telemetry/take"), tellWork);
  now.state = await api.get("api/telemetry");
  now.picked = null;
  await reloadVerdict();
  toast("The telemetry is in the case.");
});

async function pick(column, of) {
  now.picked = { column, of, plot: null };
  draw();
  try {
    now.picked.plot = await api.get("api/telemetry/plot", { column, of });
  } catch (error) {
    now.trouble = said(error);
  }
  draw();
}

function draw() {
  const box = body();
  if (!box) return;
  const active = document.activeElement, key = box.contains(active) ? active.id : "", scroll = box.parentElement.scrollTop;
  box.replaceChildren(...[sourcePart(), ...(isTaken() ? [casePart(), tablePart()] : [tablePart(), casePart()]), lists()].flat().filter(Boolean));
  box.parentElement.scrollTop = scroll;
  if (key) byId(key)?.focus({ preventScroll: true });
}

function sourcePart() {
  const { source, state } = now, set = (key) => (event) => { source[key] = event.target.value; };
  const file = el("input", { type: "file", accept: ".csv,.txt,.parquet,.xlsx", class: "sr", id: "telemetry-file", tabindex: "-1", "aria-label": "Table of telemetry", onchange: (e) => e.target.files[0] && takeTable(e.target.files[0]) });
  const known = state?.files[0] || "", name = source.address ? "the database" : source.file || known;
  const timezone = el("input", { type: "text", id: "telemetry-timezone", list: "timezones-telemetry", autocomplete: "off", disabled: off(), value: source.timezone ?? page.draft.site.timezone, onchange: set("timezone") });
  return [
    el("p", { class: "soft" }, "A table with one column a point, or one row a reading; names are free. CSV, Excel, Parquet, or a PostgreSQL database."),
    el("div", { class: "row" },
      el("button", { type: "button", id: "telemetry-choose", class: state?.table ? "" : "primary", disabled: off(), onclick: () => file.click() }, "Choose a file…"), file,
      el("span", { class: "soft" }, known ? `now: ${known}` : "or drop one anywhere on this page")),
    el("details", { class: "more" }, el("summary", {}, "Database, sheet, time zone, steps"), el("div", { class: "grid four" },
      field("Database: postgresql://USER:PASSWORD@HOST/NAME (never written down)", el("input", { type: "text", id: "telemetry-address", value: source.address, autocomplete: "off", spellcheck: "false", disabled: off(), onchange: set("address") })),
      field("Sheet, table, or SELECT …; empty: the only one", el("input", { type: "text", id: "telemetry-table", value: source.table, autocomplete: "off", disabled: off(), onchange: set("table") })),
      field("Time zone of stamps without offset", timezone),
      field("Steps to average over", choice(STEPS, source.step, { id: "telemetry-step", disabled: off(), onchange: set("step") })),
      el("button", { type: "button", id: "telemetry-read", disabled: off() || !(source.address || name), onclick: () => { if (!source.file) source.file = known; work("Reading", look); } }, name ? `Read ${name}` : "Read"))),
    now.trouble && el("p", { class: "message", role: "alert" }, told(now.trouble)),
    now.working && el("div", { class: "working" }, el("p", { id: "telemetry-working", role: "status", "aria-live": "polite" }, now.working), el("progress")),
  ];
}

// Whether what the case has is of the table that was read last.
const isTaken = () => Boolean(now.check?.points.length) && now.state?.taken?.where === now.state?.table?.where;

const lists = () => [
  el("datalist", { id: "telemetry-entities" }, (now.state?.entities || []).map((name) => el("option", { value: name }))),
  el("datalist", { id: "telemetry-points" }, Object.keys(now.state?.points || {}).map((name) => el("option", { value: name }))),
  el("datalist", { id: "timezones-telemetry" }, (Intl.supportedValuesOf?.("timeZone") || []).map((zone) => el("option", { value: zone }))),
];

const pictureOf = (of) => now.picked?.of === of && (now.picked.plot ? figure(now.picked.plot, now.picked.column) : el("p", { class: "soft" }, "Drawing…"));

const isOut = (row) => Boolean(row.remark), isOpen = (row) => isOut(row) || row.confidence < SURE;

// A list with a search, a choice of rows and a picture of the one that is picked.
function rowsPart(of, rows, filters, head, rowOf) {
  const words = now.search.toLowerCase().split(/\s+/).filter(Boolean), test = filters.find(([key]) => key === now.filter) || filters[0];
  const listed = rows.filter((row) => test[2](row) && words.every((word) => `${row.column} ${row.entity} ${row.point}`.toLowerCase().includes(word)));
  return [
    el("div", { class: "row" },
      el("input", { type: "search", id: "telemetry-search", placeholder: "Search columns", "aria-label": "Search columns", value: now.search, oninput: (e) => { now.search = e.target.value; draw(); } }),
      choice(filters.map(([key, text, keep]) => [key, `${text} (${rows.filter(keep).length})`]), test[0], { id: "telemetry-filter", "aria-label": "Show", onchange: (e) => { now.filter = e.target.value; draw(); } })),
    pictureOf(of),
    el("div", { class: "scroll" }, el("table", { class: "columns" }, el("thead", {}, el("tr", {}, head.map((text) => el("th", { scope: "col" }, text)))), el("tbody", {}, listed.slice(0, MOST).map(rowOf)))),
    listed.length > MOST && el("p", { class: "soft" }, `and ${listed.length - MOST} more: search for them`),
  ];
}

const nameCell = (row, of) => el("th", { scope: "row" }, el("button", { type: "button", class: "link", title: "Show it large", onclick: () => pick(row.column, of) }, row.column));

function tablePart() {
  const table = now.state?.table;
  if (!table) return null;
  const rows = [...table.columns].sort((a, b) => isOut(b) - isOut(a) || a.confidence - b.confidence), used = rows.filter((row) => !isOut(row)).length;
  const cell = (row, key, list) => el("td", {}, el("input", { type: "text", id: `${key} ${row.column}`, value: row[key], list, disabled: off(), autocomplete: "off", "aria-label": `${key} of ${row.column}`, onchange: (e) => correct(row.column, { [key]: e.target.value.trim() }) }));
  const rowOf = (row) => el("tr", { class: isOut(row) ? "out" : "" }, nameCell(row, "table"), el("td", {}, spark(row)), cell(row, "entity", "telemetry-entities"), cell(row, "point", "telemetry-points"),
    el("td", {}, el("input", { type: "text", class: "unit", id: `unit ${row.column}`, value: row.unit, placeholder: now.state.points[row.point] || "", disabled: off(), "aria-label": `Unit of ${row.column}`, onchange: (e) => correct(row.column, { unit: e.target.value.trim() }) })),
    el("td", { class: "soft" }, row.remark ? `${row.remark === "left out" ? "" : "left out: "}${row.remark}${row.heat ? " – but it tells of heat" : ""}` : row.confidence === 1 ? "sure" : `${Math.round(100 * row.confidence)} % alike`),
    el("td", {}, isOut(row) ? row.entity && row.point && el("button", { type: "button", disabled: off(), "aria-label": `Take ${row.column} for that`, onclick: () => correct(row.column, {}) }, "Take it") : el("button", { type: "button", disabled: off(), "aria-label": `Leave ${row.column} out`, onclick: () => correct(row.column, { entity: "", point: "" }) }, "Leave out")));
  const title = `${table.where}: ${used} of ${rows.length} columns are matched`;
  const box = isTaken() ? el("details", { open: now.open, ontoggle: (e) => { now.open = e.target.open; } }, el("summary", { id: "telemetry-again" }, `${title}; change that`)) : el("section", {}, el("h3", {}, title));
  box.append(
    el("p", { class: "soft" }, `${table.start.slice(0, 16).replace("T", " ")} to ${table.end.slice(0, 16).replace("T", " ")} UTC. What each column was taken for stands beside its picture; correct it, or leave it out. Units: as written, else of the column's name, else the one in grey.`),
    el("div", { class: "row" }, el("button", { type: "button", id: "telemetry-take", class: "primary", disabled: off() || !used, onclick: take }, `Put ${used} columns into the case`)),
    ...rowsPart("table", rows, [["all", "all columns", () => true], ["open", "worth a look", isOpen], ["out", "left out", isOut]], ["column", "values", "device, zone or station", "point", "unit", "match", ""], rowOf).filter(Boolean));
  return box;
}

function casePart() {
  const check = now.check, taken = now.state?.taken;
  if (!check?.points.length) return now.working || now.state?.table ? null : el("p", { class: "soft pad" }, "The case has no telemetry yet.");
  const odd = new Set(check.anomalies.flatMap((a) => a.columns)), worst = check.anomalies.filter((a) => a.severity !== "remark");
  const isOdd = (row) => odd.has(row.column) || Object.keys(row.flaws).length > 0, notes = check.anomalies.length - worst.length;
  const points = [...check.points].sort((a, b) => isOdd(b) - isOdd(a));
  const found = [worst.length ? `${worst.length} ${worst.length > 1 ? "findings are" : "finding is"} worth a look` : "", notes ? `${notes} ${notes > 1 ? "notes on single points stand" : "note on a single point stands"} first in the list below` : ""];
  const heard = taken?.file === page.telemetry ? [`from ${taken.where}${taken.left_out ? `, ${taken.left_out} columns left out` : ""}`, ...taken.remarks, ...(taken.unmatched_heat.length ? [`left out, though they tell of heat: ${taken.unmatched_heat.join(", ")}`] : [])] : [];
  const rowOf = (row) => el("tr", {}, nameCell(row, "case"), el("td", {}, spark(row)), el("td", {}, row.meaning), el("td", { class: "n" }, row.lowest === null ? "–" : `${short(shown(row.lowest, row.unit))} to ${short(shown(row.highest, row.unit))} ${unitOf(row.unit)}`),
    el("td", { class: "n" }, `${Math.floor(1000 * row.usable_share) / 10} %`), el("td", { class: "soft" }, [...Object.entries(row.flaws).map(([kind, n]) => `${n} × ${kind}`), ...check.anomalies.filter((a) => a.columns.includes(row.column)).map((a) => told(a.what))].join("; ")));
  return el("section", {},
    el("h3", {}, `In the case: ${check.points.length} points, ${check.start.slice(0, 10)} to ${check.end.slice(0, 10)}, every ${check.step / 60} minutes`),
    el("p", { class: check.fit ? "" : "message", id: "telemetry-verdict" }, check.fit ? `${["Nothing speaks against a calibration", ...found].filter(Boolean).join("; ")}.` : "A calibration makes no sense with this telemetry:"),
    worst.length > 0 && el("ul", { class: "findings" }, worst.slice(0, 40).map((a) => el("li", { class: a.severity === "error" ? "error" : "remark" }, el("button", { type: "button", onclick: () => a.columns[0] && pick(a.columns[0], "case") }, el("strong", {}, a.kind), el("span", {}, told(`${a.what} (${a.certainty}); ${a.advice}`)))))),
    (heard.length > 0 || check.remarks.length > 0) && el("details", {}, el("summary", {}, `${heard.length + check.remarks.length} remarks`), el("ul", {}, [...heard, ...check.remarks].map((text) => el("li", {}, told(text))))),
    el("div", { class: "row" }, ["calibrate", "diagnose"].filter((kind) => page.reports.includes(kind)).map((kind) => el("button", { type: "button", id: `telemetry-${kind}`, class: now.state?.table && !isTaken() ? "" : "primary", disabled: now.working !== "" || !check.fit, onclick: async () => { await openReports(); await makeReport(kind); } }, `${kind === "calibrate" ? "Calibrate" : "Diagnose"} now`))),
    rowsPart("case", points, [["all", "all points", () => true], ["odd", "with findings", isOdd]], ["point", "values", "what it is", "range", "usable", "found"], rowOf));
}
