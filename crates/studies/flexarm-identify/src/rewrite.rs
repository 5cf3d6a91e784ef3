//! Replacement of values in a robot file by identified ones; everything else stays as written.

use std::path::Path;

use crate::estimation::ParameterEstimate;
use crate::estimation::parameter::displacement;
use flexarm_kinematics::Pose;
use flexarm_run::Calibration;
use flexarm_stepping::GuideTerm;
use nalgebra::{Matrix6, Rotation3, Translation3, Vector3};
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::parameters::ParameterLocation;

/// Reason why identified values cannot be written to a robot file.
#[derive(Debug, thiserror::Error)]
#[doc(hidden)]
pub enum RewriteError {
    #[error("{0}")]
    Syntax(#[from] toml_edit::TomlError),
    #[error("there is no [[{list}]] with {key} = {name:?}")]
    NoTable { list: &'static str, key: &'static str, name: String },
    #[error("there is no {0}")]
    Missing(&'static str),
    #[error("the drive of joint {joint:?} has no gearbox.{key}")]
    NoGearbox { joint: String, key: &'static str },
    #[error("link {link:?} has no stiffness_factors[{entry}]")]
    NoFactor { link: String, entry: usize },
    #[error("{list} has no entry {entry}")]
    NoEntry { list: String, entry: usize },
    #[error("{what} is not {expected}")]
    Form { what: String, expected: &'static str },
}

/// Returns the text of the robot file with the identified values; each is listed in a comment with
/// its standard deviation.
///
/// * `tool`: link of the tool and its present pose in the link.
/// * `calibrations`: corrections of joint frames in the old file.
/// * `home`: folder of the old file; `to`: folder of the new file. Relative paths in the file are
///   rewritten if they differ.
#[doc(hidden)]
pub fn rewritten(
    text: &str,
    found: &[(ParameterEstimate, ParameterLocation)],
    tool: (&str, &Pose),
    calibrations: &[Calibration],
    home: &Path,
    to: &Path,
) -> Result<String, RewriteError> {
    let mut file: DocumentMut = text.parse()?;
    for (parameter, written) in found {
        put(&mut file, parameter, written)?;
    }
    put_tool(&mut file, found, tool)?;
    put_frames(&mut file, found, calibrations)?;
    if home != to {
        moved_paths(&mut file, home, to);
    }
    Ok(comments(found) + &file.to_string())
}

/// Writes one value to its place; the pose of the tool is left to [`put_tool`].
fn put(file: &mut DocumentMut, found: &ParameterEstimate, written: &ParameterLocation) -> Result<(), RewriteError> {
    let number = exact(found.value);
    match written {
        ParameterLocation::Gearbox { joint, entry } => {
            let missing = || RewriteError::NoGearbox { joint: joint.clone(), key: "stiffness" };
            let drive = named(file, "drive", "joint", joint)?;
            let gearbox = drive.get_mut("gearbox").and_then(Item::as_table_like_mut).ok_or_else(missing)?;
            put_stiffness(gearbox.get_mut("stiffness").ok_or_else(missing)?, *entry, found)?;
            gearbox.insert("identified", toml_edit::value(true));
            Ok(())
        }
        ParameterLocation::Seat { joint, entry } => {
            let gearbox = named(file, "drive", "joint", joint)?.get_mut("gearbox").and_then(Item::as_table_like_mut);
            let seat = gearbox.and_then(|gearbox| gearbox.get_mut("seat"));
            let missing = || RewriteError::NoGearbox { joint: joint.clone(), key: "seat" };
            put_stiffness(seat.ok_or_else(missing)?, Some(*entry), found)
        }
        ParameterLocation::GearboxDamping { joint, entry } => {
            put_gear_damping(named(file, "drive", "joint", joint)?, joint, *entry, found)
        }
        ParameterLocation::Link { link } => {
            named(file, "flexible_link", "link", link)?.insert("stiffness_factor", toml_edit::value(number));
            Ok(())
        }
        ParameterLocation::LinkDirection { link, entry } => {
            put_link_direction(named(file, "flexible_link", "link", link)?, *entry, number)
                .ok_or_else(|| RewriteError::NoFactor { link: link.clone(), entry: *entry })
        }
        ParameterLocation::LinkDamping { link } => {
            put_link_damping(named(file, "flexible_link", "link", link)?, link, found)
        }
        ParameterLocation::LinkEntry { link, row, column, K } => {
            let entry = named(file, "flexible_link", "link", link)?;
            put_entry(entry, (*row, *column), K, number).ok_or_else(|| RewriteError::Form {
                what: format!("the stiffness of link {link:?}"),
                expected: "a 6x6 matrix",
            })
        }
        ParameterLocation::Tool { .. } | ParameterLocation::Frame { .. } => Ok(()),
        ParameterLocation::Guide { joint, axis, term } => {
            put_guide(named(file, "drive", "joint", joint)?, *axis, *term, number)
                .ok_or_else(|| RewriteError::NoGearbox { joint: joint.clone(), key: "guide" })
        }
        ParameterLocation::Mounting { entry } => {
            let mounting = file.get_mut("mounting").and_then(Item::as_table_like_mut);
            let stiffness = mounting.and_then(|mounting| mounting.get_mut("stiffness"));
            put_stiffness(stiffness.ok_or(RewriteError::Missing("mounting.stiffness"))?, Some(*entry), found)
        }
        ParameterLocation::Mass { link, flexible: true } => {
            named(file, "flexible_link", "link", link)?.insert("mass", toml_edit::value(number));
            Ok(())
        }
        ParameterLocation::Mass { link, flexible: false } => {
            entry_of(file, "inertial", "link", link)?.insert("mass", toml_edit::value(number));
            Ok(())
        }
        ParameterLocation::Com { link, axis, com } => {
            let entry = entry_of(file, "inertial", "link", link)?;
            if entry.get("com").is_none() {
                entry.insert("com", toml_edit::value(com.iter().copied().collect::<Array>()));
            }
            let old = entry.get_mut("com").and_then(Item::as_array_mut).and_then(|com| com.get_mut(*axis));
            replace(old.ok_or(RewriteError::Missing("inertial.com"))?, number);
            Ok(())
        }
        ParameterLocation::Payload => {
            let payload = file.get_mut("payload").and_then(Item::as_table_like_mut);
            payload.ok_or(RewriteError::Missing("payload"))?.insert("mass", toml_edit::value(number));
            Ok(())
        }
    }
}

/// Returns the header comment that lists the identified values.
fn comments(found: &[(ParameterEstimate, ParameterLocation)]) -> String {
    let mut out = String::from("# Identified by flexarm identify: value, standard deviation, previous value.\n");
    let mut last = "";
    for (ParameterEstimate { name, unit, value, std, initial, identifiable, rigid, .. }, _) in found {
        // Tied parameters have several places.
        if std::mem::replace(&mut last, name) == name {
            continue;
        }
        let deviation = match (std.is_finite(), rigid) {
            (true, _) => format!("+- {} {unit}", plain(rounded(*std, *std))),
            (false, true) => format!("{unit} (rigid within the readings)"),
            (false, false) => format!("{unit} (not determined alone)"),
        };
        let value = if *identifiable { rounded(*value, *std) } else { rounded(*value, 1e-4 * value.abs()) };
        out += &format!("#   {name} = {} {deviation}, was {}\n", plain(value), plain(*initial));
    }
    out + "\n"
}

/// Formats a number with the digits it has, small ones with an exponent.
fn plain(x: f64) -> String {
    let text = format!("{x:?}");
    text.strip_suffix(".0").map_or_else(|| text.clone(), str::to_owned)
}

/// Rounds a value to twelve digits, so that the file is the model whose residuals are reported.
fn exact(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// Rounds a value to two digits beyond the first digit of its deviation, for comments.
fn rounded(value: f64, std: f64) -> f64 {
    if !(std > 0.0 && std.is_finite() && value.is_finite()) {
        return value;
    }
    let place = std.log10().floor() as i32 - 2;
    let text = match place {
        0.. => {
            let unit = 10f64.powi(place);
            format!("{}", (value / unit).round() * unit)
        }
        _ => format!("{value:.*}", place.unsigned_abs() as usize),
    };
    text.parse().unwrap_or(value)
}

/// Returns the entry with a given name in an array of tables.
fn named<'a>(
    file: &'a mut DocumentMut,
    list: &'static str,
    key: &'static str,
    name: &str,
) -> Result<&'a mut dyn TableLike, RewriteError> {
    let missing = || RewriteError::NoTable { list, key, name: name.to_owned() };
    let is_it = |table: &dyn TableLike| table.get(key).and_then(Item::as_str) == Some(name);
    match file.get_mut(list) {
        Some(Item::ArrayOfTables(tables)) => tables
            .iter_mut()
            .find(|table| is_it(*table as &Table))
            .map(|table| table as &mut dyn TableLike)
            .ok_or_else(missing),
        Some(Item::Value(Value::Array(values))) => values
            .iter_mut()
            .filter_map(Value::as_inline_table_mut)
            .find(|table| is_it(*table as &toml_edit::InlineTable))
            .map(|table| table as &mut dyn TableLike)
            .ok_or_else(missing),
        _ => Err(missing()),
    }
}

fn put_stiffness(item: &mut Item, entry: Option<usize>, found: &ParameterEstimate) -> Result<(), RewriteError> {
    let what = || "gearbox.stiffness".to_owned();
    let value =
        item.as_value_mut().ok_or_else(|| RewriteError::Form { what: what(), expected: "a number or a list" })?;
    let number = exact(found.value);
    match (value, entry) {
        (Value::Array(list), Some(k)) => {
            let old = list.get_mut(k).ok_or_else(|| RewriteError::NoEntry { list: what(), entry: k })?;
            replace(old, number);
        }
        // Full matrix: scales every entry by the factor.
        (Value::Array(rows), None) => {
            for cell in rows.iter_mut().filter_map(Value::as_array_mut).flat_map(toml_edit::Array::iter_mut) {
                let old = cell.as_float().or_else(|| cell.as_integer().map(|n| n as f64)).unwrap_or(0.0);
                replace(cell, old * found.value);
            }
        }
        (value, _) => replace(value, number),
    }
    Ok(())
}

/// Sets an entry of a link's `stiffness_factors`. A missing list is written as ones first.
fn put_link_direction(link: &mut dyn TableLike, entry: usize, number: f64) -> Option<()> {
    if link.get("stiffness_factors").is_none() {
        let ones: Array = [1.0; 6].into_iter().collect();
        link.insert("stiffness_factors", toml_edit::value(ones));
    }
    replace(link.get_mut("stiffness_factors").and_then(Item::as_array_mut)?.get_mut(entry)?, number);
    Some(())
}

/// Sets the damping of a link, as modal damping if it has none.
fn put_link_damping(link: &mut dyn TableLike, name: &str, found: &ParameterEstimate) -> Result<(), RewriteError> {
    let damping = link.get_mut("damping").and_then(Item::as_table_like_mut);
    match damping.and_then(|damping| damping.iter_mut().next().map(|(_, value)| value)) {
        Some(value) => {
            let not_one = || RewriteError::Form { what: format!("the damping of link {name:?}"), expected: "a number" };
            put_damping(value.as_value_mut().ok_or_else(not_one)?, found);
        }
        None => {
            let mut modal = InlineTable::new();
            modal.insert("modal", exact(found.value).into());
            link.insert("damping", toml_edit::value(modal));
        }
    }
    Ok(())
}

/// Sets an entry of a link's `stiffness` and its symmetric counterpart. A missing `stiffness` is
/// written as `K` first.
fn put_entry(link: &mut dyn TableLike, place: (usize, usize), K: &Matrix6<f64>, number: f64) -> Option<()> {
    if link.get("stiffness").is_none() {
        let mut rows: Array = (0..6).map(|i| (0..6).map(|j| K[(i, j)]).collect::<Array>()).collect();
        rows.iter_mut().for_each(|row| row.decor_mut().set_prefix("\n    "));
        rows.set_trailing_comma(true);
        rows.set_trailing("\n");
        link.insert("stiffness", toml_edit::value(rows));
    }
    let rows = link.get_mut("stiffness").and_then(Item::as_array_mut)?;
    for (i, j) in [place, (place.1, place.0)] {
        replace(rows.get_mut(i)?.as_array_mut()?.get_mut(j)?, number);
    }
    Some(())
}

/// Writes the pose of the tool, moved and rotated about its own axes by the identified values.
fn put_tool(
    file: &mut DocumentMut,
    found: &[(ParameterEstimate, ParameterLocation)],
    tool: (&str, &Pose),
) -> Result<(), RewriteError> {
    let mut shift = [0.0; 6];
    for (parameter, written) in found {
        if let ParameterLocation::Tool { axis } = written {
            shift[*axis] = parameter.value;
        }
    }
    if shift == [0.0; 6] {
        return Ok(());
    }
    let part = |first: usize| Vector3::new(shift[first], shift[first + 1], shift[first + 2]);
    let X_LT = tool.1 * Pose::from_parts(Translation3::from(part(0)), Rotation3::new(part(3)));
    if file.get("tcp").is_none() {
        let link = [("link", Value::from(tool.0))].into_iter().collect::<InlineTable>();
        file.insert("tcp", toml_edit::value(link));
    }
    let entry = file.get_mut("tcp").and_then(Item::as_table_like_mut);
    let entry = entry.ok_or_else(|| RewriteError::Form { what: "tcp".into(), expected: "a table" })?;
    let list = |values: [f64; 3]| values.map(exact).into_iter().collect::<Array>();
    entry.insert("xyz", toml_edit::value(list(X_LT.translation.vector.into())));
    if part(3) != Vector3::zeros() {
        let (roll, pitch, yaw) = X_LT.rotation.euler_angles();
        entry.insert("rpy", toml_edit::value(list([roll, pitch, yaw])));
    }
    Ok(())
}

/// Writes the corrections of joint frames: those of the old file followed by the identified ones.
fn put_frames(
    file: &mut DocumentMut,
    found: &[(ParameterEstimate, ParameterLocation)],
    calibrations: &[Calibration],
) -> Result<(), RewriteError> {
    let mut corrections: Vec<(Calibration, Pose)> = Vec::new();
    for (parameter, written) in found {
        let ParameterLocation::Frame { joint, twist, axis, zero } = written else { continue };
        let at = corrections.iter().position(|(own, _)| own.joint == *joint).unwrap_or_else(|| {
            let old = calibrations.iter().find(|old| old.joint == *joint).cloned();
            let old = old.unwrap_or(Calibration { joint: joint.clone(), frame: Pose::identity(), zero: 0.0 });
            // The old zero acts after the old frame and before the identified corrections.
            let turned = displacement(&(axis * old.zero));
            corrections.push((old, turned));
            corrections.len() - 1
        });
        let (own, turned) = &mut corrections[at];
        match zero {
            true => own.zero += parameter.value,
            false => own.frame = own.frame * *turned * displacement(&(twist * parameter.value)) * turned.inverse(),
        }
    }
    for (Calibration { joint, frame, zero }, _) in corrections {
        let entry = entry_of(file, "calibration", "joint", &joint)?;
        let list = |values: [f64; 3]| values.map(exact).into_iter().collect::<Array>();
        let (roll, pitch, yaw) = frame.rotation.euler_angles();
        for (key, values) in [("xyz", frame.translation.vector.into()), ("rpy", [roll, pitch, yaw])] {
            if values != [0.0; 3] {
                entry.insert(key, toml_edit::value(list(values)));
            }
        }
        if zero != 0.0 {
            let zero = exact(zero);
            match entry.get_mut("zero").and_then(Item::as_value_mut) {
                Some(old) => replace(old, zero),
                None => {
                    entry.insert("zero", toml_edit::value(zero));
                }
            }
        }
    }
    Ok(())
}

/// Returns the entry with a given name in an array of tables, a new one if the file has none.
fn entry_of<'a>(
    file: &'a mut DocumentMut,
    list: &'static str,
    key: &'static str,
    name: &str,
) -> Result<&'a mut dyn TableLike, RewriteError> {
    if named(file, list, key, name).is_err() {
        let mut table = Table::new();
        table.insert(key, toml_edit::value(name));
        match file.entry(list).or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new())) {
            Item::ArrayOfTables(tables) => tables.push(table),
            Item::Value(Value::Array(values)) => values.push(table.into_inline_table()),
            _ => return Err(RewriteError::Form { what: list.into(), expected: "a list of tables" }),
        }
    }
    named(file, list, key, name)
}

/// Sets a number of the guide of a drive.
fn put_guide(drive: &mut dyn TableLike, axis: char, term: GuideTerm, number: f64) -> Option<()> {
    let gearbox = drive.get_mut("gearbox")?.as_table_like_mut()?;
    let guide = gearbox.get_mut("guide")?.as_table_like_mut()?;
    let tilt = guide.get_mut(&axis.to_string())?.as_table_like_mut()?;
    let key = match term {
        GuideTerm::Compliance(k) => {
            replace(tilt.get_mut("compliance")?.as_array_mut()?.get_mut(k)?, number);
            return Some(());
        }
        GuideTerm::Gap => "gap",
        GuideTerm::Centre => "centre",
        GuideTerm::Width => "width",
    };
    let play = tilt.get_mut("play")?.as_table_like_mut()?;
    match play.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => replace(old, number),
        None => {
            play.insert(key, toml_edit::value(number));
        }
    }
    Some(())
}

/// Sets the damping of a gearbox, or one entry of it.
fn put_gear_damping(
    drive: &mut dyn TableLike,
    joint: &str,
    entry: Option<usize>,
    found: &ParameterEstimate,
) -> Result<(), RewriteError> {
    let gearbox = drive.get_mut("gearbox").and_then(Item::as_table_like_mut);
    let damping = gearbox.and_then(|gearbox| gearbox.get_mut("damping")).and_then(Item::as_value_mut);
    let missing = || RewriteError::NoGearbox { joint: joint.to_owned(), key: "damping" };
    let damping = damping.ok_or_else(missing)?;
    match (damping, entry) {
        (Value::Array(list), Some(k)) => {
            let missing = || RewriteError::NoEntry { list: format!("gearbox.damping of {joint:?}"), entry: k };
            let old = list.get_mut(k).ok_or_else(missing)?;
            replace(old, exact(found.value));
        }
        (damping, _) => put_damping(damping, found),
    }
    Ok(())
}

/// Sets a number to the new value; scales the entries of a longer list by the ratio of new to
/// initial.
fn put_damping(item: &mut Value, found: &ParameterEstimate) {
    let factor = found.value / found.initial;
    match item {
        Value::Array(list) if list.len() == 1 => {
            list.iter_mut().for_each(|cell| replace(cell, exact(found.value)));
        }
        Value::Array(list) => {
            for cell in list.iter_mut() {
                let old = cell.as_float().or_else(|| cell.as_integer().map(|n| n as f64)).unwrap_or(0.0);
                replace(cell, old * factor);
            }
        }
        number => replace(number, exact(found.value)),
    }
}

/// Replaces a number and keeps the spaces and comments around it.
fn replace(old: &mut Value, number: f64) {
    let decor = old.decor().clone();
    *old = Value::from(number);
    *old.decor_mut() = decor;
}

/// Rewrites the relative paths of a file for another folder.
pub fn moved_paths(file: &mut DocumentMut, home: &Path, to: &Path) {
    let moved = |text: &str| -> Option<String> {
        let path = Path::new(text);
        path.is_relative().then(|| relative(&home.join(path), to).display().to_string().replace('\\', "/"))
    };
    let change = |item: Option<&mut Item>| {
        let Some(value) = item.and_then(Item::as_value_mut) else { return };
        if let Some(new) = value.as_str().and_then(moved) {
            let decor = value.decor().clone();
            *value = Value::from(new);
            *value.decor_mut() = decor;
        }
    };
    change(file.get_mut("urdf"));
    change(file.get_mut("default_trajectory"));
    if let Some(packages) = file.get_mut("packages").and_then(Item::as_table_like_mut) {
        packages.iter_mut().for_each(|(_, item)| change(Some(item)));
    }
    if let Some(Item::ArrayOfTables(links)) = file.get_mut("flexible_link") {
        links.iter_mut().for_each(|link| change(link.get_mut("reduced")));
    }
}

/// Returns a path relative to a folder.
fn relative(path: &Path, from: &Path) -> std::path::PathBuf {
    let real =
        |path: &Path| path.canonicalize().unwrap_or_else(|_| std::path::absolute(path).unwrap_or_else(|_| path.into()));
    let (path, from) = (real(path), real(from));
    let shared = path.components().zip(from.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return path;
    }
    let up = from.components().skip(shared).map(|_| std::path::Component::ParentDir);
    up.chain(path.components().skip(shared)).collect()
}
