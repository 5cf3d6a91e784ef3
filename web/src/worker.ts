// Runs the program away from the page, so that the page stays responsive.
import { type Files, type Outcome, runProgram } from "./program";
import { readRecording, type Recording } from "./recording";

export interface Job {
  id: number;
  args: string[];
  files: Files;
  /** Path of the recording to read after a run with success. */
  recording?: string;
}

export interface Answer extends Outcome {
  id: number;
  recording?: Recording;
}

/** Bytes of the program that have arrived, and their total. */
export interface Loading {
  loaded: number;
  total: number;
}

async function load(): Promise<WebAssembly.Module> {
  const response = await fetch(new URL("../flexarm.wasm", self.location.href));
  if (!response.ok || !response.body) throw new Error(`flexarm.wasm: ${response.status} ${response.statusText}`);
  const total = Number(response.headers.get("content-length") ?? 0);
  let loaded = 0;
  const count = new TransformStream<Uint8Array, Uint8Array>({
    transform(chunk, out) {
      loaded += chunk.byteLength;
      self.postMessage({ loaded, total } satisfies Loading);
      out.enqueue(chunk);
    },
  });
  const counted = new Response(response.body.pipeThrough(count), { headers: { "content-type": "application/wasm" } });
  return WebAssembly.compileStreaming(counted);
}

const module = load();

self.onmessage = async ({ data: { id, args, files, recording } }: MessageEvent<Job>) => {
  try {
    const outcome = await runProgram(await module, args, files);
    const bytes = outcome.code === 0 && recording !== undefined ? outcome.files.get(recording) : undefined;
    self.postMessage({ id, ...outcome, recording: bytes && readRecording(bytes) } satisfies Answer);
  } catch (error) {
    const stderr = `error: ${error instanceof Error ? error.message : String(error)}`;
    self.postMessage({ id, code: 101, stdout: "", stderr, files: new Map() } satisfies Answer);
  }
};
