//! Where results go: tables, the result folder, `run.json`.

pub mod columns;
pub mod csv;
pub mod folder;
pub mod run_json;
pub mod table;
pub mod unfinished;
