// The panel beside the view: what is told of what is selected.
import { cameraPanel } from "./camera_panel";
import { button, h } from "./dom";
import type { Model } from "./model";
import { pointPanel } from "./point_panel";
import type { Selection } from "./view";

export interface Actions {
  select(selection: Selection): void;
  close(): void;
  lookFrom(camera: number): void;
  showInTable(camera: number): void;
}

const KEYS: [string, string][] = [
  ["arrows", "turn"],
  ["shift + arrows", "move"],
  ["+ and −", "nearer, farther"],
  ["n and p", "next, previous camera"],
  ["Enter", "the point in the middle"],
  ["Esc", "select nothing"],
  ["Home", "as at first"],
  ["End", "the whole rig"],
];

export class Inspector {
  readonly element: HTMLElement;
  private readonly title = h("h3", { id: "inspector-title", tabindex: -1 });
  private readonly tools = h("div", { class: "row" });
  private readonly body = h("div", {
    class: "body",
    tabindex: 0,
    role: "group",
    "aria-labelledby": "inspector-title",
  });
  private before: Selection[] = [];
  private isGoingBack = false;

  constructor(
    private readonly model: Model,
    private readonly actions: Actions,
  ) {
    const live = h("p", { class: "hidden", role: "status" });
    this.element = h(
      "section",
      { class: "inspector", "aria-labelledby": "inspector-title" },
      this.title,
      this.tools,
      this.body,
      live,
    );
    this.say = (text) => (live.textContent = text);
    this.element.addEventListener("keydown", (event) => {
      if (event.key === "Escape" && this.element.dataset["kind"]) actions.close();
    });
  }

  private readonly say: (text: string) => void;

  /** Show what is told of a selection in the plans that are in view. */
  show(selection: Selection, plans: number[], previous: Selection): void {
    if (this.isGoingBack) this.isGoingBack = false;
    else if (previous && !same(previous, selection)) this.before.push(previous);
    if (!selection) this.before = [];
    const kind = !selection ? "" : "camera" in selection ? "camera" : "point";
    this.element.dataset["kind"] = kind;
    this.element.dataset["index"] = selection ? String(Object.values(selection)[0]) : "";
    this.body.scrollTop = 0;
    if (!selection) return this.nothing();
    if ("camera" in selection) return this.camera(selection.camera, plans);
    this.title.textContent = `Point ${selection.point}`;
    this.tools.replaceChildren(...this.back(), this.close());
    this.body.replaceChildren(
      ...pointPanel(this.model, selection, plans, (each) => this.actions.select(each)),
    );
    this.say(`Point ${selection.point}: ${this.body.querySelector(".status")?.textContent}`);
  }

  focus(): void {
    this.title.focus({ preventScroll: true });
  }

  private camera(camera: number, plans: number[]): void {
    const { name } = this.model.cameras[camera]!;
    this.title.textContent = name;
    this.tools.replaceChildren(
      ...this.back(),
      button("Look from here", () => this.actions.lookFrom(camera)),
      button("Find in table", () => this.actions.showInTable(camera)),
      this.close(),
    );
    this.body.replaceChildren(...cameraPanel(this.model, camera, plans));
    this.say(`${name}: ${this.body.querySelector(".status")?.textContent}`);
  }

  private nothing(): void {
    this.title.textContent = "Nothing selected";
    this.tools.replaceChildren();
    const keys = KEYS.map(([key, does]) => h("div", {}, h("dt", {}, key), h("dd", {}, does)));
    this.body.replaceChildren(
      h("p", {}, "Click a point of the surface: which cameras see it, which hold it in focus, why it is not sharp, and what would mend it."),
      h("p", {}, "Click a camera, here or in the table: where its lens is set, and what that holds."),
      h("h4", {}, "Keys, when the picture has the focus"),
      h("dl", { class: "facts keys" }, ...keys),
    );
  }

  private back(): Node[] {
    if (!this.before.length) return [];
    return [
      button("Back", () => {
        this.isGoingBack = true;
        this.actions.select(this.before.pop()!);
      }),
    ];
  }

  private close(): HTMLButtonElement {
    return button("Close", () => this.actions.close());
  }
}

/** Whether two selections are of one thing, in whichever plan. */
function same(a: Selection, b: Selection): boolean {
  if (!a || !b) return a === b;
  if ("camera" in a) return "camera" in b && a.camera === b.camera;
  return "point" in b && a.point === b.point;
}
