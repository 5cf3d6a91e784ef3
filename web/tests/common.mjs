// What the tests share: the native program, and the files of the repository.
import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";
import path from "node:path";

export const WEB = path.resolve(import.meta.dirname, "..");
export const ROOT = path.resolve(WEB, "..");
export const WASM = path.join(WEB, "dist", "flexarm.wasm");
/** The native program. */
export const NATIVE = process.env.FLEXARM ?? path.join(ROOT, "target", "release", "flexarm");

function output(program, args) {
  try {
    const options = { cwd: ROOT, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"], env: { ...process.env, NO_COLOR: "1" } };
    return { code: 0, stdout: execFileSync(program, args, options), stderr: "" };
  } catch ({ status: code, stdout, stderr }) {
    return { code, stdout, stderr };
  }
}

/** Runs the native program; returns its exit code, and what it printed. */
export function native(args) {
  if (!existsSync(NATIVE)) throw new Error(`${NATIVE} is not there: cargo build --release, or set FLEXARM`);
  return output(NATIVE, args);
}

/** Runs the program as WebAssembly in Node.js. */
export const wasm = (args) => output(process.execPath, ["--no-warnings", path.join(import.meta.dirname, "run.mjs"), ...args]);
