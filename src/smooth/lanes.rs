//! Designs in lanes on the CPU: their rows of statistics from the chart of the rod. Twin of `shaders/smooth.wgsl`.
//!
//! # Theory
//! With κ = (K − 1)/t a polynomial in t = θ² through the squares of the chart, the mean of K over the distances is the polynomial
//! through the means, and `SD² = t² Σ_kl Cov(κ_k, κ_l) L_k(t) L_l(t)`: a row costs a few flops however many distances it has.
//! The covariances are centred before they are summed (Welford), so nothing cancels.
//!
//! The estimate f(â) = K̄ε/θ is a quadratic in 1/â. With â = a/(1 + η) and q = K̄/K − 1 it reads `F₀ q = φ η − β η²`,
//! F₀ = (1 − p)(A − β), φ = (A − β) − β(1 − p), A = b1 + b2, β = s1 b1 + s2 b2: the error â − a keeps its relative precision.
//! The far root is the one with the smaller η; there is none above q_peak = φ²/(4βF₀); the near one is within the range of
//! interest between two values of q.

use super::rod::unit;
use super::scope::Scope;
use crate::kernel::cpu::pack::Pack;
use crate::scene::{Per, RankBy, Tuple};

/// Designs that go together.
pub const LANES: usize = 16;

/// Most squares of a chart.
const SQUARES: usize = super::rod::MOST[2];

/// Most terms over s.
const PLACES: usize = super::rod::MOST[1];

/// Largest deviation of the strain for which it is taken to grow with the angle.
const LARGEST: f64 = 0.3;

type Lanes<const FMA: bool> = Pack<f32, LANES, FMA>;

/// Constants of a scope in single precision.
#[derive(Debug)]
pub struct Tables {
    squares: Vec<f32>,
    terms: usize,
    places: usize,
    /// Functions (ω, ζ, terms of X) × terms of each square.
    values: Vec<Vec<f32>>,
    /// Scale and shift of 1/(1 − p), and of s.
    stiffness: [f32; 2],
    place: [f32; 2],
    gauge: Vec<(f32, f32)>,
    distances: Vec<(f32, f32, [f32; 2])>,
    angles: Vec<Angle>,
    /// Places of the angles in the layout.
    order: Vec<u32>,
    /// Σ|L_k| at most.
    lebesgue: f32,
    strain_limit: f32,
    noise: f32,
    fixed: Option<f32>,
    elongation: bool,
    by: RankBy,
    per: Per,
}

#[derive(Debug)]
struct Angle {
    angle: f32,
    square: f32,
    basis: [f32; SQUARES],
    /// L_k L_l for k ≤ l, twice off the diagonal.
    products: Vec<f32>,
}

/// Best rows and counts of some designs.
#[derive(Debug, Clone, Default)]
pub struct Found {
    /// Rank, design, drive.
    pub rows: Vec<(f32, u64, u32)>,
    /// Rows that are complete.
    pub complete: u64,
    /// Taps without a word, and with each of them.
    pub words: Words,
    /// Designs that must be solved tap by tap.
    pub hard: Vec<u64>,
}

/// Taps per status word.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Words {
    /// None.
    pub ok: u64,
    /// `slipped_off`.
    pub slipped: u64,
    /// `strain_limit`.
    pub strain: u64,
    /// `no_root`.
    pub rootless: u64,
    /// `ambiguous`.
    pub ambiguous: u64,
    /// `invalid_geometry`.
    pub invalid: u64,
}

impl Words {
    /// Adds `other`.
    pub fn add(&mut self, other: &Self) {
        self.ok += other.ok;
        self.slipped += other.slipped;
        self.strain += other.strain;
        self.rootless += other.rootless;
        self.ambiguous += other.ambiguous;
        self.invalid += other.invalid;
    }
}

impl Found {
    /// Adds `other`.
    pub fn merge(&mut self, other: Self) {
        self.rows.extend(other.rows);
        self.complete += other.complete;
        self.words.add(&other.words);
        self.hard.extend(other.hard);
    }
}

impl Tables {
    /// Tables of `scope`.
    pub fn new(scope: &Scope) -> Self {
        let chart = &scope.chart;
        let narrow = |v: &[f64]| v.iter().map(|&x| x as f32).collect::<Vec<_>>();
        let m = chart.squares.len();
        let angles = scope.angles.iter().map(|a| {
            let l = &a.basis;
            let products = (0..m).flat_map(|k| (k..m).map(move |n| (k, n)));
            let product = |(k, n): (usize, usize)| (l[k] * l[n] * if k == n { 1.0 } else { 2.0 }) as f32;
            Angle {
                angle: a.angle as f32,
                square: (a.angle * a.angle) as f32,
                basis: std::array::from_fn(|k| l.get(k).map_or(0.0, |&x| x as f32)),
                products: products.map(product).collect(),
            }
        });
        let lebesgue = scope.angles.iter().map(|a| a.basis.iter().map(|l| l.abs()).sum::<f64>());
        // x = scale v + shift.
        let affine = |range: [f64; 2]| {
            let shift = unit(range, 0.0);
            [(unit(range, 1.0) - shift) as f32, shift as f32]
        };
        Self {
            squares: narrow(&chart.squares),
            terms: chart.terms,
            places: chart.place_terms,
            values: chart.values.iter().map(|v| narrow(&v.concat())).collect(),
            stiffness: affine(chart.range.stiffness()),
            place: affine(chart.range.place),
            gauge: scope.gauge.iter().map(|&(x, w)| (x as f32, w as f32)).collect(),
            distances: scope
                .distances
                .iter()
                .map(|d| (d.a as f32, (1.0 / d.a) as f32, d.ends.map(|e| e as f32)))
                .collect(),
            angles: angles.collect(),
            order: scope.angles.iter().map(|a| a.place).collect(),
            lebesgue: lebesgue.fold(1.0, f64::max) as f32,
            strain_limit: scope.strain_limit as f32,
            noise: scope.noise as f32,
            fixed: scope.fixed.map(|k| k as f32),
            elongation: scope.elongation,
            by: scope.rank.by,
            per: scope.rank.per,
        }
    }

    /// Rows of the designs `ks`, all easy, that rank below `bound`; [`LANES`] at a time.
    pub fn rank(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        #[cfg(target_arch = "x86_64")]
        if crate::kernel::cpu::fused() {
            // SAFETY: the CPU has just been found to have both features.
            unsafe { self.rank_avx2(ks, tuples, bound, found) };
            return;
        }
        self.rank_lanes::<{ cfg!(target_arch = "aarch64") }>(ks, tuples, bound, found);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn rank_avx2(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        self.rank_lanes::<true>(ks, tuples, bound, found);
    }

    #[inline(always)]
    fn rank_lanes<const FMA: bool>(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        let mut scratch = Scratch::default();
        for (ks, tuples) in ks.chunks(LANES).zip(tuples.chunks(LANES)) {
            if self.angles.is_empty() {
                self.designs::<FMA, true>(ks, tuples, bound, found, &mut scratch);
            } else {
                self.designs::<FMA, false>(ks, tuples, bound, found, &mut scratch);
            }
        }
    }

    /// One pack of designs. `OWN`: each has its own angle, at which the chart is read first.
    #[inline(always)]
    fn designs<const FMA: bool, const OWN: bool>(
        &self,
        ks: &[u64],
        tuples: &[Tuple],
        bound: f32,
        found: &mut Found,
        scratch: &mut Scratch<FMA>,
    ) {
        let of = Lanes::<FMA>::of;
        let live = ks.len();
        let lane = |f: &dyn Fn(&Tuple) -> f64| {
            Pack(std::array::from_fn(|i| f(&tuples[if i < live { i } else { 0 }]) as f32))
        };
        let design = Whisker {
            diameter: lane(&|t| t.D),
            tau: lane(&|t| (t.D - t.d) / (t.D * t.L_a)),
            length: lane(&|t| t.L_a),
            gauge: [
                lane(&|t| t.x_ss),
                lane(&|t| t.x_ss + t.l / (1.0 + (0.5 * (t.D - t.d) / t.L_a).powi(2)).sqrt()),
            ],
        };
        let own = lane(&|t| t.drive.to_radians());
        let m = if OWN { 1 } else { self.squares.len() };
        if OWN {
            self.read(own * own, scratch);
        }
        scratch.taps.clear();
        let (mut mean, mut low, mut high) =
            ([of(0.0); SQUARES], [of(f64::MAX); SQUARES], [of(f64::MIN); SQUARES]);
        let mut spread = [of(0.0); SQUARES * (SQUARES + 1) / 2];
        let mut largest = of(0.0);
        for (i, distance) in self.distances.iter().enumerate() {
            let tap = self.tap::<FMA, OWN>(&design, own, *distance, scratch);
            let share = of(1.0 / (i + 1) as f64);
            let mut from_old = [of(0.0); SQUARES];
            for k in 0..m {
                from_old[k] = tap.kappa[k] - mean[k];
                mean[k] = from_old[k].mul_add(share, mean[k]);
                low[k] = low[k].min(tap.kappa[k]);
                high[k] = high[k].max(tap.kappa[k]);
                let square = if OWN { own * own } else { Pack::splat(self.squares[k]) };
                largest = largest.max((square * tap.deviation[k]).abs());
            }
            let mut at = 0;
            for k in 0..m {
                for l in k..m {
                    spread[at] = from_old[k].mul_add(tap.kappa[l] - mean[l], spread[at]);
                    at += 1;
                }
            }
            scratch.taps.push(tap);
        }
        let rows = Rows { live, ks, bound, design, own, mean, hull: [low, high], spread, largest };
        self.rows::<FMA, OWN>(&rows, &scratch.taps, found);
    }

    /// The chart at each lane's own square.
    #[inline(always)]
    fn read<const FMA: bool>(&self, square: Lanes<FMA>, scratch: &mut Scratch<FMA>) {
        let m = self.squares.len();
        let mut basis = [Lanes::<FMA>::of(0.0); SQUARES];
        for k in 0..m {
            let mut l = Lanes::<FMA>::of(1.0);
            let mut scale = 1.0;
            for j in (0..m).filter(|&j| j != k) {
                l = l * (square - Pack::splat(self.squares[j]));
                scale *= f64::from(self.squares[k]) - f64::from(self.squares[j]);
            }
            basis[k] = l * Lanes::<FMA>::of(1.0 / scale);
        }
        scratch.own.clear();
        for i in 0..self.values[0].len() {
            let mut sum = Lanes::<FMA>::of(0.0);
            for k in 0..m {
                sum = basis[k].mul_add(Pack::splat(self.values[k][i]), sum);
            }
            scratch.own.push(sum);
        }
    }

    /// The rod, its gauge and its estimate at one distance.
    #[inline(always)]
    fn tap<const FMA: bool, const OWN: bool>(
        &self,
        design: &Whisker<Lanes<FMA>>,
        own: Lanes<FMA>,
        (a, inverse, _): (f32, f32, [f32; 2]),
        scratch: &mut Scratch<FMA>,
    ) -> Tap<Lanes<FMA>> {
        let of = Lanes::<FMA>::of;
        let (one, inverse) = (of(1.0), Pack::splat(inverse));
        let p = design.tau * Pack::splat(a);
        let rest = one - p;
        let [s1, s2] = [design.gauge[0] * inverse, design.gauge[1] * inverse];
        let (u1, u2) = (one - p * s1, one - p * s2);
        let (near, far) = (one - s1, one - s2);

        // Mean of the polynomials over s with the weight 1/(1 − ps)³.
        let mut over_gauge = [of(0.0); PLACES];
        for &(point, weight) in &self.gauge {
            let s = (s2 - s1).mul_add(Pack::splat(point), s1);
            let u = one - p * s;
            let w = Pack::splat(weight) / (u * u * u);
            let x = s.mul_add(Pack::splat(self.place[0]), Pack::splat(self.place[1]));
            let (mut before, mut now) = (w, w * x);
            for sum in &mut over_gauge[..self.places] {
                *sum = *sum + before;
                (before, now) = (now, of(2.0) * x * now - before);
            }
        }
        let whole = one / over_gauge[0];

        let x = (one / rest).mul_add(Pack::splat(self.stiffness[0]), Pack::splat(self.stiffness[1]));
        let twice = x + x;
        let n = self.terms;
        scratch.basis.clear();
        let (mut before, mut now) = (one, x);
        for _ in 0..n {
            scratch.basis.push(before);
            (before, now) = (now, twice * now - before);
        }
        let lever = near * u2 + far * u1;
        let ratio = (u1 + u2) / lever;
        let mut tap = Tap {
            kappa: [of(0.0); SQUARES],
            deviation: [of(0.0); SQUARES],
            arc: [of(0.0); SQUARES],
            ..Tap::default()
        };
        let m = if OWN { 1 } else { self.squares.len() };
        for k in 0..m {
            let series = |f: usize| {
                let mut sum = of(0.0);
                for i in 0..n {
                    let c = if OWN { scratch.own[f * n + i] } else { Pack::splat(self.values[k][f * n + i]) };
                    sum = c.mul_add(scratch.basis[i], sum);
                }
                sum
            };
            let (force, arc) = (series(0), series(1));
            let mut shortening = of(0.0);
            for (s, mean) in over_gauge[..self.places].iter().enumerate() {
                shortening = series(2 + s).mul_add(*mean, shortening);
            }
            let t = if OWN { own * own } else { Pack::splat(self.squares[k]) };
            let growth = t.mul_add(force, one);
            let deviation = (growth * ratio).mul_add(arc - shortening * whole, force);
            tap.deviation[k] = deviation;
            tap.arc[k] = arc;
            tap.kappa[k] = of(0.0) - deviation / t.mul_add(deviation, one);
        }

        // f of the linear theory, and the quadratic of its inverse; b = 1/u.
        let b = one / (u1 * u2);
        let quarter = of(0.75) * design.diameter * inverse * b;
        tap.strain = quarter * rest * lever * b;
        tap.beta = (s1 * u2 + s2 * u1) * b;
        tap.value = rest * lever * b;
        tap.slope = lever * b - tap.beta * rest;
        tap.unit = quarter;
        tap
    }

    /// Ranks and counts the rows of a pack.
    #[inline(always)]
    fn rows<const FMA: bool, const OWN: bool>(
        &self,
        pack: &Rows<'_, Lanes<FMA>>,
        taps: &[Tap<Lanes<FMA>>],
        found: &mut Found,
    ) {
        let of = Lanes::<FMA>::of;
        let m = if OWN { 1 } else { self.squares.len() };
        let drives = if OWN { 1 } else { self.angles.len() };
        let row = |j: usize| -> Row<Lanes<FMA>> {
            if OWN {
                let mut basis = [of(0.0); SQUARES];
                basis[0] = of(1.0);
                return Row { angle: pack.own, square: pack.own * pack.own, basis };
            }
            let a = &self.angles[j];
            Row {
                angle: Pack::splat(a.angle),
                square: Pack::splat(a.square),
                basis: a.basis.map(Pack::splat),
            }
        };
        let mut hard = [false; LANES];
        for i in 0..pack.live {
            hard[i] = !(f64::from(pack.largest.0[i]) < LARGEST);
        }
        // First angle, by place, at which a tap is above the limit, or has slipped; the least of the latter over the distances.
        let last = row(drives - 1);
        let mut first_slip = [drives; LANES];
        let n = taps.len() as f64;
        let words = if self.by == RankBy::KSd { Some(Decided::new(self, pack, m)) } else { None };
        let mut above = vec![[drives; LANES]; taps.len()];
        let mut slipped = vec![[drives; LANES]; taps.len()];
        for (i, tap) in taps.iter().enumerate() {
            let (a, inverse, _) = self.distances[i];
            let room = (pack.design.length - Pack::splat(a)) * Pack::splat(inverse);
            let strain =
                |r: &Row<Lanes<FMA>>| tap.strain * r.angle * (of(1.0) + r.square * r.read(&tap.deviation, m));
            let arc = |r: &Row<Lanes<FMA>>| r.square * r.read(&tap.arc, m);
            let limit = Pack::splat(self.strain_limit);
            let crosses = |value: Lanes<FMA>, limit: Lanes<FMA>| !value.all_at_most(limit);
            if crosses(strain(&last), limit) {
                above[i] = first(drives, &|j| strain(&row(j)), limit);
            }
            if crosses(arc(&last), room) {
                slipped[i] = first(drives, &|j| arc(&row(j)), room);
                for (least, at) in first_slip.iter_mut().zip(slipped[i]) {
                    *least = (*least).min(at);
                }
            }
        }

        let mut counts = [Words::default(); LANES];
        if let Some(words) = &words {
            for (i, tap) in taps.iter().enumerate() {
                let verdict = words.of(self, tap, self.distances[i].2, m, pack);
                for lane in 0..pack.live {
                    let count = &mut counts[lane];
                    let (over, off) = (above[i][lane], slipped[i][lane]);
                    count.strain += (drives - over) as u64;
                    count.slipped += (drives - off) as u64;
                    match verdict[lane] {
                        Verdict::Clear => count.ok += over.min(off) as u64,
                        Verdict::Ambiguous => count.ambiguous += drives as u64,
                        Verdict::Open if first_slip[lane] < drives => hard[lane] = true,
                        Verdict::Beyond => hard[lane] = true,
                        Verdict::Open => {}
                    }
                }
                if verdict[..pack.live].contains(&Verdict::Open) {
                    for j in 0..drives {
                        let r = row(j);
                        let q = self.miss(pack, &r, tap, m);
                        let [low, high, peak] = bounds(tap, self.distances[i].2);
                        for lane in (0..pack.live).filter(|&l| verdict[l] == Verdict::Open) {
                            let (q, peak) = (q.0[lane], peak.0[lane]);
                            let ambiguous = q >= low.0[lane] && q <= high.0[lane].min(peak);
                            counts[lane].rootless += u64::from(q > peak);
                            counts[lane].ambiguous += u64::from(ambiguous);
                            let free = !ambiguous && q <= peak && j < above[i][lane] && j < slipped[i][lane];
                            counts[lane].ok += u64::from(free);
                        }
                    }
                }
            }
        }

        let mut best = [(f32::INFINITY, 0u32); LANES];
        let mut complete = [0u64; LANES];
        let scale = if self.elongation { pack.design.gauge[1] - pack.design.gauge[0] } else { of(1.0) };
        let scale = scale * of((1.0 / (n - 1.0)).sqrt());
        for j in 0..drives {
            let r = row(j);
            let mut incomplete = [false; LANES];
            let rank = if words.is_some() {
                let mut sum = of(0.0);
                let pairs = m * (m + 1) / 2;
                if OWN {
                    sum = pack.spread[0];
                } else {
                    for (s, l) in pack.spread[..pairs].iter().zip(&self.angles[j].products) {
                        sum = s.mul_add(Pack::splat(*l), sum);
                    }
                }
                r.square * sum.max(of(0.0)).sqrt() * scale
            } else {
                let edges = Edges { above: &above, slipped: &slipped, j };
                self.estimate(pack, &r, taps, m, &edges, &mut counts, &mut incomplete)
            };
            let place = if OWN { 0 } else { self.order[j] };
            for lane in 0..pack.live {
                if j >= first_slip[lane] || incomplete[lane] || hard[lane] {
                    continue;
                }
                complete[lane] += 1;
                let value = rank.0[lane];
                match self.per {
                    Per::Row if value <= pack.bound => found.rows.push((value, pack.ks[lane], place)),
                    Per::Design if value < best[lane].0 => best[lane] = (value, place),
                    _ => {}
                }
            }
        }
        for lane in 0..pack.live {
            if hard[lane] {
                found.hard.push(pack.ks[lane]);
                continue;
            }
            found.words.add(&counts[lane]);
            let (value, place) = best[lane];
            if self.per == Per::Design {
                found.complete += u64::from(complete[lane] > 0);
                if complete[lane] > 0 && value <= pack.bound {
                    found.rows.push((value, pack.ks[lane], place));
                }
            } else {
                found.complete += complete[lane];
            }
        }
        // Rows of a design that turned out hard belong to the other path.
        if hard[..pack.live].contains(&true) {
            let ours = |k: &u64| pack.ks.iter().position(|x| x == k).is_some_and(|lane| hard[lane]);
            found.rows.retain(|(_, k, _)| !ours(k));
        }
    }

    /// q = K̄/K − 1 of a tap of a row.
    #[inline(always)]
    fn miss<const FMA: bool>(
        &self,
        pack: &Rows<'_, Lanes<FMA>>,
        row: &Row<Lanes<FMA>>,
        tap: &Tap<Lanes<FMA>>,
        m: usize,
    ) -> Lanes<FMA> {
        let of = Lanes::<FMA>::of;
        let deviation = row.square * row.read(&tap.kappa, m);
        let calibration = match self.fixed {
            Some(fixed) => Pack::splat(fixed),
            None => row.square * row.read(&pack.mean, m),
        };
        (calibration - deviation) / (of(1.0) + deviation)
    }

    /// Distance errors of a row, reduced to its ranked value; its taps' words go to `counts`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn estimate<const FMA: bool>(
        &self,
        pack: &Rows<'_, Lanes<FMA>>,
        row: &Row<Lanes<FMA>>,
        taps: &[Tap<Lanes<FMA>>],
        m: usize,
        edges: &Edges<'_>,
        counts: &mut [Words; LANES],
        incomplete: &mut [bool; LANES],
    ) -> Lanes<FMA> {
        let of = Lanes::<FMA>::of;
        let (zero, one, two) = (of(0.0), of(1.0), of(2.0));
        let (mut squares, mut largest, mut noises) = (zero, zero, zero);
        let calibration = match self.fixed {
            Some(fixed) => Pack::splat(fixed),
            None => row.square * row.read(&pack.mean, m),
        };
        let noise = (one + calibration) * Pack::splat(self.noise) / row.angle;
        for (i, tap) in taps.iter().enumerate() {
            let q = self.miss(pack, row, tap, m);
            let read = tap.value * q;
            let gap2 = tap.slope * tap.slope - of(4.0) * tap.beta * read;
            let gap = gap2.max(zero).sqrt();
            let above = two * read / (tap.slope + gap);
            let below = (tap.slope - gap) / (two * tap.beta);
            let eta = tap.slope.if_less(zero, below, above);
            let whole = one / (one + eta);
            let (a, ..) = self.distances[i];
            let error = Pack::splat(a) * eta * whole;
            squares = error.mul_add(error, squares);
            largest = largest.max(error.abs());
            // |f′(â)| = unit (φ − 2βη)(1 + η)²/a.
            let slope = tap.unit * gap;
            let sigma = noise * Pack::splat(a) * whole * whole / slope.max(of(1e-30));
            noises = sigma.mul_add(sigma, noises);
            let [low, high, peak] = bounds(tap, self.distances[i].2);
            for lane in 0..pack.live {
                let (q, count) = (q.0[lane], &mut counts[lane]);
                // Below what the farthest contact gives, a widening whisker has no root.
                let rootless = gap2.0[lane] < 0.0 || eta.0[lane] <= -1.0;
                let ambiguous = !rootless && q >= low.0[lane] && q <= high.0[lane].min(peak.0[lane]);
                let (strain, slip) = (edges.j >= edges.above[i][lane], edges.j >= edges.slipped[i][lane]);
                incomplete[lane] |= rootless;
                count.rootless += u64::from(rootless);
                count.ambiguous += u64::from(ambiguous);
                count.strain += u64::from(strain);
                count.slipped += u64::from(slip);
                count.ok += u64::from(!(rootless || ambiguous || strain || slip));
            }
        }
        let share = of(1.0 / taps.len() as f64);
        match self.by {
            RankBy::ErrorMax => largest,
            RankBy::NoiseRms => (noises * share).sqrt(),
            RankBy::TotalRms => ((squares + noises) * share).sqrt(),
            _ => (squares * share).sqrt(),
        }
    }
}

/// q from which, and up to which, the near root is within the range of interest, and q at the peak.
#[inline(always)]
fn bounds<const FMA: bool>(tap: &Tap<Lanes<FMA>>, [lo, hi]: [f32; 2]) -> [Lanes<FMA>; 3] {
    let of = Lanes::<FMA>::of;
    let vertex = tap.slope / (of(2.0) * tap.beta);
    let at = |eta: Lanes<FMA>| eta * (tap.slope - tap.beta * eta) / tap.value;
    let (lo, hi) = (Pack::splat(lo), Pack::splat(hi));
    let never = of(1e30);
    [lo.if_less(vertex, never, at(lo)), vertex.if_less(hi, at(hi), never), at(vertex)]
}

/// First place at which a growing value is above `limit`, in each lane; `count` where it never is.
#[inline(always)]
fn first<const FMA: bool>(
    count: usize,
    value: &dyn Fn(usize) -> Lanes<FMA>,
    limit: Lanes<FMA>,
) -> [usize; LANES] {
    let mut places = [count; LANES];
    for (lane, place) in places.iter_mut().enumerate() {
        let (mut lo, mut hi) = (0, count);
        while lo < hi {
            let mid = (lo + hi) / 2;
            if value(mid).0[lane] > limit.0[lane] { hi = mid } else { lo = mid + 1 }
        }
        *place = lo;
    }
    places
}

/// Where in each tap's angles its words begin, and the angle at hand.
struct Edges<'a> {
    above: &'a [[usize; LANES]],
    slipped: &'a [[usize; LANES]],
    j: usize,
}

/// The words of the estimate that all angles of a tap have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// One root in the range at every angle.
    Clear,
    /// Two at every angle.
    Ambiguous,
    /// It depends on the angle.
    Open,
    /// A reading may lie below what the farthest contact gives.
    Beyond,
}

/// Bounds on q over all angles.
struct Decided<T> {
    /// Largest square.
    square: T,
}

impl<const FMA: bool> Decided<Lanes<FMA>> {
    #[inline(always)]
    fn new(tables: &Tables, pack: &Rows<'_, Lanes<FMA>>, _m: usize) -> Self {
        let square = match tables.angles.last() {
            Some(a) => Pack::splat(a.square),
            None => pack.own * pack.own,
        };
        Self { square }
    }

    #[inline(always)]
    fn of(
        &self,
        tables: &Tables,
        tap: &Tap<Lanes<FMA>>,
        ends: [f32; 2],
        m: usize,
        pack: &Rows<'_, Lanes<FMA>>,
    ) -> [Verdict; LANES] {
        let of = Lanes::<FMA>::of;
        // |K̄ − K| is at most this, with K̄ anywhere among the taps that count.
        let mut apart = of(0.0);
        for k in 0..m {
            let reach = match tables.fixed {
                Some(_) => tap.kappa[k].abs(),
                None => (pack.hull[1][k] - tap.kappa[k]).max(tap.kappa[k] - pack.hull[0][k]),
            };
            apart = apart.max(reach);
        }
        let fixed = tables.fixed.map_or(0.0, |k| k.abs());
        let most =
            self.square * apart * Pack::splat(1.2 * tables.lebesgue) + Pack::splat(1.2 * fixed) + of(1e-7);
        let [low, high, peak] = bounds(tap, ends);
        let farthest = (tap.slope + tap.beta) / tap.value;
        std::array::from_fn(|i| {
            let (most, low, high) = (most.0[i], low.0[i], high.0[i].min(peak.0[i]));
            if most > 0.9 * farthest.0[i] || most > 0.5 {
                Verdict::Beyond
            } else if peak.0[i] > most && (low > most || high < -most) {
                Verdict::Clear
            } else if peak.0[i] > most && low < -most && high > most {
                Verdict::Ambiguous
            } else {
                Verdict::Open
            }
        })
    }
}

/// A whisker with its gauge, mm and 1/mm.
#[derive(Clone, Copy)]
struct Whisker<T> {
    diameter: T,
    tau: T,
    length: T,
    gauge: [T; 2],
}

/// A tap at every square of the chart, or at its own.
#[derive(Clone, Copy, Default)]
struct Tap<T> {
    /// (K − 1)/θ².
    kappa: [T; SQUARES],
    /// δ/θ².
    deviation: [T; SQUARES],
    /// (c/a − 1)/θ².
    arc: [T; SQUARES],
    /// f, per radian.
    strain: T,
    /// F₀, φ, β of the estimate, and what f is measured in there.
    value: T,
    slope: T,
    beta: T,
    unit: T,
}

/// A drive.
struct Row<T> {
    angle: T,
    square: T,
    basis: [T; SQUARES],
}

impl<const FMA: bool> Row<Lanes<FMA>> {
    /// The polynomial through `values` at this angle.
    #[inline(always)]
    fn read(&self, values: &[Lanes<FMA>; SQUARES], m: usize) -> Lanes<FMA> {
        let mut sum = self.basis[0] * values[0];
        for k in 1..m {
            sum = self.basis[k].mul_add(values[k], sum);
        }
        sum
    }
}

/// Statistics of a pack over its distances.
struct Rows<'a, T> {
    live: usize,
    ks: &'a [u64],
    bound: f32,
    design: Whisker<T>,
    own: T,
    mean: [T; SQUARES],
    hull: [[T; SQUARES]; 2],
    spread: [T; SQUARES * (SQUARES + 1) / 2],
    /// Largest |δ|.
    largest: T,
}

/// Memory of a pack, used again by the next.
struct Scratch<const FMA: bool> {
    own: Vec<Lanes<FMA>>,
    basis: Vec<Lanes<FMA>>,
    taps: Vec<Tap<Lanes<FMA>>>,
}

impl<const FMA: bool> Default for Scratch<FMA> {
    fn default() -> Self {
        Self { own: Vec::new(), basis: Vec::new(), taps: Vec::new() }
    }
}
