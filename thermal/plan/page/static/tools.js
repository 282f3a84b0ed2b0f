// Tools on the plan, by pointer and by keyboard: select, place, wall, split, erase, room, new zone.

import { FIRST_ZONE, at, line, snapZone } from "./grid.js";
import * as edits from "./edits.js";
import { el, byId, toast } from "./dom.js";
import { floorOf, page, select, tell } from "./store.js";
import * as view from "./plan.js";

const svg = view.plan;
export const TOOLS = [
  ["select", "V", "Select", "M5 3l12 9-6 1-3 6z", "Click a zone or a device; Shift+click for several; drag devices into rooms."],
  ["place", "P", "Place next", "M12 21s6-6 6-11a6 6 0 1 0-12 0c0 5 6 11 6 11zM12 7v6M9 10h6", "Click the room of the device that is next."],
  ["wall", "W", "Wall", "M3 8h18v8H3zM9 8v8M15 8v8", "Drag a wall; Shift for any direction. A zone that it parts becomes two."],
  ["split", "X", "Split zone", "M4 5h16v14H4zM12 2v20", "Drag a line across a zone: it is split from wall to wall."],
  ["erase", "E", "Erase wall", "M14 4l6 6-9 9H6l-3-3zM9 9l6 6M11 19h10", "Drag over walls to take them away."],
  ["room", "R", "Room", "M4 6h16v12H4zM4 12h0", "Drag a rectangle: walls around a new zone."],
  ["fill", "F", "New zone", "M5 5h14v14H5zM9 12h6M12 9v6", "Click an enclosed white place to make it a zone."],
];
const DRAWN = new Set(["wall", "split", "erase", "room"]);

export const tool = { name: "select", snap: true, takeNames: false, skipped: new Set() };
let stroke = null, cursor = null, spaceDown = false;

export function choose(name) {
  if (page.mode !== "edit" && name !== "select") { tell("refused"); return; }
  tool.name = name;
  stroke = null;
  cursor = null;
  view.preview(null);
  if (name === "place") { tool.skipped.clear(); if (!nextDevice()) { toast("No device is left to place."); tool.name = "select"; } }
  svg.dataset.tool = tool.name;
  tell("tool");
}

export function nextDevice() {
  const left = edits.left().filter((d) => !tool.skipped.has(d.name));
  const chosen = left.find((d) => page.selection.devices.includes(d.name));
  return chosen || left[0] || null;
}

export function skipDevice() {
  const device = nextDevice();
  if (device) tool.skipped.add(device.name);
  select({});
  if (!nextDevice()) choose("select");
  tell("tool");
}

function place(zone) {
  const device = nextDevice();
  if (!device) { choose("select"); return; }
  if (!zone) { toast("No zone here: click inside a room.", "error"); return; }
  edits.placeInto(device.name, zone, tool.takeNames);
  byId("hint").textContent = `${device.name} is in ${zone}.`;
  if (!nextDevice()) { toast("All devices are placed."); choose("select"); }
  tell("tool");
}

const cellOf = (event) => view.toCell(event).reverse().map(Math.floor);

function strokePlaces(end, free) {
  const { start, places } = stroke;
  if (tool.name === "erase") return places;
  if (tool.name === "room") {
    const found = [];
    const [top, bottom] = [start[0], end[0]].sort((a, b) => a - b), [left, right] = [start[1], end[1]].sort((a, b) => a - b);
    for (let r = top; r <= bottom; r++) for (let c = left; c <= right; c++) if (r === top || r === bottom || c === left || c === right) found.push([r, c]);
    return found;
  }
  return line(start, end, free && tool.name === "wall");
}

function finish(end, free) {
  const places = strokePlaces(end, free), { start } = stroke;
  stroke = null;
  cursor = cursor && end;
  view.preview(cursor ? [cursor] : null, "cursor");
  if (tool.name === "wall") edits.wall(places);
  if (tool.name === "split") edits.split(start, end);
  if (tool.name === "erase") edits.erase(places);
  if (tool.name === "room") edits.room(start, end);
}

function extend(end, free) {
  if (tool.name === "erase") stroke.places.push(...line(stroke.places[stroke.places.length - 1], end, true).slice(1));
  view.preview(strokePlaces(end, free), tool.name);
}

function down(event) {
  if (event.button === 1 || spaceDown || (event.button === 0 && event.altKey)) { startPan(event); return; }
  if (event.button !== 0 || !floorOf()) return;
  const [row, column] = cellOf(event), device = event.target.closest(".device")?.dataset.device;
  if (tool.name !== "select" && page.mode !== "edit") { tell("refused"); return; }
  if (DRAWN.has(tool.name)) {
    stroke = { start: [row, column], places: [[row, column]] };
    svg.setPointerCapture(event.pointerId);
    extend([row, column], event.shiftKey);
  } else if (tool.name === "fill") edits.fill(row, column);
  else if (tool.name === "place") place(snapZone(floorOf(), ...view.toCell(event)));
  else if (device) startDrag(event, device);
  else pick(event, snapZone(floorOf(), ...view.toCell(event), 0));
  event.preventDefault();
  svg.focus({ preventScroll: true });
}

function pick(event, zone) {
  const add = event.shiftKey || event.ctrlKey || event.metaKey;
  if (!zone) { if (!add) select({}); startPan(event); return; }
  const now = page.selection.zones;
  const zones = add ? (now.includes(zone) ? now.filter((z) => z !== zone) : [...now, zone]) : [zone];
  select({ zones });
  view.focusZone(zone);
}

function follow(event, moved, done) {
  svg.setPointerCapture(event.pointerId);
  const end = (last) => {
    svg.removeEventListener("pointermove", moved);
    svg.removeEventListener("pointerup", end);
    svg.removeEventListener("pointercancel", end);
    done(last);
  };
  svg.addEventListener("pointermove", moved);
  svg.addEventListener("pointerup", end);
  svg.addEventListener("pointercancel", end);
}

function startPan(event) {
  let last = [event.clientX, event.clientY];
  svg.classList.add("panning");
  event.preventDefault();
  follow(event, (e) => { view.pan(e.clientX - last[0], e.clientY - last[1]); last = [e.clientX, e.clientY]; }, () => svg.classList.remove("panning"));
}

function startDrag(event, name) {
  const add = event.shiftKey || event.ctrlKey || event.metaKey, now = page.selection.devices;
  select({ devices: add ? [...new Set([...now, name])] : now.includes(name) ? now : [name] });
  if (page.mode !== "edit") return;
  const start = [event.clientX, event.clientY];
  let moved = false;
  follow(event, (e) => {
    moved ||= Math.hypot(e.clientX - start[0], e.clientY - start[1]) > 4;
    if (moved) view.moveDevice(name, ...view.toCell(e));
  }, (e) => { if (moved && (e.type !== "pointerup" || !edits.drop(name, ...view.toCell(e), tool.snap))) view.render(); });
}

svg.addEventListener("pointerdown", down);
svg.addEventListener("pointermove", (event) => { if (stroke && !cursor) extend(cellOf(event), event.shiftKey); });
svg.addEventListener("pointerup", (event) => { if (stroke && !cursor) finish(cellOf(event), event.shiftKey); });
svg.addEventListener("pointercancel", () => { stroke = null; view.preview(null); });
svg.addEventListener("wheel", (event) => {
  event.preventDefault();
  const [x, y] = view.toCell(event);
  view.zoomAt(x, y, Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0016)));
}, { passive: false });
svg.addEventListener("contextmenu", (event) => event.preventDefault());

// Devices may also be dragged from the list onto the plan.
svg.addEventListener("dragover", (event) => { if (event.dataTransfer.types.includes("text/device")) event.preventDefault(); });
svg.addEventListener("drop", (event) => {
  const name = event.dataTransfer.getData("text/device");
  if (!name) return;
  event.preventDefault();
  event.stopPropagation();
  edits.drop(name, ...view.toCell(event), tool.snap);
});

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function arrow(event) {
  const [dx, dy] = ARROWS[event.key];
  if (DRAWN.has(tool.name) || tool.name === "fill") {
    const floor = floorOf(), far = event.shiftKey ? 5 : 1;
    cursor = cursor ? [cursor[0] + dy * far, cursor[1] + dx * far] : [Math.floor(floor.rows / 2), Math.floor(floor.columns / 2)];
    cursor = [Math.min(floor.rows - 1, Math.max(0, cursor[0])), Math.min(floor.columns - 1, Math.max(0, cursor[1]))];
    if (stroke) extend(cursor, false); else view.preview([cursor], "cursor");
    const what = at(floor, ...cursor);
    byId("hint").textContent = `Row ${cursor[0] + 1}, column ${cursor[1] + 1}: ${["outside", "exterior wall", "interior wall"][what] || floor.legend[what]}`;
    return;
  }
  const next = view.neighbour(view.focusedZone() || page.selection.zones[0], [dx, dy]);
  if (next) { view.focusZone(next); if (tool.name === "select" && !event.shiftKey) select({ zones: [next] }); view.focusZone(next); }
}

function enter() {
  if (tool.name === "place") { place(view.focusedZone()); return; }
  if (tool.name === "fill" && cursor) { edits.fill(...cursor); return; }
  if (DRAWN.has(tool.name)) {
    if (!cursor) { arrow({ key: "ArrowUp" }); return; }
    if (stroke) finish(cursor, false);
    else { stroke = { start: cursor, places: [cursor] }; extend(cursor, false); }
    return;
  }
  const zone = view.focusedZone();
  if (zone) { select({ zones: [zone] }); tell({ show: "selection" }); }
}

// Keys on the plan; true when one was meant for it.
export function planKey(event) {
  if (ARROWS[event.key]) { arrow(event); return true; }
  if (event.key === "Enter" || (event.key === " " && view.focusedZone())) {
    const zone = view.focusedZone();
    if (event.key === " " && tool.name === "select") {
      const now = page.selection.zones;
      select({ zones: now.includes(zone) ? now.filter((z) => z !== zone) : [...now, zone] });
    } else enter();
    return true;
  }
  return false;
}

export function escape() {
  if (stroke) { stroke = null; view.preview(cursor ? [cursor] : null, "cursor"); return; }
  if (tool.name !== "select") choose("select");
  else select({});
}

export function holdSpace(held) {
  spaceDown = held;
  svg.classList.toggle("grab", held);
}

function icon(path) {
  return view.make("svg", { viewBox: "0 0 24 24" }, view.make("path", { d: path }));
}

export function drawToolbar() {
  const bar = byId("tools"), actions = [
    ["merge", "M", "Merge zones", "M3 6h8v12H3M21 6h-8v12h8M8 12h8M10 10l-2 2 2 2M14 10l2 2-2 2", () => edits.merge(), () => page.selection.zones.length > 1],
    ["delete", "Delete", "Remove", "M4 7h16M9 7V4h6v3M6 7l1 13h10l1-13", removeSelected, () => page.selection.zones.length + page.selection.devices.length > 0],
  ];
  const focused = bar.contains(document.activeElement) ? document.activeElement.id : "";
  const button = (id, keys, name, sign, act, pressed, disabled) => el("button", {
    type: "button", id, title: `${name} (${keys})`, "aria-keyshortcuts": keys, "aria-pressed": pressed, disabled, onclick: act, tabindex: "-1",
  }, el("span", { class: "sign", "aria-hidden": "true" }, icon(sign)), el("span", { class: "word" }, name), el("kbd", { "aria-hidden": "true" }, keys === "Delete" ? "Del" : keys));
  bar.replaceChildren(
    ...TOOLS.map(([id, keys, name, sign]) => button(`tool-${id}`, keys, name, sign, () => choose(id), String(tool.name === id), page.mode !== "edit" && id !== "select")),
    el("hr"),
    ...actions.map(([id, keys, name, sign, act, able]) => button(`act-${id}`, keys, name, sign, act, null, page.mode !== "edit" || !able())),
  );
  const first = bar.querySelector(`#${focused || `tool-${tool.name}`}`) || bar.firstChild;
  first.setAttribute("tabindex", "0");
  if (focused) first.focus();
}

byId("tools").addEventListener("keydown", (event) => {
  const buttons = [...byId("tools").querySelectorAll("button:not([disabled])")], now = buttons.indexOf(document.activeElement);
  const by = { ArrowDown: 1, ArrowUp: -1, ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!by || now < 0) return;
  event.preventDefault();
  event.stopPropagation();
  buttons[(now + by + buttons.length) % buttons.length].focus();
});

export function removeSelected() {
  const { zones, devices } = page.selection;
  if (devices.length) edits.dropDevices(devices);
  else if (zones.length) edits.dropZones(zones.filter((zone) => floorOf().legend.indexOf(zone) >= FIRST_ZONE));
}
