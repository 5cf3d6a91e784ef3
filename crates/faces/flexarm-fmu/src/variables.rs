//! Variables of a plant: names, units, causality, start values.
//!
//! A variable is found by its reference, the position in the list. Names are structured as FMI asks:
//! `joint.joint_1.target_position`, `tcp.position.x`. Start at [`variables`]; a [`Meaning`] ties a
//! variable to the quantity of the arm. Positions, velocities and wrenches are in world axes.
//! Not here: the values (`model.rs`).

use std::fmt::Write as _;

use flexarm::Arm;
use flexarm::live::ElasticCoordinate;
use flexarm::robots::Coordinate;

/// Axes of vectors.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Direction of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Time.
    Independent,
    /// Set before the start.
    Parameter,
    /// Set between steps.
    Input,
    /// Computed.
    Output,
    /// Coordinate of the arm, its velocity or its acceleration.
    Local,
}

/// Type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 64-bit number.
    Real,
    /// True or false.
    Boolean,
}

/// Meaning of a variable; numbers are joints or components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Meaning {
    Time,
    Step,
    StiffnessFactor,
    DampingFactor,
    PayloadMass,
    Payload,
    UseTargetVelocity,
    OpenServos,
    TargetPosition(usize),
    TargetVelocity(usize),
    TargetAcceleration(usize),
    Torque(usize),
    Wrench(usize),
    MotorPosition(usize),
    MotorVelocity(usize),
    MotorAcceleration(usize),
    LinkPosition(usize),
    LinkVelocity(usize),
    Effort(usize),
    TcpPosition(usize),
    TcpQuaternion(usize),
    TcpVelocity(usize),
    TcpAcceleration(usize),
    RigidPosition(usize),
    RigidQuaternion(usize),
    Error(usize),
    ErrorLength,
    RotationError(usize),
    Gauge(usize),
    Deflection(usize),
    DeflectionVelocity(usize),
    DeflectionAcceleration(usize),
}

/// A variable of a plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Structured name.
    pub name: String,
    /// One sentence.
    pub description: String,
    /// Unit of a number, as in [`UNITS`].
    pub unit: &'static str,
    /// Type.
    pub kind: Kind,
    /// Direction.
    pub causality: Causality,
    /// Start value of parameters and inputs; 1 is true.
    pub start: Option<f64>,
    /// Reference of the variable whose derivative it is, in an arm that has equations of motion.
    pub derivative_of: Option<usize>,
    pub(crate) meaning: Meaning,
}

impl Variable {
    /// Returns the nominal value of a continuous state: of a deflection and of its velocity less
    /// than of a joint.
    pub(crate) fn nominal(&self) -> f64 {
        match self.meaning {
            Meaning::Deflection(_) => 1e-3,
            Meaning::DeflectionVelocity(_) => 1e-1,
            _ => 1.0,
        }
    }

    /// Returns the step of differences with respect to a state or an input: small beside play and
    /// the velocities at which friction turns, large beside rounding.
    pub(crate) fn difference_step(&self) -> f64 {
        match self.unit {
            "m" | "rad" | "1" => 1e-5,
            "m/s" | "rad/s" | "1/s" => 1e-4,
            _ => 1.0,
        }
    }
}

/// References of the continuous states and of their derivatives.
#[derive(Clone, Debug, Default)]
pub(crate) struct StateReferences {
    /// Coordinates, then their velocities.
    pub(crate) states: Vec<usize>,
    /// Velocities, then accelerations.
    pub(crate) derivatives: Vec<usize>,
}

impl StateReferences {
    pub(crate) fn of(variables: &[Variable]) -> Self {
        let state_of = |reference: usize| variables[reference].derivative_of;
        let all = |is_acceleration: bool| {
            let derivatives = (0..variables.len()).filter_map(move |own| Some((own, state_of(own)?)));
            derivatives.filter(move |(_, state)| state_of(*state).is_some() == is_acceleration)
        };
        let (derivatives, states) = all(false).chain(all(true)).unzip();
        Self { states, derivatives }
    }
}

/// Units with their exponents of kg, m, s and rad.
pub const UNITS: [(&str, [i32; 4]); 14] = [
    ("1", [0, 0, 0, 0]),
    ("1/s", [0, 0, -1, 0]),
    ("1/s2", [0, 0, -2, 0]),
    ("s", [0, 0, 1, 0]),
    ("kg", [1, 0, 0, 0]),
    ("m", [0, 1, 0, 0]),
    ("m/s", [0, 1, -1, 0]),
    ("m/s2", [0, 1, -2, 0]),
    ("rad", [0, 0, 0, 1]),
    ("rad/s", [0, 0, -1, 1]),
    ("rad/s2", [0, 0, -2, 1]),
    ("N", [1, 1, -2, 0]),
    ("N.m", [1, 2, -2, 0]),
    ("Pa", [1, -1, -2, 0]),
];

/// Returns a name of a joint as a part of a structured name: quoted unless it is an identifier.
pub fn part(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && name.chars().all(plain) {
        return name.to_owned();
    }
    let mut quoted = String::from("'");
    for c in name.chars() {
        match c {
            '\'' | '\\' => {
                quoted.push('\\');
                quoted.push(c);
            }
            c if c.is_ascii_graphic() || c == ' ' => quoted.push(c),
            // Only ASCII is allowed between quotes.
            c => {
                let _ = write!(quoted, "u{:x}", u32::from(c));
            }
        }
    }
    quoted + "'"
}

/// Start values that differ from arm to arm.
pub(crate) struct Starts<'a> {
    /// Joint positions (rad or m).
    pub(crate) pose: &'a [f64],
    /// Step size (s).
    pub(crate) step_s: f64,
    /// Mass of the payload (kg), if the robot file has one that can be changed.
    pub(crate) payload: Option<f64>,
    /// Whether the payload can be put down.
    pub(crate) releases: bool,
    /// Torques that hold the pose (N m or N).
    pub(crate) holding: &'a [f64],
    /// Whether the stepper gives accelerations.
    pub(crate) has_acceleration: bool,
    /// Channels of gauges.
    pub(crate) gauges: &'a [String],
    /// Elastic coordinates of the equations of motion; `None` if the arm has none.
    pub(crate) elastic: Option<&'a [ElasticCoordinate]>,
}

/// Returns the variables of an arm.
pub(crate) fn variables(arm: &Arm, starts: &Starts<'_>) -> Vec<Variable> {
    let mut list = List(Vec::new());
    list.parameters(starts);
    if arm.has_servo() {
        list.add(
            Causality::Parameter,
            "open_servos",
            "Motors get the inputs torque alone, without the servos of the arm",
            "",
            Some(0.0),
            Meaning::OpenServos,
        );
    }
    let model = &arm.model;
    let driven: Vec<usize> = arm.servo_limits().map(|(coordinate, _)| coordinate).collect();
    for (k, coordinate) in model.coordinates()[..model.n_actuated()].iter().enumerate() {
        list.joint(k, coordinate, driven.contains(&k), starts);
    }
    list.deflections(starts.elastic.unwrap_or_default());
    list.tcp(starts.has_acceleration);
    // Stress needs accelerations.
    for (k, name) in starts.gauges.iter().enumerate().filter(|_| starts.has_acceleration) {
        let (text, unit) = match name.ends_with("_pa") {
            true => ("Stress below a stress point of the robot file", "Pa"),
            false => ("Strain of a gauge of the robot file, in its direction", "1"),
        };
        list.add(Causality::Output, format!("gauge.{}", part(name)), text, unit, None, Meaning::Gauge(k));
    }
    list.0
}

/// Returns the units of a position, a velocity and an acceleration.
fn motion_units(slides: bool) -> [&'static str; 3] {
    if slides { ["m", "m/s", "m/s2"] } else { ["rad", "rad/s", "rad/s2"] }
}

struct List(Vec<Variable>);

impl List {
    fn add(
        &mut self,
        causality: Causality,
        name: impl Into<String>,
        description: impl Into<String>,
        unit: &'static str,
        start: Option<f64>,
        meaning: Meaning,
    ) {
        let kind = match meaning {
            Meaning::UseTargetVelocity | Meaning::OpenServos | Meaning::Payload => Kind::Boolean,
            _ => Kind::Real,
        };
        let (name, description) = (name.into(), description.into());
        self.0.push(Variable { name, description, unit, kind, causality, start, derivative_of: None, meaning });
    }

    /// Adds joint number k; `is_driven`: whether it is driven by torque.
    fn joint(&mut self, k: usize, coordinate: &Coordinate, is_driven: bool, starts: &Starts<'_>) {
        let slides = coordinate.slides();
        let [position, velocity, acceleration] = motion_units(slides);
        let effort = if slides { "N" } else { "N.m" };
        let of_joint = |what: &str| format!("joint.{}.{what}", part(&coordinate.joint));
        let (input, output) = (Causality::Input, Causality::Output);
        let start = starts.pose.get(k).copied().unwrap_or(0.0);
        let holding = starts.holding.get(k).copied().unwrap_or(0.0);
        // Commands.
        let text = "Target at the end of the communication step; the arm starts at rest there";
        self.add(input, of_joint("target_position"), text, position, Some(start), Meaning::TargetPosition(k));
        let text = "Target velocity at the end of the communication step, used with use_target_velocity";
        self.add(input, of_joint("target_velocity"), text, velocity, Some(0.0), Meaning::TargetVelocity(k));
        if starts.elastic.is_some() {
            let (name, text) =
                (of_joint("target_acceleration"), "Target acceleration, of a prescribed joint in model exchange");
            self.add(input, name, text, acceleration, Some(0.0), Meaning::TargetAcceleration(k));
        }
        if is_driven {
            let text = format!(
                "Torque or force at the joint, added to that of the servo; {holding:.6} {effort} hold the first pose"
            );
            self.add(input, of_joint("torque"), text, effort, Some(0.0), Meaning::Torque(k));
        }
        // Motions and effort.
        let outputs = [
            ("motor_position", "Position of the motor, at the joint", position, Meaning::MotorPosition(k)),
            ("motor_velocity", "Velocity of the motor, at the joint", velocity, Meaning::MotorVelocity(k)),
            ("link_position", "Position of the link behind the gearbox", position, Meaning::LinkPosition(k)),
            ("link_velocity", "Velocity of the link behind the gearbox", velocity, Meaning::LinkVelocity(k)),
            ("effort", "Torque or force of the drive, at the joint", effort, Meaning::Effort(k)),
        ];
        let first = self.0.len();
        for (what, text, unit, meaning) in outputs {
            self.add(output, of_joint(what), text, unit, None, meaning);
        }
        // The motor of a driven joint is a state: position, velocity, acceleration.
        if is_driven && starts.elastic.is_some() {
            let (name, text) = (of_joint("motor_acceleration"), "Acceleration of the motor, at the joint");
            self.0[first + 1].derivative_of = Some(first);
            self.add(Causality::Local, name, text, acceleration, None, Meaning::MotorAcceleration(k));
            self.differentiates(first + 1);
        }
    }

    /// Makes the last variable the derivative of another one.
    fn differentiates(&mut self, of: usize) {
        if let Some(last) = self.0.last_mut() {
            last.derivative_of = Some(of);
        }
    }

    /// Adds the elastic coordinates with velocities and accelerations.
    fn deflections(&mut self, elastic: &[ElasticCoordinate]) {
        for (k, ElasticCoordinate { element, number, unit }) in elastic.iter().enumerate() {
            let units = match *unit {
                "m" => motion_units(true),
                "rad" => motion_units(false),
                _ => ["1", "1/s", "1/s2"],
            };
            let name = format!("elastic.{}[{number}]", part(element));
            let text = format!("Elastic coordinate {number} of {element}");
            let own = [
                (name.clone(), text.clone(), Meaning::Deflection(k)),
                (format!("der({name})"), format!("{text}, velocity"), Meaning::DeflectionVelocity(k)),
                (format!("der({name},2)"), format!("{text}, acceleration"), Meaning::DeflectionAcceleration(k)),
            ];
            for (order, ((name, text, meaning), unit)) in own.into_iter().zip(units).enumerate() {
                self.add(Causality::Local, name, text, unit, None, meaning);
                if order > 0 {
                    self.differentiates(self.0.len() - 2);
                }
            }
        }
    }

    /// Adds time, parameters and the inputs of the whole arm.
    fn parameters(&mut self, starts: &Starts<'_>) {
        self.add(Causality::Independent, "time", "Time", "s", None, Meaning::Time);
        let parameter = Causality::Parameter;
        let text = "Step size of the solver; shorter where communication steps are no multiples of it";
        self.add(parameter, "step", text, "s", Some(starts.step_s), Meaning::Step);
        let text = "Factor on the stiffness of all links and gearboxes";
        self.add(parameter, "stiffness_factor", text, "1", Some(1.0), Meaning::StiffnessFactor);
        let text = "Factor on the damping of all links and gearboxes";
        self.add(parameter, "damping_factor", text, "1", Some(1.0), Meaning::DampingFactor);
        if let Some(mass) = starts.payload {
            self.add(parameter, "payload.mass", "Mass of the payload", "kg", Some(mass), Meaning::PayloadMass);
        }
        if starts.releases {
            let text = "Whether the arm carries its payload";
            self.add(Causality::Input, "payload.attached", text, "", Some(1.0), Meaning::Payload);
        }
        let text = "Whether the inputs target_velocity are used; without them joints follow the parabola through \
                    the last three targets";
        self.add(parameter, "use_target_velocity", text, "", Some(0.0), Meaning::UseTargetVelocity);
    }

    /// Adds wrench, motion and error of the TCP.
    fn tcp(&mut self, has_acceleration: bool) {
        // Input: the wrench on the TCP.
        for (i, (part, unit)) in [("force", "N"), ("torque", "N.m")].into_iter().enumerate() {
            for (k, axis) in AXES.iter().enumerate() {
                let (name, text) = (format!("tcp.{part}.{axis}"), format!("External {part} on the TCP, world axes"));
                self.add(Causality::Input, name, text, unit, Some(0.0), Meaning::Wrench(3 * i + k));
            }
        }
        let output = Causality::Output;
        let vector = |list: &mut Self, name: &str, text: &str, unit, meaning: &dyn Fn(usize) -> Meaning| {
            for (k, axis) in AXES.iter().enumerate() {
                list.add(output, format!("{name}.{axis}"), text, unit, None, meaning(k));
            }
        };
        let quaternion = |list: &mut Self, name: &str, text: &str, meaning: &dyn Fn(usize) -> Meaning| {
            for (k, part) in ["w", "x", "y", "z"].into_iter().enumerate() {
                list.add(output, format!("{name}.{part}"), text, "1", None, meaning(k));
            }
        };
        // Outputs: the flexible TCP, the rigid one, and their difference.
        vector(self, "tcp.position", "Position of the TCP, world", "m", &Meaning::TcpPosition);
        let text = "Orientation of the TCP, unit quaternion with w >= 0";
        quaternion(self, "tcp.orientation", text, &Meaning::TcpQuaternion);
        vector(self, "tcp.velocity", "Velocity of the TCP, world axes", "m/s", &Meaning::TcpVelocity);
        let text = "Angular velocity of the TCP, world axes";
        vector(self, "tcp.angular_velocity", text, "rad/s", &|k| Meaning::TcpVelocity(3 + k));
        if has_acceleration {
            let text = "Acceleration of the TCP, world axes";
            vector(self, "tcp.acceleration", text, "m/s2", &Meaning::TcpAcceleration);
        }
        let text = "Position of the TCP of the rigid arm with its joints at the targets";
        vector(self, "rigid_tcp.position", text, "m", &Meaning::RigidPosition);
        let text = "Orientation of the TCP of the rigid arm, unit quaternion with w >= 0";
        quaternion(self, "rigid_tcp.orientation", text, &Meaning::RigidQuaternion);
        let text = "TCP error: position less that of the rigid arm, world axes";
        vector(self, "tcp_error.position", text, "m", &Meaning::Error);
        let text = "Length of the TCP error";
        self.add(output, "tcp_error.length", text, "m", None, Meaning::ErrorLength);
        let text = "Rotation vector from the rigid to the flexible TCP, world axes";
        vector(self, "tcp_error.rotation", text, "rad", &Meaning::RotationError);
    }
}
