//! Admissible ranges for the numbers of robots, tools and loads.
//!
//! The ranges are wide: a number outside cannot belong to a robot, whatever its unit. They bound
//! the ratios of masses, lengths and stiffnesses so that matrices made of them can be factorised.
//! Possible but unlikely values are reported as a [`crate::Finding`].

use std::fmt;

/// Physical quantity: unit, and range of the magnitude of nonzero values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// SI unit.
    pub unit: &'static str,
    /// Minimum magnitude of a nonzero value.
    pub least: f64,
    /// Maximum magnitude.
    pub most: f64,
}

impl Quantity {
    /// Mass.
    pub const MASS: Self = Self::up_to("kg", 1e7);
    /// Moment of inertia.
    pub const INERTIA: Self = Self::up_to("kg m2", 1e9);
    /// Density.
    pub const DENSITY: Self = Self::up_to("kg/m3", 1e6);
    /// Length or position.
    pub const LENGTH: Self = Self::up_to("m", 1e4);
    /// Time.
    pub const TIME: Self = Self::up_to("s", 1e7);
    /// Value of a joint.
    pub const JOINT: Self = Self::up_to("rad or m", 1e5);
    /// Acceleration.
    pub const ACCELERATION: Self = Self::up_to("m/s2", 1e5);
    /// Force.
    pub const FORCE: Self = Self::up_to("N", 1e9);
    /// Torque.
    pub const TORQUE: Self = Self::up_to("N m", 1e9);
    /// Spring of a joint, a link or a base.
    pub const STIFFNESS: Self = Self::between("N/m or N m/rad", 1e-9, 1e18);
    /// Damper.
    pub const DAMPING: Self = Self::up_to("N s/m or N m s/rad", 1e15);
    /// Frequency.
    pub const FREQUENCY: Self = Self::between("Hz", 1e-6, 1e7);
    /// Spindle speed.
    pub const SPEED: Self = Self::between("1/min", 1e-3, 1e7);
    /// Gear ratio or stiffness factor.
    pub const RATIO: Self = Self::between("", 1e-9, 1e9);
    /// Pressure, modulus or cutting coefficient.
    pub const PRESSURE: Self = Self::up_to("Pa", 1e14);
    /// Stiffness of a tool's mode.
    pub const TOOL_STIFFNESS: Self = Self::between("N/m", 1e-3, 1e13);
    /// Damping ratio of a tool's mode.
    pub const DAMPING_RATIO: Self = Self::between("of critical", 1e-9, 100.0);
    /// Number of unknown unit.
    pub const NUMBER: Self = Self::up_to("", 1e30);

    const fn up_to(unit: &'static str, most: f64) -> Self {
        Self { unit, least: 0.0, most }
    }

    const fn between(unit: &'static str, least: f64, most: f64) -> Self {
        Self { unit, least, most }
    }

    /// Returns the value if it is zero or its magnitude is in the range.
    ///
    /// # Errors
    /// [`OutOfRange`], also for a non-finite value.
    pub fn check(self, name: &str, value: f64) -> Result<f64, OutOfRange> {
        match value == 0.0 || (self.least..=self.most).contains(&value.abs()) {
            true => Ok(value),
            false => Err(OutOfRange { name: name.to_owned(), value, quantity: self }),
        }
    }

    /// As [`Quantity::check`], for all values.
    ///
    /// # Errors
    /// [`OutOfRange`] for the first value outside.
    pub fn check_all<'v>(self, name: &str, values: impl IntoIterator<Item = &'v f64>) -> Result<(), OutOfRange> {
        values.into_iter().try_for_each(|value| self.check(name, *value).map(|_| ()))
    }
}

/// Number outside the range of its quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct OutOfRange {
    /// Name of the number.
    pub name: String,
    /// The number.
    pub value: f64,
    /// Quantity with its range.
    pub quantity: Quantity,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, quantity: Quantity { unit, least, most } } = self;
        let space = if unit.is_empty() { "" } else { " " };
        let short = |x: f64| if (1e-3..1e5).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") };
        write!(f, "{name} is {}{space}{unit}: ", short(*value))?;
        match (value.is_finite(), *least > 0.0) {
            (false, _) => write!(f, "expected a finite number"),
            (true, false) => write!(f, "expected a size of at most {}{space}{unit}; is its unit right?", short(*most)),
            (true, true) => {
                write!(f, "expected a size of {} to {}{space}{unit}; is its unit right?", short(*least), short(*most))
            }
        }
    }
}

impl std::error::Error for OutOfRange {}
