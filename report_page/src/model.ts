// What a report is about, decoded: the surface, the rig, the plans, and who sees what.
import type { CameraFocus, Facts, Image, Lens, Payload, PlanFacts, RigCamera } from "./payload";

export type Vector = [number, number, number];

export const NONE = -1;

/** What a sample is in a plan, as it is coloured. */
export const enum Seen {
  Unseen,
  Blurred,
  Sharp,
}

export interface Plan extends PlanFacts {
  cost: Float32Array;
  /** The camera that images a sample best; -1 where none sees it. */
  camera: Int32Array;
  sharp: Uint8Array;
  views: ArrayLike<number>;
  pairHeld: Uint8Array;
}

export interface Camera extends RigCamera {
  index: number;
  picture: Image;
  optics: Lens;
}

export class Model {
  readonly facts: Facts;
  readonly cameras: Camera[];
  readonly points: Float32Array;
  readonly normals: Float32Array;
  readonly areas: Float32Array;
  readonly importance: Float32Array | null;
  /** Sample p's pairs are offsets[p] to offsets[p + 1]. */
  readonly offsets: Uint32Array;
  readonly pairCamera: Uint32Array;
  readonly pairSample: Uint32Array;
  readonly pairDepth: Float32Array;
  readonly pairCost: Float32Array;
  readonly plans: Plan[];
  private byCamera: { offsets: Uint32Array; pairs: Uint32Array } | null = null;

  constructor(private readonly payload: Payload) {
    const facts = (this.facts = payload.facts);
    this.cameras = facts.cameras.map((camera, index) => ({
      ...camera,
      index,
      picture: facts.images[camera.image]!,
      optics: facts.lenses[camera.lens]!,
    }));
    this.points = interleaved(payload.shares("points", 0, facts.extent), facts.origin);
    this.normals = unfolded(payload.shares("normals", -1, 2));
    this.areas = payload.shares("areas", 0, facts.areaUnit);
    this.importance = facts.importance ? payload.shares("importance") : null;
    const counts = payload.whole("counts");
    this.offsets = new Uint32Array(facts.samples + 1);
    for (let p = 0; p < facts.samples; p++) this.offsets[p + 1] = this.offsets[p]! + counts[p]!;
    this.pairSample = new Uint32Array(facts.pairs);
    this.pairCamera = new Uint32Array(facts.pairs);
    const steps = payload.whole("cameras");
    for (let p = 0; p < facts.samples; p++) {
      let camera = 0;
      for (let q = this.offsets[p]!; q < this.offsets[p + 1]!; q++) {
        camera += steps[q]!;
        this.pairCamera[q] = camera;
        this.pairSample[q] = p;
      }
    }
    this.pairDepth = payload.shares("depths", facts.depth[0], facts.depth[1]);
    this.pairCost = payload.shares("costs");
    this.plans = facts.plans.map((plan, k) => ({
      ...plan,
      cost: payload.shares(`cost${k}`),
      camera: Int32Array.from(payload.whole(`camera${k}`), (each) => each - 1),
      sharp: payload.bits(`sharp${k}`),
      views: payload.whole(`views${k}`),
      pairHeld: payload.bits(`held${k}`),
    }));
  }

  get samples(): number {
    return this.facts.samples;
  }

  point(p: number): Vector {
    return [this.points[3 * p]!, this.points[3 * p + 1]!, this.points[3 * p + 2]!];
  }

  normal(p: number): Vector {
    return [this.normals[3 * p]!, this.normals[3 * p + 1]!, this.normals[3 * p + 2]!];
  }

  seen(plan: Plan, p: number): Seen {
    if (plan.camera[p] === NONE) return Seen.Unseen;
    return plan.sharp[p] ? Seen.Sharp : Seen.Blurred;
  }

  /** A camera's pairs, by sample. */
  pairsOf(camera: number): Uint32Array {
    this.byCamera ??= this.sortedByCamera();
    const { offsets, pairs } = this.byCamera;
    return pairs.subarray(offsets[camera]!, offsets[camera + 1]!);
  }

  focus(plan: Plan, camera: number): CameraFocus {
    return plan.cameras[camera]!;
  }

  /** A camera's own picture in a plan, as an address within this page; null if there is none. */
  picture(plan: number, camera: number): string | null {
    const name = `picture${plan}.${camera}`;
    if (!this.payload.has(name)) return null;
    const bytes = this.payload.bytes(name) as Uint8Array<ArrayBuffer>;
    return URL.createObjectURL(new Blob([bytes], { type: "image/webp" }));
  }

  /** The share of the surface of which `of` holds. */
  share(of: (p: number) => boolean): number {
    let area = 0;
    let all = 0;
    for (let p = 0; p < this.samples; p++) {
      all += this.areas[p]!;
      if (of(p)) area += this.areas[p]!;
    }
    return all ? area / all : 0;
  }

  private sortedByCamera() {
    const offsets = new Uint32Array(this.cameras.length + 1);
    for (const camera of this.pairCamera) offsets[camera + 1]!++;
    for (let c = 0; c < this.cameras.length; c++) offsets[c + 1]! += offsets[c]!;
    const next = offsets.slice();
    const pairs = new Uint32Array(this.pairCamera.length);
    this.pairCamera.forEach((camera, q) => (pairs[next[camera]!++] = q));
    return { offsets, pairs };
  }
}

function interleaved(axes: Float32Array, origin: Vector): Float32Array {
  const count = axes.length / 3;
  const points = new Float32Array(axes.length);
  for (let p = 0; p < count; p++) {
    for (let axis = 0; axis < 3; axis++) {
      points[3 * p + axis] = axes[axis * count + p]! + origin[axis]!;
    }
  }
  return points;
}

/** Unit vectors of points on the unfolded octahedron. */
function unfolded(square: Float32Array): Float32Array {
  const count = square.length / 2;
  const normals = new Float32Array(3 * count);
  for (let p = 0; p < count; p++) {
    let x = square[p]!;
    let y = square[count + p]!;
    const z = 1 - Math.abs(x) - Math.abs(y);
    if (z < 0) {
      const folded = (1 - Math.abs(y)) * (x >= 0 ? 1 : -1);
      y = (1 - Math.abs(x)) * (y >= 0 ? 1 : -1);
      x = folded;
    }
    const length = Math.hypot(x, y, z);
    normals[3 * p] = x / length;
    normals[3 * p + 1] = y / length;
    normals[3 * p + 2] = z / length;
  }
  return normals;
}
