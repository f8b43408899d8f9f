// Taps of one whisker at one distance, read from the chart: the gauge's strain, K, the arc and the force of the contact at every drive, and
// the strain along the whisker.

import type { FunctionName } from "./baked";
import { distortedLinear, isWhisker, type SignalCurve, type Taper, taperOf, type Whisker } from "./beam";
import { dotted, type Plane, polynomial } from "./chart";
import { Curves, type Rig } from "./rig";

/** Words of a tap; those of the sweep's tables, and what only a chart can say. */
export type Word = "invalid_geometry" | "no_strain" | "slipped_off" | "strain_limit" | "no_root" | "ambiguous" | "outside_calibration" | "outside_chart";

/** What a tap gives. */
export interface Tap {
  /** Signed strain of the gauge; tension is positive. NaN where a moment or a force is read and the gauge lies outside the chart. */
  readonly strain: number;
  /** What the sensor reads: that strain, or the moment (N mm) or the force (N) on the root. */
  readonly signal: number;
  /** K − 1, without unit. */
  readonly deviation: number;
  /** c, mm. */
  readonly arc: number;
  /** P, N. */
  readonly force: number;
  /** T/P; within −μ and μ where the contact sticks. */
  readonly ratio: number;
  readonly words: readonly Word[];
}

/** Weights of T_n for functions that know no place. */
const NOWHERE = Float64Array.from({ length: 64 }, (_, n) => (n === 0 ? 1 : 0));

/** Places, and the step in x/a between them, from which the strain is drawn to the contact. */
const PLACES = 4;
const STEP = 0.05;

/** Taps of a whisker at the distance a, mm. */
export class Contact {
  readonly taper: Taper;
  readonly theory: SignalCurve;
  /** Why there is no tap whatever the drive. */
  readonly void: Word | undefined;
  /** Which number lies outside the chart. */
  readonly outside: string | undefined;
  private readonly model: SignalCurve;
  private readonly linearStrain: number;
  private readonly linearSignal: number;
  /** What distorting sections add to the strain of the gauge, relative to the rod's, at the linear limit. */
  private readonly skinOfGauge: number = 0;
  /** Coefficients over the drive, of each branch. */
  private readonly gauge: readonly Float64Array[] = [];
  private readonly arcs: readonly Float64Array[] = [];
  private readonly forces: readonly Float64Array[] = [];
  private readonly signals: readonly Float64Array[] = [];
  private readonly planes = new Map<FunctionName, readonly Plane[]>();
  private readonly middle: readonly [number, number, number];

  constructor(
    readonly rig: Rig,
    readonly whisker: Whisker,
    readonly a: number,
    curves?: Curves,
  ) {
    const { chart, baked } = rig;
    const { model, theory, read } = curves ?? new Curves(rig, whisker);
    this.taper = taperOf(whisker);
    this.theory = theory;
    this.model = model;
    this.linearStrain = model.value(a);
    this.linearSignal = read.value(a);
    const { tau, x1, x2 } = this.taper;
    const offset = baked.model.pole_radius > 0 ? baked.model.pole_radius : whisker.hub;
    this.middle = [offset / a, whisker.D / a, tau * a];
    if (!isWhisker(whisker) || !(a > 0 && a <= whisker.L_a * (1 + 1e-12))) {
      this.void = "invalid_geometry";
      return;
    }
    if (a <= x1 && rig.reads === "strain") {
      this.void = "no_strain";
      return;
    }
    const outside = [1, 2, 3].map((k) => chart.outside(k, this.middle[k - 1]!));
    // Where the chart is cut next to the contact, what is drawn goes on; what a gauge reads does not.
    const last = chart.axes[4]!.range[1];
    const beyond = x2 / a > last;
    if (beyond && rig.reads === "strain") {
      outside.push(`gauge end x₂/a = ${(x2 / a).toPrecision(3)} > ${Number(last.toPrecision(3))}`);
    }
    this.outside = outside.find((why) => why !== undefined);
    if (this.outside !== undefined) {
      return;
    }
    const fold = (name: FunctionName, weights: Float64Array) => this.plane(name).map((plane) => chart.fold(plane, weights));
    if (!beyond) {
      const { weights, skin } = this.overGauge();
      this.gauge = fold(rig.side(baked.gauge.side), weights);
      this.skinOfGauge = skin;
    }
    if (rig.reads !== "strain") {
      this.signals = fold("signal", NOWHERE);
    }
    this.arcs = fold("arc", NOWHERE);
    this.forces = fold("force", NOWHERE);
  }

  private plane(name: FunctionName): readonly Plane[] {
    let planes = this.planes.get(name);
    if (!planes) {
      planes = this.rig.chart.planes(name, this.middle);
      this.planes.set(name, planes);
    }
    return planes;
  }

  /**
   * Weights of T_n that turn (1 − x/a) δ(x) into δ of the gauge: the mean of ε = θ f(x) (1 + δ(x)) over [x1, x2] by Gauss's points, where
   * f(x) goes as (1 − x/a)/(1 − τx)³; and the same mean of what distorting sections add.
   */
  private overGauge(): { weights: Float64Array; skin: number } {
    const { tau, x1, x2 } = this.taper;
    const places = Math.max(...this.plane(this.rig.side(this.rig.baked.gauge.side)).map((p) => p.places));
    const weights = new Float64Array(places);
    let linear = 0;
    let skin = 0;
    for (const [at, w] of this.rig.baked.gauss) {
      const x = 0.5 * (x1 + x2) + 0.5 * (x2 - x1) * at;
      const weight = w / (1 - tau * x) ** 3;
      linear += weight * (1 - x / this.a);
      skin += weight * this.skin(x);
      this.rig.chart.placeBasis(places, x / this.a).forEach((t, n) => {
        if (n < places) {
          weights[n]! += weight * t;
        }
      });
    }
    return { weights: weights.map((w) => w / linear), skin: skin / linear };
  }

  /** (1 − x/a) times what distorting sections add to the strain at x, relative to the rod's, at the linear limit; it grows as the force does. */
  private skin(x: number): number {
    const { skin } = this.rig.baked.model;
    if (!skin) {
      return 0;
    }
    const [bending, lever] = distortedLinear(skin, this.whisker, x);
    return (1 - x / this.a) * (bending - 1) + lever / this.a;
  }

  /** The drive as the chart has it: rad, or δ/a. */
  private own(drive: number): number {
    const amount = this.rig.amount(drive);
    return this.rig.drive === "angle" ? amount : amount / this.a;
  }

  /** Why a drive (degrees or mm) is outside the chart, or nothing. */
  outsideAt(drive: number): string | undefined {
    const why = this.outside ?? this.rig.chart.outside(0, this.own(drive));
    return this.void ? undefined : why;
  }

  /** The tap at a drive, degrees or mm; only its words where it has no values. */
  at(drive: number): Tap {
    const none = (word: Word): Tap => ({ strain: NaN, signal: NaN, deviation: NaN, arc: NaN, force: NaN, ratio: NaN, words: [word] });
    if (this.void) {
      return none(this.void);
    }
    if (this.outsideAt(drive) !== undefined) {
      return none("outside_chart");
    }
    const { chart, baked } = this.rig;
    const own = this.own(drive);
    const amount = this.rig.amount(drive);
    const scale = own ** chart.power;
    const t = this.rig.drives(own);
    const { shares, ratio } = chart.shares(this.arcs.map((c) => dotted(c, t)));
    const read = (branches: readonly Float64Array[]) => {
      let sum = 0;
      for (let b = 0; b < branches.length; b += 1) {
        sum += shares[b]! * dotted(branches[b]!, t);
      }
      return scale * sum;
    };
    const pressed = 1 + read(this.forces);
    const ofGauge = this.gauge.length > 0 ? read(this.gauge) + pressed * this.skinOfGauge : NaN;
    const delta = this.rig.reads === "strain" ? ofGauge : read(this.signals);
    const arc = this.a * (1 + read(this.arcs));
    const force = this.linearForce(amount) * pressed;
    // K = θ f/ε with ε = θ f_model (1 + δ); both theories differ by their shear only.
    const u2 = 1 / (this.a * this.a);
    const apart = ((this.model.shear - this.theory.shear) * u2) / (1 + this.theory.shear * u2);
    const side = baked.gauge.side === "contact" ? 1 : -1;
    const strain = side * amount * this.linearStrain * (1 + ofGauge);
    const signal = this.rig.reads === "strain" ? strain : (this.linear(drive) * (1 + delta)) / (1 + apart);
    const words: Word[] = [];
    if (arc <= this.taper.x1 && this.rig.reads === "strain") {
      words.push("no_strain");
    }
    if (arc > this.whisker.L_a * (1 + 1e-12)) {
      words.push("slipped_off");
    }
    if (this.rig.reads === "strain" && Math.abs(strain) > baked.gauge.strain_limit) {
      words.push("strain_limit");
    }
    return { strain, signal, deviation: (apart - delta) / (1 + delta), arc, force, ratio, words };
  }

  /** What is read by the theory of the estimate: strain_linear or signal_linear of the tables. A tap pushes the root back. */
  linear(drive: number): number {
    const sign = this.rig.reads === "strain" && this.rig.baked.gauge.side === "contact" ? 1 : -1;
    return sign * this.rig.amount(drive) * this.linearSignal;
  }

  /** P of the linear theory of the model, N. */
  private linearForce(amount: number): number {
    const { D, hub } = this.whisker;
    const { a } = this;
    const reach = this.rig.drive === "angle" ? a + hub : 1;
    const stiffness = (3 * Math.PI * this.rig.baked.model.E_MPa * D ** 4) / 64;
    return (amount * stiffness * (1 - this.taper.tau * a) * reach) / a ** 3 / (1 + this.model.shear / (a * a));
  }

  /**
   * Strain of a side along the whisker, as a function of x (mm) up to the arc of the contact. Beyond the last place of the chart what is
   * left, (1 − x/a)(1 + δ), goes on as a polynomial through the last places. Of the rod itself, or as the skin shows it.
   */
  along(drive: number, side: "contact" | "far", arc: number, of: "skin" | "rod" = "skin"): (x: number) => number {
    const { chart } = this.rig;
    const own = this.own(drive);
    const scale = own ** chart.power;
    const t = this.rig.drives(own);
    const { shares } = chart.shares(this.arcs.map((c) => dotted(c, t)));
    const planes = this.plane(this.rig.side(side)).map((plane) => chart.atDrive(plane, own));
    const c = new Float64Array(Math.max(...planes.map((p) => p.length)));
    planes.forEach((p, b) => p.forEach((value, n) => (c[n]! += shares[b]! * value)));
    const { a, taper, whisker } = this;
    const turned = this.rig.drive === "angle" ? (a + whisker.hub) / a : 1 / a;
    const prefix =
      (this.rig.amount(drive) * 1.5 * whisker.D * (1 - taper.tau * a) * turned) / (a * (1 + this.model.shear / (a * a)));
    const sign = side === "contact" ? 1 : -1;
    const [first, end] = chart.axes[4]!.range;
    const last = Math.min(end, arc / a);
    const pressed = 1 + scale * this.forces.reduce((sum, f, b) => sum + shares[b]! * dotted(f, t), 0);
    const lever = (place: number) => {
      const t = chart.placeBasis(c.length, Math.max(place, first));
      return 1 - place + scale * dotted(c, t) + (of === "skin" ? pressed * this.skin(place * a) : 0);
    };
    const onward = polynomial(Array.from({ length: PLACES }, (_, k) => lever(last - STEP * k)));
    return (x) => {
      const place = x / a;
      if (x >= arc) {
        return 0;
      }
      const left = place <= last ? lever(place) : onward((last - place) / STEP);
      return (sign * prefix * left) / (1 - taper.tau * x) ** 3;
    };
  }
}
