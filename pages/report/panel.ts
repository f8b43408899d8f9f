// A panel on the screen: axes, marks, what is pointed at (mouse, touch or arrow keys), log axes.

const tip = element("div", { id: "tip", role: "status", "aria-live": "polite" });

function say(words: string[], x: number, y: number): void {
    tip.replaceChildren(...words.map((w) => element("div", {}, w)));
    tip.hidden = false;
    const wide = tip.offsetWidth;
    tip.style.left = `${Math.max(4, Math.min(x + 14, document.documentElement.clientWidth - wide - 8))}px`;
    tip.style.top = `${y + 16}px`;
}

function silent(): void {
    tip.hidden = true;
    choice.point(null);
}

/** The points whose place the axes must hold. */
function reach(m: Mark): [Value, Value][] {
    switch (m.kind) {
        case "cells":
            return [[m.x[0]!, m.y[0]!], [m.x[m.x.length - 1]!, m.y[m.y.length - 1]!]];
        case "rule":
        case "note":
            return [];
        case "bars":
            return m.x.flatMap((x, i): [Value, Value][] => [[x, m.y[i] ?? null], [0, m.y[i] ?? null]]);
        case "points":
            return m.x.flatMap((x, i): [Value, Value][] => {
                const [y, e] = [m.y[i] ?? null, m.error[i] ?? 0];
                return y === null ? [] : [[x, y - e], [x, y + e]];
            });
        default:
            return m.x.map((x, i): [Value, Value] => [x, m.y[i] ?? null]);
    }
}

class PanelView {
    readonly box = element("div", { class: "panel" });
    private readonly hidden: Set<string>;
    private readonly logs: { x: boolean; y: boolean };
    /** Also what lies beyond the ends of a cut axis is shown. */
    private whole = false;
    private spots: Spot[] = [];
    private at = -1;
    private ring: SVGElement | null = null;

    constructor(private readonly panel: Panel, hidden: Set<string>) {
        this.hidden = hidden;
        this.logs = { x: panel.x.log, y: panel.y.log };
        choice.whenChanged(() => this.show());
    }

    /** Draws it, `wide` pixels wide. */
    draw(wide: number): void {
        const p = this.panel;
        const marks = p.marks.filter((m) => !("name" in m) || !this.hidden.has(m.name));
        const points = p.marks.flatMap(reach);
        const mapped = p.marks.find((m): m is Cells => m.kind === "cells");
        const axis = (a: Axis, log: boolean) => ({ ...a, log, ends: log === a.log && !(this.whole && a === p.y) ? a.ends : null });
        const x = Scale.of(axis(p.x, this.logs.x), points.map((q) => q[0]), mapped !== undefined);
        const y = Scale.of(axis(p.y, this.logs.y), points.map((q) => q[1]), mapped !== undefined);
        const bar = mapped === undefined ? null : new Bar(mapped.of, Shades.of(mapped));
        // Titles that are longer than the panel is wide have more lines.
        const [title, below] = [broken(p.title, wide, LABEL), broken(text(p.x), wide, LABEL)];
        const [right, top] = [bar === null ? 12 : bar.wide(), 8 + LINE * title.length];
        // Words are cut where they would take half the panel; numbers never are. How many there are depends on the height.
        let place = this.place(wide, { left: 62, right, top, x, y });
        for (let again = 0; again < 3; again++) {
            const words = longest(named(p.y, place.y, many(place.high, 40)).map((t) => t[1]));
            const room = p.y.words.length > 0 ? Math.min(0.45 * wide, 30 + words) : 30 + words;
            if (again > 0 && room <= place.left) break;
            place = this.place(wide, { left: room, right, top, x, y });
        }
        const { left, wide: inside, high } = place;
        const turned = p.x.words.length > 6 ? 60 : 0;
        const svg = drawn("svg", {
            width: wide, height: top + high + 26 + turned + LINE * below.length, tabindex: "0", role: "img",
            "aria-label": `${p.title} ${text(p.y)} against ${text(p.x)}; arrow keys go from point to point`,
        });
        this.axes(svg, place, turned);
        stacked(svg, title, "title", left + inside / 2, 14, wide);
        stacked(svg, below, "label", left + inside / 2, top + high + 36 + turned, wide);
        const clip = `clip${PanelView.count++}`;
        svg.append(drawn("clipPath", { id: clip }, drawn("rect", { x: left - 1, y: top - 1, width: inside + 2, height: high + 2 })));
        const inner = drawn("g", { "clip-path": `url(#${clip})` });
        this.spots = marks.flatMap((m) => mark(inner, place, p, m));
        notes(inner, place, marks);
        svg.append(inner, drawn("rect", { x: left, y: top, width: inside, height: high, class: "edge" }));
        bar?.draw(svg, left + inside, top, high);
        this.ring = drawn("circle", { r: 7, class: "pointed", visibility: "hidden" });
        svg.append(this.ring);
        svg.addEventListener("pointermove", (e) => this.near(svg, e));
        svg.addEventListener("pointerdown", (e) => this.near(svg, e));
        svg.addEventListener("pointerleave", () => this.leave());
        svg.addEventListener("blur", () => this.leave());
        svg.addEventListener("keydown", (e) => this.key(svg, e));
        this.box.replaceChildren(svg, this.switches());
        this.show();
    }

    private static count = 0;

    /** Where the inside lies between its margins. */
    private place(wide: number, { left, right, top, x, y }: { left: number; right: number; top: number; x: Scale; y: Scale }): Place {
        const p = this.panel;
        const inside = wide - left - right;
        if (!p.to_scale) {
            const least = Math.max(150, 15 * p.y.words.length, measured(text(p.y), LABEL) - top);
            return { left, top, wide: inside, high: Math.max(least, Math.min(0.66 * inside, 460)), x, y };
        }
        const high = Math.max(60, Math.min((inside * (y.to - y.from)) / (x.to - x.from), 460));
        // What the panel has more than the data need goes to both ends.
        const each = Math.max((x.to - x.from) / inside, (y.to - y.from) / high);
        const wider = (s: Scale, long: number) => {
            const more = 0.5 * (each * long - (s.to - s.from));
            return new Scale(s.from - more, s.to + more, false);
        };
        return { left, top, wide: inside, high, x: wider(x, inside), y: wider(y, high) };
    }

    private axes(svg: SVGElement, place: Place, turned: number): void {
        const { left, top, wide, high, x, y } = place;
        const p = this.panel;
        // No line of the grid shows between the bands of a map.
        const mapped = p.marks.some((m) => m.kind === "cells");
        let last = -Infinity;
        for (const [value, words] of named(p.x, x, many(wide, 62))) {
            const at = left + x.share(value) * wide;
            svg.append(drawn("path", { d: mapped ? `M${at} ${top + high}v4` : `M${at} ${top}v${high + 4}`, class: "grid" }));
            if (turned > 0) {
                svg.append(drawn("text", { x: at, y: top + high + 8, class: "tick", "text-anchor": "end", transform: `rotate(-60 ${at} ${top + high + 8})` }, words));
            } else if (at - 0.5 * measured(words, TICK) > last + 4) {
                svg.append(drawn("text", { x: at, y: top + high + 17, class: "tick", "text-anchor": "middle" }, words));
                last = at + 0.5 * measured(words, TICK);
            }
        }
        for (const [value, words] of named(p.y, y, many(high, 40))) {
            const at = top + (1 - y.share(value)) * high;
            svg.append(drawn("path", { d: `M${left - 4} ${at}h${mapped ? 4 : wide + 4}`, class: "grid" }));
            const shown = p.y.words.length > 0 ? cut(words, left - 28) : words;
            svg.append(drawn("text", { x: left - 7, y: at + 4, class: "tick", "text-anchor": "end" }, shown, drawn("title", {}, words)));
        }
        svg.append(drawn("text", { x: 12, y: top + high / 2, class: "label", "text-anchor": "middle", transform: `rotate(-90 12 ${top + high / 2})` }, text(p.y)));
    }

    private near(svg: SVGSVGElement, e: PointerEvent): void {
        const box = svg.getBoundingClientRect();
        const [x, y] = [e.clientX - box.left, e.clientY - box.top];
        let [best, least] = [-1, 40 * 40];
        this.spots.forEach((s, i) => {
            const d = (s.x - x) ** 2 + (s.y - y) ** 2;
            if (d < least && (s.row === null || choice.has(s.row))) [best, least] = [i, d];
        });
        this.point(svg, best);
    }

    private point(svg: SVGSVGElement, i: number): void {
        const s = this.spots[i];
        if (s === undefined) return this.leave();
        this.at = i;
        this.ring?.setAttribute("visibility", "visible");
        this.ring?.setAttribute("cx", String(s.x));
        this.ring?.setAttribute("cy", String(s.y));
        const box = svg.getBoundingClientRect();
        say(s.words, box.left + s.x + scrollX, box.top + s.y + scrollY);
        choice.point(s.row);
    }

    private leave(): void {
        this.at = -1;
        this.ring?.setAttribute("visibility", "hidden");
        silent();
    }

    private key(svg: SVGSVGElement, e: KeyboardEvent): void {
        const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[e.key];
        if (e.key === "Escape") this.leave();
        if (step === undefined || this.spots.length === 0) return;
        e.preventDefault();
        const n = this.spots.length;
        this.point(svg, (((this.at + step) % n) + n) % n);
    }

    private switches(): HTMLElement {
        const made = (which: "x" | "y") => {
            const a = this.panel[which];
            const positive = this.panel.marks.flatMap(reach).some((q) => (q[which === "x" ? 0 : 1] ?? 0) > 0);
            if (a.words.length > 0 || this.panel.to_scale || !positive) return "";
            const button = element("button", { type: "button", "aria-pressed": String(this.logs[which]) }, `log ${which}`);
            button.addEventListener("click", () => {
                this.logs[which] = !this.logs[which];
                this.draw(this.box.clientWidth);
                this.box.querySelectorAll<HTMLElement>("button")[which === "x" ? 0 : this.box.querySelectorAll("button").length - 1]?.focus();
            });
            return button;
        };
        return element("div", { class: "switches" }, made("x"), this.cut(), made("y"));
    }

    /** Shows what lies beyond a cut axis, or hides it. */
    private cut(): HTMLElement | string {
        if (this.panel.beyond === "") return "";
        const button = element("button", { type: "button", "aria-pressed": String(this.whole) }, "all of y");
        button.addEventListener("click", () => {
            this.whole = !this.whole;
            this.draw(this.box.clientWidth);
        });
        return button;
    }

    /** Shows what is chosen. */
    private show(): void {
        for (const group of this.box.querySelectorAll<SVGElement>("[data-row]")) {
            const row = Number(group.dataset.row);
            group.classList.toggle("out", !choice.has(row));
            group.classList.toggle("here", choice.pointed === row);
        }
    }
}

function text(axis: Axis): string {
    return axis.unit === "" ? axis.label : `${axis.label} (${axis.unit})`;
}

/** From line to line of a title, px. */
const LINE = 16;

/** Words in lines that are at most `room` wide. */
function broken(words: string, room: number, size: number): string[] {
    const lines: string[] = [];
    for (const word of words.split(" ").filter((w) => w !== "")) {
        const longer = lines.length === 0 ? word : `${lines.at(-1)} ${word}`;
        if (lines.length > 0 && measured(longer, size) <= room) lines[lines.length - 1] = longer;
        else lines.push(word);
    }
    return lines;
}

/** Lines of a title about `middle`, as far as the drawing goes. */
function stacked(svg: SVGElement, lines: string[], name: string, middle: number, y: number, wide: number): void {
    lines.forEach((line, i) => {
        const half = measured(line, LABEL) / 2 + 1;
        const x = Math.max(half, Math.min(middle, wide - half));
        svg.append(drawn("text", { x, y: y + LINE * i, class: name, "text-anchor": "middle" }, line));
    });
}

/** How many ticks have room. */
function many(long: number, each: number): number {
    return Math.max(2, Math.floor(long / each));
}

/** Ticks of an axis with their words. */
function named(axis: Axis, scale: Scale, wanted: number): [number, string][] {
    if (axis.words.length > 0) return axis.words.map((w, i): [number, string] => [i, w]);
    return scale.ticks(wanted);
}

/** What of some words has room. */
function cut(words: string, room: number): string {
    if (measured(words, TICK) <= room) return words;
    let shown = words;
    while (shown !== "" && measured(`${shown}…`, TICK) > room) shown = shown.slice(0, -1);
    return `${shown}…`;
}
