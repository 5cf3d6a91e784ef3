//! A cast lower arm: from a tetrahedral mesh to a link, each step compared with the mesh and with
//! two other programs.
//!
//! `truth` has the results of the mesh and of the other programs, `study` computes findings, `page`
//! writes them up.

mod page;
mod study;
mod truth;

use flexarm::Robot;
use flexarm_fem::UnitSystem;
use flexarm_fem::reduction::Tie;

use crate::bench::Bench;
use crate::meshed::Meshed;
use crate::page::Case;
use crate::{Error, Pace};

use study::{FlangeLoads, Frequencies, Ties, Weight};
use truth::{Program, Truth};

const ROBOT: &str = "robots/test/lower_arm/robot.toml";
const MESH: &str = "robots/test/lower_arm/lower_arm.msh.gz";
/// Acceleration of gravity (m/s²).
const G: f64 = 9.81;
/// The frame at interface B.
const B: Option<&str> = Some("flange");
/// Numbers of parts and of modes in the link file.
const CHAINS: [usize; 3] = [3, 4, 8];
const ALL_MODES: usize = 10;
const AXES: [&str; 3] = ["x", "y", "z"];

/// Findings of the case.
struct Findings {
    about: About,
    flange_loads: FlangeLoads,
    weight: Weight,
    frequencies: Frequencies,
    /// Findings that need the whole mesh; `None` in a quick run.
    whole: Option<MeshResult>,
}

/// The casting and the programs it is compared with.
struct About {
    mass_kg: f64,
    /// Distance from A to B (m).
    length_m: f64,
    /// Programs, scripts and dates of the stored results.
    programs: String,
}

/// Findings on the whole mesh.
struct MeshResult {
    degrees_of_freedom: usize,
    ties: Ties,
}

impl About {
    fn new(robot: &Robot, programs: &[Program; 2]) -> Self {
        let reduced = &robot.flexible_links[0].flexible.reduced;
        let along = reduced.X_LB.translation.vector - reduced.X_LA.translation.vector;
        Self {
            mass_kg: reduced.proximal.mass + reduced.distal.mass,
            length_m: along.norm(),
            programs: format!("{}; {}", programs[0].provenance, programs[1].provenance),
        }
    }
}

impl Findings {
    fn new(bench: &Bench) -> Result<Self, Error> {
        let mut robot = bench.robot(ROBOT)?;
        // The truths are those of the casting without the flange.
        for link in robot.rigid.links.iter_mut().filter(|link| link.name == "flange") {
            link.inertia = None;
        }
        let programs = Program::both(bench)?;
        let about = About::new(&robot, &programs);
        if bench.quick {
            let truth = Truth::filed(&robot, programs[1].truth.hz.clone())?;
            return Self::against(&robot, &truth, &programs, about, None);
        }
        let mesh = Meshed::read(bench, MESH, "mm-t-s".parse::<UnitSystem>()?)?;
        let reduced = &robot.flexible_links[0].flexible.reduced;
        let (p_A, p_B) = (reduced.X_LA.translation.vector, reduced.X_LB.translation.vector);
        let condensed = mesh.condensed([Tie::Rigid; 2], p_A, p_B)?;
        let truth = Truth::new(&condensed)?;
        let whole =
            MeshResult { degrees_of_freedom: mesh.size(), ties: Ties::new(&mesh, [p_A, p_B], &truth, &programs)? };
        Self::against(&robot, &truth, &programs, about, Some(whole))
    }

    fn against(
        robot: &Robot,
        truth: &Truth,
        programs: &[Program; 2],
        about: About,
        whole: Option<MeshResult>,
    ) -> Result<Self, Error> {
        Ok(Self {
            about,
            flange_loads: FlangeLoads::new(robot, truth, programs)?,
            weight: Weight::new(robot, truth, programs)?,
            frequencies: Frequencies::new(robot, truth, programs)?,
            whole,
        })
    }

    /// Name of the truth in claims: the mesh, or the matrices of the link file.
    fn truth_name(&self) -> &'static str {
        if self.whole.is_some() { "the mesh" } else { "matrices of the link file" }
    }
}

/// Runs the case.
pub(crate) fn case(bench: &Bench, _pace: &mut Pace<'_>) -> Result<Case, Error> {
    Ok(page::page(&Findings::new(bench)?))
}
