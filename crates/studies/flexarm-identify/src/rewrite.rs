//! Replacement of values in a robot file by identified ones; everything else stays as written.
//!
//! Start at `rewritten`. Each value goes to its `ParameterLocation`; poses are composed of several
//! values (`put_tool`, `put_frames`). Frames: L link of the tool, T tool.
//!
//! Not here: the choice of what is fitted (`choose.rs`), robots made of the new text.

use std::path::Path;

use flexarm_kinematics::Pose;
use flexarm_run::Calibration;
use flexarm_stepping::GuideTerm;
use nalgebra::{Matrix6, Rotation3, Translation3, Vector3};
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::parameters::ParameterLocation;
use crate::estimation::FittedParameter;
use crate::estimation::parameter::displacement;

/// Returns the text of the robot file with the identified values; each is listed in a comment with
/// its standard deviation.
///
/// * `tool`: link of the tool and its present pose in the link.
/// * `calibrations`: corrections of joint frames in the old file.
/// * `home`: folder of the old file; `to`: folder of the new file. Relative paths in the file are
///   rewritten if they differ.
///
/// # Errors
/// A message if the file has no place for a value.
#[doc(hidden)]
pub fn rewritten(
    text: &str,
    found: &[(FittedParameter, ParameterLocation)],
    tool: (&str, &Pose),
    calibrations: &[Calibration],
    home: &Path,
    to: &Path,
) -> Result<String, String> {
    let mut file: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| error.to_string())?;
    for (parameter, written) in found {
        put(&mut file, parameter, written)
            .ok_or_else(|| format!("there is no place for {} in the robot file", parameter.name))?;
    }
    put_tool(&mut file, found, tool).ok_or("tcp is not a table")?;
    put_frames(&mut file, found, calibrations).ok_or("calibration is not a list of tables")?;
    if home != to {
        moved_paths(&mut file, home, to);
    }
    Ok(comments(found) + &file.to_string())
}

/// Writes one value to its place; the pose of the tool and the joint frames are left to [`put_tool`]
/// and [`put_frames`]. Returns `None` without a place.
fn put(file: &mut DocumentMut, found: &FittedParameter, written: &ParameterLocation) -> Option<()> {
    match written {
        ParameterLocation::Gearbox { joint, .. }
        | ParameterLocation::Seat { joint, .. }
        | ParameterLocation::GearboxDamping { joint, .. }
        | ParameterLocation::Guide { joint, .. } => {
            put_in_gearbox(inside(named(file, "drive", "joint", joint)?, &["gearbox"])?, found, written)
        }
        ParameterLocation::Link { link }
        | ParameterLocation::LinkDirection { link, .. }
        | ParameterLocation::LinkDamping { link }
        | ParameterLocation::LinkEntry { link, .. }
        | ParameterLocation::Mass { link, flexible: true } => {
            put_in_link(named(file, "flexible_link", "link", link)?, found, written)
        }
        // Not in the robot file: the tool and the frames of the measurements.
        ParameterLocation::Tool { .. } | ParameterLocation::Frame { .. } => Some(()),
        ParameterLocation::Mounting { entry } => {
            put_number(inside(file.as_table_mut(), &["mounting", "stiffness"])?, Some(*entry), found)
        }
        ParameterLocation::Payload => {
            set(file.get_mut("payload")?.as_table_like_mut()?, "mass", exact(found.value));
            Some(())
        }
        ParameterLocation::Mass { link, flexible: false } => {
            set(entry_of(file, "inertial", "link", link)?, "mass", exact(found.value));
            Some(())
        }
        ParameterLocation::Com { link, axis, com } => {
            let entry = entry_of(file, "inertial", "link", link)?;
            if entry.get("com").is_none() {
                entry.insert("com", toml_edit::value(com.iter().copied().collect::<Array>()));
            }
            put_number(entry.get_mut("com")?, Some(*axis), found)
        }
    }
}

/// Writes a value to the `gearbox` of a `[[drive]]`.
fn put_in_gearbox(gearbox: &mut Item, found: &FittedParameter, written: &ParameterLocation) -> Option<()> {
    let gearbox = gearbox.as_table_like_mut()?;
    match written {
        ParameterLocation::Gearbox { entry, .. } => {
            put_number(gearbox.get_mut("stiffness")?, *entry, found)?;
            gearbox.insert("identified", toml_edit::value(true));
            Some(())
        }
        ParameterLocation::Seat { entry, .. } => put_number(gearbox.get_mut("seat")?, Some(*entry), found),
        ParameterLocation::GearboxDamping { entry, .. } => put_number(gearbox.get_mut("damping")?, *entry, found),
        ParameterLocation::Guide { axis, term, .. } => {
            let tilt = inside(gearbox, &["guide", &axis.to_string()])?.as_table_like_mut()?;
            let key = match term {
                GuideTerm::Compliance(k) => return put_number(tilt.get_mut("compliance")?, Some(*k), found),
                GuideTerm::Gap => "gap",
                GuideTerm::Centre => "centre",
                GuideTerm::Width => "width",
            };
            set(tilt.get_mut("play")?.as_table_like_mut()?, key, exact(found.value));
            Some(())
        }
        _ => None,
    }
}

/// Writes a value to a `[[flexible_link]]`.
fn put_in_link(link: &mut dyn TableLike, found: &FittedParameter, written: &ParameterLocation) -> Option<()> {
    let number = exact(found.value);
    match written {
        ParameterLocation::Link { .. } => {
            link.insert("stiffness_factor", toml_edit::value(number));
        }
        ParameterLocation::LinkDirection { entry, .. } => {
            if link.get("stiffness_factors").is_none() {
                link.insert("stiffness_factors", toml_edit::value([1.0; 6].into_iter().collect::<Array>()));
            }
            put_number(link.get_mut("stiffness_factors")?, Some(*entry), found)?;
        }
        ParameterLocation::LinkDamping { .. } => {
            let damping = link.get_mut("damping").and_then(Item::as_table_like_mut);
            match damping.and_then(|damping| damping.iter_mut().next().map(|(_, value)| value)) {
                Some(value) => put_number(value, None, found)?,
                None => {
                    let modal = [("modal", Value::from(number))].into_iter().collect::<InlineTable>();
                    link.insert("damping", toml_edit::value(modal));
                }
            }
        }
        ParameterLocation::LinkEntry { row, column, K, .. } => put_entry(link, (*row, *column), K, number)?,
        ParameterLocation::Mass { .. } => set(link, "mass", number),
        _ => return None,
    }
    Some(())
}

/// Returns the header comment that lists the identified values.
fn comments(found: &[(FittedParameter, ParameterLocation)]) -> String {
    let mut out = String::from("# Identified by flexarm identify: value, standard deviation, previous value.\n");
    let mut last = "";
    for (FittedParameter { name, unit, value, std, initial, identifiable, rigid, .. }, _) in found {
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
fn named<'a>(file: &'a mut DocumentMut, list: &str, key: &str, name: &str) -> Option<&'a mut dyn TableLike> {
    let is_it = |table: &dyn TableLike| table.get(key).and_then(Item::as_str) == Some(name);
    match file.get_mut(list)? {
        Item::ArrayOfTables(tables) => {
            let found = tables.iter_mut().find(|table| is_it(*table as &Table));
            found.map(|table| table as &mut dyn TableLike)
        }
        Item::Value(Value::Array(values)) => {
            let found = values.iter_mut().filter_map(Value::as_inline_table_mut);
            found.map(|table| table as &mut dyn TableLike).find(|table| is_it(*table))
        }
        _ => None,
    }
}

/// Returns the item at the end of a path of keys.
fn inside<'a>(table: &'a mut dyn TableLike, keys: &[&str]) -> Option<&'a mut Item> {
    let (first, rest) = keys.split_first()?;
    let item = table.get_mut(first)?;
    if rest.is_empty() { Some(item) } else { inside(item.as_table_like_mut()?, rest) }
}

/// Sets a number, or one of a list. Without an entry a list of several numbers or a matrix is scaled by
/// the ratio of new to initial value.
fn put_number(item: &mut Item, entry: Option<usize>, found: &FittedParameter) -> Option<()> {
    let number = exact(found.value);
    match (item.as_value_mut()?, entry) {
        (Value::Array(list), Some(k)) => replace(list.get_mut(k)?, number),
        (Value::Array(list), None) if list.len() == 1 => replace(list.get_mut(0)?, number),
        (Value::Array(list), None) => list.iter_mut().for_each(|value| scale(value, found.value / found.initial)),
        (value, _) => replace(value, number),
    }
    Some(())
}

/// Multiplies all numbers of a value by a factor.
fn scale(value: &mut Value, factor: f64) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(|value| scale(value, factor)),
        value => {
            if let Some(old) = value.as_float().or_else(|| value.as_integer().map(|n| n as f64)) {
                replace(value, old * factor);
            }
        }
    }
}

/// Sets the number of a key, which is new if the table does not have it.
fn set(table: &mut dyn TableLike, key: &str, number: f64) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => replace(old, number),
        None => {
            table.insert(key, toml_edit::value(number));
        }
    }
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
fn put_tool(file: &mut DocumentMut, found: &[(FittedParameter, ParameterLocation)], tool: (&str, &Pose)) -> Option<()> {
    let mut shift = [0.0; 6];
    for (parameter, written) in found {
        if let ParameterLocation::Tool { axis } = written {
            shift[*axis] = parameter.value;
        }
    }
    if shift == [0.0; 6] {
        return Some(());
    }
    // X_LT moved and turned about the axes of T.
    let part = |first: usize| Vector3::new(shift[first], shift[first + 1], shift[first + 2]);
    let X_LT = tool.1 * Pose::from_parts(Translation3::from(part(0)), Rotation3::new(part(3)));
    // A file without a tool gets one, on the link of the robot's tool.
    if file.get("tcp").is_none() {
        let link = [("link", Value::from(tool.0))].into_iter().collect::<InlineTable>();
        file.insert("tcp", toml_edit::value(link));
    }
    let entry = file.get_mut("tcp")?.as_table_like_mut()?;
    let list = |values: [f64; 3]| values.map(exact).into_iter().collect::<Array>();
    entry.insert("xyz", toml_edit::value(list(X_LT.translation.vector.into())));
    if part(3) != Vector3::zeros() {
        let (roll, pitch, yaw) = X_LT.rotation.euler_angles();
        entry.insert("rpy", toml_edit::value(list([roll, pitch, yaw])));
    }
    Some(())
}

/// Writes the corrections of joint frames: those of the old file followed by the identified ones.
fn put_frames(
    file: &mut DocumentMut,
    found: &[(FittedParameter, ParameterLocation)],
    calibrations: &[Calibration],
) -> Option<()> {
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
            set(entry, "zero", exact(zero));
        }
    }
    Some(())
}

/// Returns the entry with a given name in an array of tables, a new one if the file has none.
fn entry_of<'a>(file: &'a mut DocumentMut, list: &str, key: &str, name: &str) -> Option<&'a mut dyn TableLike> {
    if named(file, list, key, name).is_none() {
        let mut table = Table::new();
        table.insert(key, toml_edit::value(name));
        match file.entry(list).or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new())) {
            Item::ArrayOfTables(tables) => tables.push(table),
            Item::Value(Value::Array(values)) => values.push(table.into_inline_table()),
            _ => return None,
        }
    }
    named(file, list, key, name)
}

/// Replaces a value and keeps the spaces and comments around it.
fn replace(old: &mut Value, new: impl Into<Value>) {
    let decor = old.decor().clone();
    *old = new.into();
    *old.decor_mut() = decor;
}

/// Rewrites the relative paths of a robot file in the folder `home` for the folder `to`.
pub fn moved_paths(file: &mut DocumentMut, home: &Path, to: &Path) {
    let moved = |text: &str| -> Option<String> {
        let path = Path::new(text);
        path.is_relative().then(|| relative(&home.join(path), to).display().to_string().replace('\\', "/"))
    };
    let change = |item: Option<&mut Item>| {
        let Some(value) = item.and_then(Item::as_value_mut) else { return };
        if let Some(new) = value.as_str().and_then(moved) {
            replace(value, new);
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
