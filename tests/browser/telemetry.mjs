// Gives a case its telemetry on the page, corrects a column, looks at plots, and makes reports through a reload and a stop.
// node telemetry.mjs ADDRESS FOLDER MODULES CHROMIUM SENTENCES [PICTURES]; SENTENCES: a list as JSON, to be read in feet; writes what it saw to stdout as JSON.
import { createRequire } from "node:module";
import { join } from "node:path";

const [, , address, folder, modules, executablePath, sentences, pictures] = process.argv;
const { chromium } = createRequire(join(modules, "index.js"))("playwright-core");
const faults = [], seen = {};
const expect = (holds, text) => { if (!holds) throw new Error(`expected ${text}`); };

const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
const context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
const page = await context.newPage();
page.on("pageerror", (error) => faults.push(error.message));
page.on("console", (message) => { if (message.type() === "error" && !/status of 4\d\d/.test(message.text())) faults.push(message.text()); });
const picture = async (name) => { if (pictures) await page.screenshot({ path: join(pictures, `${name}.png`) }); };
const red = (id) => page.evaluate((i) => document.getElementById(i).getAttribute("aria-invalid") === "true", id);
const pill = (pattern) => page.waitForFunction((p) => new RegExp(p).test(document.getElementById("job").textContent), pattern);
const saved = () => page.waitForFunction(() => document.getElementById("saved").textContent === "Saved · valid case");

async function place() {
  await page.click("#tab-building");
  await page.fill("#place", "Atlantis");
  await page.press("#place", "Enter");
  await page.waitForSelector("#places:has-text('No city of that name')");
  await page.fill("#place", "reykjavik");
  await page.click("#find-place");
  await page.click(".place");
  expect((await page.inputValue("#site-timezone")) === "Atlantic/Reykjavik", "the time zone of the place");
  await picture("place");
  await page.keyboard.press("Escape");
  await saved();
}

// A field is red while it is wrong, and not while it is being saved.
async function notRedWhileSaving() {
  await page.fill("#site-latitude", "190");
  await page.press("#site-latitude", "Tab");
  await page.waitForFunction(() => document.getElementById("site-latitude").getAttribute("aria-invalid") === "true"); // the focus is in the next field
  let free;
  const held = new Promise((done) => { free = done; });
  await page.route("**/api/draft?*", async (route) => { await held; await route.continue(); });
  await page.fill("#site-latitude", "37.4");
  await page.press("#site-latitude", "Tab");
  await page.waitForFunction(() => document.getElementById("saved").textContent === "Saving…");
  seen.red_while_saving = await red("site-latitude");
  free();
  await saved();
  seen.red_when_saved = await red("site-latitude");
  await page.unroute("**/api/draft?*");
}

// What is shown and typed turns to feet and °F; the case stays in SI units.
async function units() {
  const metres = Number(await page.inputValue("#floor-height"));
  await page.click("#units");
  await page.waitForSelector("#units:has-text('m, °C')");
  expect(Math.abs(Number(await page.inputValue("#floor-height")) - metres / 0.3048) < 1e-3, "the height in feet");
  await page.fill("#floor-height", "10");
  await page.press("#floor-height", "Tab");
  await saved();
  seen.height = await page.inputValue("#floor-height");
  seen.area = await page.textContent(".zone text:last-of-type");
  seen.bar = await page.textContent("#scalebar");
  seen.told = await page.evaluate(async (texts) => {
    const { told } = await import(new URL("static/units.js", location));
    return texts.map(told);
  }, JSON.parse(sentences));
  await picture("feet");
}

async function telemetry() {
  await page.click("#telemetry");
  await page.waitForSelector("#telemetry-body:has-text('no telemetry yet')");
  await page.setInputFiles("#telemetry-file", join(folder, "export.csv"));
  await page.waitForSelector("#telemetry-take:not([disabled])");
  seen.matched = await page.textContent("#telemetry-body h3");
  await page.getByRole("button", { name: "OAT", exact: true }).click();
  await page.waitForSelector(".plot svg path");
  await page.fill("[id='entity Lift alarm']", "nobody");
  await page.press("[id='entity Lift alarm']", "Tab");
  await page.waitForSelector("#telemetry-body .message:has-text('a device, a zone or the weather station')");
  await page.fill("[id='point Lift alarm']", "zone_air_temperature_sensor");
  await page.press("[id='point Lift alarm']", "Tab");
  await page.waitForSelector("tr:has-text('Lift alarm'):has-text('whose it is is not said yet')");
  await picture("columns");
  await page.click("#telemetry-take");
  await page.waitForSelector("#telemetry-verdict");
  seen.verdict = await page.textContent("#telemetry-verdict");
  await page.locator("table.columns").first().getByRole("button").first().click();
  await page.waitForSelector(".plot svg path");
  await page.getByRole("button", { name: "OAT", exact: true }).or(page.getByRole("button", { name: /outside_air_temperature/ })).last().click();
  await page.waitForSelector(".plot figcaption:has-text('°F')");
  await picture("checked");
}

async function reports() {
  await page.click("#telemetry-calibrate");
  await page.waitForSelector("#job-calibrate:has-text('fitting')");
  await page.waitForSelector("#job-calibrate:has-text('left')");
  await picture("running");
  await page.reload();
  await page.waitForSelector(".zone");
  await pill("^Calibrate: \\d+ %");
  await page.click("#job");
  await page.click("#make-diagnose");
  await page.waitForSelector("#job-diagnose");
  await page.hover("#job-calibrate button");
  await page.mouse.down(); // what is drawn while a button is pressed does not take the press away
  await page.waitForSelector("table tbody tr:has-text('Diagnosis')");
  await page.mouse.up();
  await page.waitForSelector("#make-calibrate");
  seen.reports = await page.locator("table tbody tr").count();
  const opened = context.waitForEvent("page");
  await page.click("table tbody a");
  seen.report = await (await opened).textContent(".verdict");
}

async function phone() {
  await page.keyboard.press("Escape");
  expect(await page.locator("#phone").isHidden(), "no word about phones on a wide window");
  await page.setViewportSize({ width: 390, height: 844 });
  seen.phone = await page.textContent("#phone");
  expect(await page.locator("#phone").isVisible(), "the page to say what it can do on a phone");
  seen.overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  await picture("phone");
  await page.click("#telemetry");
  await page.waitForSelector("#telemetry-verdict");
  await picture("phone-telemetry");
}

await page.goto(address);
await page.waitForSelector(".zone");
await place();
await notRedWhileSaving();
await units();
await telemetry();
await reports();
await phone();
await browser.close();
expect(!faults.length, `no error in the page's console, found ${faults.join("; ")}`);
process.stdout.write(JSON.stringify(seen));
