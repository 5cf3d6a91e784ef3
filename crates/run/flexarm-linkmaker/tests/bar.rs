//! A bar made into a link, exported, and made into a link again.

use std::path::{Path, PathBuf};

use flexarm_linkmaker::export::{ExportFormat, ExportJob, export};
use flexarm_linkmaker::import::{ImportJob, ImportSummary, UnitsOfFile, import};
use flexarm_linkmaker::reduce::{At, InterfaceEntry, ReduceJob, ReduceOutputs, ReduceSummary, Reduction};

/// Length (m), side of the section (m), Young's modulus (Pa) and density (kg/m³) of the bar.
const BAR: [f64; 4] = [1.0, 0.04, 200e9, 7850.0];

/// Folder that is removed at the end of the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("flexarm-linkmaker-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Reduces eight bricks along x, with three modes.
fn reduced(folder: &Path) -> ReduceSummary {
    let [length, side, E, rho] = BAR;
    let mut deck = String::from("*NODE\n");
    for k in 0..=8 {
        for (j, (y, z)) in [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)].into_iter().enumerate() {
            deck += &format!("{},{},{y},{z}\n", 4 * k + j + 1, length / 8.0 * k as f64);
        }
    }
    deck += "*ELEMENT,TYPE=C3D8I,ELSET=bar\n";
    for k in 0..8 {
        let nodes: Vec<String> = (4 * k + 1..=4 * k + 8).map(|node| node.to_string()).collect();
        deck += &format!("{},{}\n", k + 1, nodes.join(","));
    }
    let mesh = folder.join("bar.inp");
    std::fs::write(&mesh, deck).unwrap();
    let end = |name: &str, place: &str| InterfaceEntry {
        name: Some(name.into()),
        select: Some(place.parse().unwrap()),
        at: Some(At::Centroid),
        ..InterfaceEntry::default()
    };
    let job = ReduceJob {
        units: Some("m-kg-s".parse().unwrap()),
        material: Some(format!("{E},0,{rho}").parse().unwrap()),
        modes: Some(3),
        interface: vec![end("A", "plane(0,0,0; 1,0,0)"), end("B", "plane(1,0,0; 1,0,0)")],
        ..ReduceJob::for_mesh(&mesh)
    };
    let outputs = ReduceOutputs { flex: Some(folder.join("bar.flex")), ..ReduceOutputs::default() };
    Reduction::open(&job, Some(&outputs), &mut |_| {}).unwrap().finish(None, &mut |_| {}).unwrap()
}

fn imported(folder: &Path, units: &str) -> ImportSummary {
    let out = folder.join(units);
    let units: UnitsOfFile = units.parse().unwrap();
    let link = folder.join("bar.flex");
    let format = ExportFormat::MatrixMarket;
    export(&ExportJob { link, format, units, nodes: Vec::new(), folder: out.clone(), overwrite: false }).unwrap();
    import(&ImportJob { files: vec![out.join("bar_K.mtx")], ..ImportJob::default() }, None).unwrap()
}

/// Truth: the bar itself, `E A/l` along its axis and mass ρ A l with its centre in the middle.
#[test]
fn a_bar_has_the_stiffness_and_the_mass_of_the_bar() {
    let folder = Folder::new("bar");
    let [length, side, E, rho] = BAR;
    let statics = reduced(&folder.0).statics;
    let (k, m) = (E * side * side / length, rho * side * side * length);
    let errors =
        [statics.stiffness[0][0] / k - 1.0, statics.mass_kg / m - 1.0, statics.com_m[0] / (0.5 * length) - 1.0];
    eprintln!("stiffness, mass, centre of the bar: {errors:?}");
    assert!(errors.iter().all(|error| error.abs() < 1e-11), "{errors:?}"); // measured 5e-14, 9e-16, 0
}

/// Truth: the first link. Units of the files between them are SI and mm, t, s.
#[test]
fn a_link_exported_and_imported_again_is_the_same_link() {
    let folder = Folder::new("round-trip");
    let first = reduced(&folder.0);
    for units in ["m-kg-s", "mm-t-s"] {
        let again = imported(&folder.0, units);
        let scale = |i: usize| first.statics.stiffness[i][i].sqrt();
        let entries = (0..6).flat_map(|i| (0..6).map(move |j| (i, j)));
        let differs = |(i, j): (usize, usize)| {
            (again.statics.stiffness[i][j] - first.statics.stiffness[i][j]).abs() / (scale(i) * scale(j))
        };
        let stiffness = entries.map(differs).fold(0.0, f64::max);
        let mass = (again.statics.mass_kg / first.statics.mass_kg - 1.0).abs();
        let pairs = again.frequencies_hz.iter().zip(&first.frequencies_hz);
        let first_modes = pairs.take(2).map(|(again, hz)| (again / hz - 1.0).abs()).fold(0.0, f64::max);
        eprintln!("{units}: stiffness {stiffness:.1e}, mass {mass:.1e}, frequencies {first_modes:.1e}");
        // Measured 2e-16, 3e-13 and 3e-4: the reduced matrices against the mesh.
        assert!(
            stiffness < 1e-12 && mass < 1e-9 && first_modes < 1e-3,
            "{units}: {stiffness:e} {mass:e} {first_modes:e}"
        );
        assert!(again.checks.mass_error.is_some_and(|error| error < 1e-9), "{units}: {:?}", again.checks.mass_error);
    }
}

/// The keys are a contract: those of both summaries stand side by side at the top.
#[test]
fn both_summaries_have_mass_stiffness_and_cost_at_their_top() {
    let folder = Folder::new("keys");
    let both = [serde_json::to_value(reduced(&folder.0)), serde_json::to_value(imported(&folder.0, "m-kg-s"))];
    for summary in both.map(Result::unwrap) {
        for key in ["mass_kg", "com_m", "inertia", "stiffness", "compliance", "split_m", "parts", "wall_s", "cpu_s"] {
            assert!(summary.get(key).is_some(), "{key}");
        }
        assert!(summary.get("statics").is_none() && summary.get("cost").is_none());
    }
}
