// The scale of colours beside a map or a bundle of lines.

/** Width of a text in a font of the page (pages/report/report.css), px. */
function measured(words: string, size: number): number {
    ruler ??= document.createElement("canvas").getContext("2d");
    if (ruler === null) return 0.6 * size * words.length;
    ruler.font = `${size}px system-ui, sans-serif`;
    return ruler.measureText(words).width;
}

let ruler: CanvasRenderingContext2D | null = null;

/** Sizes of texts of the page, px. */
const TICK = 11.5;
const LABEL = 12.5;

/** Length of the longest of some texts at an axis, px. */
function longest(words: string[]): number {
    return Math.max(0, ...words.map((w) => measured(w, TICK)));
}

/** Different values of a map of which each has a colour: as src/figure/shades.rs. */
const FEW = 6;

/** What the colours of a map mean: a scale, or a band for each of few values. */
class Shades {
    private constructor(readonly scale: Scale | null, readonly bands: number[]) {}

    static of(cells: Cells): Shades {
        const bands: number[] = [];
        for (const z of cells.z.filter((z) => z !== null).sort((a, b) => a - b)) {
            const last = bands.at(-1);
            if (last === undefined || z - last > 1e-9 * Math.max(Math.abs(last), Math.abs(z))) bands.push(z);
        }
        return bands.length > 0 && bands.length <= FEW ? new Shades(null, bands) : Shades.along(Scale.of(cells.of, cells.z, true));
    }

    static along(scale: Scale): Shades {
        return new Shades(scale, []);
    }

    /** Colour of a value. */
    colour(z: Value | undefined): string {
        if (this.scale !== null) return shade(this.scale.share(z));
        const off = this.bands.map((b) => Math.abs(b - (z ?? NaN)));
        return shade(off.indexOf(Math.min(...off)) / (Math.max(this.bands.length, 2) - 1));
    }
}

/** A scale of colours. */
class Bar {
    constructor(private readonly of: Axis, private readonly shades: Shades) {}

    /** Shares of the height with their words. */
    private ticks(): [number, string][] {
        const { scale, bands } = this.shades;
        if (scale !== null) return scale.ticks(5).map(([x, words]) => [scale.share(x), words]);
        return bands.map((x, i) => [(i + 0.5) / bands.length, alone(x)]);
    }

    /** Width that it takes, px. */
    wide(): number {
        return 10 + 10 + 4 + longest(this.ticks().map((t) => t[1])) + 20;
    }

    /** Draws it from `left` on. */
    draw(svg: SVGElement, left: number, top: number, high: number): void {
        const { bands } = this.shades;
        // Bands have gaps between them, steps of a scale overlap by a hair.
        const [from, steps, more] = bands.length > 0 ? [left + 10, bands.length, -1.5] : [left + 10, 48, 0.2];
        for (let i = 0; i < steps; i++) {
            const step = high / steps;
            const fill = bands.length > 0 ? this.shades.colour(bands[i]) : shade((i + 0.5) / steps);
            svg.append(drawn("rect", { x: from, y: top + high - (i + 1) * step - more, width: 10, height: step + 2 * more, style: `fill: ${fill}` }));
        }
        for (const [share, words] of this.ticks()) {
            svg.append(drawn("text", { x: from + 14, y: top + (1 - share) * high + 4, class: "tick" }, words));
        }
        const [x, y] = [left + this.wide() - 5, top + high / 2];
        svg.append(drawn("text", { x, y, class: "label", "text-anchor": "middle", transform: `rotate(-90 ${x} ${y})` }, text(this.of)));
    }
}
