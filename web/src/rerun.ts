// The viewer of Rerun, in a frame of the page, with the recording of the run.
import { WebViewer } from "@rerun-io/web-viewer";

// The viewer opens addresses, not bytes: these addresses of the page's own origin are answered here.
const recordings = new Map<string, Uint8Array>();
const fetchFromServer = window.fetch.bind(window);
window.fetch = (input, init) => {
  const url = input instanceof Request ? input.url : String(input);
  const bytes = recordings.get(url);
  return bytes === undefined ? fetchFromServer(input, init) : Promise.resolve(new Response(bytes as BodyInit));
};

const viewer = new WebViewer();
viewer.on("recording_open", () => (document.body.dataset.state = "shown"));
let started: Promise<void> | undefined;

async function show(bytes: Uint8Array, name: string): Promise<void> {
  const [before] = recordings.keys();
  recordings.clear();
  const url = new URL(`recording/${Date.now()}/${name}.mcap`, location.href).href;
  recordings.set(url, bytes);
  document.body.dataset.state = "opening";
  started ??= viewer.start(null, document.body, { width: "100%", height: "100%", hide_welcome_screen: true });
  await started;
  if (before !== undefined) viewer.close(before);
  viewer.open(url);
}

window.addEventListener("message", async ({ source, data }: MessageEvent<{ bytes: Uint8Array; name: string }>) => {
  if (source !== window.parent) return;
  try {
    await show(data.bytes, data.name);
  } catch (error) {
    document.body.textContent = `The viewer did not start: ${error instanceof Error ? error.message : String(error)}`;
  }
});
window.parent.postMessage("ready", location.origin);
