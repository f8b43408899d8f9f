//! The drive from which a tap is above the strain limit, or has slipped off.

use super::rows::{Row, Rows};
use super::tap::TapSeries;
use super::{Angle, Distance, LANES, Lanes, ORDERS, Tables};
use crate::kernel::cpu::{Pack, Packed};

/// Iterations to rounding accuracy: each leaves some hundredths of the error, up to a fifth with a soft contact.
const REPEATS: usize = 5;
const REPEATS_YIELDING: usize = 10;

#[derive(Clone, Copy)]
pub(super) struct Edges {
    pub above: Lanes,
    pub slipped: Lanes,
    /// 1 where a rough look does not decide.
    pub open: Lanes,
    /// No lane has either edge, each at its design's drive.
    pub none: bool,
}

impl Rows {
    #[inline(always)]
    pub fn edges<const OWN: bool>(
        &self,
        tables: &Tables,
        tap: TapSeries<'_>,
        distance: &Distance,
        last: &Row,
        drives: usize,
        m: usize,
    ) -> Edges {
        let of = Lanes::of;
        let never = of(drives as f64);
        let limit = self.passed.limit;
        let (strain, most) =
            (tap.strain * last.drive, limit * (of(1.0) + last.power * last.read(tap.kappa, m)));
        let mut edges = Edges { above: never, slipped: never, open: of(0.0), none: false };
        let room = (self.design.length - Lanes::splat(distance.a)) * Lanes::splat(distance.inverse);
        if OWN {
            let strain_slack = limit * last.power * tap.slack[0];
            edges.none = strain.all_at_most(most - strain_slack);
            let [arc, arc_slack] = [last.power * last.read(tap.arc, m), last.power * tap.slack[1]];
            if !self.still {
                edges.none &= arc.all_at_most(room - arc_slack);
            }
            if !edges.none {
                edges.above = most.if_less(strain, of(0.0), never);
                edges.slipped = room.if_less(arc, of(0.0), never);
                let open = (strain - most).abs().if_less(strain_slack, of(1.0), of(0.0));
                edges.open = (arc - room).abs().if_less(arc_slack, of(1.0), open);
            }
            return edges;
        }
        let arc = last.power * last.read(tap.arc, m);
        if !strain.all_at_most(most) {
            edges.above = most.if_less(strain, self.first_above(tables, tap, limit, m), never);
        }
        if !arc.all_at_most(room) {
            edges.slipped = room.if_less(arc, Pack(first_slipped(tables, tap.arc, room)), never);
        }
        edges
    }

    /// First place with strain above `limit`: s θ = limit · (1 + θᵉ κ(θ)) by fixed-point iteration, as strain is nearly proportional to the drive.
    #[inline(always)]
    fn first_above(&self, tables: &Tables, tap: TapSeries<'_>, limit: Lanes, m: usize) -> Lanes {
        let of = Lanes::of;
        let ends = [&tables.angles[0], &tables.angles[tables.angles.len() - 1]]
            .map(|a| Lanes::splat(a.stroke.drive));
        let linear = limit / tap.strain;
        let mut drive = linear;
        for _ in 0..if tables.fourth { REPEATS_YIELDING } else { REPEATS } {
            drive = drive.max(ends[0]).min(ends[1]);
            let (x, power) = tables.over_drives(drive);
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
        if let Some([first, steps]) = tables.even.map(|even| even.map(Lanes::splat)) {
            let mut passed =
                ((drive - first) * steps + of(1.0)).max(of(0.0)).min(of(tables.angles.len() as f64));
            for place in &mut passed.0 {
                *place = *place as i32 as f32;
            }
            return passed;
        }
        for angle in &tables.angles {
            places = places + drive.if_less(Lanes::splat(angle.stroke.drive), of(0.0), of(1.0));
        }
        places
    }
}

/// First place, in each lane, at which the arc has grown by more than `room`.
fn first_slipped(tables: &Tables, values: &[Lanes], room: Lanes) -> [f32; LANES] {
    let n = tables.angles.len();
    let mut places = [n as f32; LANES];
    for (lane, place) in places.iter_mut().enumerate() {
        let mut own = [0.0; ORDERS];
        own.iter_mut().zip(values).for_each(|(own, v)| *own = v.0[lane]);
        let off = |a: &Angle| {
            let read: f32 = a.stroke.basis.iter().zip(&own[..tables.points]).map(|(t, v)| t * v).sum();
            a.stroke.power * read > room.0[lane]
        };
        *place = tables.angles.partition_point(|a| !off(a)) as f32;
    }
    places
}
