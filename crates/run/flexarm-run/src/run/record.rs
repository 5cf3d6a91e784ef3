//! Constant parts of a run's recordings: header, meshes, files.
//!
//! Start at `recorders` (files and folder) and `header` (contents). Not here: samples (`sampler`),
//! formats (`flexarm-log`), the report (`report`).

use std::fs::{File, TryLockError};
use std::path::{Component, Path, PathBuf};

use flexarm_files::Undo;
use flexarm_kinematics::{Frame, JointKind, Model};
use flexarm_log::{Attachment, CreateOptions, LinkInfo, LinkMesh, Recorder, RecorderSet, RecordingFormat, RunHeader};
use flexarm_stepping::Plant;
use flexarm_urdf::Geometry;

use crate::arm::Arm;
use crate::arm::options::{Outputs, RunOptions};
use crate::error::{Error, RecordingError};
use crate::motions::motion::Motion;
use crate::motions::scenario::Scenario;
use crate::robot::Robot;
use crate::run::summary::Files;
use flexarm_settings::Words;
use flexarm_settings::written::{markdown, markdown_code, markdown_row};

/// Recorders of a run with the names of their files.
pub(crate) struct Recordings {
    pub(crate) set: RecorderSet,
    pub(crate) names: Files,
    /// Folders created for them.
    folders: Undo,
    /// Lock that reserves the folder for this run.
    lock: Option<FolderLock>,
}

impl Recordings {
    /// Creates the files. On failure no file and no newly created folder remains.
    pub(crate) fn begin(&mut self, header: &RunHeader) -> Result<(), Error> {
        self.set.begin(header)?;
        self.folders.keep();
        Ok(())
    }
}

/// Returns the names of the files that a run writes into its folder, recordings first.
pub(crate) fn files_of_a_run() -> impl Iterator<Item = &'static str> {
    let recordings = RecordingFormat::ALL.into_iter().map(|format| format.info().file_name);
    let pages = ["report.html", "report.md", "summary.json", STUDY_FILE, FIGURES_FOLDER, STRESS_PICTURE];
    recordings.chain(pages).chain(LAYOUT_FILES).chain([BAG_FILE])
}

/// Viewer layouts written next to `run.mcap`: Foxglove, PlotJuggler.
const LAYOUT_FILES: [&str; 2] = ["run.foxglove.json", "run.plotjuggler.xml"];

/// Makes the folder with `run.mcap` a bag of ROS 2.
const BAG_FILE: &str = "metadata.yaml";

/// Recording of all runs of a study.
pub(crate) const STUDY_FILE: &str = "study.rrd";

/// Picture of the stress of the links.
pub(crate) const STRESS_PICTURE: &str = "stress.png";

/// Folder for figures for papers, within the output folder.
pub(crate) const FIGURES_FOLDER: &str = "figures";

/// Returns an error if the folder contains files of an earlier run that may not be replaced;
/// ignores files named in `ours`.
pub(crate) fn refuse_to_overwrite(outputs: &Outputs, ours: &[&str]) -> Result<(), Error> {
    let files = files_of_a_run().filter(|file| !ours.contains(file));
    let mut files = files.map(|file| outputs.folder.join(file));
    match files.find(|path| path.exists()).filter(|_| !outputs.overwrite) {
        None => Ok(()),
        Some(path) => Err(Error::Taken { path, place: "folder", movable: true }),
    }
}

/// Removes files of an earlier run that this run does not overwrite, so that they are not mistaken
/// for its own.
fn remove_leftovers(outputs: &Outputs, ours: &[&str]) -> Result<(), Error> {
    for file in files_of_a_run().filter(|file| !ours.contains(file)) {
        let path = outputs.folder.join(file);
        // A run writes neither folders nor links under these names.
        if path.symlink_metadata().is_ok_and(|there| there.is_file()) {
            std::fs::remove_file(&path)
                .map_err(|e| Error::File { what: format!("is of an earlier run and cannot be removed: {e}"), path })?;
        }
    }
    remove_figures(&outputs.folder.join(FIGURES_FOLDER))
}

/// Removes the figures of an earlier run: drawings with a data file of the same name, and pictures
/// of the arm; removes the folder too if it is then empty.
fn remove_figures(folder: &Path) -> Result<(), Error> {
    if !folder.symlink_metadata().is_ok_and(|there| there.is_dir()) {
        return Ok(());
    }
    let fail = |e: std::io::Error| Error::File {
        path: folder.to_owned(),
        what: format!("holds figures of an earlier run that cannot be removed: {e}"),
    };
    let mut old: Vec<PathBuf> = vec![folder.join("arm_side.png"), folder.join("arm_oblique.png")];
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let drawing = entry.map_err(fail)?.path();
        let data = drawing.with_extension("csv");
        if drawing.extension().is_some_and(|ending| ending == "svg") && data.is_file() {
            old.extend([drawing, data]);
        }
    }
    for path in old.iter().filter(|path| path.symlink_metadata().is_ok_and(|there| there.is_file())) {
        std::fs::remove_file(path).map_err(fail)?;
    }
    // A folder that is not empty stays.
    let _ = std::fs::remove_dir(folder);
    Ok(())
}

/// Lock on an output folder, held by the run that writes into it. Has no effect on file systems
/// without locks.
pub(crate) struct FolderLock(#[expect(dead_code, reason = "the lock lasts as long as the open folder")] Option<File>);

impl FolderLock {
    /// Locks the folder; returns None if another run holds the lock.
    fn take(folder: &Path) -> Option<Self> {
        let opened = File::open(folder).ok();
        match opened.as_ref().map(File::try_lock) {
            Some(Err(TryLockError::WouldBlock)) => None,
            _ => Some(Self(opened)),
        }
    }
}

/// Returns a recorder for this format.
///
/// # Errors
/// [`RecordingError::WithoutFormat`] if this build does not support the format.
pub(crate) fn recorder(
    format: RecordingFormat,
    path: impl Into<PathBuf>,
    options: CreateOptions,
) -> Result<Box<dyn Recorder>, Error> {
    format.recorder(path, options).ok_or_else(|| RecordingError::WithoutFormat { format }.into())
}

/// Returns recorders for the outputs; refuses to overwrite before anything is created. `in_study`:
/// whether the recording of the study is being written too.
pub(crate) fn recorders(outputs: Option<&Outputs>, in_study: bool) -> Result<Recordings, Error> {
    let mut recordings =
        Recordings { set: RecorderSet::new(), names: Files::default(), folders: Undo::default(), lock: None };
    let Some(outputs) = outputs else { return Ok(recordings) };

    // Files of this run, one recorder for each format.
    let mut ours = vec!["report.html", "report.md", "summary.json"];
    ours.extend(outputs.recordings.iter().map(|format| format.info().file_name));
    ours.extend(in_study.then_some(STUDY_FILE));
    refuse_to_overwrite(outputs, if in_study { &[STUDY_FILE] } else { &[] })?;
    let options = CreateOptions::default().with_overwrite(outputs.overwrite);
    let path = |name: &str| outputs.folder.join(name);
    let text = |name: &str| Some(path(name).display().to_string());
    for &format in &outputs.recordings {
        let name = format.info().file_name;
        recordings.set.push(recorder(format, path(name), options)?);
        recordings.names.recordings.insert(format, path(name).display().to_string());
    }
    if outputs.recordings.contains(&RecordingFormat::Mcap) {
        [recordings.names.foxglove_layout, recordings.names.plotjuggler_layout] = LAYOUT_FILES.map(text);
    }
    recordings.names.report = text("report.html");
    recordings.names.report_md = text("report.md");
    if outputs.figures {
        recordings.names.figures = text(FIGURES_FOLDER);
    }

    // The folder, which no other run may use meanwhile.
    let unusable = |what: String| Error::File { path: outputs.folder.clone(), what };
    if outputs.folder.exists() && !outputs.folder.is_dir() {
        return Err(unusable(
            "is a file; the results need a folder: choose another place, or move the file away".into(),
        ));
    }
    // Old files are removed only after all new files have been found writable.
    recordings.set.check()?;
    recordings.folders.make(&outputs.folder).map_err(|e| unusable(format!("the output folder cannot be made: {e}")))?;
    let lock = FolderLock::take(&outputs.folder).ok_or_else(|| {
        unusable("another run is writing into this folder: wait for its end, or choose another folder".into())
    })?;
    recordings.lock = Some(lock);
    if outputs.overwrite {
        remove_leftovers(outputs, &ours)?;
    }
    Ok(recordings)
}

/// Writes viewer layouts for the MCAP recording, if there is one.
#[cfg(feature = "mcap")]
pub(crate) fn write_layouts(outputs: Option<&Outputs>, header: &RunHeader) -> Result<(), Error> {
    let Some(outputs) = outputs.filter(|outputs| outputs.recordings.contains(&RecordingFormat::Mcap)) else {
        return Ok(());
    };
    let [foxglove, plotjuggler] = LAYOUT_FILES.map(|name| outputs.folder.join(name));
    let layouts =
        [(foxglove, flexarm_log::foxglove_layout(header)), (plotjuggler, flexarm_log::plotjuggler_layout(header))];
    Ok(flexarm_files::write_all(&layouts)?)
}

/// Writes the file that makes the folder of the finished MCAP recording a bag of ROS 2.
#[cfg(feature = "mcap")]
pub(crate) fn write_bag_metadata(outputs: Option<&Outputs>) -> Result<(), Error> {
    let Some(outputs) = outputs.filter(|outputs| outputs.recordings.contains(&RecordingFormat::Mcap)) else {
        return Ok(());
    };
    // Not the path of the summary: as text it is another one if the folder's name is not text.
    let path = outputs.folder.join(RecordingFormat::Mcap.info().file_name);
    let metadata = flexarm_log::rosbag2_metadata(&path)?;
    let file = metadata.map(|text| (path.with_file_name(BAG_FILE), text));
    Ok(flexarm_files::write_all(&Vec::from_iter(file))?)
}

/// Without the feature `mcap` there is no bag.
#[cfg(not(feature = "mcap"))]
pub(crate) fn write_bag_metadata(_: Option<&Outputs>) -> Result<(), Error> {
    Ok(())
}

/// Without the feature `mcap` there are no layouts.
#[cfg(not(feature = "mcap"))]
pub(crate) fn write_layouts(_: Option<&Outputs>, _: &RunHeader) -> Result<(), Error> {
    Ok(())
}

/// Returns the links of the URDF, parents before children.
pub(crate) fn ordered_links(robot: &Robot) -> Vec<LinkInfo> {
    let mechanism = &robot.urdf.mechanism;
    let base = mechanism.links.iter().find(|l| mechanism.joints.iter().all(|j| j.child != l.name));
    let mut links: Vec<LinkInfo> =
        base.iter().map(|l| LinkInfo { name: l.name.clone(), parent: None, fixed: !robot.is_mounted() }).collect();
    let mut next = 0;
    while next < links.len() {
        let name = links[next].name.clone();
        links.extend(mechanism.child_joints(&name).map(|j| LinkInfo {
            name: j.child.clone(),
            parent: Some(next),
            // A fixed joint at the far end of a flexible link moves relative to the link's frame.
            fixed: j.kind == JointKind::Fixed
                && robot.flexible_links.iter().all(|f| f.flexible.link != name)
                && !(next == 0 && robot.is_mounted()),
        }));
        next += 1;
    }
    links
}

/// Returns the frames of the URDF's links in the model, in the order of the header.
pub fn link_frames(robot: &Robot, model: &Model) -> Vec<Frame> {
    let links = ordered_links(robot);
    links.iter().map(|l| model.frame(&l.name).expect("all links are frames").clone()).collect()
}

/// Label of a model choice left to the robot file.
const AS_FILED: &str = "as the robot file says";

/// Formats a path without `folder/..`. Does not access the file system, so the result does not
/// depend on the machine.
pub fn straight(path: &Path) -> String {
    let mut parts: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            (Component::ParentDir, Some(Component::Normal(_))) => {
                parts.pop();
            }
            _ => parts.push(part),
        }
    }
    parts.iter().collect::<PathBuf>().display().to_string()
}

/// Builds the header of a run: everything that does not change over time.
pub(crate) fn header(arm: &Arm, scenario: &Scenario, options: &RunOptions, plant: &Plant) -> RunHeader {
    let (robot, links_model) = (arm.robot(), arm.links_model());
    let frequencies: Vec<String> = plant.modes.frequencies_hz().iter().map(|f| format!("{f:.4}")).collect();
    RunHeader {
        trajectory: scenario.motion.name.clone(),
        metadata: metadata(arm, scenario, options, plant, &frequencies),
        description: description(robot, &scenario.motion, options, links_model, &frequencies),
        has_rigid: options.with_twin,
        log_rate_hz: options.log_rate_hz,
        step_s: options.step_s,
        start_ns: options.start_ns,
        urdf: located_urdf(robot, options.embed_meshes),
        ..robot_header(robot, plant)
    }
}

/// Settings and inputs of the run, in groups of key-value pairs.
fn metadata(
    arm: &Arm,
    scenario: &Scenario,
    options: &RunOptions,
    plant: &Plant,
    frequencies: &[String],
) -> Vec<(String, Vec<(String, String)>)> {
    let robot = arm.robot();
    let motion = &scenario.motion;
    let group = |name: &str, rows: &[(&str, String)]| {
        (name.to_owned(), rows.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect::<Vec<_>>())
    };
    let stepper = crate::run::summary::StepperFigures::new(options, Default::default());
    let elements: Vec<String> = plant.elements.iter().map(|e| e.name.clone()).collect();
    let methods: Vec<String> = robot
        .flexible_links
        .iter()
        .map(|f| format!("{}: {}", f.flexible.link, f.flexible.reduced.provenance.method))
        .collect();

    // Paths of the input, as given; settings that are left to the robot file say so.
    let mut inputs = vec![
        ("robot_file", straight(&robot.path)),
        ("urdf_file", straight(&robot.urdf_path)),
        ("trajectory_file", straight(&motion.path)),
    ];
    inputs.extend(scenario.loads_file.as_ref().map(|path| ("loads_file", straight(path))));
    let drives = arm.modelling().drives.word().unwrap_or(AS_FILED);
    let links_choice = arm.modelling().links.word().unwrap_or(AS_FILED);
    let mut run = vec![
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("robot", robot.name.clone()),
        ("trajectory", motion.name.clone()),
        ("stepper", stepper.name.clone()),
        ("step_s", options.step_s.to_string()),
        ("start", format!("{:?}", scenario.start).to_lowercase()),
        ("log_rate_hz", options.log_rate_hz.to_string()),
        ("settling_band_m", options.settling_band_m.to_string()),
    ];
    run.extend(stepper.settings.0.iter().map(|(key, value)| (key.as_str(), value.to_string())));
    vec![
        group("flexarm.run", &run),
        group(
            "flexarm.model",
            &[
                ("links", arm.links_model().into()),
                ("links_choice", links_choice.into()),
                ("drives", drives.into()),
                ("elements", elements.join(", ")),
                ("payload_kg", robot.payload_kg().to_string()),
                ("reduction", methods.join("; ")),
                ("frequencies_hz", frequencies.join(", ")),
            ],
        ),
        group("flexarm.inputs", &inputs),
    ]
}

/// Header with the links and the names of the signals.
pub(crate) fn signals(robot: &Robot, plant: &Plant) -> RunHeader {
    RunHeader { links: ordered_links(robot), ..names_of_signals(robot, plant) }
}

/// Header with the names of joints, springs and TCP, used for column names.
pub(crate) fn names_of_signals(robot: &Robot, plant: &Plant) -> RunHeader {
    let actuated = &plant.model.coordinates()[..plant.model.n_actuated()];
    RunHeader {
        robot: robot.name.clone(),
        joints: actuated.iter().map(|c| c.joint.clone()).collect(),
        prismatic: actuated.iter().map(|c| c.slides()).collect(),
        elements: plant.elements.iter().map(|e| e.name.clone()).collect(),
        tcp: robot.tcp.0.clone(),
        ..RunHeader::default()
    }
}

/// Header without the data of a particular run.
pub fn robot_header(robot: &Robot, plant: &Plant) -> RunHeader {
    let header = signals(robot, plant);
    let read = |name: &str, media_type: &str, path: &std::path::Path| {
        std::fs::read(path).ok().map(|bytes| Attachment { name: name.into(), media_type: media_type.into(), bytes })
    };
    let mut attachments: Vec<Attachment> = Vec::new();
    if robot.path != robot.urdf_path {
        attachments.extend(read("robot.toml", "application/toml", &robot.path));
    }
    // The recorder attaches the mesh files of visuals; those of collision shapes are attached here.
    let drawn = |path: &Path| {
        robot.urdf.visuals.iter().any(|v| matches!(&v.geometry, Geometry::Mesh { path: Some(p), .. } if p == path))
    };
    for (k, (_, path)) in robot.urdf.mesh_files.iter().filter(|(_, path)| !drawn(path)).enumerate() {
        let file = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        attachments.extend(read(&format!("collision/{k}/{file}"), flexarm_log::mesh_media_type(path), path));
    }
    RunHeader { urdf: located_urdf(robot, false), meshes: meshes(robot, &header.links), attachments, ..header }
}

/// Returns the URDF with all meshes found, of visuals and collision shapes, as `file://`
/// references, so that viewers find them without knowing the robot's folder; with `embed`, as
/// `data:` references that contain them.
fn located_urdf(robot: &Robot, embed: bool) -> String {
    use base64::Engine as _;
    let mut text = robot.urdf.text.clone();
    for (reference, path) in &robot.urdf.mesh_files {
        let embedded = || {
            let data = base64::engine::general_purpose::STANDARD.encode(std::fs::read(path).ok()?);
            Some(format!("data:{};base64,{data}", flexarm_log::mesh_media_type(path)))
        };
        let located = || Some(format!("file://{}", path.canonicalize().ok()?.display()));
        if let Some(new) = embed.then(embedded).flatten().or_else(located) {
            text = text.replace(&format!("\"{reference}\""), &format!("\"{new}\""));
            text = text.replace(&format!("'{reference}'"), &format!("'{new}'"));
        }
    }
    text
}

/// Returns a summary of the set-up as Markdown.
fn description(
    robot: &Robot,
    motion: &Motion,
    options: &RunOptions,
    links_model: &str,
    frequencies: &[String],
) -> String {
    let mut text = format!(
        "# {} on {}\n\nFlexible arm (solid) against its rigid twin (ghost), TCP {}.\n\n| | |\n|---|---|\n\
         | duration | {:.3} s |\n| stepper | {}, step {} s |\n| links | {} |\n",
        markdown(&robot.name),
        markdown(&motion.name),
        markdown_code(&robot.tcp.0),
        motion.trajectory.duration(),
        options.stepper.name(),
        options.step_s,
        links_model,
    );
    for f in robot.flexible_links.iter().map(|f| &f.flexible) {
        text += &markdown_row(&["flexible link", &format!("{}: {}", f.link, f.reduced.provenance.method)]);
    }
    if !frequencies.is_empty() {
        text += &format!("| first frequencies | {} Hz |\n", frequencies[..frequencies.len().min(3)].join(", "));
    }
    text
}

/// Visuals as triangles in link axes; skips those that cannot be read (the URDF reader warns).
fn meshes(robot: &Robot, links: &[LinkInfo]) -> Vec<LinkMesh> {
    let mut meshes = Vec::new();
    for (i, visual) in robot.urdf.visuals.iter().enumerate() {
        let Some(link) = links.iter().position(|l| l.name == visual.link) else { continue };
        let Ok(mesh) = visual.geometry.triangles() else { continue };
        let file = match &visual.geometry {
            Geometry::Mesh { path, .. } => path.clone(),
            _ => None,
        };
        let color = visual.color.or(mesh.color).unwrap_or([0.75, 0.75, 0.78, 1.0]);
        let moved = mesh.transformed(&visual.X_LV);
        let own_normals = moved.normals.is_some();
        let mesh = LinkMesh {
            link,
            name: visual.name.clone().unwrap_or_else(|| format!("visual_{i}")),
            positions: moved.positions,
            normals: moved.normals.unwrap_or_default(),
            triangles: moved.triangles,
            color,
            file,
        };
        let mut mesh = if own_normals { mesh } else { mesh.with_creases() };
        // Two visuals of a link may have the same name.
        let named = |name: &str| meshes.iter().any(|other: &LinkMesh| other.link == link && other.name == name);
        if named(&mesh.name) {
            mesh.name = (2..).map(|n| format!("{}_{n}", mesh.name)).find(|name| !named(name)).unwrap_or_default();
        }
        meshes.push(mesh);
    }
    meshes
}
