// What makes a report move: without it, all its text and tables are there.
import { CameraTable } from "./camera_table";
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
  const table = new CameraTable(byId("cameras") as HTMLTableElement, byId("filters"));
  const model = new Model(await readPayload(byId("payload").textContent!));
  byId("payload").remove();
  try {
    drawn = new Stage(model, stage, table);
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    stage.replaceChildren(
      h("p", { class: "about", role: "alert" }, `This browser does not draw the surface: ${why}. All else is below.`),
    );
  }
}

void start();
