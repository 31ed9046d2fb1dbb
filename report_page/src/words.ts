// How numbers are written: no line ends between one and its unit.

export function metres(value: number | null): string {
  return value === null ? "∞" : `${value.toFixed(3)}\u00a0m`;
}

export function millimetres(value: number): string {
  const mm = Math.abs(1000 * value);
  return mm < 10 ? `${mm.toFixed(1)}\u00a0mm` : `${Math.round(mm)}\u00a0mm`;
}

export function area(value: number): string {
  const cm2 = 1e4 * value;
  if (cm2 >= 1e4) return `${value.toFixed(2)}\u00a0m²`;
  return cm2 >= 10 || cm2 === 0 ? `${Math.round(cm2)}\u00a0cm²` : `${cm2.toFixed(1)}\u00a0cm²`;
}

export function percent(share: number): string {
  const value = 100 * share;
  return value > 0 && value < 0.1 ? "<\u00a00.1\u00a0%" : `${value.toFixed(1)}\u00a0%`;
}

export function counted(count: number, what: string, plural = `${what}s`): string {
  return `${count} ${count === 1 ? what : plural}`;
}

export function listed(items: string[]): string {
  if (items.length < 2) return items.join("");
  return `${items.slice(0, -1).join(", ")} and ${items[items.length - 1]}`;
}

/** A number with a minus sign in place of a hyphen. */
export function signed(number: string): string {
  return number.replace("-", "−");
}
