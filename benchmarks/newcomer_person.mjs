// Goes from two PNGs, a list of devices and an export to a calibrated, diagnosed model on the labelling page, as a person
// does, and counts what that person does and waits for.
// node newcomer_person.mjs ADDRESS FOLDER MODULES CHROMIUM PROCESS [PICTURES]; writes the counts to stdout as JSON. FOLDER
// holds the drawings, devices.csv and truth.json, which stands for what the person knows of the building; export.csv lies
// beside it. PROCESS is the server's: its CPU time, with that of its children, is that of each step's computing.
//
// An action is a click, a field that is filled in (the way to it and the typing together) or a step of the system's
// dialog for files, which takes two beside the button: the file, and "Open". A wait is counted from the action until the
// page shows what was asked for.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const [, , address, folder, modules, executablePath, server, pictures] = process.argv;
const { chromium } = createRequire(join(modules, "index.js"))("playwright-core");
const truth = JSON.parse(readFileSync(join(folder, "truth.json"), "utf8"));
const LONG = { timeout: 3_600_000 };
const steps = [], faults = [];

const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
const context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
const page = await context.newPage();
page.on("pageerror", (error) => faults.push(error.message));
page.on("console", (message) => { if (message.type() === "error") faults.push(message.text()); });

// CPU time of the server and of its children that have ended [s]; proc(5): fields 14 to 17 in hundredths of a second.
const spent = () => readFileSync(`/proc/${server}/stat`, "utf8").split(") ")[1].split(" ").slice(11, 15).reduce((sum, ticks) => sum + Number(ticks) / 100, 0);

function step(name) {
  if (steps.length) now().computed = spent() - now().computed;
  if (name) steps.push({ name, clicks: 0, fields: 0, waited: 0, computed: spent() });
}
const now = () => steps[steps.length - 1];
const picture = async (name, of = page) => { if (pictures) await of.screenshot({ path: join(pictures, `${name}.png`) }); };

async function click(selector, options = {}) {
  await page.click(selector, options);
  now().clicks++;
}

async function clickAt(x, y) {
  await page.mouse.click(x, y);
  now().clicks++;
}

async function fill(selector, text) {
  await page.fill(selector, String(text));
  await page.press(selector, "Tab");
  now().fields++;
}

async function choose(selector, files) { // the button, the files, "Open"
  await page.setInputFiles(selector, files);
  now().clicks += 3;
}

async function wait(what) {
  const began = Date.now();
  await what();
  now().waited += (Date.now() - began) / 1000;
}

const shown = (selector) => wait(() => page.waitForSelector(selector, LONG));
const valid = () => wait(() => page.waitForFunction(() => document.getElementById("saved").textContent === "Saved · valid case", null, LONG));

async function importDrawings() {
  step("drawings: scale by two points, rooms");
  await click("#empty-import");
  await choose("#drawing-file", truth.floors.map((name) => join(folder, `${name}.png`)));
  await wait(() => page.waitForFunction(() => document.querySelector("#drawing img")?.naturalWidth > 0, null, LONG));
  const box = await page.locator("#drawing").boundingBox(), size = await page.$eval("#marks", (m) => m.getAttribute("viewBox").split(" ").map(Number));
  for (const [x, y] of truth.scale.points) await clickAt(box.x + (x / size[2]) * box.width, box.y + (y / size[3]) * box.height);
  await fill("#sheet-distance", truth.scale.distance);
  await click("text=Same for the others");
  await click("#find-rooms");
  await shown(".zone");
}

async function describeBuilding() {
  step("building: name, place, glazing by facade");
  await click("#tab-building");
  await fill("#case-name", "office");
  await fill("#place", `${truth.place.latitude}, ${truth.place.longitude}`);
  await click("#find-place");
  await shown(".place");
  await click(".place");
  await fill("#site-elevation", truth.place.elevation);
  for (const [facade, share] of Object.entries(truth.glazing)) await fill(`#ratio-building-${facade}`, Math.round(1000 * share) / 10);
  await picture("building");
}

// Where a room lies on the screen: its place on the drawing, through the drawing under the plan.
const onScreen = (point) => page.evaluate(([x, y]) => {
  const matrix = document.querySelector("#plan image").getScreenCTM();
  const { x: left, y: top } = new DOMPoint(x, y).matrixTransform(matrix);
  return [left, top];
}, point);

async function placeDevices() {
  step("devices: list, one click a room");
  await click("#tab-devices");
  await choose("#device-file", join(folder, "devices.csv"));
  await shown(".list [role=option]");
  await click("#place-next");
  await page.check("#placing input");
  now().clicks++;
  while (await page.locator("#placing").isVisible()) {
    const name = await page.textContent("#placing strong"), room = truth.rooms[truth.devices[name]];
    const tab = page.locator("#floors [role=tab]", { hasText: room.floor });
    if ((await tab.getAttribute("aria-selected")) !== "true") { await tab.click(); now().clicks++; }
    await clickAt(...(await onScreen(room.point)));
    await page.waitForFunction((n) => document.getElementById("placing").hidden || document.querySelector("#placing strong").textContent !== n, name);
  }
  await valid();
  await picture("placed");
}

async function giveTelemetry() {
  step("telemetry: file, columns looked over, into the case");
  await click("#telemetry");
  await choose("#telemetry-file", join(folder, "..", "export.csv"));
  await shown("#telemetry-take");
  const matched = await page.textContent("section h3");
  await click(".columns button.link >> nth=2"); // looks at one
  await shown(".plot svg");
  await picture("telemetry");
  await click("#telemetry-take");
  await shown("#telemetry-verdict");
  await picture("checked");
  return [matched, await page.textContent("#telemetry-verdict")];
}

// Both are asked for at once: they run side by side.
async function makeReports() {
  step("calibrate and diagnose");
  await click("#telemetry-calibrate");
  await shown("#job-calibrate");
  await click("#make-diagnose");
  await shown("#job-diagnose");
  await picture("begun");
  const verdicts = [];
  for (const kind of ["calibrate", "diagnose"]) verdicts.push(await readReport(kind));
  return verdicts;
}

async function readReport(kind) {
  await shown(`#make-${kind}:not([disabled])`);
  const title = { calibrate: "Calibration", diagnose: "Diagnosis" }[kind];
  const told = page.locator("table tbody tr", { hasText: title }).first();
  await wait(() => told.waitFor({ timeout: 20_000 }));
  const opened = context.waitForEvent("page");
  await told.locator("a").click();
  now().clicks++;
  const report = await opened;
  await report.waitForSelector(".verdict");
  await picture(kind, report);
  const verdict = (await report.textContent(".verdict")).trim();
  await report.close();
  return verdict;
}

await page.goto(address);
await page.waitForSelector("#empty:not([hidden])");
await importDrawings();
await describeBuilding();
await placeDevices();
const [matched, checked] = await giveTelemetry();
const [calibration, diagnosis] = await makeReports();
step(null);
await browser.close();
if (faults.length) throw new Error(`expected no error in the page's console, found ${faults.join("; ")}`);
process.stdout.write(JSON.stringify({ steps, matched, checked, calibration, diagnosis }));
