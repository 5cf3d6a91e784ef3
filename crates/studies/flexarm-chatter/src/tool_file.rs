//! File of a cutting tool (`docs/lobes.md`): cutter, engagement, spindle speeds, position of the
//! tip, flexibility. Units are converted here.
//!
//! Start at [`CuttingTool::load`]. Directions stay in the axes in which the file gives them
//! ([`Direction`]). Not here: plausible ranges, which are caveats ([`super::caveats`]).

use std::ops::Range;
use std::path::Path;

use crate::milling::{Coefficients, Cutter, Engagement};
use flexarm_files::read_text;
use flexarm_settings::{OutOfRange, Quantity};
use nalgebra::{Rotation3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use flexarm_run::Error;
use flexarm_run::robot_file::Source;
use flexarm_run::toml_file::{parsed, word};

/// Contents of the file as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolFile {
    format: Spanned<i64>,
    lengths: Option<Spanned<String>>,
    angles: Option<Spanned<String>>,
    pressures: Option<Spanned<String>>,
    cutter: Spanned<CutterEntry>,
    engagement: Spanned<EngagementEntry>,
    spindle: Spanned<SpindleEntry>,
    #[serde(default)]
    tool: ToolEntry,
    deepest: Option<Spanned<f64>>,
    #[serde(default)]
    mode: Vec<Spanned<ModeEntry>>,
    /// Not supported.
    measured: Option<Spanned<toml::Value>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CutterEntry {
    teeth: Spanned<i64>,
    diameter: Spanned<f64>,
    helix: Option<Spanned<f64>>,
    lead: Option<Spanned<f64>>,
    coefficients: Spanned<CoefficientEntry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CoefficientEntry {
    tangential: f64,
    radial: f64,
    #[serde(default)]
    axial: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EngagementEntry {
    /// `up`, `down`, `slot`, `full` or `angles`.
    kind: Spanned<String>,
    /// Radial depth of cut.
    ae: Option<Spanned<f64>>,
    /// Radial depth of cut over diameter.
    immersion: Option<Spanned<f64>>,
    entry: Option<Spanned<f64>>,
    exit: Option<Spanned<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SpindleEntry {
    /// Spindle speeds (1/min).
    rpm: Option<Spanned<Vec<f64>>>,
    from: Option<Spanned<f64>>,
    to: Option<Spanned<f64>>,
    points: Option<Spanned<usize>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolEntry {
    axis: Option<Spanned<[f64; 3]>>,
    axis_axes: Option<Spanned<String>>,
    feed: Option<Spanned<[f64; 3]>>,
    feed_axes: Option<Spanned<String>>,
    tip: Option<Spanned<[f64; 3]>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModeEntry {
    /// `radial`, `axial`, or a direction.
    direction: Spanned<DirectionEntry>,
    /// Natural frequency (Hz).
    frequency: Spanned<f64>,
    damping: Spanned<f64>,
    /// Modal mass (kg).
    mass: Option<Spanned<f64>>,
    /// Modal stiffness (N/m).
    stiffness: Option<Spanned<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "expected \"radial\", \"axial\", or a direction [x, y, z] in the axes of the TCP")]
enum DirectionEntry {
    Word(String),
    Vector([f64; 3]),
}

/// Cutting tool from its file, in SI units.
#[derive(Clone, Debug)]
pub struct CuttingTool {
    /// Name of the tool, the stem of its file name.
    pub name: String,
    pub(crate) cutter: Cutter,
    /// Spindle speeds (1/min), ascending.
    pub rpm: Vec<f64>,
    /// Maximum depth of cut (m).
    pub deepest: f64,
    /// Direction from the spindle to the tip.
    pub(crate) axis: Direction,
    /// Direction of the feed.
    pub(crate) feed: Option<Direction>,
    /// Position of the tip in the axes of the TCP (m).
    pub(crate) tip: Vector3<f64>,
    pub(crate) modes: Vec<ToolMode>,
}

/// Unit vector in the axes of the TCP or of the world.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Direction {
    /// Fixed in the TCP.
    Tcp(Vector3<f64>),
    /// Fixed in the world.
    World(Vector3<f64>),
}

impl Direction {
    /// Returns the direction in world axes. `R_WT`: rotation from TCP to world axes.
    pub(crate) fn in_world(self, R_WT: &Rotation3<f64>) -> Vector3<f64> {
        match self {
            Self::Tcp(direction) => R_WT * direction,
            Self::World(direction) => direction,
        }
    }
}

/// Mode of the tool itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolMode {
    pub(crate) direction: ToolDirection,
    /// Natural frequency (rad/s).
    pub(crate) omega: f64,
    pub(crate) damping_ratio: f64,
    /// Modal mass (kg).
    pub(crate) mass: f64,
}

/// Direction of a mode of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ToolDirection {
    /// Both radial directions, with equal modes.
    Radial,
    /// Along the tool's axis.
    Axial,
    /// Unit vector in the axes of the TCP.
    Along(Vector3<f64>),
}

/// Default maximum depth of cut over the diameter.
const DEEPEST: f64 = 1.0;
/// Default number of spindle speeds in a range.
const POINTS: usize = 101;
/// Valid range of cutter diameters.
const DIAMETER: Quantity = Quantity { unit: "m", least: 1e-6, most: 2.0 };
/// Maximum number of spindle speeds.
const MAX_POINTS: usize = 10_000;

const LENGTHS: [(&str, f64); 2] = [("m", 1.0), ("mm", 1e-3)];
const ANGLES: [(&str, f64); 2] = [("rad", 1.0), ("deg", std::f64::consts::PI / 180.0)];
const PRESSURES: [(&str, f64); 4] = [("N/m2", 1.0), ("Pa", 1.0), ("N/mm2", 1e6), ("MPa", 1e6)];

impl CuttingTool {
    /// Reads the file of a tool.
    ///
    /// # Errors
    /// [`Error::RobotFile`] with the file and place, the value found and the values expected;
    /// [`Error::File`] for a table.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let text = read_text(path)?;
        let source = Source::new(path, &text, "tool");
        let file: ToolFile = parsed(&text, &source, &[], |file: &ToolFile| &file.format)?;
        let reader = Reader {
            source: &source,
            length: word(&source, "lengths", &file.lengths, &LENGTHS)?.1,
            angle: word(&source, "angles", &file.angles, &ANGLES)?.1,
            pressure: word(&source, "pressures", &file.pressures, &PRESSURES)?.1,
        };
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        reader.tool(&file, name)
    }

    /// Returns the spindle speeds of the file (1/min).
    pub fn spindle_rpm(&self) -> &[f64] {
        &self.rpm
    }

    /// Returns the tool with other spindle speeds (1/min, positive), given in any order.
    #[must_use]
    pub fn at_speeds(mut self, mut rpm: Vec<f64>) -> Self {
        rpm.sort_by(f64::total_cmp);
        rpm.dedup();
        self.rpm = rpm;
        self
    }
}

/// Data for reading entries.
struct Reader<'a> {
    source: &'a Source,
    length: f64,
    angle: f64,
    pressure: f64,
}

impl Reader<'_> {
    /// Returns the tool.
    fn tool(&self, file: &ToolFile, name: String) -> Result<CuttingTool, Error> {
        let cutter = self.cutter(&file.cutter, &file.engagement)?;
        let deepest = match &file.deepest {
            Some(depth) => self.positive("deepest", depth, self.length, Quantity::LENGTH)?,
            None => DEEPEST * cutter.diameter,
        };
        let axis = self.direction(["axis", "axis_axes"], &file.tool.axis, &file.tool.axis_axes)?;
        let feed = self.direction(["feed", "feed_axes"], &file.tool.feed, &file.tool.feed_axes)?;
        let tip = file.tool.tip.as_ref().map_or(Ok(Vector3::zeros()), |tip| self.point("tip", tip))?;
        if let Some(entry) = &file.measured {
            let message = "[measured]: tables of measured frequency responses are not read; fit modes to the response \
                           and give each as [[mode]] with direction, frequency, damping and stiffness";
            return Err(self.error(entry.span(), message));
        }
        Ok(CuttingTool {
            name,
            cutter,
            rpm: self.speeds(&file.spindle)?,
            deepest,
            axis: axis.unwrap_or(Direction::Tcp(Vector3::z())),
            feed,
            tip,
            modes: file.mode.iter().map(|mode| self.mode(mode)).collect::<Result<_, Error>>()?,
        })
    }

    /// Reads teeth, angles and coefficients; a mistaken unit of the coefficients is refused.
    fn cutter(&self, entry: &Spanned<CutterEntry>, engagement: &Spanned<EngagementEntry>) -> Result<Cutter, Error> {
        let e = entry.get_ref();
        let teeth = match *e.teeth.get_ref() {
            n @ 1..=1000 => n as usize,
            n => return Err(self.error(e.teeth.span(), format!("teeth = {n}: expected 1 to 1000"))),
        };
        let angle = |what: &str, value: &Option<Spanned<f64>>, default: f64, high: f64, low_too: bool| {
            let Some(value) = value else { return Ok(default) };
            let found = self.angle * *value.get_ref();
            if found.is_finite() && (found > 0.0 || low_too && found == 0.0) && found <= high {
                return Ok(found);
            }
            let low = if low_too { "0" } else { "above 0" };
            let message =
                format!("{what} is {:.2} degrees, expected {low} to {:.0}", found.to_degrees(), high.to_degrees());
            Err(self.error(value.span(), message))
        };
        // Coefficients in N/m², then the cutter as a whole.
        let k = e.coefficients.get_ref();
        let coefficients = Coefficients {
            tangential: k.tangential * self.pressure,
            radial: k.radial * self.pressure,
            axial: k.axial * self.pressure,
        };
        let diameter = self.positive("diameter", &e.diameter, self.length, DIAMETER)?;
        let cutter = Cutter {
            teeth,
            diameter,
            helix: angle("helix", &e.helix, 0.0, 80f64.to_radians(), true)?,
            lead: angle("lead", &e.lead, 90f64.to_radians(), 90f64.to_radians(), false)?,
            coefficients,
            engagement: self.engagement(engagement, diameter)?,
        };
        cutter.check().map_err(|error| self.error(e.coefficients.span(), error.to_string()))?;
        // Confused units are off by a million: coefficients are 1e7 N/m² for the softest plastics
        // and below 1e10 N/m² for hard alloys.
        if !(1e6..1e11).contains(&coefficients.tangential) {
            let message = format!(
                "the tangential coefficient is {:.3e} N/m2; usual values are 1e7 to 1e10: is the unit right \
                 (pressures = \"N/mm2\")?",
                coefficients.tangential
            );
            return Err(self.error(e.coefficients.span(), message));
        }
        Ok(cutter)
    }

    /// Reads the range of angles in which a tooth cuts; each kind has its own keys.
    fn engagement(&self, entry: &Spanned<EngagementEntry>, diameter: f64) -> Result<Engagement, Error> {
        let e = entry.get_ref();
        let kind = e.kind.get_ref().as_str();
        let stray =
            |names: &[(&str, Option<Range<usize>>)]| match names.iter().find_map(|(n, s)| Some((*n, s.clone()?))) {
                Some((name, span)) => Err(self.error(span, format!("kind = {kind:?} does not allow {name}"))),
                None => Ok(()),
            };
        let (ae, immersion) = (e.ae.as_ref().map(Spanned::span), e.immersion.as_ref().map(Spanned::span));
        let (entry_at, exit_at) = (e.entry.as_ref().map(Spanned::span), e.exit.as_ref().map(Spanned::span));
        // Read the keys of the kind, and refuse those of the others.
        match kind {
            "up" | "down" => {
                stray(&[("entry", entry_at), ("exit", exit_at)])?;
                let part = self.immersion(e, entry.span(), diameter)?;
                Ok(if kind == "up" { Engagement::up(part) } else { Engagement::down(part) })
            }
            "slot" | "full" => {
                stray(&[("ae", ae), ("immersion", immersion), ("entry", entry_at), ("exit", exit_at)])?;
                Ok(if kind == "slot" { Engagement::slot() } else { Engagement::full() })
            }
            "angles" => {
                stray(&[("ae", ae), ("immersion", immersion)])?;
                self.angles(e, entry.span())
            }
            other => {
                let message =
                    format!("kind = {other:?} is not known; use \"up\", \"down\", \"slot\", \"full\" or \"angles\"");
                Err(self.error(e.kind.span(), message))
            }
        }
    }

    /// Returns the radial depth of cut over the diameter.
    fn immersion(&self, e: &EngagementEntry, place: Range<usize>, diameter: f64) -> Result<f64, Error> {
        let (part, span) = match (&e.ae, &e.immersion) {
            (Some(ae), None) => (self.length * *ae.get_ref() / diameter, ae.span()),
            (None, Some(part)) => (*part.get_ref(), part.span()),
            (Some(_), Some(both)) => return Err(self.error(both.span(), "give ae or immersion, not both")),
            (None, None) => {
                return Err(self.error(place, "up and down need ae = ... (radial depth) or immersion = ..."));
            }
        };
        if part.is_finite() && part > 0.0 && part <= 1.0 {
            return Ok(part);
        }
        Err(self.error(span, format!("the radial depth is {part:.4} diameters, expected above 0, at most 1")))
    }

    /// Reads entry and exit angle.
    fn angles(&self, e: &EngagementEntry, place: Range<usize>) -> Result<Engagement, Error> {
        let (Some(from), Some(to)) = (&e.entry, &e.exit) else {
            return Err(self.error(place, "kind = \"angles\" needs entry = ... and exit = ..."));
        };
        let (entry, exit) = (self.angle * *from.get_ref(), self.angle * *to.get_ref());
        let turn = std::f64::consts::TAU;
        let sound = (0.0..turn).contains(&entry) && exit > entry && exit <= entry + turn * (1.0 + 1e-9);
        if !sound {
            let message = format!(
                "the teeth cut from {:.2} to {:.2} degrees: expected an entry from 0 to below 360, and an exit above \
                 the entry by at most 360",
                entry.to_degrees(),
                exit.to_degrees()
            );
            return Err(self.error(from.span(), message));
        }
        Ok(Engagement { entry, exit: exit.min(entry + turn) })
    }

    /// Reads the spindle speeds (1/min): a list, or a range.
    fn speeds(&self, entry: &Spanned<SpindleEntry>) -> Result<Vec<f64>, Error> {
        let e = entry.get_ref();
        // Either the speeds themselves, or a range with a number of equal steps.
        match (&e.rpm, &e.from, &e.to) {
            (Some(list), None, None) if e.points.is_none() => {
                let rpm = list.get_ref();
                let ascending = rpm.windows(2).all(|pair| pair[0] < pair[1]);
                if rpm.is_empty() || !ascending || rpm.len() > MAX_POINTS || rpm[0] <= 0.0 {
                    return Err(self.error(list.span(), "rpm must be positive, ascending speeds (1/min)"));
                }
                self.located(list.span(), Quantity::SPEED.check_all("rpm", rpm))?;
                Ok(rpm.clone())
            }
            (None, Some(from), Some(to)) => {
                let speed = |what, value| self.positive(what, value, 1.0, Quantity::SPEED);
                let (low, high) = (speed("from", from)?, speed("to", to)?);
                let points = e.points.as_ref().map_or(POINTS, |points| *points.get_ref());
                if high <= low {
                    return Err(self
                        .error(to.span(), format!("speeds from {low} to {high} 1/min: to must be greater than from")));
                }
                if !(2..=MAX_POINTS).contains(&points) {
                    let span = e.points.as_ref().map_or(entry.span(), Spanned::span);
                    return Err(self.error(span, format!("points = {points}: expected 2 to {MAX_POINTS}")));
                }
                Ok((0..points).map(|k| low + (high - low) * k as f64 / (points - 1) as f64).collect())
            }
            _ => Err(self.error(
                entry.span(),
                "give the speeds as a list rpm = [...], or as from = ..., to = ..., points = ...",
            )),
        }
    }

    /// Reads a direction and the axes in which it is given.
    fn direction(
        &self,
        [what, its_axes]: [&str; 2],
        value: &Option<Spanned<[f64; 3]>>,
        axes: &Option<Spanned<String>>,
    ) -> Result<Option<Direction>, Error> {
        let world = word(self.source, its_axes, axes, &[("tcp", false), ("world", true)])?.1;
        match (value, axes) {
            (Some(value), _) => {
                let direction = self.unit_vector(what, *value.get_ref(), value.span())?;
                Ok(Some(if world { Direction::World(direction) } else { Direction::Tcp(direction) }))
            }
            (None, Some(axes)) => {
                Err(self.error(axes.span(), format!("{its_axes} has no effect without {what} = [...]")))
            }
            (None, None) => Ok(None),
        }
    }

    /// Reads a mode of the tool; modal mass or stiffness follows from the other and the frequency.
    fn mode(&self, entry: &Spanned<ModeEntry>) -> Result<ToolMode, Error> {
        let e = entry.get_ref();
        let direction = match e.direction.get_ref() {
            DirectionEntry::Word(word) if word == "radial" => ToolDirection::Radial,
            DirectionEntry::Word(word) if word == "axial" => ToolDirection::Axial,
            DirectionEntry::Word(word) => {
                let message = format!(
                    "direction = {word:?} is not known; use \"radial\", \"axial\" or a vector in the axes of the TCP"
                );
                return Err(self.error(e.direction.span(), message));
            }
            DirectionEntry::Vector(vector) => {
                ToolDirection::Along(self.unit_vector("direction", *vector, e.direction.span())?)
            }
        };
        // m = k / ω²; both must be those of a tool or a spindle.
        let omega = std::f64::consts::TAU * self.positive("frequency", &e.frequency, 1.0, Quantity::FREQUENCY)?;
        let mass = match (&e.mass, &e.stiffness) {
            (Some(mass), None) => {
                let mass = self.positive("mass", mass, 1.0, Quantity::MASS)?;
                let stiffness = Quantity::TOOL_STIFFNESS.check("the stiffness of the mode", mass * omega * omega);
                self.located(entry.span(), stiffness)?;
                mass
            }
            (None, Some(stiffness)) => {
                let stiffness = self.positive("stiffness", stiffness, 1.0, Quantity::TOOL_STIFFNESS)?;
                self.located(entry.span(), Quantity::MASS.check("the mass of the mode", stiffness / (omega * omega)))?
            }
            (Some(_), Some(both)) => {
                return Err(
                    self.error(both.span(), "give mass or stiffness, not both: the other follows from the frequency")
                );
            }
            (None, None) => {
                return Err(self.error(entry.span(), "a mode needs mass = ... (kg) or stiffness = ... (N/m)"));
            }
        };
        let damping_ratio = self.positive("damping", &e.damping, 1.0, Quantity::DAMPING_RATIO)?;
        Ok(ToolMode { direction, omega, damping_ratio, mass })
    }

    /// Returns a positive number in SI units.
    fn positive(&self, what: &str, value: &Spanned<f64>, unit: f64, quantity: Quantity) -> Result<f64, Error> {
        match unit * *value.get_ref() {
            x if x > 0.0 || x.is_nan() => self.located(value.span(), quantity.check(what, x)),
            _ => Err(self.error(value.span(), format!("{what} = {}: expected a positive number", value.get_ref()))),
        }
    }

    /// Returns a point (m).
    fn point(&self, what: &str, value: &Spanned<[f64; 3]>) -> Result<Vector3<f64>, Error> {
        let point = Vector3::from(*value.get_ref()) * self.length;
        self.located(value.span(), Quantity::LENGTH.check_all(what, &point)).map(|()| point)
    }

    /// Adds the place to a number out of range.
    fn located<T>(&self, span: Range<usize>, checked: Result<T, OutOfRange>) -> Result<T, Error> {
        checked.map_err(|outside| self.error(span, outside.to_string()))
    }

    /// Returns a direction of length 1.
    fn unit_vector(&self, what: &str, value: [f64; 3], span: Range<usize>) -> Result<Vector3<f64>, Error> {
        let vector = Vector3::from(value);
        let size = vector.norm();
        if size.is_finite() && size > 1e-6 && size < 1e6 {
            return Ok(vector / size);
        }
        Err(self.error(span, format!("{what} = {value:?}: expected a direction, three numbers that are not all zero")))
    }

    fn error(&self, span: Range<usize>, message: impl Into<String>) -> Error {
        self.source.error(span, message).into()
    }
}
