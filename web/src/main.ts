// The page: settings on the left, the run on the right.
import { parse } from "smol-toml";
import { ErrorChart } from "./chart";
import { DROPPED, isPart, placePackages, readChosen, readDrop, sortOut } from "./dropped";
import type { Files } from "./program";
import type { Recording } from "./recording";
import { ArmScene, locate } from "./scene";
import { fetchFiles, loadShipped, type Shipped } from "./shipped";
import "./style.css";
import type { Answer, Job, Loading } from "./worker";

const get = <T extends HTMLElement = HTMLElement>(id: string): T => document.getElementById(id) as T;
const choice = (id: string): HTMLSelectElement => get<HTMLSelectElement>(id);
const SELECTS = ["links", "drives", "stepper", "magnify"];
const STEPPERS = ["generalized-alpha", "extrapolated-alpha", "sdirk3", "spook", "rk4", "reference"];
const OUT = "/out";
const FIRST_ROBOT = "fanuc_r2000_210f";

interface Summary {
  headline: string;
  end: string;
  duration_s: number;
  warnings: string[];
  wall_s: number;
  frequencies_hz: number[];
}

// The program, one run at a time.
const worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
const waiting = new Map<number, (answer: Answer) => void>();
let jobs = 0;
worker.onmessage = ({ data }: MessageEvent<Answer | Loading>) => {
  if ("id" in data) {
    waiting.get(data.id)?.(data);
    waiting.delete(data.id);
  } else if (jobs > 0 && !shown) {
    const of = data.total > data.loaded ? ` of ${(data.total / 1e6).toFixed(1)}` : "";
    get("headline").textContent = `Loading the program: ${(data.loaded / 1e6).toFixed(1)}${of} MB`;
  }
};
worker.onerror = (event) => fail(`error: the program did not start: ${event.message ?? "unknown reason"}`);

function start(args: string[], files: Files, recording?: string): Promise<Answer> {
  const id = ++jobs;
  worker.postMessage({ id, args, files, recording } satisfies Job);
  return new Promise((done) => waiting.set(id, done));
}

// State.
let shipped: Shipped = { robots: [], motions: [] };
let mine: Files = new Map();
const fetched: Files = new Map();
let shown: Recording | undefined;
let time = 0;
let playing = false;
let busy = false;
let again = false;
/** Values of the sliders that differ from the file. */
let values = new Map<string, number>();

interface Slider {
  key: string;
  label: string;
  /** Value with unit; `#` is the number. */
  unit: string;
  neutral: number;
  min: number;
  max: number;
  /** Step of the slider, on which the neutral value lies; of the power of two if `powers`. */
  step: number;
  /** Positions of the slider are powers of two. */
  powers: boolean;
  /** Changes that a value makes. */
  changes: (value: number) => string[];
}
let sliders: Slider[] = [];

const scene = new ArmScene(get<HTMLCanvasElement>("arm"));
const chart = new ErrorChart(get("chart"), (to) => seek(to));

function fail(text: string): void {
  get("result").classList.add("failed");
  get("messages").hidden = false;
  get("messages").textContent = text;
  get("headline").classList.add("bad");
  get("headline").textContent = `The run did not succeed${shown ? "; below is the one before" : ""}.`;
}

/** Path of the robot in the program's file system. */
const robotPath = (): string => (choice("robot").value.startsWith("/") ? choice("robot").value : `/robots/${choice("robot").value}/robot.toml`);

async function files(): Promise<Files> {
  const name = choice("robot").value;
  const own = shipped.robots.find((robot) => robot.name === name);
  const motions = shipped.motions.flatMap((motion) => motion.files);
  await fetchFiles([...(own?.files ?? []), ...motions], fetched);
  return new Map([...fetched, ...mine]);
}

/** Returns the sliders that a robot file has entries for. */
function slidersOf(text: string): Slider[] {
  const found: Slider[] = [];
  let file: Record<string, any>;
  try {
    file = parse(text);
  } catch {
    return []; // the program says what is wrong, and where
  }
  const mass = file.payload?.mass;
  if (typeof mass === "number" && mass > 0) {
    found.push({ key: "payload", label: "Payload", unit: "# kg", neutral: mass, min: 0.05 * mass, max: 2 * mass, step: 0.05 * mass, powers: false, changes: (x) => [`payload.mass=${x}`] });
  }
  found.push({ key: "speed", label: "Speed of the motion", unit: "× #", neutral: 1, min: 0.2, max: 1.6, step: 0.05, powers: false, changes: (x) => [`motion.speed=${x}`] });
  const drives: Record<string, any>[] = Array.isArray(file.drive) ? file.drive : [];
  for (const [key, label] of [["stiffness", "Stiffness of the gearboxes"], ["damping", "Damping of the gearboxes"]]) {
    const numeric = (value: unknown): boolean => typeof value === "number" || (Array.isArray(value) && value.every(numeric));
    const joints = drives.filter((drive) => numeric(drive.gearbox?.[key])).map((drive) => drive.joint);
    if (joints.length > 0) {
      const changes = (x: number) => joints.map((joint) => `drive."${joint}".gearbox.${key}*=${x}`);
      found.push({ key, label, unit: "× #", neutral: 1, min: 0.25, max: 4, step: 0.1, powers: true, changes });
    }
  }
  return found;
}

function showSliders(): void {
  get("sliders").replaceChildren(
    ...sliders.map((slider) => {
      const label = document.createElement("label");
      const [input, output] = [document.createElement("input"), document.createElement("output")];
      const of = (x: number) => (slider.powers ? Math.log2(x) : x);
      const back = (x: number) => Number((slider.powers ? 2 ** x : x).toPrecision(3));
      Object.assign(input, { type: "range", id: `slider-${slider.key}`, min: String(of(slider.min)), max: String(of(slider.max)) });
      const write = () => (output.textContent = slider.unit.replace("#", String(Number((values.get(slider.key) ?? slider.neutral).toPrecision(3)))));
      input.step = String(slider.step);
      input.value = String(of(values.get(slider.key) ?? slider.neutral));
      input.addEventListener("input", () => {
        // Exactly the value of the file, whatever its digits.
        if (Math.abs(Number(input.value) - of(slider.neutral)) < slider.step / 2) values.delete(slider.key);
        else values.set(slider.key, back(Number(input.value)));
        write();
        run();
      });
      write();
      label.append(slider.label, " ", output, input);
      return label;
    }),
  );
}

function line(): string[] {
  const args = ["compare", robotPath()];
  if (choice("motion").value !== "") args.push(choice("motion").value);
  for (const name of SELECTS) if (choice(name).value !== "") args.push(`--${name}`, choice(name).value);
  for (const slider of sliders) {
    const value = values.get(slider.key);
    if (value !== undefined && value !== slider.neutral) for (const change of slider.changes(value)) args.push("--set", change);
  }
  return args;
}

/** Runs with the settings of the page; the last settings win. */
async function run(): Promise<void> {
  again = true;
  if (busy) return;
  busy = true;
  get("result").classList.add("busy");
  while (again) {
    again = false;
    keepInLink();
    try {
      const args = [...line(), "-o", OUT, "--json"];
      show(await start(args, await files(), `${OUT}/run.mcap`));
    } catch (error) {
      fail(`error: ${error instanceof Error ? error.message : String(error)}`);
    }
  }
  busy = false;
  get("result").classList.remove("busy");
}

function show(answer: Answer): void {
  if (!answer.recording) {
    fail(answer.stderr || answer.stdout || "error: the program gave no answer");
    return;
  }
  const summary: Summary = JSON.parse(answer.stdout);
  get("messages").hidden = true;
  get("result").classList.remove("failed");
  get("headline").classList.remove("bad");
  get("headline").textContent = summary.headline;
  const same = shown !== undefined && shown.robot === answer.recording.robot && shown.motion === answer.recording.motion;
  shown = answer.recording;
  scene.show(shown);
  chart.show(shown);
  showGroups(shown);
  get<HTMLInputElement>("time").max = String(end());
  const notes = summary.warnings.map((text) => Object.assign(document.createElement("li"), { textContent: text }));
  const list = Object.assign(document.createElement("ul"), { id: "caveats" });
  list.append(...notes);
  const lowest = summary.frequencies_hz[0];
  const facts = document.createElement("p");
  facts.textContent = `${lowest === undefined ? "" : `First natural frequency ${lowest.toFixed(2)} Hz. `}${summary.duration_s.toFixed(2)} s of motion computed in ${summary.wall_s.toFixed(2)} s.${firstAnswer()}`;
  get("notes").replaceChildren(facts, ...(notes.length > 0 ? [Object.assign(document.createElement("h2"), { textContent: "Read this before you rely on it" }), list] : []));
  showDownloads(answer.files);
  mcap = answer.files.get(`${OUT}/run.mcap`);
  showInRerun();
  // Begin at the largest error: it is what one asks for.
  seek(same ? Math.min(time, end()) : shown.times[shown.error.indexOf(Math.max(...shown.error))] ?? 0);
}

let first: number | undefined;
/** Says once how long the page took to its first answer. */
function firstAnswer(): string {
  if (first !== undefined) return "";
  first = performance.now() / 1000;
  return ` First answer ${first.toFixed(1)} s after the page was opened.`;
}

function showGroups(recording: Recording): void {
  const names: [string, string][] = [["flexible", "arm"], ["rigid", "rigid"], ["magnified", `deflection x ${Number(recording.magnification.toPrecision(2))}`]];
  get("groups").replaceChildren(
    ...names.filter(([group]) => scene.has(group)).map(([group, text]) => {
      const label = document.createElement("label");
      const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: true });
      box.addEventListener("change", () => scene.setVisible(group, box.checked));
      label.append(box, ` ${text}`);
      return label;
    }),
  );
}

const TYPES: Record<string, string> = { html: "text/html", csv: "text/csv", json: "application/json", md: "text/markdown" };
/** The files that most want, first. */
const FIRST = ["report.html", "run.mcap", "run.csv", "summary.json"];
let links: string[] = [];

function showDownloads(all: Files): void {
  links.forEach((link) => URL.revokeObjectURL(link));
  links = [];
  const made = [...all].filter(([path]) => path.startsWith(`${OUT}/`)).map(([path, bytes]) => ({ name: path.slice(OUT.length + 1), bytes }));
  const place = (name: string) => FIRST.includes(name) ? FIRST.indexOf(name) : FIRST.length;
  const anchors = made.sort((a, b) => place(a.name) - place(b.name)).map(({ name, bytes }) => {
    const type = TYPES[name.split(".").pop() ?? ""] ?? "application/octet-stream";
    const link = URL.createObjectURL(new Blob([bytes as BlobPart], { type }));
    links.push(link);
    const anchor = Object.assign(document.createElement("a"), { href: link, download: name, textContent: name, className: "button" });
    return anchor;
  });
  get("downloads").replaceChildren("Take along: ", ...anchors);
}

/** Recording of the run, for the viewer of Rerun. */
let mcap: Uint8Array | undefined;
let viewer: HTMLIFrameElement | undefined;
let viewerAsked = false;
let viewerReady = false;

/** Gives the recording to the viewer, if that is open. */
async function showInRerun(): Promise<void> {
  if (!get<HTMLDetailsElement>("rerun").open || !mcap || !shown) return;
  if (viewerReady) viewer?.contentWindow?.postMessage({ bytes: mcap, name: shown.robot }, location.origin);
  if (viewerAsked) return;
  viewerAsked = true;
  // The copy in the Python package comes without the viewer.
  if (!(await fetch("rerun.html", { method: "HEAD" })).ok) {
    get("rerun").append("This copy of the page has no viewer: take run.mcap along and open it with Rerun or Foxglove.");
    return;
  }
  viewer = Object.assign(document.createElement("iframe"), { src: "rerun.html", title: "Rerun viewer" });
  get("rerun").append(viewer);
}

const end = (): number => shown?.times.at(-1) ?? 0;

function seek(to: number): void {
  time = Math.min(Math.max(to, 0), end());
  scene.move(time);
  chart.move(time);
  get<HTMLInputElement>("time").value = String(time);
  get("clock").textContent = `${time.toFixed(2)} s`;
  showShares();
}

function showShares(): void {
  if (!shown) return;
  const [at] = locate(shown.times, time);
  get("instant").textContent = `at ${time.toFixed(2)} s: ${(1e3 * (shown.error[at] ?? 0)).toFixed(3)} mm, along its direction`;
  const rows = shown.contributors.map((name, k) => ({ name, mm: 1e3 * (shown as Recording).shares[k][at] }));
  const largest = Math.max(...rows.map(({ mm }) => Math.abs(mm)), 1e-9);
  get("shares").replaceChildren(
    ...rows.flatMap(({ name, mm }) => {
      const [label, bar, number] = [document.createElement("span"), document.createElement("i"), document.createElement("span")];
      label.textContent = name;
      bar.style.width = `${(100 * Math.abs(mm)) / largest}%`;
      if (mm < 0) bar.className = "less";
      number.textContent = `${mm.toFixed(3).replace(/^-(0\.0+)$/, "$1")} mm`;
      return [label, bar, number];
    }),
  );
}

let before = 0;
function play(now: number): void {
  if (!playing) return;
  const next = time + ((now - before) / 1000) * Number(choice("pace").value);
  before = now;
  seek(next >= end() ? 0 : next);
  requestAnimationFrame(play);
}

function setPlaying(on: boolean): void {
  playing = on && shown !== undefined;
  get("play").textContent = playing ? "Pause" : "Play";
  before = performance.now();
  if (playing) requestAnimationFrame(play);
}

// Settings in the address.
function keepInLink(): void {
  const link = new URLSearchParams();
  for (const name of ["robot", "motion", ...SELECTS]) {
    const { value } = choice(name);
    if (value !== "" && !value.startsWith(`${DROPPED}/`)) link.set(name, value);
  }
  for (const [key, value] of values) link.set(key, String(value));
  history.replaceState(null, "", `#${link}`);
}

/** Replaces the options of a list; what is chosen stays chosen. */
function refill(id: string, options: HTMLOptionElement[]): void {
  const { value } = choice(id);
  choice(id).replaceChildren(...options);
  if (options.some((option) => option.value === value)) choice(id).value = value;
}

function fillMotions(): void {
  const own = sortOut(mine).motions.map((path) => new Option(path.slice(DROPPED.length + 1), path));
  const listed = shipped.motions.map(({ name, files }) => new Option(name, `/${files[0]}`));
  refill("motion", [new Option("the robot's own", ""), ...own, ...listed]);
}

function fillRobots(): void {
  const own = sortOut(mine).robots.map((path) => new Option(path.slice(DROPPED.length + 1), path));
  refill("robot", [...own, ...shipped.robots.map(({ name, title }) => new Option(`${name}: ${title}`, name))]);
}

async function choose(): Promise<void> {
  const bytes = (await files()).get(robotPath());
  sliders = bytes ? slidersOf(new TextDecoder().decode(bytes)) : [];
  showSliders();
}

async function take(files_: Files): Promise<void> {
  if (files_.size === 0) return;
  const { robots, descriptions, motions } = sortOut(files_);
  if (robots.length + descriptions.length + motions.length === 0 && ![...files_.keys()].some(isPart)) {
    const names = [...files_.keys()].map((path) => path.slice(DROPPED.length + 1)).join(", ");
    get("messages").hidden = false;
    get("messages").textContent = `${names}: no robot (.urdf, .xacro, robot.toml), motion or mesh; nothing changes`;
    return;
  }
  mine = new Map([...mine, ...files_]);
  mine = new Map([...mine, ...placePackages(mine)]);
  get("headline").textContent = "Reading your files ...";
  for (const description of robots.length > 0 ? [] : descriptions) {
    // A robot file with assumed stiffness, payload and a sample motion.
    const folder = description.slice(0, description.lastIndexOf("/"));
    const answer = await start(["new", description, "-o", folder, "--force", "--no-run"], mine);
    if (answer.code !== 0) {
      fail(answer.stderr);
      return;
    }
    mine = new Map([...mine, ...[...answer.files].filter(([path]) => path.startsWith(`${DROPPED}/`))]);
  }
  fillRobots();
  fillMotions();
  const robot = sortOut(mine).robots.find((path) => [...files_.keys(), ...descriptions.map((path) => `${path.slice(0, path.lastIndexOf("/"))}/robot.toml`)].includes(path));
  if (robot !== undefined) {
    choice("robot").value = robot;
    values = new Map();
    choice("motion").value = "";
  }
  if (motions.length > 0) choice("motion").value = motions[0];
  await choose();
  await run();
}

async function begin(): Promise<void> {
  shipped = await loadShipped();
  fillRobots();
  fillMotions();
  choice("stepper").replaceChildren(...STEPPERS.map((name, k) => new Option(name, k === 0 ? "" : name)));
  const link = new URLSearchParams(location.hash.slice(1));
  for (const name of ["robot", "motion", ...SELECTS]) {
    const value = link.get(name);
    if (value !== null && [...choice(name).options].some((option) => option.value === value)) choice(name).value = value;
  }
  if (!link.has("robot")) choice("robot").value = FIRST_ROBOT;
  await choose();
  for (const { key, min, max } of sliders) {
    const value = Number(link.get(key) ?? Number.NaN);
    if (value >= min && value <= max) values.set(key, value);
  }
  showSliders();

  choice("robot").addEventListener("change", async () => {
    values = new Map();
    choice("motion").value = "";
    await choose();
    await run();
  });
  for (const name of ["motion", ...SELECTS]) choice(name).addEventListener("change", run);
  get("settings").addEventListener("submit", (event) => event.preventDefault());
  get("reset").addEventListener("click", async () => {
    values = new Map();
    for (const name of ["motion", ...SELECTS]) choice(name).selectedIndex = 0;
    choice("robot").value = FIRST_ROBOT;
    await choose();
    await run();
  });
  get("share").addEventListener("click", async () => {
    await navigator.clipboard.writeText(location.href);
    get("share").textContent = "Copied";
    setTimeout(() => (get("share").textContent = "Copy link"), 1500);
  });
  get("play").addEventListener("click", () => setPlaying(!playing));
  get("time").addEventListener("input", () => {
    setPlaying(false);
    seek(Number(get<HTMLInputElement>("time").value));
  });
  get("rerun").addEventListener("toggle", showInRerun);
  window.addEventListener("message", ({ source }) => {
    if (viewer === undefined || source !== viewer.contentWindow) return;
    viewerReady = true;
    showInRerun();
  });
  const drop = get("drop");
  for (const kind of ["dragover", "dragenter"]) {
    document.addEventListener(kind, (event) => {
      event.preventDefault();
      drop.classList.add("over");
    });
  }
  document.addEventListener("dragleave", () => drop.classList.remove("over"));
  document.addEventListener("drop", async (event) => {
    event.preventDefault();
    drop.classList.remove("over");
    if (event.dataTransfer) await take(await readDrop(event.dataTransfer));
  });
  for (const id of ["choose", "choose-folder"]) {
    get(id).addEventListener("change", async () => {
      const input = get<HTMLInputElement>(id);
      if (input.files) await take(await readChosen(input.files));
      input.value = "";
    });
  }
  await run();
}

begin().catch((error) => fail(`error: ${error instanceof Error ? error.message : String(error)}`));
