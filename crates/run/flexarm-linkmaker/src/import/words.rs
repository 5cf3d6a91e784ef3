//! Parsing of import options: rows or nodes of the interfaces, their frames, masses, position of
//! the joint.
//!
//! Rows and nodes are counted as in the file, lengths are in its unit; masses are in SI. Not here:
//! values shared with a reduction (`reduce/words.rs`), the map of rows itself
//! (`flexarm_fe_io::exchange::InterfaceMap`).

use std::fmt;
use std::str::FromStr;

use flexarm_fe_io::exchange::{InterfaceMap, MatrixFormat};
use flexarm_fem::RigidPart;
use flexarm_settings::Words;
use nalgebra::{Matrix3, Vector3};

use crate::WordError;
use crate::reduce::numbers;

/// Rows or nodes of the interfaces.
#[derive(Clone, Debug, PartialEq)]
pub enum ImportMap {
    /// Rows of the matrices: `A=1001,B=1002`, `A=947:1-3+948:1-3,...`, `A=#1-6,B=#7-12`.
    Rows(InterfaceMap),
    /// Nodes tied rigidly: `A=plane(x,y,z;nx,ny,nz),B=plane(...)`; for full models of solids with
    /// positions.
    Nodes(Vec<(String, NodePlane)>),
}

/// All nodes of a full model in a plane; unit and axes of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct NodePlane {
    /// A point in the plane.
    pub point: Vector3<f64>,
    /// Normal of the plane.
    pub normal: Vector3<f64>,
}

impl FromStr for ImportMap {
    type Err = WordError;

    fn from_str(text: &str) -> Result<Self, WordError> {
        let is_nodes = |value: &str| value.trim().starts_with("plane(");
        let parts = split_outside_brackets(text);
        let values = || parts.iter().filter_map(|part| part.split_once('=').map(|(_, value)| value));
        if !values().any(is_nodes) {
            return text.parse().map(Self::Rows).map_err(|error| WordError(error.to_string()));
        }
        // Planes: a point and a normal per interface.
        let one = |part: &&str| {
            let wrong = || WordError::form(part, "NAME=plane(x,y,z;nx,ny,nz) for every interface");
            let (name, value) = part.split_once('=').ok_or_else(wrong)?;
            let inside = value.trim().strip_prefix("plane(").and_then(|v| v.strip_suffix(')')).ok_or_else(wrong)?;
            let (point, normal) = inside.split_once(';').ok_or_else(wrong)?;
            let (point, normal) = (triple(point)?, triple(normal)?);
            if normal.norm() == 0.0 {
                return Err(WordError(format!("{part:?}: the normal of the plane is zero")));
            }
            Ok((name.trim().to_owned(), NodePlane { point, normal }))
        };
        let list: Vec<(String, NodePlane)> = parts.iter().map(one).collect::<Result<_, _>>()?;
        for (k, (name, _)) in list.iter().enumerate() {
            if list[..k].iter().any(|(other, _)| other == name) {
                return Err(WordError(format!("the name {name:?} is used twice in the map")));
            }
        }
        Ok(Self::Nodes(list))
    }
}

impl fmt::Display for NodePlane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { point: p, normal: n } = self;
        write!(f, "plane({},{},{};{},{},{})", p.x, p.y, p.z, n.x, n.y, n.z)
    }
}

impl ImportMap {
    /// Returns the names of the interfaces, in order, with the text of their selection.
    #[doc(hidden)]
    pub fn entries(&self) -> Vec<(String, String)> {
        match self {
            Self::Rows(map) => map.interfaces.iter().map(|i| (i.name.clone(), i.rows_text())).collect(),
            Self::Nodes(list) => list.iter().map(|(name, choice)| (name.clone(), choice.to_string())).collect(),
        }
    }

    pub(super) fn rows(&self) -> Option<&InterfaceMap> {
        match self {
            Self::Rows(map) => Some(map),
            Self::Nodes(_) => None,
        }
    }
}

/// Splits at commas outside brackets.
fn split_outside_brackets(text: &str) -> Vec<&str> {
    let (mut parts, mut depth, mut start) = (Vec::new(), 0_i32, 0);
    for (i, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&text[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

/// Frame of an interface, `NAME=x,y,z` or `NAME=x,y,z,roll,pitch,yaw`; unit of the file, rad, link
/// axes.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameAt {
    /// Name of the interface.
    pub name: String,
    /// Position, in the unit of the file.
    pub xyz: Vector3<f64>,
    /// Roll, pitch, yaw (rad).
    pub rpy: Vector3<f64>,
}

impl FromStr for FrameAt {
    type Err = WordError;

    fn from_str(text: &str) -> Result<Self, WordError> {
        let wrong = || WordError::form(text, "NAME=x,y,z or NAME=x,y,z,roll,pitch,yaw, such as B=0,0,1.1");
        let (name, values) = text.split_once('=').ok_or_else(wrong)?;
        match numbers(values)?.as_slice() {
            [x, y, z] => Ok(Self { name: name.trim().into(), xyz: Vector3::new(*x, *y, *z), rpy: Vector3::zeros() }),
            [x, y, z, r, p, w] => {
                Ok(Self { name: name.trim().into(), xyz: Vector3::new(*x, *y, *z), rpy: Vector3::new(*r, *p, *w) })
            }
            _ => Err(wrong()),
        }
    }
}

/// File format as given by the user.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImportFormat {
    /// Any, by content.
    #[default]
    Auto,
    /// Matrix Market.
    MatrixMarket,
    /// `*USER ELEMENT` of CalculiX and Abaqus.
    UserElement,
    /// `node,dof,node,dof,value`.
    AbaqusText,
    /// `row column value`: Abaqus COORDINATE, CalculiX `.sti`.
    Coordinate,
    /// Nastran DMIG.
    Dmig,
    /// Nastran OP4, text or binary.
    Op4,
    /// Harwell-Boeing.
    HarwellBoeing,
    /// Comma-separated, as for Simscape.
    Simscape,
    /// SID.
    Sid,
}

impl Words for ImportFormat {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("auto", Self::Auto, "By content"),
        ("matrix-market", Self::MatrixMarket, "Matrix Market"),
        ("user-element", Self::UserElement, "CalculiX, Abaqus"),
        ("abaqus-text", Self::AbaqusText, "node,dof,node,dof,value"),
        ("coordinate", Self::Coordinate, "row column value (Abaqus COORDINATE, CalculiX .sti)"),
        ("dmig", Self::Dmig, "Nastran"),
        ("op4", Self::Op4, "Nastran"),
        ("harwell-boeing", Self::HarwellBoeing, "Harwell-Boeing"),
        ("simscape", Self::Simscape, "Comma-separated values"),
        ("sid", Self::Sid, "Modal body"),
    ];
}

impl ImportFormat {
    /// Whether a file recognised as `found` has this format.
    pub(super) fn covers(self, found: MatrixFormat) -> bool {
        match self {
            Self::Auto => true,
            Self::MatrixMarket => found == MatrixFormat::MatrixMarket,
            Self::UserElement => found == MatrixFormat::UserElement,
            Self::AbaqusText => found == MatrixFormat::LabelledText,
            Self::Coordinate => found == MatrixFormat::CoordinateText,
            Self::Dmig => found == MatrixFormat::Dmig,
            Self::Op4 => matches!(found, MatrixFormat::Op4Text | MatrixFormat::Op4Binary),
            Self::HarwellBoeing => found == MatrixFormat::HarwellBoeing,
            Self::Simscape => found == MatrixFormat::Csv,
            Self::Sid => found == MatrixFormat::Sid,
        }
    }
}

/// Parses a rigid part, `mass;cx,cy,cz;ixx,iyy,izz,ixy,ixz,iyz`: kg, m, kg m² about its centre of
/// mass, link axes.
///
/// # Errors
/// [`WordError`].
pub fn parse_part(text: &str) -> Result<RigidPart, WordError> {
    let wrong = || WordError::form(text, "mass;x,y,z;ixx,iyy,izz,ixy,ixz,iyz in kg, m, kg m2");
    let mut pieces = text.split(';');
    let (Some(mass), Some(com), Some(inertia), None) = (pieces.next(), pieces.next(), pieces.next(), pieces.next())
    else {
        return Err(wrong());
    };
    let [mass] = numbers(mass)?[..] else { return Err(wrong()) };
    Ok(RigidPart { mass, com: triple(com)?, inertia: parse_inertia(inertia)? })
}

/// Parses an inertia `ixx,iyy,izz,ixy,ixz,iyz` (kg m²).
///
/// # Errors
/// [`WordError`].
pub fn parse_inertia(text: &str) -> Result<Matrix3<f64>, WordError> {
    let [xx, yy, zz, xy, xz, yz] = numbers(text)?[..] else {
        return Err(WordError::form(text, "ixx,iyy,izz,ixy,ixz,iyz"));
    };
    Ok(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
}

/// Parses three finite numbers separated by commas.
///
/// # Errors
/// [`WordError`].
pub fn triple(text: &str) -> Result<Vector3<f64>, WordError> {
    let [x, y, z] = numbers(text)?[..] else { return Err(WordError::form(text, "three numbers x,y,z")) };
    Ok(Vector3::new(x, y, z))
}
