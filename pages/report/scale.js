"use strict";
// From values to places along an axis, and its ticks: as src/figure/scale.rs.
/** Beyond this, values count as this: the way from end to end is a number. */
const FAR = 0.25 * Number.MAX_VALUE;
/** Least number of all digits. */
const TINY = 2.2250738585072014e-308;
class Scale {
    from;
    to;
    log;
    constructor(from, to, log) {
        this.from = from;
        this.to = to;
        this.log = log;
    }
    /** That holds all values which have a place on the axis, with a little room; `tight`: exactly those. */
    static of(axis, values, tight = false) {
        if (axis.words.length > 0)
            return new Scale(-0.5, axis.words.length - 0.5, false);
        let [least, most] = [Infinity, -Infinity];
        for (const value of values) {
            if (value === null || !Number.isFinite(value) || (axis.log && value <= 0))
                continue;
            const x = Math.min(Math.max(value, axis.log ? 4 * TINY : -FAR), FAR);
            if (x < least)
                least = x;
            if (x > most)
                most = x;
        }
        if (axis.ends !== null && !(axis.log && axis.ends[0] <= 0))
            return new Scale(axis.ends[0], axis.ends[1], axis.log);
        if (least > most)
            return new Scale(axis.log ? 0.1 : 0, 1, axis.log);
        // What a wide axis has more may be no number.
        const end = (x) => (axis.log ? Math.min(Math.max(x, TINY), Number.MAX_VALUE) : x);
        const over = (a, b) => new Scale(end(a), end(b), axis.log);
        if (tight && least < most)
            return over(least, most);
        if (axis.log) {
            const room = least < most ? Math.exp(0.04 * (Math.log(most) - Math.log(least))) : 2;
            return over(least / room, most * room);
        }
        if (least === most) {
            const room = least === 0 ? 1 : 0.1 * Math.abs(least);
            return over(least - room, most + room);
        }
        const room = 0.04 * most - 0.04 * least;
        return over(least >= 0 && least < 0.2 * most ? 0 : least - room, most + room);
    }
    /** Share of the way from end to end; NaN where there is no place. */
    share(x) {
        if (x === null || x === undefined)
            return NaN;
        if (!this.log)
            return (x - this.from) / (this.to - this.from);
        const from = Math.log(this.from);
        return x > 0 ? (Math.log(x) - from) / (Math.log(this.to) - from) : NaN;
    }
    /** The value at a share. */
    value(share) {
        return this.log ? this.from ** (1 - share) * this.to ** share : this.from + share * (this.to - this.from);
    }
    ticks(wanted) {
        return this.log ? this.decades(wanted) : this.even(wanted);
    }
    even(wanted) {
        const raw = (this.to - this.from) / Math.max(1, wanted);
        const unit = 10 ** Math.floor(Math.log10(raw));
        const step = [1, 2, 5, 10].map((m) => m * unit).find((s) => s >= 0.9 * raw) ?? unit;
        const found = [];
        for (let i = Math.ceil(this.from / step - 1e-9); i * step <= this.to + 1e-9 * step && found.length < 100; i++) {
            found.push([i * step, round(i * step, step)]);
        }
        return found;
    }
    decades(wanted) {
        const first = Math.max(-308, Math.floor(Math.log10(this.from)));
        const last = Math.min(308, Math.ceil(Math.log10(this.to)));
        const whole = Array.from({ length: last - first + 1 }, (_, i) => first + i);
        const inside = (x) => this.share(x) >= -1e-9 && this.share(x) <= 1 + 1e-9;
        const every = Math.max(1, Math.floor(whole.length / Math.max(1, wanted)));
        const tens = whole.filter((n) => n % every === 0).map((n) => 10 ** n).filter(inside);
        const parts = whole.flatMap((n) => [1, 2, 5].map((m) => m * 10 ** n)).filter(inside);
        if (tens.length < 2 && parts.length < 2)
            return this.even(Math.min(wanted, 4));
        const named = tens.length < 2 ? parts : tens;
        // All ticks of an axis are written in the same way.
        const plain = named.every((x) => x > 0.0099 && x < 9999);
        return named.map((x) => [x, decade(x, plain)]);
    }
}
/** A multiple of `step`. */
function round(x, step) {
    if (x === 0)
        return "0";
    if (Math.abs(x) >= 1e5 || (Math.abs(x) < 1e-3 && step < 1e-3)) {
        const power = Math.floor(Math.log10(Math.abs(x)) + 1e-9);
        // As many digits as the step has in units of the leading one: 1.5·10⁻⁴ at steps of 5·10⁻⁵.
        const digits = Math.min(6, Math.max(0, power - Math.floor(Math.log10(step) + 1e-9)));
        const lead = String(Number((x / 10 ** power).toFixed(digits)));
        return (lead === "1" ? ten(power) : lead === "-1" ? `-${ten(power)}` : `${lead}·${ten(power)}`).replace("-", "−");
    }
    return x.toFixed(Math.max(0, Math.ceil(-Math.log10(step) - 1e-9))).replace("-", "−");
}
/** A number alone, to four digits. */
function alone(x) {
    const words = round(x, 10 ** (Math.floor(Math.log10(Math.abs(x) || 1000)) - 3));
    return words.includes(".") && !words.includes("·") ? words.replace(/\.?0+$/, "") : words;
}
function decade(x, plain) {
    if (plain)
        return String(Number(x.toPrecision(6)));
    const power = Math.floor(Math.log10(x) + 1e-9);
    const lead = Math.round(x / 10 ** power);
    return lead === 1 ? ten(power) : `${lead}·${ten(power)}`;
}
function ten(power) {
    if (power === 0)
        return "1";
    const raised = [...String(power)].map((c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(c)])).join("");
    return `10${raised}`;
}
