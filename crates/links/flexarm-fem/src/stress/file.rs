//! File of stress fields: tensors in the safetensors format, which numpy and PyTorch read.
//!
//! | tensor | shape | what |
//! | --- | --- | --- |
//! | `stress` | fields, sites, 6 | Pa per unit, `xx yy zz xy yz zx`: wrenches, inertia loads, modes |
//! | `position` | sites, 3 | m, link axes |
//! | `node`, `material`, `from_tie` | sites | number in the mesh, index, m |
//! | `triangle` | triangles, 3 | sites of the surface |
//! | `materials` | materials, 3 | E (Pa), nu, rho (kg/m³) |
//! | `pose` | interfaces, 12 | rotation by rows, position (m) |
//! | `compliance` | 6 per interface but the first | its displacement under unit wrenches |
//! | `frequency_hz` | modes | fixed-interface modes |
//!
//! The metadata have, as JSON below the key `flexarm`, the format with its version and the names of
//! link and interfaces.

use flexarm_spatial::Pose;
use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};
use serde::{Deserialize, Serialize};

use super::error::StressError;
use super::fields::{INERTIA_LOADS, StressFields, StressSite};
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

/// Returns the content of a stress file; equal fields give equal bytes. The section forces of a
/// beam are not written.
///
/// # Panics
/// If the sizes of the fields do not agree with each other.
pub fn write_stress(fields: &StressFields) -> Vec<u8> {
    let sites = fields.sites.len();
    let bytes = |numbers: &mut dyn Iterator<Item = f64>| numbers.flat_map(f64::to_le_bytes).collect::<Vec<u8>>();
    let pose = |X: &Pose| {
        let R = X.rotation.matrix().transpose();
        R.iter().chain(X.translation.vector.iter()).copied().collect::<Vec<_>>()
    };
    let materials = fields.materials.iter().flat_map(|material| [material.E, material.nu, material.rho]);
    let tied = fields.sites.iter().map(|site| site.from_tie);
    let n = fields.compliance.nrows();
    let parts: [(&str, Dtype, Vec<usize>, Vec<u8>); 10] = [
        (
            "stress",
            Dtype::F32,
            vec![fields.stress.ncols(), sites, 6],
            fields.stress.iter().flat_map(|stress| stress.to_le_bytes()).collect(),
        ),
        ("position", Dtype::F64, vec![sites, 3], bytes(&mut fields.sites.iter().flat_map(|s| s.position.data.0[0]))),
        ("node", Dtype::U64, vec![sites], fields.sites.iter().flat_map(|site| site.node.to_le_bytes()).collect()),
        (
            "material",
            Dtype::U32,
            vec![sites],
            fields.sites.iter().flat_map(|site| (site.material as u32).to_le_bytes()).collect(),
        ),
        ("from_tie", Dtype::F64, vec![sites], bytes(&mut tied.into_iter())),
        (
            "triangle",
            Dtype::U32,
            vec![fields.triangles.len(), 3],
            fields.triangles.iter().flatten().flat_map(|site| site.to_le_bytes()).collect(),
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
    serialize(views, Some([(KEY.to_owned(), about)].into_iter().collect())).expect("tensors of plain numbers")
}

/// Reads a stress file.
///
/// * `bytes`: the whole file.
///
/// Returns the fields, with every size, index and number checked; no section forces.
///
/// # Errors
/// [`StressError`] for bytes that are no stress file, and for a tensor that is missing, has another
/// shape or type, or contains an impossible number.
pub fn parse_stress(bytes: &[u8]) -> Result<StressFields, StressError> {
    // Description, then tensors: the sizes of the later ones follow from the earlier ones.
    let about = read_about(bytes)?;
    let file = SafeTensors::deserialize(bytes).map_err(|e| StressError::file(format!("damaged: {e}")))?;
    let file = Tensors { file: &file };
    // Sizes follow from one another: materials, interfaces, modes, sites.
    let (materials, poses) = (file.rows("materials", 3)?, file.rows("pose", 12)?);
    let frequencies_hz = file.numbers("frequency_hz")?;
    let sites = file.sites(materials.len())?;
    let triangles = file.triangles(sites.len())?;
    let wrenches = 6 * poses.len().saturating_sub(1);
    let stress = file.stress(wrenches + INERTIA_LOADS + frequencies_hz.len(), sites.len())?;
    let compliance = file.compliance(wrenches)?;
    if about.interfaces.len() != poses.len() {
        let what = format!("{} interfaces have {} poses", about.interfaces.len(), poses.len());
        return Err(StressError::file(what));
    }
    // A pose is stored as its rotation, row by row, and its translation.
    let pose = |row: &Vec<f64>| {
        let R = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&row[..9]));
        Pose::from_parts(Vector3::from_column_slice(&row[9..]).into(), R)
    };
    Ok(StressFields {
        link: about.link,
        interfaces: about.interfaces,
        poses: poses.iter().map(pose).collect(),
        compliance,
        frequencies_hz,
        materials: materials.iter().map(|row| Material::isotropic(row[0], row[1], row[2])).collect(),
        sites,
        triangles,
        stress,
        section_forces: None,
    })
}

/// Reads the description in the metadata.
fn read_about(bytes: &[u8]) -> Result<About, StressError> {
    let (_, header) =
        SafeTensors::read_metadata(bytes).map_err(|e| StressError::file(format!("not a stress file: {e}")))?;
    let text = header.metadata().as_ref().and_then(|about| about.get(KEY));
    let about = text.and_then(|text| serde_json::from_str(text).ok());
    let missing = || StressError::file(format!("its metadata have no key {KEY:?} with format, link and interfaces"));
    let about: About = about.ok_or_else(missing)?;
    if about.format != FORMAT {
        return Err(StressError::file(format!("format {:?}, expected {FORMAT:?}", about.format)));
    }
    Ok(about)
}

fn check_finite(numbers: &[f64]) -> Result<(), StressError> {
    let finite = numbers.iter().all(|number| number.is_finite());
    if finite { Ok(()) } else { Err(impossible_number()) }
}

fn impossible_number() -> StressError {
    StressError::file(format!("a number is not finite, or a stress beyond {LARGEST:e} Pa per unit"))
}

struct Tensors<'a> {
    file: &'a SafeTensors<'a>,
}

impl<'a> Tensors<'a> {
    fn tensor(&self, name: &'static str, kind: Dtype) -> Result<TensorView<'a>, StressError> {
        let tensor = self.file.tensor(name).map_err(|_| StressError::file(format!("tensor {name:?} is missing")))?;
        if tensor.dtype() == kind {
            return Ok(tensor);
        }
        let found = tensor.dtype();
        Err(StressError::file(format!("tensor {name:?} has numbers of the type {found:?}, expected {kind:?}")))
    }

    fn numbers(&self, name: &'static str) -> Result<Vec<f64>, StressError> {
        let tensor = self.tensor(name, Dtype::F64)?;
        Ok(tensor.data().as_chunks().0.iter().map(|word| f64::from_le_bytes(*word)).collect())
    }

    /// Rows of a matrix of numbers with the given width.
    fn rows(&self, name: &'static str, width: usize) -> Result<Vec<Vec<f64>>, StressError> {
        let tensor = self.tensor(name, Dtype::F64)?;
        if tensor.shape().len() != 2 || tensor.shape()[1] != width {
            let found = tensor.shape();
            return Err(StressError::file(format!(
                "tensor {name:?} has the shape {found:?}, expected rows of {width}"
            )));
        }
        Ok(self.numbers(name)?.chunks_exact(width).map(<[f64]>::to_vec).collect())
    }

    /// Whole numbers of 32 or 64 bits.
    fn whole(&self, name: &'static str) -> Result<Vec<u64>, StressError> {
        if let Ok(tensor) = self.tensor(name, Dtype::U64) {
            return Ok(tensor.data().as_chunks().0.iter().map(|word| u64::from_le_bytes(*word)).collect());
        }
        let tensor = self.tensor(name, Dtype::U32)?;
        Ok(tensor.data().as_chunks().0.iter().map(|word| u64::from(u32::from_le_bytes(*word))).collect())
    }

    /// Sites, with their materials checked against the number of materials.
    fn sites(&self, materials: usize) -> Result<Vec<StressSite>, StressError> {
        let positions = self.rows("position", 3)?;
        let (nodes, kinds, tied) = (self.whole("node")?, self.whole("material")?, self.numbers("from_tie")?);
        let sites = positions.len();
        if [nodes.len(), kinds.len(), tied.len()] != [sites; 3] {
            let what = format!("its tensors \"node\", \"material\", \"from_tie\" do not have {sites} entries");
            return Err(StressError::file(what));
        }
        if kinds.iter().any(|kind| *kind >= materials as u64) {
            return Err(StressError::file("an index is out of range"));
        }
        positions.iter().try_for_each(|position| check_finite(position))?;
        let site = |k: usize| StressSite {
            node: nodes[k],
            position: Vector3::from_column_slice(&positions[k]),
            material: kinds[k] as usize,
            from_tie: tied[k],
        };
        Ok((0..sites).map(site).collect())
    }

    fn triangles(&self, sites: usize) -> Result<Vec<[u32; 3]>, StressError> {
        let corners = self.whole("triangle")?;
        if corners.iter().any(|site| *site >= sites as u64) {
            return Err(StressError::file("an index is out of range"));
        }
        Ok(corners.as_chunks().0.iter().map(|corners| corners.map(|site| site as u32)).collect())
    }

    /// Stress by fields, six rows per site.
    fn stress(&self, fields: usize, sites: usize) -> Result<DMatrix<f32>, StressError> {
        let tensor = self.tensor("stress", Dtype::F32)?;
        let expected = [fields, sites, 6];
        if tensor.shape() != expected {
            let found = tensor.shape();
            return Err(StressError::file(format!("tensor \"stress\" has the shape {found:?}, expected {expected:?}")));
        }
        let stress: Vec<f32> = tensor.data().as_chunks().0.iter().map(|word| f32::from_le_bytes(*word)).collect();
        if !stress.iter().all(|stress| stress.abs() < LARGEST) {
            return Err(impossible_number());
        }
        Ok(DMatrix::from_vec(6 * sites, fields, stress))
    }

    /// Displacements under unit wrenches.
    fn compliance(&self, wrenches: usize) -> Result<DMatrix<f64>, StressError> {
        let numbers = self.numbers("compliance")?;
        let (found, expected) = (numbers.len(), wrenches * wrenches);
        if found != expected || wrenches == 0 {
            return Err(StressError::file(format!("tensor \"compliance\" has {found} entries, expected {expected}")));
        }
        check_finite(&numbers)?;
        Ok(DMatrix::from_vec(wrenches, wrenches, numbers))
    }
}
