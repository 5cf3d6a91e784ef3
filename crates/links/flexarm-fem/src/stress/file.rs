//! File of stress fields: tensors in the safetensors format, which numpy and PyTorch read.
//!
//! | tensor | shape | what |
//! | --- | --- | --- |
//! | `stress` | fields, seats, 6 | Pa per unit, `xx yy zz xy yz zx`: wrenches, inertia loads, modes |
//! | `position` | seats, 3 | m, link axes |
//! | `node`, `material`, `from_tie` | seats | number in the mesh, index, m |
//! | `triangle` | triangles, 3 | seats of the surface |
//! | `materials` | materials, 3 | E (Pa), nu, rho (kg/m³) |
//! | `pose` | interfaces, 12 | rotation by rows, position (m) |
//! | `compliance` | 6 per interface but the first | its displacement under unit wrenches |
//! | `frequency_hz` | modes | fixed-interface modes |
//!
//! The metadata have, as JSON below the key `flexarm`, the format with its version and the names of
//! link and interfaces.

use std::collections::HashMap;

use flexarm_spatial::Pose;
use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};
use serde::{Deserialize, Serialize};

use super::fields::{INERTIA_LOADS, StressFields, StressSeat};
use crate::material::Material;

/// Format with its version.
const FORMAT: &str = "flexarm stress 1";
/// Bound of a stress per unit (Pa): modes of metal parts have 1e11 to 1e13.
const LARGEST: f32 = 1e15;
/// Key of the metadata.
const KEY: &str = "flexarm";

#[derive(Serialize, Deserialize)]
struct About {
    format: String,
    link: String,
    interfaces: Vec<String>,
}

/// Returns the content of a stress file.
pub fn write_stress(fields: &StressFields) -> Vec<u8> {
    let seats = fields.seats.len();
    let bytes = |numbers: &mut dyn Iterator<Item = f64>| numbers.flat_map(f64::to_le_bytes).collect::<Vec<u8>>();
    let pose = |X: &Pose| {
        let R = X.rotation.matrix().transpose();
        R.iter().chain(X.translation.vector.iter()).copied().collect::<Vec<_>>()
    };
    let materials = fields.materials.iter().flat_map(|material| [material.E, material.nu, material.rho]);
    let tied = fields.seats.iter().map(|seat| seat.from_tie);
    let n = fields.compliance.nrows();
    let parts: [(&str, Dtype, Vec<usize>, Vec<u8>); 10] = [
        (
            "stress",
            Dtype::F32,
            vec![fields.stress.ncols(), seats, 6],
            fields.stress.iter().flat_map(|stress| stress.to_le_bytes()).collect(),
        ),
        ("position", Dtype::F64, vec![seats, 3], bytes(&mut fields.seats.iter().flat_map(|s| s.position.data.0[0]))),
        ("node", Dtype::U64, vec![seats], fields.seats.iter().flat_map(|seat| seat.node.to_le_bytes()).collect()),
        (
            "material",
            Dtype::U32,
            vec![seats],
            fields.seats.iter().flat_map(|seat| (seat.material as u32).to_le_bytes()).collect(),
        ),
        ("from_tie", Dtype::F64, vec![seats], bytes(&mut tied.into_iter())),
        (
            "triangle",
            Dtype::U32,
            vec![fields.triangles.len(), 3],
            fields.triangles.iter().flatten().flat_map(|seat| seat.to_le_bytes()).collect(),
        ),
        ("materials", Dtype::F64, vec![fields.materials.len(), 3], bytes(&mut materials.into_iter())),
        ("pose", Dtype::F64, vec![fields.poses.len(), 12], bytes(&mut fields.poses.iter().flat_map(pose))),
        ("compliance", Dtype::F64, vec![n, n], bytes(&mut fields.compliance.iter().copied())),
        (
            "frequency_hz",
            Dtype::F64,
            vec![fields.frequencies_hz.len()],
            bytes(&mut fields.frequencies_hz.iter().copied()),
        ),
    ];
    let views = parts.iter().map(|(name, kind, shape, bytes)| {
        (*name, TensorView::new(*kind, shape.clone(), bytes).expect("as many bytes as the shape has"))
    });
    let about = About { format: FORMAT.into(), link: fields.link.clone(), interfaces: fields.interfaces.clone() };
    let about = serde_json::to_string(&about).expect("strings");
    // One entry, so that equal fields give equal bytes.
    serialize(views, Some(HashMap::from([(KEY.to_owned(), about)]))).expect("tensors of plain numbers")
}

/// Reads a stress file.
///
/// # Errors
/// A message with what was found and expected.
pub fn parse_stress(bytes: &[u8]) -> Result<StressFields, String> {
    let help = "reduce the mesh again, with its stress";
    let fail = |what: String| format!("{what}; {help}");
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(|error| fail(format!("not a stress file: {error}")))?;
    let about = header.metadata().as_ref().and_then(|about| about.get(KEY));
    let about: About = about
        .and_then(|text| serde_json::from_str(text).ok())
        .ok_or_else(|| fail(format!("its metadata have no key {KEY:?} with format, link and interfaces")))?;
    if about.format != FORMAT {
        return Err(fail(format!("format {:?}, expected {FORMAT:?}", about.format)));
    }
    let file = SafeTensors::deserialize(bytes).map_err(|error| fail(format!("damaged: {error}")))?;
    let file = Tensors { file: &file };
    let (materials, poses) = (file.rows("materials", 3)?, file.rows("pose", 12)?);
    let (positions, frequencies_hz) = (file.rows("position", 3)?, file.numbers("frequency_hz")?);
    let (nodes, kinds, tied) = (file.whole("node")?, file.whole("material")?, file.numbers("from_tie")?);
    let corners = file.whole("triangle")?;
    let (seats, wrenches) = (positions.len(), 6 * poses.len().saturating_sub(1));
    let columns = wrenches + INERTIA_LOADS + frequencies_hz.len();
    let stress = file.tensor("stress", Dtype::F32)?;
    let expected = [columns, seats, 6];
    if stress.shape() != expected {
        return Err(fail(format!("tensor \"stress\" has the shape {:?}, expected {expected:?}", stress.shape())));
    }
    if [nodes.len(), kinds.len(), tied.len()] != [seats; 3] {
        return Err(fail(format!("its tensors \"node\", \"material\", \"from_tie\" do not have {seats} entries")));
    }
    if kinds.iter().any(|kind| *kind >= materials.len() as u64) || corners.iter().any(|seat| *seat >= seats as u64) {
        return Err(fail("an index is out of range".to_owned()));
    }
    let compliance = file.numbers("compliance")?;
    if compliance.len() != wrenches * wrenches || wrenches == 0 {
        return Err(fail(format!(
            "tensor \"compliance\" has {} entries, expected {}",
            compliance.len(),
            wrenches * wrenches
        )));
    }
    let single = |word: &[u8]| f32::from_le_bytes([word[0], word[1], word[2], word[3]]);
    let stress: Vec<f32> = stress.data().chunks_exact(4).map(single).collect();
    let finite = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
    if !stress.iter().all(|stress| stress.abs() < LARGEST)
        || !positions.iter().all(|p| finite(p))
        || !finite(&compliance)
    {
        return Err(fail(format!("a number is not finite, or a stress beyond {LARGEST:e} Pa per unit")));
    }
    let seat = |k: usize| StressSeat {
        node: nodes[k],
        position: Vector3::from_column_slice(&positions[k]),
        material: kinds[k] as usize,
        from_tie: tied[k],
    };
    let pose = |row: &Vec<f64>| {
        let R = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&row[..9]));
        Pose::from_parts(Vector3::from_column_slice(&row[9..]).into(), R)
    };
    if about.interfaces.len() != poses.len() {
        return Err(fail(format!("{} interfaces have {} poses", about.interfaces.len(), poses.len())));
    }
    Ok(StressFields {
        link: about.link,
        interfaces: about.interfaces,
        poses: poses.iter().map(pose).collect(),
        compliance: DMatrix::from_column_slice(wrenches, wrenches, &compliance),
        frequencies_hz,
        materials: materials.iter().map(|row| Material::isotropic(row[0], row[1], row[2])).collect(),
        seats: (0..seats).map(seat).collect(),
        triangles: corners.chunks_exact(3).map(|c| [c[0] as u32, c[1] as u32, c[2] as u32]).collect(),
        stress: DMatrix::from_vec(6 * seats, columns, stress),
        section_forces: None,
    })
}

struct Tensors<'a> {
    file: &'a SafeTensors<'a>,
}

impl<'a> Tensors<'a> {
    fn tensor(&self, name: &str, kind: Dtype) -> Result<TensorView<'a>, String> {
        let tensor = self.file.tensor(name).map_err(|_| format!("tensor {name:?} is missing"))?;
        if tensor.dtype() == kind {
            return Ok(tensor);
        }
        Err(format!("tensor {name:?} has numbers of the type {:?}, expected {kind:?}", tensor.dtype()))
    }

    fn numbers(&self, name: &str) -> Result<Vec<f64>, String> {
        let tensor = self.tensor(name, Dtype::F64)?;
        Ok(tensor.data().as_chunks().0.iter().map(|word| f64::from_le_bytes(*word)).collect())
    }

    fn rows(&self, name: &str, width: usize) -> Result<Vec<Vec<f64>>, String> {
        let tensor = self.tensor(name, Dtype::F64)?;
        if tensor.shape().len() != 2 || tensor.shape()[1] != width {
            return Err(format!("tensor {name:?} has the shape {:?}, expected rows of {width}", tensor.shape()));
        }
        Ok(self.numbers(name)?.chunks_exact(width).map(<[f64]>::to_vec).collect())
    }

    /// Whole numbers of 32 or 64 bits.
    fn whole(&self, name: &str) -> Result<Vec<u64>, String> {
        if let Ok(tensor) = self.tensor(name, Dtype::U64) {
            return Ok(tensor.data().as_chunks().0.iter().map(|word| u64::from_le_bytes(*word)).collect());
        }
        let tensor = self.tensor(name, Dtype::U32)?;
        Ok(tensor.data().as_chunks().0.iter().map(|word| u64::from(u32::from_le_bytes(*word))).collect())
    }
}
