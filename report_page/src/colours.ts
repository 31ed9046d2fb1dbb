// How the surface is coloured, and what the legend says. Colours are told apart without colour
// vision too: by lightness, and what no camera sees by stripes.
import { NONE, Seen, type Model, type Plan } from "./model";
import { millimetres, percent } from "./words";

export type Colour = [number, number, number];

export interface Key {
  colour: Colour;
  striped?: boolean;
  label: string;
  /** Per plan: the share of the surface. */
  values: string[];
}

export interface Legend {
  keys: Key[];
  /** A continuous scale: colours from left to right, its ends, and a value per plan. */
  scale?: { colours: Colour[]; low: string; high: string; name: string; values: string[] };
  note?: string;
}

export interface Scheme {
  id: string;
  label: string;
  colour(plan: Plan, p: number): Colour;
  legend(plans: Plan[]): Legend;
}

// Of matplotlib (CC0): magma from light to dark, viridis from dark to light.
const MAGMA = ["fcfdbf", "fecf92", "fe9f6d", "f7705c", "de4968", "b73779", "8c2981", "641a80"];
const VIRIDIS = ["482878", "3e4989", "31688e", "26828e", "35b779", "b5de2b"];
const CIVIDIS = ["00224e", "35456c", "666970", "948e77", "c8b866", "fee838"];
// Paul Tol's "muted" and "light" sets.
const MANY = [
  ...["332288", "88ccee", "44aa99", "117733", "999933", "ddcc77", "cc6677", "882255", "aa4499"],
  ...["77aadd", "ee8866", "ffaabb", "bbcc33"],
].map(parsed);
const COST_END = 0.75;

function parsed(hex: string): Colour {
  return [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16)) as Colour;
}

function ramp(names: string[]): (share: number) => Colour {
  const stops = names.map(parsed);
  return (share) => {
    const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
    const k = Math.min(Math.floor(at), stops.length - 2);
    const [a, b] = [stops[k]!, stops[k + 1]!];
    return a.map((each, i) => Math.round(each + (at - k) * (b[i]! - each))) as Colour;
  };
}

export function css([r, g, b]: Colour): string {
  return `rgb(${r} ${g} ${b})`;
}

export function schemes(model: Model): Scheme[] {
  const all = [status(model), cost(model), chosen(model), views(model)];
  if (model.importance) all.push(importance(model.importance));
  return all;
}

function status(model: Model): Scheme {
  const { sharp, blurred, unseen } = model.facts.colours;
  const colours = { [Seen.Sharp]: sharp, [Seen.Blurred]: blurred, [Seen.Unseen]: unseen };
  const told = (plan: Plan) => model.shares(plan);
  return {
    id: "status",
    label: "sharp, blurred, unseen",
    colour: (plan, p) => colours[model.seen(plan, p)],
    legend: (plans) => ({
      ...resting(model, plans),
      keys: [
        {
          colour: sharp,
          label: "sharp in the picture that images it best",
          values: plans.map((plan) => percent(told(plan).sharp)),
        },
        {
          colour: blurred,
          label: "blurred there",
          values: plans.map((plan) => percent(told(plan).blurred)),
        },
        unseenKey(model, plans),
      ],
    }),
  };
}

/** What shares and colours rest on, where that is not what one would think. */
function resting(model: Model, plans: Plan[]): Pick<Legend, "note"> {
  const { tolerance, mostMmPerPixel } = model.facts;
  const told = model.shares(plans[0]!);
  const ignored = 1 - told.sharp - told.blurred - told.unseen;
  const notes = [];
  if (tolerance) {
    notes.push(`What counts as sharp stays so if its depth is off by ${millimetres(tolerance)}.`);
  }
  if (mostMmPerPixel !== null) {
    notes.push(`What is imaged with more than ${mostMmPerPixel} mm per pixel counts as unseen.`);
  }
  if (ignored > 1e-6) {
    notes.push(`${percent(ignored)} of the surface has no importance and is in no share.`);
  }
  return notes.length ? { note: notes.join(" ") } : {};
}

function unseenKey(model: Model, plans: Plan[]): Key {
  const values = plans.map((plan) => percent(model.shares(plan).unseen));
  const label = model.facts.mostMmPerPixel === null ? "seen by no camera" : "seen by no camera finely enough";
  return { colour: model.facts.colours.unseen, striped: true, label, values };
}

function cost(model: Model): Scheme {
  const colour = ramp(MAGMA);
  return {
    id: "cost",
    label: "cost",
    colour: (plan, p) =>
      plan.camera[p] === NONE ? model.facts.colours.unseen : colour(plan.cost[p]! / COST_END),
    legend: (plans) => ({
      scale: {
        colours: MAGMA.map(parsed),
        low: "0",
        high: `${COST_END} or more`,
        name: "cost of a point",
        values: plans.map(() => ""),
      },
      keys: [unseenKey(model, plans)],
    }),
  };
}

function chosen(model: Model): Scheme {
  let colours: Colour[] | null = null;
  const colourOf = (camera: number) => (colours ??= distinct(model))[camera]!;
  const used = (plan: Plan) => new Set(plan.camera.filter((camera) => camera !== NONE)).size;
  return {
    id: "camera",
    label: "the camera that images it best",
    colour: (plan, p) => (plan.camera[p] === NONE ? model.facts.colours.unseen : colourOf(plan.camera[p]!)),
    legend: (plans) => ({
      note: "Each patch is what one camera images best. Point at it to read which.",
      keys: [
        { colour: MANY[1]!, label: "cameras that image something best", values: plans.map((p) => `${used(p)}`) },
        unseenKey(model, plans),
      ],
    }),
  };
}

/** A colour per camera, unlike those of the cameras around it. */
function distinct(model: Model): Colour[] {
  const chosen: number[] = [];
  const at = model.cameras.map((camera) => camera.position);
  for (let c = 0; c < at.length; c++) {
    const away = chosen.map((_, k) => {
      const [a, b] = [at[c]!, at[k]!];
      return { k, square: (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2 };
    });
    const taken = away.sort((a, b) => a.square - b.square).slice(0, MANY.length - 1);
    const near = new Set(taken.map(({ k }) => chosen[k]!));
    const free = MANY.map((_, k) => (k + 5 * c) % MANY.length).find((k) => !near.has(k));
    chosen.push(free ?? c % MANY.length);
  }
  return chosen.map((k) => MANY[k]!);
}

function views(model: Model): Scheme {
  const colour = (count: number) => parsed(VIRIDIS[Math.min(count, VIRIDIS.length - 1)]!);
  const most = VIRIDIS.length - 1;
  const share = (plan: Plan, count: number) =>
    model.shares(plan).views[count] ??
    model.share((p) => plan.camera[p] !== NONE && Math.min(plan.views[p]!, most) === count);
  return {
    id: "views",
    label: "number of sharp views",
    colour: (plan, p) => (plan.camera[p] === NONE ? model.facts.colours.unseen : colour(plan.views[p]!)),
    legend: (plans) => ({
      ...resting(model, plans),
      keys: [
        ...VIRIDIS.map((_, count) => ({
          colour: colour(count),
          label: count === most ? `${most} or more` : count === 0 ? "0, but seen" : `${count}`,
          values: plans.map((plan) => percent(share(plan, count))),
        })),
        unseenKey(model, plans),
      ],
    }),
  };
}

function importance(of: Float32Array): Scheme {
  const colour = ramp(CIVIDIS);
  return {
    id: "importance",
    label: "importance",
    colour: (_, p) => colour(of[p]!),
    legend: (plans) => ({
      scale: {
        colours: CIVIDIS.map(parsed),
        low: "0",
        high: "the greatest",
        name: "importance of a point",
        values: plans.map(() => ""),
      },
      keys: [],
    }),
  };
}
