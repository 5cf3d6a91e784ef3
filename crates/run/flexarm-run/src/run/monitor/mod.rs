//! Monitors of a run: one file per quantity, each a struct that receives every logged sample
//! (`update`) and returns its figures at any time (`result`).
//!
//! A monitor receives the arm as observed by the stepper ([`Observation`]) and the rigid twin, and
//! keeps sums and maxima, no curves. Not here: samples for recordings (`run::sampler`), messages
//! about the figures (`caveat`).

pub(crate) mod contribution;
pub(crate) mod deflection;
pub(crate) mod drive_load;
pub(crate) mod energy;
pub(crate) mod strain;
pub(crate) mod stress;
pub(crate) mod tool;
pub(crate) mod tool_path;

use std::sync::Arc;

use flexarm_kinematics::Frame;
use flexarm_stepping::{Observation, Plant};

use crate::arm::Arm;
use crate::motions::tool_path::ToolPath;
use crate::run::monitor::contribution::Contributions;
use crate::run::monitor::deflection::Deflections;
use crate::run::monitor::drive_load::DriveLoads;
use crate::run::monitor::energy::Energy;
use crate::run::monitor::strain::Strains;
use crate::run::monitor::stress::StressMonitor;
use crate::run::monitor::tool::{ToolError, ToolMonitor};
use crate::run::monitor::tool_path::ToolPathMonitor;
use crate::run::twin::RigidTwin;

/// All monitors of a run.
pub(crate) struct Monitors {
    pub(crate) tool: ToolMonitor,
    pub(crate) contributions: Contributions,
    pub(crate) strains: Strains,
    pub(crate) deflections: Deflections,
    pub(crate) drive_loads: DriveLoads,
    pub(crate) energy: Energy,
    /// For links with stress fields.
    pub(crate) stress: Option<StressMonitor>,
    /// For motions given as TCP paths.
    pub(crate) tool_path: Option<ToolPathMonitor>,
}

impl Monitors {
    /// Creates the monitors of an arm of a robot with `n_drives` drives; those of TCP and stress
    /// are built separately.
    pub(crate) fn new(
        plant: &Plant,
        arm: &Arm,
        n_drives: usize,
        tool: ToolMonitor,
        stress: Option<StressMonitor>,
        tool_path: Option<Arc<ToolPath>>,
    ) -> Self {
        Self {
            tool,
            contributions: Contributions::new(arm, n_drives),
            strains: Strains::new(arm, &plant.model),
            deflections: Deflections::new(plant, arm, n_drives),
            drive_loads: DriveLoads::new(plant),
            energy: Energy::new(&plant.model),
            stress,
            tool_path: tool_path.map(ToolPathMonitor::new),
        }
    }

    /// Passes a sample to all monitors; returns its TCP error.
    pub(crate) fn update(&mut self, observed: &Observation, twin: &RigidTwin, plant: &Plant, tcp: &Frame) -> ToolError {
        self.drive_loads.update(observed);
        self.contributions.update(observed, twin, plant);
        self.strains.update(observed.t, &observed.X_WB, &twin.data.X_WB);
        self.deflections.update(&observed.q);
        self.energy.update(observed);
        if let Some(stress) = &mut self.stress {
            stress.update(observed);
        }
        let tool = self.tool.update(observed, twin, tcp);
        if let Some(path) = &mut self.tool_path {
            path.update(observed.t, &tool, &twin.velocity);
        }
        tool
    }
}
