//! Monitors of a run: one file each, with a struct that receives every logged sample
//! (`update`) and says at the end, or at any time before, what it has seen (`result`).
//!
//! A monitor sees the arm as the stepper shows it ([`Observation`]) beside the rigid twin, and
//! keeps sums and largest values, no curves. Not here: samples for recordings (`run::sampler`),
//! sentences about what was seen (`caveat`).

pub(crate) mod contribution;
pub(crate) mod deflection;
pub(crate) mod drive_load;
pub(crate) mod energy;
pub(crate) mod strain;
pub(crate) mod tool;
pub(crate) mod tool_path;

use std::sync::Arc;

use flexarm_kinematics::Frame;
use flexarm_stepping::{FlexibleArm, Observation};

use crate::flexible::FlexibleRobot;
use crate::monitor::contribution::Contributions;
use crate::monitor::deflection::Deflections;
use crate::monitor::drive_load::DriveLoads;
use crate::monitor::energy::Energy;
use crate::monitor::strain::Strains;
use crate::monitor::tool::{ToolError, ToolMonitor};
use crate::monitor::tool_path::ToolPathMonitor;
use crate::tool_path::ToolPath;
use crate::twin::RigidTwin;

/// All monitors of a run.
pub(crate) struct Monitors {
    pub(crate) tool: ToolMonitor,
    pub(crate) contributions: Contributions,
    pub(crate) strains: Strains,
    pub(crate) deflections: Deflections,
    pub(crate) drive_loads: DriveLoads,
    pub(crate) energy: Energy,
    /// Monitor for motions that are given as a TCP path.
    pub(crate) tool_path: Option<ToolPathMonitor>,
}

impl Monitors {
    /// For an arm of a robot with `n_drives` drives; `tool` has its own needs.
    pub(crate) fn new(arm: &FlexibleArm, flexible: &FlexibleRobot, n_drives: usize, tool: ToolMonitor) -> Self {
        Self {
            tool,
            contributions: Contributions::new(flexible, n_drives),
            strains: Strains::new(flexible, &arm.model),
            deflections: Deflections::new(arm, flexible, n_drives),
            drive_loads: DriveLoads::new(arm),
            energy: Energy::new(&arm.model),
            tool_path: None,
        }
    }

    /// The same, with an eye on the path of the tool.
    #[must_use]
    pub(crate) fn along(self, path: Option<Arc<ToolPath>>) -> Self {
        Self { tool_path: path.map(ToolPathMonitor::new), ..self }
    }

    /// Shows a sample to all; the error of the tool in it.
    pub(crate) fn update(&mut self, seen: &Observation, twin: &RigidTwin, arm: &FlexibleArm, tcp: &Frame) -> ToolError {
        self.drive_loads.update(seen);
        self.contributions.update(seen, twin, arm);
        self.strains.update(&seen.X_WB, &twin.data.X_WB);
        self.deflections.update(&seen.q);
        self.energy.update(seen);
        let tool = self.tool.update(seen, twin, tcp);
        if let Some(path) = &mut self.tool_path {
            path.update(seen.t, &tool, &twin.velocity);
        }
        tool
    }
}
