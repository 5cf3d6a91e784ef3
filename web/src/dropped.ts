// Files of the user: dropped or chosen, also whole folders.
import type { Files } from "./program";

/** Folder of the user's files in the program's file system. */
export const DROPPED = "/mine";

async function read(entry: FileSystemEntry, path: string, into: Files): Promise<void> {
  if (entry.isFile) {
    const file = await new Promise<File>((done, failed) => (entry as FileSystemFileEntry).file(done, failed));
    into.set(`${path}/${entry.name}`, new Uint8Array(await file.arrayBuffer()));
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((done, failed) => reader.readEntries(done, failed));
    if (some.length === 0) return;
    for (const inner of some) await read(inner, `${path}/${entry.name}`, into);
  }
}

/** Returns the files of a drop. */
export async function readDrop(transfer: DataTransfer): Promise<Files> {
  const files: Files = new Map();
  const entries = [...transfer.items].flatMap((item) => item.webkitGetAsEntry() ?? []);
  for (const entry of entries) await read(entry, DROPPED, files);
  return files;
}

/** Returns the files that were chosen in a dialogue. */
export async function readChosen(list: FileList): Promise<Files> {
  const files: Files = new Map();
  for (const file of list) {
    const path = file.webkitRelativePath || file.name;
    files.set(`${DROPPED}/${path}`, new Uint8Array(await file.arrayBuffer()));
  }
  return files;
}

/** Returns copies of files where `package://NAME/PATH` of a description expects them: beside it, in a folder NAME. */
export function placePackages(files: Files): Files {
  const placed: Files = new Map();
  for (const [path, bytes] of files) {
    if (!["urdf", "xacro"].includes(ending(path))) continue;
    for (const [, place] of text(bytes).matchAll(/(?:package|model):\/\/([^"'<>\s]+\/[^"'<>\s]+)/g)) {
      if ([...files.keys()].some((known) => known.endsWith(`/${place}`))) continue;
      // The file with the longest common end: meshes are often chosen without their folders.
      const parts = place.split("/").slice(1);
      const ends = parts.map((_, k) => `/${parts.slice(k).join("/")}`);
      const found = ends.flatMap((end) => [...files].find(([known]) => known.endsWith(end)) ?? [])[1];
      if (found instanceof Uint8Array) placed.set(`${DROPPED}/${place}`, found);
    }
  }
  return placed;
}

/** Whether a robot or a run reads files with this ending besides robots and motions. */
export const isPart = (path: string): boolean => ["stl", "dae", "obj", "flex", "xacro", "yaml", "xml", "toml"].includes(ending(path));

const ending = (path: string): string => /\.([^./]+)$/.exec(path)?.[1].toLowerCase() ?? "";
const text = (bytes: Uint8Array): string => new TextDecoder().decode(bytes);

/** Paths of the robot files (robot.toml first), the descriptions without one, and the motions among the files. */
export function sortOut(files: Files): { robots: string[]; descriptions: string[]; motions: string[] } {
  const found = { robots: [] as string[], descriptions: [] as string[], motions: [] as string[] };
  for (const [path, bytes] of files) {
    const kind = ending(path);
    if (kind === "toml" && /^\s*urdf\s*=/m.test(text(bytes))) found.robots.push(path);
    else if (kind === "toml" && /^\s*\[\[reduce|^\s*\[\[load\]\]|^\s*mesh\s*=/m.test(text(bytes))) continue;
    else if (["toml", "csv", "json", "yaml", "yml", "mcap", "bag", "db3"].includes(kind)) found.motions.push(path);
    else if (kind === "urdf" || (kind === "xacro" && /<robot[^>]*\sname=/.test(text(bytes)))) found.descriptions.push(path);
  }
  const own = (path: string): number => Number(!path.endsWith("/robot.toml"));
  found.robots.sort((a, b) => own(a) - own(b));
  return found;
}
