//! Writes a [`ReducedLink`] as text that reads back to bitwise equal numbers.
//!
//! Start at [`write_flex`]; SI, link axes. Not here: superelement, chains and modal links
//! (`details.rs`, `modal.rs`), reading (`read.rs`).

use flexarm_spatial::Pose;

use super::frames::pose_lines;
use super::rigid_part::inertial;
use super::text::{numbers, quoted};
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

/// Writes `[provenance]` without empty entries.
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

/// Writes the measures that a 6×6 cannot repeat.
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
