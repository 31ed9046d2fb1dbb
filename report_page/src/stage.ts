// The picture with all that belongs to it: what to show, how to colour it, the legend, the panel.
import { CameraTable } from "./camera_table";
import { schemes, type Scheme } from "./colours";
import { button, choice, h, segmented } from "./dom";
import { Inspector } from "./inspector";
import { Labels } from "./labels";
import { legendNodes } from "./legend";
import type { Model } from "./model";
import { listen } from "./pointing";
import { currentInks, inksOfPaper } from "./theme";
import { View, type Layout, type Selection } from "./view";
import { percent } from "./words";

const NONE = "none";

export class Stage {
  private readonly view: View;
  private readonly labels: Labels;
  private readonly inspector: Inspector;
  private readonly holder = h("div", { class: "canvas" });
  private readonly captions = h("div", { class: "captions", "aria-hidden": "true" });
  private readonly divider = this.madeDivider();
  private readonly legend = h("div", { class: "legend-box" });
  private readonly schemes: Scheme[];
  private scheme: Scheme;
  private selection: Selection = null;
  private first = 0;
  private second: number | null = null;
  private slider = false;
  private ways: HTMLFieldSetElement | null = null;
  private readonly paper = h("canvas", { class: "paper", "aria-hidden": "true" });
  private folded: HTMLDetailsElement[] = [];

  constructor(
    private readonly model: Model,
    private readonly element: HTMLElement,
    private readonly table: CameraTable,
  ) {
    this.schemes = schemes(model);
    this.scheme = this.schemes[0]!;
    this.second = model.plans.length > 1 && window.innerWidth >= 700 ? 1 : null;
    this.inspector = new Inspector(model, {
      select: (selection) => this.select(selection),
      close: () => {
        this.select(null);
        this.view.canvas.focus({ preventScroll: true });
      },
      lookFrom: (camera) => this.view.lookFrom(camera),
      showInTable: (camera) => this.table.show(camera),
    });
    const picture = h("div", { class: "picture-box" }, this.holder, this.legend);
    element.replaceChildren(this.toolbar(), h("div", { class: "stage" }, picture, this.inspector.element));
    this.view = new View(model, this.holder);
    this.holder.append(this.captions, this.divider, this.paper);
    this.labels = new Labels(model, this.view, this.holder);
    const { canvas } = this.view;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-roledescription", "3D picture");
    canvas.setAttribute("aria-label", "The surface and the cameras: arrows turn, n and p choose a camera, Enter the point in the middle");
    listen(model, this.view, () => this.selection, (selection) => this.select(selection));
    this.view.onDrawn = () => this.drawn();
    this.view.onWhole = (isWhole) => element.toggleAttribute("data-drawn", isWhole);
    window.addEventListener("beforeprint", () => this.print());
    window.addEventListener("afterprint", () => this.printed());
    this.inspector.show(null, this.plans, null);
    this.view.paint(this.scheme);
    this.arrange();
    this.restyle();
    table.link((camera) => {
      this.select({ camera });
      this.view.reveal(camera);
      this.element.scrollIntoView({ block: "start" });
      this.inspector.focus();
    });
  }

  restyle(): void {
    this.view.ink(currentInks());
  }

  private select(selection: Selection): void {
    const previous = this.selection;
    this.selection = selection;
    this.inspector.show(selection, this.plans, previous);
    this.table.mark(selection && "camera" in selection ? selection.camera : null);
    this.view.select(selection);
  }

  private get plans(): number[] {
    return this.second === null ? [this.first] : [this.first, this.second];
  }

  // --- what to show ----------------------------------------------------------------------------

  private toolbar(): HTMLElement {
    const plans = this.model.plans.map((plan, k): [string, string] => [String(k), plan.title]);
    const colours = this.schemes.map((each): [string, string] => [each.id, each.label]);
    const bar = h("div", { class: "toolbar" });
    bar.append(
      choice("Colour by", colours, this.scheme.id, (id) => {
        this.scheme = this.schemes.find((each) => each.id === id)!;
        this.view.paint(this.scheme);
        this.arrange();
      }),
    );
    if (plans.length > 1) {
      const ways = segmented(
        "as",
        [
          ["side", "Side by side"],
          ["slider", "Slider"],
        ],
        "side",
        (value) => {
          this.slider = value === "slider";
          this.arrange();
        },
      );
      this.ways = ways;
      bar.append(
        choice("Show", plans, "0", (value) => {
          this.first = Number(value);
          this.arrange();
        }),
        choice("beside", [[NONE, "nothing"], ...plans], this.second === null ? NONE : "1", (value) => {
          this.second = value === NONE ? null : Number(value);
          this.arrange();
        }),
        ways,
      );
    }
    const shown = h("input", { type: "checkbox", checked: true });
    shown.addEventListener("change", () => {
      this.view.showCameras = shown.checked;
      this.view.draw();
    });
    bar.append(
      h("label", { class: "check" }, shown, h("span", {}, "Cameras")),
      button("Reset view", () => this.view.home()),
      button("Show rig", () => this.view.home(true)),
    );
    return bar;
  }

  private arrange(): void {
    const layout: Layout = {
      plans: this.second === null ? [this.first] : [this.first, this.second],
      slider: this.slider,
      at: this.view.layout.at,
    };
    this.view.arrange(layout);
    if (this.ways) this.ways.disabled = this.second === null;
    this.divider.hidden = this.second === null || !this.slider;
    const plans = this.plans.map((k) => this.model.plans[k]!);
    const [left, right] = plans.map((plan) => plan.title);
    const said = right === undefined ? `The plan ${left}` : `Left: ${left}. Right: ${right}.`;
    this.legend.replaceChildren(
      h("p", { class: "print-only" }, `${said}. Coloured by ${this.scheme.label}.`.replace("..", ".")),
      ...legendNodes(
        this.scheme.legend(plans),
        plans.map((plan) => plan.title),
      ),
    );
    this.inspector.show(this.selection, this.plans, this.selection);
  }

  // --- over the picture ------------------------------------------------------------------------

  private drawn(): void {
    const selected = this.selection && "camera" in this.selection ? this.selection.camera : null;
    this.labels.place(selected);
    this.captions.replaceChildren(
      this.aim(),
      ...this.view.panes().map((pane, k) => {
        const plan = this.model.plans[pane.plan]!;
        const caption = h(
          "span",
          { class: k ? "caption right" : "caption" },
          h("b", {}, plan.title),
          ` ${percent(this.model.shares(plan).sharp)} in focus`,
        );
        if (this.slider && k) caption.style.right = "12px";
        else caption.style.left = `${pane.from + 12}px`;
        caption.classList.toggle("beside", k > 0 && !this.slider);
        return caption;
      }),
    );
    this.divider.style.left = `${100 * this.view.layout.at}%`;
  }

  /** What Enter selects, while the picture has the focus. */
  private aim(): HTMLElement {
    const mark = h("span", { class: "aim" });
    mark.style.left = `${this.view.middle().x}px`;
    return mark;
  }

  private madeDivider(): HTMLElement {
    const divider = h("div", {
      class: "divider",
      role: "slider",
      tabindex: 0,
      "aria-label": "Line between the plans",
      "aria-valuemin": 0,
      "aria-valuemax": 100,
      "aria-valuenow": 50,
    });
    const move = (at: number) => {
      this.view.layout.at = Math.min(Math.max(at, 0), 1);
      divider.setAttribute("aria-valuenow", String(Math.round(100 * this.view.layout.at)));
      this.view.draw();
    };
    divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
    divider.addEventListener("pointermove", (event) => {
      if (!divider.hasPointerCapture(event.pointerId)) return;
      const box = this.holder.getBoundingClientRect();
      move((event.clientX - box.left) / box.width);
    });
    divider.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.02, ArrowDown: -0.02, ArrowRight: 0.02, ArrowUp: 0.02, Home: -1, End: 1 }[event.key];
      if (step === undefined) return;
      move(this.view.layout.at + step);
      event.preventDefault();
    });
    return divider;
  }

  /** Draw as it goes onto paper, with what tells how it was made. */
  private print(): void {
    this.folded = [...document.querySelectorAll<HTMLDetailsElement>("#origin details:not([open])")];
    for (const each of this.folded) each.open = true;
    this.view.ink(inksOfPaper());
    this.view.drawNow();
    // A browser prints what it last showed of WebGL, but what is now in a plain canvas.
    const { canvas } = this.view;
    [this.paper.width, this.paper.height] = [canvas.width, canvas.height];
    this.paper.getContext("2d")!.drawImage(canvas, 0, 0);
  }

  private printed(): void {
    this.paper.width = this.paper.height = 0;
    for (const each of this.folded) each.open = false;
    this.restyle();
  }
}
