// Where a camera images a point, and what a lens holds in focus: as the planner computes it.
import type { Camera, Vector } from "./model";
import type { Image, Lens } from "./payload";

export function minus(a: Vector, b: Vector): Vector {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function plus(a: Vector, b: Vector, times = 1): Vector {
  return [a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]];
}

export function dot(a: Vector, b: Vector): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function norm(a: Vector): number {
  return Math.hypot(a[0], a[1], a[2]);
}

function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

function unit(a: Vector): Vector {
  const length = norm(a);
  return [a[0] / length, a[1] / length, a[2] / length];
}

/** A camera's x, y or z axis in the rig's frame. */
export function axis(camera: Camera, which: 0 | 1 | 2): Vector {
  const r = camera.rotation;
  return [r[which]!, r[3 + which]!, r[6 + which]!];
}

/** A point of the rig's frame in the camera's: x right, y down, z forward. */
export function toCamera(camera: Camera, point: Vector): Vector {
  const d = minus(point, camera.position);
  return [dot(axis(camera, 0), d), dot(axis(camera, 1), d), dot(axis(camera, 2), d)];
}

export function fromCamera(camera: Camera, [x, y, z]: Vector): Vector {
  const along = plus(camera.position, axis(camera, 0), x);
  return plus(plus(along, axis(camera, 1), y), axis(camera, 2), z);
}

/** The four points that the image's corners show at a depth, in the rig's frame. */
export function corners(camera: Camera, depth: number): Vector[] {
  return camera.picture.corners.map(([x, y]) => fromCamera(camera, [x * depth, y * depth, depth]));
}

/** The image of (x, y, 1) relative to the principal point, in focal lengths. */
function distorted(image: Image, x: number, y: number): [number, number] {
  const k = image.k;
  const square = x * x + y * y;
  if (image.kind === "pinhole") return [x, y];
  if (image.kind === "fisheye") {
    const tangent = Math.sqrt(square);
    const angle = Math.atan(tangent);
    const t = angle * angle;
    const grown = angle * (1 + t * (k[0]! + t * (k[1]! + t * (k[2]! + t * k[3]!))));
    const scale = tangent > 0 ? grown / tangent : 1;
    return [scale * x, scale * y];
  }
  const above = 1 + square * (k[0]! + square * (k[1]! + square * k[4]!));
  const below = 1 + square * (k[5]! + square * (k[6]! + square * k[7]!));
  const scale = below > 0 ? above / below : Infinity;
  const twice = 2 * x * y;
  return [
    scale * x + k[2]! * twice + k[3]! * (square + 2 * x * x) + square * (k[8]! + square * k[9]!),
    scale * y + k[2]! * (square + 2 * y * y) + k[3]! * twice + square * (k[10]! + square * k[11]!),
  ];
}

/** By how many pixels a point in front of a camera misses its picture; 0 if it is in it. */
export function pixelsOutside(camera: Camera, [x, y, z]: Vector): number {
  const image = camera.picture;
  if (image.reach !== null && !(Math.hypot(x, y) / z < image.reach)) return Infinity;
  const [a, b] = distorted(image, x / z, y / z);
  const u = image.f[0] * a + image.c[0];
  const v = image.f[1] * b + image.c[1];
  if (u >= -0.5 && u < image.size[0] - 0.5 && v >= -0.5 && v < image.size[1] - 0.5) return 0;
  const beyond = (at: number, size: number) => Math.max(-0.5 - at, at - (size - 0.5), 0);
  return Math.max(Math.hypot(beyond(u, image.size[0]), beyond(v, image.size[1])), 1e-3);
}

/**
 * How far pixels that are read out are apart along the surface, where that is farthest; metres.
 *
 * By a short step along each of two directions on the tangent plane.
 */
export function metresPerPixel(camera: Camera, point: Vector, normal: Vector): number {
  const image = camera.picture;
  const imaged = (at: Vector): [number, number] => {
    const [x, y, z] = toCamera(camera, at);
    const [a, b] = distorted(image, x / z, y / z);
    return [(image.f[0] * a) / image.bin[0], (image.f[1] * b) / image.bin[1]];
  };
  const least = [0, 1, 2].reduce((a, b) => (Math.abs(normal[b]!) < Math.abs(normal[a]!) ? b : a));
  const other: Vector = [least === 0 ? 1 : 0, least === 1 ? 1 : 0, least === 2 ? 1 : 0];
  const first = unit(cross(normal, other));
  const second = unit(cross(normal, first));
  const step = 1e-5 * norm(minus(point, camera.position));
  const [[a, c], [b, d]] = [first, second].map((way): [number, number] => {
    const [u0, v0] = imaged(plus(point, way, -step));
    const [u1, v1] = imaged(plus(point, way, step));
    return [(u1 - u0) / (2 * step), (v1 - v0) / (2 * step)];
  }) as [[number, number], [number, number]];
  // The reciprocal of the least singular value of [[a, b], [c, d]].
  const squares = a * a + b * b + c * c + d * d;
  const area = Math.abs(a * d - b * c);
  return Math.sqrt((squares + Math.sqrt(Math.max(squares ** 2 - 4 * area ** 2, 0))) / 2) / area;
}

/** The focus distances that hold a depth in focus, within the lens's limits; null if none do. */
export function focusInterval(
  depth: number,
  lens: Lens,
  tolerance: number,
): [number, number] | null {
  const { hyperfocal: h, focal: f } = lens;
  const back = depth + tolerance;
  const front = depth - tolerance;
  const near = Math.max((back * (h + f)) / (h + back), lens.limits[0]);
  let far = h > front ? (front * (h - f)) / (h - front) : Infinity;
  far = Math.min(far, lens.limits[1] ?? Infinity);
  return near <= far && front > f ? [near, far] : null;
}

/** The distance within an interval that is nearest to another, of those that the lens takes. */
export function nearestSetting(
  focus: number,
  [low, high]: [number, number],
  lens: Lens,
  decimals: number,
): number | null {
  const { distances } = lens;
  if (!distances) {
    // As it is told: rounded, but not out of the interval.
    const step = 10 ** -decimals;
    const exact = Math.min(Math.max(focus, low), high);
    const told = step * (exact > focus ? Math.ceil(exact / step) : Math.floor(exact / step));
    return told >= low && told <= high ? told : exact;
  }
  const first = distances[countBelow(distances, (each) => each < low)] ?? Infinity;
  const last = distances[countBelow(distances, (each) => each <= high) - 1] ?? -Infinity;
  return first <= last ? Math.min(Math.max(focus, first), last) : null;
}

/** How many of ascending numbers come before the first that is not below. */
function countBelow(numbers: number[], isBelow: (each: number) => boolean): number {
  let low = 0;
  let high = numbers.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (isBelow(numbers[middle]!)) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** By what the f-number must be multiplied for a focus to hold a depth; Infinity if none does. */
export function stoppedDown(focus: number, depth: number, lens: Lens, tolerance: number): number {
  const least = Math.max(
    ...[depth - tolerance, depth + tolerance].map((d) => {
      // From D_N = H·s / (H + s − F) and D_F = H·s / (H − s + F).
      const away = Math.abs(d - focus);
      const most = away > 0 ? (d * (focus - lens.focal)) / away : Infinity;
      return most > 0 ? lens.hyperfocal / most : Infinity;
    }),
  );
  return least;
}
