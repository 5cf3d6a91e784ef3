// The built page in Chromium, served by `flexarm serve`.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import path from "node:path";
import test from "node:test";
import { gzipSync } from "node:zlib";
import { chromium } from "playwright-core";
import { NATIVE, native, ROOT, WEB } from "./common.mjs";

const DIST = path.join(WEB, "dist");
const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";
const PICTURES = process.env.PICTURES; // folder for screenshots

let server;
let browser;
let home;

test.before(async () => {
  server = spawn(NATIVE, ["serve", "--no-open", "--json"], { cwd: ROOT, stdio: ["ignore", "pipe", "inherit"] });
  home = JSON.parse(await new Promise((done) => server.stdout.once("data", done))).url;
  const args = ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
  browser = await chromium.launch({ executablePath: CHROMIUM, args });
});
test.afterEach(() => Promise.all(browser.contexts().map((context) => context.close())));
test.after(async () => {
  await browser?.close();
  server?.kill();
});

/** Opens the page; anything that it complains of fails the test. */
async function open(hash = "", options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  page.complaints = [];
  page.on("console", (message) => message.type() === "error" && page.complaints.push(message.text()));
  page.on("pageerror", (error) => page.complaints.push(String(error)));
  page.on("request", (request) => !request.url().startsWith(home) && !/^(blob|data):/.test(request.url()) && page.complaints.push(`asks ${request.url()}`));
  await page.goto(home + hash);
  await settled(page);
  return page;
}

const settled = (page) => page.waitForFunction(() => !document.getElementById("result").classList.contains("busy") && /TCP error|^The run did not/.test(document.getElementById("headline").textContent), undefined, { timeout: 60_000 });
const headline = (page) => page.textContent("#headline");
const picture = async (page, name) => PICTURES && (await page.screenshot({ path: path.join(PICTURES, `${name}.png`), fullPage: true }));
const native_headline = (...args) => JSON.parse(native(["compare", ...args, "--no-files", "--json"]).stdout).headline;

test("the first arm runs by itself and has the peak of the command line", async () => {
  const page = await open();
  assert.equal(await headline(page), native_headline("fanuc_r2000_210f"));
  assert.match(await page.textContent("#instant"), /at 0\.75 s: 3\.83\d mm/);
  assert.ok((await page.locator("#downloads a").allTextContents()).includes("report.html"));
  await picture(page, "desktop");
  assert.deepEqual(page.complaints, []);
});

test("each robot of the gallery runs", async () => {
  const page = await open("#robot=test/one_beam");
  const names = await page.locator("#robot option").evaluateAll((options) => options.map((option) => option.value));
  assert.ok(names.length >= 13, names.join(" "));
  for (const name of names) {
    await page.selectOption("#robot", name);
    await settled(page);
    assert.match(await headline(page), /^TCP error/, `${name}: ${await page.textContent("#messages")}`);
  }
  assert.deepEqual(page.complaints, []);
});

test("sliders change the run as the options of the command line do, and the address keeps them", async () => {
  const page = await open("#robot=kr210&payload=75&speed=0.8&stiffness=2");
  const changes = ["--set", "payload.mass=75", "--set", "motion.speed=0.8", "--set", "drive.*.gearbox.stiffness*=2"];
  assert.equal(await headline(page), native_headline("kr210", ...changes));
  await page.locator("#slider-payload").focus();
  await page.keyboard.press("ArrowRight");
  await settled(page);
  await page.waitForFunction(() => /payload=8/.test(location.hash));
  await page.click("#reset");
  await page.waitForFunction(() => location.hash === "#robot=fanuc_r2000_210f");
  await settled(page);
  assert.equal(await headline(page), native_headline("fanuc_r2000_210f"));
});

test("a description with its meshes is enough: it gets a robot file and a motion", async () => {
  const page = await open("#robot=test/one_beam");
  await page.setInputFiles("#choose-folder", path.join(ROOT, "robots", "kr210"));
  await page.waitForFunction(() => document.getElementById("robot").value.startsWith("/mine"));
  await settled(page);
  assert.equal(await headline(page), native_headline("kr210"));
  const bare = await open("#robot=test/one_beam");
  await bare.setInputFiles("#choose", [path.join(ROOT, "robots", "test", "reference_arm", "reference_arm.urdf")]);
  await bare.waitForFunction(() => document.getElementById("robot").value.startsWith("/mine"));
  await settled(bare);
  assert.match(await headline(bare), /^TCP error/, await bare.textContent("#messages"));
});

test("a damaged file gets the sentence of the command line", async () => {
  const page = await open("#robot=test/one_beam");
  const text = readFileSync(path.join(ROOT, "robots", "test", "reference_arm", "reference_arm.urdf"), "utf8");
  const broken = text.replace(/<child link="[^"]*"\/>/, "");
  await page.setInputFiles("#choose", { name: "broken.urdf", mimeType: "application/xml", buffer: Buffer.from(broken) });
  await page.waitForFunction(() => !document.getElementById("messages").hidden);
  assert.match(await page.textContent("#messages"), /^error: .*broken\.urdf/);
  await picture(page, "broken");
});

test("a motion, a picture and a broken file leave the robot as it is", async () => {
  const page = await open("#robot=kr210");
  const robot = () => page.inputValue("#robot");
  await page.setInputFiles("#choose", { name: "photo.png", mimeType: "image/png", buffer: Buffer.from([0x89, 0x50, 0x4e, 0x47]) });
  await page.getByText("photo.png: no robot").waitFor();
  assert.equal(await robot(), "kr210");
  await page.setInputFiles("#choose", path.join(ROOT, "trajectories", "milling_square.toml"));
  await page.waitForFunction(() => document.getElementById("motion").value.startsWith("/mine"));
  await settled(page);
  assert.deepEqual([await robot(), await headline(page)], ["kr210", native_headline("kr210", "milling_square")]);
  await page.setInputFiles("#choose", { name: "broken.urdf", mimeType: "application/xml", buffer: Buffer.from("<robot name='x'>") });
  await page.waitForFunction(() => document.getElementById("result").classList.contains("failed"));
  assert.equal(await robot(), "kr210");
});

test("sliders return to the values of the file", async () => {
  const page = await open("#robot=kr210&payload=173&stiffness=1.07");
  for (const [name, key, times] of [["payload", "ArrowLeft", 3], ["stiffness", "ArrowLeft", 1]]) {
    await page.locator(`#slider-${name}`).focus();
    for (let k = 0; k < times; k++) await page.keyboard.press(key);
  }
  await page.waitForFunction(() => location.hash === "#robot=kr210");
  await settled(page);
  assert.equal(await headline(page), native_headline("kr210"));
});

test("meshes of package:// are found among files chosen without their folders", async () => {
  const page = await open("#robot=kr210");
  const stl = path.join(ROOT, "robots", "kr210", "meshes");
  const mesh = readdirSync(stl).find((name) => name.endsWith(".stl"));
  const inertial = "<inertial><mass value='5'/><inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial>";
  const urdf = `<robot name='two'><link name='base'/><link name='arm'>${inertial}<visual><geometry><mesh filename='package://my_arm/meshes/${mesh}'/></geometry></visual></link><link name='tool0'/>
    <joint name='j' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='900' velocity='1'/></joint>
    <joint name='f' type='fixed'><parent link='arm'/><child link='tool0'/><origin xyz='0.5 0 0'/></joint></robot>`;
  await page.setInputFiles("#choose", [{ name: "two.urdf", mimeType: "application/xml", buffer: Buffer.from(urdf) }, { name: mesh, mimeType: "model/stl", buffer: readFileSync(path.join(stl, mesh)) }]);
  await page.waitForFunction(() => document.getElementById("robot").value.startsWith("/mine"));
  await settled(page);
  assert.doesNotMatch((await page.textContent("#notes")) + (await page.textContent("#messages")), /not found|does not exist/);
});

test("the page fits a phone, in light and dark", async () => {
  const page = await open("", { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, colorScheme: "dark" });
  const [inner, whole] = await page.evaluate(() => [innerWidth, document.documentElement.scrollWidth]);
  assert.ok(whole <= inner, `${whole} of ${inner}`);
  await picture(page, "phone");
});

test("time is moved by keyboard, and the arm with it", async () => {
  const page = await open("#robot=kr210");
  const pixels = () => page.evaluate(() => document.getElementById("arm").toDataURL());
  const before = await pixels();
  await page.locator("#time").focus();
  await page.keyboard.press("Home");
  assert.equal(await page.textContent("#clock"), "0.00 s");
  assert.notEqual(await pixels(), before);
  await page.locator("#play").focus();
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => Number.parseFloat(document.getElementById("clock").textContent) > 0.2);
});

test("the recording opens in the viewer of Rerun, also that of the next run", async () => {
  const page = await open("#robot=test/one_beam");
  await page.click("#rerun summary");
  const shown = () => page.frameLocator("#rerun iframe").locator("body[data-state=shown]").waitFor({ timeout: 120_000 });
  await shown();
  await page.selectOption("#links", "modal");
  await settled(page);
  await shown();
  await page.waitForTimeout(PICTURES ? 5000 : 0);
  await picture(page, "rerun");
  assert.deepEqual(page.complaints, []);
});

test("a copy without the viewer says so", async () => {
  const page = await open("#robot=test/one_beam");
  await page.route("**/rerun.html", (route) => route.fulfill({ status: 404 }));
  await page.click("#rerun summary");
  await page.getByText("This copy of the page has no viewer").waitFor();
});

test("memory stays flat over many runs", async () => {
  const page = await open("#robot=test/one_beam");
  const session = await page.context().newCDPSession(page);
  const heap = async () => {
    await session.send("HeapProfiler.collectGarbage");
    const { usedSize } = await session.send("Runtime.getHeapUsage");
    return usedSize / 1e6;
  };
  const run = async (k) => {
    await page.selectOption("#stepper", k % 2 === 0 ? "sdirk3" : "");
    await settled(page);
  };
  for (let k = 0; k < 10; k++) await run(k);
  const before = await heap();
  for (let k = 0; k < 100; k++) await run(k);
  const after = await heap();
  console.log(`heap of the page ${before.toFixed(1)} MB after 10 runs, ${after.toFixed(1)} MB after 110`);
  assert.ok(after < before + 10, `${before} to ${after} MB`);
});

test("the first load is small", () => {
  const first = ["index.html", "flexarm.wasm", "shipped.json"].map((name) => path.join(DIST, name));
  const assets = readFileSync(path.join(DIST, "index.html"), "utf8").matchAll(/assets\/[\w.-]+/g);
  const files = [...first, ...[...assets].map(([name]) => path.join(DIST, name))];
  const size = files.reduce((sum, file) => sum + gzipSync(readFileSync(file)).length, 0) / 1e6;
  console.log(`first load ${size.toFixed(2)} MB compressed`);
  assert.ok(size < 6.1); // measured 6.04
});
