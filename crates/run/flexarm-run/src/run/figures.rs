//! Computes the figures of a run from its monitors, and checks whether its models are valid.
//!
//! Start at `RunLoop::summary`. Not here: sums and maxima during the run (`monitor`), thresholds
//! and sentences of caveats (`caveat`).

use flexarm_analysis::TcpMetrics;
use flexarm_kinematics::{Frame, forward_kinematics};
use flexarm_log::Event;
use flexarm_stepping::Plant;

use super::before::BeforeRun;
use super::{Detail, RunLoop, moves};
use crate::arm::Owner;
use crate::arm::options::RunOptions;
use crate::caveat::{Finding, drives, kinds, validity};
use crate::poses::posed::{set_equilibrium, undeformed};
use crate::run::headline::{self, Bending, ShareFigures};
use crate::run::monitor::stress::StressMonitor;
use crate::run::summary::{CURVE_PIECES, DriveFigures, LinkFigures, StepperFigures, Summary, TcpFigures};

impl RunLoop<'_> {
    /// Returns the figures so far; `robot_caveats` come before those of the run.
    pub(super) fn summary(&self, robot_caveats: Vec<Finding>) -> (Summary, Vec<Event>) {
        // A run that stopped immediately has no metrics.
        let metrics = self.monitors.tool.result().metrics().ok();
        let metrics = metrics.as_ref().filter(|_| self.options.with_twin);
        let (links, elastic_drives) = (self.link_figures(), self.drive_figures());
        let sag_m = static_sag(&self.plant, &self.tcp);
        let robot = self.robot;
        let by_choice = !robot.flexible_links.is_empty()
            || robot.is_mounted()
            || robot.drives.iter().any(|drive| drive.gearbox.is_some());
        let coordinates = self.plant.model.coordinates().iter();
        let peaks = coordinates.zip(self.monitors.drive_loads.result());
        let mut summary = Summary {
            bends: Bending {
                links: links.iter().map(|link| link.name.clone()).filter(|name| !robot.stands_on(name)).collect(),
                gearboxes: elastic_drives.iter().map(|drive| drive.joint.clone()).collect(),
                mounting: links.iter().map(|link| link.name.clone()).find(|name| robot.stands_on(name)),
            },
            robot: robot.name.clone(),
            trajectory: self.motion.name.clone(),
            links_model: self.arm.links_model().into(),
            duration_s: self.monitors.tool.result().last_time_s().unwrap_or(0.0),
            stepper: StepperFigures::new(self.options, self.stepper.counts()),
            tcp: metrics.map(|m| self.tool_figures(m, sag_m)),
            path: metrics.and_then(|_| self.monitors.tool_path.as_ref()?.result()),
            frequencies_hz: self.plant.modes.frequencies_hz(),
            energy: self.monitors.energy.result(),
            drives: peaks.map(|(c, load)| (c.joint.clone(), load.peak)).collect(),
            motors: self.motors.clone(),
            moves_s: moves(self.motion).iter().map(|&(start, end)| [start, end]).collect(),
            error_curve: self.monitors.tool.result().largest_errors(CURVE_PIECES),
            links,
            stress: self.monitors.stress.as_ref().map_or_else(Vec::new, StressMonitor::result),
            elastic_drives,
            ..Summary::default()
        };
        summary.caveats = self.caveats(&summary, sag_m, robot_caveats);
        summary.headline = headline::headline(&summary, by_choice);
        let events = if self.detail == Detail::Curves { self.events(metrics) } else { Vec::new() };
        (summary, events)
    }

    /// Returns what the flexible links contribute, and how far they deform.
    fn link_figures(&self) -> Vec<LinkFigures> {
        let measured = self.monitors.contributions.result().iter().zip(self.monitors.strains.result());
        let figures = self.arm.spans.iter().zip(measured).map(|(span, (moved, strained))| LinkFigures {
            name: span.link.clone(),
            peak_contribution_m: moved.peak_m,
            engineering_strain: strained.strain,
            peak_rotation_rad: strained.rotation,
        });
        figures.collect()
    }

    /// Returns what the elastic drives contribute, and how far they deflect.
    fn drive_figures(&self) -> Vec<DriveFigures> {
        let moved = &self.monitors.contributions.result()[self.arm.spans.len()..];
        let measured = moved.iter().zip(self.monitors.deflections.result());
        let drives = self.robot.drives.iter().zip(measured).enumerate();
        let elastic = drives.filter(|(k, _)| self.arm.owners.contains(&Owner::Drive(*k)));
        let figures = elastic.map(|(_, (drive, (moved, deflection)))| DriveFigures {
            joint: drive.joint.clone(),
            peak_contribution_m: moved.peak_m,
            peak_deflection_rad: *deflection,
            slides: drive.guide().is_none()
                && self.plant.model.coordinates().iter().any(|c| c.joint == drive.joint && c.slides()),
        });
        figures.collect()
    }

    /// Returns the figures of the TCP with its static and dynamic part.
    fn tool_figures(&self, metrics: &TcpMetrics, static_sag_m: f64) -> TcpFigures {
        let figures = TcpFigures {
            static_sag_m,
            shares_at_peak: self.shares_at_peak(),
            ..TcpFigures::from(metrics).with_band(self.options.settling_band_m)
        };
        match self.monitors.tool.result().parts() {
            Ok(parts) => figures.with_parts(&parts),
            Err(_) => figures,
        }
    }

    /// Contribution of each contributor to the maximum error, along the error's direction.
    fn shares_at_peak(&self) -> Vec<ShareFigures> {
        let (along, rest) = self.at_peak.along(&self.tcp);
        let mut places = vec![0.0; self.monitors.contributions.moved().len()];
        for (k, along) in along.iter().enumerate() {
            places[self.monitors.contributions.place_of(k, &self.plant)] += along;
        }
        let shares = self.contributors.iter().map(|who| ShareFigures {
            name: who.name.clone(),
            kind: who.kind.into(),
            along_m: places[who.place],
        });
        let of_stepper = self.options.stepper.entry().maximal.then(|| ShareFigures {
            name: self.options.stepper.name().into(),
            kind: headline::STEPPER.into(),
            along_m: rest,
        });
        shares.chain(of_stepper).collect()
    }

    /// Caveats about the input and the validity of the models in the run so far.
    fn caveats(&self, summary: &Summary, sag_m: f64, mut caveats: Vec<Finding>) -> Vec<Finding> {
        let (arm, plant, motion, options) = (self.arm, &*self.plant, self.motion, self.options);
        caveats.extend(BeforeRun { arm, plant, motion, options }.caveats(sag_m));
        caveats.extend(self.drive_caveats());
        if let Some(tcp) = summary.tcp.as_ref() {
            let of_stepper = tcp.shares_at_peak.iter().filter(|share| share.kind == headline::STEPPER);
            caveats.extend(of_stepper.filter_map(|s| validity::drift(&s.name, s.along_m.abs() / tcp.peak_m)));
            let usual_m = RunOptions::default().settling_band_m;
            let stops = !tcp.holds.is_empty();
            caveats.extend(validity::band(self.options.settling_band_m, tcp.peak_m, usual_m).filter(|_| stops));
        }
        for link in &summary.links {
            caveats.extend(validity::link(&link.name, link.peak_rotation_rad, link.engineering_strain));
        }
        caveats.extend(self.spin_caveats());
        caveats.extend(validity::stress(&summary.stress));
        if self.monitors.stress.as_ref().is_some_and(StressMonitor::is_blind) {
            caveats.push(kinds::NO_STRESS.found(format!("stepper {}", self.options.stepper.name()), 0.0, 0.0));
        }
        caveats.extend(validity::energy(self.monitors.energy.result().imbalance));
        let efforts = self.effort_caveats();
        // The torque of the run replaces that of the rigid robot.
        let is_known = |of: &Finding| efforts.iter().any(|run| run.location == of.location);
        caveats.retain(|caveat| caveat.code != kinds::MOTION_EFFORT.code || !is_known(caveat));
        caveats.extend(efforts);
        caveats
    }

    /// Caveats about modal links that turn fast without geometric stiffening.
    fn spin_caveats(&self) -> Vec<Finding> {
        let first_hz = self.plant.modes.frequencies_hz().first().copied().unwrap_or(f64::INFINITY);
        let links = self.arm.spans.iter().zip(self.monitors.strains.result()).enumerate();
        let elements = || self.plant.elements.iter().zip(&self.arm.owners);
        let is_linear =
            |k: usize| elements().any(|(e, owner)| *owner == Owner::Link(k) && e.modal && e.geometric.is_none());
        let soft = links.filter(|(k, _)| is_linear(*k));
        soft.filter_map(|(_, (span, measured))| validity::spin(&span.link, measured.speed, first_hz)).collect()
    }

    /// Caveats about gearbox deflections.
    fn drive_caveats(&self) -> Vec<Finding> {
        let coordinates = self.plant.model.coordinates();
        let drives = self.robot.drives.iter().zip(self.monitors.deflections.result()).enumerate();
        let elastic = drives.filter(|(k, _)| self.arm.owners.contains(&Owner::Drive(*k)));
        let found = elastic.flat_map(|(_, (drive, give))| {
            let joint = coordinates.iter().find(|c| c.joint == drive.joint);
            let slides = joint.is_some_and(|c| c.slides()) && drive.guide().is_none();
            let [turned, moved] = if slides { [0.0, *give] } else { [*give, 0.0] };
            let effort = joint.map_or(f64::INFINITY, |c| c.limits.effort);
            let [turning, sliding] = drive.play(slides);
            drives::give(drive, effort, (turned - turning).max(0.0), (moved - sliding).max(0.0), 2.0)
        });
        found.collect()
    }

    /// Caveats about drive torques and forces that exceed their limits.
    fn effort_caveats(&self) -> Vec<Finding> {
        let (coordinates, loads) = (self.plant.model.coordinates(), self.monitors.drive_loads.result());
        let peaks: Vec<f64> = loads.iter().map(|load| load.peak).collect();
        let mut caveats: Vec<Finding> = validity::efforts(&kinds::EFFORT, coordinates, &peaks).collect();
        for (c, load) in coordinates.iter().zip(loads).filter(|(_, load)| load.at_limit > 0) {
            let share = 100.0 * load.at_limit as f64 / self.monitors.tool.result().len() as f64;
            caveats.push(kinds::SERVO_LIMIT.found(format!("joint {:?}", c.joint), share, 0.0));
        }
        caveats
    }
}

/// Computes the TCP error with the drives at rest in their initial position, also for runs that
/// start undeformed (m).
pub fn static_sag(plant: &Plant, tcp: &Frame) -> f64 {
    let (mut data, mut state) = undeformed(plant);
    forward_kinematics(&plant.model, &mut data, &state.q);
    let rigid = data.X_WF(tcp).translation.vector;
    set_equilibrium(plant, &mut state);
    forward_kinematics(&plant.model, &mut data, &state.q);
    (data.X_WF(tcp).translation.vector - rigid).norm()
}
