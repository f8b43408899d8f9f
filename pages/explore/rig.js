// What all taps of a page share, and the strain curves of a whisker in it.
import { shearLength2, SignalCurve } from "./beam";
import { basis } from "./chart";
/** Orders over the drive are fewer. */
const MOST_DRIVES = 24;
/** Everything that the taps of a page share: its chart and its model. */
export class Rig {
    baked;
    chart;
    drive;
    /** What the sensor reads. */
    reads;
    last = NaN;
    lastBasis = new Float64Array(0);
    constructor(baked, chart) {
        this.baked = baked;
        this.chart = chart;
        this.drive = baked.drive;
        this.reads = baked.sensor.signal;
    }
    /** S of the model, and of the theory that K and distances are told by. */
    shears(D) {
        const s = shearLength2(D, this.baked.model.nu);
        return {
            model: this.baked.model.shear ? s : 0,
            theory: this.baked.estimate.theory === "timoshenko" ? s : 0,
        };
    }
    /** θ in rad, or δ in mm. */
    amount(drive) {
        return this.drive === "angle" ? (drive * Math.PI) / 180 : drive;
    }
    /** T_i at a drive of the chart, rad or δ/a: the same for many taps in a row. */
    drives(own) {
        if (own !== this.last) {
            this.last = own;
            this.lastBasis = basis(MOST_DRIVES, this.chart.place(0, own));
        }
        return this.lastBasis;
    }
    /** Whether the contact of a tap sticks: what holds it is less than what slides. */
    sticks(tap) {
        const { ratios } = this.chart;
        return ratios.length > 1 && Math.abs(tap.ratio) < ratios[ratios.length - 1];
    }
    /** The function of a side: that of the contact side where both are mirror images. */
    side(side) {
        return this.chart.has(side) ? side : "contact";
    }
}
/** Strain curves of a whisker: of the model's linear limit, and of the theory of the estimate; and the curve of what is read by that theory. */
export class Curves {
    model;
    theory;
    read;
    constructor(rig, whisker) {
        const shears = rig.shears(whisker.D);
        this.model = new SignalCurve(whisker, rig.drive, shears.model);
        this.theory = new SignalCurve(whisker, rig.drive, shears.theory);
        const { sensor, model } = rig.baked;
        this.read = sensor.signal === "strain" ? this.theory : new SignalCurve(whisker, rig.drive, shears.theory, sensor.signal, model.E_MPa);
    }
}
