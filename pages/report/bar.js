"use strict";
// The scale of colours beside a map or a bundle of lines.
/** Width of a text in a font of the page (pages/report/report.css), px. */
function measured(words, size) {
    ruler ??= document.createElement("canvas").getContext("2d");
    if (ruler === null)
        return 0.6 * size * words.length;
    ruler.font = `${size}px system-ui, sans-serif`;
    return ruler.measureText(words).width;
}
let ruler = null;
/** Sizes of texts of the page, px. */
const TICK = 11.5;
const LABEL = 12.5;
/** Length of the longest of some texts at an axis, px. */
function longest(words) {
    return Math.max(0, ...words.map((w) => measured(w, TICK)));
}
/** Different values of a map of which each has a colour: as src/figure/shades.rs. */
const FEW = 6;
/** What the colours of a map mean: a scale, or a band for each of few values. */
class Shades {
    scale;
    bands;
    constructor(scale, bands) {
        this.scale = scale;
        this.bands = bands;
    }
    static of(cells) {
        const bands = [];
        for (const z of cells.z.filter((z) => z !== null).sort((a, b) => a - b)) {
            const last = bands.at(-1);
            if (last === undefined || z - last > 1e-9 * Math.max(Math.abs(last), Math.abs(z)))
                bands.push(z);
        }
        return bands.length > 0 && bands.length <= FEW ? new Shades(null, bands) : Shades.along(Scale.of(cells.of, cells.z, true));
    }
    static along(scale) {
        return new Shades(scale, []);
    }
    /** Colour of a value. */
    colour(z) {
        if (this.scale !== null)
            return shade(this.scale.share(z));
        const off = this.bands.map((b) => Math.abs(b - (z ?? NaN)));
        return shade(off.indexOf(Math.min(...off)) / (Math.max(this.bands.length, 2) - 1));
    }
}
/** A scale of colours. */
class Bar {
    of;
    shades;
    constructor(of, shades) {
        this.of = of;
        this.shades = shades;
    }
    /** Shares of the height with their words. */
    ticks() {
        const { scale, bands } = this.shades;
        if (scale !== null)
            return scale.ticks(5).map(([x, words]) => [scale.share(x), words]);
        return bands.map((x, i) => [(i + 0.5) / bands.length, alone(x)]);
    }
    /** Width that it takes, px. */
    wide() {
        return 10 + 10 + 4 + longest(this.ticks().map((t) => t[1])) + 20;
    }
    /** Draws it from `left` on. */
    draw(svg, left, top, high) {
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
