// The scale of colours beside a map or a bundle of lines.

/** Width of a text in a font of the page (src/page/report.css), px. */
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

/** A scale of colours. */
class Bar {
    constructor(private readonly of: Axis, private readonly scale: Scale) {}

    private ticks(): [number, string][] {
        return this.scale.ticks(5);
    }

    /** Width that it takes, px. */
    wide(): number {
        return 10 + 10 + 4 + longest(this.ticks().map((t) => t[1])) + 20;
    }

    /** Draws it from `left` on. */
    draw(svg: SVGElement, left: number, top: number, high: number): void {
        const [from, steps] = [left + 10, 48];
        for (let i = 0; i < steps; i++) {
            const step = high / steps;
            svg.append(drawn("rect", { x: from, y: top + high - (i + 1) * step - 0.2, width: 10, height: step + 0.4, style: `fill: ${shade((i + 0.5) / steps)}` }));
        }
        for (const [value, words] of this.ticks()) {
            svg.append(drawn("text", { x: from + 14, y: top + (1 - this.scale.share(value)) * high + 4, class: "tick" }, words));
        }
        const [x, y] = [left + this.wide() - 5, top + high / 2];
        svg.append(drawn("text", { x, y, class: "label", "text-anchor": "middle", transform: `rotate(-90 ${x} ${y})` }, text(this.of)));
    }
}
