//! Frequency response at a pose, with the drives locked or a joint excited: TCP motion per newton
//! at the TCP or per radian of a joint.
//!
//! Start at [`Arm::response`]. World axes at the TCP, SI units, rad/s as ω and Hz in names. Not
//! here: the transfer function and its resonances (`flexarm_analysis::LinearSystem`).

use std::path::PathBuf;
use std::sync::Arc;

use flexarm_analysis::{
    LinearSystem, Quantity, Spacing, frequency_grid, resolved_response, response_peaks, with_resonances,
};
use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve, PlotError};
use flexarm_files::{check_free, write_all};
use flexarm_settings::Setting;
use flexarm_settings::written::csv_field;
use flexarm_stepping::Linear;
use nalgebra::{Complex, DMatrix, Vector6};
use serde::Serialize;

use crate::arm::Arm;
use crate::caveat::slip::outside;
use crate::caveat::{self, Finding, UNUSUAL, kinds};
use crate::error::Error;
use crate::poses::modes::{linear_error, modes_of, tool_map};
use crate::poses::posed::Posed;

/// Files of a response in its output folder: table, plot, figures.
const RESPONSE_FILES: [&str; 3] = ["response.csv", "response.svg", "response.json"];
/// Allowed number of points of a response.
const POINTS: std::ops::RangeInclusive<usize> = 2..=100_000;
/// Maximum frequency (Hz).
const HIGHEST_HZ: f64 = 1e6;
/// A curve below this fraction of the largest with the same unit is round-off.
const NOTHING: f64 = 1e-12;
/// Relative accuracy with which the curves are resolved.
const RESOLUTION: f64 = 0.01;
/// Maximum number of natural frequencies listed in a plot.
const LISTED: usize = 8;
/// A resonance with a damping ratio below this counts as undamped.
const UNDAMPED: f64 = 1e-6;
const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];
const WRENCH: [&str; 6] = ["force-x", "force-y", "force-z", "torque-x", "torque-y", "torque-z"];

/// Request for [`Arm::response`].
#[derive(Clone, Debug)]
pub struct ResponseRequest {
    /// Inputs: `force-x` ... `torque-z` (on the TCP, world axes), or names of joints.
    pub inputs: Vec<String>,
    /// Outputs: `x`, `y`, `z`, `rx`, `ry`, `rz` of the TCP, world axes.
    pub outputs: Vec<String>,
    /// Whether the outputs are displacements, velocities or accelerations.
    pub quantity: Quantity,
    /// Lowest frequency (Hz); a tenth of the first natural frequency by default.
    pub from_hz: Option<f64>,
    /// Highest frequency (Hz); twice the sixth natural frequency by default.
    pub to_hz: Option<f64>,
    /// Number of frequencies; more are added around the resonances.
    pub points: usize,
    /// Spacing of the frequencies.
    pub spacing: Spacing,
}

impl Default for ResponseRequest {
    fn default() -> Self {
        let words = |words: &[&str]| words.iter().map(|w| (*w).to_owned()).collect();
        Self {
            inputs: words(&WRENCH[..3]),
            outputs: words(&AXES[..3]),
            quantity: Quantity::Displacement,
            from_hz: None,
            to_hz: None,
            points: 500,
            spacing: Spacing::Logarithmic,
        }
    }
}

/// Result of `flexarm response`. SI units.
#[derive(Clone, Debug, Serialize)]
pub struct Response {
    /// Name of the robot.
    pub robot: String,
    /// Joints, in coordinate order.
    pub joints: Vec<String>,
    /// Positions at which the joints are held, or about which they move (rad or m).
    pub at: Vec<f64>,
    /// Whether each joint is prismatic.
    #[serde(skip)]
    pub slides: Vec<bool>,
    /// Link that carries the TCP.
    pub tcp: String,
    /// `displacement`, `velocity` or `acceleration`.
    pub quantity: &'static str,
    /// Natural frequencies of all modes (Hz).
    pub frequencies_hz: Vec<f64>,
    /// Damping ratios of the modes.
    pub damping_ratio: Vec<f64>,
    /// Frequencies of the curves (Hz).
    pub frequency_hz: Vec<f64>,
    /// Whether the frequencies are logarithmically spaced.
    pub logarithmic: bool,
    /// One curve per pair of input and output.
    pub curves: Vec<ResponseCurve>,
    /// Written files.
    pub files: ResponseFiles,
    /// Warnings among the caveats, as sentences.
    pub warnings: Vec<String>,
    /// Probable errors in the input, and limits of the result's validity.
    pub caveats: Vec<Finding>,
}

/// Response of one output to one input.
#[derive(Clone, Debug, Serialize)]
pub struct ResponseCurve {
    /// Name of the input.
    pub input: String,
    /// Name of the output.
    pub output: String,
    /// Unit of the magnitude.
    pub unit: String,
    /// Static response, signed; null where it is infinite.
    pub at_rest: Option<f64>,
    /// Resonances within the frequency range, the highest first.
    pub peaks: Vec<PeakFigures>,
    /// Amplitude ratio of output to input, one per frequency.
    pub magnitude: Vec<f64>,
    /// Phase lead of the output over the input (rad), one per frequency; unwrapped.
    pub phase_rad: Vec<f64>,
}

/// A resonance.
#[derive(Clone, Debug, Serialize)]
pub struct PeakFigures {
    /// Frequency (Hz).
    pub frequency_hz: f64,
    /// Magnitude.
    pub magnitude: f64,
    /// Phase (rad).
    pub phase_rad: f64,
}

/// Written files; null where none was written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ResponseFiles {
    /// Table.
    pub csv: Option<String>,
    /// Plot of magnitude and phase.
    pub plot: Option<String>,
    /// This result as JSON.
    pub json: Option<String>,
}

/// Output location of a response.
#[derive(Clone, Debug)]
pub struct ResponseOutputs {
    /// Output folder; created if it does not exist.
    pub folder: PathBuf,
    /// Whether existing files are overwritten.
    pub overwrite: bool,
}

/// End of a band over the first and the last natural frequency, beyond which the band shows no
/// mode.
const BAND: [f64; 2] = [0.1, 50.0];

/// Input or output channel: its name, its unit, its index and whether it is a joint.
struct Channel {
    word: String,
    unit: &'static str,
    index: usize,
    joint: bool,
}

impl Arm {
    /// Returns the frequency response at a pose, linearised about the static equilibrium under
    /// gravity, with the other drives locked.
    ///
    /// `at`: values of all actuated joints (rad or m); [`crate::Robot::start_pose`] by default.
    ///
    /// # Errors
    /// [`Error::Value`] for invalid channel names and values, [`Error::Step`]
    /// if there is no equilibrium.
    pub fn response(self: &Arc<Self>, at: Option<&[f64]>, request: &ResponseRequest) -> Result<Response, Error> {
        response_at(self.posed(at)?, request, None)
    }

    /// As [`Arm::response`], and writes the curves and their picture.
    ///
    /// # Errors
    /// As [`Arm::response`]; [`Error::File`] and [`Error::Write`] for files.
    pub fn record_response(
        self: &Arc<Self>,
        at: Option<&[f64]>,
        request: &ResponseRequest,
        outputs: &ResponseOutputs,
    ) -> Result<Response, Error> {
        response_at(self.posed(at)?, request, Some(outputs))
    }
}

fn response_at(posed: Posed, request: &ResponseRequest, outputs: Option<&ResponseOutputs>) -> Result<Response, Error> {
    let robot = posed.arm.robot();
    let inputs = input_channels(&request.inputs, &posed)?;
    let channels = output_channels(&request.outputs)?;
    if !POINTS.contains(&request.points) {
        let (least, most) = (*POINTS.start(), *POINTS.end());
        let message =
            format!("{} must lie between {least} and {most}, found {found}", Setting::Points, found = request.points);
        return Err(Error::Value(message));
    }
    let paths: Vec<PathBuf> = outputs.iter().flat_map(|o| RESPONSE_FILES.map(|name| o.folder.join(name))).collect();
    check_free(&paths, outputs.is_some_and(|o| o.overwrite))?;

    // The linear system, and the frequencies that resolve its response.
    let linear = posed.linear(&Vector6::zeros())?;
    let modes = modes_of(&linear)?;
    let frequencies_hz: Vec<f64> = modes.iter().map(flexarm_analysis::DampedMode::frequency_hz).collect();
    let damping_ratio: Vec<f64> = modes.iter().map(flexarm_analysis::DampedMode::damping_ratio).collect();
    let (from, to) = range(request, &frequencies_hz)?;
    let system = system(&linear, &inputs, &channels);

    let resonances: Vec<(f64, f64)> = frequencies_hz.iter().copied().zip(damping_ratio.iter().copied()).collect();
    let grid = with_resonances(&frequency_grid(from, to, request.points, request.spacing), &resonances);
    let transfer = Transfer::resolved(&system, request.quantity, &grid);
    system.check().map_err(linear_error)?;
    let curves = transfer.curves(&inputs, &channels);

    // A band far from all modes, and an undamped mode in it, are likely mistakes.
    let mut caveats = posed.caveats_of(&linear, &[0.0; 6]);
    if let (Some(first), Some(last)) = (frequencies_hz.first(), frequencies_hz.last()) {
        let (kind, usual) = (UNUSUAL.with_unit("Hz"), BAND[0] * first..=BAND[1] * last);
        let factors = &[(1e-3, "kHz"), (std::f64::consts::TAU, "rad/s")];
        caveats.extend(outside(&kind, "the end of the band of frequencies", to, &usual, factors, 1.0));
    }
    let within = |k: &usize| damping_ratio[*k] < UNDAMPED && (from..=to).contains(&frequencies_hz[*k]);
    if let Some(k) = (0..modes.len()).find(within) {
        let hz = frequencies_hz[k];
        caveats.push(kinds::UNDAMPED.found(format!("the mode at {hz:.3} Hz"), damping_ratio[k], UNDAMPED));
    }
    let mut response = Response {
        robot: robot.name.clone(),
        tcp: robot.tcp.0.clone(),
        quantity: quantity_name(request.quantity),
        frequencies_hz,
        damping_ratio,
        frequency_hz: transfer.frequency_hz,
        logarithmic: request.spacing == Spacing::Logarithmic,
        curves,
        files: ResponseFiles::default(),
        warnings: caveat::warnings(&caveats),
        caveats,
        slides: posed.prismatic,
        joints: posed.joints,
        at: posed.at,
    };
    if outputs.is_some() {
        save(&mut response, paths)?;
    }
    Ok(response)
}

/// Response matrices of a linear system, outputs by inputs. One solution per frequency serves all
/// curves.
struct Transfer<'a> {
    system: &'a LinearSystem,
    quantity: Quantity,
    /// Frequencies that resolve the displacements (Hz); all quantities use the same.
    frequency_hz: Vec<f64>,
    matrices: Vec<DMatrix<Complex<f64>>>,
}

impl<'a> Transfer<'a> {
    fn resolved(system: &'a LinearSystem, quantity: Quantity, grid: &[f64]) -> Self {
        let displacement = |hz: f64| system.response(std::f64::consts::TAU * hz).ok();
        let (frequency_hz, displacements) = resolved_response(grid, displacement, RESOLUTION);
        let factor = |hz: &f64| quantity.factor(std::f64::consts::TAU * hz);
        let matrices = frequency_hz.iter().zip(displacements).map(|(hz, H)| H * factor(hz)).collect();
        Self { system, quantity, frequency_hz, matrices }
    }

    /// Returns the matrix at a frequency; there is none at an undamped resonance.
    fn at(&self, hz: f64) -> Option<DMatrix<Complex<f64>>> {
        let omega = std::f64::consts::TAU * hz;
        self.system.response(omega).ok().map(|H| H * self.quantity.factor(omega))
    }

    /// Returns a curve for each pair of output and input.
    fn curves(&self, inputs: &[Channel], outputs: &[Channel]) -> Vec<ResponseCurve> {
        let pairs = || (0..inputs.len()).flat_map(|j| (0..outputs.len()).map(move |i| (i, j)));
        let unit_of = |(i, j): (usize, usize)| unit(&outputs[i], &inputs[j], self.quantity);
        let size = |place: (usize, usize)| self.matrices.iter().map(|H| H[place].norm()).fold(0.0, f64::max);
        let curve = |place: (usize, usize)| {
            let unit = unit_of(place);
            let at = |hz: f64| self.at(hz).map_or(Complex::new(0.0, 0.0), |H| H[place]);
            let magnitude: Vec<f64> = self.matrices.iter().map(|H| H[place].norm()).collect();
            // A curve that is negligible among those of its unit has only round-off peaks.
            let largest = pairs().filter(|other| unit_of(*other) == unit).map(size).fold(0.0, f64::max);
            let peaks = match size(place) < NOTHING * largest {
                true => Vec::new(),
                false => response_peaks(&self.frequency_hz, &magnitude, |hz| at(hz).norm()),
            };
            let peaks = peaks.into_iter().map(|p| PeakFigures {
                frequency_hz: p.frequency,
                magnitude: p.magnitude,
                phase_rad: at(p.frequency).arg(),
            });
            ResponseCurve {
                input: inputs[place.1].word.clone(),
                output: outputs[place.0].word.clone(),
                unit,
                at_rest: self.at(0.0).map(|H| H[place].re),
                peaks: peaks.collect(),
                magnitude,
                phase_rad: unwrapped(self.matrices.iter().map(|H| H[place].arg())),
            }
        };
        pairs().map(curve).collect()
    }
}

/// Lowest and highest frequency, as requested or derived from the modes.
fn range(request: &ResponseRequest, modes_hz: &[f64]) -> Result<(f64, f64), Error> {
    let first = modes_hz.iter().find(|f| **f > 0.0);
    let from = request.from_hz.unwrap_or_else(|| first.map_or(1.0, |f| 0.1 * f));
    let sixth = modes_hz.get(5).or(modes_hz.last());
    let to = request.to_hz.unwrap_or_else(|| sixth.map_or(200.0, |f| 2.0 * f).max(10.0 * from).min(HIGHEST_HZ));
    let logarithmic = request.spacing == Spacing::Logarithmic;
    let lowest = if logarithmic { f64::MIN_POSITIVE } else { 0.0 };
    if !(from.is_finite() && from >= lowest) {
        let expected = match logarithmic {
            true => format!("positive (0 needs {} linear)", Setting::Spacing),
            false => "positive or zero".into(),
        };
        return Err(Error::Value(format!("{} must be {expected}, found {from} Hz", Setting::LowestFrequency)));
    }
    if !(to.is_finite() && to > from && to <= HIGHEST_HZ) {
        let message = format!(
            "{} must lie above {} ({from} Hz) and below 1e6 Hz, found {to} Hz",
            Setting::HighestFrequency,
            Setting::LowestFrequency
        );
        return Err(Error::Value(message));
    }
    Ok((from, to))
}

/// Returns the inputs with these names.
fn input_channels(words: &[String], posed: &Posed) -> Result<Vec<Channel>, Error> {
    let channel = |word: &String| {
        if let Some(index) = WRENCH.iter().position(|w| w == word) {
            let unit = if index < 3 { "N" } else { "Nm" };
            return Ok(Channel { word: word.clone(), unit, index, joint: false });
        }
        let Some(index) = posed.joints.iter().position(|j| j == word) else {
            let (word, joints) = (word.clone(), posed.joints.clone());
            return Err(Error::Value(format!(
                "input {word:?} is not known; inputs are {forces:?} and the joints {joints:?}",
                forces = WRENCH
            )));
        };
        let unit = if posed.prismatic[index] { "m" } else { "rad" };
        Ok(Channel { word: word.clone(), unit, index, joint: true })
    };
    once(words.iter().map(channel).collect::<Result<_, Error>>()?, "input")
}

/// Returns the outputs with these names.
fn output_channels(words: &[String]) -> Result<Vec<Channel>, Error> {
    let channel = |word: &String| {
        let index = AXES.iter().position(|w| w == word);
        let index = index.ok_or_else(|| {
            Error::Value(format!(
                "output {word:?} is not known; outputs are {axes:?} (the folder is {})",
                Setting::Output,
                axes = AXES
            ))
        })?;
        Ok(Channel { word: word.clone(), unit: if index < 3 { "m" } else { "rad" }, index, joint: false })
    };
    once(words.iter().map(channel).collect::<Result<_, Error>>()?, "output")
}

/// Rejects an empty list and repeated names.
fn once(channels: Vec<Channel>, side: &'static str) -> Result<Vec<Channel>, Error> {
    if channels.is_empty() {
        return Err(Error::Value(format!("no {side} is given")));
    }
    for (k, channel) in channels.iter().enumerate() {
        if channels[..k].iter().any(|c| c.word == channel.word) {
            return Err(Error::Value(format!("{side} {word:?} is given twice", word = channel.word)));
        }
    }
    Ok(channels)
}

/// Returns the linear system between inputs and outputs.
///
/// A wrench acts through `Jᵀ`. A joint acts through the inertia, damping and stiffness coupled to
/// it, and also moves the TCP directly.
fn system(linear: &Linear, inputs: &[Channel], outputs: &[Channel]) -> LinearSystem {
    let n = linear.M.nrows();
    let J = tool_map(linear);
    let columns =
        |f: &dyn Fn(usize, &Channel) -> f64| DMatrix::from_fn(n, inputs.len(), |row, column| f(row, &inputs[column]));
    LinearSystem {
        M: linear.M.clone(),
        D: linear.D.clone(),
        K: linear.K.clone(),
        B_0: columns(&|row, c| if c.joint { -linear.K_a[(row, c.index)] } else { J[(c.index, row)] }),
        B_1: columns(&|row, c| if c.joint { -linear.D_a[(row, c.index)] } else { 0.0 }),
        B_2: columns(&|row, c| if c.joint { -linear.M_a[(row, c.index)] } else { 0.0 }),
        C: DMatrix::from_fn(outputs.len(), n, |row, column| J[(outputs[row].index, column)]),
        F: DMatrix::from_fn(outputs.len(), inputs.len(), |row, column| {
            let c = &inputs[column];
            if c.joint { linear.J_a[(outputs[row].index, c.index)] } else { 0.0 }
        }),
    }
}

fn quantity_name(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Displacement => "displacement",
        Quantity::Velocity => "velocity",
        Quantity::Acceleration => "acceleration",
    }
}

/// Returns the unit of an output per input.
fn unit(output: &Channel, input: &Channel, quantity: Quantity) -> String {
    let rate = match quantity {
        Quantity::Displacement => "",
        Quantity::Velocity => "/s",
        Quantity::Acceleration => "/s2",
    };
    format!("{}{rate}/{}", output.unit, input.unit)
}

/// Unwraps angles: removes steps of more than half a turn.
fn unwrapped(angles: impl Iterator<Item = f64>) -> Vec<f64> {
    use std::f64::consts::TAU;
    let mut last = None;
    angles
        .map(|angle| {
            let near = last.map_or(angle, |last: f64| angle + TAU * ((last - angle) / TAU).round());
            last = Some(near);
            near
        })
        .collect()
}

/// Returns the response as a table: frequency, then magnitude and phase of each curve, with units
/// in the column names.
fn csv(response: &Response) -> String {
    let mut text = "frequency_hz".to_owned();
    for c in &response.curves {
        let unit = c.unit.replace('/', "_per_");
        for what in [unit.as_str(), "phase_rad"] {
            text += &format!(",{}", csv_field(&format!("{}_to_{}_{what}", c.input, c.output)));
        }
    }
    text.push('\n');
    for (k, hz) in response.frequency_hz.iter().enumerate() {
        text += &hz.to_string();
        for c in &response.curves {
            text += &format!(",{:e},{}", c.magnitude[k], c.phase_rad[k]);
        }
        text.push('\n');
    }
    text
}

/// Returns a display unit and the factor from the SI unit to it: `m/N` becomes `µm/N` with 1e6.
#[must_use]
pub fn readable_unit(unit: &str) -> (String, f64) {
    let (of, per) = unit.rsplit_once('/').unwrap_or((unit, ""));
    // TCP displacements per joint displacement are of order one.
    if ["rad", "m"].contains(&per) {
        return (unit.to_owned(), 1.0);
    }
    (format!("µ{of}/{per}").replace("s2", "s²").replace("Nm", "N m"), 1e6)
}

/// Plots magnitude over frequency with one panel per unit, and the phase of all curves below; marks
/// the natural frequencies.
fn plot(response: &Response) -> Result<String, PlotError> {
    // Motion in the direction of its force has the colour of that axis.
    let style = |c: &ResponseCurve| {
        let direction = WRENCH.iter().position(|word| *word == c.input);
        match direction.filter(|k| AXES[*k] == c.output) {
            Some(k) => CurveLook::Axis(k % 3),
            None if direction.is_some() => CurveLook::Dashed,
            None => CurveLook::Plain,
        }
    };
    let curve = |c: &ResponseCurve, y: Vec<f64>| PlotCurve {
        name: format!("{} to {}", c.input, c.output),
        look: style(c),
        x: response.frequency_hz.clone(),
        y,
    };
    let mut panels: Vec<Panel> = Vec::new();
    for c in response.curves.iter().filter(|c| c.magnitude.iter().any(|m| *m > 0.0)) {
        let (unit, factor) = readable_unit(&c.unit);
        let label = format!("magnitude [{unit}]");
        let magnitude = curve(c, c.magnitude.iter().map(|m| factor * m).collect());
        match panels.iter_mut().find(|panel| panel.label == label) {
            Some(panel) => panel.curves.push(magnitude),
            None => panels.push(Panel { label, logarithmic: true, legend: true, curves: vec![magnitude] }),
        }
    }
    let degrees = |c: &ResponseCurve| curve(c, c.phase_rad.iter().map(|x| x.to_degrees()).collect());
    let phase = response.curves.iter().map(degrees).collect();
    panels.push(Panel { label: "phase [deg]".into(), logarithmic: false, legend: false, curves: phase });
    let title = format!("{}: {} of the TCP ({})", response.robot, response.quantity, response.tcp);
    let oscillates = |k: &usize| response.damping_ratio[*k] < 1.0;
    let mut marks: Vec<(f64, String)> = Vec::new();
    for (k, hz) in response.frequencies_hz.iter().enumerate().filter(|(k, _)| oscillates(k)) {
        marks.push((*hz, format!("f{}", k + 1)));
    }
    let plot = LinePlot {
        title: &title,
        notes: &notes(response, &marks),
        x_label: "frequency [Hz]",
        logarithmic_x: response.logarithmic,
        marks: &marks,
        panels: &panels,
    };
    plot.svg()
}

/// The pose and the natural frequencies as text.
fn notes(response: &Response, marks: &[(f64, String)]) -> Vec<String> {
    let named: Vec<String> =
        marks.iter().take(LISTED).map(|(hz, name)| format!("{name} {}", rounded(*hz, 2))).collect();
    let mut notes = vec![format!("at {}", pose_in_words(&response.joints, &response.at, &response.slides))];
    if !named.is_empty() {
        let more = if marks.len() > LISTED { ", ..." } else { "" };
        notes.push(format!("natural frequencies {}{more} Hz", named.join(", ")));
    }
    notes
}

/// Formats joint positions in degrees or millimetres.
///
/// * `at`: rad or m, one per joint. `slides`: whether each joint is prismatic.
pub fn pose_in_words(joints: &[String], at: &[f64], slides: &[bool]) -> String {
    let joint = |((joint, q), slides): ((&String, &f64), &bool)| match slides {
        true => format!("{joint} {} mm", rounded(1e3 * q, 1)),
        false => format!("{joint} {}°", rounded(q.to_degrees(), 1)),
    };
    joints.iter().zip(at).zip(slides).map(joint).collect::<Vec<_>>().join(", ")
}

/// Rounds a number to `decimals` decimals.
fn rounded(x: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    // Avoids -0.
    (x * unit).round() / unit + 0.0
}

/// Writes table, picture and figures; a failed picture gives a warning.
fn save(response: &mut Response, paths: Vec<PathBuf>) -> Result<(), Error> {
    let text = |k: usize| Some(paths[k].display().to_string());
    // A rigid robot has no curve to draw.
    let picture = plot(response).map_err(|error| response.warnings.push(error.to_string())).ok();
    response.files = ResponseFiles { csv: text(0), plot: picture.as_ref().and(text(1)), json: text(2) };
    let json = serde_json::to_string_pretty(response).expect("plain numbers and strings") + "\n";
    let contents = [Some(csv(response)), picture, Some(json)];
    let files = paths.into_iter().zip(contents).filter_map(|(path, content)| Some((path, content?)));
    Ok(write_all(&files.collect::<Vec<_>>())?)
}
