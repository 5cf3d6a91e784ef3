//! Figures of the TCP error: the distance between the TCP of a flexible arm and that of the rigid
//! arm.
//!
//! The TCP error is the flexible pose minus the pose of the rigid twin: the same robot on the same
//! trajectory with every elastic coordinate held at zero. [`tcp_error`] gives it for one sample,
//! [`tcp_metrics`] condenses a record of it: peak, RMS, sag, settling time, overshoot, dominant
//! frequency, parts along and across the path.
//!
//! ```
//! use flexarm_analysis::{ErrorRecord, MetricSettings, tcp_metrics};
//!
//! // A move of one second along x; then the tool rings at 10 Hz around a sag of 0.2 mm.
//! let times: Vec<f64> = (0..3000).map(|k| f64::from(k) * 1e-3).collect();
//! let ringing = |t: f64| if t < 1.0 { 0.0 } else { 1e-3 * (-5.0 * (t - 1.0)).exp() * (62.832 * (t - 1.0)).sin() };
//! let errors: Vec<[f64; 6]> = times.iter().map(|&t| [ringing(t), 0.0, -2e-4, 0.0, 0.0, 0.0]).collect();
//! let rigid: Vec<[f64; 3]> = times.iter().map(|&t| [0.5 * t.min(1.0), 0.0, 0.8]).collect();
//!
//! let record = ErrorRecord {
//!     times: &times,
//!     errors: &errors,
//!     rigid_positions: &rigid,
//!     quasi_static: None,
//!     moves: &[(0.0, 1.0)],
//! };
//! let metrics = tcp_metrics(&record, &MetricSettings::default())?;
//! assert!((metrics.static_sag_m - 2e-4).abs() < 1e-12);
//! assert!((metrics.dominant_hz.unwrap() - 10.0).abs() < 0.05);
//! assert!((metrics.overshoot_m - 8.85e-4).abs() < 1e-5);     // the first swing, in the direction of travel
//! assert!((metrics.settling_s.unwrap() - 0.433).abs() < 0.001); // below 0.1 mm from then on
//! # Ok::<(), flexarm_analysis::RecordError>(())
//! ```
//!
//! [`error_parts`] splits the error into its static part and the part due to motion.
//!
//! A separate part treats linear structures: [`damped_modes`] with the participation of each mode
//! ([`compliance_parts`], [`strain_energy_shares`]), and the response to harmonic excitation
//! ([`LinearSystem::response`], [`response_peaks`]).
//!
//! The inverse problem is solved by [`Inversion`]: joint commands that compensate a TCP error; a
//! [`Shaper`] suppresses the residual vibration of a motion.
//!
//! Names of ISO 9283:1998 are used where they fit. A simulation is deterministic and has one cycle,
//! so these are "ISO 9283-style" figures, not a test according to the standard: path accuracy AT
//! ([`TcpMetrics::path_accuracy_m`]), position overshoot OV ([`TcpMetrics::overshoot_m`]), position
//! stabilisation time ([`TcpMetrics::settling_s`], which is that of the worst stop and is counted
//! from the end of the commanded move, not from the first entry into the band as in the standard).
//!
//! Frames: W world, T tool. Order: linear first, angular second. SI units.
//! Not here: simulation, robots, files. Everything is a pure function of slices and matrices.
#![allow(non_snake_case, reason = "monogram notation: R_WT, X_WT, p_WT")]

mod contributions;
mod damped_modes;
mod error_parts;
mod fatigue;
mod hold;
mod inversion;
mod linear_system;
mod long_record;
mod metrics;
mod optimal_shaper;
mod participation;
mod path_frame;
mod pose_error;
mod record;
mod repeated_pose;
mod servo;
mod shaping;
pub mod signal;
mod spectrum;
mod totals;
mod vibration;

pub use contributions::{ContributionPeak, engineering_strain};
pub use damped_modes::{DampedMode, damped_modes};
pub use error_parts::{ErrorParts, error_parts};
pub use fatigue::{FatigueCycle, SnCurve, rainflow, rainflow_repeating};
pub use flexarm_kinematics::{Pose, rotation_vector};
pub use hold::HoldMetrics;
pub use inversion::{Inversion, InversionError, Node};
pub use linear_system::{
    LinearError, LinearSystem, Quantity, ResponsePeak, Spacing, frequency_grid, resolved_response, response_peaks,
    with_resonances,
};
pub use long_record::LongRecord;
pub use metrics::{MetricSettings, TcpMetrics, tcp_metrics, tcp_metrics_on_path};
pub use optimal_shaper::{OptimalShaper, ShapedMode, ShaperError};
pub use participation::{compliance_parts, effective_mass, mode_outputs, strain_energy_shares};
pub use path_frame::{PathFrame, path_frames};
pub use pose_error::tcp_error;
pub use record::{ErrorRecord, ErrorSample, RecordError};
pub use repeated_pose::RepeatedPose;
pub use servo::NodeServo;
pub use shaping::{Shaper, ShaperKind};
pub use spectrum::{AmplitudeSpectrum, SpectralLine, Taper, amplitude_spectrum, strongest_line};
pub use vibration::vibration_left;

/// Kernels, for the tests of this crate.
#[doc(hidden)]
pub mod internals {
    pub use crate::path_frame::tangential_at;
    pub use crate::repeated_pose::repeated_poses;
}
