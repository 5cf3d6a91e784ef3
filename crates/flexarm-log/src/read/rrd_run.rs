//! A Rerun recording of a run. It is made to be looked at: the error is in millimetres and has every sample, other curves and
//! poses (in single precision) are fewer and interpolated. All of it is read into memory, since a viewer may have written the chunks in any order.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::rerun::Chunk;
use crate::rerun::{EntityPath, Scalars, SeriesLines, TextDocument, Timeline, Transform3D};
use flexarm_kinematics::Pose;
use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};

use super::rrd_messages::{Message, Messages};
use super::rrd_track::Track;
use super::wall::caught;
use super::{broken_end, exact_time, not_a_recording};
use crate::rrd_file::tracks::SIM_TIME;
use crate::rrd_file::{RESULT_ENTITY, RUN_ENTITY, link_part, path as entity};
use crate::{ElasticSample, EnergySample, LogError, RunHeader, RunResult, RunSource, Sample, TwinSample, run_json};

const MILLI: f64 = 1e-3;

/// See the module.
pub(super) struct RrdRun {
    path: PathBuf,
    header: RunHeader,
    result: RunResult,
    /// Why the file ends before its end.
    broken: Option<String>,
    finished: bool,
    data: Data,
    missing: Vec<String>,
    warnings: Vec<String>,
}

/// What changes with time, by entity.
#[derive(Default)]
struct Data {
    scalars: BTreeMap<EntityPath, Track>,
    poses: BTreeMap<EntityPath, Track>,
    /// Instants at which anything moved (ns), ascending.
    pictures: Vec<i64>,
    names: BTreeMap<EntityPath, Vec<String>>,
    texts: BTreeMap<EntityPath, String>,
}

impl RrdRun {
    pub(super) fn open(path: &Path) -> Result<Self, LogError> {
        let (mut data, mut broken, mut application) = (Data::default(), None, None);
        let mut messages = Messages::open(path)?;
        loop {
            match messages.next() {
                Ok(Some(Message::Recording(name))) => application = Some(name),
                Ok(Some(Message::Rows(chunk))) => {
                    if let Err(cause) = caught(|| data.take(&chunk)) {
                        broken = Some(cause);
                        break;
                    }
                }
                Ok(Some(Message::Other)) => {}
                Ok(None) => break,
                Err(cause) => {
                    broken = Some(cause);
                    break;
                }
            }
        }
        data.sort();
        let is_ours = application.as_deref() == Some("flexarm");
        if !is_ours || data.scalars.is_empty() && data.text(RUN_ENTITY).is_none() {
            let found = match (application, &broken) {
                (Some(name), _) if !is_ours => format!("a Rerun recording of {name:?}"),
                (_, Some(cause)) => format!("a Rerun recording without a run ({cause})"),
                _ => "a Rerun recording without a run".into(),
            };
            return Err(not_a_recording(path, found, "one that flexarm wrote, with curves below /plots"));
        }
        let of_study = |at: &&EntityPath| at.to_string().starts_with("/plots/study/");
        if data.scalars.keys().find(of_study).is_some() {
            return Err(not_a_recording(
                path,
                "a study of several runs",
                "one run: run.mcap beside it, or in a folder below",
            ));
        }
        let mut missing = vec!["the file has no stations of bent links: they are straight".to_owned()];
        let header = match data.text(RUN_ENTITY).map(|text| run_json::read(text.as_bytes())) {
            Some(Ok((header, _))) => header,
            Some(Err(what)) => return Err(not_a_recording(path, what, "the description of a run")),
            None => {
                missing.push("the file does not describe its run: links are not known".into());
                data.header()
            }
        };
        if !header.contributors.is_empty() {
            missing.push("the file has only sizes of the shares of the tool error, not their directions".into());
        }
        if header.has_static {
            missing.push("the file has no static part of the tool error".into());
        }
        if !header.has_rigid {
            missing.push("the file has at most 200 samples a second".into());
        }
        missing.push(
            "between pictures (200 a second) all but the error is interpolated; poses are in single precision".into(),
        );
        missing.push("surfaces of links and attached files are not read back".into());
        let header = RunHeader {
            urdf: data.text(["urdf", ""]).unwrap_or_default().to_owned(),
            bends: Vec::new(),
            contributors: Vec::new(),
            has_static: false,
            magnification: 0.0,
            ..header
        };
        let finished = data.text(RESULT_ENTITY).is_some();
        let result = data.text(RESULT_ENTITY).map(run_json::read_result).unwrap_or_default();
        let path = path.to_owned();
        Ok(Self { path, header, result, broken, finished, data, missing, warnings: Vec::new() })
    }
}

impl RunSource for RrdRun {
    fn header(&self) -> &RunHeader {
        &self.header
    }

    fn missing(&self) -> Vec<String> {
        self.missing.clone()
    }

    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    fn replay(&mut self, take: &mut dyn FnMut(&Sample) -> Result<(), LogError>) -> Result<RunResult, LogError> {
        let twins = [Tracks::of(&self.header, "flexible"), Tracks::of(&self.header, "rigid")];
        let (mut count, mut last_s) = (0, 0.0);
        for time_ns in self.data.times(self.finished) {
            let sample = self.sample(time_ns, &twins);
            take(&sample)?;
            (count, last_s) = (count + 1, sample.time_s);
        }
        self.warnings.clear();
        if let Some(cause) = &self.broken {
            self.warnings.push(broken_end(&self.path, cause, count, last_s));
        } else if !self.finished {
            let path = self.path.display();
            self.warnings
                .push(format!("{path}: the run was not finished; {count} samples, up to t = {last_s} s, were read"));
        }
        Ok(self.result.clone())
    }
}

impl RrdRun {
    fn sample(&self, time_ns: i64, twins: &[Tracks; 2]) -> Sample {
        let (header, data) = (&self.header, &self.data);
        let joints = header.joints.len();
        let row = |parts: &[&str], width: usize| -> Vec<f64> {
            let track = data.scalars.get(&entity(parts)).filter(|track| track.width() == width);
            track.map_or_else(|| vec![f64::NAN; width], |track| track.between(time_ns))
        };
        let one = |group: &str, key: &str| MILLI * row(&["plots", group, key], 1)[0];
        let six = |parts: [f64; 3], angles: [f64; 3]| [parts[0], parts[1], parts[2], angles[0], angles[1], angles[2]];
        let twin = |tracks: &Tracks, who: &str| TwinSample {
            q: row(&["plots", "joints", "position"], joints),
            qdot: row(&["plots", "joints", "velocity"], joints),
            effort: row(&["plots", "joints", "effort", who], joints),
            X_WL: tracks.links.iter().map(|link| data.pose(link, time_ns).unwrap_or_default()).collect(),
            X_WT: data.tool(&tracks.tool, time_ns),
            X_WS: Vec::new(),
        };
        let (time_s, step) = exact_time(u64::try_from(time_ns).unwrap_or(0), header.step_s);
        let mut sample = Sample { time_s, step, flexible: twin(&twins[0], "flexible"), ..Sample::default() };
        if header.has_rigid {
            sample.rigid = twin(&twins[1], "rigid");
            sample.rigid.X_WT = data.tool(&twins[1].tool, time_ns);
            sample.rigid.q.fill(f64::NAN); // the curves are those of the flexible robot
            sample.rigid.qdot.fill(f64::NAN);
            let rotation = ["x", "y", "z"].map(|axis| one("tcp_error_rotation", axis));
            sample.error_world = six(["x", "y", "z"].map(|axis| one("tcp_error", axis)), rotation);
            let along = ["tangential", "normal", "binormal"].map(|axis| one("tcp_error_path", axis));
            sample.error_path = six(along, [f64::NAN; 3]);
            // Between two pictures the error is known better than the pose.
            if !data.drawn(&twins[0].tool, time_ns) {
                let [x, y, z, ..] = sample.error_world;
                sample.flexible.X_WT.translation.vector = sample.rigid.X_WT.translation.vector + Vector3::new(x, y, z);
            }
        }
        let element = |name: &String| {
            let (deflection, load) = (row(&["plots", "elastic", name], 6), row(&["plots", "elastic_load", name], 6));
            ElasticSample {
                deflection: std::array::from_fn(|k| MILLI * deflection[k]),
                load: std::array::from_fn(|k| load[k]),
            }
        };
        sample.elastic = header.elements.iter().map(element).collect();
        let energy = row(&["plots", "energy"], 3);
        sample.energy = EnergySample { kinetic: energy[0], potential: energy[1], elastic: energy[2] };
        let solver = row(&["plots", "solver"], 2);
        sample.solver = [solver[0], solver[1]];
        sample
    }
}

/// Entities of one of the two robots.
struct Tracks {
    links: Vec<EntityPath>,
    tool: EntityPath,
}

impl Tracks {
    fn of(header: &RunHeader, who: &str) -> Self {
        let at = |what: &str| entity([header.robot.as_str(), who, what]);
        Self { links: header.links.iter().map(|link| at(&link_part(&link.name))).collect(), tool: at("tcp") }
    }
}

impl Data {
    fn take(&mut self, chunk: &Chunk) {
        let at = chunk.entity_path();
        if chunk.is_static() {
            let mut texts = chunk.iter_slices::<String>(TextDocument::descriptor_text().component);
            if let Some(text) = texts.next().and_then(|texts| texts.first().cloned()) {
                self.texts.insert(at.clone(), text.as_str().to_owned());
            }
            let mut names = chunk.iter_slices::<String>(SeriesLines::descriptor_names().component);
            if let Some(names) = names.next() {
                self.names.insert(at.clone(), names.iter().map(|name| name.as_str().to_owned()).collect());
            }
            return;
        }
        let timeline = *Timeline::new_duration(SIM_TIME).name();
        let scalars = Scalars::descriptor_scalars().component;
        let times = || chunk.iter_component_indices(timeline, scalars).map(|(time, _)| time.as_i64());
        for (time, values) in times().zip(chunk.iter_slices::<f64>(scalars)) {
            track(&mut self.scalars, at, values.len()).push(time, values);
        }
        let translation = Transform3D::descriptor_translation().component;
        let translations = chunk.iter_slices::<[f32; 3]>(translation);
        let rotations = chunk.iter_slices::<[f32; 4]>(Transform3D::descriptor_quaternion().component);
        let times = chunk.iter_component_indices(timeline, translation).map(|(time, _)| time.as_i64());
        for ((time, places), turns) in times.zip(translations).zip(rotations) {
            let (Some(&[x, y, z]), Some(&[qx, qy, qz, qw])) = (places.first(), turns.first()) else { continue };
            track(&mut self.poses, at, 7).push(time, &[x, y, z, qx, qy, qz, qw].map(f64::from));
        }
    }

    /// Brings everything in order of time; to be called once all has been taken.
    fn sort(&mut self) {
        self.scalars.values_mut().chain(self.poses.values_mut()).for_each(Track::sort);
        let mut pictures: Vec<i64> = Vec::new();
        for track in self.poses.values() {
            pictures.extend(track.times());
            pictures.sort_unstable();
            pictures.dedup();
        }
        self.pictures = pictures;
    }

    fn text(&self, parts: [&str; 2]) -> Option<&str> {
        let parts = parts.into_iter().filter(|part| !part.is_empty());
        self.texts.get(&entity(parts)).map(String::as_str)
    }

    /// Times of the samples: those of the fullest curve. Curves are written one after the other, so at the end of a file
    /// that breaks off some go further than others; only what all have counts.
    fn times(&self, finished: bool) -> Vec<i64> {
        // Names of curves are written at the start, before any rows.
        if !finished && self.names.keys().any(|curve| !self.scalars.contains_key(curve)) {
            return Vec::new();
        }
        let fullest = self.scalars.values().max_by_key(|track| track.times().len());
        let first = fullest.and_then(|track| track.times().first());
        let curves = self.scalars.values().filter(|track| track.times().first() == first);
        let shortest = curves.filter_map(|track| track.times().last()).min().copied();
        let end = shortest.filter(|_| !finished).unwrap_or(i64::MAX);
        let until = |track: &Track| Some(track.times()[..=track.last_until(end)?].to_vec());
        fullest.and_then(until).unwrap_or_default()
    }

    /// The last pose at or before a time, or the first one.
    fn pose(&self, at: &EntityPath, time_ns: i64) -> Option<Pose> {
        let track = self.poses.get(at)?;
        Some(pose(track.row(track.last_until(time_ns).unwrap_or(0))))
    }

    /// Whether there is a pose for just this time.
    fn drawn(&self, at: &EntityPath, time_ns: i64) -> bool {
        self.poses.get(at).is_some_and(|track| track.times().binary_search(&time_ns).is_ok())
    }

    /// Pose of a tool, between two pictures on the straight way from one to the other; without any its place is NaN.
    fn tool(&self, at: &EntityPath, time_ns: i64) -> Pose {
        let Some(track) = self.poses.get(at) else { return Translation3::from(Vector3::repeat(f64::NAN)).into() };
        let (before, after) = track.around(time_ns);
        let (Some(before), Some(after)) = (before, after) else {
            return before.or(after).map(|k| pose(track.row(k))).unwrap_or_default();
        };
        let (start, end, end_ns) = (pose(track.row(before)), pose(track.row(after)), track.times()[after]);
        // A row is left out where nothing moves: the way begins at the last picture before the next row.
        let earlier = self.pictures.partition_point(|picture| *picture < end_ns);
        let start_ns = if earlier > 0 { self.pictures[earlier - 1] } else { end_ns };
        if time_ns <= start_ns || end_ns == start_ns {
            return if time_ns == end_ns { end } else { start };
        }
        let share = time_ns.saturating_sub(start_ns) as f64 / end_ns.saturating_sub(start_ns) as f64;
        let place = start.translation.vector.lerp(&end.translation.vector, share);
        Pose::from_parts(place.into(), start.rotation.slerp(&end.rotation, share))
    }

    /// Header of a recording that does not describe itself, from the names of its entities.
    fn header(&self) -> RunHeader {
        let part = |at: &EntityPath, k: usize| at.iter().nth(k).map(|part| part.unescaped_str().to_owned());
        let names = |parts: [&str; 3]| self.names.get(&entity(parts)).cloned().unwrap_or_default();
        let is_element =
            |at: &&EntityPath| part(at, 0).as_deref() == Some("plots") && part(at, 1).as_deref() == Some("elastic");
        let mut robots = self.poses.keys().filter(|at| part(at, 1).as_deref() == Some("flexible"));
        RunHeader {
            robot: robots.next().and_then(|at| part(at, 0)).unwrap_or_else(|| "robot".into()),
            trajectory: "unknown".into(),
            joints: names(["plots", "joints", "position"]),
            elements: self.scalars.keys().filter(is_element).filter_map(|at| part(at, 2)).collect(),
            has_rigid: self.scalars.contains_key(&entity(["plots", "tcp_error", "x"])),
            ..RunHeader::default()
        }
    }
}

/// The track of an entity; a new one has rows of `width` numbers.
fn track<'t>(tracks: &'t mut BTreeMap<EntityPath, Track>, at: &EntityPath, width: usize) -> &'t mut Track {
    tracks.entry(at.clone()).or_insert_with(|| Track::new(width))
}

/// Translation, then quaternion x, y, z, w.
fn pose(row: &[f64]) -> Pose {
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(row[6], row[3], row[4], row[5]));
    Pose::from_parts(Translation3::new(row[0], row[1], row[2]), rotation.to_rotation_matrix())
}
