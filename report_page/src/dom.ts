// Elements from names, attributes and children; text is text and never markup.

type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | null | undefined>;

export function h<K extends keyof HTMLElementTagNameMap>(
  name: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(name);
  set(element, attributes);
  element.append(...children.filter(isShown));
  return element;
}

export function svg(name: string, attributes: Attributes = {}, ...children: Child[]): SVGElement {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  set(element, attributes);
  element.append(...children.filter(isShown));
  return element;
}

function set(element: Element, attributes: Attributes): void {
  for (const [key, value] of Object.entries(attributes)) {
    if (value === true) element.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) {
      element.setAttribute(key, String(value));
    }
  }
}

function isShown(child: Child): child is Node | string {
  return child !== null && child !== undefined && child !== false;
}

/** A button that does something; its text is its name. */
export function button(text: string, action: () => void, attributes: Attributes = {}) {
  const element = h("button", { type: "button", ...attributes }, text);
  element.addEventListener("click", action);
  return element;
}

/** A labelled choice of one of several. */
export function choice(
  label: string,
  options: [string, string][],
  chosen: string,
  action: (value: string) => void,
): HTMLElement {
  const id = `choice-${label.replace(/\W+/g, "-")}`;
  const select = h("select", { id }, ...options.map(([value, text]) => h("option", { value }, text)));
  select.value = chosen;
  select.addEventListener("change", () => action(select.value));
  return h("div", { class: "field" }, h("label", { for: id }, label), select);
}

/** One of a few choices, all in view. */
export function segmented(
  label: string,
  options: [string, string][],
  chosen: string,
  action: (value: string) => void,
): HTMLFieldSetElement {
  const name = `choice-${label.replace(/\W+/g, "-")}`;
  const entries = options.map(([value, text]) => {
    const input = h("input", { type: "radio", name, value, checked: value === chosen });
    input.addEventListener("change", () => action(value));
    return h("label", {}, input, h("span", {}, text));
  });
  return h("fieldset", { class: "segmented" }, h("legend", {}, label), ...entries);
}

export function table(
  caption: string,
  headings: (string | { text: string; number: boolean })[],
  rows: Child[][],
  firstIsHeading = true,
): HTMLTableElement {
  const isNumber = (k: number) => typeof headings[k] === "object" && headings[k].number;
  const head = headings.map((each, k) => {
    const text = typeof each === "string" ? each : each.text;
    if (!text) return h("td");
    return h("th", { scope: "col", class: isNumber(k) ? "number" : null }, text);
  });
  const body = rows.map((cells) =>
    h(
      "tr",
      {},
      ...cells.map((cell, k) =>
        k === 0 && firstIsHeading
          ? h("th", { scope: "row" }, cell)
          : h("td", { class: isNumber(k) ? "number" : null }, cell),
      ),
    ),
  );
  return h(
    "table",
    {},
    h("caption", { class: "hidden" }, caption),
    h("thead", {}, h("tr", {}, ...head)),
    h("tbody", {}, ...body),
  );
}
