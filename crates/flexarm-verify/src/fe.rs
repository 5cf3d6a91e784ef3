//! Own finite elements on a shipped mesh: the full model behind a reduced link.

use std::path::{Path, PathBuf};

use flexarm::Error;
use flexarm_fem::model::{AssemblyOptions, FeModel};
use flexarm_fem::reduction::{Condensation, CondensationOptions, Interface, Tie};
use flexarm_fem::{Material, Mesh, Pose, ReadOptions, UnitSystem, read_mesh};
use nalgebra::Vector3;

/// A mesh with its matrices, exact quadrature, SI.
pub(crate) struct Fe {
    path: PathBuf,
    /// The mesh.
    pub(crate) mesh: Mesh,
    /// Its matrices.
    pub(crate) model: FeModel,
}

impl Fe {
    /// Reads and assembles.
    pub(crate) fn load(path: &Path, units: UnitSystem, material: Material) -> Result<Self, Error> {
        let file = read_mesh(path, &ReadOptions { units, beams: Vec::new() }).map_err(Box::new)?;
        let options = AssemblyOptions { material: Some(material), ..AssemblyOptions::default() };
        let fault = |e| Self::fault(path, e);
        let model = FeModel::assemble(&file.mesh, &options).map_err(|e| fault(e.into()))?;
        Ok(Self { path: path.to_owned(), mesh: file.mesh, model })
    }

    /// An interface tied to a group of nodes.
    pub(crate) fn tied(&self, group: &str, at: [f64; 3], tie: Tie) -> Result<Interface, Error> {
        let missing = || Error::File { path: self.path.clone(), what: format!("there is no group {group:?} of nodes") };
        let nodes = self.mesh.node_sets.get(group).ok_or_else(missing)?.clone();
        Ok(Interface { name: group.into(), X_LI: pose(at), nodes, tie })
    }

    /// The same with a rigid tie.
    pub(crate) fn rigid(&self, group: &str, at: [f64; 3]) -> Result<Interface, Error> {
        self.tied(group, at, Tie::Rigid)
    }

    /// The nodes of the plane at `x` as a distributing tie on the x axis.
    pub(crate) fn section(&self, x: f64) -> Interface {
        let nodes = self.mesh.nodes.iter().enumerate().filter(|(_, p)| (p.x - x).abs() < 1e-6).map(|(n, _)| n as u32);
        Interface {
            name: format!("x = {x}"),
            X_LI: pose([x, 0.0, 0.0]),
            nodes: nodes.collect(),
            tie: Tie::Distributing,
        }
    }

    /// Ties, factorises, condenses.
    pub(crate) fn condense(&self, interfaces: &[Interface]) -> Result<Condensation<'_>, Error> {
        Condensation::new(&self.model, interfaces, CondensationOptions::default())
            .map_err(|e| Self::fault(&self.path, e.into()))
    }

    fn fault(path: &Path, source: flexarm_fem::mesh_link::MeshLinkError) -> Error {
        Error::Reduction { path: path.to_owned(), note: String::new(), source: Box::new(source) }
    }
}

fn pose(at: [f64; 3]) -> Pose {
    Pose::from(nalgebra::Translation3::from(Vector3::from(at)))
}
