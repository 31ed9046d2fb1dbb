// What is told of a camera.
import { h, table } from "./dom";
import { histogram } from "./histogram";
import type { Model, Plan } from "./model";
import type { Shot } from "./payload";
import { area, metres, millimetres, percent } from "./words";

const STATUS = [
  "Unknown",
  "Planned",
  "Others image all samples that were planned on better: leave it as it is",
  "Sees none of the samples that were planned on: leave it as it is",
  "Takes no picture, as pictures are limited: leave it as it is",
];

/** What the panel says of a camera, its plans side by side. */
export function cameraPanel(model: Model, camera: number, plans: number[]): Node[] {
  const shown = plans.map((k) => model.plans[k]!);
  const nodes: Node[] = [];
  const statuses = shown.map((plan) => STATUS[plan.cameras[camera]!.status] ?? STATUS[0]!);
  const differ = new Set(statuses).size > 1;
  shown.forEach((plan, k) => {
    const text = differ ? `${plan.title}: ${statuses[k]}` : statuses[k]!;
    if (differ || k === 0) nodes.push(h("p", { class: "status" }, text));
  });
  const columns = shown.flatMap((plan) =>
    plan.cameras[camera]!.shots.map((shot, k, all) => ({
      plan,
      shot,
      title: all.length > 1 ? `${plan.title}, shot ${k + 1}` : plan.title,
    })),
  );
  const { decimals } = model.facts;
  const rows: [string, (shot: Shot, plan: Plan) => string][] = [
    ["focus, from the centre of projection", (shot) => metres(shot.focus, decimals)],
    ["from the sensor", (shot) => (shot.fromSensor === null ? "–" : metres(shot.fromSensor, decimals))],
    ["dioptres", (shot) => (1 / shot.focus).toFixed(3)],
    ["near limit", (shot) => metres(shot.near, decimals)],
    ["far limit", (shot) => metres(shot.far, decimals)],
    ["depth of field", (shot) => (shot.far === null ? "∞" : millimetres(shot.far - shot.near))],
    ["samples assigned to it", (shot, plan) => `${shot.assigned} of ${plan.samples}`],
    ["of them in focus", (shot) => `${shot.inFocus}`],
  ];
  if (columns.some(({ shot }) => shot.device !== null)) {
    rows.splice(2, 0, ["device value", (shot, plan) => device(shot, plan, camera)]);
  }
  const settings = table(
      "Where the lens is set, and what that holds",
      ["", ...columns.map(({ title }) => ({ text: title, number: true }))],
      rows.map(([name, of]) => [name, ...columns.map(({ shot, plan }) => of(shot, plan))]),
  );
  if (!columns.length) return nodes;
  const region = { class: "scroll", tabindex: 0, role: "region", "aria-label": "Where the lens is set" };
  nodes.push(h("div", region, settings));
  const taken = shown.filter((plan) => plan.seesTheSame && plan.cameras[camera]!.shots.length);
  nodes.push(...heldNodes(model, camera, taken));
  for (const k of plans) nodes.push(...pictureNodes(model, camera, k, plans.length > 1));
  return nodes;
}

function device(shot: Shot, plan: Plan, camera: number): string {
  if (shot.device === null) return "–";
  const unit = plan.cameras[camera]!.unit ?? "";
  return `${Number(shot.device.toPrecision(6))} ${unit}`.trim();
}

function heldNodes(model: Model, camera: number, plans: Plan[]): Node[] {
  const pairs = model.pairsOf(camera);
  if (!pairs.length || !plans.length) return [];
  let seen = 0;
  for (const q of pairs) seen += model.areas[model.pairSample[q]!]!;
  const nodes: Node[] = [
    h("h4", {}, "Depths seen"),
    h(
      "p",
      { class: "about" },
      `It sees ${area(seen)}. The band is what is in focus, the line the focus. In the picture what ` +
        "it holds has its full colour; what it sees out of focus is pale, the rest grey.",
    ),
  ];
  for (const plan of plans) {
    const held = plan.held[camera] ?? 0;
    const says = `${plan.title}: holds ${area(held)}, ${percent(held / seen)} of what it sees`;
    const drawing = histogram(model, plan, camera, plans);
    if (drawing) nodes.push(h("figure", {}, drawing, h("figcaption", {}, says)));
  }
  return nodes;
}

function pictureNodes(model: Model, camera: number, plan: number, named: boolean): Node[] {
  const address = model.picture(plan, camera);
  if (!address) return [];
  const { name } = model.cameras[camera]!;
  const { title, cameras } = model.plans[plan]!;
  const { main, shots } = cameras[camera]!;
  if (!shots.length) return [];
  const shot = shots.length > 1 ? `, shot ${main + 1} of ${shots.length}` : "";
  const image = h("img", {
    src: address,
    alt: `What ${name} will see with the plan ${title}${shot}`,
    class: "picture",
  });
  image.addEventListener("load", () => URL.revokeObjectURL(address), { once: true });
  const caption = h(
    "figcaption",
    {},
    `Its picture${named ? `, ${title}` : ""}${shot}, made small, which hides most of the blur. In full: `,
    h("code", {}, `focus_planner preview RUN --camera ${quoted(name)}`),
  );
  return [h("figure", {}, image, caption)];
}

/** As a shell takes it for one word. */
function quoted(name: string): string {
  return /^[\w.-]+$/.test(name) ? name : `'${name.replaceAll("'", "'\\''")}'`;
}
