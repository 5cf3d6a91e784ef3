//! The reducer against two independent FE codes on the same meshes.
//!
//! Truth: CalculiX 2.20 matrices (4-point rule for stiffness and mass of C3D10), condensed, and the
//! frequencies of CalculiX; stored outside the project, so these tests say "skipped" without them.

#![allow(non_snake_case, reason = "K, M as in the theory")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test stops at the first failure and says what it skipped"
)]

use std::path::PathBuf;

use flexarm_fem::element::Quadrature;
use flexarm_fem::mesh::{ReadOptions, read_mesh};
use flexarm_fem::model::{AssemblyOptions, FeModel};
use flexarm_fem::reduction::{Condensation, CondensationOptions, Interface, InterfaceFrame, Superelement, Tie};
use flexarm_fem::sparse::ModesWanted;
use flexarm_fem::{Mesh, Pose, UnitSystem};
use nalgebra::{DMatrix, Vector3};

fn reference(name: &str) -> Option<PathBuf> {
    let start = std::env::var_os("FLEXARM_SHARED").map(PathBuf::from);
    let up = PathBuf::from(env!("CARGO_MANIFEST_DIR")).ancestors().map(|p| p.join("shared")).collect::<Vec<_>>();
    let found = start.into_iter().chain(up).map(|p| p.join("fe").join(name)).find(|p| p.exists());
    if found.is_none() {
        eprintln!("skipped: reference {name} is not on this machine");
    }
    found
}

/// A dense Matrix Market file, `coordinate symmetric` or `array`.
fn matrix(name: &str) -> Option<DMatrix<f64>> {
    let text = std::fs::read_to_string(reference(name)?).unwrap();
    let coordinate = text.lines().next().unwrap().contains("coordinate");
    let mut lines = text.lines().filter(|line| !line.starts_with('%') && !line.trim().is_empty());
    let numbers = |line: &str| line.split_whitespace().map(|w| w.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let head = numbers(lines.next().unwrap());
    let n = head[0] as usize;
    let mut A = DMatrix::zeros(n, n);
    if coordinate {
        for line in lines {
            let entry = numbers(line);
            let (i, j) = (entry[0] as usize - 1, entry[1] as usize - 1);
            A[(i, j)] = entry[2];
            A[(j, i)] = entry[2];
        }
    } else {
        let values: Vec<f64> = lines.flat_map(numbers).collect();
        assert_eq!(values.len(), n * n);
        A.copy_from_slice(&values);
    }
    Some(A)
}

/// Largest difference of entries over `sqrt(d_i d_j)`.
fn difference(A: &DMatrix<f64>, B: &DMatrix<f64>) -> f64 {
    let d = B.diagonal().map(f64::sqrt);
    (0..A.nrows())
        .flat_map(|i| (0..A.ncols()).map(move |j| (i, j)))
        .map(|(i, j)| (A[(i, j)] - B[(i, j)]).abs() / (d[i] * d[j]))
        .fold(0.0, f64::max)
}

fn interfaces(mesh: &Mesh, a: (&str, [f64; 3]), b: (&str, [f64; 3]), tie: Tie) -> Vec<Interface> {
    let one = |name: &str, (set, at): (&str, [f64; 3])| Interface {
        name: name.into(),
        X_LI: Pose::from_parts(Vector3::from(at).into(), nalgebra::Rotation3::identity()),
        nodes: mesh.node_sets[set].clone(),
        tie,
    };
    vec![one("A", a), one("B", b)]
}

struct Case {
    file: &'static str,
    a: (&'static str, [f64; 3]),
    b: (&'static str, [f64; 3]),
    matrices: &'static str,
}

const BEAM_TET: Case = Case {
    file: "A1_beam/beam_tet10_h50mm.inp.gz",
    a: ("INTERFACE_A", [0.0, 0.0, 0.0]),
    b: ("INTERFACE_B", [1.0, 0.0, 0.0]),
    matrices: "A1_beam/beam_tet10_h50mm_ccx",
};
const BEAM_HEX: Case =
    Case { file: "A1_beam/beam_hex20_20x4x2.inp.gz", matrices: "A1_beam/beam_hex20_20x4x2_ccx", ..BEAM_TET };
const ARM: Case = Case {
    file: "A2_lower_arm/arm_tet10_h30mm.inp.gz",
    a: ("INTERFACE_A", [0.0, -0.075, 0.0]),
    b: ("INTERFACE_B", [0.04, 0.11, 1.1]),
    matrices: "A2_lower_arm/arm_tet10_h30mm_ccx",
};

impl Case {
    fn read(&self) -> Option<Mesh> {
        let options = ReadOptions { units: UnitSystem::SI, beams: Vec::new() };
        let file = read_mesh(reference(self.file)?, &options).unwrap();
        Some(file.mesh)
    }

    fn reduce(
        &self,
        mesh: &Mesh,
        quadrature: Quadrature,
        modes: usize,
    ) -> (Superelement, Vec<f64>, Vec<f64>, Vec<f64>) {
        let options = AssemblyOptions { quadrature, material: None };
        let model = FeModel::assemble(mesh, &options).unwrap();
        let interfaces = interfaces(mesh, self.a, self.b, Tie::Rigid);
        let reduction = Condensation::new(&model, &interfaces, CondensationOptions::default()).unwrap();
        let fixed = reduction.fixed_modes(ModesWanted::Count(modes)).unwrap();
        let residuals = reduction.mode_residuals(&fixed);
        let held = reduction.held_modes(ModesWanted::Count(modes)).unwrap().frequencies_hz();
        let free = reduction.free_modes(ModesWanted::Count(modes)).unwrap().frequencies_hz();
        let frames = interfaces
            .iter()
            .map(|i| InterfaceFrame { name: i.name.clone(), X_LI: i.X_LI, tie: Some(i.tie) })
            .collect();
        (reduction.superelement(frames, &fixed), residuals, held, free)
    }

    fn agrees_with_calculix(&self) {
        let Some(mesh) = self.read() else { return };
        let (mut element, residuals, held, _) = self.reduce(&mesh, Quadrature::Calculix, 10);
        let (K, M) = (
            matrix(&format!("{}_K12.mtx", self.matrices)).unwrap(),
            matrix(&format!("{}_M12.mtx", self.matrices)).unwrap(),
        );
        let guyan = element.guyan();
        let (dK, dM) = (difference(&guyan.K, &K), difference(&guyan.M, &M));
        let (K, M) = (
            matrix(&format!("{}_CB22_K.mtx", self.matrices)).unwrap(),
            matrix(&format!("{}_CB22_M.mtx", self.matrices)).unwrap(),
        );
        // A mode has no sign of its own.
        for k in 12..22 {
            let dot: f64 = (0..12).map(|i| element.M[(i, k)] * M[(i, k)] / M[(i, i)]).sum();
            if dot < 0.0 {
                element.M.column_mut(k).neg_mut();
                element.M.row_mut(k).neg_mut();
            }
        }
        let (cK, cM) = (difference(&element.K, &K), difference(&element.M, &M));
        let worst = residuals.iter().copied().fold(0.0, f64::max);
        eprintln!(
            "{}: K12 {dK:.1e} M12 {dM:.1e} CB K {cK:.1e} M {cM:.1e}, mode residual {worst:.1e}, held {:?}",
            self.file,
            &held[..3]
        );
        assert!(dK < 1e-8 && dM < 1e-8 && cK < 1e-8 && cM < 1e-8);
        assert!(worst < 1e-6);
    }
}

#[test]
fn beam_of_tetrahedra_equals_calculix() {
    BEAM_TET.agrees_with_calculix();
}

#[test]
fn beam_of_bricks_equals_calculix() {
    BEAM_HEX.agrees_with_calculix();
}

#[test]
fn lower_arm_equals_calculix() {
    ARM.agrees_with_calculix();
}
