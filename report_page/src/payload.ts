// Reads what focus_planner/report/payload.py writes: see there for the form.

export interface Image {
  kind: "pinhole" | "polynomial" | "fisheye";
  /** tan of the angle off the axis up to which it images; null without end. */
  reach: number | null;
  f: [number, number];
  c: [number, number];
  size: [number, number];
  /** Columns and rows per bin. */
  bin: [number, number];
  k: number[];
  /** x, y at depth 1 of the rays through the corners, clockwise from the top left. */
  corners: [number, number][];
}

export interface Lens {
  focal: number;
  hyperfocal: number;
  limits: [number, number | null];
  /** That it can be set to, ascending; null if any will do. */
  distances: number[] | null;
}

export interface RigCamera {
  name: string;
  position: [number, number, number];
  /** Row by row; the columns are the camera's x, y and z axis in the rig's frame. */
  rotation: number[];
  image: number;
  lens: number;
}

export interface Shot {
  focus: number;
  near: number;
  /** null for infinity. */
  far: number | null;
  assigned: number;
  inFocus: number;
  device: number | null;
  fromSensor: number | null;
}

/** Of the surface's area, as the plan tells them: 0 to 1. */
export interface Shares {
  sharp: number;
  blurred: number;
  unseen: number;
  /** Of what some camera sees: sharp in no picture, in those of one camera, of two, ... or more. */
  views: number[];
}

export interface CameraFocus {
  status: number;
  unit: string | null;
  assigned: number;
  inFocus: number;
  /** The shot that its picture is of. */
  main: number;
  shots: Shot[];
}

export interface PlanFacts {
  title: string;
  method: string;
  /** That it was planned on. */
  samples: number;
  held: number[];
  pictures: boolean;
  /** null if only the samples tell. */
  shares: Shares | null;
  /** Of each camera, if it was made for others than those of the report. */
  lenses: number[] | null;
  /** Whether its cameras see the same samples as the report's. */
  seesTheSame: boolean;
  cameras: CameraFocus[];
}

export interface Facts {
  origin: [number, number, number];
  extent: number;
  depth: [number, number];
  samples: number;
  pairs: number;
  spacing: number;
  area: number;
  areaUnit: number;
  focusWeight: number;
  tolerance: number;
  /** What is imaged with more counts as unseen; null without a limit. */
  mostMmPerPixel: number | null;
  /** Of a point's views, how many make its cost: their mean. */
  views: number;
  model: { area: number; axis: number; areaScale: number; axisLimit: number };
  importance: boolean;
  /** Of a distance in metres. */
  decimals: number;
  /** Red, green, blue, 0 to 255. */
  colours: Record<"sharp" | "blurred" | "unseen", [number, number, number]>;
  frame: string;
  cameras: RigCamera[];
  images: Image[];
  lenses: Lens[];
  plans: PlanFacts[];
  histograms: { edges: number[]; areas: number[] }[];
}

type Whole = Uint8Array | Uint16Array | Uint32Array;

export class Payload {
  constructor(
    readonly facts: Facts,
    private readonly arrays: Map<string, { kind: string; count: number; bytes: Uint8Array }>,
  ) {}

  has(name: string): boolean {
    return this.arrays.has(name);
  }

  whole(name: string): Whole {
    const { kind, count, bytes } = this.array(name);
    if (kind === "u8") return bytes;
    const words = kind === "u16" ? new Uint16Array(count) : new Uint32Array(count);
    for (let plane = 0; plane * count < bytes.length; plane++) {
      for (let i = 0; i < count; i++) words[i]! |= bytes[plane * count + i]! << (8 * plane);
    }
    return words;
  }

  /** Numbers that were told as shares of a range. */
  shares(name: string, low = 0, range = 1): Float32Array {
    const levels = this.whole(name);
    const values = new Float32Array(levels.length);
    for (let i = 0; i < levels.length; i++) values[i] = low + (levels[i]! / 65535) * range;
    return values;
  }

  bits(name: string): Uint8Array {
    const { count, bytes } = this.array(name);
    const flags = new Uint8Array(count);
    for (let i = 0; i < count; i++) flags[i] = (bytes[i >> 3]! >> (i & 7)) & 1;
    return flags;
  }

  bytes(name: string): Uint8Array {
    return this.array(name).bytes;
  }

  private array(name: string) {
    const array = this.arrays.get(name);
    if (!array) throw new Error(`the report lacks ${name}`);
    return array;
  }
}

export async function readPayload(text: string): Promise<Payload> {
  const packed = bytesOfBase64(text.trim());
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const length = new DataView(bytes.buffer).getUint32(0, true);
  const { facts, arrays } = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  let at = 4 + length;
  const index = new Map();
  for (const [name, kind, count] of arrays as [string, string, number][]) {
    const size = kind === "bits" ? (count + 7) >> 3 : (count * Number(kind.slice(1))) / 8;
    index.set(name, { kind, count, bytes: bytes.subarray(at, at + size) });
    at += size;
  }
  return new Payload(facts as Facts, index);
}

function bytesOfBase64(text: string): Uint8Array<ArrayBuffer> {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}
