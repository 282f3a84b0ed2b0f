// The page: starts, listens, keeps its parts up to date.

import * as api from "./api.js";
import { arrowTabs, byId, closeDialog, el, openDialog, toast } from "./dom.js";
import * as edits from "./edits.js";
import { importFiles, openImport } from "./importer.js";
import { renderPanels, showTab } from "./panels.js";
import * as view from "./plan.js";
import { openReports, resume } from "./reports.js";
import * as store from "./store.js";
import { openTelemetry } from "./telemetry.js";
import { TOOLS, choose, drawToolbar, escape, holdSpace, nextDevice, planKey, removeSelected, skipDevice, tool } from "./tools.js";
import * as units from "./units.js";

const { page } = store;

function renderHeader() {
  const devices = page.draft.devices, left = edits.left().length, errors = page.findings.filter((f) => f.level === "error").length;
  const done = devices.length - left;
  byId("title").textContent = page.draft.name || "untitled";
  document.title = `${left ? `${left} left – ` : ""}${page.draft.name} – labelling`;
  byId("bar").style.width = `${devices.length ? (100 * done) / devices.length : 0}%`;
  const words = devices.length ? (left ? `${left} of ${devices.length} devices left` : `all ${devices.length} devices placed`) : "no devices yet";
  byId("left").textContent = `${words}${errors ? ` · ${errors} problem${errors > 1 ? "s" : ""}` : ""}`;
  byId("count-devices").textContent = left || "";
  byId("count-problems").textContent = errors || "";
  byId("undo").disabled = page.mode !== "edit" || !store.canUndo();
  byId("redo").disabled = page.mode !== "edit" || !store.canRedo();
  byId("undo").title = `Undo ${store.canUndo()} (Ctrl+Z)`;
  byId("redo").title = `Redo ${store.canRedo()} (Ctrl+Shift+Z)`;
  byId("import").disabled = page.mode !== "edit";
}

function renderSaved() {
  const errors = page.findings.some((f) => f.level === "error");
  const words = {
    saved: errors || !page.written ? "Draft saved · not a valid case yet" : "Saved · valid case", saving: "Saving…", waiting: "Saving…", trouble: "Not saved – trying again",
  };
  const pill = byId("saved"), text = page.mode === "read" ? "Read only" : words[page.saved];
  if (pill.textContent !== text) pill.textContent = text;
  pill.className = `pill ${page.mode === "read" ? "read" : page.saved === "trouble" ? "bad" : page.saved !== "saved" ? "busy" : errors || !page.written ? "open" : "good"}`;
}

function renderUnits() {
  const feet = units.chosen() === "ip";
  byId("units").textContent = feet ? "m, °C" : "ft, °F";
  byId("units").title = feet ? "Show and type in SI units" : "Show and type in inch-pound units; the case stays in SI units";
}

async function turnUnits() {
  try {
    await units.turn();
  } catch (error) {
    toast(`${error.refusal || error.name}: ${error.message}`, "error");
  }
  renderUnits();
  view.applyView();
  store.tell("all");
}

function renderClock() {
  const minutes = Math.floor(store.workSeconds() / 60), seconds = Math.floor(store.workSeconds() % 60);
  byId("clock").textContent = `${minutes}:${String(seconds).padStart(2, "0")}`;
}

function renderFloors() {
  const list = byId("floors");
  const tabs = page.draft.floors.map((floor, k) => el("button", {
    role: "tab", id: `floor-${k}`, type: "button", "aria-selected": String(k === page.floor), tabindex: k === page.floor ? "0" : "-1", onclick: () => goFloor(k),
  }, floor.name || "unnamed"));
  list.replaceChildren(...tabs);
  byId("add-floor").disabled = page.mode !== "edit";
  byId("empty").hidden = page.draft.floors.length > 0;
}

export function goFloor(k) {
  if (!page.draft.floors[k]) return;
  page.floor = k;
  store.tell("all");
}

function renderPlacing() {
  const box = byId("placing"), device = tool.name === "place" ? nextDevice() : null;
  box.hidden = !device;
  byId("hint").textContent = (page.draft.floors.length && TOOLS.find(([name]) => name === tool.name)?.[4]) || "";
  if (!device) return;
  const zone = device.room ? ` · the list says ${device.room}` : "";
  box.replaceChildren(
    el("strong", {}, device.name), ` ${device.type}${zone} · ${edits.left().length} left `,
    el("button", { type: "button", onclick: skipDevice, title: "Skip (S)" }, "Skip"),
    el("button", { type: "button", onclick: () => choose("select"), title: "Stop (Esc)" }, "Stop"),
    device.room && el("label", {}, el("input", { type: "checkbox", checked: tool.takeNames, onchange: (e) => { tool.takeNames = e.target.checked; view.plan.focus(); } }), " name zones after the list"),
  );
}

function renderAll() {
  document.body.dataset.mode = page.mode;
  renderHeader();
  renderSaved();
  renderClock();
  renderFloors();
  drawToolbar();
  renderPanels();
  view.render();
  renderPlacing();
}

store.listen((what) => {
  if (what === "clock") { renderClock(); return; }
  if (what === "saved") { renderSaved(); return; }
  if (what === "refused") { toast("Read only: another window has this case.", "error"); return; }
  if (what?.trouble) { toast(`${what.trouble.refusal}: ${what.trouble.message}`, "error"); return; }
  if (what?.lost) { showHeld({ lost: what.lost }); return; }
  if (what?.show) { showTab(what.show, true); return; }
  if (what === "selection") { view.mark(); drawToolbar(); renderPlacing(); renderPanels(); return; }
  if (what === "verdict") { renderHeader(); view.mark(); renderPanels("verdict"); return; }
  renderAll();
});

function showHeld(held) {
  const minutes = (s) => (s < 90 ? `${Math.round(s)} s` : `${Math.round(s / 60)} min`);
  const text = held.lost
    ? "Another window has taken this case over. What you did is saved; here it can only be looked at now."
    : `This case is open in another window since ${minutes(held.since)} (last sign of life ${minutes(held.seen)} ago). Only one window may change it.`;
  const banner = byId("banner");
  banner.hidden = false;
  banner.replaceChildren(el("p", {}, text), el("button", { type: "button", id: "take-over", class: "primary", onclick: takeOver }, held.lost ? "Take it back" : "Take over"),
    el("button", { type: "button", id: "read-only", onclick: () => { banner.hidden = true; } }, "Read only"));
  byId("read-only").focus();
}

async function takeOver() {
  await store.open(true);
  byId("banner").hidden = true;
  await store.load();
  toast("This window has the case now.");
}

const KEYS = {
  "?": openHelp, i: () => openImport(), t: () => openTelemetry(), m: () => edits.merge(), "+": () => view.zoom(1.3), "=": () => view.zoom(1.3), "-": () => view.zoom(1 / 1.3), 0: () => view.fit(),
  Delete: removeSelected, Backspace: removeSelected, Escape: escape, n: () => edits.addDevice(), F2: () => store.tell({ show: "selection" }),
  "[": () => goFloor(page.floor - 1), "]": () => goFloor(page.floor + 1), PageDown: () => goFloor(page.floor - 1), PageUp: () => goFloor(page.floor + 1),
};
for (const [name, key] of TOOLS) KEYS[key.toLowerCase()] = () => choose(name);

function onKey(event) {
  const writes = event.target.matches?.("input:not([type=checkbox]):not([type=range]), textarea, select");
  if ((event.ctrlKey || event.metaKey) && !writes && !byId("dialog").open) {
    const key = event.key.toLowerCase();
    const act = key === "z" ? (event.shiftKey ? store.redo : store.undo) : key === "y" ? store.redo : key === "s" ? store.save : null;
    if (act) { event.preventDefault(); Promise.resolve(act()).then((done) => { if (done && key !== "s") byId("hint").textContent = `${key === "y" || event.shiftKey ? "Redone" : "Undone"}: ${done}`; }); }
    return;
  }
  if (writes || byId("dialog").open || event.altKey || event.ctrlKey || event.metaKey) return;
  const onPlan = event.target === view.plan || view.plan.contains(event.target) || event.target === document.body;
  if (onPlan && planKey(event)) { event.preventDefault(); return; }
  if (event.key === " " && onPlan) { holdSpace(true); event.preventDefault(); return; }
  if (event.key.toLowerCase() === "s" && tool.name === "place") { skipDevice(); return; }
  const act = KEYS[event.key] || KEYS[event.key.toLowerCase()];
  if (act && !(event.key === "Escape" && event.target.closest?.("dialog"))) { event.preventDefault(); act(); }
}

function openHelp() {
  const rows = [
    ...TOOLS.map(([, key, name, , text]) => [key, `${name}. ${text}`]),
    ["M", "Merge the selected zones."], ["Del", "Remove the selected devices, or zones (their place becomes outside)."],
    ["Arrow keys", "From zone to zone; with a drawing tool, a cell (Shift: five)."], ["Enter", "Place the device in the focused zone; begin or end a line; show the zone."],
    ["Space", "Add the focused zone to the selection; hold to pan."], ["S", "While placing: skip this device."], ["Esc", "Stop what is being drawn, then the tool, then the selection."],
    ["Ctrl+Z, Ctrl+Shift+Z", "Undo, redo."], ["[ ]", "Floor below, floor above."], ["+ − 0", "Zoom in, out, show all. The wheel zooms too; the middle button pans."],
    ["N", "New device."], ["I", "Import drawings."], ["T", "Telemetry."], ["F2", "Go to the details of what is selected."], ["?", "This list."],
  ];
  openDialog("Keyboard shortcuts", [
    el("table", { class: "keys" }, el("tbody", {}, rows.map(([key, text]) => el("tr", {}, el("th", { scope: "row" }, el("kbd", {}, key)), el("td", {}, text))))),
    el("p", { class: "soft" }, "Everything is saved as you go. The case folder always holds the last state that was a valid case."),
  ]);
}

function wire() {
  byId("undo").onclick = store.undo;
  byId("redo").onclick = store.redo;
  byId("import").onclick = byId("empty-import").onclick = () => openImport();
  byId("add-floor").onclick = () => { edits.addFloor(); renderAll(); };
  byId("empty-draw").onclick = () => { edits.addFloor(); choose("room"); };
  byId("reports").onclick = byId("job").onclick = openReports;
  byId("telemetry").onclick = openTelemetry;
  byId("help").onclick = openHelp;
  byId("theme").onclick = () => {
    const dark = document.documentElement.dataset.theme || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
    localStorage.setItem("buildingmpc-theme", document.documentElement.dataset.theme = dark === "dark" ? "light" : "dark");
  };
  byId("units").onclick = turnUnits;
  byId("zoom-in").onclick = () => view.zoom(1.3);
  byId("zoom-out").onclick = () => view.zoom(1 / 1.3);
  byId("zoom-fit").onclick = () => view.fit();
  byId("opacity").oninput = (event) => view.plan.style.setProperty("--drawing", event.target.value / 100);
  arrowTabs(byId("floors"), (tab) => tab.id.startsWith("floor-") && goFloor(Number(tab.id.slice(6))));
  arrowTabs(byId("tabs"), (tab) => showTab(tab.id.slice(4)));
  for (const tab of byId("tabs").children) tab.onclick = () => showTab(tab.id.slice(4));
  addEventListener("keydown", onKey);
  addEventListener("keyup", (event) => { if (event.key === " ") holdSpace(false); });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => { event.preventDefault(); if (event.dataTransfer.files.length) importFiles([...event.dataTransfer.files]); });
}

async function start() {
  const theme = localStorage.getItem("buildingmpc-theme");
  if (theme) document.documentElement.dataset.theme = theme;
  wire();
  view.plan.dataset.tool = "select";
  try {
    await units.load();
    renderUnits();
    const held = await store.open();
    await store.load();
    if (!held.mine) showHeld(held);
    store.startClocks();
    resume(page.running);
    if (!page.draft.floors.length && held.mine) {
      const { drawings } = await api.get("api/drawings");
      if (drawings.length) openImport();
    }
  } catch (error) {
    byId("saved").textContent = "Cannot start";
    toast(`${error.refusal || error.name}: ${error.message}`, "error");
  }
}

start();
export { closeDialog };
