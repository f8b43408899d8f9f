// Rows of a design over the drive (docs/model.md §4): K and its spread over the distances, errors of the distance estimate, the best drive.

import type { Whisker } from "./beam";
import { Curves, type Rig } from "./rig";
import { Contact, type Tap, type Word } from "./tap";

/** An estimated distance. */
export interface Estimate {
  readonly distance: number;
  /** σ_a = K̄ σ_ε/(θ |f′(â)|), mm. */
  readonly sigma: number;
  readonly word: Word | undefined;
}

/** A design at one drive, over its distances: a row of designs.csv. Values that do not exist are NaN. */
export interface Row {
  readonly drive: number;
  /** Taps that count. */
  readonly n: number;
  /** Mean of K − 1, and the standard deviation of K, without unit. */
  readonly deviation: number;
  readonly K_sd: number;
  readonly error_rms: number;
  readonly error_max: number;
  readonly noise_rms: number;
  readonly total_rms: number;
  readonly strain_max: number;
  /** Of what the sensor reads. */
  readonly signal_max: number;
  readonly force_max: number;
  /** Whether every distance that was asked has its estimate. */
  readonly complete: boolean;
  readonly words: ReadonlySet<Word>;
  readonly taps: readonly Tap[];
  readonly estimates: readonly (Estimate | undefined)[];
}

/** Step by which a kink is looked for, of the drive. */
const KINK = 3e-3;

/** What the best drive is, and what limits it. */
export interface Optimum {
  readonly row: Row;
  readonly limitedBy: "bias" | "noise" | "strain_limit" | "bound" | "complete_rows" | "friction" | "chart_end";
}

/** `n` evenly spaced distances, both ends included. */
export function spaced(from: number, to: number, n: number): number[] {
  return n < 2 ? [from] : Array.from({ length: n }, (_, i) => (i === n - 1 ? to : from + ((to - from) * i) / (n - 1)));
}

function uncounted(word: Word): boolean {
  return word === "invalid_geometry" || word === "no_strain" || word === "slipped_off" || word === "outside_chart";
}

export class Design {
  readonly contacts: readonly Contact[];
  private readonly curves: Curves;
  private readonly rows = new Map<number, Row>();

  constructor(
    readonly rig: Rig,
    readonly whisker: Whisker,
    readonly distances: readonly number[],
    readonly noise: number,
  ) {
    this.curves = new Curves(rig, whisker);
    this.contacts = distances.map((a) => new Contact(rig, whisker, a, this.curves));
  }

  /** Contact at another distance. */
  contact(a: number): Contact {
    return new Contact(this.rig, this.whisker, a, this.curves);
  }

  /** Why distances are outside the chart at a drive, each with its a. */
  outside(drive: number): string[] {
    return this.contacts.flatMap((c) => {
      const why = c.outsideAt(drive);
      return why === undefined ? [] : [`${why} at a = ${Number(c.a.toPrecision(4))} mm`];
    });
  }

  /** The row at a drive, degrees or mm. */
  at(drive: number): Row {
    let row = this.rows.get(drive);
    if (!row) {
      row = this.compute(drive);
      this.rows.set(drive, row);
    }
    return row;
  }

  private compute(drive: number): Row {
    const taps = this.contacts.map((c) => c.at(drive));
    const words = new Set(taps.flatMap((t) => t.words));
    const counting = taps.map((t) => !t.words.some(uncounted));
    const counted = taps.filter((_, i) => counting[i]);
    const n = counted.length;
    const mean = counted.reduce((sum, t) => sum + t.deviation, 0) / n;
    const spread = counted.reduce((sum, t) => sum + (t.deviation - mean) ** 2, 0);
    const K_sd = n >= 2 ? Math.sqrt(spread / (n - 1)) : NaN;
    const K = this.calibration(n, mean);
    const amount = this.rig.amount(drive);
    const estimates = taps.map((t, i) =>
      K === undefined || !Number.isFinite(t.signal) || t.signal === 0 || t.words.includes("no_strain")
        ? undefined
        : this.estimate(K, Math.abs(t.signal), amount, this.distances[i]!),
    );
    estimates.forEach((e) => e?.word && words.add(e.word));
    const judged = estimates.flatMap((e, i) => (e && counting[i] ? [{ e, a: this.distances[i]! }] : []));
    const whole = K !== undefined && n > 0 && judged.length === n && judged.every(({ e }) => Number.isFinite(e.distance + e.sigma));
    const known = whole && !words.has("outside_chart");
    const rms = (of: (x: { e: Estimate; a: number }) => number) =>
      known ? Math.sqrt(judged.reduce((sum, x) => sum + of(x) ** 2, 0) / n) : NaN;
    const error_rms = rms(({ e, a }) => e.distance - a);
    const noise_rms = rms(({ e }) => e.sigma);
    const partly = words.has("outside_chart");
    const largest = (of: (t: Tap) => number) => (n > 0 ? counted.reduce((m, t) => Math.max(m, of(t)), 0) : NaN);
    return {
      drive,
      n,
      deviation: n > 0 && !partly ? mean : NaN,
      K_sd: partly ? NaN : K_sd,
      error_rms,
      error_max: known ? judged.reduce((m, { e, a }) => Math.max(m, Math.abs(e.distance - a)), 0) : NaN,
      noise_rms,
      total_rms: Math.hypot(error_rms, noise_rms),
      strain_max: largest((t) => Math.abs(t.strain)),
      signal_max: largest((t) => Math.abs(t.signal)),
      force_max: largest((t) => t.force),
      complete: known && n === this.distances.length,
      words,
      taps,
      estimates,
    };
  }

  /** K by which K of the tables is multiplied: x2 − x1 by the convention of elongation. */
  get unit(): number {
    const { taper } = this.contacts[0]!;
    return this.rig.baked.estimate.elongation ? taper.x2 - taper.x1 : 1;
  }

  private calibration(n: number, mean: number): number | undefined {
    const given = this.rig.baked.estimate.K;
    return given !== null ? given / this.unit : n >= 2 ? 1 + mean : undefined;
  }

  private estimate(K: number, signal: number, amount: number, a: number): Estimate {
    const { read } = this.curves;
    const roots = read.roots((K * signal) / amount, a);
    if (!roots) {
      return { distance: NaN, sigma: NaN, word: "no_root" };
    }
    const [lo, hi] = this.rig.baked.estimate.range ?? [Math.min(...this.distances), Math.max(...this.distances)];
    const interesting = (x: number) => x >= lo * (1 - 1e-6) && x <= hi * (1 + 1e-6);
    const twice = roots.near !== undefined && interesting(roots.near);
    const sigma = this.noise === 0 ? 0 : (K * this.noise) / (amount * Math.abs(read.slope(roots.far)));
    return { distance: roots.far, sigma, word: twice ? "ambiguous" : roots.beyond ? "outside_calibration" : undefined };
  }

  /** The drive of [lo, hi] with the smallest total error among complete rows that keep the strain limit; nothing where there is none. */
  optimum([lo, hi]: readonly [number, number], grid: readonly number[]): Optimum | undefined {
    const allowed = (row: Row) => row.complete && !row.words.has("strain_limit");
    const value = (row: Row) => (allowed(row) ? row.total_rms : Infinity);
    const rows = grid.map((drive) => this.at(drive));
    let best: Row | undefined;
    const consider = (row: Row) => {
      if (value(row) < (best ? value(best) : Infinity)) {
        best = row;
      }
    };
    const last = rows.length - 1;
    const minima = rows
      .map((_, i) => i)
      .filter((i) => {
        const v = value(rows[i]!);
        return Number.isFinite(v) && (i === 0 || value(rows[i - 1]!) >= v) && (i === last || value(rows[i + 1]!) >= v);
      })
      .sort((i, j) => value(rows[i]!) - value(rows[j]!))
      .slice(0, 3);
    for (const i of minima) {
      consider(rows[i]!);
      const low = this.inner(rows[i]!, rows[Math.max(i - 1, 0)]!, allowed);
      const high = this.inner(rows[i]!, rows[Math.min(i + 1, last)]!, allowed);
      [low, high, ...this.golden(low.drive, high.drive)].forEach(consider);
    }
    if (!best) {
      return undefined;
    }
    const close = (x: number) => Math.abs(best!.drive - x) <= 1e-5 * x;
    const bound = [rows[0]!, rows[last]!].find((end) => close(end.drive) && allowed(end));
    const row = bound ?? best;
    const stopped = [0.9999, 1.0001].map((f) => row.drive * f).filter((x) => x > lo && x < hi).map((x) => this.compute(x));
    // What lies beyond the chart is not known to be worse.
    const limitedBy = stopped.some((s) => s.words.has("outside_chart"))
      ? "chart_end"
      : stopped.some((s) => s.words.has("strain_limit"))
      ? "strain_limit"
      : bound
        ? "bound"
        : stopped.some((s) => !s.complete)
          ? "complete_rows"
          : this.kinked(row)
            ? "friction"
            : row.noise_rms > row.error_rms
              ? "noise"
              : "bias";
    return { row, limitedBy };
  }

  /** Whether the total has a kink at its minimum, where a contact turns from sticking to sliding: the slope jumps by the same whatever the step. */
  private kinked({ drive, total_rms }: Row): boolean {
    const total = (share: number) => this.compute(drive * (1 + share)).total_rms;
    const rise = (step: number) => total(step) + total(-step) - 2 * total_rms;
    const sticks = (share: number) => this.compute(drive * (1 + share)).taps.map((t) => this.rig.sticks(t)).join();
    return rise(KINK) < 1.5 * 2 * rise(0.5 * KINK) && sticks(-KINK) !== sticks(KINK);
  }

  /** The farthest allowed row from `from` towards `to`. */
  private inner(from: Row, to: Row, allowed: (row: Row) => boolean): Row {
    if (allowed(to)) {
      return to;
    }
    let [inside, outside] = [from, to.drive];
    for (let i = 0; i < 30; i += 1) {
      const row = this.compute(0.5 * (inside.drive + outside));
      if (allowed(row)) {
        inside = row;
      } else {
        outside = row.drive;
      }
    }
    return inside;
  }

  /** Rows around the smallest total between two drives: golden section. */
  private golden(lo: number, hi: number): Row[] {
    if (!(hi - lo > 1e-9 * hi)) {
      return [];
    }
    const ratio = 0.5 * (Math.sqrt(5) - 1);
    let [a, b] = [lo, hi];
    let left = this.compute(b - ratio * (b - a));
    let right = this.compute(a + ratio * (b - a));
    for (let i = 0; i < 24; i += 1) {
      if (left.total_rms < right.total_rms) {
        [b, right] = [right.drive, left];
        left = this.compute(b - ratio * (b - a));
      } else {
        [a, left] = [left.drive, right];
        right = this.compute(a + ratio * (b - a));
      }
    }
    return [left, right];
  }
}
