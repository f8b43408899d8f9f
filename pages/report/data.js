"use strict";
// What the page is given (src/figure/data.rs, src/report/page.rs), and small tools of all parts.
const data = JSON.parse(document.getElementById("data").textContent);
/** An element with attributes and children; text becomes text, never markup. */
function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes))
        made.setAttribute(name, value);
    made.append(...children);
    return made;
}
/** The same of SVG. */
function drawn(tag, attributes, ...children) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) {
        made.setAttribute(name, typeof value === "number" ? String(Math.round(value * 100) / 100) : value);
    }
    made.append(...children);
    return made;
}
/** A number as people read it: six digits. */
function spoken(x) {
    if (x === null || x === undefined || !Number.isFinite(x))
        return "–";
    const size = Math.abs(x);
    if (x !== 0 && (size < 1e-4 || size >= 1e6))
        return x.toExponential(4).replace("-", "−").replace("e−", "e−").replace("e+", "e");
    return String(Number(x.toPrecision(6))).replace("-", "−");
}
/** A quantity with its symbol and unit. */
function told(axis, x) {
    const word = axis.words[Math.round(x ?? -1)];
    if (word !== undefined && axis.label === "")
        return word;
    const unit = axis.unit === "" || axis.unit === "°" ? axis.unit : ` ${axis.unit}`;
    return `${axis.label === "" ? "value" : axis.label} = ${word ?? spoken(x)}${unit}`;
}
/** Colour of a share 0 … 1 of the scale of maps, whose stops the theme gives; grey where there is none. */
function shade(share) {
    if (Number.isNaN(share))
        return "var(--soft)";
    const last = data.map.light.length - 1;
    const at = Math.min(1, Math.max(0, share)) * last;
    const i = Math.min(Math.floor(at), last - 1);
    return `color-mix(in srgb, var(--m${i + 1}) ${(100 * (at - i)).toFixed(2)}%, var(--m${i}))`;
}
/** Rows of the linked table that are chosen (null: all), and the one that is pointed at. */
class Choice {
    rows = null;
    pointed = null;
    told = [];
    whenChanged(tell) {
        this.told.push(tell);
    }
    choose(rows) {
        this.rows = rows;
        this.told.forEach((tell) => tell());
    }
    point(row) {
        if (row === this.pointed)
            return;
        this.pointed = row;
        this.told.forEach((tell) => tell());
    }
    has(row) {
        return this.rows === null || this.rows.has(row);
    }
}
const choice = new Choice();
