// Sparse Chebyshev series over (drive, (r₀ or ρ)/a, D/a, τa, x/a). At a whisker and a distance the three in the middle are fixed: what is
// left is a small matrix over the orders of drive and place, from which every drive and every place is read.
import { bracketed } from "./beam";
const DRIVE = 0;
const PLACE = 4;
/** Slack of the box, relative: sums of decimal numbers. */
const SLACK = 1e-9;
/** Shares of a chart of one branch. */
const ONE = [1];
function variable(axis, q) {
    switch (axis.variable) {
        case "linear":
            return q;
        case "square":
            return q * q;
        case "root":
            return 1 / Math.sqrt(1 - q);
        case "inverse":
            return 1 / (1 - q);
        case "fourth":
            return Math.sqrt(Math.sqrt(Math.max(q, 0)));
    }
}
/** T_0(x) … T_{n−1}(x). */
export function basis(n, x) {
    const t = new Float64Array(Math.max(n, 2));
    t[0] = 1;
    t[1] = x;
    for (let k = 2; k < n; k += 1) {
        t[k] = 2 * x * t[k - 1] - t[k - 2];
    }
    return t;
}
/** Σ c_k t_k. */
export function dotted(c, t) {
    let sum = 0;
    for (let k = 0; k < c.length; k += 1) {
        sum += c[k] * t[k];
    }
    return sum;
}
/** Newton's polynomial through `values` at 0, 1, 2 …. */
export function polynomial(values) {
    const coefficients = [];
    for (let left = values; left.length > 0; left = left.slice(1).map((next, i) => next - left[i])) {
        coefficients.push(left[0]);
    }
    return (u) => coefficients.reduceRight((sum, c, k) => c + ((u - k) / (k + 1)) * sum, 0);
}
function flat(rows) {
    const orders = new Uint8Array(4 * rows.length);
    const starts = new Uint32Array(rows.length + 1);
    const coefficients = [];
    const most = [1, 1, 1, 1];
    let places = 1;
    rows.forEach(([of, values], r) => {
        orders.set(of, 4 * r);
        coefficients.push(...values);
        starts[r + 1] = coefficients.length;
        of.forEach((order, k) => (most[k] = Math.max(most[k], order + 1)));
        places = Math.max(places, values.length);
    });
    return { orders, starts, coefficients: Float64Array.from(coefficients), most, places };
}
export class Chart {
    power;
    axes;
    terms;
    /** What the axes are called, and the factor to the number that is said. */
    words;
    ends;
    /** T/P of each branch. */
    ratios;
    branches;
    constructor(baked) {
        this.power = baked.power;
        this.axes = baked.axes;
        this.words = [
            baked.drive === "angle" ? ["θ in degrees", 180 / Math.PI] : ["δ/a", 1],
            [baked.model.pole_radius > 0 ? "ρ/a" : "hub/a", 1],
            ["D/a", 1],
            ["τa", 1],
            ["x/a", 1],
        ];
        this.ends = baked.axes.map((axis) => [variable(axis, axis.range[0]), variable(axis, axis.range[1])]);
        this.ratios = baked.branches.map((b) => b.T_over_P);
        this.branches = baked.branches.map(({ functions }) => {
            const named = Object.entries(functions);
            return new Map(named.map(([name, rows]) => [name, flat(rows)]));
        });
        const all = this.branches.flatMap((b) => [...b.values()]);
        this.terms = all.reduce((sum, s) => sum + s.coefficients.length, 0);
    }
    /** Whether a function was charted. */
    has(name) {
        return this.branches[0].has(name);
    }
    /** Place of q on axis `k` in [−1, 1]; 0 where the axis has one value. */
    place(k, q) {
        const [lo, hi] = this.ends[k];
        return hi > lo ? (2 * variable(this.axes[k], q) - hi - lo) / (hi - lo) : 0;
    }
    /** Why q on axis `k` is outside the chart, or nothing. */
    outside(k, q) {
        const axis = this.axes[k];
        const [lo, hi] = axis.range;
        const slack = SLACK * Math.max(Math.abs(lo), Math.abs(hi));
        if (q >= lo - slack && q <= hi + slack) {
            return undefined;
        }
        const [word, unit] = this.words[k];
        const [end, than] = q < lo ? [lo, "<"] : [hi, ">"];
        return `${word} = ${(q * unit).toPrecision(3)} ${than} ${(end * unit).toPrecision(3)}`;
    }
    /** A function of each branch at (r₀ or ρ)/a, D/a and τa. */
    planes(name, middle) {
        return this.branches.map((branch) => this.plane(branch.get(name), middle));
    }
    plane(s, middle) {
        const t = middle.map((q, k) => basis(s.most[k + 1], this.place(k + 1, q)));
        const drives = s.most[DRIVE];
        const c = new Float64Array(drives * s.places);
        for (let r = 0; r + 1 < s.starts.length; r += 1) {
            const at = 4 * r;
            const shared = t[0][s.orders[at + 1]] * t[1][s.orders[at + 2]] * t[2][s.orders[at + 3]];
            const row = s.orders[at] * s.places - s.starts[r];
            for (let i = s.starts[r]; i < s.starts[r + 1]; i += 1) {
                c[row + i] += shared * s.coefficients[i];
            }
        }
        return { c, drives, places: s.places };
    }
    /** Coefficients over the drive, the place folded by `weights` of T_n. */
    fold({ c, drives, places }, weights) {
        return Float64Array.from({ length: drives }, (_, i) => {
            let sum = 0;
            for (let n = 0; n < places; n += 1) {
                sum += c[i * places + n] * weights[n];
            }
            return sum;
        });
    }
    /** Coefficients over the place, at a drive (rad, or δ/a). */
    atDrive({ c, drives, places }, drive) {
        const t = basis(drives, this.place(DRIVE, drive));
        return Float64Array.from({ length: places }, (_, n) => {
            let sum = 0;
            for (let i = 0; i < drives; i += 1) {
                sum += t[i] * c[i * places + n];
            }
            return sum;
        });
    }
    /**
     * What each branch counts, by c/a − 1 of each (or a multiple of it): the last where even T/P = μ lets the contact slide outwards, the first
     * where even −μ lets it slide inwards, else those of the polynomial through all at the T/P at which the contact does not move.
     */
    shares(arcs) {
        const n = arcs.length;
        if (n === 1) {
            return { shares: ONE, ratio: this.ratios[0] };
        }
        const at = (ratio) => ({
            ratio,
            shares: this.ratios.map((own) => this.ratios.reduce((p, other) => (other === own ? p : (p * (ratio - other)) / (own - other)), 1)),
        });
        const [first, last] = [this.ratios[0], this.ratios[n - 1]];
        if (arcs[n - 1] >= 0) {
            return at(last);
        }
        if (arcs[0] <= 0) {
            return at(first);
        }
        const arc = (ratio) => at(ratio).shares.reduce((sum, share, i) => sum + share * arcs[i], 0);
        return at(bracketed(arc, first, last));
    }
    /** T_n at the place x/a. */
    placeBasis(n, x) {
        return basis(n, this.place(PLACE, x));
    }
}
