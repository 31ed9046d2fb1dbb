// What is told of a point of the surface.
import { button, h, segmented, table } from "./dom";
import { NONE, Seen, type Model, type Plan } from "./model";
import { explain, remarksOn, verdictOf, type Blind, type Blindness, type View } from "./reasons";
import type { Selection } from "./view";
import { counted, fixed, signed } from "./words";

const WORDS: Record<Seen, string> = {
  [Seen.Sharp]: "sharp",
  [Seen.Blurred]: "blurred",
  [Seen.Unseen]: "unseen",
};
const BLIND: Record<Blindness, string> = {
  "no picture": "it takes no picture, as pictures are limited",
  behind: "it is behind the camera, or too close to it",
  outside: "it is outside the picture",
  "faces away": "it faces away",
  "too coarse": "imaged more coarsely than counts, if it is not hidden",
  hidden: "the surface hides it",
};
const MOST_NAMES = 24;

export function pointPanel(
  model: Model,
  { point: p, plan }: { point: number; plan: number },
  plans: number[],
  select: (selection: Selection) => void,
): Node[] {
  // Of plans for cameras that see something else, the report does not have what they see.
  const explicable = plans.filter((k) => model.plans[k]!.seesTheSame);
  const explained = model.plans[explicable.includes(plan) ? plan : (explicable[0] ?? 0)]!;
  const told = explain(model, explained, p);
  const onCamera = (camera: number) => select({ camera });
  const shown = plans.map((k) => model.plans[k]!);
  const line = inOneLine(model, explained, p);
  const nodes: Node[] = [
    h("p", { class: "status" }, shown.includes(explained) ? line : `${explained.title}: ${line}`),
    summary(model, shown, p),
    h("p", { class: "about" }, whereItIs(model, p)),
  ];
  if (new Set(explicable).size > 1) {
    const options = explicable.map((k): [string, string] => [String(k), model.plans[k]!.title]);
    nodes.push(
      segmented("Explained in", options, String(model.plans.indexOf(explained)), (value) =>
        select({ point: p, plan: Number(value) }),
      ),
    );
  }
  if (told.why.length) {
    nodes.push(h("h4", {}, told.state === Seen.Sharp ? "Why it costs what it does" : "Why"));
    nodes.push(h("ul", { class: "why" }, ...told.why.map((each) => h("li", {}, each))));
  }
  if (told.mends.length) {
    nodes.push(h("h4", {}, "What would mend it"));
    nodes.push(h("ul", { class: "mends" }, ...told.mends.map((each) => h("li", {}, each))));
  }
  if (told.views.length) {
    nodes.push(h("h4", {}, `${counted(told.views.length, "camera sees", "cameras see")} it`));
    nodes.push(
      h(
        "div",
        { class: "scroll short", tabindex: 0, role: "region", "aria-label": "Cameras that see it" },
        seeing(model, told.views, onCamera),
      ),
    );
  }
  if (told.blind.length) nodes.push(...notSeeing(told.blind, onCamera));
  return nodes;
}

function inOneLine(model: Model, plan: Plan, p: number): string {
  const camera = plan.camera[p]!;
  if (camera === NONE) return "Seen by no camera";
  const { name } = model.cameras[camera]!;
  return plan.sharp[p] ? `Sharp in ${name}` : `Blurred in ${name}, which images it best`;
}

function summary(model: Model, plans: Plan[], p: number): HTMLElement {
  const number = (text: string) => ({ text, number: true });
  return table(
    "The point in the plans that are shown",
    ["", "", "imaged best by", number(costOf(model)), number("sharp views")],
    plans.map((plan) => {
      const camera = plan.camera[p]!;
      const state = model.seen(plan, p);
      return [
        plan.title,
        h("span", { class: state === Seen.Sharp ? "is sharp" : "is blurred" }, WORDS[state]),
        camera === NONE ? "–" : model.cameras[camera]!.name,
        plan.cost[p]!.toFixed(3),
        `${plan.views[p]}`,
      ];
    }),
  );
}

function costOf(model: Model): string {
  return model.facts.views > 1 ? `cost, mean of ${model.facts.views} views` : "cost";
}

function whereItIs(model: Model, p: number): string {
  const place = model.point(p).map((each) => signed(each.toFixed(3)));
  const at = `At (${place.join(", ")}) m in ${model.facts.frame}`;
  if (!model.importance) return at;
  return `${at}, with ${model.importance[p]!.toFixed(2)} of the greatest importance`;
}

function seeing(model: Model, views: View[], onCamera: (camera: number) => void) {
  const { decimals } = model.facts;
  return table(
    "Cameras that see the point, the best first",
    ["camera", { text: "depth / m", number: true }, "in focus / m", "there it is", { text: "cost", number: true }],
    views.map((view) => [
      button(view.camera.name, () => onCamera(view.camera.index), { class: "link" }),
      fixed(view.depth, decimals),
      h(
        "span",
        { class: "range" },
        `${fixed(view.near, decimals)}–${view.far === null ? "∞" : fixed(view.far, decimals)}`,
      ),
      h(
        "span",
        { class: view.held ? "is sharp" : "is blurred" },
        [verdictOf(model, view), ...remarksOn(model, view)].join("; "),
      ),
      view.cost.toFixed(3),
    ]),
  );
}

function notSeeing(blind: Blind[], onCamera: (camera: number) => void): Node[] {
  const kinds = Object.keys(BLIND) as Blindness[];
  const lines = kinds
    .map((kind) => ({ kind, all: blind.filter((each) => each.why === kind) }))
    .filter(({ all }) => all.length)
    .map(({ kind, all }) => {
      const names = all.slice(0, MOST_NAMES).map(({ camera }) => {
        return h("li", {}, button(camera.name, () => onCamera(camera.index), { class: "link" }));
      });
      const more = all.length - names.length;
      return h(
        "details",
        {},
        h("summary", {}, `${BLIND[kind]}: ${all.length}`),
        h("ul", { class: "names" }, ...names, more > 0 ? h("li", {}, `and ${more} more`) : null),
      );
    });
  return [h("h4", {}, `${counted(blind.length, "camera does", "cameras do")} not see it`), ...lines];
}
