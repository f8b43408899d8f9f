//! Distance and tilt from the strains of two gauges (model §6.4), for a known lean of the pole: Newton's method in both, with coarse differences of
//! the smooth shares ε/(θ f cos β).

use crate::design::{Design, radians};
use crate::error::SolveError;
use crate::estimate::{Estimated, Estimator};
use crate::evaluate::{Evaluator, Outcome, Referral, Task};
use crate::scene::{Contact, Direction, Setup, Side, Theory};
use crate::status::Status;

/// Largest |tilt| of the search, degrees.
const STEEPEST: f64 = 85.0;
/// Taps per evaluation of strains and slopes; until the last rounds the first `AIMING` suffice.
pub const TAPS: usize = 5;
const AIMING: usize = 3;
const ROUNDS: usize = 12;
/// Steps of the difference quotients: of a, relative; of the tilt, degrees.
const STEPS: [f64; 2] = [3e-3, 0.2];
/// Longest step of a round: of a, relative; of the tilt, degrees.
const LONGEST: [f64; 2] = [0.25, 15.0];
/// Changes at which the search ends: of a, relative, and of the tilt, degrees; or this multiple of the strain tolerance (relative, rad) if larger.
const STILL: ([f64; 2], f64) = ([2e-7, 1e-5], 0.1);
const SAME: f64 = 1e-3;
/// Margin around the range of interest within which f's near root starts a search for the model's.
const NEARBY: f64 = 0.25;
const TOGETHER: usize = 1 << 13;

/// True if the model itself gives distances from two strains.
pub fn asked(setup: &Setup) -> bool {
    setup.gauge.second && setup.estimate.theory == Theory::Exact
}

/// Why the model cannot give a distance and a tilt from two strains; `None` if it can.
pub fn forbids(contact: Contact) -> Option<&'static str> {
    match contact {
        Contact::Frictionless | Contact::Coulomb(0.0) => None,
        Contact::Stick => Some(
            "with contact = \"stick\" the whisker bends in the plane of rotation whatever the tilt: two strains tell no more than one",
        ),
        Contact::Coulomb(_) => Some(
            "with contact = { coulomb = … } there is no model of tilted edges, from which two strains could tell the tilt",
        ),
    }
}

/// True if the model itself can give distances for `setup`: from one strain always, from several channels never.
pub fn possible(setup: &Setup) -> bool {
    setup.channels.is_none() && (!setup.gauge.second || forbids(setup.model.contact).is_none())
}

/// Maps the strains of the centreline, the first gauge and the second to two readings, linearly.
pub type Reading<'r> = &'r dyn Fn([f64; 3]) -> [f64; 2];

/// The start of the search for a tap, and its two readings, r₁ > 0 and r₂.
pub type TwoReadings = (Task, [f64; 2]);

/// The tap of two readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inverted {
    /// The tap.
    pub task: Task,
    /// Rows: d r₁, d r₂; columns: da (mm), dβ (rad).
    pub slopes: [[f64; 2]; 2],
}

/// Inverts the model of some designs.
pub struct Inverter<'e, 'a> {
    /// The setup of all taps.
    pub setup: &'e Setup,
    /// Solves them.
    pub evaluator: &'e mut Evaluator<'a>,
    /// The taps that it leaves to the reference.
    pub referral: Referral,
    /// The whiskers.
    pub designs: &'e [Design],
    /// The readings.
    pub reading: Reading<'e>,
    /// Taps solved so far.
    pub taps: u64,
}

type Seen = ([f64; 2], [[f64; 2]; 2]);

impl Inverter<'_, '_> {
    /// Readings and slopes at `tasks`, each from `taps` taps; `None` where the model has none.
    fn seen(&mut self, tasks: &[Task], taps: usize) -> Result<Vec<Option<Seen>>, SolveError> {
        let around: Vec<Task> =
            tasks.iter().flat_map(|task| self.around(*task).into_iter().take(taps)).collect();
        self.taps += around.len() as u64;
        let outcomes = self.evaluator.run_referring(self.designs, &around, self.referral)?;
        let one = |(taps, outcomes): (&[Task], &[Outcome])| self.seen_around(taps, outcomes);
        Ok(around.chunks_exact(taps).zip(outcomes.chunks_exact(taps)).map(one).collect())
    }

    fn seen_around(&self, taps: &[Task], outcomes: &[Outcome]) -> Option<Seen> {
        let (setup, reading) = (self.setup, self.reading);
        let curve = &self.designs[taps[0].design as usize].shared.as_ref()?.model;
        // Shares of θ f cos β of ε₀, ε₁, ε₂, less 0, cos β, sin β.
        let shares = |k: usize| {
            let (sin, cos) = radians(taps[k].direction)[0].sin_cos();
            let unit = taps[k].driven(setup).size() * curve.value(taps[k].a) * cos;
            strains(setup, &outcomes[k])
                .map(|[axial, e1, e2]| [axial / unit, e1 / unit - cos, e2 / unit - sin])
        };
        let here = shares(0)?;
        // A parabola through two neighbours, or the chord to one.
        let slope = |k: usize, step: &dyn Fn(usize) -> f64| {
            let beside = [k, k + 2].into_iter().filter(|i| *i < taps.len());
            let mut there = beside.filter_map(|i| Some((step(i), shares(i)?)));
            let (h, one) = there.next()?;
            let chord = |f: usize| (one[f] - here[f]) / h;
            let Some((g, more)) = there.next() else { return Some([0, 1, 2].map(chord)) };
            Some([0, 1, 2].map(|f| (chord(f) * g - (more[f] - here[f]) / g * h) / (g - h)))
        };
        let by_a = slope(1, &|i| taps[i].a - taps[0].a)?;
        let by_tilt = slope(2, &|i| radians(taps[i].direction)[0] - radians(taps[0].direction)[0])?;
        let (sin, cos) = radians(taps[0].direction)[0].sin_cos();
        let of_unit = taps[0].driven(setup).size() * cos;
        let (f, slope) = (of_unit * curve.value(taps[0].a), of_unit * curve.slope(taps[0].a));
        let (whole, turn) = ([here[0], here[1] + cos, here[2] + sin], [0.0, -sin, cos]);
        let along = reading([0, 1, 2].map(|k| slope * whole[k] + f * by_a[k]));
        let across = reading([0, 1, 2].map(|k| f * (turn[k] + by_tilt[k] - sin / cos * whole[k])));
        let slopes = [[along[0], across[0]], [along[1], across[1]]];
        Some((reading(whole.map(|share| f * share)), slopes))
    }

    /// A tap, one at another distance, one at another tilt, and one more of each.
    fn around(&self, task: Task) -> [Task; TAPS] {
        let (step, tip) = (STEPS[0] * task.a, self.designs[task.design as usize].tuple.L_a);
        let kink = self.designs[task.design as usize].shared.as_ref().map_or(0.0, |shared| shared.gauge[1]);
        // Not across the far end of the gauge, where the strain has a kink, nor beyond the tip.
        let [one, more] = match () {
            () if task.a >= kink && task.a - step < kink => [step, 2.0 * step],
            () if task.a + step > tip => [-step, -2.0 * step],
            () => [-step, step],
        };
        let turn = if task.direction.tilt > 0.0 { -STEPS[1] } else { STEPS[1] };
        let other = |by: f64| moved(task, [by, 0.0]);
        let turned = |by: f64| moved(task, [0.0, by]);
        [task, other(one), turned(turn), other(more), turned(-turn)]
    }

    /// The taps of `asked`, each between the distances of `reach`, mm, of its design; `None` where none is found.
    pub fn invert(
        &mut self,
        asked: &[TwoReadings],
        reach: &dyn Fn(u32) -> [f64; 2],
    ) -> Result<Vec<Option<Inverted>>, SolveError> {
        let room = 1.0 + 2.0 * STEPS[0];
        let reach = &|design: u32| {
            let [near, far] = reach(design);
            [near * room, far]
        };
        let allowed = STILL.1 * self.evaluator.tolerance();
        let still = [STILL.0[0].max(allowed), STILL.0[1].max(allowed.to_degrees())];
        let mut found = vec![None; asked.len()];
        let begin =
            |(i, (start, _)): (usize, &TwoReadings)| Trial { i, at: within(*start, reach), step: [0.0; 2] };
        let mut open: Vec<Trial> = asked.iter().enumerate().map(begin).collect();
        for _ in 0..ROUNDS {
            if open.is_empty() {
                break;
            }
            let tasks: Vec<Task> = open.iter().map(|trial| trial.at).collect();
            let seen = self.seen(&tasks, AIMING)?;
            let mut rest = Vec::new();
            for (mut trial, seen) in open.into_iter().zip(seen) {
                let Some((here, slopes)) = seen else {
                    // No such tap: go half the way back.
                    if trial.step != [0.0; 2] {
                        trial.step = trial.step.map(|s| 0.5 * s);
                        trial.at = moved(trial.at, trial.step.map(|s| -s));
                        rest.push(trial);
                    }
                    continue;
                };
                let (_, target) = asked[trial.i];
                let Some([da, tilt]) = solve(slopes, [target[0] - here[0], target[1] - here[1]]) else {
                    continue;
                };
                let step = [da, tilt.to_degrees()];
                let sizes = [step[0].abs() / trial.at.a, step[1].abs()];
                if sizes[0] <= still[0] && sizes[1] <= still[1] {
                    found[trial.i] = Some(Inverted { task: moved(trial.at, step), slopes });
                    continue;
                }
                let share = (LONGEST[0] / sizes[0]).min(LONGEST[1] / sizes[1]).min(1.0);
                let next = within(moved(trial.at, step.map(|s| share * s)), reach);
                trial.step = [next.a - trial.at.a, next.direction.tilt - trial.at.direction.tilt];
                trial.at = next;
                if trial.step != [0.0; 2] {
                    rest.push(trial);
                }
            }
            open = rest;
        }
        Ok(found)
    }
}

struct Trial {
    i: usize,
    at: Task,
    /// The step that led there: mm and degrees.
    step: [f64; 2],
}

fn moved(at: Task, [a, tilt]: [f64; 2]) -> Task {
    let direction = Direction { tilt: at.direction.tilt + tilt, ..at.direction };
    Task { a: at.a + a, direction, ..at }
}

fn within(at: Task, reach: &impl Fn(u32) -> [f64; 2]) -> Task {
    let [near, far] = reach(at.design);
    let direction = Direction { tilt: at.direction.tilt.clamp(-STEEPEST, STEEPEST), ..at.direction };
    Task { a: at.a.max(near).min(far), direction, ..at }
}

/// Strains of a tap: of the centreline, of the first gauge, and of the second, 90° further; all signed as the first. `None` where the model has none.
pub fn strains(setup: &Setup, outcome: &Outcome) -> Option<[f64; 3]> {
    let sign = if setup.gauge.side == Side::Far { -1.0 } else { 1.0 };
    let strains = [outcome.axial, outcome.strain, outcome.strain_2].map(|e| sign * e);
    let there = strains[1].is_finite() && strains[2].is_finite() && !outcome.status.has(Status::NO_STRAIN);
    there.then_some(strains)
}

/// Inverse of a 2 × 2 matrix, given by rows; `None` of a singular one.
pub fn inverse([[a, b], [c, d]]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = a * d - b * c;
    let inverse = [[d / determinant, -b / determinant], [-c / determinant, a / determinant]];
    inverse.iter().flatten().all(|x| x.is_finite()).then_some(inverse)
}

fn solve(slopes: [[f64; 2]; 2], [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let solved = inverse(slopes)?.map(|[p, q]| p * x + q * y);
    solved.iter().all(|s| s.is_finite()).then_some(solved)
}

/// The estimate from two strains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Both {
    /// â, mm.
    a: f64,
    /// Strain of one gauge, of two equal and independent ones, that moves â by 1 mm.
    slope: f64,
    /// Another distance with the same strains, mm.
    other: Option<f64>,
    /// True if the strains grow with the distance, and no farther distance with the same strains is known.
    near: bool,
}

impl Both {
    /// The distance, with the noise and the range of interest of `by`.
    pub fn estimate(&self, by: &Estimator<'_>) -> Estimated {
        by.estimated(self.a, self.slope, self.other, self.near)
    }
}

/// A tap whose distance is to be estimated from its strains.
#[derive(Debug, Clone, Copy)]
pub struct Ask {
    /// The tap, of the design whose model is used.
    pub tap: Task,
    /// Its strains; `None` without any.
    pub strains: Option<[f64; 2]>,
    /// True if it is a tap of this very whisker: then the model gives its distance and tilt exactly.
    pub own: bool,
    /// Smallest and largest distance of the whisker's taps, mm.
    pub reach: [f64; 2],
}

impl Ask {
    /// The tap of an `outcome`, by the model of its whisker.
    pub fn own(setup: &Setup, tap: Task, outcome: &Outcome, reach: [f64; 2]) -> Self {
        Self { tap, strains: strains(setup, outcome).map(|[_, e1, e2]| [e1, e2]), own: true, reach }
    }
}

/// The estimate for each of `asks`, and the number of taps solved. Empty unless the model gives distances from two strains.
pub fn both(
    setup: &Setup,
    (evaluator, referral): (&mut Evaluator<'_>, Referral),
    designs: &[Design],
    asks: &[Ask],
) -> Result<(Vec<Option<Both>>, u64), SolveError> {
    if !asked(setup) {
        return Ok((Vec::new(), 0));
    }
    evaluator.unguarded(|evaluator| {
        let reading: Reading<'_> = &|[_, e1, e2]| [e1, e2];
        let mut inverter = Inverter { setup, evaluator, referral, designs, reading, taps: 0 };
        let mut all = Vec::with_capacity(asks.len());
        for asks in asks.chunks(TOGETHER) {
            all.extend(inverter.answers(asks)?);
        }
        Ok((all, inverter.taps))
    })
}

impl Inverter<'_, '_> {
    fn answers(&mut self, asks: &[Ask]) -> Result<Vec<Option<Both>>, SolveError> {
        let designs = self.designs;
        let reach = |design: u32| {
            let Design { tuple, shared, .. } = &designs[design as usize];
            [shared.as_ref().map_or(tuple.L_a, |shared| shared.gauge[0]), tuple.L_a]
        };
        let whisker = |ask: &Ask| designs[ask.tap.design as usize].shared.is_some();
        let open: Vec<usize> =
            (0..asks.len()).filter(|&i| asks[i].strains.is_some() && whisker(&asks[i])).collect();
        let (own, blind): (Vec<usize>, Vec<usize>) = open.iter().partition(|&&i| asks[i].own);
        let mut found: Vec<Option<Inverted>> = vec![None; asks.len()];
        let tasks: Vec<Task> = own.iter().map(|&i| asks[i].tap).collect();
        for ((&i, task), seen) in own.iter().zip(&tasks).zip(self.seen(&tasks, TAPS)?) {
            found[i] = seen.map(|(_, slopes)| Inverted { task: *task, slopes });
        }
        let asked = |&i: &usize| Some((asks[i].tap, asks[i].strains?));
        let starts: Vec<TwoReadings> = blind.iter().filter_map(asked).collect();
        for (&i, inverted) in blind.iter().zip(self.invert(&starts, &reach)?) {
            found[i] = inverted;
        }
        // On the other side of the peak there may be a tap with the same strains.
        let again = |&i: &usize| {
            let start = self.across(&asks[i], &found[i]?)?;
            Some((i, (start, asks[i].strains?)))
        };
        let (places, starts): (Vec<usize>, Vec<TwoReadings>) = open.iter().filter_map(again).unzip();
        let mut others: Vec<Option<Inverted>> = vec![None; asks.len()];
        for (&i, inverted) in places.iter().zip(self.invert(&starts, &reach)?) {
            others[i] = inverted;
        }
        let taken = |(found, other): (&Option<Inverted>, &Option<Inverted>)| {
            let both = taken(found.as_ref()?, other.as_ref())?;
            let shared = designs[found.as_ref()?.task.design as usize].shared.as_ref();
            let alone = both.near && shared.is_some_and(|shared| shared.theory.alone(both.a));
            Some(Both { near: both.near && !alone, ..both })
        };
        Ok(found.iter().zip(&others).map(taken).collect())
    }

    /// Start of the search for the other tap with the strains of `found`, if it matters: f's other root.
    fn across(&self, ask: &Ask, found: &Inverted) -> Option<Task> {
        let theory = &self.designs[found.task.design as usize].shared.as_ref()?.theory;
        let (a, peak) = (found.task.a, theory.peak().0);
        let roots = theory.roots(theory.curve().value(a))?;
        let [near, far] = [roots.near.unwrap_or(roots.far), roots.far];
        // Next to the peak of f the model's peak may be on the other side.
        let mirrored = 2.0 * peak - a;
        let beyond = |root: f64| if (root - a).abs() > SAME * a { root } else { mirrored };
        let start = if rises(found) { beyond(far).max(a) } else { beyond(near).min(a) };
        let [least, _] = self.setup.estimate.range.unwrap_or(ask.reach);
        let wanted = start > 0.0 && (rises(found) || start > least * (1.0 - NEARBY));
        wanted.then_some(Task { a: start, ..found.task })
    }
}

/// True if the reading grows with the distance: before the peak.
fn rises(found: &Inverted) -> bool {
    found.slopes[0][0] > 0.0
}

fn taken(found: &Inverted, other: Option<&Inverted>) -> Option<Both> {
    let apart = |other: &&Inverted| (other.task.a - found.task.a).abs() > SAME * found.task.a;
    let other = other.filter(|other| rises(other) != rises(found)).filter(apart);
    let (far, near) = match (rises(found), other) {
        (true, Some(far)) => (far, Some(found.task.a)),
        (_, near) => (found, near.map(|near| near.task.a)),
    };
    let [of_a, _] = inverse(far.slopes)?;
    Some(Both { a: far.task.a, slope: 1.0 / of_a[0].hypot(of_a[1]), other: near, near: rises(far) })
}
