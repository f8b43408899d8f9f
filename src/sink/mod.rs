//! Where results go: tables, the result folder, `run.json`.

pub mod columns;
pub mod csv;
pub mod folder;
pub mod memory;
pub mod pack;
pub mod parquet;
pub mod rows;
pub mod run_json;
pub mod shard;
pub mod sheet;
pub mod table;
pub mod unfinished;
