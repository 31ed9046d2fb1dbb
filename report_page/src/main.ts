// What makes a report move: without it, all its text and tables are there.
import { Model } from "./model";
import { readPayload } from "./payload";
import { Stage } from "./stage";
import { themeSwitch } from "./theme";
import { h } from "./dom";

const byId = (id: string) => document.getElementById(id)!;

async function start(): Promise<void> {
  const stage = byId("stage");
  let drawn: Stage | null = null;
  byId("tools").append(themeSwitch(() => drawn?.restyle()));
  const model = new Model(await readPayload(byId("payload").textContent!));
  byId("payload").remove();
  try {
    drawn = new Stage(model, stage);
  } catch (error) {
    const said = error instanceof Error ? error.message : String(error);
    stage.replaceChildren(
      h("p", { class: "about", role: "alert" }, `This browser does not draw it: ${said}`),
    );
    return;
  }
  drawn.useTable(byId("cameras") as HTMLTableElement, byId("filters"));
}

void start();
