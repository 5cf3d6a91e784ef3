// The command line as a WebAssembly program with files in memory.
import { ConsoleStdout, Directory, File, type Inode, OpenFile, PreopenDirectory, WASI } from "@bjorn3/browser_wasi_shim";

/** Files by absolute path. */
export type Files = Map<string, Uint8Array>;

export interface Outcome {
  code: number;
  stdout: string;
  stderr: string;
  /** All files after the run. */
  files: Files;
}

function toTree(files: Files): Map<string, Inode> {
  const root = new Map<string, Inode>();
  for (const [path, bytes] of files) {
    const parts = path.split("/").filter((part) => part !== "");
    const name = parts.pop();
    if (name === undefined) continue;
    let folder = root;
    for (const part of parts) {
      const known = folder.get(part);
      const next = known instanceof Directory ? known : new Directory(new Map());
      folder.set(part, next);
      folder = next.contents;
    }
    folder.set(name, new File(bytes));
  }
  return root;
}

function fromTree(folder: Map<string, Inode>, path: string, into: Files): Files {
  for (const [name, inode] of folder) {
    if (inode instanceof Directory) fromTree(inode.contents, `${path}/${name}`, into);
    else if (inode instanceof File) into.set(`${path}/${name}`, inode.data);
  }
  return into;
}

/** Runs `flexarm` with `args`. Each run has a memory of its own, which is free afterwards. */
export async function runProgram(module: WebAssembly.Module, args: string[], files: Files): Promise<Outcome> {
  const lines: [string[], string[]] = [[], []];
  const root = new PreopenDirectory("/", toTree(files));
  const descriptors = [
    new OpenFile(new File([])),
    ConsoleStdout.lineBuffered((line) => lines[0].push(line)),
    ConsoleStdout.lineBuffered((line) => lines[1].push(line)),
    root,
  ];
  const wasi = new WASI(["flexarm", ...args], ["NO_COLOR=1", "RUST_BACKTRACE=0"], descriptors, { debug: false });
  const instance = await WebAssembly.instantiate(module, { wasi_snapshot_preview1: wasi.wasiImport });
  let code: number;
  try {
    code = wasi.start(instance as unknown as { exports: { memory: WebAssembly.Memory; _start: () => unknown } });
  } catch (error) {
    // A panic ends in a trap after its message; memory that is used up ends in one as well.
    code = 101;
    lines[1].push(`error: the program stopped: ${error instanceof Error ? error.message : String(error)}`);
  }
  const [stdout, stderr] = lines.map((part) => part.join("\n"));
  return { code, stdout, stderr, files: fromTree(root.dir.contents, "", new Map()) };
}
