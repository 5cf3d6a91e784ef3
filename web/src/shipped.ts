// Robots and motions that come with the page.
import type { Files } from "./program";

export interface Shipped {
  robots: { name: string; title: string; files: string[] }[];
  motions: { name: string; files: string[] }[];
}

export async function loadShipped(): Promise<Shipped> {
  const response = await fetch("shipped.json");
  if (!response.ok) throw new Error(`shipped.json: ${response.status} ${response.statusText}`);
  return response.json();
}

/** Fetches files and puts them at the root of the program's file system. */
export async function fetchFiles(paths: string[], into: Files): Promise<void> {
  const fetchOne = async (path: string) => {
    if (into.has(`/${path}`)) return;
    const response = await fetch(`shipped/${path}`);
    if (!response.ok) throw new Error(`${path}: ${response.status} ${response.statusText}`);
    into.set(`/${path}`, new Uint8Array(await response.arrayBuffer()));
  };
  await Promise.all(paths.map(fetchOne));
}
