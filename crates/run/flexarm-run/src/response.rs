//! Frequency response at a pose, drives locked or shaken: what the TCP does per newton on it or per
//! radian of a joint.

use std::path::PathBuf;

use flexarm_analysis::{
    LinearSystem, Quantity, Spacing, frequency_grid, resolved_response, response_peaks, with_resonances,
};
use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve, PlotError};
use flexarm_files::{check_free, write_all};
use flexarm_settings::written::csv_field;
use flexarm_stepping::Linear;
use nalgebra::{Complex, DMatrix, Vector6};
use serde::Serialize;

use crate::arm::Arm;
use crate::caveat::{self, Caveat, kinds};
use crate::error::{ChannelError, Error, ValueError};
use crate::modes::{linear_error, modes_of, tool_map};
use crate::options::Modelling;
use crate::posed::Posed;
use crate::robot::Robot;

/// Files of a response in its output folder: table, plot, figures.
const RESPONSE_FILES: [&str; 3] = ["response.csv", "response.svg", "response.json"];
/// Allowed numbers of points of a response.
const POINTS: std::ops::RangeInclusive<usize> = 2..=100_000;
/// Highest frequency that makes sense (Hz).
const HIGHEST_HZ: f64 = 1e6;
/// A curve below this part of the largest of its unit is rounding.
const NOTHING: f64 = 1e-12;
/// Curves are drawn within this part of their height.
const RESOLUTION: f64 = 0.01;
/// Natural frequencies that a plot lists.
const LISTED: usize = 8;
/// Below this damping ratio a resonance is as good as undamped.
const UNDAMPED: f64 = 1e-6;
const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];
const WRENCH: [&str; 6] = ["force-x", "force-y", "force-z", "torque-x", "torque-y", "torque-z"];

/// Request of [`response`].
#[derive(Clone, Debug)]
pub struct ResponseRequest {
    /// `force-x` ... `torque-z` (on the TCP, world axes), or names of joints.
    pub inputs: Vec<String>,
    /// `x`, `y`, `z`, `rx`, `ry`, `rz` of the TCP, world axes.
    pub outputs: Vec<String>,
    /// Displacement, velocity or acceleration of the outputs.
    pub quantity: Quantity,
    /// Lowest frequency (Hz); a tenth of the first mode without it.
    pub from_hz: Option<f64>,
    /// Highest frequency (Hz); twice the sixth mode without it.
    pub to_hz: Option<f64>,
    /// Number of frequencies; more are added around resonances.
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

/// Answer of `flexarm response`. SI units.
#[derive(Clone, Debug, Serialize)]
pub struct Response {
    /// Name of the robot.
    pub robot: String,
    /// Joints, in coordinate order.
    pub joints: Vec<String>,
    /// Positions at which they are held, or about which they move (rad or m).
    pub at: Vec<f64>,
    /// Whether each of them is prismatic.
    #[serde(skip)]
    pub slides: Vec<bool>,
    /// Link that carries the TCP.
    pub tcp: String,
    /// displacement, velocity or acceleration.
    pub quantity: &'static str,
    /// Natural frequencies of the modes (Hz), all.
    pub frequencies_hz: Vec<f64>,
    /// Their damping ratios.
    pub damping_ratio: Vec<f64>,
    /// Frequencies of the curves (Hz).
    pub frequency_hz: Vec<f64>,
    /// Whether they are spaced by equal ratios.
    pub logarithmic: bool,
    /// One per input and output.
    pub curves: Vec<ResponseCurve>,
    /// Written files.
    pub files: ResponseFiles,
    /// Warnings among the caveats, as sentences.
    pub warnings: Vec<String>,
    /// Doubts about the input and limits of the result.
    pub caveats: Vec<Caveat>,
}

/// Response of one output to one input.
#[derive(Clone, Debug, Serialize)]
pub struct ResponseCurve {
    /// Word of the input.
    pub input: String,
    /// Word of the output.
    pub output: String,
    /// Unit of the magnitude.
    pub unit: String,
    /// Response at rest, with its sign; null where it is infinite.
    pub at_rest: Option<f64>,
    /// Resonances within the frequencies, the highest first.
    pub peaks: Vec<PeakFigures>,
    /// Amplitude of the output per amplitude of the input, one per frequency.
    pub magnitude: Vec<f64>,
    /// Phase lead of the output (rad), one per frequency, unwrapped: steps of more than half a
    /// turn are removed.
    pub phase_rad: Vec<f64>,
}

/// A resonance.
#[derive(Clone, Debug, Serialize)]
pub struct PeakFigures {
    /// Frequency (Hz).
    pub frequency_hz: f64,
    /// Magnitude.
    pub magnitude: f64,
    /// Phase there (rad).
    pub phase_rad: f64,
}

/// Written files; null where none was written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ResponseFiles {
    /// Table.
    pub csv: Option<String>,
    /// Magnitude and phase as a picture.
    pub plot: Option<String>,
    /// This answer.
    pub json: Option<String>,
}

/// Output files of a response.
#[derive(Clone, Debug)]
pub struct ResponseOutputs {
    /// Folder; made if it is not there.
    pub folder: PathBuf,
    /// Overwrite what is there.
    pub overwrite: bool,
}

/// A column of the input or output side: its word, its unit, and the letter for names of columns.
struct Channel {
    word: String,
    unit: &'static str,
    index: usize,
    joint: bool,
}

/// Frequency response of the flexible robot at a pose, about its equilibrium under weight, other
/// drives locked.
///
/// `at`: all actuated joints (rad or m), zero without it.
///
/// # Errors
/// [`Error::Channel`] and [`Error::Value`] for words and numbers that make no sense,
/// [`Error::Step`] where there is no equilibrium, [`Error::File`] and [`Error::Write`] for files.
pub fn response(
    robot: &Robot,
    modelling: &Modelling,
    at: Option<&[f64]>,
    request: &ResponseRequest,
    outputs: Option<&ResponseOutputs>,
) -> Result<Response, Error> {
    response_at(robot, Posed::new(robot, modelling, at)?, request, outputs)
}

impl Arm {
    /// As [`response()`], of an arm whose links and drives are in place; nothing is written.
    ///
    /// # Errors
    /// As [`response()`].
    pub fn response(&self, at: Option<&[f64]>, request: &ResponseRequest) -> Result<Response, Error> {
        response_at(self.robot(), Posed::on(self, at)?, request, None)
    }
}

fn response_at(
    robot: &Robot,
    posed: Posed,
    request: &ResponseRequest,
    outputs: Option<&ResponseOutputs>,
) -> Result<Response, Error> {
    let inputs = input_channels(&request.inputs, &posed)?;
    let channels = output_channels(&request.outputs)?;
    if !POINTS.contains(&request.points) {
        let (least, most) = (*POINTS.start(), *POINTS.end());
        return Err(ValueError::Points { found: request.points, least, most }.into());
    }
    let paths: Vec<PathBuf> = outputs.iter().flat_map(|o| RESPONSE_FILES.map(|name| o.folder.join(name))).collect();
    check_free(&paths, outputs.is_some_and(|o| o.overwrite))?;

    let linear = posed.linear(&Vector6::zeros())?;
    let modes = modes_of(&linear)?;
    let frequencies_hz: Vec<f64> = modes.iter().map(flexarm_analysis::DampedMode::frequency_hz).collect();
    let damping_ratio: Vec<f64> = modes.iter().map(flexarm_analysis::DampedMode::damping_ratio).collect();
    let (from, to) = range(request, &frequencies_hz)?;
    let system = system(&linear, &inputs, &channels);

    // One solution per frequency serves all curves; an undamped resonance has none and is left out.
    let resonances: Vec<(f64, f64)> = frequencies_hz.iter().copied().zip(damping_ratio.iter().copied()).collect();
    let grid = with_resonances(&frequency_grid(from, to, request.points, request.spacing), &resonances);
    let displacement = |hz: f64| system.response(std::f64::consts::TAU * hz).ok();
    let factor = |hz: f64| request.quantity.factor(std::f64::consts::TAU * hz);
    let answer = |hz: f64| displacement(hz).map(|H| H * factor(hz));
    // All quantities have the same frequencies.
    let (frequency_hz, answers) = resolved_response(&grid, displacement, RESOLUTION);
    let answers: Vec<DMatrix<Complex<f64>>> = frequency_hz.iter().zip(answers).map(|(hz, H)| H * factor(*hz)).collect();
    system.check().map_err(linear_error)?;

    // A curve that is nothing beside the others of its unit has no peaks but rounding.
    let size = |i: usize, j: usize| answers.iter().map(|H| H[(i, j)].norm()).fold(0.0, f64::max);
    let largest = |unit: &str, other: &dyn Fn(usize, usize) -> String| {
        let all = (0..channels.len()).flat_map(|i| (0..inputs.len()).map(move |j| (i, j)));
        all.filter(|&(i, j)| other(i, j) == unit).map(|(i, j)| size(i, j)).fold(0.0, f64::max)
    };
    let unit_of = |i: usize, j: usize| unit(&channels[i], &inputs[j], request.quantity);
    let mut curves = Vec::new();
    for (j, input) in inputs.iter().enumerate() {
        for (i, output) in channels.iter().enumerate() {
            let at = |hz: f64| answer(hz).map_or(Complex::new(0.0, 0.0), |H| H[(i, j)]);
            let magnitude: Vec<f64> = answers.iter().map(|H| H[(i, j)].norm()).collect();
            let nothing = size(i, j) < NOTHING * largest(&unit_of(i, j), &unit_of);
            let peaks =
                if nothing { Vec::new() } else { response_peaks(&frequency_hz, &magnitude, |hz| at(hz).norm()) };
            let peaks = peaks
                .into_iter()
                .map(|p| PeakFigures {
                    frequency_hz: p.frequency,
                    magnitude: p.magnitude,
                    phase_rad: at(p.frequency).arg(),
                })
                .collect();
            curves.push(ResponseCurve {
                input: input.word.clone(),
                output: output.word.clone(),
                unit: unit(output, input, request.quantity),
                at_rest: answer(0.0).map(|H| H[(i, j)].re),
                peaks,
                magnitude,
                phase_rad: unwrapped(answers.iter().map(|H| H[(i, j)].arg())),
            });
        }
    }
    let mut caveats = posed.caveats_of(robot, &linear, &[0.0; 6]);
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
        frequency_hz,
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

/// Lowest and highest frequency, asked for or after the modes.
fn range(request: &ResponseRequest, modes_hz: &[f64]) -> Result<(f64, f64), Error> {
    let first = modes_hz.iter().find(|f| **f > 0.0);
    let from = request.from_hz.unwrap_or_else(|| first.map_or(1.0, |f| 0.1 * f));
    let sixth = modes_hz.get(5).or(modes_hz.last());
    let to = request.to_hz.unwrap_or_else(|| sixth.map_or(200.0, |f| 2.0 * f).max(10.0 * from).min(HIGHEST_HZ));
    let logarithmic = request.spacing == Spacing::Logarithmic;
    let lowest = if logarithmic { f64::MIN_POSITIVE } else { 0.0 };
    if !(from.is_finite() && from >= lowest) {
        return Err(ValueError::LowestFrequency { found: from, logarithmic }.into());
    }
    if !(to.is_finite() && to > from && to <= HIGHEST_HZ) {
        return Err(ValueError::HighestFrequency { found: to, lowest: from }.into());
    }
    Ok((from, to))
}

fn input_channels(words: &[String], posed: &Posed) -> Result<Vec<Channel>, Error> {
    let channel = |word: &String| {
        if let Some(index) = WRENCH.iter().position(|w| w == word) {
            let unit = if index < 3 { "N" } else { "Nm" };
            return Ok(Channel { word: word.clone(), unit, index, joint: false });
        }
        let Some(index) = posed.joints.iter().position(|j| j == word) else {
            let (word, joints) = (word.clone(), posed.joints.clone());
            return Err(ChannelError::UnknownInput { word, forces: &WRENCH, joints });
        };
        let unit = if posed.prismatic[index] { "m" } else { "rad" };
        Ok(Channel { word: word.clone(), unit, index, joint: true })
    };
    once(words.iter().map(channel).collect::<Result<_, ChannelError>>()?, "input")
}

fn output_channels(words: &[String]) -> Result<Vec<Channel>, Error> {
    let channel = |word: &String| {
        let index = AXES.iter().position(|w| w == word);
        let index = index.ok_or_else(|| ChannelError::UnknownOutput { word: word.clone(), axes: &AXES })?;
        Ok(Channel { word: word.clone(), unit: if index < 3 { "m" } else { "rad" }, index, joint: false })
    };
    once(words.iter().map(channel).collect::<Result<_, ChannelError>>()?, "output")
}

fn once(channels: Vec<Channel>, side: &'static str) -> Result<Vec<Channel>, Error> {
    if channels.is_empty() {
        return Err(ChannelError::Missing { side }.into());
    }
    for (k, channel) in channels.iter().enumerate() {
        if channels[..k].iter().any(|c| c.word == channel.word) {
            return Err(ChannelError::Twice { side, word: channel.word.clone() }.into());
        }
    }
    Ok(channels)
}

/// A wrench acts by `Jᵀ`; a joint by the inertia and weight that it moves, and moves the tool
/// directly.
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

fn unit(output: &Channel, input: &Channel, quantity: Quantity) -> String {
    let rate = match quantity {
        Quantity::Displacement => "",
        Quantity::Velocity => "/s",
        Quantity::Acceleration => "/s2",
    };
    format!("{}{rate}/{}", output.unit, input.unit)
}

/// Angles without steps of more than half a turn.
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

/// The response as a table: frequency, then magnitude and phase of each curve, units in the names.
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

/// A unit as people say it, and how many of it make one of the SI unit: `m/N` is 1e6 `µm/N`.
#[must_use]
pub fn readable_unit(unit: &str) -> (String, f64) {
    let (of, per) = unit.rsplit_once('/').unwrap_or((unit, ""));
    // Displacements of a tool for a joint's are of one size.
    if ["rad", "m"].contains(&per) {
        return (unit.to_owned(), 1.0);
    }
    (format!("µ{of}/{per}").replace("s2", "s²").replace("Nm", "N m"), 1e6)
}

/// Magnitude over frequency, a panel per unit, and phase of all curves below; the natural
/// frequencies marked.
fn plot(response: &Response) -> Result<String, PlotError> {
    // A curve in the direction of its force has the colour of that axis.
    let look = |c: &ResponseCurve| {
        let direction = WRENCH.iter().position(|word| *word == c.input);
        match direction.filter(|k| AXES[*k] == c.output) {
            Some(k) => CurveLook::Axis(k % 3),
            None if direction.is_some() => CurveLook::Dashed,
            None => CurveLook::Plain,
        }
    };
    let curve = |c: &ResponseCurve, y: Vec<f64>| PlotCurve {
        name: format!("{} to {}", c.input, c.output),
        look: look(c),
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

/// The pose and the natural frequencies, in words.
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

/// Joints and where they are, in degrees or millimetres.
pub fn pose_in_words(joints: &[String], at: &[f64], slides: &[bool]) -> String {
    let joint = |((joint, q), slides): ((&String, &f64), &bool)| match slides {
        true => format!("{joint} {} mm", rounded(1e3 * q, 1)),
        false => format!("{joint} {}°", rounded(q.to_degrees(), 1)),
    };
    joints.iter().zip(at).zip(slides).map(joint).collect::<Vec<_>>().join(", ")
}

/// A number with so many decimals at most.
fn rounded(x: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    // Nothing is gained by -0.
    (x * unit).round() / unit + 0.0
}

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
