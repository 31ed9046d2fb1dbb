// The surface as discs along it, one per sample: overlapping, they look like one surface.
import * as THREE from "three";
import type { Scheme } from "./colours";
import { NONE, type Model, type Plan } from "./model";

const RADIUS = 1.75; // spacings: random samples then leave hardly any hole
const RAISE = 0.22; // of the radius: the middle of a disc wins over the edge of its neighbour

/** Flags of a sample. */
const enum State {
  Striped = 1,
  /** Of a camera that is selected: it sees the sample, it holds it in focus. */
  Seen = 2,
  Held = 4,
}

const VERTICES = 4; // of a disc
const SHUFFLE = 0.6180339887; // of all discs, between one and the next that is drawn

const VERTEX = /* glsl */ `
attribute vec3 towards;
attribute vec4 tint;
uniform float radius;
varying vec2 at;
varying vec3 normal_view;
varying vec3 place;
varying vec3 colour;
varying float state;
// A pyramid around a disc: its raised middle, and the corners of the triangle around its rim.
const vec3 CORNERS[4] = vec3[4](
  vec3(0.0, 0.0, 1.0), vec3(-1.7320508, -1.0, -1.0), vec3(1.7320508, -1.0, -1.0), vec3(0.0, 2.0, -1.0)
);
void main() {
  vec3 n = normalize(towards);
  vec3 t = normalize(cross(n, abs(n.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0)));
  vec3 b = cross(n, t);
  normal_view = normalMatrix * n;
  int which = gl_VertexID % 4;
  // Seen from behind it is flat: one triangle, not three.
  if (which == 0 && dot(normal_view, (modelViewMatrix * vec4(position, 1.0)).xyz) > 0.0) which = 1;
  vec3 corner = CORNERS[which];
  vec3 local = corner.x * t + corner.y * b + ${RAISE.toFixed(2)} * corner.z * n;
  vec4 seen = modelViewMatrix * vec4(position + radius * local, 1.0);
  at = corner.xy;
  place = seen.xyz;
  colour = tint.rgb;
  state = tint.a;
  gl_Position = projectionMatrix * seen;
}`;

const FRAGMENT = /* glsl */ `
uniform float selecting;
uniform vec3 paper;
uniform float pixels;
varying vec2 at;
varying vec3 normal_view;
varying vec3 place;
varying vec3 colour;
varying float state;
void main() {
  if (dot(at, at) > 1.0) discard;
  int flags = int(255.0 * state + 0.5);
  vec3 n = normalize(normal_view);
  float facing = dot(n, normalize(-place));
  vec3 base = colour;
  if ((flags & ${State.Striped}) != 0) {
    float stripe = mod(gl_FragCoord.x + gl_FragCoord.y, 8.0 * pixels);
    base *= stripe < 2.5 * pixels ? 0.62 : 1.0;
  }
  float light = 0.66 + 0.36 * max(dot(n, normalize(vec3(-0.35, 0.55, 0.76))), 0.0);
  light *= 0.82 + 0.18 * smoothstep(0.0, 0.55, abs(facing));
  if (facing < 0.0) { base = mix(base, vec3(0.45), 0.75); light = 0.6; }
  vec3 lit = base * light;
  if (selecting > 0.5) {
    float grey = dot(lit, vec3(0.3, 0.59, 0.11));
    if ((flags & ${State.Seen}) == 0) lit = mix(mix(vec3(grey), lit, 0.12), paper, 0.5);
    else if ((flags & ${State.Held}) == 0) lit = mix(mix(vec3(grey), lit, 0.45), paper, 0.22);
  }
  gl_FragColor = vec4(lit, 1.0);
}`;

export class Splats {
  readonly meshes: THREE.Mesh[];
  private readonly material: THREE.ShaderMaterial;
  private readonly tints: THREE.BufferAttribute[];
  private readonly radius: number;

  constructor(private readonly model: Model) {
    this.radius = RADIUS * model.facts.spacing;
    this.material = new THREE.ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      side: THREE.DoubleSide,
      uniforms: {
        radius: { value: this.radius },
        selecting: { value: 0 },
        paper: { value: new THREE.Vector3(1, 1, 1) },
        pixels: { value: 1 },
      },
    });
    // Not instanced: drawing one small thing very many times is slow, most of all without a
    // graphics card.
    const { samples } = model;
    const position = new THREE.BufferAttribute(repeated(model.points, 3), 3);
    const packed = new Int16Array(4 * samples);
    for (let p = 0; p < samples; p++) {
      for (let k = 0; k < 3; k++) packed[4 * p + k] = Math.round(32767 * model.normals[3 * p + k]!);
    }
    const towards = new THREE.BufferAttribute(repeated(packed, 4), 4, true);
    const index = new THREE.BufferAttribute(triangles(samples), 1);
    this.tints = model.plans.map(
      () => new THREE.BufferAttribute(new Uint8Array(4 * VERTICES * samples), 4, true),
    );
    this.meshes = this.tints.map((tint) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", position);
      geometry.setAttribute("towards", towards);
      geometry.setAttribute("tint", tint);
      geometry.setIndex(index);
      const mesh = new THREE.Mesh(geometry, this.material);
      mesh.frustumCulled = false;
      return mesh;
    });
  }

  paint(plan: Plan, k: number, scheme: Scheme): void {
    const tint = this.tints[k]!;
    const words = new Uint32Array(tint.array.buffer);
    const { unseen } = this.model.facts.colours;
    for (let p = 0; p < this.model.samples; p++) {
      const colour = scheme.colour(plan, p);
      const striped = plan.camera[p] === NONE && colour === unseen ? State.Striped : 0;
      const kept = words[VERTICES * p]! >>> 24 & ~State.Striped;
      const word = colour[0] | (colour[1] << 8) | (colour[2] << 16) | ((kept | striped) << 24);
      words.fill(word, VERTICES * p, VERTICES * (p + 1));
    }
    tint.needsUpdate = true;
  }

  /** Let stand out what a camera sees and holds; null for none. */
  select(camera: number | null): void {
    this.material.uniforms["selecting"]!.value = camera === null ? 0 : 1;
    if (camera === null) return;
    this.model.plans.forEach((plan, k) => {
      const tint = this.tints[k]!;
      const bytes = tint.array as Uint8Array;
      for (let at = 3; at < bytes.length; at += 4) bytes[at]! &= State.Striped;
      for (const q of this.model.pairsOf(camera)) {
        const flags = plan.pairHeld[q] ? State.Seen | State.Held : State.Seen;
        const first = 4 * VERTICES * this.model.pairSample[q]! + 3;
        for (let v = 0; v < VERTICES; v++) bytes[first + 4 * v]! |= flags;
      }
      tint.needsUpdate = true;
    });
  }

  onPaper(colour: THREE.Color, pixels: number): void {
    this.material.uniforms["paper"]!.value.set(colour.r, colour.g, colour.b);
    this.material.uniforms["pixels"]!.value = pixels;
  }

  /** Draw a share of the discs, as much larger as there are fewer. */
  thin(share: number): void {
    const count = Math.ceil(share * this.model.samples);
    for (const mesh of this.meshes) mesh.geometry.setDrawRange(0, 9 * count);
    this.material.uniforms["radius"]!.value = this.radius / Math.sqrt(share);
  }
}

function repeated<Numbers extends Float32Array | Int16Array>(items: Numbers, size: number): Numbers {
  const all = new (items.constructor as new (length: number) => Numbers)(VERTICES * items.length);
  for (let from = 0, to = 0; from < items.length; from += size) {
    for (let v = 0; v < VERTICES; v++, to += size) {
      for (let k = 0; k < size; k++) all[to + k] = items[from + k]!;
    }
  }
  return all;
}

/** The sides of all pyramids, in an order of which every beginning is spread over the surface. */
function triangles(samples: number): Uint32Array {
  const index = new Uint32Array(9 * samples);
  const step = coprime(Math.max(Math.round(SHUFFLE * samples), 1), samples);
  for (let k = 0, p = 0; k < samples; k++, p = (p + step) % samples) {
    const [top, a, b, c] = [VERTICES * p, VERTICES * p + 1, VERTICES * p + 2, VERTICES * p + 3];
    index.set([top, a, b, top, b, c, top, c, a], 9 * k);
  }
  return index;
}

/** The first number from one on that shares no divisor with another. */
function coprime(from: number, other: number): number {
  const divisor = (a: number, b: number): number => (b ? divisor(b, a % b) : a);
  let found = from;
  while (divisor(found, other) !== 1) found++;
  return found;
}
