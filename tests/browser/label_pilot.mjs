// Labels a building from its drawings and its list of devices, as a technician does: by mouse and keyboard, through the page.
// node label_pilot.mjs ADDRESS FOLDER MODULES CHROMIUM [PICTURES]; writes numbers to stdout as JSON. FOLDER is made by
// pilot.py, MODULES is where install.sh put playwright-core.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const [, , address, folder, modules, executablePath, pictures] = process.argv;
const { chromium } = createRequire(join(modules, "index.js"))("playwright-core");
const truth = JSON.parse(readFileSync(join(folder, "truth.json"), "utf8"));
const drawings = truth.floors.map((name) => join(folder, `${name}.png`));
const began = Date.now(), faults = [];
const expect = (holds, text) => { if (!holds) throw new Error(`expected ${text}`); };

const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
const context = await browser.newContext({ viewport: { width: 1440, height: 900 } });
const page = await context.newPage();
for (const p of [page]) {
  p.on("pageerror", (error) => faults.push(error.message));
  p.on("console", (message) => { if (message.type() === "error" && !/status of 4\d\d/.test(message.text())) faults.push(message.text()); });
}
const settled = (of = page) => of.evaluate(() => document.querySelectorAll(".toast button").forEach((button) => button.click()));
const picture = async (name, of = page) => { if (pictures) await of.screenshot({ path: join(pictures, `${name}.png`) }); };
const saved = (of = page) => of.waitForFunction(() => /Saved|Draft saved/.test(document.getElementById("saved").textContent), null, { timeout: 30000 });

async function importDrawings() {
  await page.click("#empty-import");
  await page.setInputFiles("#drawing-file", drawings);
  await page.waitForFunction((n) => document.querySelectorAll(".sheets li").length === n, drawings.length);
  await page.waitForFunction(() => document.querySelector("#drawing img")?.naturalWidth > 0);
  const box = await page.locator("#drawing").boundingBox(), size = await page.$eval("#marks", (m) => m.getAttribute("viewBox").split(" ").map(Number));
  for (const [x, y] of truth.scale.points) await page.mouse.click(box.x + (x / size[2]) * box.width, box.y + (y / size[3]) * box.height);
  await page.fill("#sheet-distance", String(truth.scale.distance));
  await picture("scale");
  await page.getByText("Same for the others").click();
  await page.click("#find-rooms");
  await page.waitForSelector(".zone", { timeout: 900000 });
  await saved();
  await picture("zones");
}

async function fillBuilding() {
  await page.click("#tab-building");
  for (const [id, text] of [["case-name", "pilot"], ["site-latitude", "37.62"], ["site-longitude", "-122.4"], ["site-elevation", "2"], ["site-timezone", "Etc/GMT+8"]]) {
    await page.fill(`#${id}`, text);
    await page.press(`#${id}`, "Tab");
  }
}

// Where a room lies on the screen: its place on the drawing, through the drawing under the plan.
const onScreen = (point) => page.evaluate(([x, y]) => {
  const matrix = document.querySelector("#plan image").getScreenCTM();
  const { x: left, y: top } = new DOMPoint(x, y).matrixTransform(matrix);
  return [left, top];
}, point);

async function goTo(floor) {
  const tab = page.locator("#floors [role=tab]", { hasText: floor });
  if ((await tab.getAttribute("aria-selected")) !== "true") await tab.click();
}

const left = () => page.textContent("#left");
const zoneOf = (name) => page.evaluate((n) => document.querySelector(`.list [data-key="device ${n}"] .where`)?.textContent, name);

async function placeDevices(times, most = Infinity) {
  while (times.length < most && (await page.locator("#placing").isVisible())) {
    const start = Date.now(), name = await page.textContent("#placing strong"), room = truth.rooms[truth.devices[name]];
    await goTo(room.floor);
    const [x, y] = await onScreen(room.point);
    await page.mouse.click(x, y);
    await page.waitForFunction((n) => document.getElementById("placing").hidden || document.querySelector("#placing strong").textContent !== n, name);
    times.push((Date.now() - start) / 1000);
  }
}

// A device is placed, a zone is renamed and a wall is drawn without the mouse, and all of it is taken back.
async function byKeyboard() {
  const before = await left();
  await page.focus("#plan");
  await page.keyboard.press("p");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  expect((await left()) !== before, "a device placed with the Enter key");
  await page.keyboard.press("Escape");
  await page.keyboard.press("Control+z");
  expect((await left()) === before, "the device taken back");
  const zones = await page.locator(".zone").count();
  await page.keyboard.press("w");
  await page.keyboard.press("ArrowRight"); // the cursor in the middle of the plan
  await page.keyboard.press("Enter");
  for (let k = 0; k < 20; k++) await page.keyboard.press("Shift+ArrowLeft");
  await page.keyboard.press("Enter");
  expect((await page.locator(".zone").count()) > zones, "a wall across rooms to part them");
  await page.keyboard.press("Control+z");
  expect((await page.locator(".zone").count()) === zones, "the wall taken back");
  await page.keyboard.press("Escape");
  await page.keyboard.press("Escape");
}

// The page is loaded anew right after a click: nothing may be lost.
async function reload() {
  const before = await left();
  await page.reload();
  await page.waitForSelector(".zone");
  expect(await page.locator("#banner").isHidden(), "a window that is loaded anew to keep the case");
  expect((await left()) === before, `"${before}" after the reload, found "${await left()}"`);
}

// Split, merge, drag, and take all of it back.
async function correct() {
  const floor = truth.floors[0], [name, room] = Object.entries(truth.rooms).find(([zone, r]) => r.floor === floor && truth.areas[zone] > 30);
  await goTo(floor);
  const count = () => page.locator(".zone").count(), zones = await count();
  const [x, y] = await onScreen(room.point);
  await page.keyboard.press("x");
  await page.mouse.move(x, y - 8);
  await page.mouse.down();
  await page.mouse.move(x, y + 8, { steps: 4 });
  await page.mouse.up();
  expect((await count()) === zones + 1, "one zone more after the split");
  await page.keyboard.press("v");
  await page.mouse.click(x - 18, y);
  await page.keyboard.down("Shift");
  await page.mouse.click(x + 18, y);
  await page.keyboard.up("Shift");
  await picture("merge");
  await page.keyboard.press("m");
  expect((await count()) === zones, "one zone less after the merge");
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+z");
  expect((await count()) === zones, "the zones as they were after two steps back");
  const device = page.locator(`.device[data-device="VAV_${name}"]`), other = Object.values(truth.rooms).filter((r) => r.floor === floor).pop();
  const from = await device.boundingBox(), to = await onScreen(other.point);
  await page.mouse.move(from.x + from.width / 2, from.y + from.height / 2);
  await page.mouse.down();
  await page.mouse.move(...to, { steps: 6 });
  await page.mouse.up();
  await page.waitForFunction(([n, z]) => document.querySelector(`.device[data-device="${n}"]`)?.getAttribute("aria-label").includes(z), [`VAV_${name}`, "zone"]);
  await page.click("#tab-devices");
  expect((await zoneOf(`VAV_${name}`)) !== name, "the device in the room that it was dragged to");
  await page.keyboard.press("Control+z");
  expect((await zoneOf(`VAV_${name}`)) === name, "the device back in its room");
  await saved();
}

async function secondWindow() {
  const second = await (await browser.newContext({ viewport: { width: 1440, height: 900 } })).newPage();
  await second.goto(address);
  await second.waitForSelector("#banner:not([hidden])");
  const told = await second.textContent("#banner p");
  expect(/open in another window/.test(told), `the second window to be told, found "${told}"`);
  await picture("second", second);
  await second.click("#read-only");
  expect((await second.textContent("#saved")) === "Read only", "the second window to be read only");
  expect(await second.locator("#import").isDisabled(), "nothing to change in the second window");
  await second.reload();
  await second.waitForSelector("#take-over");
  await second.click("#take-over");
  await second.waitForFunction(() => document.body.dataset.mode === "edit");
  await page.waitForSelector("#banner:not([hidden])", { timeout: 15000 });
  expect(/taken this case over/.test(await page.textContent("#banner p")), "the first window to be told");
  await page.click("#take-over");
  await page.waitForFunction(() => document.body.dataset.mode === "edit");
  await second.close();
  return told;
}

async function hostile() {
  await page.click("#import");
  await page.setInputFiles("#drawing-file", join(folder, "bomb.png"));
  await page.waitForFunction(() => /OversizedFileError/.test(document.getElementById("import-status").textContent), null, { timeout: 20000 });
  const refusal = await page.textContent("#import-status");
  await picture("refused");
  await page.keyboard.press("Escape");
  return refusal;
}

// A report is made, listed with what it found, and opened in a window of its own.
async function report() {
  await page.getByRole("button", { name: "Reports" }).click();
  await page.click("#make-check");
  const link = page.locator("#reports-body td a", { hasText: "Check" });
  await link.waitFor({ timeout: 120000 });
  const found = await page.locator("#reports-body .found").first().textContent();
  // its telemetry is one outdoor column of two stamps
  expect(found.startsWith("The case is not valid for calibration"), `what the check found beside its report, found "${found}"`);
  await picture("reports");
  const [opened] = await Promise.all([context.waitForEvent("page"), link.click()]);
  await opened.waitForSelector("h1");
  expect(/pilot/.test(await opened.textContent("h1")), "the report of the case");
  await picture("report", opened);
  await opened.close();
  await page.keyboard.press("Escape");
  return found;
}

await page.goto(address);
await page.waitForSelector("#empty:not([hidden])");
await picture("empty");
await importDrawings();
const imported = (Date.now() - began) / 1000;
await fillBuilding();
await page.click("#tab-devices");
await page.setInputFiles("#device-file", join(folder, "devices.csv"));
await page.waitForFunction((n) => document.querySelectorAll(".list [role=option]").length === n, Object.keys(truth.devices).length);
await picture("devices");

await byKeyboard();
const times = [];
await page.click("#place-next");
await page.check("#placing input");
await placeDevices(times, Math.floor(Object.keys(truth.rooms).length / 3));
await settled();
await picture("labelling");
await reload();
await page.click("#place-next");
await page.check("#placing input");
await placeDevices(times);
await saved();
const told = await secondWindow();
await correct();
const refusal = await hostile();
await page.waitForFunction(() => /valid case$/.test(document.getElementById("saved").textContent) && !/not/.test(document.getElementById("saved").textContent), null, { timeout: 30000 });
await picture("done");
const checked = await report();
expect(!faults.length, `no error in the page's console, found ${faults.join("; ")}`);
await browser.close();

const total = (Date.now() - began) / 1000, devices = Object.keys(truth.devices).length;
process.stdout.write(JSON.stringify({
  devices, placed: times.length, import_seconds: imported, seconds_per_placement: times.reduce((a, b) => a + b, 0) / times.length, slowest_placement: Math.max(...times),
  total_seconds: total, seconds_per_device: total / devices, told, refusal, checked,
}));
