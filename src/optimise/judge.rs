//! From the solved taps of candidates, and of whiskers sampled around them, to scores.

use super::samples;
use super::score::{Limit, Score};
use crate::chart::lanes::Figures;
use crate::design::{Design, amount};
use crate::estimate::Estimator;
use crate::evaluate::{Outcome, Task};
use crate::physics::taper::Taper;
use crate::profile::{
    Profile, Reach,
    both::{self, Both},
};
use crate::reduce::Spread;
use crate::scene::search::{Calibrated, Robust, Search};
use crate::scene::{COLUMNS, Column, Convention, Direction, Setup, Theory, Tuple};
use crate::statistics::{DriveRow, Reduction, Told};
use crate::status::Status;

/// What turns solved taps into scores.
pub(super) struct Judge<'a> {
    pub setup: &'a Setup,
    pub search: &'a Search,
    pub distances: Vec<f64>,
    pub reach: [f64; 2],
    pub deviations: Vec<[f64; COLUMNS]>,
}

impl Judge<'_> {
    /// Whether each sampled whisker is calibrated at upright poles, and judged at poles whose direction it does not know.
    pub fn blind(&self) -> bool {
        let each = self.search.robust.as_ref().filter(|r| r.calibrated == Calibrated::Each);
        !self.deviations.is_empty() && each.is_some_and(Robust::tilts)
    }

    /// Whisker `w` of a point: the nominal one, or a sampled one.
    pub fn whisker(&self, point: &Tuple, w: usize) -> Tuple {
        let (Some(robust), Some(sample)) = (&self.search.robust, w.checked_sub(1)) else { return *point };
        let (mut values, z) = (point.to_array(), &self.deviations[sample]);
        for ((value, sd), z) in values.iter_mut().zip(&robust.sd).zip(z) {
            // A gauge bonded at the clamp cannot lie before it.
            *value += sd * z;
        }
        let place = &mut values[Column::GaugePosition as usize];
        *place = place.max(0.0);
        Tuple::from_array(values)
    }

    /// Where the model's own curve of whisker `w` of a point is wanted, which taps a pole of this direction, if it is.
    pub fn reach_of(&self, w: usize, direction: Direction) -> Option<Reach> {
        if self.setup.estimate.theory != Theory::Exact {
            return None;
        }
        let robust = self.search.robust.as_ref().filter(|_| !self.deviations.is_empty());
        let nominal = robust.is_some_and(|r| r.calibrated == Calibrated::Nominal);
        match (nominal, self.search.limits.unambiguous) {
            (true, _) if w == 0 => Some(Reach::Whole(self.reach)),
            (false, _) if !direction.is_upright() => Some(Reach::Whole(self.reach)),
            (_, true) => Some(Reach::Peak(self.reach)),
            (true, false) => None,
            (false, false) => Some(Reach::Asked(self.reach)),
        }
    }

    /// What two strains of `tap` are told by: the model of the whisker itself or, where so calibrated, of the nominal one among the `whiskers` of its
    /// candidate. The lean is the nominal one's in both.
    pub fn ask(&self, designs: &[Design], whiskers: usize, tap: Task, outcome: &Outcome) -> both::Ask {
        let mine = both::Ask::own(self.setup, tap, outcome, self.reach);
        let nominal = tap.design - tap.design % whiskers as u32;
        let lean = designs[nominal as usize].tuple.lean;
        let direction = Direction { lean, ..tap.direction };
        let robust = self.search.robust.as_ref().filter(|_| tap.design != nominal);
        match robust.map(|r| r.calibrated) {
            Some(Calibrated::Nominal) => {
                let drive = designs[nominal as usize].tuple.drive;
                both::Ask { tap: Task { design: nominal, direction, drive, ..tap }, own: false, ..mine }
            }
            Some(Calibrated::Each) if lean != tap.direction.lean => {
                both::Ask { tap: Task { direction, ..tap }, own: false, ..mine }
            }
            _ => mine,
        }
    }

    /// Score of one candidate: its nominal whisker, then the sampled ones; `own` are the model's own curves, where distances are told by
    /// them, and `both` what the model takes two strains for; `upright`: the taps at upright poles by which each of the sampled ones is calibrated,
    /// where it is [`Self::blind`].
    pub fn score(
        &self,
        designs: &[Design],
        (taps, upright): (&[Outcome], &[Outcome]),
        (own, both): (&[Option<Profile>], &[Option<Both>]),
    ) -> Score {
        let n = self.distances.len();
        let both = |w: usize| both.get(w * n..(w + 1) * n).unwrap_or_default();
        let nominal = Read::new(self, &designs[0], (&taps[..n], both(0)), Told::by(own, 0), None);
        let Some(robust) = self.search.robust.as_ref().filter(|_| designs.len() > 1) else {
            return nominal.score;
        };
        let calibration = match (robust.calibrated, &designs[0].shared) {
            (Calibrated::Nominal, Some(shared)) => {
                let profile = own.first().and_then(Option::as_ref);
                let estimator = Estimator::new(self.setup, shared, self.reach);
                let known = nominal.k.is_some() || profile.is_some();
                known.then_some(Calibration {
                    estimator,
                    k: nominal.k,
                    drive: designs[0].tuple.drive,
                    profile,
                    upright: None,
                })
            }
            _ => None,
        };
        let samples: Vec<Score> = (1..designs.len())
            .map(|w| {
                let taps = &taps[w * n..(w + 1) * n];
                let mine = upright.chunks(n).nth(w - 1).and_then(|upright| {
                    self.calibrated(&designs[w], upright, own.get(w).and_then(Option::as_ref))
                });
                let calibration = mine.as_ref().or(calibration.as_ref());
                Read::new(self, &designs[w], (taps, both(w)), Told::by(own, w), calibration).score
            })
            .collect();
        samples::gather(robust, &nominal.score, &samples)
    }

    /// The calibration of a whisker by its taps at upright poles.
    fn calibrated<'d>(
        &self,
        design: &'d Design,
        upright: &[Outcome],
        profile: Option<&'d Profile>,
    ) -> Option<Calibration<'d>> {
        let estimator = Estimator::new(self.setup, design.shared.as_ref()?, self.reach);
        let row = self.reduce(design, (&continued(upright), &[]), Told::Formula, None);
        Some(Calibration {
            estimator,
            k: row.k,
            drive: design.tuple.drive,
            profile,
            upright: Some(row.deviation),
        })
    }

    /// Score of one whisker by itself, from what charts say of it.
    pub fn told(&self, tuple: &Tuple, figures: &Figures) -> Score {
        let mut score = self.shape(tuple);
        let taper = Taper::new(tuple.D, tuple.d, tuple.L_a);
        let [x1, x2] = taper.gauge(tuple.x_ss, tuple.l);
        let row = &figures.row;
        let nearest = self.distances.iter().copied().fold(figures.arc[0], f64::min);
        let [place, highest] = figures.peak;
        if row.complete() {
            score.figures = self::figures(self, row, x2 - x1, tuple.L_a);
        }
        self.limits(
            &mut score,
            &Seen {
                nearest: x1 / nearest,
                farthest: figures.arc[1] / tuple.L_a,
                strain: figures.strain,
                reading: figures.strain,
                force: figures.force,
                unsolved: 0.0,
                highest: row.k.map(|k| (k, highest)),
                peak: place,
            },
        );
        score
    }

    /// Score of a candidate from those of its nominal whisker and the sampled ones, each by itself.
    pub fn gather(&self, scores: &[Score]) -> Score {
        match &self.search.robust {
            Some(robust) if scores.len() > 1 => samples::gather(robust, &scores[0], &scores[1..]),
            _ => scores[0],
        }
    }

    /// What the numbers of a whisker alone violate.
    fn shape(&self, tuple: &Tuple) -> Score {
        let mut score = Score::NOTHING;
        let farthest = self.distances.iter().copied().fold(0.0, f64::max);
        score.set(Limit::Gauge, over((tuple.x_ss + tuple.l) / tuple.L_a - 1.0));
        score.set(Limit::Reach, over(farthest / tuple.L_a - 1.0));
        if self.search.limits.tip_not_wider {
            score.set(Limit::Tip, tuple.d / tuple.D - 1.0);
        }
        score
    }

    /// What the taps of a whisker violate.
    fn limits(&self, score: &mut Score, seen: &Seen) {
        let limits = &self.search.limits;
        score.set(Limit::Solved, if seen.unsolved > 0.0 { seen.unsolved } else { f64::NEG_INFINITY });
        score.set(Limit::NoStrain, seen.nearest - 1.0);
        score.set(Limit::Slipped, over(seen.farthest - 1.0));
        score.set(Limit::Strain, seen.strain / limits.strain - 1.0);
        if let Some(force) = limits.force {
            score.set(Limit::Force, seen.force / force - 1.0);
        }
        if let (Some((k, peak)), true) = (seen.highest, self.search.objective.needs_distance()) {
            score.set(Limit::Root, k * seen.reading / peak - 1.0);
        }
        if limits.unambiguous {
            let range = self.setup.estimate.range.unwrap_or(self.reach);
            score.set(Limit::Unambiguous, 1.0 - range[0] / seen.peak);
        }
    }

    /// The designs row of one whisker, its distances told by `own` or with what is `given`: the calibration of another one; or by what the model takes
    /// two strains for.
    pub fn reduce(
        &self,
        design: &Design,
        (taps, both): (&[Outcome], &[Option<Both>]),
        own: Told<'_>,
        given: Option<&Calibration<'_>>,
    ) -> DriveRow {
        let n = (taps.len(), 1);
        let mut reduced = match given {
            Some(other) => Reduction::with(self.setup, design, Some(other.estimator), n),
            None => Reduction::new(self.setup, design, self.reach, n),
        };
        taps.iter().enumerate().for_each(|(i, tap)| reduced.count((i, 0), tap));
        let told = given.and_then(|other| other.profile).map_or(own, Told::Other);
        let told = told.towards(design.tuple.direction());
        let drive = match given {
            Some(other) => {
                reduced.calibrate_as(other.k);
                other.drive
            }
            None => {
                reduced.calibrate();
                design.tuple.drive
            }
        };
        for (i, tap) in taps.iter().enumerate() {
            reduced.estimate_by((i, 0), (self.distances[i], drive), tap, told.or_both(both.get(i)));
        }
        reduced.drives[0]
    }
}

/// With what readings are turned into distances, where it is not the whisker's own.
pub(super) struct Calibration<'a> {
    /// f.
    estimator: Estimator<'a>,
    /// K̄, where f needs it.
    k: Option<f64>,
    drive: f64,
    /// The model's curve, where it stands in for f.
    profile: Option<&'a Profile>,
    /// K − 1 of the taps that it was made of, where these are other taps of the same whisker.
    upright: Option<Spread>,
}

/// A slipped contact has its own limit; its tap is continued, so that figures change smoothly across it.
fn continued(taps: &[Outcome]) -> Vec<Outcome> {
    taps.iter().map(|t| Outcome { status: t.status.without(Status::SLIPPED_OFF), ..*t }).collect()
}

/// What one whisker gives.
struct Read {
    score: Score,
    k: Option<f64>,
}

impl Read {
    fn new(
        judge: &Judge<'_>,
        design: &Design,
        (taps, both): (&[Outcome], &[Option<Both>]),
        told: Told<'_>,
        other: Option<&Calibration<'_>>,
    ) -> Self {
        let setup = judge.setup;
        let Tuple { D, d, L_a, x_ss, l, drive, .. } = design.tuple;
        let mut score = judge.shape(&design.tuple);
        let valid = [D, d, L_a, l].iter().all(|x| *x > 0.0) && x_ss >= 0.0;
        let Some(shared) = design.shared.as_ref().filter(|_| valid && !score.outside()) else {
            if !score.outside() {
                score.set(Limit::Solved, 1.0);
            }
            return Self { score, k: None };
        };
        let taps = continued(taps);
        let own = Estimator::new(setup, shared, judge.reach);
        let mut row = judge.reduce(design, (&taps, both), told, other);
        // K̄ and its spread are those of the calibration.
        if let Some(spread) = other.and_then(|other| other.upright).filter(|_| row.complete()) {
            row.deviation = spread;
        }
        if row.complete() {
            score.figures = figures(judge, &row, own.k_unit, L_a);
        }

        let largest =
            |f: &dyn Fn(&Outcome) -> f64| taps.iter().map(f).filter(|x| x.is_finite()).fold(0.0, f64::max);
        let unsolved =
            taps.iter().filter(|t| t.status.has(Status::NOT_CONVERGED | Status::MATERIAL_LIMIT)).count();
        let near = |t: (&Outcome, &f64)| if t.0.arc.is_finite() { t.1.min(t.0.arc) } else { *t.1 };
        let nearest = taps.iter().zip(&judge.distances).map(near).fold(f64::INFINITY, f64::min);
        let (estimator, drive) = other.map_or((&own, drive), |other| (&other.estimator, other.drive));
        let highest = match (told, other.and_then(|other| other.profile)) {
            _ if !both.is_empty() => None,
            (_, Some(profile)) => Some((1.0, profile.peak().1)),
            (Told::Formula, None) => row.k.map(|k| (k, estimator.peak() * amount(setup.drive, drive))),
            // What a whisker reads of its own tap has a distance.
            (Told::Own(_) | Told::Other(_) | Told::Both(_), None) => None,
        };
        let peak = match told {
            Told::Own(Some(profile)) => profile.peak().0,
            _ => shared.theory.peak().0,
        };
        judge.limits(
            &mut score,
            &Seen {
                nearest: shared.gauge[0] / nearest,
                farthest: largest(&|t| t.arc) / L_a,
                strain: largest(&Outcome::magnitude),
                reading: largest(&|t| t.magnitude() / t.cosine()),
                force: largest(&|t| t.normal_force),
                unsolved: unsolved as f64 / taps.len() as f64,
                highest,
                peak,
            },
        );
        Self { score, k: row.k }
    }
}

/// What limits ask of the taps of a whisker.
struct Seen {
    /// Near end of the gauge over the nearest contact.
    nearest: f64,
    /// Farthest contact over L_a.
    farthest: f64,
    /// Largest |ε|.
    strain: f64,
    /// Largest K̄⁻¹ θ f(â) that is read: |ε|, of two gauges √(ε₁² + ε₂²)/cos β̂.
    reading: f64,
    /// Largest P, N.
    force: f64,
    /// Share of the taps that are not solved.
    unsolved: f64,
    /// K̄, and the largest strain of which the theory has a distance, where that matters.
    highest: Option<(f64, f64)>,
    /// Where the curve that distances are told by peaks, mm.
    peak: f64,
}

/// Rounding of a sum of decimal numbers is no violation.
fn over(value: f64) -> f64 {
    if value <= 1e-12 { value.min(0.0) } else { value }
}

/// K_sd, total_rms_mm, weighted sum.
fn figures(judge: &Judge<'_>, row: &DriveRow, gauge: f64, length: f64) -> [f64; 3] {
    let unit = if judge.setup.estimate.convention == Convention::Elongation { gauge } else { 1.0 };
    let sd = row.deviation.sd().unwrap_or(f64::NAN);
    let total = row.total_rms().unwrap_or(f64::NAN);
    let mean = 1.0 + row.deviation.mean().unwrap_or(f64::NAN);
    let [by_sd, by_distance] = judge.search.weights;
    // A weight of 0 leaves its term out, also where that has no value.
    let term = |weight: f64, value: f64| if weight == 0.0 { 0.0 } else { weight * value };
    [sd * unit, total, term(by_sd, sd / mean) + term(by_distance, total / length)]
}
