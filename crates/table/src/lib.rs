//! Output: tables, the result folder, `run.json`.

pub mod fields;
pub mod folder;
pub mod frame;
pub mod heading;
pub mod lab;
pub mod parquet;
pub mod read;
pub mod run_json;
pub mod shard;
pub mod sheet;
pub mod table;
pub mod text_file;
pub mod values;

pub use folder::{Folder, Question, Written, hash};
pub use frame::Frame;
pub use heading::{Heading, heading};
pub use lab::{LabCell, LabRow, LabStream, LabTable};
pub use shard::Shard;
pub use sheet::{Sheet, TableFormat, free_memory};
pub use table::{AtDistance, AtDrive, Table, TapRow, WHISKER, drive_unit};
pub use values::{Field, Values};

pub(crate) use vibrissa_core::{combinations, design, error, estimate, reduce, scene, status};
pub(crate) use vibrissa_evaluate::{evaluate, statistics};
pub(crate) use vibrissa_kernel as kernel;

/// The git commit of the build, if known.
pub const COMMIT: Option<&str> = option_env!("VIBRISSA_COMMIT");
