// The plan on the screen: drawing, zones, walls, labels, devices, as SVG whose unit is a cell.

import { address } from "./api.js";
import { EXTERIOR, INTERIOR } from "./grid.js";
import { measure, trace } from "./shapes.js";
import { floorOf, page } from "./store.js";
import { measured, typed, unitOf } from "./units.js";

const NS = "http://www.w3.org/2000/svg";
const LETTERS = { vav: "V", fan_coil: "F", electric_heater: "E", radiator: "R", supply_air_terminal: "S", ahu: "A", boiler: "B", chiller: "C" };
const svg = document.getElementById("plan");
const layers = {};
const shown = { floor: null, measured: new Map(), places: new Map() };
const view = { x: 0, y: 0, scale: 8, touched: false }; // left, top [cells], pixels a cell, whether somebody has chosen it

export const plan = svg;
export const zonesShown = () => shown.measured;
export const deviceLetter = (type) => LETTERS[type] || (type[0] || "?").toUpperCase();

export function make(tag, attributes = {}, ...children) {
  const element = document.createElementNS(NS, tag);
  for (const [name, value] of Object.entries(attributes)) if (value !== null && value !== undefined) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

for (const name of ["picture", "zones", "walls", "devices", "preview"]) {
  layers[name] = make("g", { class: `layer-${name}` });
  svg.append(layers[name]);
}

export function toCell(event) {
  const box = svg.getBoundingClientRect();
  return [view.x + (event.clientX - box.left) / view.scale, view.y + (event.clientY - box.top) / view.scale];
}

export function toScreen(x, y) {
  const box = svg.getBoundingClientRect();
  return [box.left + (x - view.x) * view.scale, box.top + (y - view.y) * view.scale];
}

export const pixelsPerCell = () => view.scale;

export function applyView() {
  const box = svg.getBoundingClientRect();
  svg.setAttribute("viewBox", `${view.x} ${view.y} ${Math.max(box.width, 1) / view.scale} ${Math.max(box.height, 1) / view.scale}`);
  svg.style.setProperty("--cell", view.scale);
  svg.classList.toggle("far", view.scale < 5);
  const bar = document.getElementById("scalebar");
  const wide = (length) => (typed(length, "m") / page.draft.cell_size) * view.scale; // pixels
  if (page.draft) {
    const length = [200, 100, 50, 20, 10, 5, 2, 1, 0.5].find((m) => wide(m) < 140) || 0.5;
    bar.style.width = `${wide(length)}px`;
    bar.textContent = `${length} ${unitOf("m")}`;
  }
}

export function zoomAt(x, y, factor) {
  const scale = Math.min(200, Math.max(0.5, view.scale * factor));
  view.x = x - ((x - view.x) * view.scale) / scale;
  view.y = y - ((y - view.y) * view.scale) / scale;
  view.scale = scale;
  view.touched = true;
  applyView();
}

export function zoom(factor) {
  const box = svg.getBoundingClientRect();
  zoomAt(view.x + box.width / 2 / view.scale, view.y + box.height / 2 / view.scale, factor);
}

export function pan(dx, dy) {
  view.x -= dx / view.scale;
  view.y -= dy / view.scale;
  view.touched = true;
  applyView();
}

export function fit() {
  const floor = floorOf(), box = svg.getBoundingClientRect();
  if (!floor || !floor.rows || !box.width) return;
  const bounds = [...shown.measured.values()].reduce(
    (b, z) => [Math.min(b[0], z.left), Math.min(b[1], z.top), Math.max(b[2], z.right + 1), Math.max(b[3], z.bottom + 1)],
    [Infinity, Infinity, -Infinity, -Infinity],
  );
  const [left, top, right, bottom] = bounds[0] < Infinity ? bounds.map((b, k) => b + (k < 2 ? -2 : 2)) : [0, 0, floor.columns, floor.rows];
  const above = 54, below = 60; // px that the line of the next device and the view's buttons need
  view.scale = Math.max(0.5, Math.min(box.width / (right - left), (box.height - above - below) / (bottom - top)));
  view.x = (left + right) / 2 - box.width / 2 / view.scale;
  view.y = (top + bottom) / 2 - (above + (box.height - above - below) / 2) / view.scale;
  view.touched = false;
  applyView();
}

// Bring a zone into sight.
export function reveal(zone) {
  const place = shown.measured.get(zone), box = svg.getBoundingClientRect();
  if (!place) return;
  const [width, height] = [box.width / view.scale, box.height / view.scale];
  const seen = place.x > view.x + 2 && place.x < view.x + width - 2 && place.y > view.y + 2 && place.y < view.y + height - 2;
  if (!seen) {
    view.x = place.x - width / 2;
    view.y = place.y - height / 2;
    applyView();
  }
}

function hue(name) {
  let sum = 7;
  for (const sign of name) sum = (sum * 31 + sign.codePointAt(0)) >>> 0;
  return Math.round(((sum * 0.381966) % 1) * 360);
}

function drawPicture(floor) {
  layers.picture.replaceChildren();
  if (!floor?.picture) return;
  const { file, width, height, matrix } = floor.picture;
  const href = address(`api/pictures/${encodeURIComponent(file)}`);
  layers.picture.append(make("image", { href, width, height, transform: `matrix(${matrix.join(" ")})`, preserveAspectRatio: "none" }));
}

function drawZones(floor) {
  const paths = trace(floor), old = new Map([...layers.zones.children].map((g) => [g.dataset.zone, g]));
  for (const [name, place] of shown.measured) {
    let group = old.get(name);
    if (!group) {
      group = make("g", { class: "zone", role: "button", tabindex: "-1", "data-zone": name });
      group.style.setProperty("--hue", hue(name));
      group.append(make("path", { class: "fill" }), make("path", { class: "edge" }), make("text", { class: "name" }), " ", make("text", { class: "area" }));
      layers.zones.append(group);
    }
    old.delete(name);
    const [fill, edge, title, area] = group.children;
    fill.setAttribute("d", paths.fills.get(place.number) || "");
    edge.setAttribute("d", paths.lines.get(place.number) || "");
    const wide = (place.span * 0.9) / (0.62 * name.length), half = Math.max(0.5, place.depth - 0.5);
    const inRows = Math.min(1.9, wide, half * 0.62), inLine = Math.min(1.9, wide * 0.85, half * 1.1);
    place.narrow = inRows < 0.7 * inLine; // the name alone, and devices beside it
    const size = place.size = Math.max(0.35, place.narrow ? inLine : inRows);
    title.textContent = name;
    area.toggleAttribute("hidden", place.narrow);
    for (const [text, down, share] of [[title, place.narrow ? 0.35 : -0.55, 1], [area, 0.25, 0.72]]) {
      text.setAttribute("x", place.x);
      text.setAttribute("y", place.y + down * size);
      text.setAttribute("font-size", size * share);
      if (place.upright) text.setAttribute("transform", `rotate(-90 ${place.x} ${place.y})`); else text.removeAttribute("transform");
    }
  }
  for (const group of old.values()) group.remove();
  layers.walls.replaceChildren(
    make("path", { class: "wall interior", d: paths.fills.get(INTERIOR) || "" }),
    make("path", { class: "wall exterior", d: paths.fills.get(EXTERIOR) || "" }),
  );
}

// Where each device of the floor stands: where it was put, or in a row below the name of its zone.
function placeDevices(floor) {
  shown.places.clear();
  const rows = new Map();
  for (const device of page.draft.devices) {
    const zone = device.zone && shown.measured.get(device.zone);
    if (device.x !== null && device.floor === floor.name) shown.places.set(device.name, [device.x, device.y, zone?.size || 1.2]);
    else if (zone && device.x === null) rows.set(device.zone, [...(rows.get(device.zone) || []), device.name]);
  }
  for (const [name, devices] of rows) {
    const zone = shown.measured.get(name), size = Math.min(zone.size, 1.4), step = size * 1.7;
    const beside = 0.31 * name.length * zone.size + 1.1 * size; // in a corridor: behind its name
    devices.forEach((device, k) => {
      const along = zone.narrow ? beside + k * step : (k - (devices.length - 1) / 2) * step, down = zone.narrow ? 0 : 0.45 * zone.size + 0.75 * size;
      shown.places.set(device, zone.upright ? [zone.x + down, zone.y + along, size] : [zone.x + along, zone.y + down, size]);
    });
  }
}

function drawDevices(floor) {
  placeDevices(floor);
  const old = new Map([...layers.devices.children].map((g) => [g.dataset.device, g]));
  for (const device of page.draft.devices) {
    const place = shown.places.get(device.name);
    if (!place) continue;
    let group = old.get(device.name);
    if (!group) {
      group = make("g", { class: "device", role: "button", tabindex: "-1", "data-device": device.name }, make("title"), make("rect"), make("text"));
      layers.devices.append(group);
    }
    old.delete(device.name);
    const size = Math.min(1.5, Math.max(0.5, place[2]));
    group.setAttribute("transform", `translate(${place[0]} ${place[1]}) scale(${size})`);
    const [title, rect, text] = group.children;
    title.textContent = `${device.name} (${device.type})`;
    for (const [key, value] of Object.entries({ x: -0.7, y: -0.62, width: 1.4, height: 1.24, rx: 0.32 })) rect.setAttribute(key, value);
    text.textContent = deviceLetter(device.type);
    text.setAttribute("y", 0.34);
    group.setAttribute("aria-label", `${device.name}, ${device.type}, ${device.zone ? `zone ${device.zone}` : "no zone"}`);
  }
  for (const group of old.values()) group.remove();
}

export function mark() {
  const served = new Map();
  for (const device of page.draft.devices) if (device.zone) served.set(device.zone, (served.get(device.zone) || 0) + 1);
  const wrong = new Map();
  for (const f of page.findings) if (f.level === "error") wrong.set(`${f.kind}:${f.name}`, f.message);
  for (const group of layers.zones.children) {
    const name = group.dataset.zone, area = page.zones[name]?.area ?? (shown.measured.get(name)?.cells || 0) * page.draft.cell_size ** 2;
    const trouble = wrong.get(`zone:${name}`);
    group.classList.toggle("served", served.has(name));
    group.classList.toggle("selected", page.selection.zones.includes(name));
    group.classList.toggle("wrong", Boolean(trouble));
    group.children[3].textContent = measured(area, "m²");
    const count = served.get(name) || 0;
    group.setAttribute("aria-label", `${name} ${measured(area, "m²")}, zone with ${count || "no"} device${count === 1 ? "" : "s"}${trouble ? `. Error: ${trouble}` : ""}`);
    group.setAttribute("aria-pressed", page.selection.zones.includes(name));
  }
  for (const group of layers.devices.children) {
    group.classList.toggle("selected", page.selection.devices.includes(group.dataset.device));
    group.classList.toggle("wrong", wrong.has(`device:${group.dataset.device}`));
  }
}

export function render() {
  const floor = floorOf();
  if (!floor) {
    for (const layer of Object.values(layers)) layer.replaceChildren();
    shown.floor = null;
    shown.measured = new Map();
    return;
  }
  if (floor !== shown.floor) {
    const other = shown.floor?.picture?.file !== floor.picture?.file || shown.floor?.picture?.matrix?.join() !== floor.picture?.matrix?.join();
    const fresh = !shown.floor || shown.floor.rows !== floor.rows || shown.floor.columns !== floor.columns;
    shown.measured = measure(floor);
    if (other || !shown.floor) drawPicture(floor);
    drawZones(floor);
    shown.floor = floor;
    if (fresh) fit();
    svg.classList.toggle("plain", !floor.picture);
  }
  drawDevices(floor);
  mark();
}

// What is about to be drawn, as cells.
export function preview(places, kind = "wall") {
  layers.preview.replaceChildren();
  if (!places?.length) return;
  const d = places.map(([r, c]) => `M${c} ${r}h1v1h-1z`).join("");
  layers.preview.append(make("path", { class: `preview ${kind}`, d }));
}

export function focusZone(name) {
  const group = [...layers.zones.children].find((g) => g.dataset.zone === name);
  for (const g of layers.zones.children) g.setAttribute("tabindex", g === group ? "0" : "-1");
  group?.focus({ preventScroll: true });
  if (group) reveal(name);
  return group;
}

export const focusedZone = () => document.activeElement?.closest?.(".zone")?.dataset.zone || null;
export const devicePlace = (name) => shown.places.get(name);
export const moveDevice = (name, x, y) => {
  const group = [...layers.devices.children].find((g) => g.dataset.device === name);
  group?.setAttribute("transform", `translate(${x} ${y}) scale(${Math.min(1.5, Math.max(0.5, shown.places.get(name)?.[2] || 1))})`);
};

// The zone nearest to another in a direction, for the arrow keys.
export function neighbour(name, [dx, dy]) {
  const from = shown.measured.get(name);
  let best = null, least = Infinity;
  for (const [other, place] of shown.measured) {
    if (!from) return other;
    const along = (place.x - from.x) * dx + (place.y - from.y) * dy, across = Math.abs((place.x - from.x) * dy) + Math.abs((place.y - from.y) * dx);
    if (other === name || along <= 0.5) continue;
    const distance = along + 2.2 * across;
    if (distance < least) [best, least] = [other, distance];
  }
  return best;
}

new ResizeObserver(() => (view.touched ? applyView() : fit())).observe(svg);
