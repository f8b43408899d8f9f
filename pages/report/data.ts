// What the page is given (src/figure/data.rs, src/report/page.rs), and small tools of all parts.

type Value = number | null;

interface Axis { label: string; unit: string; log: boolean; words: string[]; ends: [number, number] | null }
interface Path { name: string; colour: number; x: Value[]; y: Value[] }
type Marker = "circle" | "square" | "triangle" | "diamond" | "down" | "plus" | "star" | "hourglass" | "cross" | "ring" | "arrow";
interface Line extends Path { kind: "line"; dash: number; marker: Marker | null }
interface Points extends Path { kind: "points"; marker: Marker; error: Value[]; rows: number[]; notes: string[] }
interface Bars extends Path { kind: "bars"; among: [number, number] }
interface Area extends Path { kind: "area"; outlined: boolean }
interface Cells { kind: "cells"; x: number[]; y: number[]; z: Value[]; of: Axis }
interface Rule { kind: "rule"; along: "x" | "y"; at: number; name: string; colour: number; dash: number }
interface Note { kind: "note"; x: number; y: number; text: string }
type Mark = Line | Points | Bars | Area | Cells | Rule | Note;
interface Panel { title: string; x: Axis; y: Axis; to_scale: boolean; marks: Mark[]; beyond: string }
interface Parallel { axes: Axis[]; values: Value[][]; colour: number; muted: boolean[]; why: string }
interface Figure { name: string; title: string; caption: string; panels: Panel[]; columns: number; parallel: Parallel | null }
interface Table {
    file: string; of: number; how: string; linked: boolean; at: number[];
    columns: { name: string; label: string; unit: string }[]; rows: (Value | string)[][];
}
interface Data {
    made: [string, string][]; facts: [string, string][]; notes: string[]; figures: Figure[]; tables: Table[];
    spec: string | null; no_value: string; answer: string;
    colours: { light: string[]; dark: string[] };
    /** Stops of the scale of maps: red, green, blue. */
    map: { light: [number, number, number][]; dark: [number, number, number][] };
    /** Corners and strokes of markers of radius 1. */
    markers: Record<string, [[number, number][], [number, number][][]]>;
}

const data: Data = JSON.parse(document.getElementById("data")!.textContent!);

/** An element with attributes and children; text becomes text, never markup. */
function element<K extends keyof HTMLElementTagNameMap>(
    tag: K, attributes: Record<string, string> = {}, ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
}

/** The same of SVG. */
function drawn<K extends keyof SVGElementTagNameMap>(
    tag: K, attributes: Record<string, string | number>, ...children: (Node | string)[]
): SVGElementTagNameMap[K] {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) {
        made.setAttribute(name, typeof value === "number" ? String(Math.round(value * 100) / 100) : value);
    }
    made.append(...children);
    return made;
}

/** A number as people read it: six digits. */
function spoken(x: Value | undefined): string {
    if (x === null || x === undefined || !Number.isFinite(x)) return "–";
    const size = Math.abs(x);
    if (x !== 0 && (size < 1e-4 || size >= 1e6)) return x.toExponential(4).replace("-", "−").replace("e−", "e−").replace("e+", "e");
    return String(Number(x.toPrecision(6))).replace("-", "−");
}

/** A quantity with its symbol and unit. */
function told(axis: Axis, x: Value | undefined): string {
    const word = axis.words[Math.round(x ?? -1)];
    if (word !== undefined && axis.label === "") return word;
    const unit = axis.unit === "" || axis.unit === "°" ? axis.unit : ` ${axis.unit}`;
    return `${axis.label === "" ? "value" : axis.label} = ${word ?? spoken(x)}${unit}`;
}

/** Colour of a share 0 … 1 of the scale of maps, whose stops the theme gives; grey where there is none. */
function shade(share: number): string {
    if (Number.isNaN(share)) return "var(--soft)";
    const last = data.map.light.length - 1;
    const at = Math.min(1, Math.max(0, share)) * last;
    const i = Math.min(Math.floor(at), last - 1);
    return `color-mix(in srgb, var(--m${i + 1}) ${(100 * (at - i)).toFixed(2)}%, var(--m${i}))`;
}

/** Rows of the linked table that are chosen (null: all), and the one that is pointed at. */
class Choice {
    rows: Set<number> | null = null;
    pointed: number | null = null;
    private readonly told: (() => void)[] = [];

    whenChanged(tell: () => void): void {
        this.told.push(tell);
    }

    choose(rows: Set<number> | null): void {
        this.rows = rows;
        this.told.forEach((tell) => tell());
    }

    point(row: number | null): void {
        if (row === this.pointed) return;
        this.pointed = row;
        this.told.forEach((tell) => tell());
    }

    has(row: number): boolean {
        return this.rows === null || this.rows.has(row);
    }
}

const choice = new Choice();
