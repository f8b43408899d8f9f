//! From the solved taps of candidates, and of whiskers sampled around them, to scores.

use rayon::prelude::*;

use super::score::{Limit, Score, deviation, gather};
use super::whisker::{self, Read, Seen, continued, over};
use crate::chart::lanes::Figures;
use crate::curve::{
    Curve, Reach,
    both::{self, Both},
};
use crate::design::Design;
use crate::estimate::Estimator;
use crate::evaluate::{Outcome, Task};
use crate::physics::taper::Taper;
use crate::reduce::Spread;
use crate::scene::search::{Calibrated, Robust, Search};
use crate::scene::{COLUMNS, Column, Direction, Property, Setup, Theory, Tuple};
use crate::statistics::{DriveRow, Reduction, Told};

pub(super) struct Judge<'a> {
    pub setup: &'a Setup,
    pub search: &'a Search,
    pub distances: Vec<f64>,
    pub reach: [f64; 2],
    pub deviations: Vec<[f64; COLUMNS]>,
    /// How far inside its limits a tap is kept, relative: as far as its kernel may be off, so that every more accurate one finds them kept.
    pub margin: f64,
}

impl Judge<'_> {
    /// Whether each sampled whisker is calibrated at upright poles, and judged at poles whose direction it does not know.
    pub fn blind(&self) -> bool {
        let each = self.search.robust.as_ref().filter(|r| r.calibrated == Calibrated::Each);
        !self.deviations.is_empty() && each.is_some_and(Robust::tilts)
    }

    /// The taps of `designs`, each over all distances.
    pub fn tasks(&self, designs: &[Design]) -> Vec<Task> {
        let n = self.distances.len();
        let task =
            |t: usize| Task::of((t / n) as u32, &Tuple { a: self.distances[t % n], ..designs[t / n].tuple });
        (0..designs.len() * n).into_par_iter().map(task).collect()
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
        Tuple::from_array(values).of_rig(point.rig)
    }

    /// The design of whisker `w` of a point, a sampled one with a rig of its own where properties of it are sampled.
    pub fn design(&self, point: &Tuple, w: usize) -> Design {
        let mut tuple = self.whisker(point, w);
        let robust = self.search.robust.as_ref().filter(|robust| w > 0 && !robust.properties.is_empty());
        let Some(robust) = robust else { return Design::new(self.setup, tuple) };
        let rigs = self.setup.rigs.as_ref();
        let Some(mut own) = rigs.map_or(Some(self.setup.clone()), |rigs| rigs.setup(self.setup, point.rig))
        else {
            return Design::nothing(tuple);
        };
        for (dimension, (property, sd)) in (0..).zip(&robust.properties) {
            let scale =
                rigs.filter(|_| *property == Property::Scale).map(|rigs| rigs.value(point.rig, *property));
            let nominal = scale.filter(|scale| !scale.is_nan()).unwrap_or_else(|| property.get(&own));
            let value = inside(*property, nominal + sd * deviation(self.search.seed, w - 1, dimension));
            if !property.about().range.holds(value) {
                return Design::nothing(tuple);
            }
            if *property == Property::Scale {
                (tuple.D, tuple.d) = (tuple.D * value / nominal, tuple.d * value / nominal);
                property.set(&mut own, value / nominal);
            } else {
                property.set(&mut own, value);
            }
        }
        Design::with(own, tuple)
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
        (own, both): (&[Option<Curve>], &[Option<Both>]),
    ) -> Score {
        let n = self.distances.len();
        let both = |w: usize| both.get(w * n..(w + 1) * n).unwrap_or_default();
        let nominal = Read::new(self, &designs[0], (&taps[..n], both(0)), Told::by(own, 0), None);
        let Some(robust) = self.search.robust.as_ref().filter(|_| designs.len() > 1) else {
            return nominal.score;
        };
        let calibration = match (robust.calibrated, &designs[0].shared) {
            (Calibrated::Nominal, Some(shared)) => {
                let curve = own.first().and_then(Option::as_ref);
                let estimator = Estimator::new(designs[0].setup(self.setup), shared, self.reach);
                let known = nominal.k.is_some() || curve.is_some();
                known.then_some(Calibration {
                    estimator,
                    k: nominal.k,
                    drive: designs[0].tuple.drive,
                    curve,
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
        gather(robust, &nominal.score, &samples)
    }

    /// The calibration of a whisker by its taps at upright poles.
    fn calibrated<'d>(
        &self,
        design: &'d Design,
        upright: &[Outcome],
        curve: Option<&'d Curve>,
    ) -> Option<Calibration<'d>> {
        let estimator = Estimator::new(design.setup(self.setup), design.shared.as_ref()?, self.reach);
        let row = self.reduce(design, (&continued(upright), &[]), Told::Formula, None);
        Some(Calibration {
            estimator,
            k: row.k,
            drive: design.tuple.drive,
            curve,
            upright: Some(row.deviation),
        })
    }

    /// Score of one whisker by itself, from what charts say of it.
    pub fn score_of_chart(&self, tuple: &Tuple, figures: &Figures) -> Score {
        let mut score = self.shape(tuple);
        let taper = Taper::new(tuple.D, tuple.d, tuple.L_a);
        let [x1, x2] = taper.gauge(tuple.x_ss, tuple.l);
        let row = &figures.row;
        let largest = row.figures().strain_max.unwrap_or(0.0);
        let nearest = self.distances.iter().copied().fold(figures.arc[0], f64::min);
        let [place, highest] = figures.peak;
        if row.complete() {
            score.figures = whisker::figures(self, row, x2 - x1, tuple.L_a);
        }
        self.limits(
            &mut score,
            &Seen {
                nearest: x1 / nearest,
                farthest: figures.arc[1] / tuple.L_a,
                strain: largest,
                reading: largest,
                force: row.figures().force_max.unwrap_or(0.0),
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
            Some(robust) if scores.len() > 1 => gather(robust, &scores[0], &scores[1..]),
            _ => scores[0],
        }
    }

    /// What the numbers of a whisker alone violate.
    pub fn shape(&self, tuple: &Tuple) -> Score {
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
    pub fn limits(&self, score: &mut Score, seen: &Seen) {
        let limits = &self.search.limits;
        let share = |value: f64, most: f64| value * (1.0 + self.margin) / most - 1.0;
        score.set(Limit::Solved, if seen.unsolved > 0.0 { seen.unsolved } else { f64::NEG_INFINITY });
        score.set(Limit::NoStrain, seen.nearest - 1.0);
        score.set(Limit::Slipped, over(seen.farthest - 1.0));
        score.set(Limit::Strain, share(seen.strain, limits.strain));
        if let Some(force) = limits.force {
            score.set(Limit::Force, share(seen.force, force));
        }
        if let (Some((k, peak)), true) = (seen.highest, self.search.objective.needs_distance()) {
            score.set(Limit::Root, share(k * seen.reading, peak));
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
        let at = |i: usize| (self.distances[i], design.tuple.drive);
        taps.iter().enumerate().for_each(|(i, tap)| reduced.count((i, 0), at(i), tap));
        let told = given.and_then(|other| other.curve).map_or(own, Told::Other);
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

/// A value that is none as the nearest that is.
fn inside(property: Property, value: f64) -> f64 {
    match property {
        Property::Exponent => value.clamp(0.25, 4.0),
        Property::Nu => value.clamp(0.0, 0.5),
        Property::Bore | Property::Core | Property::Hub | Property::PoleRadius | Property::Friction => {
            value.max(0.0)
        }
        _ => value,
    }
}

/// With what readings are turned into distances, where it is not the whisker's own.
pub(super) struct Calibration<'a> {
    pub estimator: Estimator<'a>,
    /// K̄, where f needs it.
    k: Option<f64>,
    pub drive: f64,
    /// The model's curve, where it stands in for f.
    pub curve: Option<&'a Curve>,
    /// K − 1 of the taps that it was made of, where these are other taps of the same whisker.
    pub upright: Option<Spread>,
}
