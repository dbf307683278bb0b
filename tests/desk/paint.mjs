// Paints a session in a real browser: node paint.mjs OVERCOAT SESSION OUT MODULES
// OVERCOAT is the program, SESSION a built session, which is copied, OUT receives the copy and pictures, MODULES is a folder with
// node_modules of playwright-core and axe-core. DESK_PAGES names a folder of pages to use instead of those in the program.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [program, from, out, modules] = process.argv.slice(2);
const require = createRequire(path.resolve(modules, "x.js"));
const { chromium } = require("playwright-core");
const axe = fs.readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const session = path.join(out, "session");
fs.rmSync(session, { recursive: true, force: true });
fs.mkdirSync(out, { recursive: true });
fs.cpSync(from, session, { recursive: true });

/** Starts the server; gives its process and its address. */
function serve(...args) {
  const server = spawn(path.resolve(program), ["paint", "--no-browser", ...args], { cwd: session });
  return new Promise((done, failed) => {
    let said = "";
    server.stdout.on("data", (data) => {
      said += data;
      const address = said.match(/http:\S+/);
      if (address) done({ server, address: address[0] });
    });
    server.stderr.on("data", (data) => process.stderr.write(data));
    server.on("exit", () => failed(new Error(`the server has ended: ${said}`)));
  });
}

/** The file of a layer's strokes, or nothing. */
const strokes = (layer) => {
  const file = path.join(session, "paint", `${layer}.jsonl`);
  return fs.existsSync(file) ? fs.readFileSync(file, "utf8").trim().split("\n") : [];
};

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking"],
});
// One browser with several pages, which share what it keeps.
const context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
const said = [];
async function open(address) {
  const page = await context.newPage();
  page.setDefaultTimeout(120_000);
  page.on("console", (message) => said.push(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => said.push(`error: ${error.message}`));
  if (process.env.DESK_PAGES) await useFolder(page, process.env.DESK_PAGES);
  await page.goto(address);
  await page.waitForFunction(() => document.body.dataset.layer);
  return page;
}

async function useFolder(page, folder) {
  const read = (name) => fs.readFileSync(path.join(folder, name), "utf8");
  const names = ["pack.js", "math.js", "viewer.js", "surface.js", "outbox.js", "keys.js", "paint.js"];
  const lines = names.flatMap((name) => read(name).split("\n")).filter((line) => !line.startsWith("import "));
  const script = lines.map((line) => line.replace(/^export /, "")).join("\n");
  await page.route("**/paint.js", (route) => route.fulfill({ contentType: "text/javascript", body: script }));
  await page.route("**/paint.css", (route) => route.fulfill({ contentType: "text/css", body: read("page.css") + read("paint.css") }));
  await page.route(/\/\?token=/, async (route) => {
    const response = await route.fetch();
    const title = (await response.text()).match(/<title>(.*): paint</)?.[1] ?? "";
    await route.fulfill({ response, body: read("paint.html").replaceAll("{{SURFACE}}", "scan").replaceAll("{{TITLE}}", title).replace("{{ID}}", "test").replace(/<link rel="icon".*>/, "") });
  });
}

/** The place on the screen of the point of the scan that is nearest to a place relative to the middle of its box. */
const screenOf = (page, relative) =>
  page.evaluate((relative) => {
    const { easel, viewer } = window;
    const p = easel.layer.surface.positions;
    const { middle, facing } = easel.layer;
    const right = [facing[2], 0, -facing[0]];
    const wanted = [0, 1, 2].map((k) => middle[k] + right[k] * relative[0] + facing[k] * relative[2] + (k === 1 ? relative[1] : 0));
    let [best, at] = [Infinity, 0];
    for (let k = 0; k < p.length; k += 3) {
      const d = Math.hypot(p[k] - wanted[0], p[k + 1] - wanted[1], p[k + 2] - wanted[2]);
      if (d < best) [best, at] = [d, k];
    }
    const m = viewer.camera.matrix(viewer.aspect());
    const clip = [0, 1, 3].map((row) => m[row] * p[at] + m[4 + row] * p[at + 1] + m[8 + row] * p[at + 2] + m[12 + row]);
    const box = viewer.canvas.getBoundingClientRect();
    return [box.left + ((clip[0] / clip[2] + 1) / 2) * box.width, box.top + ((1 - clip[1] / clip[2]) / 2) * box.height];
  }, relative);

const labels = (page) => page.evaluate(() => Array.from(window.easel.layer.labels).join(""));
const idle = (page) => page.waitForFunction(() => window.easel.outbox.messages.length === 0 && !window.easel.path);
const state = (page) => page.textContent("#state");

async function drag(page, places) {
  await page.mouse.move(...places[0]);
  await page.mouse.down();
  for (const place of places.slice(1)) await page.mouse.move(...place, { steps: 4 });
  await page.mouse.up();
  await idle(page);
}

let number = 0;
const picture = (page, name) => page.screenshot({ path: path.join(out, `${String(++number).padStart(2, "0")}-${name}.png`) });

const { server, address } = await serve();
let page = await open(address);
const layer = await page.evaluate(() => window.easel.layer.name);
await picture(page, "begin");
const before = await labels(page);
const chest = [await screenOf(page, [-0.05, 0.25, 0.12]), await screenOf(page, [0.05, 0.25, 0.12])];

// A stroke, and back.
await page.keyboard.press("e");
await drag(page, chest);
assert.equal(strokes(layer).length, 1, await state(page));
const erased = await labels(page);
assert.notEqual(erased, before);
await picture(page, "erased");
console.log(`a stroke took ${Math.round(await page.evaluate(() => window.easel.lastMs))} ms on the server`);
await page.keyboard.press("z");
await idle(page);
assert.equal(strokes(layer).length, 0);
assert.equal(await labels(page), before, "undo takes the labels back");
await page.keyboard.press("y");
await idle(page);
assert.equal(await labels(page), erased, "redo brings them again");
await page.keyboard.press("z");
await idle(page);

// A lasso, a line, a mirrored stroke.
await page.keyboard.press("o");
const ring = [];
for (let k = 0; k <= 12; k++) ring.push(await screenOf(page, [0.06 * Math.sin(k / 2), 0.25 + 0.06 * Math.cos(k / 2), 0.12]));
await drag(page, ring);
assert.ok(JSON.parse(strokes(layer)[0]).closed, await state(page));
await picture(page, "lasso");
await page.keyboard.press("l");
await page.keyboard.press("c");
await drag(page, chest);
assert.equal(JSON.parse(strokes(layer)[1]).op, "clear");
await page.keyboard.press("b");
await page.keyboard.press("a");
await page.keyboard.press("m");
await drag(page, [await screenOf(page, [0.1, 0.05, 0.1]), await screenOf(page, [0.12, 0.08, 0.1])]);
assert.equal(strokes(layer).length, 4, "a stroke and its mirror image");
for (const count of [2, 1, 0]) {
  await page.keyboard.press("z");
  await idle(page);
  assert.equal(strokes(layer).length, count);
}
assert.equal(await labels(page), before);

// The verdict follows, and a second page sees what the first does.
const other = await open(address);
await page.keyboard.press("e");
await page.keyboard.press("m");
await drag(page, chest);
const painted = await labels(page);
await other.waitForFunction((painted) => Array.from(window.easel.layer.labels).join("") === painted, painted);
await page.waitForFunction(() => !document.querySelector("#verdict").textContent.includes("follows"));
console.log(await page.textContent("#verdict"));
await page.selectOption("#surface", "cut");
await page.waitForFunction(() => window.easel.layer.cut);
await page.keyboard.press("w");
await picture(page, "cut");
await page.keyboard.press("w");
await page.selectOption("#surface", "scan");

// The keyboard alone switches the layer.
const layers = await page.evaluate(() => window.easel.all.map((one) => one.name));
if (layers.length > 1) {
  await page.focus("#view");
  await page.keyboard.press(".");
  await page.waitForFunction((name) => document.body.dataset.layer === name, layers[1]);
  await picture(page, "second-layer");
  await page.keyboard.press(",");
  await page.waitForFunction((name) => document.body.dataset.layer === name, layers[0]);
}

for (const scheme of ["light", "dark"]) {
  await page.emulateMedia({ colorScheme: scheme });
  await page.evaluate(axe);
  const found = await page.evaluate(() => window.axe.run());
  const serious = found.violations.filter((one) => ["serious", "critical"].includes(one.impact));
  console.log(`axe, ${scheme}: ${serious.length} serious, ${found.violations.length} in all ${found.violations.map((one) => one.id).join(" ")}`);
  assert.deepEqual(serious.map((one) => `${one.id}: ${one.nodes[0].html}`), []);
}
await picture(page, "dark");
await page.setViewportSize({ width: 480, height: 900 });
await picture(page, "narrow");
await page.setViewportSize({ width: 1280, height: 800 });
assert.deepEqual(said, [], "nothing is said on the console");

// A stroke that would erase everything is refused; it is listed until it is discarded, also by the page loaded again.
await other.close();
const refused = () => page.textContent("#refused");
await page.evaluate(() => {
  const { outbox, layer } = window.easel;
  const strokes = [{ op: "erase", radius: 0.9, points: [layer.middle] }];
  outbox.put({ path: "/api/paint", layer: layer.name, what: "a stroke", body: { id: "all", layer: layer.name, scan: layer.scan, strokes } });
});
const reload = async () => {
  await page.reload();
  await page.waitForFunction(() => document.body.dataset.layer);
};
await page.waitForSelector("#refused button");
await reload();
assert.match(await refused(), /was not applied: .*is left/);
await picture(page, "refused");
await page.click("#refused button:last-of-type");
await reload();
assert.equal(await refused(), "");

// The server is killed: a stroke waits, and is applied once when a page of the same address is opened again.
const count = strokes(layer).length;
server.removeAllListeners("exit");
server.kill("SIGKILL");
await new Promise((done) => server.on("close", done));
const lower = [await screenOf(page, [-0.04, 0.1, 0.12]), await screenOf(page, [0.04, 0.1, 0.12])];
await page.mouse.move(...lower[0]);
await page.mouse.down();
await page.mouse.move(...lower[1], { steps: 4 });
await page.mouse.up();
await page.waitForFunction(() => document.querySelector("#state").textContent.includes("not saved yet"));
await picture(page, "killed");
console.log(await state(page));
const again = await serve("--port", new URL(address).port);
await page.waitForFunction(() => document.querySelector("#state").textContent.includes("started anew"));
console.log(await state(page));
const next = await open(again.address);
await idle(next);
assert.equal(strokes(layer).length, count + 1, "the stroke that waited is applied once");
await page.close({ runBeforeUnload: false });
await picture(next, "again");
again.server.removeAllListeners("exit");
again.server.kill("SIGINT");
await browser.close();
console.log("all is as it should be");
