//! Shipped meshes, assembled and condensed on the fly: the truth for reduced links.
//!
//! [`Meshed`] is a mesh with its matrices, [`Condensed`] the same condensed to interfaces A and B.
//! SI units, axes of the link. Not here: the methods (`flexarm-fem`).

use std::path::{Path, PathBuf};

use flexarm_fe_io::mesh::{ReadOptions, read_mesh};
use flexarm_fem::chain::energy_by_slice;
use flexarm_fem::element::Quadrature;
use flexarm_fem::mesh::Mesh;
use flexarm_fem::model::{AssemblyOptions, FeModel};
use flexarm_fem::reduction::{Condensation, CondensationOptions, Interface, Tie};
use flexarm_fem::sparse::ModesWanted;
use flexarm_fem::{CutPlane, Material, Pose, UnitSystem};
use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};

use crate::Error;
use crate::bench::Bench;

/// A mesh with its stiffness and mass matrices, SI units.
pub(crate) struct Meshed {
    path: PathBuf,
    /// The mesh.
    pub(crate) mesh: Mesh,
    /// Its matrices.
    pub(crate) model: FeModel,
}

impl Meshed {
    /// Reads an aluminium mesh by its path from the root, with node sets `interface_A` and
    /// `interface_B` and exact quadrature.
    pub(crate) fn read(bench: &Bench, file: &str, units: UnitSystem) -> Result<Self, Error> {
        Self::read_with(bench, file, units, Material::ALUMINIUM, Quadrature::Exact)
    }

    /// Like [`Meshed::read`], with another material or another quadrature rule.
    pub(crate) fn read_with(
        bench: &Bench,
        file: &str,
        units: UnitSystem,
        material: Material,
        quadrature: Quadrature,
    ) -> Result<Self, Error> {
        let path = bench.root.join(file);
        let options = ReadOptions { units, ..ReadOptions::default() };
        let mesh = read_mesh(&path, &options).map_err(Box::new)?.mesh;
        let options = AssemblyOptions { material: Some(material), quadrature };
        let model = FeModel::assemble(&mesh, &options).map_err(|e| fault(&path, e))?;
        Ok(Self { path, mesh, model })
    }

    /// Interface `A` or `B`, tied to the reference point `p` (m).
    pub(crate) fn interface(&self, name: &str, p: Vector3<f64>, tie: Tie) -> Result<Interface, Error> {
        let set = format!("interface_{name}");
        let nodes = self.mesh.node_sets.get(&set);
        let nodes = nodes.ok_or_else(|| fault(&self.path, format!("the mesh has no node set {set:?}")))?.clone();
        Ok(Interface { name: name.into(), X_LI: Pose::translation(p.x, p.y, p.z), nodes, tie })
    }

    /// The nodes of the plane at `x`, tied by their mean to the point on the x axis.
    pub(crate) fn section(&self, x: f64) -> Interface {
        let nodes = self.mesh.nodes.iter().enumerate().filter(|(_, p)| (p.x - x).abs() < 1e-6).map(|(n, _)| n as u32);
        let (name, nodes) = (format!("x = {x}"), nodes.collect());
        Interface { name, X_LI: Pose::translation(x, 0.0, 0.0), nodes, tie: Tie::Distributing }
    }

    /// Ties the interfaces, factorises and condenses.
    pub(crate) fn condense(&self, interfaces: &[Interface]) -> Result<Condensation<'_>, Error> {
        Condensation::new(&self.model, interfaces, CondensationOptions::default()).map_err(|e| fault(&self.path, e))
    }

    /// Number of degrees of freedom.
    pub(crate) fn size(&self) -> usize {
        self.model.size()
    }

    /// Mass (kg).
    pub(crate) fn mass(&self) -> f64 {
        let R = self.model.rigid_modes(&Vector3::zeros()).columns(0, 1).into_owned();
        (R.transpose() * self.model.M.product(&R))[(0, 0)]
    }

    /// Condenses to the two interfaces with the given ties and reference points `p_A` and `p_B`
    /// (m).
    pub(crate) fn condensed(
        &self,
        ties: [Tie; 2],
        p_A: Vector3<f64>,
        p_B: Vector3<f64>,
    ) -> Result<Condensed<'_>, Error> {
        let inner = self.condense(&[self.interface("A", p_A, ties[0])?, self.interface("B", p_B, ties[1])?])?;
        Ok(Condensed { path: &self.path, inner, p_A, p_B })
    }
}

/// A mesh condensed to its interfaces.
pub(crate) struct Condensed<'m> {
    path: &'m Path,
    inner: Condensation<'m>,
    p_A: Vector3<f64>,
    p_B: Vector3<f64>,
}

impl Condensed<'_> {
    /// Motion of B (rows) under unit wrenches at B, with A held.
    pub(crate) fn compliance(&self) -> Result<Matrix6<f64>, Error> {
        let K: Matrix6<f64> = self.inner.stiffness().fixed_view::<6, 6>(6, 6).into();
        inverse(&K).ok_or_else(|| Error::Case("interface B can move without force".into()))
    }

    /// Motion of B under a uniform acceleration (m/s²), with A held.
    pub(crate) fn under_acceleration(&self, g: &Vector3<f64>) -> Vector6<f64> {
        let model = self.inner.model();
        let R = model.rigid_modes(&Vector3::zeros());
        let g = DMatrix::from_fn(6, 1, |i, _| if i < 3 { g[i] } else { 0.0 });
        let F = model.M.product(&(R * g));
        let u = self.inner.tip_under(&F);
        Vector6::from_fn(|i, _| u[(i, 0)])
    }

    /// Distribution of the strain energy under unit wrenches at B: share of each of `n` equal
    /// slices from A to B, as compliances at B.
    pub(crate) fn slices(&self, mesh: &Meshed, n: usize) -> Vec<Matrix6<f64>> {
        let plane = |k: usize| CutPlane {
            point: self.p_A + (self.p_B - self.p_A) * (k as f64 / n as f64),
            normal: self.p_B - self.p_A,
        };
        let planes: Vec<CutPlane> = (1..n).map(plane).collect();
        let materials = vec![Material::ALUMINIUM; mesh.mesh.regions.len()];
        let U = self.inner.unit_load_shapes();
        energy_by_slice(&mesh.mesh, &mesh.model, &materials, Quadrature::Exact, &U, &planes)
    }

    /// Frequencies with A held and B free (Hz).
    pub(crate) fn held_hz(&self, count: usize) -> Result<Vec<f64>, Error> {
        Ok(self.inner.held_modes(ModesWanted::Count(count)).map_err(|e| fault(self.path, e))?.frequencies_hz())
    }
}

/// Inverse of a positive definite matrix with rows of different units, by symmetric scaling.
pub(crate) fn inverse(K: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let s = K.diagonal().map(|k| 1.0 / k.sqrt());
    let scale = s * s.transpose();
    Some(K.component_mul(&scale).cholesky()?.inverse().component_mul(&scale))
}

fn fault(path: &Path, e: impl std::fmt::Display) -> Error {
    flexarm::Error::File { path: path.to_owned(), what: e.to_string() }.into()
}
