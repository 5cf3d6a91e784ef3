// Runs the program in Node.js: node run.mjs ARGUMENTS. A process each: node:wasi closes the standard streams.
import { readFileSync } from "node:fs";
import { WASI } from "node:wasi";
import { WASM } from "./common.mjs";

const wasi = new WASI({ version: "preview1", args: ["flexarm", ...process.argv.slice(2)], env: { NO_COLOR: "1" }, preopens: { "/": "/" } });
process.exitCode = wasi.start(new WebAssembly.Instance(new WebAssembly.Module(readFileSync(WASM)), wasi.getImportObject()));
