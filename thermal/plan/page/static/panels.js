// The details at the side: devices, what is selected, the building, what is wrong.

import * as api from "./api.js";
import { byId, el, field, select as choice, toast } from "./dom.js";
import * as edits from "./edits.js";
import { floorOf, page, change, save, select, tell } from "./store.js";
import * as view from "./plan.js";
import { placeFinder } from "./place.js";
import { choose, nextDevice, tool } from "./tools.js";
import { measured, shown as inUnits, told, typed, unitOf } from "./units.js";

const TYPES = [["vav", "VAV terminal"], ["fan_coil", "Fan coil"], ["electric_heater", "Electric heater"], ["radiator", "Radiator"],
  ["supply_air_terminal", "Supply air terminal"], ["ahu", "Air handler"], ["boiler", "Boiler"], ["chiller", "Chiller"]];
const SIDES = ["north", "east", "south", "west"];
const MOST = 400; // rows of the list at once
const list = { filter: "all", search: "", anchor: null };
const shown = { tab: "devices" };

const errorsOf = (kind, name) => page.findings.filter((f) => f.kind === kind && f.name === name && f.level === "error");
const messageOf = (kind, name) => errorsOf(kind, name).map((f) => f.message).join(" ");
const reading = () => page.mode !== "edit";
const typeOptions = (type) => (TYPES.some(([key]) => key === type) || !type ? TYPES : [...TYPES, [type, `${type} (unknown)`]]);

export function zoneNames() {
  return page.draft.floors.flatMap((floor) => {
    const used = new Set(floor.cells);
    return floor.legend.filter((_, k) => k >= 3 && used.has(k));
  }).sort((a, b) => a.localeCompare(b, undefined, { numeric: true }));
}

const zoneOptions = (value) => {
  const names = zoneNames();
  return [["", "no zone"], ...(value && !names.includes(value) ? [[value, `${value} (unknown)`]] : []), ...names.map((name) => [name, name])];
};

export function showTab(name, focus = false) {
  shown.tab = name;
  for (const tab of byId("tabs").children) {
    const mine = tab.id === `tab-${name}`;
    tab.setAttribute("aria-selected", String(mine));
    tab.tabIndex = mine ? 0 : -1;
    byId(tab.id.replace("tab", "panel")).hidden = !mine;
  }
  renderPanels();
  if (focus) byId(`panel-${name}`).querySelector("input, button, select")?.focus();
}

// Keep the focus, the caret and the scroll of what is drawn anew.
function redraw(panel, children) {
  const active = document.activeElement, key = panel.contains(active) ? active.dataset.key || active.id : "";
  const caret = key && active.selectionStart !== undefined ? active.selectionStart : null, scroll = panel.scrollTop, inner = panel.querySelector(".list")?.scrollTop;
  panel.replaceChildren(...children.flat().filter(Boolean));
  panel.scrollTop = scroll;
  if (inner !== undefined && panel.querySelector(".list")) panel.querySelector(".list").scrollTop = inner;
  if (!key) return;
  const again = panel.querySelector(`[data-key="${CSS.escape(key)}"]`) || panel.querySelector(`#${CSS.escape(key)}`);
  again?.focus({ preventScroll: true });
  if (caret !== null && again?.type === "text") again.setSelectionRange(caret, caret);
}

const busy = (panel) => panel.contains(document.activeElement) && document.activeElement.matches("input:not([type=checkbox]):not([type=search]), select");

function correctMarks(panel, fresh) {
  for (const box of [fresh, ...fresh.querySelectorAll(".field")].filter((e) => e.matches(".field"))) {
    const input = box.querySelector("input, select"), old = input?.id && panel.querySelector(`#${CSS.escape(input.id)}`)?.closest(".field");
    if (!old) continue;
    const mark = old.querySelector("input, select");
    for (const name of ["aria-invalid", "aria-describedby"]) { if (input.hasAttribute(name)) mark.setAttribute(name, input.getAttribute(name)); else mark.removeAttribute(name); }
    old.querySelector(".message")?.remove();
    const message = box.querySelector(".message");
    if (message) old.append(message);
  }
}

export function renderPanels(why = "") {
  const panel = byId(`panel-${shown.tab}`);
  const drawn = { devices: devicesPanel, selection: selectionPanel, building: buildingPanel, problems: problemsPanel }[shown.tab];
  // An answer must not take a field away from under somebody's fingers; what it says of fields is said all the same.
  if (why === "verdict" && busy(panel)) { for (const part of drawn().flat(3)) if (part instanceof Element) correctMarks(panel, part); return; }
  redraw(panel, drawn());
}

function listed() {
  const words = list.search.toLowerCase().split(/\s+/).filter(Boolean);
  return page.draft.devices.filter((d) => {
    if (list.filter === "left" && !edits.isLeft(d)) return false;
    if (list.filter === "placed" && !d.zone) return false;
    const text = `${d.name} ${d.type} ${d.zone || ""} ${d.room}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

function pickDevice(event, name, shownDevices) {
  const names = shownDevices.map((d) => d.name), now = page.selection.devices;
  if (event.shiftKey && list.anchor && names.includes(list.anchor)) {
    const [a, b] = [names.indexOf(list.anchor), names.indexOf(name)].sort((x, y) => x - y);
    select({ devices: names.slice(a, b + 1) });
    return;
  }
  list.anchor = name;
  if (event.ctrlKey || event.metaKey) select({ devices: now.includes(name) ? now.filter((d) => d !== name) : [...now, name] });
  else select({ devices: [name] });
  const zone = page.draft.devices.find((d) => d.name === name)?.zone;
  if (zone) goTo(zone);
}

export function goTo(zone) {
  const at = page.draft.floors.findIndex((floor) => floor.legend.includes(zone) && floor.cells.includes(floor.legend.indexOf(zone)));
  if (at < 0) return;
  if (at !== page.floor) { page.floor = at; tell("all"); }
  view.reveal(zone);
}

function deviceRow(device, shownDevices) {
  const trouble = messageOf("device", device.name), picked = page.selection.devices.includes(device.name);
  const where = device.zone ? el("span", { class: "where" }, device.zone) : el("span", { class: `where ${edits.isLeft(device) ? "left" : ""}` }, edits.PLANT.has(device.type) ? "whole building" : device.room ? `list: ${device.room}` : "no zone");
  return el("li", {
    role: "option", "aria-selected": String(picked), tabindex: picked || (!page.selection.devices.length && device === shownDevices[0]) ? "0" : "-1", "data-key": `device ${device.name}`,
    class: trouble ? "wrong" : "", title: trouble || null, draggable: reading() ? null : "true",
    onclick: (event) => pickDevice(event, device.name, shownDevices),
    ondblclick: () => showTab("selection", true),
    ondragstart: (event) => event.dataTransfer.setData("text/device", device.name),
    onkeydown: (event) => deviceKey(event, device, shownDevices),
  }, el("span", { class: `tag ${device.type}`, "aria-hidden": "true" }, view.deviceLetter(device.type)), el("span", { class: "name" }, device.name), where, trouble && el("span", { class: "sr" }, ` Error: ${trouble}`));
}

function deviceKey(event, device, shownDevices) {
  const by = { ArrowDown: 1, ArrowUp: -1 }[event.key], at = shownDevices.indexOf(device);
  if (event.key === "Enter" || event.key === " ") { event.preventDefault(); event.stopPropagation(); pickDevice({ ctrlKey: event.key === " " }, device.name, shownDevices); return; }
  const next = by && shownDevices[at + by];
  if (!next) return;
  event.preventDefault();
  event.stopPropagation();
  const now = page.selection.devices;
  select({ devices: event.shiftKey ? [...new Set([...now, next.name])] : [next.name] });
  byId("panel-devices").querySelector(`[data-key="${CSS.escape(`device ${next.name}`)}"]`)?.focus();
}

function devicesPanel() {
  const devices = listed(), left = edits.left().length, picked = page.selection.devices, off = reading();
  const file = el("input", { type: "file", accept: ".csv,.ttl,.json,.zinc", class: "sr", id: "device-file", tabindex: "-1", "aria-label": "List of devices", onchange: (e) => e.target.files[0] && takeList(e.target.files[0]) });
  const next = tool.name === "place" ? null : nextDevice();
  const zone = choice(zoneOptions(), page.selection.zones[0] || "", { id: "bulk-zone", "aria-label": "Zone for the selected devices" });
  const type = choice([["", "type…"], ...TYPES], "", { id: "bulk-type", "aria-label": "Type for the selected devices", onchange: (e) => e.target.value && edits.retype(picked, e.target.value) });
  return [
    el("div", { class: "row" },
      el("button", { type: "button", id: "import-devices", disabled: off, onclick: () => file.click() }, "Import list…"), file,
      el("button", { type: "button", id: "match-names", disabled: off || !left, title: "Assign what is left to zones whose name is in the device's", onclick: edits.matchNames }, "Match names"),
      el("button", { type: "button", id: "add-device", disabled: off, title: "New device (N)", onclick: edits.addDevice }, "New")),
    el("button", { type: "button", id: "place-next", class: "primary wide", disabled: off || !left || !page.draft.floors.length, onclick: () => { choose(tool.name === "place" ? "select" : "place"); view.plan.focus(); } },
      tool.name === "place" ? "Stop placing (Esc)" : next ? `Place next: ${next.name} (P)` : devices.length ? "All devices are placed" : "Place next"),
    el("div", { class: "row" },
      el("input", { type: "search", placeholder: "Search devices", "aria-label": "Search devices", value: list.search, "data-key": "search", oninput: (e) => { list.search = e.target.value; renderPanels(); } }),
      choice([["all", `all ${page.draft.devices.length}`], ["left", `left ${left}`], ["placed", "in zones"]], list.filter, { "aria-label": "Show", "data-key": "filter", onchange: (e) => { list.filter = e.target.value; renderPanels(); } })),
    devices.length ? el("ul", { class: "list", role: "listbox", "aria-multiselectable": "true", "aria-label": "Devices" }, devices.slice(0, MOST).map((d) => deviceRow(d, devices)))
      : el("p", { class: "soft pad" }, page.draft.devices.length ? "No device fits." : "No devices yet. Import a list: CSV with names, types and zones; Brick (.ttl); Haystack (.json, .zinc)."),
    devices.length > MOST && el("p", { class: "soft" }, `and ${devices.length - MOST} more: search for them`),
    el("div", { class: "bulk", role: "group", "aria-label": "Selected devices" },
      el("p", {}, picked.length ? `${picked.length} selected` : "Select devices to assign them together"),
      el("div", { class: "row" }, zone, el("button", { type: "button", id: "bulk-assign", disabled: off || !picked.length, onclick: () => edits.assign(picked, zone.value) }, "Assign")),
      el("div", { class: "row" }, type, el("button", { type: "button", id: "bulk-delete", disabled: off || !picked.length, onclick: () => edits.dropDevices(picked) }, "Remove")),
      el("label", { class: "check" }, el("input", { type: "checkbox", checked: tool.snap, onchange: (e) => { tool.snap = e.target.checked; } }), " snap to the room when dragged")),
  ];
}

export async function takeList(file) {
  try {
    await save();
    const { devices } = await api.upload("api/devices", file);
    edits.takeDevices(devices, file.name);
    showTab("devices");
  } catch (error) {
    toast(`${error.refusal || error.name}: ${error.message}`, "error");
  }
}

const text = (value, done, attributes = {}) => el("input", { type: "text", value, disabled: reading(), autocomplete: "off", onchange: (e) => done(e.target.value, e.target), ...attributes });
const number = (value, done, attributes = {}) => el("input", {
  type: "number", step: "any", value: value ?? "", disabled: reading(), onchange: (e) => { const v = e.target.value === "" ? null : Number(e.target.value); if (v === null || Number.isFinite(v)) done(v); }, ...attributes,
});

// A number with its unit, written and read in the units that are shown; a bound in attributes is in them, too.
const quantity = (label, unit, value, done, attributes = {}, message = "") => field(`${label} [${unitOf(unit)}]`, number(inUnits(value, unit), (v) => done(typed(v, unit)), attributes), message);

function zonePanel(zone) {
  const facts = page.zones[zone], glass = page.draft.glazing[zone] || {}, trouble = messageOf("zone", zone), off = reading();
  const devices = page.draft.devices.filter((d) => d.zone === zone);
  const sides = SIDES.filter((side) => glass[side] || facts?.facades?.[side] > 0);
  return [
    el("h2", {}, `Zone ${zone}`),
    field("Name", text(zone, (value, input) => { if (!edits.rename(zone, value)) input.value = zone; }, { id: "zone-name" }), trouble),
    el("p", { class: "facts" }, facts ? `${measured(facts.area, "m²")} · ${devices.length} device${devices.length === 1 ? "" : "s"}` : ""),
    el("div", { class: "row" },
      el("button", { type: "button", disabled: off, onclick: () => choose("split") }, "Split (X)"),
      el("button", { type: "button", disabled: off || page.selection.zones.length < 2, onclick: () => edits.merge() }, "Merge (M)"),
      el("button", { type: "button", disabled: off, onclick: () => edits.dropZones([zone]) }, "Remove (Del)")),
    el("h3", {}, "Devices"),
    devices.length ? el("ul", { class: "plain" }, devices.map((d) => el("li", {}, el("button", { type: "button", class: "link", onclick: () => { select({ devices: [d.name] }); } }, d.name), ` ${d.type}`)))
      : el("p", { class: "soft" }, "No device serves this zone."),
    el("h3", {}, "Glazing"),
    sides.length ? el("div", { class: "grid" }, sides.map((side) => quantity(`${side}, of ${measured(facts?.facades?.[side] || 0, "m²")}`, "m²", glass[side], (v) => edits.glaze(zone, side, v), { min: "0", id: `glazing-${side}`, placeholder: `${inUnits(facts?.glazing?.[side] || 0, "m²")}` })))
      : el("p", { class: "soft" }, "This zone has no facade."),
    sides.length > 0 && el("p", { class: "soft" }, "Empty: as the window-to-wall ratio on the tab Building says. 0: no window."),
  ];
}

function devicePanel(name) {
  const device = page.draft.devices.find((d) => d.name === name);
  return [
    el("h2", {}, `Device ${name}`),
    field("Name", text(name, (value) => edits.renameDevice(name, value), { id: "device-name" }), messageOf("device", name)),
    field("Type", choice(typeOptions(device.type), device.type, { id: "device-type", disabled: reading(), onchange: (e) => edits.retype([name], e.target.value) })),
    field("Zone", choice(zoneOptions(device.zone), device.zone || "", { id: "device-zone", disabled: reading(), onchange: (e) => edits.assign([name], e.target.value) })),
    device.room && el("p", { class: "soft" }, `The list of devices says: ${device.room}`),
    el("div", { class: "row" }, device.zone && el("button", { type: "button", onclick: () => goTo(device.zone) }, "Show on the plan"),
      el("button", { type: "button", disabled: reading(), onclick: () => edits.dropDevices([name]) }, "Remove (Del)")),
  ];
}

function selectionPanel() {
  const { zones, devices } = page.selection;
  if (devices.length === 1) return devicePanel(devices[0]);
  if (devices.length > 1) return [el("h2", {}, `${devices.length} devices`), el("p", {}, "Assign them together on the Devices tab."), el("ul", { class: "plain" }, devices.map((d) => el("li", {}, d)))];
  if (zones.length === 1) return zonePanel(zones[0]);
  if (zones.length > 1) {
    const area = zones.reduce((sum, z) => sum + (page.zones[z]?.area || 0), 0);
    return [el("h2", {}, `${zones.length} zones`), el("p", { class: "facts" }, `${measured(area, "m²")} together`), el("ul", { class: "plain" }, zones.map((z) => el("li", {}, z))),
      el("div", { class: "row" }, el("button", { type: "button", class: "primary", disabled: reading(), onclick: () => edits.merge() }, "Merge (M)"),
        el("button", { type: "button", disabled: reading(), onclick: () => edits.dropZones(zones) }, "Remove (Del)"))];
  }
  return [el("p", { class: "soft pad" }, "Select a zone or a device on the plan to see and change it here.")];
}

// Window-to-wall ratios of a floor, or of the whole building (""): of all facades, and of each that differs.
function ratioFields(floor) {
  const ratios = page.draft.glazing_ratio, own = ratios[floor] || {}, whole = (floor && ratios[""]) || {};
  const percent = (share) => (share === undefined ? "" : `${Math.round(share * 1000) / 10}`);
  return el("div", { class: "grid" }, ["", ...SIDES].map((side) => {
    const taken = side ? own[""] ?? whole[side] ?? whole[""] : whole[""];
    const attributes = { min: "0", max: "100", id: `ratio-${floor ? "floor" : "building"}-${side || "all"}`, placeholder: percent(taken) || "0" };
    return field(`${side || "all facades"} [%]`, number(percent(own[side]), (v) => edits.glazeBy(floor, side, v === null ? null : v / 100), attributes));
  }));
}

const site = (key, value) => change(`edit ${key}`, { site: { ...page.draft.site, [key]: value } });

function buildingPanel() {
  const { site: place, orientation, cell_size: size } = page.draft, off = reading();
  const numbers = [["latitude", "Latitude [°], north positive"], ["longitude", "Longitude [°], east positive"]];
  const zones = el("datalist", { id: "timezones" }, (Intl.supportedValuesOf?.("timeZone") || []).map((zone) => el("option", { value: zone })));
  const floor = floorOf();
  return [
    el("h2", {}, "Building"),
    field("Name of the case", text(page.draft.name, (v) => change("rename the case", { name: v.trim() }), { id: "case-name" }), messageOf("site", "name")),
    placeFinder((found) => change("choose the place", { site: found }), off),
    el("div", { class: "grid" }, numbers.map(([key, label]) => field(label, number(place[key], (v) => site(key, v), { id: `site-${key}` }), messageOf("site", key))),
      quantity("Elevation", "m", place.elevation, (v) => site("elevation", v), { id: "site-elevation" }, messageOf("site", "elevation")),
      field("Orientation [°], true north to the plan's up", number(orientation, (v) => change("orientation", { orientation: v || 0 }), { id: "orientation" }), messageOf("site", "orientation"))),
    field("Time zone, IANA name", text(place.timezone, (v) => site("timezone", v.trim()), { id: "site-timezone", list: "timezones", placeholder: "Europe/Berlin" }), messageOf("site", "timezone")), zones,
    !place.timezone && el("button", { type: "button", class: "link", disabled: off, onclick: () => site("timezone", Intl.DateTimeFormat().resolvedOptions().timeZone) }, "Take this computer's"),
    el("p", { class: "soft" }, `Cells of ${Number(inUnits(size, "m").toPrecision(4))} ${unitOf("m")}. ${page.telemetry ? `Telemetry: ${page.telemetry}.` : "No telemetry yet: button Telemetry, or drop the file on this page."}`),
    el("h3", {}, "Windows: share of the facade that is glass"),
    el("p", { class: "soft" }, "For the whole building. Floors below and single zones (tab Selection) may differ; an empty field takes what stands in grey."),
    ratioFields(""), ...[...errorsOf("case", "")].map((f) => el("p", { class: "message" }, told(f.message))),
    floor && [
      el("h2", {}, `Floor ${floor.name}`),
      el("div", { class: "grid" },
        field("Name", text(floor.name, (v) => edits.editFloor({ name: v.trim() }), { id: "floor-name" }), messageOf("floor", floor.name)),
        quantity("Clear height", "m", floor.height, (v) => v > 0 && edits.editFloor({ height: v }), { id: "floor-height", min: "0.1" })),
      el("h3", {}, "Windows of this floor"), ratioFields(floor.name), ...errorsOf("case", floor.name).map((f) => el("p", { class: "message" }, told(f.message))),
      el("div", { class: "row" },
        el("button", { type: "button", disabled: off || page.floor === 0, onclick: () => edits.moveFloor(-1) }, "Lower"),
        el("button", { type: "button", disabled: off || page.floor === page.draft.floors.length - 1, onclick: () => edits.moveFloor(1) }, "Higher"),
        el("button", { type: "button", disabled: off, onclick: () => edits.grow() }, "More room"),
        el("button", { type: "button", disabled: off, onclick: () => edits.dropFloor() }, "Remove floor")),
      el("div", { class: "row", role: "group", "aria-label": "Move this floor over the one below, by a cell" }, el("span", {}, "Move over the others:"),
        [["←", 0, -1, "left"], ["→", 0, 1, "right"], ["↑", -1, 0, "up"], ["↓", 1, 0, "down"]].map(([sign, r, c, word]) => el("button", { type: "button", disabled: off, "aria-label": `Move ${word}`, "data-key": `move-${word}`, onclick: () => edits.shift(r, c) }, sign))),
    ],
  ];
}

export function showFinding(finding) {
  if (finding.kind === "zone") { goTo(finding.name); select({ zones: [finding.name] }); showTab("selection"); }
  else if (finding.kind === "device") { select({ devices: [finding.name] }); showTab("selection", true); }
  else if (finding.kind === "site") { showTab("building"); byId(finding.name === "name" ? "case-name" : finding.name === "orientation" ? "orientation" : `site-${finding.name}`)?.focus(); }
  else if (finding.kind === "floor") {
    const at = page.draft.floors.findIndex((floor) => floor.name === finding.name);
    if (at >= 0) { page.floor = at; tell("all"); }
    showTab("building");
  } else showTab("building"); // of the case as a whole, such as its windows
}

function problemsPanel() {
  const errors = page.findings.filter((f) => f.level === "error"), remarks = page.findings.filter((f) => f.level !== "error");
  const rows = (found) => el("ul", { class: "findings" }, found.slice(0, MOST).map((f) => el("li", { class: f.level },
    el("button", { type: "button", onclick: () => showFinding(f) }, el("strong", {}, f.kind === "case" || f.kind === "site" ? f.kind : `${f.kind} ${f.name}`), el("span", {}, told(f.message))))));
  return [
    el("h2", {}, errors.length ? `${errors.length} to put right` : "This is a valid case"),
    errors.length ? rows(errors) : el("p", {}, page.telemetry ? "It is in the case folder, and every command takes it." : "It is in the case folder, and every command takes it as soon as there is telemetry."),
    remarks.length > 0 && [el("h2", {}, `${remarks.length} worth a look`), rows(remarks)],
  ];
}
