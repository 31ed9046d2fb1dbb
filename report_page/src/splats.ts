// The surface as discs along it, one per sample: overlapping, they look like one surface.
import * as THREE from "three";
import type { Scheme } from "./colours";
import { NONE, type Model, type Plan } from "./model";

const RADIUS = 1.75; // spacings: random samples then leave hardly any hole
const RAISE = 0.22; // of the radius: the middle of a disc wins over the edge of its neighbour

const VERTEX = /* glsl */ `
attribute vec3 offset;
attribute vec3 towards;
attribute vec4 tint;
attribute float part;
uniform float radius;
varying vec2 at;
varying vec3 normal_view;
varying vec3 place;
varying vec4 colour;
varying float kind;
void main() {
  vec3 n = normalize(towards);
  vec3 t = normalize(cross(n, abs(n.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0)));
  vec3 b = cross(n, t);
  vec3 local = position.x * t + position.y * b + ${RAISE.toFixed(2)} * position.z * n;
  vec4 seen = modelViewMatrix * vec4(offset + radius * local, 1.0);
  at = position.xy;
  normal_view = normalMatrix * n;
  place = seen.xyz;
  colour = tint;
  kind = part;
  gl_Position = projectionMatrix * seen;
}`;

const FRAGMENT = /* glsl */ `
uniform float selecting;
uniform vec3 paper;
uniform float pixels;
varying vec2 at;
varying vec3 normal_view;
varying vec3 place;
varying vec4 colour;
varying float kind;
void main() {
  if (dot(at, at) > 1.0) discard;
  vec3 n = normalize(normal_view);
  float facing = dot(n, normalize(-place));
  vec3 base = colour.rgb;
  if (colour.a < 0.5) {
    float stripe = mod(gl_FragCoord.x + gl_FragCoord.y, 8.0 * pixels);
    base *= stripe < 2.5 * pixels ? 0.62 : 1.0;
  }
  float light = 0.66 + 0.36 * max(dot(n, normalize(vec3(-0.35, 0.55, 0.76))), 0.0);
  light *= 0.82 + 0.18 * smoothstep(0.0, 0.55, abs(facing));
  if (facing < 0.0) { base = mix(base, vec3(0.45), 0.75); light = 0.6; }
  vec3 lit = base * light;
  if (selecting > 0.5) {
    float grey = dot(lit, vec3(0.3, 0.59, 0.11));
    if (kind < 0.25) lit = mix(mix(vec3(grey), lit, 0.12), paper, 0.5);
    else if (kind < 0.75) lit = mix(mix(vec3(grey), lit, 0.45), paper, 0.22);
  }
  gl_FragColor = vec4(lit, 1.0);
}`;

/** What a camera makes of a sample, while it is selected. */
const enum Part {
  Other = 0,
  Sees = 128,
  Holds = 255,
}

export class Splats {
  readonly meshes: THREE.Mesh[];
  private readonly material: THREE.ShaderMaterial;
  private readonly tints: THREE.InstancedBufferAttribute[];
  private readonly parts: THREE.InstancedBufferAttribute[];

  constructor(private readonly model: Model) {
    this.material = new THREE.ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      side: THREE.DoubleSide,
      uniforms: {
        radius: { value: RADIUS * model.facts.spacing },
        selecting: { value: 0 },
        paper: { value: new THREE.Vector3(1, 1, 1) },
        pixels: { value: 1 },
      },
    });
    const offset = new THREE.InstancedBufferAttribute(model.points, 3);
    const packed = Int16Array.from(model.normals, (each) => Math.round(32767 * each));
    const towards = new THREE.InstancedBufferAttribute(packed, 3, true);
    const bytes = (size: number) =>
      new THREE.InstancedBufferAttribute(new Uint8Array(size * model.samples), size, true);
    this.tints = model.plans.map(() => bytes(4));
    this.parts = model.plans.map(() => bytes(1));
    this.meshes = model.plans.map((_, k) => {
      const geometry = disc();
      geometry.setAttribute("offset", offset);
      geometry.setAttribute("towards", towards);
      geometry.setAttribute("tint", this.tints[k]!);
      geometry.setAttribute("part", this.parts[k]!);
      geometry.instanceCount = model.samples;
      const mesh = new THREE.Mesh(geometry, this.material);
      mesh.frustumCulled = false;
      return mesh;
    });
  }

  paint(plan: Plan, k: number, scheme: Scheme): void {
    const tint = this.tints[k]!;
    const bytes = tint.array as Uint8Array;
    const { unseen } = this.model.facts.colours;
    for (let p = 0; p < this.model.samples; p++) {
      const colour = scheme.colour(plan, p);
      bytes[4 * p] = colour[0];
      bytes[4 * p + 1] = colour[1];
      bytes[4 * p + 2] = colour[2];
      bytes[4 * p + 3] = plan.camera[p] === NONE && colour === unseen ? 0 : 255;
    }
    tint.needsUpdate = true;
  }

  /** Let stand out what a camera sees and holds; null for none. */
  select(camera: number | null): void {
    this.material.uniforms["selecting"]!.value = camera === null ? 0 : 1;
    if (camera === null) return;
    this.model.plans.forEach((plan, k) => {
      const part = this.parts[k]!;
      const bytes = part.array as Uint8Array;
      bytes.fill(Part.Other);
      for (const q of this.model.pairsOf(camera)) {
        bytes[this.model.pairSample[q]!] = plan.pairHeld[q] ? Part.Holds : Part.Sees;
      }
      part.needsUpdate = true;
    });
  }

  onPaper(colour: THREE.Color, pixels: number): void {
    this.material.uniforms["paper"]!.value.set(colour.r, colour.g, colour.b);
    this.material.uniforms["pixels"]!.value = pixels;
  }
}

/** A square whose middle is raised, of which the shader keeps a disc. */
function disc(): THREE.InstancedBufferGeometry {
  const geometry = new THREE.InstancedBufferGeometry();
  const corners = [0, 0, 1, -1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0];
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
  geometry.setIndex([0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1]);
  return geometry;
}
