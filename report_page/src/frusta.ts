// The cameras as pyramids, all in one draw call; and all of one that is selected.
import * as THREE from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { corners, fromCamera, plus } from "./geometry";
import type { Camera, Model, Plan, Vector } from "./model";

export interface Inks {
  paper: string;
  camera: string;
  idle: string;
  selected: string;
  held: string;
  faint: string;
}

const PLANNED = 1;
const CORNERS = 4; // of a line

/** All cameras, each as long as it is small beside the surface: lines per plan. */
export class Frusta {
  readonly lines: LineSegments2[];

  constructor(
    private readonly model: Model,
    readonly length: number,
  ) {
    const ends = model.cameras.flatMap((camera) => pyramid(camera, length));
    const bare = unrolled(ends);
    this.lines = model.plans.map(() => {
      const geometry = new THREE.BufferGeometry();
      for (const [name, attribute] of Object.entries(bare)) {
        if (name === "index") geometry.setIndex(attribute);
        else geometry.setAttribute(name, attribute);
      }
      const colours = new THREE.BufferAttribute(new Uint8Array(3 * CORNERS * ends.length), 3, true);
      geometry.setAttribute("instanceColorStart", colours);
      geometry.setAttribute("instanceColorEnd", colours);
      const material = lineMaterial(1.25, true);
      material.transparent = true;
      material.opacity = 0.85;
      // Its shader takes lines that are not instanced as well: see `unrolled`.
      const lines = new LineSegments2(geometry as unknown as LineSegmentsGeometry, material);
      lines.frustumCulled = false;
      return lines;
    });
  }

  paint(inks: Inks): void {
    const [planned, idle] = [inks.camera, inks.idle].map((ink) => {
      const { r, g, b } = new THREE.Color(ink);
      return [r, g, b].map((each) => Math.round(255 * each));
    });
    this.model.plans.forEach((plan, k) => {
      const colours = this.lines[k]!.geometry.getAttribute("instanceColorStart");
      const bytes = colours.array as Uint8Array;
      const each = bytes.length / plan.cameras.length;
      plan.cameras.forEach((focus, c) => {
        const colour = focus.status === PLANNED ? planned! : idle!;
        for (let at = c * each; at < (c + 1) * each; at += 3) bytes.set(colour, at);
      });
      (colours as THREE.BufferAttribute).needsUpdate = true;
    });
  }
}

/**
 * What LineSegmentsGeometry tells of an instance, at every corner of every line: to draw one line
 * very many times is slow, most of all without a graphics card.
 */
function unrolled(ends: [Vector, Vector][]): Record<string, THREE.BufferAttribute> {
  const count = CORNERS * ends.length;
  const [position, start, end] = [0, 0, 0].map(() => new Float32Array(3 * count));
  const uv = new Float32Array(2 * count);
  const index = new Uint32Array(6 * ends.length);
  ends.forEach(([from, to], k) => {
    for (let corner = 0; corner < CORNERS; corner++) {
      const at = CORNERS * k + corner;
      const [across, along] = [corner % 2 ? 1 : -1, corner < 2 ? 0 : 1];
      position!.set([across, along, 0], 3 * at);
      uv.set([across, 0], 2 * at);
      start!.set(from, 3 * at);
      end!.set(to, 3 * at);
    }
    const first = CORNERS * k;
    index.set([0, 1, 2, 2, 1, 3].map((corner) => first + corner), 6 * k);
  });
  return {
    position: new THREE.BufferAttribute(position!, 3),
    uv: new THREE.BufferAttribute(uv, 2),
    instanceStart: new THREE.BufferAttribute(start!, 3),
    instanceEnd: new THREE.BufferAttribute(end!, 3),
    index: new THREE.BufferAttribute(index, 1),
  };
}

function pyramid(camera: Camera, length: number): [Vector, Vector][] {
  const deepest = 1 / Math.hypot(...(camera.picture.corners[0] ?? [0, 0]), 1);
  const [a, b, c, d] = corners(camera, length * deepest) as [Vector, Vector, Vector, Vector];
  const apex = camera.position;
  const top = plus(plus(a, b), apex, 0).map((each) => each / 2) as Vector;
  const up = fromCamera(camera, [0, -0.16 * length, 0]);
  const shift: Vector = [up[0] - apex[0], up[1] - apex[1], up[2] - apex[2]];
  const peak = plus(top, shift);
  return [
    ...[a, b, c, d].map((corner): [Vector, Vector] => [apex, corner]),
    [a, b],
    [b, c],
    [c, d],
    [d, a],
    [a, peak],
    [peak, b],
  ];
}

export function lineMaterial(width: number, coloured = false): LineMaterial {
  return new LineMaterial({ linewidth: width, vertexColors: coloured, worldUnits: false });
}

export function segments(pairs: [Vector, Vector][], colour: string, width: number): LineSegments2 {
  const lines = new LineSegments2(new LineSegmentsGeometry(), lineMaterial(width));
  lines.geometry.setPositions(pairs.flatMap(([a, b]) => [...a, ...b]));
  lines.material.color.set(colour);
  return lines;
}

/** A selected camera's frustum, planes of focus, and depths of field, in a plan. */
export function selectedCamera(
  model: Model,
  plan: Plan,
  camera: Camera,
  farthest: number,
  inks: Inks,
): THREE.Group {
  const group = new THREE.Group();
  const shots = model.focus(plan, camera.index).shots;
  if (!shots.length) return group;
  const ends = shots.map((shot) => Math.min(shot.far ?? Infinity, farthest));
  const end = Math.max(...ends, ...shots.map((shot) => shot.focus));
  const rim = corners(camera, end);
  group.add(segments(rim.map((each) => [camera.position, each]), inks.selected, 1.5));
  shots.forEach((shot, k) => {
    const far = Math.max(ends[k]!, shot.near);
    group.add(slab(corners(camera, shot.near), corners(camera, far), inks.selected));
    const plane = corners(camera, Math.min(shot.focus, farthest));
    group.add(sheet(plane, inks.selected), segments(outline(plane), inks.selected, 2.5));
  });
  return group;
}

function outline(quad: Vector[]): [Vector, Vector][] {
  return quad.map((each, k) => [each, quad[(k + 1) % quad.length]!]);
}

function slab(near: Vector[], far: Vector[], colour: string): THREE.Group {
  const group = new THREE.Group();
  const places = [...near, ...far].flat();
  const faces = [0, 1, 2, 0, 2, 3, 4, 6, 5, 4, 7, 6];
  for (let k = 0; k < 4; k++) {
    const next = (k + 1) % 4;
    faces.push(k, k + 4, next, next, k + 4, next + 4);
  }
  group.add(translucent(places, faces, colour, 0.13));
  const edges = [...outline(near), ...outline(far)];
  edges.push(...near.map((each, k): [Vector, Vector] => [each, far[k]!]));
  group.add(segments(edges, colour, 1.1));
  return group;
}

function sheet(quad: Vector[], colour: string): THREE.Mesh {
  return translucent(quad.flat(), [0, 1, 2, 0, 2, 3], colour, 0.16);
}

function translucent(places: number[], faces: number[], colour: string, opacity: number) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
  geometry.setIndex(faces);
  const material = new THREE.MeshBasicMaterial({
    color: colour,
    transparent: true,
    opacity,
    side: THREE.DoubleSide,
    depthWrite: false,
  });
  return new THREE.Mesh(geometry, material);
}

/** A selected point's lines of sight in a plan: sharp ones strong, others faint. */
export function linesOfSight(model: Model, plan: Plan, p: number, inks: Inks): THREE.Group {
  const group = new THREE.Group();
  const point = plus(model.point(p), model.normal(p), model.facts.spacing / 2);
  const of = (held: number) => {
    const lines: [Vector, Vector][] = [];
    for (let q = model.offsets[p]!; q < model.offsets[p + 1]!; q++) {
      const camera = model.pairCamera[q]!;
      if (plan.pairHeld[q] === held && plan.cameras[camera]!.shots.length) {
        lines.push([point, model.cameras[camera]!.position]);
      }
    }
    return lines;
  };
  const [faint, strong] = [of(0), of(1)];
  if (faint.length) {
    const lines = segments(faint, inks.faint, 1);
    lines.material.transparent = true;
    lines.material.opacity = 0.7;
    group.add(lines);
  }
  if (strong.length) group.add(segments(strong, inks.held, 2));
  return group;
}

export function disposeOf(group: THREE.Object3D): void {
  group.traverse((each) => {
    const mesh = each as THREE.Mesh;
    mesh.geometry?.dispose();
    (mesh.material as THREE.Material | undefined)?.dispose();
  });
}
