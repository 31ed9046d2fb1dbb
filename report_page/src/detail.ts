// How much of the surface is drawn while it moves: as much as keeps it fluent; at rest, all.
const SLOW = 70; // milliseconds between drawings
const FAST = 40;
const LEAST = 1 / 16;
const REST = 180; // milliseconds without a move

export class Detail {
  private moving = 0;
  private last = 0;
  private found = 1;

  constructor(private readonly onRest: () => void) {}

  /** Of all, now. */
  get share(): number {
    return this.moving ? this.found : 1;
  }

  /** Something moves. */
  move(): void {
    if (!this.moving) this.last = 0;
    window.clearTimeout(this.moving);
    this.moving = window.setTimeout(() => {
      this.moving = 0;
      if (this.found < 1) this.onRest();
    }, REST);
  }

  /** A drawing begins. */
  drawing(): void {
    const now = performance.now();
    const taken = now - this.last;
    // Of two in a row: after a pause of the hand the time tells nothing.
    if (this.moving && this.last && taken < 2000) {
      if (taken > SLOW) this.found = Math.max(this.found * Math.max(SLOW / taken, 0.4), LEAST);
      else if (taken < FAST) this.found = Math.min(this.found * 1.1, 1);
    }
    this.last = now;
  }
}
