// The linear theory (docs/model.md §2): strain of the gauge per unit of drive, and the distance that gives a strain.

export type Drive = "angle" | "displacement";

/** What the sensor reads: the strain of the gauge, the moment on the root (N mm), the force on it (N). */
export type Signal = "strain" | "moment" | "force";

/** A whisker with its gauge; lengths in mm. */
export interface Whisker {
  readonly D: number;
  readonly d: number;
  readonly L_a: number;
  readonly x_ss: number;
  readonly l: number;
  readonly hub: number;
}

/** τ, tan α, and the span [x1, x2] of the gauge. */
export interface Taper {
  readonly tau: number;
  readonly tan: number;
  readonly x1: number;
  readonly x2: number;
}

export function taperOf(w: Whisker): Taper {
  const tan = (w.D - w.d) / (2 * w.L_a);
  return { tau: (w.D - w.d) / (w.D * w.L_a), tan, x1: w.x_ss, x2: w.x_ss + w.l / Math.hypot(1, tan) };
}

/** R(s), mm. */
export function radius(w: Whisker, s: number): number {
  return 0.5 * w.D * (1 - taperOf(w).tau * s);
}

/** A, p, B, c₁, c₂ of the strain next to the clamp (docs/model.md §8 b). */
export type Skin = readonly [number, number, number, number, number];

/** Strain of the skin at x over the rod's, at the linear limit, of a contact at a: s₀ + s₁/(a − x); [s₀, s₁ in mm] (physics/solid.rs, distorted_linear). */
export function distortedLinear([A, p, B, c1, c2]: Skin, w: Whisker, x: number): [number, number] {
  const { tan } = taperOf(w);
  const near = Math.exp((-p * x) / w.D);
  return [1 - A * near + c2 * tan * tan, B * w.D * near + c1 * tan * radius(w, x)];
}

/** Whether this is a whisker with a gauge on it. */
export function isWhisker(w: Whisker): boolean {
  return [w.D, w.d, w.L_a, w.l].every((x) => x > 0) && w.x_ss >= 0 && w.x_ss + w.l <= w.L_a * (1 + 1e-12);
}

/** S = 3ED²/(16kG), mm². */
export function shearLength2(D: number, nu: number): number {
  return ((7 + 6 * nu) / 16) * D * D;
}

/** Distances of a reading, mm: the largest, the next one, and whether none lies on a widening whisker, or the largest far beyond it. */
export interface Roots {
  readonly far: number;
  readonly near: number | undefined;
  readonly beyond: boolean;
}

const SAMPLES = 48;

/** f of a signal over u = 1/a: value, slope, and its inverse on pieces where it is monotonic. */
export class SignalCurve {
  private readonly t: Taper;
  private readonly b1: number;
  private readonly b2: number;
  private pieces: number[] | undefined;
  private values: number[] = [];

  /** `shear` is S, or 0 for Euler and Bernoulli; `E` the modulus, MPa, on which a strain does not depend. */
  constructor(
    private readonly w: Whisker,
    private readonly drive: Drive,
    readonly shear: number,
    private readonly signal: Signal = "strain",
    private readonly E = 1,
  ) {
    this.t = taperOf(w);
    this.b1 = 1 / (1 - this.t.tau * this.t.x1);
    this.b2 = 1 / (1 - this.t.tau * this.t.x2);
  }

  /** f and df/du at u = 1/a (model §2.2). */
  at(u: number): [number, number] {
    const [p, dp] = this.signal === "strain" ? this.strain(u) : this.atRoot(u);
    const [w, dw] = this.drive === "angle" ? [1 + this.w.hub * u, this.w.hub] : [u, 1];
    const q = p * w;
    const dq = dp * w + p * dw;
    const s = 1 + this.shear * u * u;
    return [q / s, (dq - (q * 2 * this.shear * u) / s) / s];
  }

  /** A signal at the root without lever and shear, and its slope: P = 3πED⁴/64 (u − τ) u, M₀ = P/u. */
  private atRoot(u: number): [number, number] {
    const { tau } = this.t;
    const stiffness = (3 * Math.PI * this.E * this.w.D ** 4) / 64;
    return this.signal === "moment" ? [stiffness * (u - tau), stiffness] : [stiffness * (u - tau) * u, stiffness * (2 * u - tau)];
  }

  /** The same of the strain. */
  private strain(u: number): [number, number] {
    const { tau, x1, x2 } = this.t;
    if (x1 * u >= 1) {
      return [0, 0];
    }
    const quarter = 0.75 * this.w.D;
    let p: number;
    let dp: number;
    if (x2 * u <= 1) {
      const c = quarter * this.b1 * this.b2;
      const m = u - tau;
      const n = this.b1 * (1 - x1 * u) + this.b2 * (1 - x2 * u);
      p = c * m * n;
      dp = c * (n - (x1 * this.b1 + x2 * this.b2) * m);
    } else {
      const c = (quarter * this.b1 * this.b1) / (x2 - x1);
      const m = 1 - x1 * u;
      p = c * m * m;
      dp = -2 * c * x1 * m;
    }
    return [p, dp];
  }

  /** Signal per rad, or per mm, at a mm. */
  value(a: number): number {
    return this.at(1 / a)[0];
  }

  /** df/da. */
  slope(a: number): number {
    return -this.at(1 / a)[1] / (a * a);
  }

  /** Ends of monotonic pieces in u, ascending. */
  private monotonic(): number[] {
    if (this.pieces) {
      return this.pieces;
    }
    const { tau, x1, x2 } = this.t;
    const lo = Math.max(tau, 0);
    const strain = this.signal === "strain";
    const hi = !strain ? 1e3 / this.w.L_a : x1 > 0 ? 1 / x1 : 1e9 / x2;
    const mid = strain ? 1 / x2 : 20 / this.w.L_a;
    const grid: number[] = [];
    for (let i = 0; i < SAMPLES; i += 1) {
      grid.push(lo + (mid - lo) * (i / SAMPLES) ** 2);
    }
    for (let i = 0; i <= SAMPLES; i += 1) {
      grid.push(mid + (hi - mid) * (i / SAMPLES) ** 3);
    }
    const slope = (u: number) => this.at(u)[1];
    const pieces = [lo];
    for (let i = 0; i + 1 < grid.length; i += 1) {
      if (slope(grid[i]!) * slope(grid[i + 1]!) < 0) {
        pieces.push(bracketed(slope, grid[i]!, grid[i + 1]!));
      }
    }
    pieces.push(hi);
    this.pieces = pieces;
    this.values = pieces.map((u) => this.at(u)[0]);
    return pieces;
  }

  /** Distances at which f is `reading` > 0; `guess` mm is near the largest. Nothing above the peak. */
  roots(reading: number, guess: number): Roots | undefined {
    const pieces = this.monotonic();
    const found: number[] = [];
    for (let i = 0; i + 1 < pieces.length && found.length < 2; i += 1) {
      const [lo, hi] = [pieces[i]!, pieces[i + 1]!];
      const miss = (u: number) => this.at(u)[0] - reading;
      const [below, above] = [this.values[i]! - reading, this.values[i + 1]! - reading];
      if (below === 0 || below * above < 0) {
        const first = found.length === 0 ? this.newton(reading, 1 / guess, lo, hi) : undefined;
        const u = first ?? bracketed(miss, lo, hi);
        if (u > 0) {
          found.push(u);
        }
      }
    }
    const [far, near] = found;
    if (far === undefined) {
      return undefined;
    }
    // The strain of a widening whisker levels off above 0.
    const levelsOff = this.signal === "strain" && this.values[0]! > 0;
    const tip = this.w.L_a * (1 + 1e-6);
    const onWhisker = near !== undefined && 1 / near <= tip;
    return {
      far: 1 / far,
      near: near === undefined ? undefined : 1 / near,
      beyond: levelsOff && 1 / far > (onWhisker ? 2 * this.w.L_a : tip),
    };
  }

  /** Newton's method from `u`, within a monotonic piece; nothing where it leaves that. */
  private newton(reading: number, u: number, lo: number, hi: number): number | undefined {
    for (let i = 0; i < 12; i += 1) {
      if (!(u > lo && u < hi)) {
        return undefined;
      }
      const [value, slope] = this.at(u);
      const step = (value - reading) / slope;
      u -= step;
      if (Math.abs(step) <= 1e-15 * u) {
        return u;
      }
      if (Math.abs(step) <= 1e-9 * u && i > 2) {
        return u;
      }
    }
    return undefined;
  }
}

/** Root of f between lo and hi, where its sign changes (Illinois). */
export function bracketed(f: (x: number) => number, lo: number, hi: number): number {
  let [a, b, fa, fb] = [lo, hi, f(lo), f(hi)];
  for (let i = 0; i < 200 && fa !== 0; i += 1) {
    let x = i % 3 === 2 ? 0.5 * (a + b) : b - (fb * (b - a)) / (fb - fa);
    if (!(x > Math.min(a, b) && x < Math.max(a, b))) {
      x = 0.5 * (a + b);
    }
    const fx = f(x);
    if (fx === 0 || Math.abs(b - a) <= 1e-15 * Math.max(Math.abs(a), Math.abs(b))) {
      return x;
    }
    if (fx * fb < 0) {
      [a, fa] = [b, fb];
    } else {
      fa *= 0.5;
    }
    [b, fb] = [x, fx];
  }
  return fa === 0 ? a : b;
}
