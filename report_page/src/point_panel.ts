// What is told of a point of the surface.
import { button, h, table } from "./dom";
import { NONE, Seen, type Model, type Plan } from "./model";
import { explain, remarksOn, verdictOf, type Blind, type Blindness, type View } from "./reasons";
import { counted, metres } from "./words";

const WORDS: Record<Seen, string> = {
  [Seen.Sharp]: "sharp",
  [Seen.Blurred]: "blurred",
  [Seen.Unseen]: "seen by no camera",
};
const BLIND: Record<Blindness, string> = {
  behind: "it is behind the camera",
  outside: "it is outside the picture",
  "faces away": "it faces away",
  hidden: "the surface hides it",
};
const MOST_NAMES = 24;

export function pointPanel(
  model: Model,
  p: number,
  plans: number[],
  onCamera: (camera: number) => void,
): Node[] {
  const [first, second] = plans.map((k) => model.plans[k]!);
  const told = explain(model, first!, p);
  const nodes: Node[] = [h("p", { class: "status" }, inOneLine(model, first!, p, plans.length > 1))];
  if (second) nodes.push(h("p", { class: "status" }, inOneLine(model, second, p, true)));
  nodes.push(facts(model, first!, p));
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

function inOneLine(model: Model, plan: Plan, p: number, named: boolean): string {
  const prefix = named ? `${plan.title}: ` : "";
  const camera = plan.camera[p]!;
  if (camera === NONE) return `${prefix}seen by no camera, cost 1`;
  return (
    `${prefix}${WORDS[model.seen(plan, p)]} in ${model.cameras[camera]!.name}, which images it best; ` +
    `cost ${plan.cost[p]!.toFixed(3)}, ${counted(plan.views[p]!, "sharp view")}`
  );
}

function facts(model: Model, plan: Plan, p: number): HTMLElement {
  const place = model
    .point(p)
    .map((each) => each.toFixed(3))
    .join(", ");
  const camera = plan.camera[p]!;
  const entries: [string, string][] = [
    ["position", `(${place}) m`],
    ["cost", plan.cost[p]!.toFixed(3)],
    ["imaged best by", camera === NONE ? "none" : model.cameras[camera]!.name],
    ["sharp views", `${plan.views[p]}`],
  ];
  if (model.importance) entries.push(["importance", model.importance[p]!.toFixed(2)]);
  return h(
    "dl",
    { class: "facts" },
    ...entries.map(([name, text]) => h("div", {}, h("dt", {}, name), h("dd", {}, text))),
  );
}

function seeing(model: Model, views: View[], onCamera: (camera: number) => void) {
  return table(
    "Cameras that see the point, the best first",
    ["camera", { text: "depth", number: true }, "in focus", "there it is", { text: "cost", number: true }],
    views.map((view) => [
      button(view.camera.name, () => onCamera(view.camera.index), { class: "link" }),
      metres(view.depth),
      `${view.near.toFixed(3)}–${view.far === null ? "∞" : view.far.toFixed(3)}`,
      h(
        "span",
        { class: view.held ? "is sharp" : "is blurred" },
        [verdictOf(view), ...remarksOn(model, view)].join("; "),
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
