//! Broyden's method for the two unknowns of a tap.

use vibrissa_kernel::cpu::{Packed, Scalar};
use vibrissa_kernel::rule::limits::{HOPELESS, ROUNDINGS, TINY};

use super::lanes::{Bent, Fixed, Ground, Load};
use super::shot::Shot;
use super::{Solution, Tap};

/// Largest drive (rad, or δ/a) solved directly from the resting whisker; larger ones are reached in strides.
pub const STRIDE: f64 = 0.3;

pub const STEPS: usize = 14;

/// The iteration stops at this share of the tolerance.
pub const STOP: f64 = 0.05;

/// Largest step of the force relative to itself, and of the contact over a.
pub const LONGEST: f64 = 0.5;

/// Finite-difference step of an unknown, as a power of the rounding.
pub const PROBE: f64 = 0.4;

/// Largest deviation of the force at the end of a stride from its extrapolation, relative; beyond it, it may be another branch.
pub const FORESEEN: f64 = 0.5;

/// Jacobian determinant over that at zero load; below this the path may have folded back.
pub const UPRIGHT: f64 = 0.1;

pub const MOST_STRIDES: usize = 32;

/// Floor of P over that of linear theory when its changes are taken relative to it.
pub const LEAST_FORCE: f64 = 1e-6;

/// Weight of the rounding of the contact's place in the error of the strain: next to the gauge the lever is short, and the error large.
pub const LEVERED: f64 = 0.5;

/// Least c/a, and largest.
pub const ARCS: [f64; 2] = [0.05, 3.0];

/// Safety factor on integration errors: the estimate is of one shot at its load.
pub const WARY: f64 = 3.0;

/// The relative error estimate e of y counts as e (ACROSS e)^¼, less than e below 1e-4 (see `close`).
pub const ACROSS: f64 = 1e4;

pub fn strides(tap: &Tap<'_>) -> usize {
    let amount = tap.turn.max(tap.lift / tap.a);
    (1..MOST_STRIDES).find(|n| amount <= STRIDE * *n as f64).unwrap_or(MOST_STRIDES)
}

/// An iteration has contracted if its last step is shorter than this.
pub fn contracted(tolerance: f64, rounding: f64) -> f64 {
    (2.0 * STOP * tolerance).max(1e3 * rounding)
}

/// End of an iteration; one with more steps starts from it.
#[derive(Debug, Clone, Copy)]
pub struct End<P> {
    z: [P; 2],
    jacobian: Matrix<P>,
    begun: P,
}

pub struct Solved<P> {
    strain: P,
    load: Load<P>,
    wrench: [P; 3],
    error: P,
    burden: P,
    shots: P,
    end: End<P>,
}

impl<P: Packed> Solved<P> {
    pub fn end(&self, i: usize) -> Option<End<f64>> {
        let of = |x: P| x.lane(i);
        let End { z, jacobian, begun } = self.end;
        (of(self.error) < 1.0).then(|| End {
            z: z.map(of),
            jacobian: jacobian.map(|column| column.map(of)),
            begun: of(begun),
        })
    }

    pub fn lane(&self, i: usize) -> Solution {
        let of = |x: P| x.lane(i);
        let error = of(self.error);
        Solution {
            strain: of(self.strain),
            normal: of(self.load.normal),
            tangential: of(self.load.tangential),
            arc: of(self.load.arc),
            wrench: self.wrench.map(of),
            error: if error.is_nan() { f64::INFINITY } else { error },
            load: of(self.burden),
            shots: of(self.shots),
        }
    }
}

impl<P: Packed> End<P> {
    pub fn of<'a>(lane: impl Fn(usize) -> &'a End<f64>) -> Self {
        let pack = |f: &dyn Fn(&End<f64>) -> f64| P::gather(|i| f(lane(i)));
        Self {
            z: std::array::from_fn(|k| pack(&|end| end.z[k])),
            jacobian: std::array::from_fn(|k| std::array::from_fn(|m| pack(&|end| end.jacobian[k][m]))),
            begun: pack(&|end| end.begun),
        }
    }
}

impl<P: Packed> Ground<P> {
    /// Units in which changes of the unknowns are measured: P, and c in a, or T in the contact force.
    #[inline(always)]
    fn scale(&self, z: [P; 2]) -> [P; 2] {
        let force = z[0].abs().max(P::of(LEAST_FORCE));
        [force, if self.effects.stick { force + z[1].abs() } else { P::of(1.0) }]
    }
}

/// Columns: derivatives of the miss and of the gauge's fibre integral by each unknown.
type Matrix<P> = [[P; 3]; 2];

impl<P: Packed> Shot<P> {
    #[inline(always)]
    fn seen(&self) -> [P; 3] {
        [self.miss[0], self.miss[1], self.bent.state[3]]
    }
}

#[inline(always)]
fn determinant<P: Packed>(j: &Matrix<P>) -> P {
    j[0][0] * j[1][1] - j[1][0] * j[0][1]
}

#[inline(always)]
fn step<P: Packed>(j: &Matrix<P>, miss: [P; 2]) -> [P; 2] {
    let inverse = P::of(-1.0) / determinant(j);
    [inverse * (j[1][1] * miss[0] - j[1][0] * miss[1]), inverse * (j[0][0] * miss[1] - j[0][1] * miss[0])]
}

/// The larger of these changes in units of `scale`; and the same or the change of the fibre over `measure`, whichever is larger.
#[inline(always)]
fn largest<P: Packed>(j: &Matrix<P>, [x, y]: [P; 2], scale: [P; 2], measure: P) -> [P; 2] {
    let size = (x / scale[0]).abs().max((y / scale[1]).abs());
    [size, size.max(((j[0][2] * x).abs() + (j[1][2] * y).abs()) / measure)]
}

#[inline(always)]
fn measure<P: Packed>(least: P, fibre: P) -> P {
    least.max(fibre.abs()).max(P::of(TINY))
}

/// Bounds on the changes of both unknowns by errors of the miss of these sizes.
#[inline(always)]
fn owed<P: Packed>(j: &Matrix<P>, [x, y]: [P; 2]) -> [P; 2] {
    let inverse = P::of(1.0) / determinant(j).abs().max(P::of(TINY));
    [inverse * (j[1][1].abs() * x + j[1][0].abs() * y), inverse * (j[0][0].abs() * y + j[0][1].abs() * x)]
}

#[inline(always)]
pub fn close<P: Packed>(
    fixed: &Fixed<P::Scalar>,
    ground: &Ground<P>,
    tolerance: f64,
    start: Option<End<P>>,
) -> Solved<P> {
    let of = P::of;
    let (zero, one) = (of(0.0), of(1.0));
    let rounding = P::Scalar::ROUNDING;
    let stop = of((STOP * tolerance).max(4.0 * rounding));
    let strides = if start.is_some() { 1 } else { ground.strides };
    let probe = rounding.powf(PROBE);
    let width = ground.gauge[1] - ground.gauge[0];
    let least = ground.least * width;
    let (mut z, mut before) = ([zero, zero], [zero, zero]);
    let mut shots = zero;
    // Positive where Newton left the branch or diverged.
    let mut lost = zero;
    let mut owing = zero;
    let mut jacobian = [[zero; 3]; 2];
    // Jacobian determinant at zero load (sliding contact).
    let mut begun = (ground.turn * (ground.a + ground.hub) + ground.lift) / ground.a;
    let mut shot = Shot::default();
    for stride in 1..=strides {
        let share = of(stride as f64 / strides as f64);
        let last = stride == strides;
        let guess = match (stride, &start) {
            (1, Some(end)) => end.z,
            (1, None) => [share, zero],
            (2, _) => [z[0] + z[0], of(4.0) * z[1]],
            _ => [z[0] + (z[0] - before[0]), z[1] + (z[1] - before[1])],
        };
        (before, z) = (z, guess);
        shot = ground.shoot(fixed, share, z, last);
        shots = shots + one;
        if let Some(end) = &start {
            (jacobian, begun) = (end.jacobian, end.begun);
        } else {
            let scale = ground.scale(z);
            for k in 0..2 {
                let change = scale[k] * of(probe);
                let mut moved = z;
                moved[k] = z[k] + change;
                let change = moved[k] - z[k];
                let other = ground.shoot(fixed, share, moved, false);
                let (other, here) = (other.seen(), shot.seen());
                for m in 0..3 {
                    jacobian[k][m] = (other[m] - here[m]) / change;
                }
            }
            shots = shots + of(2.0);
            if ground.effects.stick && stride == 1 {
                begun = determinant(&jacobian);
            }
        }
        // Positive in lanes that have converged; these keep their unknowns.
        let mut done = zero;
        let mut remains = of(1e30);
        owing = remains;
        for _ in 0..STEPS {
            let wanted = step(&jacobian, shot.miss);
            let scale = ground.scale(z);
            let [size, of_strain] = largest(&jacobian, wanted, scale, measure(least, shot.bent.state[3]));
            remains = zero.if_less(done, remains, size);
            owing = zero.if_less(done, owing, of_strain);
            done = of_strain.if_less(stop, one, done);
            if one.all_at_most(done) {
                break;
            }
            let damped = one.min(of(LONGEST) / size.max(of(TINY)));
            let mut next = [z[0] + damped * wanted[0], z[1] + damped * wanted[1]];
            if !ground.effects.stick {
                next[1] = next[1].max(of(ARCS[0] - 1.0)).min(of(ARCS[1] - 1.0));
            }
            for k in 0..2 {
                next[k] = zero.if_less(done, z[k], next[k]);
            }
            let taken = [next[0] - z[0], next[1] - z[1]];
            let fresh = ground.shoot(fixed, share, next, last);
            shots = shots + zero.if_less(done, zero, one);
            let weighted = [taken[0] / (scale[0] * scale[0]), taken[1] / (scale[1] * scale[1])];
            let length = taken[0] * weighted[0] + taken[1] * weighted[1];
            let inverse = zero.if_less(length, one / length.max(of(TINY * TINY)), zero);
            let (there, here) = (fresh.seen(), shot.seen());
            for m in 0..3 {
                let lack = there[m] - here[m] - jacobian[0][m] * taken[0] - jacobian[1][m] * taken[1];
                for k in 0..2 {
                    jacobian[k][m] = jacobian[k][m] + lack * weighted[k] * inverse;
                }
            }
            (z, shot) = (next, fresh);
        }
        lost = remains.if_less(of(contracted(tolerance, rounding)), lost, one);
        lost = of(UPRIGHT).if_less(determinant(&jacobian) / begun, lost, one);
        let off = (z[0] - guess[0]).abs();
        lost = off.if_less(of(FORESEEN) * z[0].abs().max(guess[0].abs()).max(share), lost, one);
    }
    let Bent { state, errors, load: burden, beyond } = shot.bent;
    let strain = state[3] / width;
    let measure = measure(least, state[3]);
    let relative = |error: P, of: P| error / of.max(P::of(TINY));
    // y is a double integral; its error estimate of order 5 is 500 to 2 000 times too large. The power 5/4 leaves a margin of 1 to some 100.
    let across = errors[1] * (of(ACROSS) * relative(errors[1], state[2].abs())).sqrt().sqrt();
    let missed = [errors[0] * state[2].abs() / ground.a, errors[0] + across / ground.a];
    let (owed, scale) = (owed(&jacobian, missed), ground.scale(z));
    let [_, of_strain] = largest(&jacobian, owed, scale, measure);
    let unsure = (owed[0] / scale[0] + owed[1] / scale[1]).max(of_strain);
    let integrated = relative(errors[0], state[0].abs()) + relative(errors[2], measure) + unsure;
    // Change of the strain with the place of the contact. Where that sticks, it is not an unknown: strain over lever.
    let arc = shot.load.arc;
    let lever = arc - of(0.5) * (ground.gauge[0] + ground.gauge[1].min(arc));
    let shown = match ground.effects.stick {
        true => zero.if_less(lever, arc * state[3].abs() / lever.max(of(TINY)), zero),
        false => jacobian[1][2].abs(),
    };
    let rounded = one + of(LEVERED) * shown / measure;
    let mut error = of(WARY) * integrated + owing + of(ROUNDINGS * rounding) * rounded;
    if let Some(law) = &fixed.law {
        error = error + of(2.0 * law.error);
    }
    error = zero.if_less(lost, of(1e30), error);
    error = one.if_less(beyond, of(HOPELESS), error);
    Solved {
        strain,
        load: shot.load,
        wrench: shot.wrench,
        error,
        burden,
        shots,
        end: End { z, jacobian, begun },
    }
}
