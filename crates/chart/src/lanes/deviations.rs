//! Single taps as rows are made of them, to be compared with solved ones.

use super::dispatch::{Work, best, work};
use super::rows::Rows;
use super::{LANES, Scratch, Tables};
use crate::design::amount;
use crate::scene::Tuple;

work! {
    /// [`Tables::deviations`] for an instruction set.
    Deviations: Tables.deviations_lanes(taps: &'a [(Tuple, usize)]) -> Vec<f64>
}

impl Tables {
    /// K − 1 of taps of easy designs, each with the place of its distance, as the rows are made of them.
    pub fn deviations(&self, taps: &[(Tuple, usize)]) -> Vec<f64> {
        best(Deviations { of: self, taps })
    }

    #[inline(always)]
    fn deviations_lanes<const SET: u8>(&self, taps: &[(Tuple, usize)]) -> Vec<f64> {
        let (mut scratch, mut rows) = (Scratch::<SET>::new(self), Rows::new());
        let mut found = Vec::with_capacity(taps.len());
        for taps in taps.chunks(LANES) {
            let tuples: Vec<Tuple> = taps.iter().map(|(tuple, _)| *tuple).collect();
            let own = self.angles.is_empty() || self.apart;
            match own {
                true => rows.fill::<true, false>((self, &self.charts), taps.len(), &tuples, &mut scratch),
                false => rows.fill::<false, false>((self, &self.charts), taps.len(), &tuples, &mut scratch),
            }
            if own {
                rows.read_between::<false>(self, &mut scratch);
            }
            for (lane, (tuple, i)) in taps.iter().enumerate() {
                let kappa: Vec<f32> = scratch.taps.at(*i).kappa.iter().map(|k| k.0[lane]).collect();
                let drive = amount(self.kind, tuple.drive) as f32;
                let shared = self.angles.iter().map(|a| &a.stroke).find(|a| !own && a.drive == drive);
                let deviation = match shared {
                    Some(a) => a.power * kappa.iter().zip(&a.basis).map(|(k, t)| k * t).sum::<f32>(),
                    None if own => rows.own[1].0[lane] * kappa[0],
                    None => f32::NAN,
                };
                let share = f64::from(rows.passed.share.0[lane]);
                let deviation = f64::from(deviation);
                found.push(if share == 1.0 { deviation } else { (1.0 + deviation) / share - 1.0 });
            }
        }
        found
    }
}
