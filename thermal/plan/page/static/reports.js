// The page after: reports of the case that are there, and those that are made when asked for.

import * as api from "./api.js";
import { byId, el, openDialog, toast } from "./dom.js";
import { page, save } from "./store.js";
import * as units from "./units.js";

const WORDS = {
  check: ["Check", "Geometry drawn, quality of the telemetry, what each point is. Seconds."],
  calibrate: ["Calibrate", "Fit the physical parameters to the telemetry. Minutes."],
  diagnose: ["Diagnose", "Where, which and how far model and building disagree. Minutes."],
};
const jobs = new Map(); // kind -> {state, stop}
let ready = ""; // what was done since somebody last looked

// Go on with what was running before the page was loaded anew.
export function resume(running) {
  for (const state of running) if (page.reports.includes(state.kind) && !jobs.has(state.kind)) watch(state.kind, state);
}

// What goes on is seen without the list of reports, too.
function renderJob() {
  const pill = byId("job"), states = [...jobs.values()].map((job) => job.state), state = states.find((s) => s.state === "runs") || states[0];
  const more = states.length > 1 ? ` +${states.length - 1}` : "";
  pill.hidden = !state && !ready;
  pill.className = `pill ${state ? "busy" : "good"}`;
  pill.textContent = state ? `${title(state.kind)}: ${brief(state)}${more}` : ready;
}

const title = (kind) => WORDS[kind]?.[0] || kind;

const brief = (state) => (state.state === "waiting" ? "waits" : `${state.total ? `${Math.floor((100 * state.done) / state.total)} % · ` : ""}${state.left === null ? time(state.seconds) : remaining(state)}`);

const remaining = (state) => `about ${time(state.left)} left`;

const time = (seconds) => (seconds < 90 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`);

export async function openReports() {
  ready = "";
  renderJob();
  openDialog("Reports", el("div", { id: "reports-body", class: "reports" }, "Loading…"), { wide: true });
  await refresh();
}

async function refresh() {
  if (!byId("reports-body")) return;
  try {
    await save();
    const { reports, running } = await api.get("api/reports");
    resume(running);
    draw(reports);
  } catch (error) {
    byId("reports-body").textContent = `${error.refusal || error.name}: ${error.message}`;
  }
}

// What is as it was stays in place: a button that is replaced while it is pressed loses the press.
function draw(reports) {
  const body = byId("reports-body"), errors = page.findings.some((f) => f.level === "error");
  if (!body) return;
  if (!byId("reports-list")) body.replaceChildren(el("div", { id: "reports-message" }), el("div", { class: "cards" }, page.reports.map((kind) => el("section", { class: "card", id: `card-${kind}` }))), el("div", { id: "reports-list" }));
  const message = errors ? "Reports can be made as soon as the case is valid." : page.telemetry ? "" : "The case has no telemetry yet: check works, calibrate and diagnose wait for it (button Telemetry).";
  put(byId("reports-message"), [errors, message], () => (message ? [el("p", { class: errors ? "message" : "soft" }, message)] : []));
  for (const kind of page.reports) {
    const job = jobs.get(kind), disabled = errors || !page.written || (kind !== "check" && !page.telemetry);
    put(byId(`card-${kind}`), [job?.state.number, disabled], () => card(kind, job, disabled));
  }
  put(byId("reports-list"), [reports, units.chosen()], () => list(reports));
}

// Fill a place anew where what it is made of has changed.
function put(place, made, children) {
  const told = JSON.stringify(made);
  if (place.dataset.made === told) return;
  place.dataset.made = told;
  place.replaceChildren(...children());
}

function card(kind, job, disabled) {
  const [title, text] = WORDS[kind] || [kind, ""];
  return [el("h3", {}, title), el("p", { class: "soft" }, text),
    job ? el("div", { class: "working", id: `job-${kind}` }, el("p", { role: "status", "aria-live": "polite" }, words(job.state)), el("progress", job.state.total ? { max: job.state.total, value: job.state.done } : {}), el("button", { type: "button", onclick: () => jobs.get(kind)?.stop.abort() }, "Stop"))
      : el("button", { type: "button", class: "primary", id: `make-${kind}`, disabled, onclick: () => make(kind) }, `${title} now`)];
}

function list(reports) {
  if (!reports.length) return [el("p", { class: "soft" }, "No reports yet. Those of results folders inside the case, or given with --results, are listed here.")];
  const rows = reports.map((report) => el("tr", {},
    el("td", {}, el("a", { href: api.address(`reports/${report.key}/report.html`), target: "_blank", rel: "noopener" }, capital(report.kind === "other" ? report.title : report.kind))),
    el("td", { class: "found" }, units.told(report.verdict)), el("td", { class: "soft" }, report.title || "made here"), el("td", { class: "soft" }, moment(report.time))));
  return [el("table", {}, el("caption", {}, "Reports of this case"), el("thead", {}, el("tr", {}, ["Report", "What it found", "Folder", "Written"].map((h) => el("th", { scope: "col" }, h)))), el("tbody", {}, rows))];
}

const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

const moment = (seconds) => new Date(seconds * 1000).toLocaleString([], { dateStyle: "short", timeStyle: "short" });

const words = (state) => (state.state === "waiting" ? "waits for the report before it" : `${state.stage || "working"} · ${time(state.seconds)}${state.left === null ? "" : ` · ${remaining(state)}`}`);

export async function make(kind) {
  try {
    await save();
    watch(kind, await api.send(`api/reports/${kind}`, {}, { query: { units: units.chosen() } }));
    await refresh();
  } catch (error) {
    toast(`${error.refusal || error.name}: ${error.message}`, "error");
  }
}

async function watch(kind, started) {
  const stop = new AbortController();
  jobs.set(kind, { state: started, stop });
  renderJob();
  try {
    const report = await api.job(started, (state) => {
      jobs.set(kind, { state, stop });
      renderJob();
      const box = byId(`job-${kind}`);
      if (!box) return;
      box.firstChild.textContent = words(state);
      if (state.total) Object.assign(box.children[1], { max: state.total, value: state.done });
    }, stop.signal);
    if (!byId("reports-body")) ready = `${title(kind)}: report is there`;
    toast(`${title(kind)}: the report is there.`);
    return report;
  } catch (error) {
    toast(error.refusal === "Stopped" ? `${title(kind)}: stopped; earlier reports are as they were.` : `${title(kind)}: ${error.refusal || error.name}: ${error.message}`, error.refusal === "Stopped" ? "" : "error");
    return null;
  } finally {
    jobs.delete(kind);
    renderJob();
    refresh();
  }
}
