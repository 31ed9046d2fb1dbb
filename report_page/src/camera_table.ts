// The table of cameras: sorted, filtered, and a way to each camera.
import { button, choice, h } from "./dom";
import { counted } from "./words";

export class CameraTable {
  private readonly table: HTMLTableElement;
  private readonly rows: HTMLTableRowElement[];
  private readonly count: HTMLElement;
  private text = "";
  private status = "";

  constructor(
    table: HTMLTableElement,
    filters: HTMLElement,
  ) {
    this.table = table;
    this.rows = [...table.tBodies[0]!.rows];
    this.count = h("p", { class: "count", role: "status" });
    for (const row of this.rows) nameBoxes(row);
    for (const heading of table.tHead!.rows[0]!.cells) {
      if (heading.dataset["sort"]) this.sortable(heading);
    }
    filters.append(this.textFilter(), this.statusFilter(), this.count);
    this.filter();
  }

  mark(camera: number | null): void {
    for (const row of this.rows) {
      row.classList.toggle("selected", Number(row.dataset["camera"]) === camera);
    }
  }

  show(camera: number): void {
    const row = this.rows.find((each) => Number(each.dataset["camera"]) === camera);
    if (!row) return;
    row.hidden = false;
    row.scrollIntoView({ block: "center" });
    row.querySelector("button")?.focus();
  }

  /** Make names of cameras lead to them. */
  link(onCamera: (camera: number) => void): void {
    for (const row of this.rows) {
      const cell = row.querySelector<HTMLElement>("th.name")!;
      const open = () => onCamera(Number(row.dataset["camera"]));
      cell.replaceChildren(button(cell.textContent!, open, { class: "link" }));
    }
  }

  private sortable(heading: HTMLTableCellElement): void {
    const sort = h("button", { type: "button", class: "sort" });
    sort.append(...heading.childNodes);
    heading.append(sort);
    sort.addEventListener("click", () => {
      const descending = heading.getAttribute("aria-sort") === "ascending";
      for (const each of this.table.tHead!.rows[0]!.cells) each.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
      this.sort(heading.cellIndex, heading.dataset["sort"] === "number", descending);
    });
  }

  private sort(column: number, numbers: boolean, descending: boolean): void {
    const value = (row: HTMLTableRowElement) => row.cells[column]!.dataset["value"];
    const order = (a: HTMLTableRowElement, b: HTMLTableRowElement) => {
      const [x, y] = [value(a), value(b)];
      if (x === undefined || y === undefined) {
        return Number(x === undefined) - Number(y === undefined); // what is not told is last
      }
      const compared = numbers
        ? numberOf(x) - numberOf(y) || 0
        : x.localeCompare(y, "en", { numeric: true });
      return descending ? -compared : compared;
    };
    this.rows.sort(order);
    this.table.tBodies[0]!.append(...this.rows);
  }

  private textFilter(): HTMLElement {
    const input = h("input", { type: "search", placeholder: "name or text", spellcheck: "false" });
    input.addEventListener("input", () => {
      this.text = input.value.trim().toLowerCase();
      this.filter();
    });
    return h("label", { class: "field" }, h("span", {}, "Find"), input);
  }

  private statusFilter(): HTMLElement {
    const found = [...new Set(this.rows.map((row) => row.dataset["status"]!))].sort();
    const options = found.map((each): [string, string] => [each, each]);
    return choice("Status", [["", "all"], ...options], "", (value) => {
      this.status = value;
      this.filter();
    });
  }

  private filter(): void {
    let shown = 0;
    for (const row of this.rows) {
      const matches =
        (!this.status || row.dataset["status"] === this.status) &&
        (!this.text || row.textContent!.toLowerCase().includes(this.text));
      row.hidden = !matches;
      if (matches) shown++;
    }
    this.count.textContent =
      (shown === this.rows.length ? "" : `${shown} of `) + counted(this.rows.length, "row");
  }
}

/** Say whose they are. */
function nameBoxes(row: HTMLTableRowElement): void {
  const name = row.querySelector<HTMLElement>("th.name")!.dataset["value"]!;
  for (const box of row.querySelectorAll("input")) {
    box.setAttribute("aria-label", `${name}: ${box.getAttribute("aria-label")}`);
  }
}

function numberOf(text: string): number {
  return text === "inf" ? Infinity : Number(text);
}
