// Why a point is as sharp as it is, and what would mend it: only what follows from the geometry.
import {
  axis,
  dot,
  focusInterval,
  metresPerPixel,
  minus,
  nearestSetting,
  norm,
  pixelsOutside,
  plus,
  stoppedDown,
  toCamera,
} from "./geometry";
import { Seen, type Camera, type Model, type Plan, type Vector } from "./model";
import { all, area, counted, listed, metres, millimetres, signed } from "./words";

/** A camera that sees the point. */
export interface View {
  camera: Camera;
  depth: number;
  held: boolean;
  /** The shot that is nearest to holding it. */
  near: number;
  far: number | null;
  /** By how much it is too near for the shot (negative) or too far, with the depth to spare. */
  out: number;
  /** Whether its depth is within the shot's depth of field, if with less to spare. */
  within: boolean;
  cost: number;
  /** Between the line of sight and the surface's normal, degrees. */
  slant: number;
  /** Between the optical axis and the inward normal, degrees: θ of Eq. 1. */
  tilt: number;
  /** From the optical axis, metres. */
  offAxis: number;
  /** The two terms of Eq. 1 that focus does not change. */
  areaTerm: number;
  axisTerm: number;
}

export type Blindness = "no picture" | "behind" | "outside" | "faces away" | "too coarse" | "hidden";

/** A camera that does not see the point. */
export interface Blind {
  camera: Camera;
  why: Blindness;
  /** Pixels by which it is outside the picture. */
  pixels: number;
  faces: boolean;
}

export interface Explanation {
  state: Seen;
  views: View[];
  blind: Blind[];
  why: string[];
  mends: string[];
}

const GRAZING = 60; // degrees
const MOST_STOPS = 4;

export function explain(model: Model, plan: Plan, p: number): Explanation {
  const state = model.seen(plan, p);
  const views = viewsOf(model, plan, p);
  const seeing = new Set(views.map((view) => view.camera.index));
  const inView = new Set(model.pairCamera.subarray(model.offsets[p]!, model.offsets[p + 1]!));
  const blind = model.cameras
    .filter((camera) => !seeing.has(camera.index))
    .map((camera) => blindness(model, camera, p, inView.has(camera.index)));
  const told =
    state === Seen.Unseen
      ? unseen(model, plan, p, blind)
      : views.some((view) => view.held)
        ? held(plan, p, views)
        : blurred(model, plan, p, views);
  return { state, views, blind, ...told };
}

function viewsOf(model: Model, plan: Plan, p: number): View[] {
  const views: View[] = [];
  for (let q = model.offsets[p]!; q < model.offsets[p + 1]!; q++) {
    if (takesPictures(plan, model.cameras[model.pairCamera[q]!]!)) views.push(viewOf(model, plan, p, q));
  }
  return views.sort((a, b) => a.cost - b.cost);
}

/** Whether a plan takes pictures with a camera: where these are limited it may take none. */
function takesPictures(plan: Plan, camera: Camera): boolean {
  return plan.cameras[camera.index]!.shots.length > 0;
}

function viewOf(model: Model, plan: Plan, p: number, q: number): View {
  const camera = model.cameras[model.pairCamera[q]!]!;
  const depth = model.pairDepth[q]!;
  const held = plan.pairHeld[q] === 1;
  const outs = plan.cameras[camera.index]!.shots.map((shot) => {
    const { tolerance } = model.facts;
    const before = Math.max(shot.near - (depth - tolerance), 0);
    const beyond = shot.far === null ? 0 : Math.max(depth + tolerance - shot.far, 0);
    return { shot, out: beyond > before ? beyond : -before };
  });
  const nearest = outs.reduce((a, b) => (Math.abs(b.out) < Math.abs(a.out) ? b : a));
  const [x, y, z] = toCamera(camera, model.point(p));
  const sight = minus(camera.position, model.point(p));
  const cosine = dot(sight, model.normal(p)) / norm(sight);
  const { area: w1, axis: w2, areaScale, axisLimit } = model.facts.model;
  const towards = -dot(axis(camera, 2), model.normal(p));
  const offAxis = Math.hypot(x, y);
  return {
    camera,
    depth,
    held,
    near: nearest.shot.near,
    far: nearest.shot.far,
    out: held ? 0 : nearest.out,
    within: depth >= nearest.shot.near && depth <= (nearest.shot.far ?? Infinity),
    cost: model.pairCost[q]! + (held ? 0 : model.facts.focusWeight),
    slant: degrees(cosine),
    tilt: degrees(towards),
    offAxis,
    areaTerm: w1 * (towards > 0 ? Math.min((areaScale * z * z) / towards, 1) : 1),
    axisTerm: w2 * Math.min(offAxis / axisLimit, 1),
  };
}

function degrees(cosine: number): number {
  return (Math.acos(Math.min(Math.max(cosine, -1), 1)) * 180) / Math.PI;
}

/** Why a camera does not see a point, though it may be in view of one that takes no picture. */
function blindness(model: Model, camera: Camera, p: number, inView: boolean): Blind {
  const point = model.point(p);
  const at = toCamera(camera, point);
  const faces = dot(model.normal(p), minus(point, camera.position)) < 0;
  if (inView) return { camera, why: "no picture", pixels: 0, faces };
  if (at[2] <= camera.optics.focal) return { camera, why: "behind", pixels: Infinity, faces };
  const pixels = pixelsOutside(camera, at);
  const why = pixels > 0 ? "outside" : !faces ? "faces away" : tooCoarse(model, camera, p) ? "too coarse" : "hidden";
  return { camera, why, pixels, faces };
}

/** Whether a camera would image the point more coarsely than counts, were it not hidden. */
function tooCoarse(model: Model, camera: Camera, p: number): boolean {
  const most = model.facts.mostMmPerPixel;
  return most !== null && 1000 * metresPerPixel(camera, model.point(p), model.normal(p)) > most;
}

/** What the program says of one camera that sees the point. */
export function verdictOf(model: Model, view: View): string {
  if (view.held) return "sharp";
  if (view.out === 0) return "out of focus"; // by less than depths are told with
  const { tolerance } = model.facts;
  const limit = view.out < 0 ? "near limit" : "far limit";
  const away = Math.abs(view.out) - tolerance;
  if (view.within) {
    return `only ${millimetres(away)} inside its ${limit}, not ${millimetres(tolerance)}`;
  }
  return `${millimetres(away)} ${view.out < 0 ? "before" : "beyond"} its ${limit}`;
}

export function remarksOn(model: Model, view: View): string[] {
  const remarks = [];
  if (view.slant > GRAZING) remarks.push(`grazing: ${Math.round(view.slant)}° off the normal`);
  if (view.offAxis > model.facts.model.axisLimit / 2) {
    remarks.push(`off axis: ${millimetres(view.offAxis)}`);
  }
  return remarks;
}

// --- sharp somewhere ---------------------------------------------------------------------------

function held(plan: Plan, p: number, views: View[]) {
  const best = views.find((view) => view.camera.index === plan.camera[p]) ?? views[0]!;
  const sharp = views.filter((view) => view.held);
  const why = [];
  if (!best.held) {
    why.push(
      `${best.camera.name} images it best although it is out of focus there: its view costs ` +
        `${best.cost.toFixed(3)}, that of ${sharp[0]!.camera.name}, which holds it in focus, ` +
        `${sharp[0]!.cost.toFixed(3)}.`,
    );
  }
  why.push(termsOf(best));
  const blurred = views.length - sharp.length;
  if (blurred > 0) {
    why.push(`${counted(blurred, "camera sees", "cameras see")} it out of focus.`);
  }
  return { why, mends: [] };
}

function termsOf(view: View): string {
  const grazing = view.slant > GRAZING ? " (grazing)" : "";
  const off = view.held ? "" : ", the rest from being out of focus";
  return (
    `In ${view.camera.name}, ${view.areaTerm.toFixed(3)} of its cost comes from a distance of ` +
    `${metres(view.depth)} and a tilt of ${Math.round(view.tilt)}° against the picture${grazing}, ` +
    `${view.axisTerm.toFixed(3)} from being ${millimetres(view.offAxis)} off the axis${off}.`
  );
}

// --- seen, but out of focus --------------------------------------------------------------------

function blurred(model: Model, plan: Plan, p: number, views: View[]) {
  const why = [outOf(model, views)];
  const grazing = views.filter((view) => view.slant > GRAZING).length;
  if (grazing) {
    const whose = views.length > 1 ? ` in ${grazing} of them` : "";
    why.push(`Grazing${whose}: seen from more than ${GRAZING}° off its normal.`);
  }
  const best = views.find((view) => view.camera.index === plan.camera[p]) ?? views[0]!;
  why.push(termsOf(best));
  return { why, mends: [...refocused(model, plan, views), ...stopped(model, plan, views)] };
}

function outOf(model: Model, views: View[]): string {
  const { tolerance } = model.facts;
  const near = views.filter((view) => view.out < 0).length;
  const far = views.filter((view) => view.out > 0).length;
  const both = near > 0 && far > 0;
  const sides = [];
  if (near) sides.push(both ? `too near for ${near}` : "too near");
  if (far) sides.push(both ? `too far for ${far}` : "too far");
  const margin = tolerance ? `, less ${millimetres(tolerance)} at either limit` : "";
  const who = `${all(views.length, "camera")} that ${views.length === 1 ? "sees" : "see"} it`;
  const text = `Out of the depth of field of ${who}${margin}`;
  const nearest = views.reduce((a, b) => (Math.abs(b.out) < Math.abs(a.out) ? b : a));
  if (!nearest.out) return `${text}.`; // by less than depths are told with
  if (views.length === 1) return `${text}: ${listed(sides)}, by ${millimetres(nearest.out)}.`;
  return (
    `${text}: ${listed(sides)}. ${nearest.camera.name} comes closest and misses it by ` +
    `${millimetres(nearest.out)}.`
  );
}

interface Move {
  view: View;
  from: number;
  to: number;
  gained: number;
  lost: number;
}

function refocused(model: Model, plan: Plan, views: View[]): string[] {
  const moves = views
    .map((view) => moveOf(model, plan, view))
    .filter((move) => move !== null)
    .sort((a, b) => b.gained - b.lost - (a.gained - a.lost));
  if (!moves.length) return ["No lens that sees it can be set so as to hold it."];
  const best = moves[0]!;
  const words = (move: Move) => {
    const by = millimetres(move.to - move.from);
    const way = move.to < move.from ? "nearer" : "farther";
    return (
      `Focus ${move.view.camera.name} ${by} ${way}, at ${settingOf(model, plan, move)}: it would hold this ` +
      `point. ${area(move.gained)} that is sharp nowhere would become sharp, and ` +
      `${area(move.lost)} would be sharp in no picture any more.`
    );
  };
  const told = [words(best)];
  if (best.gained <= best.lost) {
    told.push(
      `Or take one more picture with ${best.view.camera.name}, focused there: then nothing is lost.`,
    );
  }
  return told;
}

/** A focus to set, with as many decimals as tell it from what the lens takes beside it. */
function settingOf(model: Model, plan: Plan, { view, to }: Move): string {
  const { decimals } = model.facts;
  if (!model.lens(plan, view.camera).distances) return metres(to, decimals);
  const digits = to.toFixed(6).replace(/0+$/, "").split(".")[1]!.length;
  return metres(to, Math.max(digits, decimals));
}

/** The least change of a camera's focus that holds the point, and what it does to the surface. */
function moveOf(model: Model, plan: Plan, view: View): Move | null {
  const { tolerance, decimals } = model.facts;
  const lens = model.lens(plan, view.camera);
  const interval = focusInterval(view.depth, lens, tolerance);
  if (!interval) return null;
  const shots = plan.cameras[view.camera.index]!.shots;
  const targets: number[] = [];
  for (const { focus } of shots) {
    const target = nearestSetting(focus, interval, lens, decimals);
    if (target === null) return null;
    targets.push(target);
  }
  const change = (k: number) => Math.abs(targets[k]! - shots[k]!.focus);
  const moved = shots.map((_, k) => k).reduce((a, b) => (change(b) < change(a) ? b : a));
  const focuses = shots.map((shot, k) => (k === moved ? targets[k]! : shot.focus));
  let gained = 0;
  let lost = 0;
  for (const q of model.pairsOf(view.camera.index)) {
    const p = model.pairSample[q]!;
    const range = focusInterval(model.pairDepth[q]!, lens, tolerance);
    const then = range !== null && focuses.some((s) => s >= range[0] && s <= range[1]);
    const now = plan.pairHeld[q] === 1;
    if (then && !now && plan.views[p] === 0) gained += model.areas[p]!;
    if (now && !then && plan.views[p] === 1) lost += model.areas[p]!;
  }
  return { view, from: shots[moved]!.focus, to: targets[moved]!, gained, lost };
}

function stopped(model: Model, plan: Plan, views: View[]): string[] {
  const least = views
    .flatMap((view) =>
      plan.cameras[view.camera.index]!.shots.map((shot) => ({
        view,
        times: stoppedDown(shot.focus, view.depth, model.lens(plan, view.camera), model.facts.tolerance),
      })),
    )
    .reduce((a, b) => (b.times < a.times ? b : a));
  const exact = 2 * Math.log2(least.times);
  if (!(exact > 0 && exact <= MOST_STOPS)) return [];
  // Rounded up: less would not do.
  const stops = Math.ceil(10 * exact) / 10;
  const times = 2 ** (stops / 2);
  return [
    `Or stop ${least.view.camera.name} down by ${stops.toFixed(1)} stops (${(Math.ceil(100 * times) / 100).toFixed(2)} ` +
      "times its f-number): its depth of field would reach the point without a change of focus.",
  ];
}

// --- seen by none ------------------------------------------------------------------------------

function unseen(model: Model, plan: Plan, p: number, blind: Blind[]) {
  const of = (why: Blindness) => blind.filter((each) => each.why === why);
  const hidden = of("hidden");
  const away = of("faces away");
  const coarse = of("too coarse");
  const outside = blind.filter((each) => each.why === "outside" || each.why === "behind");
  const idle = of("no picture");
  const why = [];
  if (idle.length) {
    why.push(
      `In view of ${counted(idle.length, "camera")} that ${idle.length > 1 ? "take" : "takes"} no picture, ` +
        `as pictures are limited: ${some(idle)}.`,
    );
  }
  if (hidden.length) {
    why.push(
      `Hidden by other parts of the surface from ${counted(hidden.length, "camera")} that it faces ` +
        `and in whose picture it would be: ${some(hidden)}.`,
    );
  }
  if (coarse.length) {
    why.push(
      `Imaged with more than ${model.facts.mostMmPerPixel} mm per pixel, if at all, by ` +
        `${counted(coarse.length, "camera")} that it faces: ${some(coarse)}.`,
    );
  }
  if (away.length) {
    why.push(`It faces away from ${counted(away.length, "camera")} in whose picture it would be.`);
  }
  if (outside.length) {
    const whole = outside.length === blind.length;
    const whose = whole ? all(blind.length, "camera") : counted(outside.length, "camera");
    why.push(`It is outside the picture of ${whose}.`);
  }
  if (idle.length) {
    return { why, mends: [`Allow more pictures, and take one with ${idle[0]!.camera.name}.`] };
  }
  const taking = outside.filter((each) => takesPictures(plan, each.camera));
  return { why, mends: [...turned(taking), ...added(model, p)] };
}

function turned(outside: Blind[]): string[] {
  const candidates = outside.filter((each) => each.faces && Number.isFinite(each.pixels));
  if (!candidates.length) return [];
  const nearest = candidates.reduce((a, b) => (b.pixels < a.pixels ? b : a));
  const turn = (Math.atan(nearest.pixels / nearest.camera.picture.f[0]) * 180) / Math.PI;
  if (turn > 30) return [];
  return [
    `Turn ${nearest.camera.name} by about ${turn.toFixed(1)}°: the point faces it and misses its ` +
      `picture by ${Math.ceil(nearest.pixels)} pixels. Whether something is in between is not known.`,
  ];
}

/** A camera on the point's normal, as far away as cameras of this rig are from what they see. */
function added(model: Model, p: number): string[] {
  const every = Math.ceil(model.pairDepth.length / 4096);
  const depths = model.pairDepth.filter((_, q) => q % every === 0).sort();
  const distance = depths[depths.length >> 1] ?? 0;
  if (!distance) return [];
  const at = plus(model.point(p), model.normal(p), distance);
  const place = at.map((each) => signed(each.toFixed(2))).join(", ");
  if (!isFree(model, p, at)) {
    return ["Another place for a camera is hard to find: along its normal, too, the surface is in the way."];
  }
  return [`Add a camera that looks at it along its normal, for instance from (${place}) m: as far as the samples tell, nothing is in between.`];
}

/** Whether no sample's disc is between the point and a place. */
function isFree(model: Model, p: number, place: Vector): boolean {
  const from = model.point(p);
  const way = minus(place, from);
  const length = norm(way);
  const reach = 1.5 * model.facts.spacing;
  for (let other = 0; other < model.samples; other++) {
    const d = minus(model.point(other), from);
    const along = dot(d, way) / length;
    if (along < 3 * reach || along > length) continue;
    if (dot(d, d) - along * along < reach * reach) return false;
  }
  return true;
}

function some(blind: Blind[]): string {
  const names = blind.map((each) => each.camera.name);
  if (names.length <= 4) return listed(names);
  return `${names.slice(0, 3).join(", ")} and ${names.length - 3} more`;
}
