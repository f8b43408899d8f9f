//! The taps of a space, design by design.

use std::borrow::Cow;
use std::collections::HashMap;

use crate::plan::Layout;
use crate::scene::{Listed, Space, Tuple};

/// Designs are numbered in row order; in a list, in order of first appearance.
pub(super) enum Taps<'a> {
    Grid { layout: Layout, places: Places },
    List(List<'a>),
}

#[derive(Debug, Clone)]
pub(super) struct Places {
    /// Distance (with direction of the pole) and stroke of each tap, numbered in order of first appearance.
    pub of: Vec<(u32, u32)>,
    pub distances: Vec<u32>,
    pub strokes: Vec<u32>,
}

impl Places {
    fn new(of: Vec<(u32, u32)>) -> Self {
        let (mut distances, mut strokes) = (Vec::new(), Vec::new());
        for (t, &(i, j)) in (0..).zip(&of) {
            if i as usize == distances.len() {
                distances.push(t);
            }
            if j as usize == strokes.len() {
                strokes.push(t);
            }
        }
        Self { of, distances, strokes }
    }
}

pub(super) struct List<'a> {
    listed: &'a Listed,
    /// Rows design by design, each in the order of the list.
    rows: Vec<u32>,
    /// Start of each design in `rows`, and the end of the last.
    starts: Vec<u32>,
    /// True if `rows` is in the order of the list.
    in_order: bool,
}

impl<'a> List<'a> {
    fn new(listed: &'a Listed) -> Self {
        let designs = &listed.groups().designs;
        let mut starts = vec![0; listed.groups().counts[0] as usize + 1];
        designs.iter().for_each(|k| starts[*k as usize + 1] += 1);
        (1..starts.len()).for_each(|k| starts[k] += starts[k - 1]);
        let (mut rows, mut next) = (vec![0; designs.len()], starts.clone());
        for (row, k) in (0..).zip(designs) {
            rows[next[*k as usize] as usize] = row;
            next[*k as usize] += 1;
        }
        Self { listed, rows, starts, in_order: designs.is_sorted() }
    }

    fn rows(&self, k: u64) -> &[u32] {
        let [from, to] = [0, 1].map(|next| self.starts[k as usize + next] as usize);
        &self.rows[from..to]
    }

    fn places(&self, k: u64) -> Places {
        let groups = self.listed.groups();
        let (mut distances, mut strokes) = (HashMap::new(), HashMap::new());
        let mut place = |row: &u32| {
            let number = |known: &mut HashMap<u32, u32>, all: &[u32]| {
                let next = known.len() as u32;
                *known.entry(all[*row as usize]).or_insert(next)
            };
            (number(&mut distances, &groups.distances), number(&mut strokes, &groups.strokes))
        };
        Places::new(self.rows(k).iter().map(&mut place).collect())
    }
}

impl<'a> Taps<'a> {
    pub fn new(space: &'a Space) -> Self {
        match space {
            Space::Grid(factors) => {
                let layout = Layout::new(factors);
                let places = (0..layout.block()).map(|t| layout.place(t)).map(|(i, j)| (i as u32, j as u32));
                let places = Places::new(places.collect());
                Self::Grid { layout, places }
            }
            Space::List(listed) => Self::List(List::new(listed)),
        }
    }

    pub fn block(&self, k: u64) -> u64 {
        match self {
            Self::Grid { layout, .. } => layout.block(),
            Self::List(list) => list.rows(k).len() as u64,
        }
    }

    /// Design `k`; its distance and drive have no meaning.
    pub fn design(&self, k: u64) -> Tuple {
        match self {
            Self::Grid { layout, .. } => layout.design(k),
            Self::List(list) => list.listed.tuple(list.rows(k)[0] as usize),
        }
    }

    pub fn tap(&self, (k, design): (u64, &Tuple), t: u64) -> Tuple {
        match self {
            Self::Grid { layout, .. } => {
                let (i, j) = (t / layout.n_drives, t % layout.n_drives);
                Tuple { a: layout.distance(i), ..layout.stroke(design, j) }
            }
            Self::List(list) => {
                let row = list.listed.tuple(list.rows(k)[t as usize] as usize);
                Tuple { a: row.a, drive: row.drive, ..design.towards(row.direction()) }
            }
        }
    }

    pub fn reach(&self, k: u64) -> [f64; 2] {
        match self {
            Self::Grid { layout, .. } => layout.reach(),
            Self::List(list) => list.listed.groups().reach[k as usize],
        }
    }

    pub fn places(&self, k: u64) -> Cow<'_, Places> {
        match self {
            Self::Grid { places, .. } => Cow::Borrowed(places),
            Self::List(list) => Cow::Owned(list.places(k)),
        }
    }

    /// Order in which the taps of a design are reduced: in a list by drive and distance, so that sums do not depend on its order. Empty for a grid.
    pub fn order(&self, places: &Places, strokes: &[Tuple], distances: &[Tuple]) -> Vec<u32> {
        let Self::List(_) = self else { return Vec::new() };
        let bits = |x: f64, t: &Tuple| [x, t.tilt, t.lean].map(|x| (x + 0.0).to_bits());
        let mut order: Vec<u32> = (0..places.of.len() as u32).collect();
        order.sort_by_cached_key(|t| {
            let (i, j) = places.of[*t as usize];
            let (distance, stroke) = (&distances[i as usize], &strokes[j as usize]);
            (bits(stroke.drive, stroke), bits(distance.a, distance), *t)
        });
        order
    }

    /// The row of tap `t` of design `k` in a list.
    pub fn row(&self, k: u64, t: u32) -> Option<u64> {
        match self {
            Self::Grid { .. } => None,
            Self::List(list) => Some(list.rows(k)[t as usize].into()),
        }
    }

    pub fn design_of(&self, index: (u64, u32)) -> u64 {
        match self {
            Self::Grid { .. } => index.0,
            Self::List(list) => list.listed.groups().designs[index.0 as usize].into(),
        }
    }

    /// True if the rows of each design are consecutive.
    pub fn in_order(&self) -> bool {
        !matches!(self, Self::List(list) if !list.in_order)
    }
}
