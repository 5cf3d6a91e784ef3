//! `flexarm statics`, `flexarm modes` and `flexarm response`: from flags to a request, and tables
//! for people.

use std::process::ExitCode;

use flexarm::Outputs;
use flexarm::poses::{
    ModeMovie, ModeTable, Quantity, Response, ResponseOutputs, ResponseRequest, Spacing, Statics, StaticsOutputs,
};

use crate::failure::Failure;
use crate::layout::{lines, table};
use crate::posed_args::{ModesArgs, QuantityName, ResponseArgs, SpacingName, StaticsArgs};
use crate::print::{caveats, file_lines};
use crate::shipped::OutputFolder;
use crate::terminal::{Terminal, answer, to_json};
use crate::values;

/// Names of the directions at the TCP.
const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];
/// Peaks of a response in the columns of a terminal.
const SHOWN_PEAKS: usize = 3;

pub(crate) fn statics(terminal: &Terminal, args: &StaticsArgs) -> Result<ExitCode, Failure> {
    let wrench = args.wrench.as_deref().map_or(Ok([0.0; 6]), |text| values::wrench("--wrench", text))?;
    let robot = args.pose.load.load(&args.pose.robot)?;
    let at = values::joint_values(args.pose.at.as_deref(), &robot)?;
    let at = at.as_deref();
    let arm = robot.model(&args.pose.modelling.modelling())?;
    let found = match &args.output {
        Some(folder) => {
            let outputs = StaticsOutputs { folder: folder.clone(), overwrite: args.force };
            arm.record_statics(at, wrench, &outputs)?
        }
        None => arm.statics(at, wrench)?,
    };
    caveats(terminal, &found.caveats);
    answer(terminal, || to_json(&found), || statics_text(&found));
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn modes(terminal: &Terminal, args: &ModesArgs) -> Result<ExitCode, Failure> {
    if args.count == 0 {
        return Err(Failure::Usage("--count must be at least 1".into()));
    }
    let robot = args.pose.load.load(&args.pose.robot)?;
    let at = values::joint_values(args.pose.at.as_deref(), &robot)?;
    let speeds = values::joint_speeds(args.speeds.as_deref(), &robot)?;
    let (at, speeds) = (at.as_deref(), speeds.as_deref());
    let arm = robot.model(&args.pose.modelling.modelling())?;
    let found = match &args.output {
        Some(folder) => {
            let outputs = Outputs { overwrite: args.force, ..Outputs::everything(folder) };
            let movie = ModeMovie { seconds: args.seconds, tool_motion_m: args.tool_motion };
            arm.record_modes(at, speeds, args.count, &movie, &outputs)?
        }
        None => arm.modes(at, speeds, args.count)?,
    };
    caveats(terminal, &found.caveats);
    answer(terminal, || to_json(&found), || modes_text(&found));
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn response(terminal: &Terminal, args: &ResponseArgs) -> Result<ExitCode, Failure> {
    let robot = args.pose.load.load(&args.pose.robot)?;
    let trimmed = |words: &[String]| words.iter().map(|w| w.trim().to_owned()).collect();
    let request = ResponseRequest {
        inputs: trimmed(&args.input),
        outputs: trimmed(&args.output),
        quantity: match args.quantity {
            QuantityName::Displacement => Quantity::Displacement,
            QuantityName::Velocity => Quantity::Velocity,
            QuantityName::Acceleration => Quantity::Acceleration,
        },
        from_hz: args.from,
        to_hz: args.to,
        points: args.points,
        spacing: if args.spacing == SpacingName::Log { Spacing::Logarithmic } else { Spacing::Linear },
    };
    let stem = format!("{}-response", robot.name);
    let folder = OutputFolder::of(args.folder.as_deref(), &stem, !args.no_files)?;
    let outputs = folder.path().map(|folder| ResponseOutputs { folder, overwrite: args.force });
    let at = values::joint_values(args.pose.at.as_deref(), &robot)?;
    let arm = robot.model(&args.pose.modelling.modelling())?;
    let found = match &outputs {
        Some(outputs) => arm.record_response(at.as_deref(), &request, outputs)?,
        None => arm.response(at.as_deref(), &request)?,
    };
    caveats(terminal, &found.caveats);
    answer(terminal, || to_json(&found), || response_text(&found));
    Ok(ExitCode::SUCCESS)
}

/// First line of an answer at a pose.
fn pose_text(robot: &str, joints: &[String], at: &[f64], end: &str) -> String {
    let values: Vec<String> = joints.iter().zip(at).map(|(joint, q)| format!("{joint} {q:.4}")).collect();
    format!("{robot} at {}{end}\n", values.join(", "))
}

fn triple(values: &[f64], scale: f64) -> Vec<String> {
    values.iter().map(|x| format!("{:.4}", scale * x)).collect()
}

/// Formats sag, displacement and compliance at a pose.
fn statics_text(s: &Statics) -> String {
    let mut out = pose_text(&s.robot, &s.joints, &s.at, "") + &format!("TCP on {}, world axes\n", s.tcp);
    let mut t = table(&["", "x [mm]", "y [mm]", "z [mm]", "rx [mrad]", "ry [mrad]", "rz [mrad]"]);
    let row = |name: &str, d: &[f64; 3], r: &[f64; 3]| [vec![name.to_owned()], triple(d, 1e3), triple(r, 1e3)].concat();
    t.add_row(row("sag by weight", &s.sag_m, &s.sag_rad));
    if s.wrench != [0.0; 6] {
        t.add_row(row("with the wrench", &s.tcp_displacement_m, &s.tcp_rotation_rad));
    }
    for e in &s.elements {
        t.add_row(row(&format!("  by {}", e.name), &e.tcp_displacement_m, &e.tcp_rotation_rad));
    }
    out += &lines(&t);
    out += "\ncompliance [um/N, urad/N; um/(N m), urad/(N m)]\n";
    let mut t = table(&["", "fx", "fy", "fz", "tx", "ty", "tz"]);
    for (axis, values) in AXES.iter().zip(&s.compliance) {
        t.add_row([vec![(*axis).to_owned()], triple(values, 1e6)].concat());
    }
    out += &lines(&t);
    let holding: Vec<String> =
        s.joints.iter().zip(&s.holding_torque).map(|(joint, torque)| format!("{joint} {torque:.2}")).collect();
    out += &format!("\nholding torques [N m or N]: {}\n", holding.join(", "));
    for figure in flexarm::report::stress_figures(&s.stress, false) {
        let (name, value, unit) = (figure.name, figure.value, figure.unit);
        out += &format!("{name}: {value} {unit}, {}\n", figure.note);
    }
    out += &file_lines(7, &[("picture", &s.files.picture), ("figures", &s.files.json)]);
    out
}

/// Formats the modes at a pose.
fn modes_text(m: &ModeTable) -> String {
    let turning = m.joints.iter().zip(&m.speeds).filter(|(_, speed)| **speed != 0.0);
    let turning: Vec<String> = turning.map(|(joint, speed)| format!("{joint} at {speed:.4} 1/s")).collect();
    let drives = match (m.driven.is_empty(), turning.is_empty()) {
        (_, false) => format!("turning: {}", turning.join(", ")),
        (true, true) => "drives locked".to_owned(),
        (false, true) => format!("under servos: {}", m.driven.join(", ")),
    };
    let mut out = pose_text(&m.robot, &m.joints, &m.at, &format!(", {drives}"));
    if m.modes.is_empty() {
        return out + "no modes: nothing is flexible\n";
    }
    let mut t = table(&["mode", "f [Hz]", "damping [%]", "TCP direction", "mass there [kg]"]);
    for (k, mode) in m.modes.iter().enumerate() {
        // A decay without oscillation has a rate, no frequency.
        let (frequency, damping) = match mode.damping_ratio < 1.0 {
            true => (format!("{:.3}", mode.frequency_hz), format!("{:.3}", 100.0 * mode.damping_ratio)),
            false => (format!("({:.3})", mode.frequency_hz), "decays".into()),
        };
        // Of the whole translation.
        let mass = mass(mode.tcp[..3].iter().map(|x| x * x).sum());
        t.add_row([(k + 1).to_string(), frequency, damping, direction(&mode.tcp), mass]);
    }
    out += &lines(&t);
    let percent = |x: f64| format!("{:.1}", 100.0 * x);
    let head = |title: &str| {
        let numbers = (1..=m.modes.len()).map(|k| k.to_string());
        table(&std::iter::once(title.to_owned()).chain(numbers).collect::<Vec<_>>())
    };
    let mut t = head("energy in [%]");
    for (k, name) in m.elements.iter().enumerate() {
        let shares = m.modes.iter().map(|mode| percent(mode.strain_energy[k]));
        t.add_row(std::iter::once(name.clone()).chain(shares));
    }
    out += &format!("\n{}", lines(&t));
    if m.speeds.is_empty() {
        let mut t = head("share of [%]");
        for (k, axis) in AXES[..3].iter().enumerate() {
            let shares = m.modes.iter().map(|mode| mode.compliance_share[k].map_or_else(|| "-".into(), percent));
            t.add_row(std::iter::once(format!("compliance {axis}")).chain(shares));
        }
        out += &format!("\n{}", lines(&t));
    }
    for (format, path) in m.files.recordings.iter() {
        out += &format!("{:<7} {path}\n", format.info().name);
    }
    if m.total > m.modes.len() {
        out += &format!("{} more modes: --count\n", m.total - m.modes.len());
    }
    out
}

/// Effective mass of a mode from the squared motion at unit modal mass.
fn mass(square: f64) -> String {
    if square > 1e-12 { format!("{:.2}", 1.0 / square) } else { "-".into() }
}

/// Significant components of a translation, scaled so that the largest is 1.
fn direction(tcp: &[f64; 6]) -> String {
    let largest = tcp[..3].iter().fold(0.0f64, |top, x| top.max(x.abs()));
    if largest < 1e-9 {
        return "rotation".into();
    }
    let part = |(axis, x): (&&str, &f64)| {
        let share = x / largest;
        (share.abs() > 0.05).then(|| format!("{share:+.2} {axis}"))
    };
    AXES[..3].iter().zip(&tcp[..3]).filter_map(part).collect::<Vec<_>>().join(" ")
}

/// Formats the peaks of the responses.
fn response_text(r: &Response) -> String {
    let mut out = pose_text(&r.robot, &r.joints, &r.at, ", other drives locked");
    let head = ["from", "to", "unit", "at rest"].into_iter().map(str::to_owned);
    let head: Vec<String> = head.chain((1..=SHOWN_PEAKS).map(|k| format!("peak {k} at [Hz]"))).collect();
    let mut t = table(&head);
    for c in &r.curves {
        let (unit, factor) = flexarm::poses::readable_unit(&c.unit);
        let number = |x: f64| match factor * x {
            0.0 => "0".to_owned(),
            x if (1e-3..1e5).contains(&x.abs()) => format!("{x:.4}"),
            x => format!("{x:.3e}"),
        };
        let at_rest = c.at_rest.map_or_else(|| "-".into(), number);
        let mut row = vec![c.input.clone(), c.output.clone(), unit, at_rest];
        row.extend(
            c.peaks.iter().take(SHOWN_PEAKS).map(|p| format!("{} at {:.2}", number(p.magnitude), p.frequency_hz)),
        );
        t.add_row(row);
    }
    out += &lines(&t);
    out += &file_lines(7, &[("CSV", &r.files.csv), ("plot", &r.files.plot), ("figures", &r.files.json)]);
    out
}
