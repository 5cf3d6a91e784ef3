//! The bar as a mesh: flexarm's finite elements, CalculiX, beam theory, and the reduced link.
//!
//! The bar lies along x from A to B; compliances at B, or at sections, with A held (m, rad per N, N
//! m). Not here: the bar of beam theory (`study.rs`).

use flexarm::Robot;
use flexarm_fem::UnitSystem;
use flexarm_fem::reduction::{Condensation, Tie};
use flexarm_fem::sparse::ModesWanted;
use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};

use super::bar::{LENGTH_M, bar, bar_with_shear};
use super::study::{GUYAN, SETTLING_STEP_S};
use super::{G, MESH, STORED, nth, without_ball};
use crate::Error;
use crate::bench::{Bench, Rig, Stored, Worst, in_modes, in_parts, larger, small_loads, weightless};
use crate::compliance::{Method, by_every_method};
use crate::meshed::Meshed;
use crate::textbook::Stiffness;

/// Number of elements along x, y and z.
pub(super) const ELEMENTS: [usize; 3] = [40, 2, 2];
/// Positions of the loaded sections (m).
const STATIONS_M: [f64; 3] = [0.2, 0.4, 0.6];
/// Number of frequencies compared.
pub(super) const MODES: usize = 4;
/// Index of torsion in lists of loads.
const TORSION: usize = 3;
/// Number of modes in the link file.
const ALL_MODES: usize = 10;

/// Findings on the mesh.
pub(super) struct BarMesh {
    /// Program, script and date of the stored results.
    pub(super) provenance: String,
    /// Compliance of the end by flexarm's elements and by CalculiX (m/N, rad/(N m)).
    pub(super) own: Matrix6<f64>,
    pub(super) calculix: Matrix6<f64>,
    pub(super) methods: Vec<Method>,
    /// Relative error of beam theory with respect to flexarm's mesh, load by load: Euler-Bernoulli,
    /// Timoshenko.
    pub(super) euler_errors: [f64; 6],
    pub(super) timoshenko_errors: [f64; 6],
    pub(super) stations: Vec<SectionLoad>,
    pub(super) weight: MeshWeight,
}

/// A unit load at a section.
pub(super) struct SectionLoad {
    pub(super) name: &'static str,
    pub(super) x_m: f64,
    /// Deflection of that section and of the end, flexarm's mesh (m per N or N m).
    pub(super) here: f64,
    pub(super) end: f64,
    /// Maximum difference of CalculiX over all sections and components.
    pub(super) calculix_error: f64,
    /// Relative error of the closed form with respect to flexarm's mesh: that section, the end.
    pub(super) closed_errors: [f64; 2],
}

/// The bar without the ball under its own weight; frequencies with A held.
pub(super) struct MeshWeight {
    /// Sag along z and y by CalculiX (m), and its frequencies (Hz).
    pub(super) sag_m: [f64; 2],
    pub(super) hz: Vec<f64>,
    /// Relative differences of the frequencies of flexarm's mesh.
    pub(super) own_hz_errors: [f64; MODES],
    pub(super) models: Vec<MeshModel>,
}

/// A model of the reduced link, with relative differences.
pub(super) struct MeshModel {
    pub(super) name: String,
    pub(super) modal: bool,
    pub(super) sag_errors: [f64; 2],
    pub(super) hz_errors: Vec<f64>,
}

impl BarMesh {
    pub(super) fn new(bench: &Bench, meshed: &Robot) -> Result<Self, Error> {
        let stored = bench.stored(STORED)?;
        let fe = Meshed::read(bench, MESH, UnitSystem::SI)?;
        let mut interfaces = vec![
            fe.interface("A", Vector3::zeros(), Tie::Rigid)?,
            fe.interface("B", Vector3::new(LENGTH_M, 0.0, 0.0), Tie::Rigid)?,
        ];
        interfaces.extend(STATIONS_M.map(|x| fe.section(x)));
        // Compliance of all interfaces but A, which is held.
        let condensation = fe.condense(&interfaces)?;
        let (K, held) = (condensation.stiffness(), 6 * (interfaces.len() - 1));
        let C = K
            .view((6, 6), (held, held))
            .into_owned()
            .try_inverse()
            .ok_or_else(|| Error::Case(format!("{MESH}: the held mesh is a mechanism")))?;
        let own = Matrix6::from_fn(|i, j| C[(i, j)]);
        let others = [in_parts(9), in_modes(ALL_MODES)];
        let against_own = |theory: Stiffness| {
            let theory = theory.tip_compliance();
            std::array::from_fn(|j| theory[(j, j)] / own[(j, j)] - 1.0)
        };
        Ok(Self {
            provenance: stored.provenance(),
            own,
            calculix: stored.matrix6("C_BB")?,
            methods: by_every_method(meshed, None, &small_loads(&own), SETTLING_STEP_S, &others)?,
            euler_errors: against_own(bar()),
            timoshenko_errors: against_own(bar_with_shear()),
            stations: section_loads(&C, &stored)?,
            weight: MeshWeight::new(meshed, &stored, &condensation)?,
        })
    }

    /// Absolute torsional error of Timoshenko theory.
    pub(super) fn torsion_error(&self) -> f64 {
        self.timoshenko_errors[TORSION].abs()
    }

    /// Maximum error of Timoshenko theory in stretch and bending.
    pub(super) fn bending_error(&self) -> f64 {
        let rest = (0..6).filter(|j| *j != TORSION).map(|j| self.timoshenko_errors[j].abs());
        rest.fold(0.0, larger)
    }

    /// Maximum difference of CalculiX under loads at sections.
    pub(super) fn worst_at_sections(&self) -> f64 {
        self.stations.iter().map(|load| load.calculix_error).fold(0.0, larger)
    }
}

/// Applies a unit force along z and a unit moment about y at each section.
///
/// * `C`: compliance over B and the sections, in this order.
fn section_loads(C: &DMatrix<f64>, stored: &Stored) -> Result<Vec<SectionLoad>, Error> {
    let mut loads = Vec::new();
    for (k, x_m) in STATIONS_M.into_iter().enumerate() {
        for (name, component) in [("Fz", 2), ("My", 4)] {
            loads.push(section_load(C, stored, k + 1, x_m, (name, component))?);
        }
    }
    Ok(loads)
}

fn section_load(
    C: &DMatrix<f64>,
    stored: &Stored,
    section: usize,
    x_m: f64,
    (name, component): (&'static str, usize),
) -> Result<SectionLoad, Error> {
    let column = 6 * section + component;
    let own = |place: usize| -> Vector6<f64> { C.fixed_view::<6, 1>(6 * place, column).into_owned() };
    let entry = find_load(stored, x_m, name)?;
    let mut calculix_error = 0.0f64;
    for (place, at) in (1..=STATIONS_M.len()).chain([0]).zip(0..) {
        let theirs = stored.vector6(&format!("{entry}/at/{at}/u"))?;
        let scale = |i: usize| (C[(6 * place + i, 6 * place + i)] * C[(column, column)]).sqrt();
        let apart = (0..6).map(|i| (theirs[i] - own(place)[i]) / scale(i)).worst();
        calculix_error = larger(calculix_error, apart);
    }
    let (here, end) = (own(section)[2], own(0)[2]);
    let shear = bar_with_shear();
    let closed = |at: f64| match name {
        "Fz" => shear.under_force(1.0, x_m, at)[0] + x_m / shear.kGA[1],
        _ => -shear.under_moment(1.0, x_m, at)[0],
    };
    let closed_errors = [closed(x_m) / here - 1.0, closed(LENGTH_M) / end - 1.0];
    Ok(SectionLoad { name, x_m, here, end, calculix_error, closed_errors })
}

/// Path of a load in the stored list.
fn find_load(stored: &Stored, x: f64, load: &str) -> Result<String, Error> {
    let count = stored.at("station_loads")?.as_array().map_or(0, Vec::len);
    for k in 0..count {
        let entry = format!("station_loads/{k}");
        let here = stored.number(&format!("{entry}/x"))?;
        if (here - x).abs() < 1e-9 && stored.at(&format!("{entry}/load"))?.as_str() == Some(load) {
            return Ok(entry);
        }
    }
    stored.at(&format!("station_loads/{load} at {x}")).map(|_| String::new())
}

impl MeshWeight {
    fn new(meshed: &Robot, stored: &Stored, condensation: &Condensation<'_>) -> Result<Self, Error> {
        let bare = without_ball(meshed);
        let held = condensation
            .held_modes(ModesWanted::Count(MODES))
            .map_err(|error| Error::Case(format!("{MESH}: {error}")))?
            .frequencies_hz();
        let sag_m = [stored.vector6("gravity/-z")?[2], stored.vector6("gravity/-y")?[1]];
        let hz = stored.numbers("frequencies_hz")?;
        let lumped = [2, 3, 5, 9].map(|n| (in_parts(n), false));
        let modal = [((GUYAN.to_owned(), in_modes(0).1), true), (in_modes(ALL_MODES), true)];
        let models = lumped.into_iter().chain(modal).map(|((name, modelling), modal)| {
            let mut sag_errors = [0.0; 2];
            for ((error, axis), truth) in sag_errors.iter_mut().zip([2, 1]).zip(sag_m) {
                let mut robot = bare.clone();
                robot.rigid.gravity = Vector3::from_fn(|i, _| if i == axis { -G } else { 0.0 });
                *error = Rig::new(&robot, &modelling, None)?.statics(&Vector6::zeros())?[axis] / truth - 1.0;
            }
            // The first four modes of the mesh are alternately sideways and upward bending.
            let [side, up] = Rig::new(&weightless(bare.clone()), &modelling, None)?.bending_hz();
            let found = [nth(&side, 0), nth(&up, 0), nth(&side, 1), nth(&up, 1)];
            let hz_errors = found.iter().zip(&hz).map(|(f, truth)| f / truth - 1.0).collect();
            Ok(MeshModel { name, modal, sag_errors, hz_errors })
        });
        let models = models.collect::<Result<_, Error>>()?;
        let own_hz_errors = std::array::from_fn(|k| held[k] / hz[k] - 1.0);
        Ok(Self { sag_m, hz, own_hz_errors, models })
    }

    /// Maximum sag error of modal links.
    pub(super) fn modal_sag_error(&self) -> f64 {
        let modal = self.models.iter().filter(|model| model.modal);
        modal.flat_map(|model| model.sag_errors).map(f64::abs).fold(0.0, larger)
    }

    /// Maximum frequency error of modal links with all modes.
    pub(super) fn all_modes_hz_error(&self) -> f64 {
        let model = self.models.iter().find(|model| model.name == in_modes(ALL_MODES).0);
        model.map_or(f64::NAN, |model| model.hz_errors.iter().copied().worst())
    }
}
