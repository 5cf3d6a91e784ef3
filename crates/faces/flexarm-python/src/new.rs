//! A robot file from a robot description.
//!
//! Start at [`new_robot`]. Not here: the draft of the file (`flexarm-new`).

use std::path::PathBuf;

use flexarm::new::Reducer;
use flexarm::robots::{NewOptions, ReadOptions, new_robot as make};
use flexarm::settings::written::message;
use flexarm::{Finding, Severity};
use pyo3::prelude::*;

use crate::caveat;
use crate::failure::OrRaise;
use crate::robot::estimate;
use crate::values::{plain, texts, word};

/// Creates a robot file with initial guesses, and a sample motion, from a URDF or xacro file.
///
/// Parameters
/// ----------
/// urdf : path
/// folder : path
///     Output folder.
/// base, tool : str, optional
///     First link of the arm, and link of the tool.
/// joints : sequence of str, optional
///     Joints that the motion moves.
/// payload : float, optional
///     Mass at the tool (kg); 0 for none.
/// reducers : {"cycloidal", "strain-wave"}, optional
///     Kind of all reducers; by their rated torque if missing.
/// inertia_from_density : float, optional
///     Density (kg/m³) of links without a mass, or with a placeholder.
/// inertia_from_total_mass : float, optional
///     Total mass (kg) of these links.
/// overwrite : bool, default False
///
/// Returns
/// -------
/// dict
///     Files, chain and every assumption, as ``flexarm new --json``.
#[pyfunction]
#[pyo3(signature = (urdf, folder, *, base=None, tool=None, joints=None, payload=None,
                    reducers=None, inertia_from_density=None, inertia_from_total_mass=None, overwrite=false))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
pub(crate) fn new_robot<'py>(
    py: Python<'py>,
    urdf: PathBuf,
    folder: PathBuf,
    base: Option<String>,
    tool: Option<String>,
    #[pyo3(from_py_with = texts)] joints: Option<Vec<String>>,
    payload: Option<f64>,
    reducers: Option<&str>,
    inertia_from_density: Option<f64>,
    inertia_from_total_mass: Option<f64>,
    overwrite: bool,
) -> PyResult<Bound<'py, PyAny>> {
    crate::command::name_keywords();
    let read = ReadOptions {
        search_paths: flexarm::robots::search_paths_from_environment(),
        inertia_from_mesh: estimate(inertia_from_density, inertia_from_total_mass)?,
        ..ReadOptions::default()
    };
    let words = [("cycloidal", Reducer::Cycloidal), ("strain-wave", Reducer::StrainWave)];
    let reducers = reducers.map(|found| word("reducers", found, &words)).transpose()?;
    let options = NewOptions { base, tool, joints, payload_kg: payload, reducers, urdf: read };
    let made = py.detach(|| make(&urdf, &folder, overwrite, &options)).or_raise()?;
    // Doubtful values of the description are warnings; their places and sentences are written for Python.
    let shown = |finding: &Finding| {
        let [location, message] = [&finding.location, &finding.message].map(|text| message(text));
        Finding { location, message, ..finding.clone() }
    };
    let doubtful: Vec<_> =
        made.findings.iter().filter(|finding| finding.severity != Severity::Note).map(shown).collect();
    caveat::say(py, "doubts", (plain(py, &doubtful)?,))?;
    caveat::answer(py, &made, &[])
}
