//! Curves of a run, grouped by plot.
//!
//! Values are pushed in the order in which the tracks are made: [`Curves::new`] and
//! [`Curves::push_causes`] mirror each other. Errors in mm and mrad, the rest in SI units. Not
//! here: axis ranges (`plot_range.rs`).

use rerun::{Color, EntityPath, TimeColumn};

use super::colors::{axis, component, faint, series, total};
use super::entity::path;
use super::size;
use super::stream::{Result, RrdStream};
use super::tracks::{CurveExtent, ScalarTrack};
use flexarm_log::{GaugeQuantity, RunHeader, Sample};

/// All curves of a run.
pub(crate) struct Curves {
    /// Curves of the error, at every sample, in the order of [`Curves::push_error`].
    error: Vec<ScalarTrack>,
    /// All other curves, at the times at which the robots are drawn, in the order of
    /// [`Curves::push_causes`].
    causes: Vec<ScalarTrack>,
    /// Indices of the gauges of each quantity, and their factor from SI units.
    gauges: Vec<(Vec<usize>, f64)>,
    has_rigid: bool,
}

impl Curves {
    /// Creates the curves below `root`.
    pub(crate) fn new(header: &RunHeader, root: &EntityPath) -> Self {
        let at = |parts: &[&str]| root.join(&path(parts));
        let (error, mut tracks) = if header.has_rigid { error_curves(root) } else { Default::default() };
        let joints = &header.joints;
        let of_joint = |k: usize| series(header.color_number(&joints[k]));
        // Joints of both arms, then elements, then what they contribute to the error.
        tracks.push(group(at(&["joints", "position"]), joints.clone(), &of_joint));
        tracks.push(group(at(&["joints", "velocity"]), joints.clone(), &of_joint));
        tracks.push(group(at(&["joints", "effort", "flexible"]), joints.clone(), &of_joint));
        if header.has_rigid {
            let names = joints.iter().map(|joint| format!("{joint} (rigid)")).collect();
            let of_twin = |k: usize| faint(header.color_number(&joints[k]));
            tracks.push(group(at(&["joints", "effort", "rigid"]), names, &of_twin));
        }
        tracks.extend(header.elements.iter().flat_map(|element| element_curves(header, root, element)));
        if !header.contributors.is_empty() {
            let names = header.contributors.iter().map(|name| format!("{name} [mm]")).collect();
            tracks.push(group(at(&["contributions"]), names, &series));
        }
        // Gauges by quantity, with the unit in which each is shown.
        let mut gauges = Vec::new();
        for quantity in GaugeQuantity::ALL {
            let (name_of_plot, unit, factor) = quantity.shown();
            let (places, names): (Vec<usize>, Vec<String>) =
                header.gauges_of(quantity).map(|(k, name)| (k, format!("{name} [{unit}]"))).unzip();
            if !names.is_empty() {
                tracks.push(group(at(&[name_of_plot]), names, &series));
                gauges.push((places, factor));
            }
        }
        let energies = ["kinetic [J]", "potential [J]", "elastic [J]"].map(str::to_owned).to_vec();
        tracks.push(group(at(&["energy"]), energies, &series));
        tracks.push(group(at(&["solver"]), ["iterations", "residual"].map(str::to_owned).to_vec(), &series));
        Self { error, causes: tracks, gauges, has_rigid: header.has_rigid }
    }

    /// Creates the curves of the error norm only, named for a study.
    pub(crate) fn of_study(label: &str, root: &EntityPath, color: Color) -> Self {
        let curve = |group: &str| {
            ScalarTrack::new(root.join(&path(["study", group, label])), [format!("{label} [mm]")]).with_colors([color])
        };
        Self { error: vec![curve("error"), curve("lateral")], causes: Vec::new(), gauges: Vec::new(), has_rigid: true }
    }

    /// Adds a row of a study's curves: norm of the error, and of its component across the path.
    pub(crate) fn push_study(&mut self, sample: &Sample) {
        let [_, normal, binormal, ..] = sample.error_path;
        let rows = [size(&sample.error_world[..3]), size(&[normal, binormal])];
        self.error.iter_mut().zip(rows).for_each(|(track, value)| track.push([value * MILLI]));
    }

    /// Adds a row of error curves.
    pub(crate) fn push_error(&mut self, sample: &Sample) {
        if !self.has_rigid {
            return;
        }
        let [x, y, z, ..] = sample.error_world;
        let [tangential, normal, binormal, ..] = sample.error_path;
        let row = [x, y, z, size(&[x, y, z]), tangential, normal, binormal];
        self.error.iter_mut().zip(row).for_each(|(track, value)| track.push([value * MILLI]));
    }

    /// Adds a row of all other curves.
    pub(crate) fn push_causes(&mut self, sample: &Sample) {
        let mut tracks = self.causes.iter_mut();
        let mut put = |values: &mut dyn Iterator<Item = f64>| {
            tracks.next().expect("a track for every group of values").push(values);
        };
        if self.has_rigid {
            sample.error_world[3..].iter().for_each(|part| put(&mut std::iter::once(part * MILLI)));
        }
        put(&mut sample.flexible.q.iter().copied());
        put(&mut sample.flexible.qdot.iter().copied());
        put(&mut sample.flexible.effort.iter().copied());
        if self.has_rigid {
            put(&mut sample.rigid.effort.iter().copied());
        }
        for element in &sample.elastic {
            put(&mut element.deflection.iter().map(|part| part * MILLI));
            put(&mut element.load.iter().copied());
        }
        if !sample.contributions.is_empty() {
            put(&mut sample.contributions.iter().map(|moved| size(moved) * MILLI));
        }
        for (places, factor) in &self.gauges {
            put(&mut places.iter().map(|k| sample.gauges[*k] * factor));
        }
        put(&mut [sample.energy.kinetic, sample.energy.potential, sample.energy.elastic].into_iter());
        put(&mut sample.solver.into_iter());
    }

    /// Writes names and colours.
    pub(crate) fn styles(&self, stream: &RrdStream) -> Result<()> {
        self.error.iter().chain(&self.causes).try_for_each(|track| track.style(stream))
    }

    /// Writes the waiting rows and clears them.
    pub(crate) fn send(&mut self, stream: &RrdStream, times: &[TimeColumn], pose_times: &[TimeColumn]) -> Result<()> {
        self.error.iter_mut().try_for_each(|track| track.send(stream, times))?;
        self.causes.iter_mut().try_for_each(|track| track.send(stream, pose_times))
    }

    /// Returns path, envelope and names of each group of curves.
    pub(crate) fn extents(&self) -> impl Iterator<Item = CurveExtent> + '_ {
        self.error.iter().chain(&self.causes).map(ScalarTrack::extent)
    }
}

/// Several curves in one plot, each with a name.
fn group(path: EntityPath, names: Vec<String>, color: &dyn Fn(usize) -> Color) -> ScalarTrack {
    let colors: Vec<Color> = (0..names.len()).map(color).collect();
    ScalarTrack::new(path, names).with_colors(colors)
}

/// Curves of the TCP error: translations, and rotations.
fn error_curves(root: &EntityPath) -> (Vec<ScalarTrack>, Vec<ScalarTrack>) {
    let curve = |group: &str, key: &str, name: &str, color: Color| {
        ScalarTrack::new(root.join(&path([group, key])), [name]).with_colors([color])
    };
    let translations = vec![
        curve("tcp_error", "x", "x [mm]", axis(0)),
        curve("tcp_error", "y", "y [mm]", axis(1)),
        curve("tcp_error", "z", "z [mm]", axis(2)),
        curve("tcp_error", "norm", "norm [mm]", total()),
        curve("tcp_error_path", "tangential", "tangential [mm]", series(0)),
        curve("tcp_error_path", "normal", "normal [mm]", series(1)),
        curve("tcp_error_path", "binormal", "binormal [mm]", series(2)),
    ];
    let rotations = vec![
        curve("tcp_error_rotation", "x", "about x [mrad]", axis(0)),
        curve("tcp_error_rotation", "y", "about y [mrad]", axis(1)),
        curve("tcp_error_rotation", "z", "about z [mrad]", axis(2)),
    ];
    (translations, rotations)
}

/// Curves of the deflection and the load of an elastic element; one plot shows all elements.
fn element_curves(header: &RunHeader, root: &EntityPath, element: &str) -> [ScalarTrack; 2] {
    let names = |parts: [&str; 6]| parts.map(|part| format!("{element} {part}")).to_vec();
    let number = header.color_number(element);
    let curves = |kind: &str, parts: [&str; 6]| {
        group(root.join(&path([kind, element])), names(parts), &|part| component(number, part))
    };
    [
        curves("elastic", ["x [mm]", "y [mm]", "z [mm]", "rx [mrad]", "ry [mrad]", "rz [mrad]"]),
        curves("elastic_load", ["Fx [N]", "Fy [N]", "Fz [N]", "Mx [N m]", "My [N m]", "Mz [N m]"]),
    ]
}

const MILLI: f64 = 1e3;
