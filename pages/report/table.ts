// A table that is sorted by its headers; a linked one shows the rows that are chosen.

const PAGE = 25;

class TableView {
    readonly box = element("div", { class: "table" });
    private sort: { column: number; down: boolean } | null = null;
    private from = 0;

    constructor(private readonly t: Table) {
        if (t.linked) {
            choice.whenChanged(() => this.draw());
        }
        this.draw();
    }

    private order(): number[] {
        let rows = this.t.rows.map((_, i) => i);
        if (this.t.linked) rows = rows.filter((i) => choice.has(i));
        const sort = this.sort;
        if (sort === null) return rows;
        const sign = sort.down ? -1 : 1;
        return rows.sort((a, b) => {
            const [x, y] = [this.t.rows[a]![sort.column]!, this.t.rows[b]![sort.column]!];
            // What is missing stays at the end, whichever way.
            if (x === null || x === "" || y === null || y === "") return Number(x === null || x === "") - Number(y === null || y === "");
            return sign * (typeof x === "number" && typeof y === "number" ? x - y : String(x).localeCompare(String(y)));
        });
    }

    private draw(): void {
        const focused = this.box.contains(document.activeElement) ? (document.activeElement as HTMLElement).dataset.focus : undefined;
        const rows = this.order();
        this.from = Math.max(0, Math.min(this.from, Math.floor(Math.max(0, rows.length - 1) / PAGE) * PAGE));
        const head = this.t.columns.map((c, k) => {
            const mine = this.sort?.column === k;
            const arrow = mine ? (this.sort!.down ? " ↓" : " ↑") : "";
            const button = element("button", { type: "button", "data-focus": `c${k}`, title: `${c.label}${c.unit === "" ? "" : ` (${c.unit})`}: sort` }, `${c.name}${arrow}`);
            button.addEventListener("click", () => {
                this.sort = mine && !this.sort!.down ? { column: k, down: true } : mine ? null : { column: k, down: false };
                this.draw();
            });
            return element("th", { scope: "col", "aria-sort": mine ? (this.sort!.down ? "descending" : "ascending") : "none" }, button);
        });
        const body = rows.slice(this.from, this.from + PAGE).map((i) => {
            const cells = this.t.rows[i]!.map((x) =>
                typeof x === "number" ? element("td", { class: "number", title: String(x) }, spoken(x)) : element("td", {}, x ?? ""));
            const row = element("tr", {}, ...cells);
            if (this.t.linked) {
                row.classList.toggle("here", choice.pointed === i);
                row.addEventListener("pointerenter", () => this.point(i));
                row.addEventListener("pointerleave", () => this.point(null));
            }
            return row;
        });
        const turn = (words: string, by: number, allowed: boolean) => {
            const button = element("button", { type: "button", "data-focus": words }, words);
            button.disabled = !allowed;
            button.addEventListener("click", () => {
                this.from += by;
                this.draw();
            });
            return button;
        };
        const last = Math.min(this.from + PAGE, rows.length);
        const where = rows.length === 0 ? "no rows" : `rows ${this.from + 1}–${last} of ${rows.length}`;
        const less = this.t.rows.length < this.t.of ? `, of ${this.t.of} in the file: ${this.t.how}` : "";
        this.box.replaceChildren(
            element("div", { class: "wide", tabindex: "0", role: "region", "aria-label": this.t.file },
                element("table", {}, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...body))),
            element("div", { class: "switches" }, turn("previous", -PAGE, this.from > 0), turn("next", PAGE, last < rows.length), ` ${where}${less}`),
        );
        if (focused !== undefined) this.box.querySelector<HTMLElement>(`[data-focus="${focused}"]`)?.focus();
    }

    /** Points without drawing this table anew: the row under the pointer would go. */
    private point(row: number | null): void {
        const drawn = this.draw;
        this.draw = () => {};
        choice.point(row);
        this.draw = drawn;
        [...this.box.querySelectorAll("tbody tr")].forEach((tr, k) => tr.classList.toggle("here", row !== null && this.order()[this.from + k] === row));
    }
}
