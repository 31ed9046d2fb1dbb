// Mouse, touch and keys on the picture.
import type { Model } from "./model";
import type { Selection, View } from "./view";

const CLICK = 5; // pixels that a click may move
const REACH = { mouse: 14, touch: 26 };

export function listen(
  model: Model,
  view: View,
  current: () => Selection,
  select: (selection: Selection) => void,
): void {
  const { canvas } = view;
  let down: { x: number; y: number; id: number } | null = null;

  const place = (event: PointerEvent) => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  canvas.addEventListener("pointerdown", (event) => {
    down = event.isPrimary ? { ...place(event), id: event.pointerId } : null;
  });
  canvas.addEventListener("pointerup", (event) => {
    if (!down || event.pointerId !== down.id || event.button > 0) return;
    const { x, y } = place(event);
    const moved = Math.hypot(x - down.x, y - down.y);
    down = null;
    if (moved > CLICK) return;
    const reach = event.pointerType === "touch" ? REACH.touch : REACH.mouse;
    const camera = view.cameraAt(x, y, reach);
    if (camera !== null) return select({ camera });
    const point = view.pointAt(x, y);
    select(point === null ? null : { point, plan: view.planAt(x) });
  });

  let asked = false;
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons || event.pointerType === "touch" || asked) return;
    asked = true;
    const { x, y } = place(event);
    requestAnimationFrame(() => {
      asked = false;
      view.hover(view.cameraAt(x, y, REACH.mouse));
    });
  });
  canvas.addEventListener("pointerleave", () => view.hover(null));
  canvas.addEventListener("keydown", (event) => {
    if (onKey(model, view, current, select, event)) event.preventDefault();
  });
}

const WAYS: Record<string, [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

function onKey(
  model: Model,
  view: View,
  current: () => Selection,
  select: (selection: Selection) => void,
  event: KeyboardEvent,
): boolean {
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  const way = WAYS[event.key];
  if (way) {
    if (event.shiftKey) view.pan(...way);
    else view.orbit(...way);
    return true;
  }
  const next = (step: number) => {
    const now = current();
    const count = model.cameras.length;
    const from = now && "camera" in now ? now.camera : step > 0 ? -1 : 0;
    const camera = (from + step + count) % count;
    select({ camera });
    view.reveal(camera);
  };
  const actions: Record<string, () => void> = {
    "+": () => view.zoom(1.15),
    "=": () => view.zoom(1.15),
    "-": () => view.zoom(1 / 1.15),
    Home: () => view.home(),
    End: () => view.home(true),
    n: () => next(1),
    p: () => next(-1),
    Escape: () => select(null),
    Enter: () => pickMiddle(view, select),
  };
  const action = actions[event.key];
  action?.();
  return action !== undefined;
}

/** Select the point in the middle of the first pane. */
export function pickMiddle(view: View, select: (selection: Selection) => void): void {
  const { x, y } = view.middle();
  const point = view.pointAt(x, y);
  if (point !== null) select({ point, plan: view.planAt(x) });
}
