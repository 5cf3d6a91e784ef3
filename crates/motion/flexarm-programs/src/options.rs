//! What a reader is told beside the file.

use std::path::PathBuf;

use flexarm_spatial::Pose;
use nalgebra::{Rotation3, Vector3};

/// A language of robot programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Language {
    /// KUKA's KRL (`.src` with `.dat`).
    Krl,
    /// ABB's RAPID (`.mod`, `.prg`, `.sys`).
    Rapid,
    /// Universal Robots' URScript (`.script`, `.urscript`).
    UrScript,
    /// G-code of milling machines, RS274/NGC (`.nc`, `.ngc`, `.tap`, `.gcode`).
    GCode,
}

impl Language {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Krl => "KUKA KRL",
            Self::Rapid => "ABB RAPID",
            Self::UrScript => "URScript",
            Self::GCode => "G-code",
        }
    }
}

/// Pose `X_WF` of the flange in the controller's world for joint values (rad or m); `None` if they
/// are not as many as the robot has.
pub type ForwardKinematics<'a> = &'a dyn Fn(&[f64]) -> Option<Pose>;

/// What a reader is told beside the file; all may stay as it is.
#[derive(Clone)]
pub struct ReadOptions<'a> {
    /// The language; `None`: recognised by the content.
    pub language: Option<Language>,
    /// Routine with which the program starts; `None`: what the language says (`main`, the first
    /// `DEF`).
    pub entry: Option<String>,
    /// Joint values at the start, rad or m; with them a program may begin with a line.
    pub start: Option<Vec<f64>>,
    /// Names and values that the file leaves open, in its language:
    /// `("BASE_DATA[1]", "{X 1000, Y 0, Z 500, A 0, B 0, C 0}")`, `("di1", "1")`.
    pub given: Vec<(String, String)>,
    /// Further files of the program with their bytes: KUKA's `$config.dat`, other modules.
    pub companions: Vec<(PathBuf, Vec<u8>)>,
    /// Look beside the file for what belongs to it: KUKA's `.dat`, and `.src` of routines that it
    /// calls.
    pub find_companions: bool,
    /// Waiting for the outside (`WAIT FOR`, `WaitDI`) is taken as over at once.
    pub waits_are_over: bool,
    /// How often a loop without end is run; `None`: such a loop is an error.
    pub endless_passes: Option<usize>,
    /// Moves and dwells at most.
    pub most_moves: usize,
    /// Statements at most that are run.
    pub most_steps: usize,
    /// Kinematics of the robot, for moves relative to a position that was told in joint values.
    pub forward: Option<ForwardKinematics<'a>>,
    /// The robot's own tool centre point on its flange, `X_FT`, for the same.
    pub own_tool: Option<Pose>,
    /// What only G-code needs.
    pub gcode: GCodeOptions,
}

impl Default for ReadOptions<'_> {
    fn default() -> Self {
        Self {
            language: None,
            entry: None,
            start: None,
            given: Vec::new(),
            companions: Vec::new(),
            find_companions: true,
            waits_are_over: false,
            endless_passes: None,
            most_moves: 500_000,
            most_steps: 5_000_000,
            forward: None,
            own_tool: None,
            gcode: GCodeOptions::default(),
        }
    }
}

impl std::fmt::Debug for ReadOptions<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ReadOptions")
            .field("language", &self.language)
            .field("entry", &self.entry)
            .field("start", &self.start)
            .field("given", &self.given)
            .field("companions", &self.companions.iter().map(|(path, _)| path).collect::<Vec<_>>())
            .field("endless_passes", &self.endless_passes)
            .field("forward", &self.forward.is_some())
            .field("gcode", &self.gcode)
            .finish_non_exhaustive()
    }
}

/// How rotary words of G-code are understood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Rotary {
    /// They are refused, unless they are 0.
    #[default]
    Refused,
    /// The tool is turned about the axes of the work frame: `R_BT = Rz(C) Ry(B) Rx(A) R`, with `R`
    /// the orientation at A = B = C = 0.
    Tilt,
}

/// What G-code leaves to the machine.
#[derive(Debug, Clone, PartialEq)]
pub struct GCodeOptions {
    /// Orientation of the tool in the work frame, `R_BT`; by itself its z axis points against the
    /// work frame's z, its x axis along the work frame's x.
    pub R_BT: Rotation3<f64>,
    /// How A, B and C are understood.
    pub rotary: Rotary,
    /// Work frames in the controller's world, by their code: `("G54", X_WB)`; those that are not
    /// told are where the robot stands, which is noted.
    pub offsets: Vec<(String, Pose)>,
    /// Frame of the machine coordinates (G53) in the controller's world.
    pub machine: Pose,
    /// Where the tool is in the work frame at the start, mm; coordinates that are told neither here
    /// nor in the first move are 0, which is noted.
    pub start_mm: Option<[f64; 3]>,
    /// Point to which G28 goes, in machine coordinates, mm; `None`: G28 is refused. G30 likewise.
    pub reference_mm: Option<[f64; 3]>,
    /// Rapids (G0) are straight lines at this speed, m/s; `None`: they are joint moves.
    pub rapid_m_s: Option<f64>,
    /// The tool centre point is the tip of the tool, so that G43 with a tool length changes
    /// nothing. `false`: G43 is refused.
    pub tip_is_known: bool,
    /// `P` of G4 is in milliseconds, not in seconds.
    pub dwell_in_ms: bool,
    /// How far the arcs by which a helix is made may be away from it, m.
    pub helix_error_m: f64,
}

impl Default for GCodeOptions {
    fn default() -> Self {
        Self {
            R_BT: Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
            rotary: Rotary::Refused,
            offsets: Vec::new(),
            machine: Pose::identity(),
            start_mm: None,
            reference_mm: None,
            rapid_m_s: None,
            tip_is_known: false,
            dwell_in_ms: false,
            helix_error_m: 1e-6,
        }
    }
}
