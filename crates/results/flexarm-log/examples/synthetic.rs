//! Writes one synthetic run as CSV and MCAP:
//! `cargo run --release --example synthetic -- FOLDER`.
//!
//! Expect 1001 rows, an error of at most 2.11 mm and of 1.30 mm at the end, and in
//! `FOLDER/run.mcap` an arm that swings by 1.2 rad, with its rigid twin drawn transparently.
#![allow(non_snake_case, reason = "monogram notation: X_WL, pose of L in W")]

#[path = "../tests/synthetic/mod.rs"]
mod synthetic;

use flexarm_log::{CreateOptions, CsvRecorder, LogError, RecorderSet};

fn main() -> Result<(), LogError> {
    let folder = std::path::PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let options = CreateOptions::default().with_overwrite(true);

    let mut recorders = RecorderSet::new();
    recorders.push(Box::new(CsvRecorder::create(folder.join("run.csv"), options)));
    #[cfg(feature = "mcap")]
    recorders.push(Box::new(flexarm_log::McapRecorder::create(folder.join("run.mcap"), options)));

    recorders.begin(&synthetic::header())?;
    for step in 0..synthetic::SAMPLES {
        recorders.record(&synthetic::sample(step))?;
    }
    recorders.finish(&synthetic::result())
}
