// The 3D view: one camera, one or two panes of plans, drawn when something changed and not before.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Scheme } from "./colours";
import { Detail } from "./detail";
import { disposeOf, Frusta, type Inks, linesOfSight, selectedCamera } from "./frusta";
import { axis, corners, minus, norm } from "./geometry";
import type { Model, Vector } from "./model";
import { madeRenderer } from "./renderer";
import { Splats } from "./splats";

/** A point is explained in one of the plans. */
export type Selection = { camera: number } | { point: number; plan: number } | null;

/** Which plans are shown: one, two side by side, or two on either side of a line. */
export interface Layout {
  plans: [number] | [number, number];
  slider: boolean;
  /** Where the line is, 0 to 1 from the left. */
  at: number;
}

export interface Pane {
  plan: number;
  x: number;
  width: number;
  /** What of it is shown. */
  from: number;
  to: number;
}

const FIELD = 32; // degrees
const FILL = 0.84; // of a pane, by the surface at first
const CAPTION = 48; // pixels at its top that are kept free
const REVEALED = (50 * Math.PI) / 180; // off the line of sight, at most
const ORBIT_STEP = Math.PI / 36;

export class View {
  readonly canvas: HTMLCanvasElement;
  layout: Layout = { plans: [0], slider: false, at: 0.5 };
  showCameras = true;
  hovered: number | null = null;
  /** Called after each drawing, and when another camera is pointed at. */
  onDrawn: () => void = () => {};
  /** Called with true once all of the surface is on the canvas, and with false when it is drawn anew. */
  onWhole: (isWhole: boolean) => void = () => {};
  readonly frusta: Frusta;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(FIELD, 1, 0.01, 100);
  private readonly controls: OrbitControls;
  private readonly splats: Splats;
  private readonly centre: THREE.Vector3;
  private readonly radius: number;
  private readonly farthest: number;
  private readonly marker: THREE.Mesh;
  private selection: Selection = null;
  private groups: THREE.Group[] = [];
  private inks: Inks | null = null;
  private waiting = false;
  private drawings = 0;
  private held = false;
  private moved = false;
  private readonly detail = new Detail(() => this.draw());

  constructor(
    private readonly model: Model,
    holder: HTMLElement,
  ) {
    THREE.ColorManagement.enabled = false;
    this.renderer = madeRenderer();
    this.canvas = this.renderer.domElement;
    holder.append(this.canvas);
    const [centre, radius] = extentOf(model);
    this.centre = centre;
    this.radius = radius;
    this.farthest = model.facts.depth[0] + model.facts.depth[1] * 1.02;
    this.splats = new Splats(model);
    this.frusta = new Frusta(model, lengthOfFrusta(model, radius));
    this.marker = new THREE.Mesh(
      new THREE.RingGeometry(0.72, 1, 40),
      new THREE.MeshBasicMaterial({ depthTest: false, transparent: true }),
    );
    this.marker.renderOrder = 10;
    this.marker.visible = false;
    this.scene.add(...this.splats.meshes, ...this.frusta.lines, this.marker);
    this.camera.up.set(...upOf(model));
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.zoomSpeed = 1.4;
    this.controls.addEventListener("start", () => (this.held = true));
    this.controls.addEventListener("end", () => (this.held = false));
    this.controls.addEventListener("change", () => {
      this.moved ||= this.held;
      if (this.moved) this.detail.move();
      this.draw();
    });
    this.canvas.addEventListener("webglcontextrestored", () => this.draw());
    new ResizeObserver(() => {
      const { x, y } = this.renderer.getSize(new THREE.Vector2());
      if (x !== holder.clientWidth || y !== holder.clientHeight) this.resized();
    }).observe(holder);
  }

  // --- what is shown ---------------------------------------------------------------------------

  paint(scheme: Scheme): void {
    this.model.plans.forEach((plan, k) => this.splats.paint(plan, k, scheme));
    this.draw();
  }

  ink(inks: Inks): void {
    this.inks = inks;
    (this.marker.material as THREE.MeshBasicMaterial).color.set(inks.selected);
    this.frusta.paint(inks);
    this.splats.onPaper(new THREE.Color(inks.paper), window.devicePixelRatio);
    this.select(this.selection);
  }

  select(selection: Selection): void {
    this.selection = selection;
    for (const group of this.groups) {
      this.scene.remove(group);
      disposeOf(group);
    }
    this.splats.select(selection && "camera" in selection ? selection.camera : null);
    this.marker.visible = selection !== null && "point" in selection;
    const inks = this.inks;
    if (!inks) return;
    this.groups = this.model.plans.map((plan) => {
      if (!selection) return new THREE.Group();
      if ("point" in selection) return linesOfSight(this.model, plan, selection.point, inks);
      const camera = this.model.cameras[selection.camera]!;
      return selectedCamera(this.model, plan, camera, this.farthest, inks);
    });
    if (this.groups.length) this.scene.add(...this.groups);
    this.draw();
  }

  hover(camera: number | null): void {
    if (camera === this.hovered) return;
    this.hovered = camera;
    this.canvas.style.cursor = camera === null ? "" : "pointer";
    this.onDrawn();
  }

  draw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.drawNow();
    });
  }

  /** As at first, until somebody has moved it: fill the panes that there are. */
  private resized(): void {
    if (!this.moved) this.home();
    this.draw();
  }

  drawNow(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement!;
    if (!width || !height || !this.inks) return;
    const ratio = Math.min(window.devicePixelRatio, 2);
    const size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== width || size.y !== height || this.renderer.getPixelRatio() !== ratio) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height);
    }
    this.renderer.setScissorTest(false);
    this.renderer.clear();
    this.renderer.setScissorTest(true);
    this.detail.drawing();
    this.splats.thin(this.detail.share);
    for (const pane of this.panes()) {
      this.aim(pane, height);
      this.model.plans.forEach((_, k) => {
        this.splats.meshes[k]!.visible = k === pane.plan;
        this.frusta.lines[k]!.visible = this.showCameras && k === pane.plan;
        if (this.groups[k]) this.groups[k].visible = k === pane.plan;
      });
      this.placeMarker();
      this.renderer.setViewport(pane.x, 0, pane.width, height);
      this.renderer.setScissor(pane.from, 0, pane.to - pane.from, height);
      this.renderer.render(this.scene, this.camera);
    }
    this.onDrawn();
    this.drawings++;
    this.onWhole(false);
    const isWhole = this.detail.share === 1;
    this.whenFinished(() => {
      this.detail.finished();
      this.onWhole(isWhole);
    });
  }

  /** What is drawn is only asked for at first: wait until it is there, unless it is drawn anew. */
  private whenFinished(action: () => void): void {
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    const drawing = this.drawings;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const look = () => {
      const isNewest = drawing === this.drawings;
      if (fence && isNewest && gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) {
        window.setTimeout(look, 10);
        return;
      }
      gl.deleteSync(fence);
      if (isNewest && !gl.isContextLost()) action();
    };
    window.setTimeout(look);
  }

  panes(): Pane[] {
    const width = this.canvas.parentElement!.clientWidth;
    const [first, second] = this.layout.plans;
    if (second === undefined) return [{ plan: first, x: 0, width, from: 0, to: width }];
    if (this.layout.slider) {
      const line = Math.round(width * this.layout.at);
      return [
        { plan: first, x: 0, width, from: 0, to: line },
        { plan: second, x: 0, width, from: line, to: width },
      ];
    }
    const half = Math.floor(width / 2);
    return [
      { plan: first, x: 0, width: half, from: 0, to: half },
      { plan: second, x: half, width: width - half, from: half, to: width },
    ];
  }

  arrange(layout: Layout): void {
    this.layout = layout;
    this.resized();
  }

  // --- where one looks from --------------------------------------------------------------------

  /** Look at the surface from the front, or from as far away as shows all cameras. */
  home(withRig = false): void {
    this.moved = withRig;
    const up = this.camera.up;
    const front = Math.abs(up.z) > 0.5 ? new THREE.Vector3(0, -1, 0) : new THREE.Vector3(0, 0, 1);
    const side = new THREE.Vector3().crossVectors(front, up).normalize();
    const from = front.addScaledVector(side, -0.42).addScaledVector(up, 0.16).normalize();
    this.controls.target.copy(this.centre);
    this.camera.position.copy(this.centre).addScaledVector(from, this.fittingDistance(from, withRig));
    this.controls.minDistance = 0.02 * this.radius;
    this.controls.maxDistance = 30 * this.radius;
    this.controls.update();
    this.draw();
  }

  /** Turn so far around the surface that a camera is on this side of it. */
  reveal(index: number): void {
    const flat = (place: THREE.Vector3) => place.projectOnPlane(this.camera.up);
    const to = flat(new THREE.Vector3(...this.model.cameras[index]!.position).sub(this.centre));
    const from = flat(this.camera.position.clone().sub(this.controls.target));
    const turn = to.angleTo(from);
    if (!(turn > REVEALED) || to.length() < 1e-6) return;
    const left = new THREE.Vector3().crossVectors(from, to).dot(this.camera.up) > 0;
    this.orbit(((left ? -1 : 1) * (turn - REVEALED)) / ORBIT_STEP, 0);
  }

  /** How far away the surface, or the rig, fills the first pane when seen from a direction. */
  private fittingDistance(from: THREE.Vector3, withRig: boolean): number {
    const { clientWidth, clientHeight } = this.canvas.parentElement!;
    const pane = this.panes()[0]!;
    const aspect = (pane.width || clientWidth || 1) / (clientHeight || 1);
    const tangent = Math.tan((FIELD * Math.PI) / 360);
    const right = new THREE.Vector3().crossVectors(this.camera.up, from).normalize();
    const above = new THREE.Vector3().crossVectors(from, right);
    const every = Math.ceil(this.model.samples / 2048);
    const tall = Math.min(FILL, Math.max(1 - (2 * CAPTION) / (clientHeight || 1), 0.3));
    const needed = (place: Vector, fill: number, tall: number) => {
      const d = new THREE.Vector3(...place).sub(this.centre);
      const wide = Math.abs(d.dot(right)) / (fill * tangent * aspect);
      return d.dot(from) + Math.max(wide, Math.abs(d.dot(above)) / (tall * tangent));
    };
    let surface = 0;
    for (let p = 0; p < this.model.samples; p += every) {
      surface = Math.max(surface, needed(this.model.point(p), FILL, tall));
    }
    let rig = 0;
    for (const camera of this.model.cameras) rig = Math.max(rig, needed(camera.position, 0.95, 0.95));
    const all = Math.max(surface, rig);
    // With its cameras, if that makes it hardly smaller.
    return (withRig || all < 1.2 * surface ? all : surface) || 3 * this.radius;
  }

  orbit(across: number, up: number): void {
    this.moved = true;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const turn = new THREE.Quaternion().setFromUnitVectors(this.camera.up, new THREE.Vector3(0, 1, 0));
    const place = new THREE.Spherical().setFromVector3(offset.applyQuaternion(turn));
    place.theta -= across * ORBIT_STEP;
    place.phi -= up * ORBIT_STEP;
    place.makeSafe();
    offset.setFromSpherical(place).applyQuaternion(turn.invert());
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
  }

  pan(across: number, up: number): void {
    this.moved = true;
    const step = 0.05 * this.camera.position.distanceTo(this.controls.target);
    const right = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 0);
    const above = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 1);
    const move = right.multiplyScalar(across * step).addScaledVector(above, up * step);
    this.camera.position.add(move);
    this.controls.target.add(move);
    this.controls.update();
    this.draw();
  }

  zoom(times: number): void {
    this.moved = true;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const length = offset.length() / times;
    const { minDistance, maxDistance } = this.controls;
    offset.setLength(Math.min(Math.max(length, minDistance), maxDistance));
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
  }

  /** Look from where a camera of the rig is. */
  lookFrom(index: number): void {
    this.moved = true;
    const camera = this.model.cameras[index]!;
    const pairs = this.model.pairsOf(index);
    let depth = 0;
    for (const q of pairs) depth += this.model.pairDepth[q]! / pairs.length;
    const along = axis(camera, 2);
    const ahead = depth || this.radius;
    this.camera.position.set(...camera.position);
    this.controls.target.set(...camera.position).addScaledVector(new THREE.Vector3(...along), ahead);
    this.controls.update();
    this.draw();
  }

  private aimed = 0;

  private aim(pane: Pane, height: number): void {
    this.aimed = pane.width / height;
    this.camera.aspect = pane.width / height;
    const away = this.camera.position.distanceTo(this.centre);
    this.camera.near = Math.max(away - 6 * this.radius, 0.004 * this.radius);
    this.camera.far = away + 8 * this.radius;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  private placeMarker(): void {
    if (!this.selection || !("point" in this.selection)) return;
    this.marker.position.set(...this.model.point(this.selection.point));
    this.marker.quaternion.copy(this.camera.quaternion);
    const away = this.camera.position.distanceTo(this.marker.position);
    this.marker.scale.setScalar(0.012 * away);
  }

  // --- what is where ---------------------------------------------------------------------------

  /** Where a place of the rig's frame is in a pane, in pixels of the canvas; null if behind. */
  locate(place: Vector, pane: Pane): { x: number; y: number; depth: number } | null {
    const height = this.canvas.parentElement!.clientHeight;
    if (this.aimed !== pane.width / height) this.aim(pane, height);
    const at = new THREE.Vector3(...place).applyMatrix4(this.camera.matrixWorldInverse);
    const depth = -at.z;
    if (depth <= 0) return null;
    at.applyMatrix4(this.camera.projectionMatrix);
    const x = pane.x + (0.5 + at.x / 2) * pane.width;
    const y = (0.5 - at.y / 2) * height;
    return { x, y, depth };
  }

  /** The middle of the first pane. */
  middle(): { x: number; y: number } {
    const pane = this.panes()[0]!;
    const x = Math.max(Math.min(pane.x + pane.width / 2, pane.to - 1), pane.from);
    return { x, y: this.canvas.clientHeight / 2 };
  }

  planAt(x: number): number {
    return this.paneAt(x).plan;
  }

  private paneAt(x: number): Pane {
    const panes = this.panes();
    return panes.find((pane) => x >= pane.from && x < pane.to) ?? panes[0]!;
  }

  /** The camera within some pixels of a place on the canvas, unless the surface hides it. */
  cameraAt(x: number, y: number, within: number): number | null {
    if (!this.showCameras) return null;
    const pane = this.paneAt(x);
    let best: { camera: number; away: number; depth: number } | null = null;
    for (const camera of this.model.cameras) {
      const middle = this.middleOf(camera.index);
      const at = this.locate(middle, pane);
      if (!at) continue;
      const away = Math.hypot(at.x - x, at.y - y);
      if (away <= within && (!best || away < best.away)) {
        best = { camera: camera.index, away, depth: at.depth };
      }
    }
    if (!best) return null;
    const surface = this.pointAt(x, y);
    if (surface !== null) {
      const hit = this.locate(this.model.point(surface), pane);
      if (hit && hit.depth < best.depth) return null;
    }
    return best.camera;
  }

  middleOf(camera: number): Vector {
    const rim = corners(this.model.cameras[camera]!, this.frusta.length / 2);
    return [0, 1, 2].map((k) => rim.reduce((sum, each) => sum + each[k]!, 0) / 4) as Vector;
  }

  /** The sample whose disc is seen at a place on the canvas. */
  pointAt(x: number, y: number): number | null {
    const pane = this.paneAt(x);
    const height = this.canvas.parentElement!.clientHeight;
    this.aim(pane, height);
    const pointer = new THREE.Vector2(
      (2 * (x - pane.x)) / pane.width - 1,
      1 - (2 * y) / height,
    );
    const caster = new THREE.Raycaster();
    caster.setFromCamera(pointer, this.camera);
    const from = caster.ray.origin.toArray() as Vector;
    const way = caster.ray.direction.toArray() as Vector;
    const reach = 1.75 * this.model.facts.spacing;
    const { points, normals } = this.model;
    let hit: number | null = null;
    let nearest = Infinity;
    for (let p = 0, at = 0; p < this.model.samples; p++, at += 3) {
      if (normals[at]! * way[0] + normals[at + 1]! * way[1] + normals[at + 2]! * way[2] >= 0) continue;
      const dx = points[at]! - from[0];
      const dy = points[at + 1]! - from[1];
      const dz = points[at + 2]! - from[2];
      const along = dx * way[0] + dy * way[1] + dz * way[2];
      if (along <= 0 || along - reach > nearest) continue;
      const away = Math.sqrt(Math.max(dx * dx + dy * dy + dz * dz - along * along, 0));
      // Of neighbours, the one whose middle is nearest to the ray.
      const score = along + 2 * away;
      if (away <= reach && score < nearest) [nearest, hit] = [score, p];
    }
    return hit;
  }
}

function extentOf(model: Model): [THREE.Vector3, number] {
  const low = new THREE.Vector3(Infinity, Infinity, Infinity);
  const high = low.clone().negate();
  for (let p = 0; p < model.samples; p++) {
    const point = new THREE.Vector3(...model.point(p));
    low.min(point);
    high.max(point);
  }
  return [low.clone().add(high).multiplyScalar(0.5), Math.max(low.distanceTo(high) / 2, 1e-6)];
}

/** Of a frustum: long enough to be seen, and short enough not to reach the next camera. */
function lengthOfFrusta(model: Model, radius: number): number {
  const positions = model.cameras.map((camera) => camera.position);
  const gaps = positions.slice(0, 200).map((a) => {
    const away = positions.map((b) => norm(minus(a, b))).filter((gap) => gap > 1e-9);
    return away.length ? Math.min(...away) : Infinity;
  });
  const gap = gaps.sort((a, b) => a - b)[gaps.length >> 1] ?? Infinity;
  return Math.min(Math.max(0.5 * gap, 0.03 * radius), 0.11 * radius);
}

/** What is up in most pictures, if they agree; otherwise z. */
function upOf(model: Model): Vector {
  const sum: Vector = [0, 0, 0];
  for (const camera of model.cameras) {
    const down = axis(camera, 1);
    for (const k of [0, 1, 2] as const) sum[k] -= down[k] / model.cameras.length;
  }
  const length = norm(sum);
  const most = [0, 1, 2].find((k) => Math.abs(sum[k]!) > 0.9 * length);
  if (length < 0.5 || most === undefined) return [0, 0, 1];
  return [0, 1, 2].map((k) => (k === most ? Math.sign(sum[k]!) : 0)) as Vector;
}
