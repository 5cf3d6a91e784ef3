import { defineConfig } from "vite";

// Relative addresses: the page works in any folder of a static server.
const input = ["index.html", "rerun.html"];
export default defineConfig({ base: "./", worker: { format: "es" }, build: { target: "es2022", rolldownOptions: { input } } });
