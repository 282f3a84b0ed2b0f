// What is on the page: the draft, how to undo, how it is saved, who has it, and the time that somebody worked on it.

import { decodeFloor, encodeFloor } from "./grid.js";
import * as api from "./api.js";

const DEEP = 300; // changes that can be undone
const IDLE = 60_000; // ms without a sign of life that still count as work
const WAIT = 350; // ms from a change to its saving
const KEPT = `buildingmpc:${location.pathname}`;

export const page = {
  draft: null, // never changed, only replaced
  findings: [],
  zones: {}, // areas by zone, as the server measures them
  telemetry: "",
  reports: [],
  running: [], // jobs that were not done when the page was loaded
  floor: 0,
  selection: { zones: [], devices: [] },
  mode: "loading", // edit, read
  saved: "saved", // saving, waiting, trouble
  written: false,
};

const past = [], future = [], listeners = [];
let timer = null, running = null, dirty = false, unanswered = false, seconds = 0, lastSign = Date.now(), lastTick = Date.now();

export const listen = (listener) => listeners.push(listener);
export const tell = (what) => listeners.forEach((listener) => listener(what));
export const canUndo = () => (past.length ? past[past.length - 1].label : "");
export const canRedo = () => (future.length ? future[future.length - 1].label : "");
export const floorOf = () => page.draft?.floors[page.floor] || null;
export const workSeconds = () => page.draft.seconds + seconds;

function decode(draft) {
  return { ...draft, glazing_ratio: draft.glazing_ratio || {}, floors: draft.floors.map(decodeFloor) }; // kept by a browser, it may be older
}

function encode(draft) {
  return { ...draft, seconds: workSeconds(), floors: draft.floors.map(encodeFloor) };
}

// What is known of the draft again after something else than a change of it, such as new telemetry.
export async function reloadVerdict() {
  const content = await api.get("api/state");
  takeVerdict(content);
  page.written = !page.findings.some((finding) => finding.level === "error");
  tell("verdict");
}

// A thing that was just changed is not wrong until the server has looked at it.
function unjudged(before, after) {
  const same = (list, name) => list(before).find((thing) => thing.name === name) === list(after).find((thing) => thing.name === name);
  return (finding) => {
    if (finding.level !== "error") return true;
    if (finding.kind === "site") return finding.name in { name: 0, orientation: 0 } ? before[finding.name] === after[finding.name] : before.site[finding.name] === after.site[finding.name];
    if (finding.kind === "device") return same((draft) => draft.devices, finding.name);
    if (finding.kind === "floor") return same((draft) => draft.floors, finding.name);
    if (finding.kind === "zone") return before.glazing[finding.name] === after.glazing[finding.name] && before.floors === after.floors;
    return before.glazing_ratio === after.glazing_ratio;
  };
}

function takeVerdict(content) {
  page.findings = content.findings;
  page.zones = content.zones;
  page.telemetry = content.telemetry;
}

export async function load() {
  const content = await api.get("api/state");
  page.draft = decode(content.draft);
  page.reports = content.reports;
  page.running = content.running;
  takeVerdict(content);
  page.written = !page.findings.some((finding) => finding.level === "error");
  const left = restore(content);
  page.floor = Math.min(page.floor, Math.max(0, page.draft.floors.length - 1));
  if (left && page.mode === "edit") { page.draft = decode(left); schedule(); }
  tell("all");
}

// What a reload overtook on its way to the server. It is later than what the server has when nobody but the window that
// kept it has saved since.
function restore({ draft, saved_by: saver, saved_since: since }) {
  try {
    const kept = JSON.parse(localStorage.getItem(KEPT) || "null");
    if (!kept) return null;
    const later = kept.draft.revision === draft.revision || (kept.window === saver && kept.draft.revision >= since);
    return later ? { ...kept.draft, revision: draft.revision } : null;
  } catch {
    return null;
  }
}

function keep() {
  try {
    localStorage.setItem(KEPT, JSON.stringify({ window: api.windowName, draft: encode(page.draft) }));
  } catch { /* no room: the server has all but the last change */ }
}

// Replace the draft; `label` says what was done, for undo.
export function change(label, changes) {
  if (page.mode !== "edit") { tell("refused"); return; }
  past.push({ label, draft: page.draft, floor: page.floor });
  if (past.length > DEEP) past.shift();
  future.length = 0;
  const before = page.draft;
  page.draft = { ...before, ...changes };
  page.findings = page.findings.filter(unjudged(before, page.draft));
  prune();
  schedule();
  tell("draft");
}

export function changeFloor(label, floor, more = {}) {
  change(label, { floors: page.draft.floors.map((f, k) => (k === page.floor ? floor : f)), ...more });
}

function swap(from, to) {
  const step = from.pop();
  if (!step || page.mode !== "edit") return "";
  to.push({ label: step.label, draft: page.draft, floor: page.floor });
  const { revision, seconds: spent } = page.draft;
  page.draft = { ...step.draft, revision, seconds: spent };
  page.floor = Math.min(step.floor, Math.max(0, page.draft.floors.length - 1));
  prune();
  schedule();
  tell("draft");
  return step.label;
}

export const undo = () => swap(past, future);
export const redo = () => swap(future, past);

// Forget the selection of what is no more.
function prune() {
  const zones = new Set(page.draft.floors.flatMap((floor) => floor.legend));
  const devices = new Set(page.draft.devices.map((device) => device.name));
  page.selection = { zones: page.selection.zones.filter((z) => zones.has(z)), devices: page.selection.devices.filter((d) => devices.has(d)) };
}

export function select(selection) {
  page.selection = { zones: [], devices: [], ...selection };
  tell("selection");
}

function schedule() {
  dirty = true;
  keep();
  page.saved = "waiting";
  clearTimeout(timer);
  timer = setTimeout(save, WAIT);
  tell("saved");
}

// Save now; resolves when the server has the last change.
export async function save() {
  clearTimeout(timer);
  if (running) { await running; if (!dirty) return; }
  if (!dirty || page.mode !== "edit") return;
  running = push();
  try { await running; } finally { running = null; }
  if (dirty && page.saved !== "trouble") await save();
}

// A save whose answer was cut off may have come: where this window has saved last, what the server has is its own.
async function catchUp() {
  const there = await api.get("api/state");
  if (there.saved_by === api.windowName) page.draft = { ...page.draft, revision: there.draft.revision };
  unanswered = false;
}

async function push() {
  page.saved = "saving";
  tell("saved");
  try {
    if (unanswered) await catchUp();
    const sent = page.draft, spent = seconds;
    dirty = false;
    const answer = await api.send("api/draft", encode(sent), { method: "PUT" });
    page.draft = { ...page.draft, revision: answer.revision, seconds: page.draft.seconds + spent };
    seconds -= spent;
    page.written = answer.written;
    page.saved = dirty ? "waiting" : "saved";
    takeVerdict(answer);
    if (dirty) keep(); else localStorage.removeItem(KEPT);
    tell("verdict");
  } catch (error) {
    dirty = true;
    unanswered ||= error.status === 0;
    page.saved = "trouble";
    if (error.status === 409) lose(error.message);
    else { tell({ trouble: error }); clearTimeout(timer); timer = setTimeout(save, 3000); }
  }
  tell("saved");
}

function lose(message) {
  page.mode = "read";
  tell("all");
  tell({ lost: message });
}

// Ask for the case; true when it may be changed from here.
export async function open(takeOver = false) {
  const reloaded = performance.getEntriesByType("navigation")[0]?.type === "reload";
  const previous = reloaded ? sessionStorage.getItem(KEPT) || "" : "";
  const answer = await api.send("api/session", { window: api.windowName, previous, take_over: takeOver });
  if (answer.mine) sessionStorage.setItem(KEPT, api.windowName);
  page.mode = answer.mine ? "edit" : "read";
  return answer;
}

export function startClocks() {
  for (const sign of ["pointerdown", "pointermove", "keydown", "wheel"]) {
    addEventListener(sign, () => { lastSign = Date.now(); }, { passive: true, capture: true });
  }
  setInterval(() => {
    const now = Date.now();
    if (page.mode === "edit" && document.visibilityState === "visible" && now - lastSign < IDLE) seconds += Math.min(now - lastTick, 5000) / 1000;
    lastTick = now;
    tell("clock");
  }, 1000);
  setInterval(() => {
    if (page.mode !== "edit") return;
    if (seconds > 60 && !dirty) { dirty = true; save(); return; }
    api.send("api/session/beat").catch((error) => { if (error.status === 409) lose(error.message); else tell({ trouble: error }); });
  }, 3000);
  addEventListener("pagehide", () => {
    if (page.mode !== "edit") return;
    if (dirty) {
      const text = encode(page.draft);
      // Browsers send at most 64 KB after a page has gone; what is more is kept here until the page is back.
      if (JSON.stringify(text).length < 60_000) api.send("api/draft", text, { method: "PUT", keepalive: true }).catch(() => {});
    }
    api.send("api/session/close", {}, { keepalive: true }).catch(() => {});
  });
}
