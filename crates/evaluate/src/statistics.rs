//! Rows of one design: K and its spread per drive and per distance, distance errors, extremes (model §4). Two passes over the taps, in any order:
//! [`Reduction::count`] gathers K, [`Reduction::calibrate`] gives every row its K̄, [`Reduction::estimate`] gathers the errors of the distances.

use crate::curve::{Curve, both::Both};
use crate::design::Design;
use crate::estimate::{Estimated, Estimator};
use crate::evaluate::Outcome;
use crate::physics::driven::Driven;
use crate::reduce::{Errors, Spread, larger};
use crate::scene::built::Root;
use crate::scene::channels::MOST_CHANNELS;
use crate::scene::{Direction, Drive, RankBy, Setup};
use crate::status::Status;

/// Statistics of a design at one drive, over its distances: a row of designs.csv.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveRow {
    /// Number of all taps.
    pub asked: u64,
    /// K − 1 of the taps that count.
    pub deviation: Spread,
    strain: Option<f64>,
    force: Option<f64>,
    errors: Errors,
    noise: Errors,
    /// K̄ used by the estimate, without unit.
    pub k: Option<f64>,
    /// A counting tap had no root.
    incomplete: bool,
    /// Union of its taps' words.
    pub status: Status,
}

impl DriveRow {
    /// `asked` taps, of which `told` have a distance; K − 1, largest |strain| and force of those that count, errors and noise, K̄ and all words.
    pub fn of(
        [asked, told]: [u64; 2],
        deviation: Spread,
        [strain, force]: [f64; 2],
        [errors, noise]: [Errors; 2],
        k: Option<f64>,
        status: Status,
    ) -> Self {
        let [strain, force] = [strain, force].map(|most| (deviation.n > 0).then_some(most));
        let incomplete = k.is_some() && told < deviation.n;
        Self { asked, deviation, strain, force, errors, noise, k, incomplete, status }
    }

    /// True if every distance counts.
    pub fn complete(&self) -> bool {
        self.deviation.n == self.asked
    }

    /// The value by which `top` ranks, K in `unit`; `None` of a row that is not complete or has no such value.
    pub fn rank(&self, by: RankBy, unit: f64) -> Option<f64> {
        self.figures().value(by, unit).filter(|_| self.complete())
    }

    /// Its values.
    pub fn figures(&self) -> Figures {
        let whole = |value: Option<f64>| value.filter(|_| !self.incomplete);
        Figures {
            n: self.deviation.n,
            mean: self.deviation.mean(),
            sd: self.deviation.sd(),
            error_rms: whole(self.errors.rms()),
            error_max: whole(self.errors.largest()),
            error_mean: whole(self.errors.mean()),
            noise_rms: whole(self.noise.rms()),
            strain_max: self.strain,
            force_max: self.force,
            status: self.status,
        }
    }
}

/// The values of a designs row; `None` if undefined.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Figures {
    /// Taps that count.
    pub n: u64,
    /// Mean of K − 1, without unit.
    pub mean: Option<f64>,
    /// Its sample standard deviation.
    pub sd: Option<f64>,
    /// The bias: root mean square of â − a, mm.
    pub error_rms: Option<f64>,
    /// Largest |â − a|, mm.
    pub error_max: Option<f64>,
    /// Mean of â − a, mm.
    pub error_mean: Option<f64>,
    /// The noise: root mean square of σ_a, mm.
    pub noise_rms: Option<f64>,
    /// Largest |strain| of those, of two gauges √(ε₁² + ε₂²).
    pub strain_max: Option<f64>,
    /// Their largest contact force, N.
    pub force_max: Option<f64>,
    /// Union of its taps' words.
    pub status: Status,
}

impl Figures {
    /// Bias and noise in quadrature, mm.
    pub fn total_rms(&self) -> Option<f64> {
        Some(self.error_rms?.hypot(self.noise_rms?))
    }

    /// The value of the column `by`, K in `unit`.
    pub fn value(&self, by: RankBy, unit: f64) -> Option<f64> {
        match by {
            RankBy::KSd => self.sd.map(|s| s * unit),
            RankBy::ErrorRms => self.error_rms,
            RankBy::ErrorMax => self.error_max,
            RankBy::NoiseRms => self.noise_rms,
            RankBy::TotalRms => self.total_rms(),
            RankBy::StrainMax => self.strain_max,
            RankBy::ForceMax => self.force_max,
        }
    }
}

/// Statistics of a design at one distance, over its drives: a row of distances.csv.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DistanceRow {
    /// K − 1 of the taps that count.
    pub deviation: Spread,
    /// Union of its taps' words.
    pub status: Status,
}

/// Converts the strain of a tap into a distance.
#[derive(Debug, Clone, Copy)]
pub enum Told<'p> {
    /// The closed form of a theory and K̄.
    Formula,
    /// The model's curve of this very whisker at this drive, if any.
    Own(Option<&'p Curve>),
    /// The curve of another whisker.
    Other(&'p Curve),
    /// The model's estimate from the strains of two gauges, if any.
    Both(Option<&'p Both>),
}

impl<'p> Told<'p> {
    /// By place `k` of `curves`; by the formula if these are empty.
    pub fn by(curves: &'p [Option<Curve>], k: usize) -> Self {
        curves.get(k).map_or(Self::Formula, |curve| Self::Own(curve.as_ref()))
    }

    /// The same for a pole of this direction. The tilt is unknown to the estimate, so a tilted tap is not of the curve's whisker.
    pub fn towards(self, direction: Direction) -> Self {
        match self {
            Self::Own(Some(curve)) if !direction.is_upright() => Self::Other(curve),
            told => told,
        }
    }

    /// The same, or the estimate from two strains, if `both` exists.
    pub fn or_both(self, both: Option<&'p Option<Both>>) -> Self {
        both.map_or(self, |found| Self::Both(found.as_ref()))
    }
}

/// A design in reduction from taps to rows.
#[derive(Debug, Clone)]
pub struct Reduction<'a> {
    /// Estimates distances; None for an invalid whisker.
    estimator: Option<Estimator<'a>>,
    kind: Drive,
    /// Length by which K is multiplied in the tables, if any, mm.
    pub elongation: Option<f64>,
    /// One per drive.
    pub drives: Vec<DriveRow>,
    /// One per distance.
    pub distances: Vec<DistanceRow>,
    /// K − 1 of each channel, per drive; of several channels only.
    channels: Vec<[Spread; MOST_CHANNELS]>,
    /// Springs that do not carry the sensor.
    carried: Option<Root>,
}

impl<'a> Reduction<'a> {
    /// For `design` with n (distances, drives); `reach`: its smallest and largest distance, mm.
    pub fn new(setup: &Setup, design: &'a Design, reach: [f64; 2], n: (usize, usize)) -> Self {
        let estimator = design.shared.as_ref().map(|s| Estimator::new(design.setup(setup), s, reach));
        Self::with(setup, design, estimator, n)
    }

    /// [`Self::new`] with readings turned into distances by `estimator`.
    pub fn with(
        setup: &Setup,
        design: &Design,
        estimator: Option<Estimator<'a>>,
        (distances, drives): (usize, usize),
    ) -> Self {
        let several = estimator.as_ref().is_some_and(|e| e.shared.contact.is_some());
        Self {
            estimator,
            kind: setup.drive,
            elongation: design.elongation(setup),
            drives: vec![DriveRow::default(); drives],
            distances: vec![DistanceRow::default(); distances],
            carried: design.setup(setup).carried().copied(),
            channels: vec![<[Spread; MOST_CHANNELS]>::default(); if several { drives } else { 0 }],
        }
    }

    /// Unit of K in the tables.
    pub fn unit(&self) -> f64 {
        self.elongation.unwrap_or(1.0)
    }

    fn felt(&self, wrench: [f64; 3]) -> [f64; 3] {
        self.carried.map_or(wrench, |root| root.about_rest(wrench))
    }

    /// Reading and K of each channel of the `tap` at `a` mm, `drive` in degrees or mm; None of one signal.
    pub fn of_channels(&self, (a, drive): (f64, f64), tap: &Outcome) -> Option<[[f64; 2]; MOST_CHANNELS]> {
        let estimator = self.estimator.as_ref()?;
        let contact = estimator.shared.contact.as_ref()?;
        let readings = contact.channels.read(self.felt(tap.wrench), tap.strain);
        let size = Driven::of_users(self.kind, drive).size();
        let linear = contact.linear(estimator.shared.theory.curve(), a).map(|s| size * s);
        Some(std::array::from_fn(|k| [readings[k], linear[k] / readings[k]]))
    }

    /// First pass: the tap at distance `i` (`a` mm), drive `j` (`drive` in degrees or mm).
    pub fn count(&mut self, (i, j): (usize, usize), at: (f64, f64), tap: &Outcome) {
        if let Some(all) = self.of_channels(at, tap).filter(|_| tap.status.counts()) {
            self.channels[j].iter_mut().zip(all).for_each(|(spread, [_, k])| spread.push(k - 1.0));
        }
        let (row, distance) = (&mut self.drives[j], &mut self.distances[i]);
        row.asked += 1;
        row.status |= tap.status;
        distance.status |= tap.status;
        if tap.status.counts() {
            row.deviation.push(tap.deviation);
            distance.deviation.push(tap.deviation);
            row.strain = larger(row.strain, tap.magnitude());
            row.force = larger(row.force, tap.normal_force);
        }
    }

    /// Between the passes: sets K̄ of every row; None for an invalid whisker.
    pub fn calibrate(&mut self) {
        let known = |row: &DriveRow| self.estimator?.calibration(row.deviation.n, row.deviation.mean());
        self.drives.iter_mut().for_each(|row| row.k = known(row));
    }

    /// Second pass, with K̄: the estimate, by the method `told`, of the tap at distance `i` (`a` mm), drive `j` (`drive` in degrees or mm).
    pub fn estimate(
        &mut self,
        (i, j): (usize, usize),
        (a, drive): (f64, f64),
        tap: &Outcome,
        told: Told<'_>,
    ) -> Estimated {
        let felt = self.felt(tap.wrench);
        let row = &mut self.drives[j];
        let several = !self.channels.is_empty();
        let readable =
            tap.strain.is_finite() && (several || tap.strain != 0.0 && !tap.status.has(Status::NO_STRAIN));
        let (strain, cos) = (tap.magnitude(), tap.cosine());
        let estimator = self.estimator.as_ref().filter(|_| readable);
        let estimated = estimator.and_then(|e| match told {
            // f(â) = K̄ √(ε₁² + ε₂²)/(θ cos β̂), and σ_a is that of one gauge over cos²β̂.
            Told::Formula if e.shared.contact.is_some() => row.k.and_then(|_| {
                let contact = e.shared.contact.as_ref()?;
                let spreads = self.channels.get(j)?;
                let k = spreads.map(|spread| e.fixed.or(spread.mean().map(|m| 1.0 + m)).unwrap_or(1.0));
                let readings = contact.channels.read(felt, tap.strain);
                let (curve, driven) = (e.shared.theory.curve(), Driven::of_users(self.kind, drive));
                Some(contact.estimate(curve, &k, &readings, driven, |a| e.interesting(a)))
            }),
            Told::Formula => row.k.map(|k| {
                let told = e.estimate(k, strain / cos, Driven::of_users(self.kind, drive), a);
                Estimated { sigma: told.sigma / (cos * cos), ..told }
            }),
            Told::Own(curve) => curve.map(|p| p.estimate(e, Some(a), strain)),
            Told::Other(curve) => Some(curve.estimate(e, None, strain)),
            Told::Both(found) => Some(found.map_or(Estimated::NO_ROOT, |both| both.estimate(e))),
        });
        let mut estimated = estimated.unwrap_or(Estimated::NOTHING);
        if tap.status.has(Status::SLIPPED_OFF) {
            // The word slipped_off already says that the contact lies beyond the whisker.
            estimated.status = estimated.status.only(Status::NO_ROOT | Status::AMBIGUOUS);
        }
        row.status |= estimated.status;
        self.distances[i].status |= estimated.status;
        let judged = row.k.is_some() || !matches!(told, Told::Formula);
        if judged && tap.status.counts() {
            if estimated.distance.is_finite() && !estimated.sigma.is_nan() {
                row.errors.push(estimated.distance - a);
                row.noise.push(estimated.sigma);
            } else {
                row.incomplete = true;
            }
        }
        estimated
    }
}
