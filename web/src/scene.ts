// The arm in three dimensions: the recorded surfaces, moved by the recorded frames.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Recording } from "./recording";

/** Index of the last entry at or before `time`, and the fraction of the way to the next. */
export function locate(times: Float64Array, time: number): [number, number] {
  let [low, high] = [0, times.length - 1];
  if (high < 1 || time <= times[0]) return [0, 0];
  if (time >= times[high]) return [high, 0];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  return [low, (time - times[low]) / (times[high] - times[low])];
}

const COLORS: Record<string, number> = { "path/flexible": 0xf28c28, "path/rigid": 0x9aa3ad, "path/magnified": 0x4c9be8 };

export class ArmScene {
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(40, 1, 0.01, 500);
  private readonly controls: OrbitControls;
  private readonly grid = new THREE.GridHelper(10, 20, 0x8a94a3, 0x8a94a3);
  private root = new THREE.Group();
  private frames: THREE.Object3D[] = [];
  private groups = new Map<string, THREE.Object3D[]>();
  private recording?: Recording;
  private seen = "";

  constructor(canvas: HTMLCanvasElement) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.grid.rotation.x = Math.PI / 2;
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.35;
    const sun = new THREE.DirectionalLight(0xffffff, 2);
    sun.position.set(3, -4, 6);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 1.6), sun, this.grid, this.root);
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  /** Shows a recording; keeps the view if it is of the same robot. */
  show(recording: Recording): void {
    this.recording = recording;
    this.root.traverse((object) => {
      if (object instanceof THREE.Mesh || object instanceof THREE.Line) {
        object.geometry.dispose();
        object.material.dispose();
      }
    });
    this.scene.remove(this.root);
    this.root = new THREE.Group();
    this.scene.add(this.root);
    this.groups.clear();
    this.frames = recording.frames.map(() => new THREE.Group());
    recording.parents.forEach((parent, k) => (parent < 0 ? this.root : this.frames[parent]).add(this.frames[k]));
    for (const { group, frame, kind, positions, color } of recording.shapes) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
      const tint = new THREE.Color().setRGB(color[0], color[1], color[2], THREE.SRGBColorSpace);
      let object: THREE.Object3D;
      if (kind === "triangles") {
        geometry.computeVertexNormals();
        const clear = color[3] < 1;
        object = new THREE.Mesh(
          geometry,
          new THREE.MeshStandardMaterial({ color: tint, roughness: 0.65, transparent: clear, opacity: color[3], depthWrite: !clear, side: THREE.DoubleSide }),
        );
      } else {
        object = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: COLORS[group] ?? tint }));
      }
      const index = recording.frames.indexOf(frame);
      (index < 0 ? this.root : this.frames[index]).add(object);
      this.groups.set(group, [...(this.groups.get(group) ?? []), object]);
    }
    if (!this.groups.has("flexible")) this.addSkeletons(recording);
    this.move(0);
    if (this.seen !== recording.robot) this.fit();
    this.seen = recording.robot;
  }

  /** Joins the frames by lines, for a robot without surfaces. */
  private addSkeletons(recording: Recording): void {
    recording.frames.forEach((name, k) => {
      if (recording.parents[k] < 0 || /station_|bend_/.test(name)) return;
      const group = /^(rigid|magnified)\//.exec(name)?.[1] ?? "flexible";
      const color = { rigid: 0x9aa3ad, magnified: 0x4c9be8, flexible: 0xf28c28 }[group];
      const { x, y, z } = this.offset(recording, k);
      const geometry = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(x, y, z)]);
      const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color }));
      this.frames[recording.parents[k]].add(line);
      this.groups.set(group, [...(this.groups.get(group) ?? []), line]);
    });
  }

  private offset(recording: Recording, frame: number): THREE.Vector3 {
    return new THREE.Vector3().fromArray(recording.poses, 7 * frame);
  }

  /** Shows or hides the arm at true scale, the magnified arm, ... */
  setVisible(group: string, visible: boolean): void {
    for (const object of this.groups.get(group) ?? []) object.visible = visible;
    for (const object of this.groups.get(`path/${group}`) ?? []) object.visible = visible;
    this.draw();
  }

  has(group: string): boolean {
    return this.groups.has(group);
  }

  /** Moves all frames to an instant (s). */
  move(time: number): void {
    const recording = this.recording;
    if (!recording) return;
    const [at, part] = locate(recording.poseTimes, time);
    const row = 7 * recording.frames.length;
    const next = Math.min(at + 1, Math.max(recording.poseTimes.length - 1, 0));
    const [p, q] = [new THREE.Vector3(), new THREE.Quaternion()];
    this.frames.forEach((frame, k) => {
      const [here, there] = [at * row + 7 * k, next * row + 7 * k];
      frame.position.fromArray(recording.poses, here).lerp(p.fromArray(recording.poses, there), part);
      frame.quaternion.fromArray(recording.poses, here + 3).slerp(q.fromArray(recording.poses, there + 3), part);
    });
    this.draw();
  }

  private fit(): void {
    this.root.updateMatrixWorld(true);
    const box = new THREE.Box3().setFromObject(this.root);
    if (box.isEmpty()) return;
    const [center, size] = [box.getCenter(new THREE.Vector3()), box.getSize(new THREE.Vector3()).length()];
    this.grid.position.z = Math.min(box.min.z, 0);
    this.grid.scale.setScalar(size / 5);
    this.controls.target.copy(center);
    this.camera.near = size / 200;
    this.camera.far = size * 50;
    this.camera.position.copy(center).add(new THREE.Vector3(0.9, -1.1, 0.45).normalize().multiplyScalar(0.95 * size));
    this.resize();
    this.controls.update();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.renderer.domElement;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  private draw(): void {
    this.renderer.render(this.scene, this.camera);
  }
}
