//! The drive from which a tap is above the strain limit, or has slipped off.

use super::rows::{Row, Rows};
use super::tap::TapSeries;
use super::{Angle, Distance, LANES, Lanes, ORDERS, Ranker};
use crate::kernel::cpu::{Pack, Packed};

/// Iterations to rounding accuracy: each leaves some hundredths of the error, up to a fifth with a soft contact.
const REPEATS: usize = 5;
const REPEATS_YIELDING: usize = 10;

impl Rows {
    /// First drives above the strain limit, and slipped off; `last` is the last drive. Sets 1 in `hard` where a rough look does not decide.
    #[inline(always)]
    pub fn edges<const OWN: bool>(
        &self,
        ranker: &Ranker,
        (tap, distance): (TapSeries<'_>, &Distance),
        last: &Row,
        hard: &mut Lanes,
    ) -> [Lanes; 2] {
        let of = Lanes::of;
        let (zero, one, limit) = (of(0.0), of(1.0), self.passed.limit);
        let m = ranker.orders::<OWN>();
        let room = (self.design.length - Lanes::splat(distance.a)) * Lanes::splat(distance.inverse);
        let (strain, most) = (tap.strain * last.drive, limit * (one + last.power * last.read(tap.kappa, m)));
        let arc = last.power * last.read(tap.arc, m);
        if OWN {
            let slack = [limit * last.power * tap.slack[0], last.power * tap.slack[1]];
            let open = (strain - most).abs().if_less(slack[0], one, zero);
            *hard = hard.max((arc - room).abs().if_less(slack[1], one, open));
            return [most.if_less(strain, zero, one), room.if_less(arc, zero, one)];
        }
        let mut edges = [of(ranker.angles.len() as f64); 2];
        if !strain.all_at_most(most) {
            edges[0] = first_above(ranker, tap, limit);
        }
        if !arc.all_at_most(room) {
            edges[1] = Pack::new(first_slipped(ranker, tap.arc, room));
        }
        edges
    }
}

/// First place with strain above `limit`: s θ = limit · (1 + θᵉ κ(θ)) by fixed-point iteration, as strain is nearly proportional to the drive.
#[inline(always)]
fn first_above(ranker: &Ranker, tap: TapSeries<'_>, limit: Lanes) -> Lanes {
    let of = Lanes::of;
    let m = tap.kappa.len();
    let ends =
        [&ranker.angles[0], &ranker.angles[ranker.angles.len() - 1]].map(|a| Lanes::splat(a.stroke.drive));
    let linear = limit / tap.strain;
    let mut drive = linear;
    for _ in 0..if ranker.fourth { REPEATS_YIELDING } else { REPEATS } {
        drive = drive.max(ends[0]).min(ends[1]);
        let (x, power) = ranker.over_drives(drive);
        // Clenshaw's recurrence.
        let (mut one, mut two) = (of(0.0), of(0.0));
        for k in (1..m).rev() {
            let next = (x + x).mul_add(one, tap.kappa[k]) - two;
            (two, one) = (one, next);
        }
        let kappa = x.mul_add(one, tap.kappa[0]) - two;
        drive = linear.mul_add(power * kappa, linear);
    }
    let mut places = of(0.0);
    for angle in &ranker.angles {
        places = places + drive.if_less(Lanes::splat(angle.stroke.drive), of(0.0), of(1.0));
    }
    places
}

/// First place, in each lane, at which the arc has grown by more than `room`.
fn first_slipped(ranker: &Ranker, values: &[Lanes], room: Lanes) -> [f32; LANES] {
    let n = ranker.angles.len();
    let mut places = [n as f32; LANES];
    for (lane, place) in places.iter_mut().enumerate() {
        let mut own = [0.0; ORDERS];
        own.iter_mut().zip(values).for_each(|(own, v)| *own = v.0[lane]);
        let off = |a: &Angle| {
            let read: f32 = a.stroke.basis.iter().zip(&own[..ranker.points]).map(|(t, v)| t * v).sum();
            a.stroke.power * read > room.0[lane]
        };
        *place = ranker.angles.partition_point(|a| !off(a)) as f32;
    }
    places
}
