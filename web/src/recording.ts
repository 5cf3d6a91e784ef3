// The MCAP file of a run, read into arrays: moving frames, surfaces, paths, and curves over time.
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapStreamReader } from "@mcap/core";

/** Surface or line in a frame. */
export interface Shape {
  /** "flexible", "rigid", "magnified", "path/rigid", ... */
  group: string;
  frame: string;
  kind: "triangles" | "line";
  /** Three numbers each (m). */
  positions: Float32Array;
  /** Red, green, blue, alpha, 0 to 1. */
  color: [number, number, number, number];
}

export interface Recording {
  robot: string;
  motion: string;
  magnification: number;
  /** Names of the frames, and the index of each one's parent; -1 for the world. */
  frames: string[];
  parents: Int32Array;
  /** Times of the poses (s). */
  poseTimes: Float64Array;
  /** Position and quaternion (x, y, z, w) of each frame in its parent, frame by frame at each time. */
  poses: Float32Array;
  shapes: Shape[];
  /** Times of the curves (s). */
  times: Float64Array;
  /** Distance of the flexible from the rigid TCP (m). */
  error: Float64Array;
  /** Its part that stays when the arm stands still (m); empty without one. */
  staticError: Float64Array;
  /** Elements, and the part of the error along its direction that each of them makes (m). */
  contributors: string[];
  shares: Float64Array[];
  events: { time: number; text: string }[];
}

interface Vector {
  x: number;
  y: number;
  z: number;
}
interface Transform {
  header: { frame_id: string };
  child_frame_id: string;
  transform: { translation: Vector; rotation: Vector & { w: number } };
}
interface Marker {
  header: { frame_id: string };
  ns: string;
  type: number;
  points: Vector[];
  color: { r: number; g: number; b: number; a: number };
}

const LINE_STRIP = 4;
const TRIANGLES = 11;
const TOPICS = new Set(["/tf", "/tf_static", "/markers", "/markers/path", "/tcp/error", "/tcp/static_error", "/tcp/contributions", "/events"]);

const norm = (v: ArrayLike<number>, at = 0): number => Math.hypot(v[at], v[at + 1], v[at + 2]);

function shapeOf(marker: Marker): Shape | undefined {
  if (marker.type !== TRIANGLES && marker.type !== LINE_STRIP) return undefined;
  const positions = new Float32Array(3 * marker.points.length);
  marker.points.forEach((point, k) => positions.set([point.x, point.y, point.z], 3 * k));
  const { r, g, b, a } = marker.color;
  const kind = marker.type === TRIANGLES ? "triangles" : "line";
  return { group: marker.ns, frame: marker.header.frame_id, kind, positions, color: [r, g, b, a] };
}

/** Reads a recording. */
export function readRecording(bytes: Uint8Array): Recording {
  const reader = new McapStreamReader();
  reader.append(bytes);
  const schemas = new Map<number, MessageReader>();
  const channels = new Map<number, { topic: string; schemaId: number; metadata: Map<string, string> }>();
  let run: { robot: string; trajectory: string; magnification?: number } | undefined;
  let start: bigint | undefined;
  const fixed = new Map<string, Transform>();
  const moving: { time: number; transforms: Transform[] }[] = [];
  const surfaces: Shape[] = [];
  let paths: Shape[] = [];
  const times: number[] = [];
  const errors: number[][] = [];
  const staticErrors: number[] = [];
  const contributions: Float64Array[] = [];
  let contributors: string[] = [];
  const events: { time: number; text: string }[] = [];

  for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
    if (record.type === "Schema") {
      const text = new TextDecoder().decode(record.data);
      schemas.set(record.id, new MessageReader(parse(text, { ros2: true })));
    } else if (record.type === "Channel") {
      channels.set(record.id, record);
    } else if (record.type === "Attachment" && record.name === "run.json") {
      run = JSON.parse(new TextDecoder().decode(record.data));
    } else if (record.type === "Message") {
      const channel = channels.get(record.channelId);
      const decoder = channel && TOPICS.has(channel.topic) ? schemas.get(channel.schemaId) : undefined;
      if (!channel || !decoder) continue;
      start ??= record.logTime;
      const time = Number(record.logTime - start) * 1e-9;
      const message: any = decoder.readMessage(record.data);
      switch (channel.topic) {
        case "/tf_static":
          for (const transform of message.transforms as Transform[]) fixed.set(transform.child_frame_id, transform);
          break;
        case "/tf":
          moving.push({ time, transforms: message.transforms });
          break;
        case "/markers":
          surfaces.push(...(message.markers as Marker[]).flatMap((marker) => shapeOf(marker) ?? []));
          break;
        case "/markers/path":
          // Each message has the whole path so far.
          paths = (message.markers as Marker[]).flatMap((marker) => shapeOf(marker) ?? []);
          break;
        case "/tcp/error":
          times.push(time);
          errors.push(Array.from(message.position));
          break;
        case "/tcp/static_error":
          staticErrors.push(norm(message.position));
          break;
        case "/tcp/contributions":
          if (contributors.length === 0) {
            const names: string[] = message.name;
            contributors = names.filter((_, k) => k % 3 === 0).map((name) => name.replace(/\/x$/, ""));
          }
          contributions.push(Float64Array.from(message.position));
          break;
        case "/events":
          events.push({ time, text: message.msg });
          break;
      }
    }
  }
  if (!run) throw new Error("the recording does not describe its run");

  const tree = new Map<string, string>();
  for (const { header, child_frame_id } of [...fixed.values(), ...(moving[0]?.transforms ?? [])]) tree.set(child_frame_id, header.frame_id);
  const frames = [...tree.keys()];
  const index = new Map(frames.map((name, k) => [name, k]));
  const parents = Int32Array.from(frames, (name) => index.get(tree.get(name) ?? "") ?? -1);
  const poseTimes = Float64Array.from(moving, ({ time }) => time);
  const poses = new Float32Array(7 * frames.length * Math.max(moving.length, 1));
  const put = (at: number, { child_frame_id, transform: { translation: t, rotation: q } }: Transform) => {
    const frame = index.get(child_frame_id);
    if (frame !== undefined) poses.set([t.x, t.y, t.z, q.x, q.y, q.z, q.w], 7 * (at * frames.length + frame));
  };
  for (let at = 0; at < Math.max(moving.length, 1); at++) {
    if (at > 0) poses.copyWithin(7 * at * frames.length, 7 * (at - 1) * frames.length, 7 * at * frames.length);
    for (const transform of at === 0 ? fixed.values() : []) put(at, transform);
    for (const transform of moving[at]?.transforms ?? []) put(at, transform);
  }

  const error = Float64Array.from(errors, (vector) => norm(vector));
  const shares = contributors.map((_, k) =>
    Float64Array.from(contributions, (row, at) => {
      const vector = errors[at];
      const along = row[3 * k] * vector[0] + row[3 * k + 1] * vector[1] + row[3 * k + 2] * vector[2];
      return error[at] > 0 ? along / error[at] : 0;
    }),
  );
  return {
    robot: run.robot,
    motion: run.trajectory,
    magnification: run.magnification ?? 1,
    frames,
    parents,
    poseTimes,
    poses,
    shapes: [...surfaces, ...paths],
    times: Float64Array.from(times),
    error,
    staticError: Float64Array.from(staticErrors),
    contributors,
    shares,
    events,
  };
}
