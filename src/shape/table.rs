//! `shape.csv` and `contacts.csv`.

use super::{Node, Shape, shape};
use crate::design::Design;
use crate::error::{Error, InputError};
use crate::evaluate::Method;
use crate::evaluate::{Evaluator, Outcome, Task};
use crate::scene::{Column, Setup, Space, Spec, Tuple};
use crate::sink::csv::Text;
use crate::sink::folder::Folder;
use crate::sink::table::Field;
use crate::status::Status;

/// Their names.
pub const FILES: [&str; 2] = ["shape.csv", "contacts.csv"];
/// Taps of which shapes are written at most.
pub const MOST_TAPS: u64 = 10_000;

/// Columns of `shape.csv`; the place of the drive is told by its name.
pub const COLUMNS: [&str; 14] = [
    "tap",
    "D_mm",
    "d_mm",
    "L_a_mm",
    "x_ss_mm",
    "l_mm",
    "a_mm",
    "theta_deg",
    "s_mm",
    "x_mm",
    "y_mm",
    "psi_deg",
    "direction_deg",
    "strain",
];

/// Columns of `contacts.csv`.
pub const CONTACTS: [&str; 22] = [
    "tap",
    "D_mm",
    "d_mm",
    "L_a_mm",
    "x_ss_mm",
    "l_mm",
    "a_mm",
    "theta_deg",
    "hub_mm",
    "gauge_from_mm",
    "gauge_to_mm",
    "strain",
    "normal_force_N",
    "tangential_force_N",
    "contact_arc_mm",
    "contact_x_mm",
    "contact_y_mm",
    "pole_x_mm",
    "pole_y_mm",
    "pole_radius_mm",
    "contact_state",
    "status",
];

/// What was written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Taps.
    pub taps: usize,
    /// Taps with a shape.
    pub shapes: usize,
}

/// Writes both tables of the taps of `spec`, each with `nodes` sections from clamp to contact.
///
/// # Errors
/// Too many taps; poles that are not upright; a backend or a file that fails.
pub fn write(spec: &Spec, method: Method, nodes: usize, folder: &mut Folder) -> Result<Counts, Error> {
    let setup = &spec.study.setup;
    let tuples = tuples(&spec.study.space)?;
    if let Some(t) = tuples.iter().find(|t| !t.direction().is_upright()) {
        let error =
            InputError::new("the tables of a shape have no place for what is out of the plane of rotation");
        let value = format!("tilt {} and lean {} degrees", t.tilt, t.lean);
        return Err(error.key("tap.tilt").value(value).allowed("tilt = 0 and lean = 0").into());
    }
    let designs: Vec<Design> = tuples.iter().map(|t| Design::new(setup, *t)).collect();
    let task = |(i, t): (usize, &Tuple)| Task::of(i as u32, t);
    let tasks: Vec<Task> = tuples.iter().enumerate().map(task).collect();
    let outcomes = Evaluator::new(setup, method).run(&designs, &tasks)?;
    let (mut nodes_text, mut contacts) = (header(&COLUMNS, setup)?, header(&CONTACTS, setup)?);
    let mut counts = Counts { taps: tuples.len(), shapes: 0 };
    let failed = |e: csv::Error| Error::Run(e.to_string());
    for (i, ((design, task), outcome)) in designs.iter().zip(&tasks).zip(&outcomes).enumerate() {
        let bent = shape(setup, design, task, outcome, nodes);
        counts.shapes += usize::from(bent.is_some());
        let of = |s: &Shape| s.nodes.clone();
        for node in bent.as_ref().map(of).unwrap_or_default() {
            nodes_text.row(&mut section(i, &tuples[i], &node)).map_err(failed)?;
        }
        contacts.row(&mut contact(setup, i, design, &tuples[i], outcome, bent.as_ref())).map_err(failed)?;
    }
    for (name, text) in FILES.into_iter().zip([nodes_text, contacts]) {
        let mut file = folder.file(name)?;
        file.write(&text.into_bytes())?;
        file.close()?;
    }
    Ok(counts)
}

fn header(columns: &[&'static str], setup: &Setup) -> Result<Text, Error> {
    let mut text = Text::default();
    let names: Vec<&str> = columns
        .iter()
        .map(|c| if *c == "theta_deg" { Column::Drive.name(setup.drive) } else { *c })
        .collect();
    text.header(&names).map_err(|e| Error::Run(e.to_string()))?;
    Ok(text)
}

fn tuples(space: &Space) -> Result<Vec<Tuple>, InputError> {
    let many = |n: u64| {
        InputError::new("these are too many taps to look at")
            .value(n)
            .key("tuples")
            .allowed(format!("{MOST_TAPS} at most"))
    };
    match space {
        Space::List(tuples) if tuples.len() as u64 > MOST_TAPS => Err(many(tuples.len() as u64)),
        Space::List(tuples) => Ok(tuples.clone()),
        Space::File(file) => Err(many(file.len() as u64)),
        Space::Grid(_) => {
            let layout = space.layout().expect("a grid has a layout");
            if layout.len() > MOST_TAPS {
                return Err(many(layout.len()));
            }
            Ok((0..layout.len()).map(|i| layout.tuple(i)).collect())
        }
    }
}

/// What a tap is of.
fn tap_columns(t: &Tuple) -> impl Iterator<Item = Field> {
    [t.D, t.d, t.L_a, t.x_ss, t.l, t.a, t.drive].map(Field::Number).into_iter()
}

fn section(tap: usize, tuple: &Tuple, node: &Node) -> Vec<Field> {
    let mut row = vec![Field::Count(tap as u64)];
    row.extend(tap_columns(tuple));
    let angles = [node.psi, node.direction].map(f64::to_degrees);
    row.extend([node.s, node.at.x, node.at.y, angles[0], angles[1], node.strain].map(Field::Number));
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
    row.extend(tap_columns(tuple));
    let gauge = design.shared.as_ref().map_or([f64::NAN; 2], |s| s.gauge);
    let at = bent.map_or([f64::NAN; 4], |s| [s.contact.x, s.contact.y, s.pole.x, s.pole.y]);
    let solved = [o.strain, o.normal_force, o.tangential_force, o.arc];
    row.extend(
        [setup.hub]
            .into_iter()
            .chain(gauge)
            .chain(solved)
            .chain(at)
            .chain([setup.model.pole_radius])
            .map(Field::Number),
    );
    row.push(Field::Word(match (o.arc.is_finite(), o.sticking) {
        (false, _) => "",
        (_, true) => "stick",
        _ => "slide",
    }));
    let bent_or = if bent.is_none() && o.status == Status::OK { Status::MATERIAL_LIMIT } else { o.status };
    row.push(Field::Status(bent_or));
    row
}
