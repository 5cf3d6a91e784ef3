//! The curves of a run: which plots there are and what goes into them.

use rerun::log::{Chunk, TimeColumn};
use rerun::{Color, EntityPath};

use super::colors::{BLUE, GREEN, LIGHT, RED};
use super::path;
use super::stream::{Ids, StreamError};
use super::tracks::ScalarTrack;
use crate::{RunHeader, Sample};

/// All curves of a run.
pub(crate) struct Curves {
    /// The error, at every sample; in the order in which [`Curves::push_error`] fills them.
    error: Vec<ScalarTrack>,
    /// All else, at the instants at which the robots are drawn; in the order of [`Curves::push_causes`].
    causes: Vec<ScalarTrack>,
    has_rigid: bool,
}

impl Curves {
    /// Curves below `root`.
    pub(crate) fn new(header: &RunHeader, root: &EntityPath) -> Self {
        let at = |parts: &[&str]| root.join(&path(parts));
        let curve = |group: &str, key: &str, name: &str, color: u32| {
            ScalarTrack::new(at(&[group, key]), [name]).with_colors([Color::from_u32(color)])
        };
        let (mut error, mut tracks) = (Vec::new(), Vec::new());
        if header.has_rigid {
            error.push(curve("tcp_error", "x", "x [mm]", RED));
            error.push(curve("tcp_error", "y", "y [mm]", GREEN));
            error.push(curve("tcp_error", "z", "z [mm]", BLUE));
            error.push(curve("tcp_error", "norm", "norm [mm]", LIGHT));
            error.push(curve("tcp_error_path", "tangential", "tangential [mm]", RED));
            error.push(curve("tcp_error_path", "normal", "normal [mm]", GREEN));
            error.push(curve("tcp_error_path", "binormal", "binormal [mm]", BLUE));
            tracks.push(curve("tcp_error_rotation", "x", "about x [mrad]", RED));
            tracks.push(curve("tcp_error_rotation", "y", "about y [mrad]", GREEN));
            tracks.push(curve("tcp_error_rotation", "z", "about z [mrad]", BLUE));
        }
        tracks.push(ScalarTrack::new(at(&["joints", "position"]), header.joints.clone()));
        tracks.push(ScalarTrack::new(at(&["joints", "velocity"]), header.joints.clone()));
        tracks.push(ScalarTrack::new(at(&["joints", "effort", "flexible"]), header.joints.clone()));
        if header.has_rigid {
            let names = header.joints.iter().map(|joint| format!("{joint} (rigid)"));
            tracks.push(ScalarTrack::new(at(&["joints", "effort", "rigid"]), names));
        }
        for element in &header.elements {
            let names = |parts: [&str; 6]| parts.map(|part| format!("{element} {part}"));
            let deflections = names(["x [mm]", "y [mm]", "z [mm]", "rx [mrad]", "ry [mrad]", "rz [mrad]"]);
            tracks.push(ScalarTrack::new(at(&["elastic", element]), deflections));
            let loads = names(["Fx [N]", "Fy [N]", "Fz [N]", "Mx [N m]", "My [N m]", "Mz [N m]"]);
            tracks.push(ScalarTrack::new(at(&["elastic_load", element]), loads));
        }
        if !header.contributors.is_empty() {
            let names = header.contributors.iter().map(|name| format!("{name} [mm]"));
            tracks.push(ScalarTrack::new(at(&["contributions"]), names));
        }
        tracks.push(ScalarTrack::new(at(&["energy"]), ["kinetic [J]", "potential [J]", "elastic [J]"]));
        tracks.push(ScalarTrack::new(at(&["solver"]), ["iterations", "residual"]));
        Self { error, causes: tracks, has_rigid: header.has_rigid }
    }

    /// The size of the error alone, named for a study.
    pub(crate) fn of_study(label: &str, root: &EntityPath, color: Color) -> Self {
        let curve = |group: &str| {
            ScalarTrack::new(root.join(&path(["study", group, label])), [format!("{label} [mm]")]).with_colors([color])
        };
        Self { error: vec![curve("error"), curve("lateral")], causes: Vec::new(), has_rigid: true }
    }

    /// Adds a row of a study's curves: size of the error, and of its part across the path.
    pub(crate) fn push_study(&mut self, sample: &Sample) {
        let [_, normal, binormal, ..] = sample.error_path;
        let rows = [size(&sample.error_world[..3]), size(&[normal, binormal])];
        self.error.iter_mut().zip(rows).for_each(|(track, value)| track.push([value * MILLI]));
    }

    /// Adds a row of the error.
    pub(crate) fn push_error(&mut self, sample: &Sample) {
        if !self.has_rigid {
            return;
        }
        let [x, y, z, ..] = sample.error_world;
        let [tangential, normal, binormal, ..] = sample.error_path;
        let row = [x, y, z, size(&[x, y, z]), tangential, normal, binormal];
        self.error.iter_mut().zip(row).for_each(|(track, value)| track.push([value * MILLI]));
    }

    /// Adds a row of all else.
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
        put(&mut [sample.energy.kinetic, sample.energy.potential, sample.energy.elastic].into_iter());
        put(&mut sample.solver.into_iter());
    }

    /// Names and colours.
    pub(crate) fn styles(&self, ids: &mut Ids) -> Result<Vec<Chunk>, StreamError> {
        self.error.iter().chain(&self.causes).map(|track| track.style(ids)).collect()
    }

    /// Chunks of the rows that wait.
    pub(crate) fn rows(
        &self,
        ids: &mut Ids,
        times: &[TimeColumn],
        pose_times: &[TimeColumn],
        chunks: &mut Vec<Chunk>,
    ) -> Result<(), StreamError> {
        for track in &self.error {
            chunks.push(track.chunk(ids, times)?);
        }
        for track in &self.causes {
            chunks.extend(track.waiting().then(|| track.chunk(ids, pose_times)).transpose()?);
        }
        Ok(())
    }

    pub(crate) fn clear(&mut self) {
        self.error.iter_mut().chain(&mut self.causes).for_each(ScalarTrack::clear);
    }
}

const MILLI: f64 = 1e3;

pub(crate) fn size(parts: &[f64]) -> f64 {
    parts.iter().map(|part| part * part).sum::<f64>().sqrt()
}
