// What a report is about, decoded: the surface, the rig, the plans, and who sees what.
import type { CameraFocus, Facts, Image, Lens, Payload, PlanFacts, RigCamera, Shares } from "./payload";

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
  /** Whether some shot of a pair's camera holds its sample in focus. */
  readonly pairHeld: Uint8Array;
}

/** Pairs of a sample and a camera that sees it: sample p's are offsets[p] to offsets[p + 1]. */
interface Pairs {
  offsets: Uint32Array;
  camera: Uint32Array;
  sample: Uint32Array;
  depth: Float32Array;
  cost: Float32Array;
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
  readonly plans: Plan[];
  private pairs: Pairs | null = null;
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
    this.plans = facts.plans.map((plan, k) => ({
      ...plan,
      cost: payload.shares(`cost${k}`),
      camera: Int32Array.from(payload.whole(`camera${k}`), (each) => each - 1),
      sharp: payload.bits(`sharp${k}`),
      views: payload.whole(`views${k}`),
      get pairHeld() {
        const pairHeld = payload.bits(`held${k}`);
        Object.defineProperty(this, "pairHeld", { value: pairHeld });
        return pairHeld;
      },
    }));
  }

  get offsets(): Uint32Array {
    return this.allPairs.offsets;
  }

  get pairCamera(): Uint32Array {
    return this.allPairs.camera;
  }

  get pairSample(): Uint32Array {
    return this.allPairs.sample;
  }

  get pairDepth(): Float32Array {
    return this.allPairs.depth;
  }

  get pairCost(): Float32Array {
    return this.allPairs.cost;
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

  /** The lens that a camera has in a plan. */
  lens(plan: Plan, camera: Camera): Lens {
    return this.facts.lenses[plan.lenses?.[camera.index] ?? camera.lens]!;
  }

  /** A camera's own picture in a plan, as an address within this page; null if there is none. */
  picture(plan: number, camera: number): string | null {
    const name = `picture${plan}.${camera}`;
    if (!this.payload.has(name)) return null;
    const bytes = this.payload.bytes(name) as Uint8Array<ArrayBuffer>;
    return URL.createObjectURL(new Blob([bytes], { type: "image/webp" }));
  }

  /** What becomes of the surface: as the plan tells it, else by the samples that are shown. */
  shares(plan: Plan): Shares {
    const of = (kind: Seen) => this.share((p) => this.seen(plan, p) === kind);
    return (plan.shares ??= {
      sharp: of(Seen.Sharp),
      blurred: of(Seen.Blurred),
      unseen: of(Seen.Unseen),
      views: [],
    });
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

  /** Decoded when first asked for: a picture of the surface needs none. */
  private get allPairs(): Pairs {
    return (this.pairs ??= this.decodedPairs());
  }

  private decodedPairs(): Pairs {
    const { samples, pairs, depth } = this.facts;
    const counts = this.payload.whole("counts");
    const steps = this.payload.whole("cameras");
    const offsets = new Uint32Array(samples + 1);
    const sample = new Uint32Array(pairs);
    const camera = new Uint32Array(pairs);
    for (let p = 0; p < samples; p++) {
      offsets[p + 1] = offsets[p]! + counts[p]!;
      for (let q = offsets[p]!, at = 0; q < offsets[p + 1]!; q++) {
        at += steps[q]!;
        camera[q] = at;
        sample[q] = p;
      }
    }
    return {
      offsets,
      camera,
      sample,
      depth: this.payload.shares("depths", depth[0], depth[1]),
      cost: this.payload.shares("costs"),
    };
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
