// The names of cameras beside them: of those pointed at, and of all when there is room.
import { h } from "./dom";
import type { Model } from "./model";
import type { View } from "./view";

const MOST = 40;
const LETTER = 6.5; // pixels, about
const ASIDE = 8; // of the camera
const HEIGHT = 16;
const TOP = 48; // under the captions

export class Labels {
  private readonly pool: HTMLElement[] = [];

  constructor(
    private readonly model: Model,
    private readonly view: View,
    private readonly holder: HTMLElement,
  ) {}

  place(selected: number | null): void {
    let used = 0;
    if (this.view.showCameras) {
      for (const pane of this.view.panes()) {
        const height = this.holder.clientHeight;
        const all = this.model.cameras
          .map((camera) => ({
            camera: camera.index,
            at: this.view.locate(this.view.middleOf(camera.index), pane),
          }))
          .filter(({ at }) => at && at.x > pane.from && at.x < pane.to && at.y > TOP && at.y < height - HEIGHT / 2);
        const wanted = (camera: number) => camera === selected || camera === this.view.hovered;
        const few = all.length <= MOST;
        const shown = all.filter(({ camera }) => few || wanted(camera));
        shown.sort(
          (a, b) => Number(wanted(b.camera)) - Number(wanted(a.camera)) || a.at!.depth - b.at!.depth,
        );
        const taken: { left: number; right: number; y: number }[] = [];
        for (const { camera, at } of shown) {
          const width = 12 + LETTER * this.model.cameras[camera]!.name.length;
          const y = at!.y;
          // To the right of its camera; to the left, where the pane ends.
          const fits = at!.x + ASIDE + width < pane.to;
          const x = fits ? at!.x + ASIDE : Math.max(at!.x - ASIDE - width, pane.from);
          const crowded = taken.some(
            (each) => x < each.right && x + width > each.left && Math.abs(each.y - y) < HEIGHT,
          );
          if (crowded && !wanted(camera)) continue;
          taken.push({ left: x, right: x + width, y });
          this.set(used++, camera, x, y, camera === selected, camera === this.view.hovered);
        }
      }
    }
    for (let k = used; k < this.pool.length; k++) this.pool[k]!.hidden = true;
  }

  private set(
    k: number,
    camera: number,
    x: number,
    y: number,
    selected: boolean,
    hovered: boolean,
  ): void {
    const label = (this.pool[k] ??= this.made());
    label.hidden = false;
    label.textContent = this.model.cameras[camera]!.name;
    label.dataset["camera"] = String(camera);
    label.classList.toggle("selected", selected);
    label.classList.toggle("hovered", hovered);
    label.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px)`;
  }

  private made(): HTMLElement {
    const label = h("span", { class: "camera-label", "aria-hidden": "true" });
    this.holder.append(label);
    return label;
  }
}
