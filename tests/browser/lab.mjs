// Goes the lab's loop in a real browser, by mouse and by keyboard, and writes down what it saw; tests/tests/program/lab_browser.rs judges.
// node lab.mjs MODULES CHROMIUM SCREENSHOTS STUDY_URL PROCESS FIGURES [EMPTY_URL LOG FRAMES]

import { createRequire } from "node:module";
import { readFileSync, readdirSync } from "node:fs";
import { createServer } from "node:net";

const [modules, executablePath, shots, studyUrl, lab, figuresFile, emptyUrl, log, frames] = process.argv.slice(2);
const require = createRequire(`${modules}/`);
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const figures = JSON.parse(readFileSync(figuresFile, "utf8"));
const seen = { console: [], outside: [], errors: [], axe: [], steps: [], seconds: {} };

const browser = await chromium.launch({
  executablePath,
  args: ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"],
});

async function open(url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ...options });
  const page = await context.newPage();
  page.on("console", (message) => seen.console.push(`${message.text()} ${message.location().url}`));
  page.on("pageerror", (error) => seen.errors.push(error.message));
  page.on("request", (request) => {
    const { hostname, protocol } = new URL(request.url());
    if (hostname !== "127.0.0.1" && !["blob:", "data:", "file:"].includes(protocol)) seen.outside.push(request.url());
  });
  await page.goto(url);
  return page;
}

const step = (words) => seen.steps.push(words);
const check = (holds, words) => { if (!holds) throw new Error(words); };
const picture = (page, name) => page.screenshot({ path: `${shots}/${name}.png` });

/** Holds the command that the lab runs, so that it is still there however fast the machine is. */
function hold() {
  const threads = readdirSync(`/proc/${lab}/task`);
  const children = threads.flatMap((thread) => readFileSync(`/proc/${lab}/task/${thread}/children`, "utf8").split(" ").filter(Boolean));
  check(children.length === 1, `one command runs, not ${children.length}`);
  process.kill(Number(children[0]), "SIGSTOP");
}

/** Waits until nothing runs and the plots rest on the newest view. */
async function rest(page) {
  await page.waitForFunction(() => !document.getElementById("cancel") && document.documentElement.dataset.drawn, null, { timeout: 120_000 });
  await page.waitForTimeout(300);
  await page.waitForFunction(() => document.documentElement.dataset.drawn !== "all" || chosen.moved === 1);
}

/** Does something that starts a command, and waits for its end. */
async function run(page, start) {
  const before = await page.locator("footer code").textContent().catch(() => "");
  await start();
  await page.waitForFunction((old) => document.getElementById("cancel") || document.querySelector("footer code")?.textContent !== old, before);
  await rest(page);
}

/** The same for what ends with another view on the stage: the plots may move before it is drawn. */
async function redrawn(page, start) {
  const before = await page.evaluate(() => document.documentElement.dataset.view);
  await run(page, start);
  await page.waitForFunction((old) => document.documentElement.dataset.view !== old, before);
  await rest(page);
}

/** Presses a button in the page and gives the seconds until the view that comes of it has been painted. */
function toPixels(page, button) {
  return page.evaluate((selector) => new Promise((done) => {
    const root = document.documentElement;
    const old = root.dataset.view;
    const begun = performance.now();
    const watch = new MutationObserver(() => {
      if (root.dataset.view === old) return;
      watch.disconnect();
      // The first frame is about to be painted, the second one comes after that.
      requestAnimationFrame(() => requestAnimationFrame(() => done((performance.now() - begun) / 1000)));
    });
    watch.observe(root, { attributes: true });
    document.querySelector(selector).click();
  }), button);
}

/** Serious faults that axe-core finds. */
async function judge(page, name) {
  await page.evaluate(axe);
  const found = await page.evaluate(() => axe.run());
  for (const fault of found.violations.filter((v) => ["serious", "critical"].includes(v.impact))) {
    seen.axe.push(`${name}: ${fault.id}: ${fault.nodes.map((n) => n.html.slice(0, 120)).join(" | ")}`);
  }
}

/** Moves the focus with Tab until it stands on the element of this id. */
async function tabTo(page, id) {
  for (let presses = 0; presses < 200; presses += 1) {
    if (await page.evaluate((wanted) => document.activeElement.id === wanted, id)) return;
    await page.keyboard.press("Tab");
  }
  throw new Error(`no Tab leads to ${id}`);
}

async function byMouse() {
  const page = await open(studyUrl);
  await rest(page);
  await judge(page, "compare");
  await page.click("#tab-errors");
  const cells = await page.locator("#errors table tbody td.number").allTextContents();
  for (const record of figures.records.filter((r) => !r.axes.x.rests)) {
    const wanted = await page.evaluate((e) => percent(e), record.axes.x.relative_error);
    check(cells.includes(wanted), `${record.file}: ${wanted} is not among ${cells}`);
  }
  step("the page shows the figures of the command line");
  await page.click("#tab-where");
  await page.click(".region >> nth=0");
  check(await page.evaluate(() => chosen.region !== null), "a region is chosen");
  await page.click(".region >> nth=0");
  const map = await page.locator("#where canvas").first().boundingBox();
  await page.locator("#where canvas").first().scrollIntoViewIfNeeded();
  const at = await page.evaluate(() => {
    const plot = document.querySelector("#where canvas");
    const region = contents.regions.find((r) => r.version === chosen.version && r.axis === 0 && r.conditions && r.conditions.some((c) => c.state < 2));
    return region ? { y: plot.map.up(0), x: plot.map.across(0) } : null;
  });
  if (at && map) await page.locator("#where canvas").first().click({ position: at });
  await picture(page, "1-region");
  step("a region is chosen by button and on the map");

  await redrawn(page, () => page.click("#diagnose"));
  check((await page.locator(".verdict").first().textContent()).includes("coulomb@x"), "the verdict names the effect");
  await page.click("#candidates .candidate >> nth=1");
  await judge(page, "diagnosed");
  await picture(page, "2-candidate");
  await page.click("#candidates .candidate >> nth=0");
  step("candidates are laid over the residual");

  const errorOf = () => page.locator(".meter").first().getAttribute("data-error");
  const before = Number(await errorOf());
  const pressed = toPixels(page, "#candidates button.add");
  await page.waitForFunction(() => contents.versions.length === 2 && chosen.version === 1 && chosen.moved > 0.2, null, { timeout: 60_000 });
  seen.seconds.add = await pressed;
  await picture(page, "3-moving");
  await rest(page);
  const after = Number(await errorOf());
  // A measured joint holds more than one effect.
  check(after < (emptyUrl ? 0.1 : 0.4) * before, `the error falls: ${before} to ${after}`);
  await picture(page, "4-added");
  step("the effect is added and the error falls");

  await page.click("#tab-models");
  await picture(page, "5-models");
  await redrawn(page, async () => { seen.seconds.compare = await toPixels(page, "#undo"); });
  check(Number(await errorOf()) === before, "undo brings the old error back");
  step("undo");
  await page.click("#tab-models");
  await redrawn(page, () => page.click("button[aria-label^='Lay']:not([disabled]) >> nth=0"));
  check(await page.evaluate(() => contents.versions.length === 2), "two models side by side");
  await run(page, () => page.click("#export"));
  await run(page, () => page.click("#replay"));
  check((await page.locator("#commands pre").first().textContent()).includes("device's integers"), "replay prints what it prints");
  await picture(page, "6-commands");
  for (const [id, ending] of [["keep-report", ".html"], ["keep-model", ".json"], ["keep-blob", ".bin"]]) {
    const [kept] = await Promise.all([page.waitForEvent("download"), page.click(`#${id}`)]);
    check(kept.suggestedFilename().endsWith(ending), kept.suggestedFilename());
    if (ending === ".html") await kept.saveAs(`${shots}/report.html`);
  }
  step("models side by side, export, replay, downloads");
  for (const tab of await page.locator("[role=tab]").all()) {
    await tab.click();
    await judge(page, await tab.textContent());
  }
  return page;
}

async function byKeyboard() {
  const page = await open(studyUrl);
  await rest(page);
  await tabTo(page, "identify-physical");
  await redrawn(page, () => page.keyboard.press("Enter"));
  await tabTo(page, "diagnose");
  await redrawn(page, () => page.keyboard.press("Enter"));
  await tabTo(page, "add-found");
  await redrawn(page, () => page.keyboard.press("Space"));
  check(await page.evaluate(() => document.activeElement.id) === "undo", "the keyboard keeps its place");
  check(await page.evaluate(() => chosen.version === 1), "added by keyboard");
  await page.keyboard.press("b");
  await page.waitForFunction(() => chosen.version === 0 && chosen.moved === 1);
  await tabTo(page, "undo");
  await redrawn(page, () => page.keyboard.press("Enter"));
  const tab = await page.evaluate(() => document.querySelector("[role=tab][aria-selected=true]").id);
  await tabTo(page, tab);
  await page.keyboard.press("ArrowRight");
  check(await page.evaluate((old) => document.activeElement.id !== old && document.activeElement.getAttribute("role") === "tab", tab), "arrows move between tabs");
  step("the loop by keyboard alone");

  // A command survives a reload and is seen, and ended, in another tab.
  await tabTo(page, "identify-network");
  await page.keyboard.press("Enter");
  await page.waitForSelector("#cancel");
  hold();
  await page.reload();
  await page.waitForSelector("#cancel");
  const other = await open(studyUrl);
  await other.waitForSelector("#cancel");
  await picture(other, "7-running");
  await other.click("#cancel");
  await rest(page);
  check((await page.locator("footer .said").textContent()).includes("Cancelled"), "ended from another tab");
  await other.close();
  step("two tabs share one state, and a reload loses nothing");
  return page;
}

async function atRest(page) {
  const session = await page.context().newCDPSession(page);
  // Processor time, not the clock's: other programs on the machine take their share of that.
  await session.send("Performance.enable", { timeDomain: "threadTicks" });
  const busy = async () => (await session.send("Performance.getMetrics")).metrics.find((m) => m.name === "TaskDuration").value;
  await page.waitForTimeout(1500);
  const begun = await busy();
  await page.waitForTimeout(4000);
  seen.idle = (await busy() - begun) / 4;
}

/** The report that was downloaded, from its file alone. */
async function aReport() {
  for (const [name, options] of [["15-report", {}], ["16-report-narrow-dark", { viewport: { width: 390, height: 844 }, colorScheme: "dark" }]]) {
    const page = await open(`file://${shots}/report.html`, options);
    await page.waitForFunction(() => document.documentElement.dataset.drawn === "all");
    await judge(page, name);
    await page.screenshot({ path: `${shots}/${name}.png`, fullPage: true });
    await page.close();
  }
  step("the report by itself");
}

async function narrowAndDark() {
  for (const [name, options] of [["8-narrow", { viewport: { width: 390, height: 844 } }], ["9-dark", { colorScheme: "dark" }]]) {
    const page = await open(studyUrl, options);
    await rest(page);
    const wide = await page.evaluate(() => document.scrollingElement.scrollWidth);
    check(wide <= options.viewport?.width || !options.viewport, `${name}: ${wide} pixels wide`);
    await judge(page, name);
    await picture(page, name);
    if (options.viewport) await page.screenshot({ path: `${shots}/${name}-whole.png`, fullPage: true });
    await page.close();
  }
  step("390 by 844, and dark");
}

async function aDroppedLog() {
  const page = await open(emptyUrl);
  await page.waitForSelector(".drop");
  await picture(page, "10-empty");
  await page.setInputFiles("#pick", log);
  await page.waitForSelector("#init:not([disabled])", { timeout: 60_000 });
  await page.waitForTimeout(300);
  await judge(page, "draft");
  await picture(page, "11-draft");
  // The press on the button takes the focus from the field, so that the draft is asked for anew while the button is
  // held; what is asked for once the study is being written comes after it was opened.
  await page.fill("#inertia", "1.8");
  let asked = 0;
  await page.route("**/api/draft", async (route) => {
    const answer = await route.fetch();
    asked += 1;
    if (asked > 1) await new Promise((done) => setTimeout(done, 1500));
    await route.fulfill({ response: answer });
  });
  await page.click("#init", { delay: 600 });
  await page.waitForSelector(".welcome", { timeout: 60_000 });
  await page.waitForTimeout(1800);
  check(await page.locator(".welcome").isVisible(), "a late draft is not drawn over the study");
  await judge(page, "welcome");
  await picture(page, "12-welcome");
  await run(page, () => page.click("#identify-polynomial"));
  await picture(page, "13-first-model");
  step("a dropped log becomes a study and a model");
  await page.close();
}

/** A device behind a TCP port, which has said what is in a file and then keeps silent. */
async function aLiveDevice() {
  const device = createServer((line) => {
    line.on("error", () => {});
    line.write(readFileSync(frames));
  });
  await new Promise((done) => device.listen(0, "127.0.0.1", done));
  const page = await open(studyUrl);
  await rest(page);
  await page.click("#to-live");
  await page.waitForFunction(() => document.getElementById("live-state").textContent.includes("No device"));
  await page.fill("#live-place", `127.0.0.1:${device.address().port}`);
  await page.press("#live-place", "Enter");
  await page.waitForFunction(() => {
    const plots = [...document.querySelectorAll("#live-plots canvas")];
    return plots.length === 6 && plots.every((p) => p.dataset.columns === undefined || Number(p.dataset.columns) > 350)
      && Number(plots[2].dataset.points) > 500;
  });
  check((await page.locator("#live-events").textContent()).includes("firmware"), "the device has introduced itself");
  await judge(page, "live");
  await picture(page, "14-live");
  await page.waitForFunction(() => document.querySelector("#live-state .state").textContent === "silent");
  check((await page.locator("#live-state").textContent()).includes("no frames for"), "silence is told");
  await page.click("#live-leave");
  await page.waitForFunction(() => document.getElementById("live-state").textContent.includes("No device"));
  await page.click("#to-live");
  check(await page.locator("#time canvas, #time .uplot").first().isVisible(), "the stage is back");
  await page.close();
  device.close();
  step("a device live");
}

try {
  await (await byMouse()).close();
  const page = await byKeyboard();
  await atRest(page);
  await page.close();
  await aReport();
  if (emptyUrl) {
    await narrowAndDark();
    await aDroppedLog();
    await aLiveDevice();
  }
} catch (error) {
  seen.errors.push(String(error.stack || error));
}
await browser.close();
console.log(JSON.stringify(seen));
