// The depths that a camera sees, with the depth of field of its shots.
import { svg } from "./dom";
import type { Model, Plan } from "./model";
import { area } from "./words";

const WIDTH = 300;
const HEIGHT = 78;
const FOOT = 16;

/** A plan's histogram, on the scale of those of all plans beside it. */
export function histogram(
  model: Model,
  plan: Plan,
  camera: number,
  beside: Plan[],
): SVGElement | null {
  const { edges, areas } = model.facts.histograms[camera] ?? { edges: [], areas: [] };
  const most = Math.max(...areas, 0);
  if (edges.length < 2 || !most) return null;
  const { shots } = plan.cameras[camera]!;
  const ends = beside.flatMap((each) => each.cameras[camera]!.shots).flatMap((shot) => [shot.near, shot.far ?? 0, shot.focus]);
  // Fields of which only an end is far away do not squeeze the rest.
  const span = edges[edges.length - 1]! - edges[0]!;
  const within = ends.filter(
    (end) => end > edges[0]! - span / 2 && end < edges[edges.length - 1]! + span / 2,
  );
  const low = Math.min(edges[0]!, ...within);
  const high = Math.max(edges[edges.length - 1]!, ...within);
  const x = (depth: number) =>
    ((Math.min(Math.max(depth, low), high) - low) / (high - low || 1)) * WIDTH;
  const top = HEIGHT - FOOT;
  const parts: SVGElement[] = [];
  for (const shot of shots) {
    if (shot.near > high || (shot.far ?? Infinity) < low) continue;
    const [near, far] = [x(shot.near), x(shot.far ?? Infinity)];
    parts.push(
      svg("rect", { class: "field", x: near, y: 0, width: Math.max(far - near, 1), height: top }),
    );
  }
  areas.forEach((value, k) => {
    const left = x(edges[k]!);
    const height = (value / most) * (top - 4);
    parts.push(
      svg("rect", {
        class: "depths",
        x: left + 0.3,
        y: top - height,
        width: Math.max(x(edges[k + 1]!) - left - 0.6, 0.5),
        height,
      }),
    );
  });
  for (const shot of shots) {
    if (shot.focus < low || shot.focus > high) continue;
    parts.push(svg("path", { class: "focus", d: `M${x(shot.focus)} 0V${top}` }));
  }
  parts.push(svg("path", { class: "axis", d: `M0 ${top}H${WIDTH}` }));
  const total = areas.reduce((sum, each) => sum + each, 0);
  parts.push(svg("text", { class: "tick start", x: 0, y: HEIGHT - 2 }, `${low.toFixed(2)} m`));
  parts.push(svg("text", { class: "tick end", x: WIDTH, y: HEIGHT - 2 }, `${high.toFixed(2)} m`));
  const fields = shots.map(
    (shot) => `${shot.near.toFixed(3)} to ${shot.far === null ? "∞" : shot.far.toFixed(3)} m`,
  );
  const said =
    `${area(total)} of the surface seen from ${edges[0]!.toFixed(2)} to ` +
    `${edges[edges.length - 1]!.toFixed(2)} m; in focus from ${fields.join(" and ")}`;
  return svg(
    "svg",
    { class: "histogram", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": said },
    ...parts,
  );
}
