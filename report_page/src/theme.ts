// Light or dark: as the system is, or as the reader chooses. Colours are those of the style sheet.
import { segmented } from "./dom";
import type { Inks } from "./frusta";

export function themeSwitch(onChange: () => void): HTMLElement {
  const options: [string, string][] = [
    ["system", "System"],
    ["light", "Light"],
    ["dark", "Dark"],
  ];
  const root = document.documentElement;
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", onChange);
  return segmented("Theme", options, "system", (value) => {
    if (value === "system") delete root.dataset["theme"];
    else root.dataset["theme"] = value;
    onChange();
  });
}

/** The light ones, whatever is on the screen. */
export function inksOfPaper(): Inks {
  const { dataset } = document.documentElement;
  const theme = dataset["theme"];
  dataset["theme"] = "light";
  const inks = currentInks();
  if (theme === undefined) delete dataset["theme"];
  else dataset["theme"] = theme;
  return inks;
}

export function currentInks(): Inks {
  const style = getComputedStyle(document.documentElement);
  const of = (name: string) => style.getPropertyValue(`--${name}`).trim();
  return {
    paper: of("stage"),
    camera: of("camera"),
    idle: of("camera-idle"),
    selected: of("selected"),
    held: of("sight"),
    faint: of("sight-faint"),
  };
}
