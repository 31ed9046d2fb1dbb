// How much of the surface is drawn while it moves: as much as keeps it fluent; at rest, all.
const SLOW = 70; // milliseconds between drawings
const FAST = 40;
const LEAST = 1 / 16;
const REST = 180; // milliseconds without a move

export class Detail {
  private moving = false;
  private resting = 0;
  private last = 0;
  private found = 1;

  constructor(private readonly onRest: () => void) {}

  /** Of all, now. */
  get share(): number {
    return this.moving ? this.found : 1;
  }

  /** Something moves, and will be drawn. */
  move(): void {
    if (!this.moving) this.last = 0; // after a pause of the hand the time tells nothing
    this.moving = true;
    window.clearTimeout(this.resting);
  }

  /** A drawing begins. */
  drawing(): void {
    const now = performance.now();
    const taken = now - this.last;
    if (this.moving && this.last) {
      if (taken > SLOW) this.found = Math.max(this.found * Math.max(SLOW / taken, 0.4), LEAST);
      else if (taken < FAST) this.found = Math.min(this.found * 1.1, 1);
    }
    this.last = now;
  }

  /** The newest drawing is on the canvas. */
  finished(): void {
    window.clearTimeout(this.resting);
    if (!this.moving) return;
    this.resting = window.setTimeout(() => {
      this.moving = false;
      if (this.found < 1) this.onRest();
    }, REST);
  }
}
