// What can be done to a building, each as one step that can be undone.

import * as grid from "./grid.js";
import { change, changeFloor, floorOf, page, select } from "./store.js";
import { devicePlace } from "./plan.js";
import { toast } from "./dom.js";

export const PLANT = new Set(["ahu", "boiler", "chiller"]); // serve the building, no zone

export const isLeft = (device) => !device.zone && !PLANT.has(device.type);
export const left = () => page.draft.devices.filter(isLeft);
const without = (table, gone) => Object.fromEntries(Object.entries(table).filter(([zone]) => !gone.has(zone)));

function mapZones(to) {
  const { devices, glazing, airflows } = page.draft, merged = {};
  for (const [zone, sides] of Object.entries(glazing)) {
    const name = to(zone);
    if (name === null) continue;
    merged[name] = { ...merged[name] };
    for (const [side, area] of Object.entries(sides)) merged[name][side] = Math.round(((merged[name][side] || 0) + area) * 100) / 100;
  }
  return {
    devices: devices.map((d) => (d.zone && to(d.zone) !== d.zone ? { ...d, zone: to(d.zone) } : d)),
    glazing: merged,
    airflows: airflows.map((a) => ({ ...a, from: to(a.from), to: to(a.to) })).filter((a) => a.from && a.to && a.from !== a.to),
  };
}

// Devices that were put somewhere go with the part of the zone that they stand in.
function follow(floor, born) {
  const parents = new Set(born.map((b) => b.from).filter(Boolean));
  return page.draft.devices.map((device) => {
    const place = device.floor === floor.name && device.x !== null ? [device.x, device.y] : null;
    if (!place || !parents.has(device.zone)) return device;
    const zone = grid.zoneAt(floor, Math.floor(place[1]), Math.floor(place[0]));
    return zone ? { ...device, zone } : device;
  });
}

function applyDrawn(label, result) {
  changeFloor(label, result.floor, { devices: follow(result.floor, result.born) });
  if (result.born.length) select({ zones: [result.born[0].name] });
}

export function wall(places) {
  const result = grid.drawWall(floorOf(), page.draft.floors, places);
  applyDrawn("draw a wall", result);
  if (result.born.length) toast(`New zone ${result.born.map((b) => b.name).join(", ")}`);
}

export function split(from, to) {
  const result = grid.splitZone(floorOf(), page.draft.floors, from, to);
  if (!result) { toast("Draw the line across a zone, from one of its walls to the other.", "error"); return; }
  applyDrawn("split a zone", result);
  toast(`Split: new zone ${result.born.map((b) => b.name).join(", ")}`);
}

export function erase(places) {
  changeFloor("erase walls", grid.eraseWall(floorOf(), places));
}

export function room(from, to) {
  const result = grid.drawRoom(floorOf(), page.draft.floors, from, to);
  if (!result) { toast("Drag a room of at least one cell within the grid.", "error"); return; }
  applyDrawn("draw a room", result);
}

export function fill(row, column) {
  if (grid.zoneAt(floorOf(), row, column)) { toast("This is a zone already.", "error"); return; }
  const result = grid.fillZone(floorOf(), page.draft.floors, row, column);
  if (!result) { toast("This place is open to the outside: draw walls around it first.", "error"); return; }
  applyDrawn("new zone", result);
}

export function merge(names = page.selection.zones) {
  const floor = floorOf(), here = names.filter((name) => floor.legend.includes(name));
  if (here.length < 2) { toast("Select two or more zones side by side (Shift+click), then merge.", "error"); return; }
  const merged = grid.mergeZones(floor, here);
  if (!merged) { toast(`${here.join(", ")} have no wall in common: they cannot be one zone.`, "error"); return; }
  const gone = new Set(here.slice(1));
  changeFloor("merge zones", merged, mapZones((zone) => (gone.has(zone) ? here[0] : zone)));
  select({ zones: [here[0]] });
  toast(`Merged into ${here[0]}`);
}

export function dropZones(names) {
  const gone = new Set(names);
  changeFloor(`remove ${names.join(", ")}`, grid.dropZones(floorOf(), names), mapZones((zone) => (gone.has(zone) ? null : zone)));
}

export function rename(from, to) {
  const name = to.trim();
  if (!name || name === from) return false;
  if ([".", "#", "+", "outdoor", "ground"].includes(name)) { toast(`"${name}" is a name that plans use for themselves.`, "error"); return false; }
  const other = page.draft.floors.find((floor) => floor.legend.indexOf(name) >= 3 && floor.cells.includes(floor.legend.indexOf(name)));
  if (other) { toast(`Floor ${other.name} has a zone ${name} already.`, "error"); return false; }
  const floors = page.draft.floors.map((floor) => (floor.legend.includes(from) ? grid.renameZone(floor, from, name) || floor : floor));
  page.zones = { ...page.zones, [name]: page.zones[from] };
  change(`rename ${from}`, { floors, ...mapZones((zone) => (zone === from ? name : zone)) });
  select({ zones: [name] });
  return true;
}

// An area of a zone's own; null gives the facade back to the ratio of its floor.
export function glaze(zone, side, area) {
  const sides = { ...page.draft.glazing[zone], [side]: area };
  if (area === null) delete sides[side];
  const glazing = { ...page.draft.glazing, [zone]: sides };
  change(`glazing of ${zone}`, { glazing: Object.keys(sides).length ? glazing : without(glazing, new Set([zone])) });
}

// The glazed share of a facade, or of all (""), of a floor, or of the whole building (""); null takes it away.
export function glazeBy(floor, side, ratio) {
  const ratios = page.draft.glazing_ratio, sides = { ...ratios[floor], [side]: ratio };
  if (ratio === null) delete sides[side];
  const all = { ...ratios, [floor]: sides };
  change("window-to-wall ratio", { glazing_ratio: Object.keys(sides).length ? all : without(all, new Set([floor])) });
}

const touch = (names, changes) => {
  const wanted = new Set(names);
  return page.draft.devices.map((d) => (wanted.has(d.name) ? { ...d, ...changes } : d));
};

const placed = { floor: null, x: null, y: null };

export function assign(names, zone) {
  change(zone ? `assign to ${zone}` : "take from zones", { devices: touch(names, { zone: zone || null, ...placed }) });
}

// Put a device where it was dropped: in the zone there, or the one beside.
export function drop(name, x, y, snap) {
  const floor = floorOf(), zone = grid.snapZone(floor, x, y, snap ? 4 : 1);
  if (!zone && snap) { toast("No zone is near: drop the device in a room.", "error"); return false; }
  const place = snap ? placed : { floor: floor.name, x: Math.round(x * 10) / 10, y: Math.round(y * 10) / 10 };
  change(`place ${name}`, { devices: touch([name], { zone: zone || null, ...place }) });
  return true;
}

// Put the next device into a zone; the zone may take the name that the list of devices has for it.
export function placeInto(name, zone, takeName) {
  const device = page.draft.devices.find((d) => d.name === name);
  const wanted = (takeName && device.room.trim()) || zone;
  const taken = page.draft.floors.some((floor) => floor.legend.includes(wanted));
  let floors = page.draft.floors, rest = {}, target = zone;
  if (wanted !== zone && !taken) {
    floors = floors.map((floor) => (floor.legend.includes(zone) ? grid.renameZone(floor, zone, wanted) : floor));
    rest = mapZones((z) => (z === zone ? wanted : z));
    page.zones = { ...page.zones, [wanted]: page.zones[zone] };
    target = wanted;
  }
  const devices = (rest.devices || page.draft.devices).map((d) => (d.name === name ? { ...d, zone: target, room: "", ...placed } : d));
  change(`place ${name}`, { floors, ...rest, devices });
}

export function retype(names, type) {
  change("change the type", { devices: touch(names, { type }) });
}

export function renameDevice(from, to) {
  const name = to.trim();
  if (!name || name === from) return;
  if (page.draft.devices.some((d) => d.name === name)) { toast(`There is a device ${name} already.`, "error"); return; }
  change(`rename ${from}`, {
    devices: touch([from], { name }).map((d) => ({ ...d, fed_by: (d.fed_by || []).map((f) => (f === from ? name : f)) })),
    airflows: page.draft.airflows.map((a) => (a.device === from ? { ...a, device: name } : a)),
  });
  select({ devices: [name] });
}

export function dropDevices(names) {
  const gone = new Set(names);
  change(`remove ${names.length} device${names.length > 1 ? "s" : ""}`, {
    devices: page.draft.devices.filter((d) => !gone.has(d.name)).map((d) => ({ ...d, fed_by: (d.fed_by || []).filter((f) => !gone.has(f)) })),
    airflows: page.draft.airflows.filter((a) => !gone.has(a.device)),
  });
}

export function addDevice() {
  const names = new Set(page.draft.devices.map((d) => d.name));
  let n = 1;
  while (names.has(`DEVICE_${n}`)) n++;
  const zone = page.selection.zones[0] || null;
  change("add a device", { devices: [...page.draft.devices, { name: `DEVICE_${n}`, type: "vav", zone, room: "", ...placed }] });
  select({ devices: [`DEVICE_${n}`] });
}

// Devices of a list: new ones are added; those that are there keep their place.
export function takeDevices(list, file) {
  const known = new Map(page.draft.devices.map((d) => [d.name, d]));
  let added = 0;
  for (const device of list) {
    const old = known.get(device.name);
    if (!old) added++;
    known.set(device.name, old ? { ...old, type: device.type, fed_by: device.fed_by, zone: old.zone || device.zone, room: device.room } : { ...device, ...placed });
  }
  change(`import ${file}`, { devices: [...known.values()] });
  const placedNow = list.filter((d) => d.zone).length;
  toast(`${file}: ${list.length} devices, ${added} new; ${placedNow} found their zone by name`);
}

// Give devices the zone whose name is in theirs, or in what the list says, where there is just one.
export function matchNames() {
  const zones = page.draft.floors.flatMap((floor) => floor.legend.slice(3).filter((_, k) => floor.cells.includes(k + 3)));
  const keys = zones.map((zone) => [zone, ` ${grid.key(zone)} `]);
  let count = 0;
  const devices = page.draft.devices.map((device) => {
    if (!isLeft(device)) return device;
    const texts = [device.room, device.name].filter(Boolean).map((text) => ` ${grid.key(text)} `);
    for (const text of texts) {
      const hits = keys.filter(([, words]) => text.includes(words)).sort((a, b) => b[1].length - a[1].length);
      if (hits.length && (hits.length === 1 || hits[0][1].length > hits[1][1].length)) { count++; return { ...device, zone: hits[0][0] }; }
    }
    return device;
  });
  if (!count) { toast("No device that is left has a zone's name in its own."); return; }
  change("match by name", { devices });
  toast(`${count} device${count > 1 ? "s" : ""} matched by name`);
}

export const shift = (rows, columns) => {
  const moved = grid.shiftFloor(floorOf(), rows, columns);
  if (!moved) { toast("The plan has no room on that side: choose More room first.", "error"); return; }
  const devices = page.draft.devices.map((d) => (d.floor === floorOf().name && d.x !== null ? { ...d, x: d.x + columns, y: d.y + rows } : d));
  changeFloor("move the floor", moved, { devices });
};

export function grow(margin = 10) {
  const devices = page.draft.devices.map((d) => (d.x !== null ? { ...d, x: d.x + margin, y: d.y + margin } : d));
  change("more room", { floors: page.draft.floors.map((floor) => grid.growFloor(floor, margin)), devices });
}

export function addFloor() {
  const first = page.draft.floors[0], taken = new Set(page.draft.floors.map((f) => f.name));
  let n = page.draft.floors.length + 1;
  while (taken.has(`F${n}`)) n++;
  const floor = grid.emptyFloor(`F${n}`, first?.height || 3.0, first?.rows || 80, first?.columns || 120);
  change("add a floor", { floors: [...page.draft.floors, floor] });
  page.floor = page.draft.floors.length - 1;
}

export function editFloor(changes) {
  const old = floorOf().name;
  const devices = changes.name ? page.draft.devices.map((d) => (d.floor === old ? { ...d, floor: changes.name } : d)) : page.draft.devices;
  const { [old]: own, ...others } = page.draft.glazing_ratio;
  const ratios = own ? { ...others, [changes.name || old]: own } : others;
  changeFloor("edit the floor", { ...floorOf(), ...changes }, { devices, glazing_ratio: ratios });
}

export function moveFloor(by) {
  const floors = [...page.draft.floors], to = page.floor + by;
  if (to < 0 || to >= floors.length) return;
  [floors[page.floor], floors[to]] = [floors[to], floors[page.floor]];
  page.floor = to;
  change("order of the floors", { floors });
}

export function dropFloor() {
  const gone = new Set(floorOf().legend.slice(3));
  const floors = page.draft.floors.filter((_, k) => k !== page.floor);
  const rest = mapZones((zone) => (gone.has(zone) ? null : zone));
  const devices = rest.devices.map((d) => (d.floor === floorOf().name ? { ...d, ...placed } : d));
  const at = Math.max(0, page.floor - 1);
  change("remove a floor", { floors, ...rest, devices, glazing_ratio: without(page.draft.glazing_ratio, new Set([floorOf().name])) });
  page.floor = Math.min(at, Math.max(0, floors.length - 1));
}

export { devicePlace };
