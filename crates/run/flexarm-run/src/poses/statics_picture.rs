//! Statics as files: a picture of the arm at its equilibrium next to the rigid one, with the TCP
//! compliance, and the figures. World frame, SI units. Not here: drawing (`flexarm-draw`).

use std::path::PathBuf;

use flexarm_files::{check_free, write_all};
use flexarm_kinematics::{Pose, forward_kinematics};
use flexarm_log::{RunHeader, Sample, TwinSample};
use flexarm_stepping::Linear;
use nalgebra::DVector;
use serde::Serialize;

use crate::arm::bends::stations;
use crate::error::{Error, NoPicture};
use crate::poses::posed::Posed;
use crate::poses::response::pose_in_words;
use crate::poses::statics::Statics;
use crate::run::magnification::Expected;
use crate::run::record::{link_frames, robot_header};

/// Files in the output folder: picture, figures.
const STATICS_FILES: [&str; 2] = ["statics.png", "statics.json"];
/// Width of the picture (pixels).
#[cfg(feature = "png")]
const WIDTH: usize = 2000;

/// Output location of statics.
#[derive(Clone, Debug)]
pub struct StaticsOutputs {
    /// Output folder; created if it does not exist.
    pub folder: PathBuf,
    /// Whether existing files are overwritten.
    pub overwrite: bool,
}

/// Written files; null where none was written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StaticsFiles {
    /// Picture of the arm with magnified deflections next to the rigid one, and its compliance
    /// ellipsoid.
    pub picture: Option<String>,
    /// This result as JSON.
    pub json: Option<String>,
}

/// Returns the paths of the files after checking that they may be written.
pub(crate) fn places(outputs: &StaticsOutputs) -> Result<[PathBuf; 2], Error> {
    let paths = STATICS_FILES.map(|name| outputs.folder.join(name));
    check_free(&paths, outputs.overwrite)?;
    Ok(paths)
}

/// Writes the files; a failed picture gives a warning.
pub(crate) fn save(statics: &mut Statics, paths: [PathBuf; 2], posed: &Posed, loaded: &Linear) -> Result<(), Error> {
    let (header, sample) = scene(posed, loaded);
    let picture = match draw(&header, &sample, statics, &posed.prismatic) {
        Ok(png) => Some(png),
        Err(why) => {
            statics.warnings.push(why.to_string());
            None
        }
    };
    let [png, json] = paths;
    statics.files = StaticsFiles {
        picture: picture.as_ref().map(|_| png.display().to_string()),
        json: Some(json.display().to_string()),
    };
    let text = serde_json::to_string_pretty(statics).expect("plain numbers and strings") + "\n";
    let files: Vec<(PathBuf, Vec<u8>)> =
        picture.map(|bytes| (png, bytes)).into_iter().chain([(json, text.into_bytes())]).collect();
    Ok(write_all(&files)?)
}

#[cfg(feature = "png")]
fn draw(header: &RunHeader, sample: &Sample, statics: &Statics, slides: &[bool]) -> Result<Vec<u8>, NoPicture> {
    let C = nalgebra::Matrix3::from_fn(|row, column| statics.compliance[row][column]);
    Ok(flexarm_draw::arm_sheet(header, sample, &lines(statics, slides), Some(&C), WIDTH)?)
}

#[cfg(not(feature = "png"))]
fn draw(_: &RunHeader, _: &Sample, _: &Statics, _: &[bool]) -> Result<Vec<u8>, NoPicture> {
    Err(NoPicture::NotBuilt)
}

/// Text lines of the picture.
#[cfg_attr(not(feature = "png"), allow(dead_code, reason = "only pictures have them"))]
fn lines(s: &Statics, slides: &[bool]) -> Vec<String> {
    let size = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let parts = |v: &[f64; 3]| v.map(|x| format!("{:.4}", 1e3 * x + 0.0)).join(", ");
    let mut lines = vec![
        format!("{}: TCP {} off by {:.4} mm", s.robot, s.tcp, 1e3 * size(&s.tcp_displacement_m)),
        format!("at {}", pose_in_words(&s.joints, &s.at, slides)),
    ];
    let weight = format!("{:.4} mm by weight (x, y, z: {})", 1e3 * size(&s.sag_m), parts(&s.sag_m));
    if s.wrench == [0.0; 6] {
        lines.push(weight);
    } else {
        let [fx, fy, fz, tx, ty, tz] = s.wrench;
        let load = format!("{fx}, {fy}, {fz} N and {tx}, {ty}, {tz} N m");
        lines.push(format!("{weight}; with {load}: (x, y, z: {})", parts(&s.tcp_displacement_m)));
    }
    lines.push("ellipsoid at the tool: where one force moves it, by its direction; values along its axes".into());
    lines
}

/// Sample of the deflected arm next to the rigid one.
fn scene(posed: &Posed, loaded: &Linear) -> (RunHeader, Sample) {
    let robot = posed.arm.robot();
    let model = &posed.plant.model;
    let mut header = robot_header(robot, &posed.plant);
    let (bends, stations) = stations(&posed.arm.bends, model, &header.links);
    let frames = link_frames(robot, model);
    let (mut data, straight) = posed.undeformed();
    let mut twin = |q: &DVector<f64>, bent: bool| {
        forward_kinematics(model, &mut data, q);
        let X_WS: Vec<Pose> = stations.iter().filter(|_| bent).map(|f| data.X_WF(f)).collect();
        let X_WL = frames.iter().map(|f| data.X_WF(f)).collect();
        TwinSample { q: posed.at.clone(), X_WL, X_WT: data.X_WF(&posed.tool), X_WS, ..TwinSample::default() }
    };
    // The arm without and with its elastic coordinates.
    let (rigid, flexible) = (twin(&straight.q, false), twin(&loaded.q, true));
    let error_world = flexarm_analysis::tcp_error(&rigid.X_WT, &flexible.X_WT);
    let sample = Sample { flexible, rigid, error_world, ..Sample::default() };

    // Magnification by the sizes of TCP displacement, rotations and arm.
    let base = sample.rigid.X_WL.first().map_or_else(Default::default, |X| X.translation.vector);
    let places = sample.rigid.X_WL.iter().chain([&sample.rigid.X_WT]);
    let turns = loaded.elements.iter().zip(&posed.plant.elements).map(|((_, range), element)| {
        let e = loaded.equilibrium.rows(range.start, range.len());
        match (element.modal, range.len()) {
            (true, _) => 0.0,
            (false, 6) => e.rows(3, 3).norm(),
            (false, _) => e.norm(),
        }
    });
    let expected = Expected {
        tool_m: error_world[..3].iter().map(|x| x * x).sum::<f64>().sqrt(),
        turn_rad: turns.fold(0.0, f64::max),
        reach_m: places.map(|X| (X.translation.vector - base).norm()).fold(0.0, f64::max),
        volume: None,
    };
    header.has_rigid = true;
    header.bends = bends;
    header.magnification = expected.magnification();
    header.color_scale_m = expected.color_scale_m();
    (header, sample)
}
