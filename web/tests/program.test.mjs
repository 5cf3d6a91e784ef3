// The program as WebAssembly against the native one, in Node.js.
import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import test from "node:test";
import { native, ROOT, wasm } from "./common.mjs";

const scratch = mkdtempSync(path.join(tmpdir(), "flexarm-web-"));
test.after(() => rmSync(scratch, { recursive: true }));

const robot = (name) => path.join(ROOT, "robots", name, "robot.toml");
const rows = (file) => readFileSync(file, "utf8").trim().split("\n").slice(1).map((line) => line.split(",").map(Number));

/** Largest difference of a column from the native one, over the largest value of the column. */
function difference(a, b) {
  assert.equal(a.length, b.length);
  let largest = 0;
  for (let column = 0; column < a[0].length; column++) {
    const scale = Math.max(...b.map((row) => Math.abs(row[column])), 1e-9);
    largest = Math.max(largest, ...a.map((row, k) => Math.abs(row[column] - b[k][column]) / scale));
  }
  return largest;
}

for (const [name, more] of [
  ["kr210", []],
  ["kr210", ["--links", "modal"]],
  ["kr300", []],
  ["test/lower_arm", []],
  ["test/one_beam", ["--stepper", "spook"]],
  ["palletiser", []],
  ["manutec_r3", ["--drives", "servo"]],
]) {
  test(`a run of ${[name, ...more].join(" ")} has the numbers of the native program`, () => {
    const args = (folder) => ["compare", robot(name), ...more, "-o", path.join(scratch, folder), "--force", "--json", "--log-rate", "100"];
    const [ours, theirs] = [wasm(args("wasm")), native(args("native"))];
    assert.equal(ours.code, 0, ours.stderr);
    const [a, b] = [ours, theirs].map(({ stdout }) => JSON.parse(stdout));
    const off = difference(rows(path.join(scratch, "wasm", "run.csv")), rows(path.join(scratch, "native", "run.csv")));
    console.log(`${name} ${more.join(" ")}: ${off === 0 ? "equal bits" : off.toExponential(1)}; ${(1e3 * a.wall_s).toFixed(0)} ms, native ${(1e3 * b.wall_s).toFixed(0)} ms`);
    assert.ok(off <= 1e-7, `difference ${off}`);
    assert.equal(a.headline, b.headline);
    assert.deepEqual(a.warnings, b.warnings);
  });
}

test("errors are the sentences of the native program", () => {
  for (const args of [["compare", "/nowhere.toml"], ["compare", robot("kr210"), "--set", "payload.mas=1"], ["compare", robot("kr210"), "--step", "x"]]) {
    const [ours, theirs] = [wasm(args), native(args)];
    assert.equal(ours.code, theirs.code);
    assert.equal(ours.stderr, theirs.stderr);
  }
});
