//! Plan of the TCP path with the magnified error across it. World axes, m; the drawing in mm.
//!
//! Start at [`path_plan`]. Not here: the figures of the path (`figures.rs`), curves (`curves.rs`).

use flexarm_draw::{CurveLook, Panel, PlotCurve, plan_plot};
use nalgebra::{Matrix3, Vector3};

use crate::run::magnification::round_down;
use crate::run::monitor::tool_path::PathFigures;

/// Displayed size of the maximum error, relative to the size of the path.
const SHOWN: f64 = 0.06;

/// Plan of a TCP path.
pub(crate) struct PathPlan {
    /// Drawing as SVG.
    pub(crate) svg: String,
    /// Magnification of the errors.
    pub(crate) factor: f64,
}

/// Draws the path in its best-fit plane, and the TCP with its magnified errors minus the offset of
/// the workpiece; None if there is no path to draw.
pub(crate) fn path_plan(figures: &PathFigures) -> Option<PathPlan> {
    let split = |row: &[f64; 6]| (Vector3::new(row[0], row[1], row[2]), Vector3::new(row[3], row[4], row[5]));
    let points: Vec<(Vector3<f64>, Vector3<f64>)> = figures.points.iter().map(split).collect();
    if points.len() < 3 {
        return None;
    }
    // Best-fit plane, and the errors without the offset of the workpiece.
    let mean = points.iter().map(|(p, _)| p).sum::<Vector3<f64>>() / points.len() as f64;
    let [u, v] = plane(points.iter().map(|(p, _)| p - mean));
    let offset = Vector3::from(figures.offset_m);
    let within = |p: &Vector3<f64>| [u.dot(p), v.dot(p)];
    let size = points.iter().map(|(p, _)| (p - mean).norm()).fold(0.0, f64::max);
    let errors = points.iter().map(|(_, e)| e - offset);
    let largest = errors.map(|e| within(&e)).map(|[a, b]| a.hypot(b)).fold(0.0, f64::max);
    if !(size > 0.0 && largest > 0.0) {
        return None;
    }
    let factor = round_down(SHOWN * size / largest);
    let place = |enlarged: f64| points.iter().map(move |(p, e)| p + (e - offset) * enlarged);
    let curve = |name: String, look: CurveLook, enlarged: f64| {
        let places: Vec<[f64; 2]> = place(enlarged).map(|p| within(&p).map(|x| 1e3 * x)).collect();
        let (x, y) = (places.iter().map(|p| p[0]).collect(), places.iter().map(|p| p[1]).collect());
        PlotCurve { name, look, x, y }
    };
    let curves = vec![
        curve("path of the rigid tool".into(), CurveLook::Dashed, 0.0),
        curve(format!("flexible tool, error x {factor}, workpiece moved to it"), CurveLook::Plain, factor),
    ];
    let panel = Panel { label: format!("{} (mm)", named(&v)), logarithmic: false, legend: true, curves };
    let svg = plan_plot(&format!("{} (mm)", named(&u)), &panel).ok()?;
    Some(PathPlan { svg, factor })
}

/// Two world axes if the points are perpendicular to the third, otherwise the two directions of
/// largest spread.
fn plane(points: impl Iterator<Item = Vector3<f64>>) -> [Vector3<f64>; 2] {
    let spread: Matrix3<f64> = points.map(|p| p * p.transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let normal: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
    let flattest = normal.iamax();
    // Within five degrees of a world axis, the other two world axes are used.
    if normal[flattest].abs() > 0.996 {
        let axes = [[1, 2], [0, 2], [0, 1]][flattest];
        return axes.map(|k| Vector3::ith(k, 1.0));
    }
    let widest: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
    [widest, normal.cross(&widest)]
}

/// Name of an axis of the plan.
fn named(axis: &Vector3<f64>) -> String {
    let largest = axis.iamax();
    if axis[largest].abs() > 0.999 {
        return ["x", "y", "z"][largest].to_owned();
    }
    format!("along ({:.2}, {:.2}, {:.2})", axis.x, axis.y, axis.z)
}
