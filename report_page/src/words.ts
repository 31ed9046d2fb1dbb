// How numbers are written: no line ends between one and its unit.

export function metres(value: number | null, decimals = 3): string {
  return value === null ? "∞" : `${fixed(value, decimals)}\u00a0m`;
}

/** A number with so many decimals; half-way to the even one, as in the tables of the page. */
export function fixed(value: number, decimals: number): string {
  const away = value.toFixed(decimals);
  const isHalfWay = /^50*$/.test(value.toFixed(decimals + 60).slice(-60));
  const isOdd = Number(away.slice(-1)) % 2 === 1;
  return isHalfWay && isOdd ? (Number(away) - 10 ** -decimals).toFixed(decimals) : away;
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
  if (value > 0 && value < 0.05) return "<\u00a00.1\u00a0%";
  return value < 100 && value >= 99.95 ? ">\u00a099.9\u00a0%" : `${value.toFixed(1)}\u00a0%`;
}

export function counted(count: number, what: string, plural = `${what}s`): string {
  return `${count} ${count === 1 ? what : plural}`;
}

/** "the one camera", "both cameras", "all 3 cameras". */
export function all(count: number, what: string): string {
  if (count === 1) return `the one ${what}`;
  return count === 2 ? `both ${what}s` : `all ${count} ${what}s`;
}

export function listed(items: string[]): string {
  if (items.length < 2) return items.join("");
  return `${items.slice(0, -1).join(", ")} and ${items[items.length - 1]}`;
}

/** A number with a minus sign in place of a hyphen. */
export function signed(number: string): string {
  return number.replace("-", "−");
}
