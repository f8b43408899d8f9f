//! `shape.csv` and `contacts.csv`.

use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::{Node, Shape, shape};
use crate::census::Taps;
use crate::design::Design;
use crate::error::{Error, InputError};
use crate::evaluate::{Evaluator, Method, Outcome};
use crate::progress::{Progress, go_on};
use crate::scene::{Setup, Space, Spec, Tuple};
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::values::Field;
use crate::status::Status;

pub const FILES: [&str; 2] = ["shape.csv", "contacts.csv"];
pub const MOST_TAPS: u64 = 10_000;
const PART: usize = 256;

pub fn tables(
    spec: &Spec,
    method: Method,
    nodes: usize,
    (stop, progress): (&AtomicBool, &mut dyn Progress),
) -> Result<([usize; 2], [Frame; 2]), Error> {
    let setup = &spec.study.setup;
    let tuples = tuples(&spec.study.space)?;
    let Taps { designs, tasks, .. } = Taps::of(setup, &tuples);
    let mut evaluator = Evaluator::new(setup, method).stopping(stop);
    let mut outcomes = Vec::with_capacity(tasks.len());
    for some in tasks.chunks(PART) {
        outcomes.extend(evaluator.run(&designs, some)?);
        progress.at(outcomes.len() as u64, tasks.len() as u64);
    }
    let [mut sections, mut contacts] = ["shape", "contacts"].map(|table| heading(table).frame_for(setup));
    let mut shapes = 0;
    for (i, ((design, task), outcome)) in designs.iter().zip(&tasks).zip(&outcomes).enumerate() {
        go_on(stop)?;
        let bent = shape(setup, design, task, outcome, nodes);
        shapes += usize::from(bent.is_some());
        for node in bent.iter().flat_map(|shape| &shape.nodes) {
            sections.row(section(setup, i, &tuples[i], node))?;
        }
        contacts.row(contact(setup, i, design, &tuples[i], outcome, bent.as_ref()))?;
    }
    Ok(([tuples.len(), shapes], [sections, contacts]))
}

/// Upper bound of the rows of `shape.csv` for all taps of `space`; an error if there are more than `room`.
pub fn rows(space: &Space, nodes: usize, room: u64) -> Result<u64, InputError> {
    // Two more from contact to tip, or up to `FREE` + 1 for a built whisker.
    let rows = tuples(space)?.len() as u64 * (nodes + super::FREE + 1) as u64;
    if rows <= room {
        return Ok(rows);
    }
    let error = InputError::new("there is no memory for so many sections").key("nodes").value(nodes);
    Err(error.allowed(format!("{room} sections of all taps")))
}

fn tuples(space: &Space) -> Result<Vec<Tuple>, InputError> {
    let (n, at) = space.tuples();
    if n > MOST_TAPS {
        let error = InputError::new("these are too many taps to look at").value(n).key("tuples");
        return Err(error.allowed(format!("{MOST_TAPS} at most")));
    }
    Ok((0..n).map(at).collect())
}

fn tap_columns([tilt, lean]: [bool; 2], t: &Tuple) -> impl Iterator<Item = Field> {
    let whisker = [t.D, t.d, t.L_a, t.x_ss, t.l, t.a].into_iter();
    let stroke = tilt.then_some(t.tilt).into_iter().chain(lean.then_some(t.lean)).chain([t.drive]);
    whisker.chain(stroke).map(Field::Number)
}

/// x, y and, with directions of the pole, z.
fn place([tilt, lean]: [bool; 2], at: DVec3) -> impl Iterator<Item = f64> {
    [at.x, at.y].into_iter().chain((tilt || lean).then_some(at.z))
}

fn section(setup: &Setup, tap: usize, tuple: &Tuple, node: &Node) -> Vec<Field> {
    let mut row = vec![Field::Count(tap as u64)];
    let shown = setup.directions;
    row.extend(tap_columns(shown, tuple));
    let angles = [node.psi, node.direction].map(f64::to_degrees);
    let numbers = [node.s].into_iter().chain(place(shown, node.at)).chain(angles).chain([node.strain]);
    let numbers = numbers.chain(setup.built.is_some().then_some(node.diameter));
    row.extend(numbers.map(Field::Number));
    row
}

fn contact(
    setup: &Setup,
    tap: usize,
    design: &Design,
    tuple: &Tuple,
    o: &Outcome,
    bent: Option<&Shape>,
) -> Vec<Field> {
    let mut row = vec![Field::Count(tap as u64)];
    row.extend(tap_columns(setup.directions, tuple));
    let gauge = design.shared.as_ref().map_or([f64::NAN; 2], |s| s.gauge);
    let at = bent.map_or([DVec3::NAN; 2], |s| [s.contact, s.pole]);
    let at = at.into_iter().flat_map(|at| place(setup.directions, at));
    let solved = [o.strain, o.normal_force, o.tangential_force, o.arc];
    let rig = design.setup(setup);
    let numbers = [rig.hub].into_iter().chain(gauge).chain(solved).chain(at);
    row.extend(numbers.chain([rig.model.pole_radius]).map(Field::Number));
    row.push(match (o.arc.is_finite(), o.sticking) {
        (false, _) => "".into(),
        (_, true) => "stick".into(),
        _ => "slide".into(),
    });
    let bent_or = if bent.is_none() && o.status == Status::OK { Status::MATERIAL_LIMIT } else { o.status };
    row.push(bent_or.into());
    row
}
