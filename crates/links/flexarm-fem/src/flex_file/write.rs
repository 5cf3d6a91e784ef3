//! Writes a [`ReducedLink`] as text that reads back to bitwise equal numbers.

use std::fmt::Write;

use flexarm_spatial::Pose;
use nalgebra::{Matrix3, Rotation3};

use super::{FORMAT, ORDER, VERSION};
use crate::reduced::{Provenance, ReducedLink};
use crate::rigid_part::RigidPart;

/// Writes a reduced-link file: SI units, `K_BB` in link axes, one matrix row per line.
///
/// Numbers are written in the shortest form that reads back to the same value. A rotation is
/// written as `rpy` if that reproduces every bit, otherwise as a matrix.
pub fn write_flex(link: &ReducedLink) -> String {
    let mut text = format!("format = \"{FORMAT}\"\nversion = {VERSION}\n");
    text += &format!("link = {}\n", quoted(&link.name));
    text += "\n[units]\nlength = \"m\"\nforce = \"N\"\nmass = \"kg\"\nangle = \"rad\"\n";
    text += &provenance(&link.provenance);

    text += &pose("interface.A", &link.X_LA);
    text += &pose("interface.B", &link.X_LB);
    text += &pose("split", &link.split.X_LS);

    text += "\n[stiffness]\nkind = \"6x6\"\naxes = \"link\"\n";
    text += &format!("order = \"{ORDER}\"\nmatrix = [\n");
    for row in link.K_BB.row_iter() {
        text += &format!("  {},\n", numbers(row.iter()));
    }
    text += "]\n";

    text += &checks(link);
    text += &super::details::write_details(link);
    text += &part("proximal", &link.proximal);
    text += &part("distal", &link.distal);
    text
}

fn provenance(p: &Provenance) -> String {
    let entries = [
        ("source", &p.source),
        ("method", &p.method),
        ("tie", &p.tie),
        ("units", &p.units),
        ("date", &p.date),
        ("note", &p.note),
    ];
    // `units` is written even if empty: without it, reading would insert the units of the file.
    let written = |(key, value): &(&str, &String)| !value.is_empty() || *key == "units";
    let line = |(key, value): (&str, &String)| format!("{key} = {}\n", quoted(value));
    let lines: String = entries.into_iter().filter(written).map(line).collect();
    format!("\n[provenance]\n{lines}")
}

fn pose(name: &str, X: &Pose) -> String {
    format!("\n[{name}]\n{}", pose_lines(X))
}

pub(super) fn pose_lines(X: &Pose) -> String {
    let mut text = format!("xyz = {}\n", numbers(X.translation.vector.iter()));
    let R = X.rotation.matrix();
    let (roll, pitch, yaw) = X.rotation.euler_angles();
    if *Rotation3::from_euler_angles(roll, pitch, yaw).matrix() == *R {
        text += &format!("rpy = {}\n", numbers([roll, pitch, yaw].iter()));
    } else {
        text += &format!("rotation = {}\n", rows(R));
    }
    text
}

fn checks(link: &ReducedLink) -> String {
    let entries = [
        ("asymmetry", Some(link.checks.asymmetry)),
        ("rigid_body_residual", link.checks.rigid_body_residual),
        ("block_identity", link.checks.block_identity),
    ];
    let line = |(key, value): (&str, Option<f64>)| Some(format!("{key} = {:?}\n", value?));
    let lines: String = entries.into_iter().filter_map(line).collect();
    format!("\n[checks]\n{lines}")
}

fn part(name: &str, part: &RigidPart) -> String {
    format!("\n[[part]]\nname = \"{name}\"\n{}", inertial(part))
}

pub(super) fn inertial(part: &RigidPart) -> String {
    let I = &part.inertia;
    let moments = [I[(0, 0)], I[(1, 1)], I[(2, 2)], I[(0, 1)], I[(0, 2)], I[(1, 2)]];
    format!("mass = {:?}\ncom = {}\ninertia = {}\n", part.mass, numbers(part.com.iter()), numbers(moments.iter()),)
}

fn rows(R: &Matrix3<f64>) -> String {
    let rows: Vec<_> = R.row_iter().map(|row| numbers(row.iter())).collect();
    format!("[{}]", rows.join(", "))
}

/// `{:?}` prints the shortest text that parses back to the same f64, always with a point or an
/// exponent.
pub(super) fn numbers<'a>(values: impl Iterator<Item = &'a f64>) -> String {
    let printed: Vec<_> = values.map(|x| format!("{x:?}")).collect();
    format!("[{}]", printed.join(", "))
}

/// Quotes a text as a TOML basic string.
pub(super) fn quoted(text: &str) -> String {
    let mut result = String::from('"');
    for c in text.chars() {
        match c {
            '"' => result.push_str("\\\""),
            '\\' => result.push_str("\\\\"),
            c if c.is_control() => {
                // Writing to a String cannot fail.
                let _ = write!(result, "\\u{:04X}", u32::from(c));
            }
            c => result.push(c),
        }
    }
    result.push('"');
    result
}
