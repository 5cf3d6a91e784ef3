//! Files of a map: table of all poses, page, recording, figures.
//!
//! Start at [`places`] before the computation and [`save`] after it. The table is Parquet, or CSV in
//! builds without it. Not here: what is on the page (`page.rs`) and in the recording (`recording.rs`).

use std::path::{Path, PathBuf};

use flexarm_files::{check_free, write_all};
use flexarm_log::RecordingFormat;
#[cfg(feature = "parquet")]
use flexarm_log::{CreateOptions, DataColumn, DataTable, DataValues};

#[cfg(feature = "parquet")]
use super::MapColumn;
#[cfg(not(feature = "parquet"))]
use super::MapTable;
use super::region::Grid;
use super::{Map, MapRequest, page, recording};
use flexarm_run::{Arm, Error, Robot};

/// Paths of the files of a map.
pub(super) struct MapPaths {
    table: PathBuf,
    page: PathBuf,
    rrd: PathBuf,
    json: PathBuf,
}

/// File name of the table, whose format depends on the build.
const TABLE: &str = if cfg!(feature = "parquet") { "map.parquet" } else { "map.csv" };

/// Integer columns.
#[cfg(feature = "parquet")]
const WHOLE: [&str; 3] = ["place", "direction", "branch"];

/// Returns the paths of the files, after checking that they are free or may be overwritten.
pub(super) fn places(folder: &Path, overwrite: bool) -> Result<MapPaths, Error> {
    let at = |name: &str| folder.join(name);
    let paths = MapPaths { table: at(TABLE), page: at("map.html"), rrd: at("map.rrd"), json: at("map.json") };
    check_free(&[&paths.table, &paths.page, &paths.rrd, &paths.json].map(Clone::clone), overwrite)?;
    Ok(paths)
}

/// Writes the files.
pub(super) fn save(
    map: &mut Map,
    paths: &MapPaths,
    robot: &Robot,
    request: &MapRequest,
    arm: &Arm,
    grid: Option<&Grid>,
) -> Result<(), Error> {
    let text = |path: &Path| Some(path.display().to_string());
    map.file = text(&paths.table);
    map.files.table = text(&paths.table);
    map.files.page = text(&paths.page);
    map.files.json = text(&paths.json);
    map.files.rrd = text(&paths.rrd).filter(|_| RecordingFormat::Rrd.is_built_in());
    let page = page::html(map, grid).into_bytes();
    let json = serde_json::to_string_pretty(map).expect("plain numbers and strings") + "\n";
    // First of all, since it makes the folder and refuses if the call was broken off.
    write_all(&[(paths.page.clone(), page), (paths.json.clone(), json.into_bytes())])?;
    write_table(map, &paths.table, request.overwrite)?;
    recording::write(map, &paths.rrd, robot, request, arm, grid)
}

/// Writes the table with its texts.
#[cfg(feature = "parquet")]
fn write_table(map: &Map, path: &Path, overwrite: bool) -> Result<(), Error> {
    let texts = [
        ("robot", map.robot.clone()),
        ("tcp", map.tcp.clone()),
        ("by", map.by.clone()),
        ("units", "SI: m, rad, N, N m, Hz; as in the names of the columns".to_owned()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    let meanings = map.table.columns.iter().map(|column| (format!("column.{}", column.name), column.meaning.clone()));
    let texts = texts.into_iter().map(|(key, value)| (key.to_owned(), value)).chain(meanings).collect();
    let column = |(k, column): (usize, &MapColumn)| {
        let numbers = map.table.at(k);
        let values = match WHOLE.contains(&column.name.as_str()) {
            true => DataValues::Whole(numbers.iter().map(|x| *x as i64).collect()),
            false => DataValues::Number(numbers),
        };
        DataColumn::new(column.name.clone(), values)
    };
    let columns = map.table.columns.iter().enumerate().map(column).collect();
    let options = CreateOptions::default().with_overwrite(overwrite);
    Ok(DataTable { columns, texts }.write(path, options)?)
}

#[cfg(not(feature = "parquet"))]
fn write_table(map: &Map, path: &Path, _: bool) -> Result<(), Error> {
    use std::fmt::Write as _;

    use flexarm_settings::written::csv_field;

    let MapTable { columns, .. } = &map.table;
    let mut text = columns.iter().map(|column| csv_field(&column.name)).collect::<Vec<_>>().join(",") + "\n";
    for k in 0..map.table.rows() {
        for (i, value) in map.table.row(k).iter().enumerate() {
            let _ = write!(text, "{}{value}", if i == 0 { "" } else { "," });
        }
        text.push('\n');
    }
    Ok(write_all(&[(path.to_owned(), text.into_bytes())])?)
}
