//! Small TOML file accompanying Matrix Market files: units, interfaces, frames, meaning of the
//! rows.
//!
//! ```toml
//! format = "flexarm-matrices"
//! version = 1
//! stiffness = "arm_K.mtx"
//! mass = "arm_M.mtx"
//! units = "m-kg-s"
//!
//! [[interface]]
//! name = "A"
//! rows = "#1-6"                # ux uy uz rx ry rz, link axes
//! xyz = [0.0, 0.0, 0.0]        # in units of length, link axes
//! rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
//! ```
//! Rows after the interfaces are modal coordinates. The components of all interfaces are along the
//! link axes; the rotation of a frame applies to its joint, not to the matrix.
//! Start at [`Sidecar`]. Not here: the matrices ([`super::matrix_market`]).

use flexarm_spatial::Pose;
use nalgebra::{Matrix3, Rotation3, Translation3, Vector3};
use serde::Deserialize;

use super::interface::{Interface, InterfaceMap};
use super::position::ErrorPosition;
use super::text::Text;
use crate::FeFileError;
use flexarm_fem::units::UnitSystem;

/// Value of the key `format`.
pub(super) const FORMAT: &str = "flexarm-matrices";
const VERSION: i64 = 1;

/// Data missing in Matrix Market files; lengths in the units of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Sidecar {
    /// File of the stiffness, relative to the folder of the sidecar.
    pub stiffness: String,
    /// File of the mass.
    pub mass: Option<String>,
    /// Units of matrices and frames.
    pub units: UnitSystem,
    /// Interfaces in the order of their rows.
    pub interfaces: Vec<SidecarInterface>,
}

/// Interface of a [`Sidecar`].
#[derive(Debug, Clone, PartialEq)]
pub struct SidecarInterface {
    /// Rows and name of the interface.
    pub interface: Interface,
    /// Frame in the link frame, lengths in units of the file.
    pub frame: Pose,
}

impl Sidecar {
    /// Returns the interfaces as a map for [`assemble_interfaces`](super::assemble_interfaces).
    pub fn map(&self) -> InterfaceMap {
        InterfaceMap { interfaces: self.interfaces.iter().map(|i| i.interface.clone()).collect(), modal: Vec::new() }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSidecar {
    format: String,
    version: i64,
    stiffness: String,
    mass: Option<String>,
    units: String,
    #[serde(default)]
    interface: Vec<RawInterface>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawInterface {
    name: String,
    rows: String,
    xyz: [f64; 3],
    #[serde(default = "no_rotation")]
    rotation: [[f64; 3]; 3],
}

fn no_rotation() -> [[f64; 3]; 3] {
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
}

/// Reads a sidecar.
pub(super) fn parse(text: Text<'_>) -> Result<Sidecar, FeFileError> {
    let syntax = |error: toml::de::Error| {
        let line = error.span().map(|span| text.text.get(..span.start).unwrap_or("").matches('\n').count() + 1);
        let place = ErrorPosition { line, ..text.file() };
        let expected = "the keys format, version, stiffness, mass, units, [[interface]] with name, rows, xyz, rotation";
        place.fail("sidecar", error.message(), expected, "")
    };
    let raw: RawSidecar = toml::from_str(text.text).map_err(syntax)?;
    let refuse = |element: String, found: String, expected: String| text.file().fail(element, found, expected, "");
    // Format, version and units.
    if raw.format != FORMAT || raw.version != VERSION {
        let found = format!("{:?}, version {}", raw.format, raw.version);
        return Err(refuse("format".into(), found, format!("{FORMAT:?}, version {VERSION}")));
    }
    let units = raw.units.parse().map_err(|error: flexarm_fem::FemError| {
        refuse("units".into(), format!("{:?}", raw.units), error.to_string())
    })?;
    // Interfaces: rows of the matrix, and a frame whose rotation is orthogonal.
    let mut interfaces = Vec::new();
    for entry in raw.interface {
        let R = Matrix3::from_fn(|i, j| entry.rotation[i][j]);
        let p = Vector3::from(entry.xyz);
        let error = (R.transpose() * R - Matrix3::identity()).amax();
        if !(error <= 1e-9) || !(R.determinant() > 0.0) || !p.iter().all(|x| x.is_finite()) {
            let found = format!("a frame with |RᵀR - 1| = {error:.1e}");
            return Err(refuse(format!("frame of interface {}", entry.name), found, "a rotation, finite xyz".into()));
        }
        let interface = Interface::parse(&entry.name, &entry.rows)?;
        let frame = Pose::from_parts(Translation3::from(p), Rotation3::from_matrix_unchecked(R));
        interfaces.push(SidecarInterface { interface, frame });
    }
    Ok(Sidecar { stiffness: raw.stiffness, mass: raw.mass, units, interfaces })
}

/// Writes the sidecar as text; frames read back bit for bit.
pub fn write_sidecar(sidecar: &Sidecar) -> String {
    let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
    let mut text = format!("format = {FORMAT:?}\nversion = {VERSION}\nstiffness = {}\n", quoted(&sidecar.stiffness));
    if let Some(mass) = &sidecar.mass {
        text += &format!("mass = {}\n", quoted(mass));
    }
    text += &format!("units = \"{}\"\n", sidecar.units);
    for SidecarInterface { interface, frame } in &sidecar.interfaces {
        let p: [f64; 3] = frame.translation.vector.into();
        let R: Vec<[f64; 3]> = frame.rotation.matrix().row_iter().map(|row| [row[0], row[1], row[2]]).collect();
        text += &format!(
            "\n[[interface]]\nname = {}\nrows = {}\nxyz = {p:?}\nrotation = {R:?}\n",
            quoted(&interface.name),
            quoted(&interface.rows_text()),
        );
    }
    text
}
