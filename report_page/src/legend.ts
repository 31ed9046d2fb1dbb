// What the colours mean, and how much of the surface has each.
import { css, type Key, type Legend } from "./colours";
import { h, svg } from "./dom";

export function legendNodes(legend: Legend, titles: string[]): Node[] {
  const several = titles.length > 1;
  const head = several
    ? [h("thead", {}, h("tr", {}, h("td"), ...titles.map((each) => h("th", { scope: "col" }, each))))]
    : [];
  const rows = legend.keys.map((key) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, swatch(key), key.label),
      ...key.values.map((value) => h("td", { class: "number" }, value)),
    ),
  );
  if (legend.scale) {
    const { colours, low, high, name, values } = legend.scale;
    rows.unshift(
      h(
        "tr",
        {},
        h("th", { scope: "row" }, name, scale(colours, low, high)),
        ...values.map((value) => h("td", { class: "number" }, value)),
      ),
    );
  }
  const table = h(
    "table",
    { class: "legend" },
    h("caption", { class: "hidden" }, "What the colours mean"),
    ...head,
    h("tbody", {}, ...rows),
  );
  return legend.note ? [table, h("p", { class: "about" }, legend.note)] : [table];
}

function swatch(key: Key): SVGElement {
  const parts = [svg("rect", { width: 16, height: 16, rx: 3, fill: css(key.colour) })];
  if (key.striped) {
    const lines = "M-2 10L10 -2M-2 18L18 -2M6 18L18 6";
    parts.push(svg("path", { d: lines, stroke: "#5f666c", "stroke-width": 2.2 }));
  }
  return svg("svg", { class: "swatch", viewBox: "0 0 16 16", "aria-hidden": "true" }, ...parts);
}

function scale(colours: [number, number, number][], low: string, high: string): HTMLElement {
  const width = 8;
  const bars = colours.map((colour, k) =>
    svg("rect", { x: k * width, width: width + 0.1, height: 10, fill: css(colour) }),
  );
  return h(
    "span",
    { class: "scale" },
    h("span", {}, low),
    svg(
      "svg",
      {
        viewBox: `0 0 ${colours.length * width} 10`,
        preserveAspectRatio: "none",
        "aria-hidden": "true",
      },
      ...bars,
    ),
    h("span", {}, high),
  );
}
