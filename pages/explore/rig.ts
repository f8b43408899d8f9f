// What all taps of a page share, and the strain curves of a whisker in it.

import type { Baked, FunctionName } from "./baked";
import { type Drive, shearLength2, type Signal, SignalCurve, type Whisker } from "./beam";
import { basis, type Chart } from "./chart";
import type { Tap } from "./tap";

/** Orders over the drive are fewer. */
const MOST_DRIVES = 24;

/** Everything that the taps of a page share: its chart and its model. */
export class Rig {
  readonly drive: Drive;
  /** What the sensor reads. */
  readonly reads: Signal;
  private last = NaN;
  private lastBasis: Float64Array = new Float64Array(0);

  constructor(
    readonly baked: Baked,
    readonly chart: Chart,
  ) {
    this.drive = baked.drive;
    this.reads = baked.sensor.signal;
  }

  /** S of the model, and of the theory that K and distances are told by. */
  shears(D: number): { model: number; theory: number } {
    const s = shearLength2(D, this.baked.model.nu);
    return {
      model: this.baked.model.shear ? s : 0,
      theory: this.baked.estimate.theory === "timoshenko" ? s : 0,
    };
  }

  /** θ in rad, or δ in mm. */
  amount(drive: number): number {
    return this.drive === "angle" ? (drive * Math.PI) / 180 : drive;
  }

  /** T_i at a drive of the chart, rad or δ/a: the same for many taps in a row. */
  drives(own: number): Float64Array {
    if (own !== this.last) {
      this.last = own;
      this.lastBasis = basis(MOST_DRIVES, this.chart.place(0, own));
    }
    return this.lastBasis;
  }

  /** Whether the contact of a tap sticks: what holds it is less than what slides. */
  sticks(tap: Tap): boolean {
    const { ratios } = this.chart;
    return ratios.length > 1 && Math.abs(tap.ratio) < ratios[ratios.length - 1]!;
  }

  /** The function of a side: that of the contact side where both are mirror images. */
  side(side: "contact" | "far"): FunctionName {
    return this.chart.has(side) ? side : "contact";
  }
}

/** Strain curves of a whisker: of the model's linear limit, and of the theory of the estimate; and the curve of what is read by that theory. */
export class Curves {
  readonly model: SignalCurve;
  readonly theory: SignalCurve;
  readonly read: SignalCurve;

  constructor(rig: Rig, whisker: Whisker) {
    const shears = rig.shears(whisker.D);
    this.model = new SignalCurve(whisker, rig.drive, shears.model);
    this.theory = new SignalCurve(whisker, rig.drive, shears.theory);
    const { sensor, model } = rig.baked;
    this.read = sensor.signal === "strain" ? this.theory : new SignalCurve(whisker, rig.drive, shears.theory, sensor.signal, model.E_MPa);
  }
}
