//! A run's header as JSON, and its triangles as one compressed block: data without a topic in a
//! recording.
//!
//! `run.json` is a stable format: keys are added, not renamed. It has all of a [`RunHeader`] except
//! the URDF, which recordings contain unchanged, and the vertices of meshes, which are in
//! `meshes.bin.zst`. Start at [`write`] and [`read`].
//! Not here: messages and tables ([`crate::mcap_file`], [`crate::described_table`]).

use flexarm_kinematics::Pose;
use nalgebra::{Matrix3, Rotation3, Translation3};
use serde::{Deserialize, Serialize};

use crate::{Attachment, BendInfo, Event, EventKind, LinkInfo, RunHeader, RunResult, Scenery};

/// Name of the header in a recording.
pub(crate) const RUN_JSON: &str = "run.json";
/// Name of the result in a recording.
#[allow(dead_code, reason = "not every format has it")]
pub(crate) const RESULT_JSON: &str = "result.json";
/// Media type of both files.
#[allow(dead_code, reason = "not every format has it")]
pub(crate) const JSON: &str = "application/json";

/// Version of the format; a reader refuses later ones.
const FORMAT: u32 = 1;

#[derive(Debug, Serialize, Deserialize)]
struct RunJson {
    /// First in the file, for human readers.
    format: u32,
    robot: String,
    trajectory: String,
    tcp: String,
    joints: Vec<String>,
    prismatic: Vec<bool>,
    links: Vec<Link>,
    elements: Vec<String>,
    contributors: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    gauges: Vec<String>,
    bends: Vec<Bend>,
    has_rigid: bool,
    /// Missing in files of older versions.
    #[serde(default)]
    has_static: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    has_stress: bool,
    log_rate_hz: f64,
    step_s: f64,
    /// Missing in files of older versions.
    #[serde(default)]
    captions: Vec<(f64, String)>,
    /// Left out if it is [`crate::START_NS`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    start_ns: Option<u64>,
    magnification: f64,
    color_scale_m: f64,
    volume: Option<[[f64; 3]; 2]>,
    description: String,
    /// Groups of key-value pairs, in their order.
    metadata: Vec<(String, Vec<(String, String)>)>,
    /// Names of the attached files, except those of the recorder itself.
    attachments: Vec<String>,
    /// Meshes in the order of `meshes.bin.zst`.
    meshes: Vec<MeshEntry>,
}

#[derive(Debug, Serialize, Deserialize)]
struct Link {
    name: String,
    parent: Option<usize>,
    fixed: bool,
}

#[derive(Debug, Serialize, Deserialize)]
struct Bend {
    link: usize,
    /// Translation (m), then the nine entries of the rotation matrix, row by row.
    stations: Vec<[f64; 12]>,
    carries: Vec<(usize, usize)>,
}

/// A mesh without its vertices and triangles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct MeshEntry {
    pub(crate) link: usize,
    pub(crate) name: String,
    pub(crate) color: [f32; 4],
    pub(crate) corners: usize,
    pub(crate) triangles: usize,
}

/// Returns the header as JSON text. `meshes`: whether to list its meshes and the surfaces of the
/// result, that is whether they are stored beside it.
pub(crate) fn write(header: &RunHeader, meshes: bool) -> String {
    // Parts that differ from those of the header.
    let entry = |mesh: &crate::LinkMesh| MeshEntry {
        link: mesh.link,
        name: mesh.name.clone(),
        color: mesh.color,
        corners: mesh.positions.len(),
        triangles: mesh.triangles.len(),
    };
    let link = |link: &LinkInfo| Link { name: link.name.clone(), parent: link.parent, fixed: link.fixed };
    let bend = |bend: &BendInfo| Bend {
        link: bend.link,
        stations: bend.X_LS.iter().map(numbers).collect(),
        carries: bend.carries.clone(),
    };
    let run = RunJson {
        format: FORMAT,
        robot: header.robot.clone(),
        trajectory: header.trajectory.clone(),
        tcp: header.tcp.clone(),
        joints: header.joints.clone(),
        prismatic: header.prismatic.clone(),
        links: header.links.iter().map(link).collect(),
        elements: header.elements.clone(),
        contributors: header.contributors.clone(),
        gauges: header.gauges.clone(),
        bends: header.bends.iter().map(bend).collect(),
        has_rigid: header.has_rigid,
        has_static: header.has_static,
        has_stress: header.has_stress && meshes,
        log_rate_hz: header.log_rate_hz,
        step_s: header.step_s,
        captions: header.captions.iter().map(|caption| (caption.from_s, caption.text.clone())).collect(),
        start_ns: header.start_ns.filter(|start| *start != crate::START_NS),
        magnification: header.magnification,
        color_scale_m: header.color_scale_m,
        volume: header.volume,
        description: header.description.clone(),
        metadata: header.metadata.clone(),
        attachments: header.attachments.iter().map(|file| file.name.clone()).collect(),
        meshes: if meshes { header.meshes.iter().map(entry).collect() } else { Vec::new() },
    };
    serde_json::to_string(&run).expect("names, texts and numbers are JSON")
}

/// Returns the files that make an MCAP file readable again: the header, and the meshes if there are
/// any.
#[cfg(feature = "mcap")]
pub(crate) fn files(header: &RunHeader) -> std::io::Result<Vec<crate::Attachment>> {
    let file = |name: &str, media_type: &str, bytes| crate::Attachment {
        name: name.into(),
        media_type: media_type.into(),
        bytes,
    };
    let mut files = vec![file(RUN_JSON, JSON, write(header, true).into_bytes())];
    if !header.meshes.is_empty() {
        files.push(file(meshes::FILE, meshes::MEDIA_TYPE, meshes::write(&header.meshes)?));
    }
    Ok(files)
}

/// Fault in the text of a header.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RunJsonError {
    #[error("{RUN_JSON} cannot be read: {0}")]
    NotAHeader(serde_json::Error),
    #[error("{RUN_JSON} has format {found}, this program reads up to {FORMAT}")]
    LaterFormat { found: u32 },
    #[error("{RUN_JSON} names links that it does not have")]
    UnknownLink,
}

/// Reads the header, without URDF, attached files and meshes, which the caller adds; also returns
/// the names of the attached files and the list of meshes.
pub(crate) fn read(text: &[u8]) -> Result<(RunHeader, Vec<String>, Vec<MeshEntry>), RunJsonError> {
    let run: RunJson = serde_json::from_slice(text).map_err(RunJsonError::NotAHeader)?;
    if run.format > FORMAT {
        return Err(RunJsonError::LaterFormat { found: run.format });
    }
    // Every index of a link must exist, and a parent must precede its children.
    let links = run.links.len();
    let parents_first = run.links.iter().enumerate().all(|(k, link)| link.parent.is_none_or(|parent| parent < k));
    let in_range = run.meshes.iter().all(|mesh| mesh.link < links)
        && run.bends.iter().all(|bend| {
            bend.link < links && bend.carries.iter().all(|&(link, k)| link < links && k < bend.stations.len())
        });
    if !parents_first || !in_range {
        return Err(RunJsonError::UnknownLink);
    }
    let bend = |bend: Bend| BendInfo {
        link: bend.link,
        X_LS: bend.stations.iter().map(pose).collect(),
        carries: bend.carries,
    };
    let header = RunHeader {
        robot: run.robot,
        trajectory: run.trajectory,
        tcp: run.tcp,
        joints: run.joints,
        prismatic: run.prismatic,
        links: run
            .links
            .into_iter()
            .map(|link| LinkInfo { name: link.name, parent: link.parent, fixed: link.fixed })
            .collect(),
        elements: run.elements,
        contributors: run.contributors,
        gauges: run.gauges,
        bends: run.bends.into_iter().map(bend).collect(),
        has_rigid: run.has_rigid,
        has_static: run.has_static,
        has_stress: run.has_stress,
        log_rate_hz: run.log_rate_hz,
        step_s: run.step_s,
        captions: run.captions.into_iter().map(|(from_s, text)| crate::Caption { from_s, text }).collect(),
        start_ns: run.start_ns,
        magnification: run.magnification,
        color_scale_m: run.color_scale_m,
        volume: run.volume,
        description: run.description,
        metadata: run.metadata,
        ..RunHeader::default()
    };
    Ok((header, run.attachments, run.meshes))
}

#[derive(Debug, Serialize, Deserialize)]
struct ResultJson {
    format: u32,
    /// Label and value, in their order.
    figures: Vec<(String, String)>,
    /// Label and value for human readers.
    readable: Vec<(String, String)>,
    /// Time (s), kind, text.
    events: Vec<(f64, String, String)>,
    /// Name, media type and text of the attached text files.
    files: Vec<(String, String, String)>,
    /// Objects of pictures, such as the links coloured by stress; in MCAP files alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    scenery: Vec<Scenery>,
}

/// Returns the file with the result for the end of an MCAP file; attached files are in it
/// separately.
#[cfg(feature = "mcap")]
pub(crate) fn result_file(result: &RunResult) -> Attachment {
    let text = write_result(&RunResult { attachments: Vec::new(), ..result.clone() });
    Attachment { name: RESULT_JSON.into(), media_type: JSON.into(), bytes: text.into_bytes() }
}

/// Returns the result as JSON text. Attached files that are not text are left out.
pub(crate) fn write_result(result: &RunResult) -> String {
    let event = |event: &Event| (event.time_s, event.kind.word().to_owned(), event.text.clone());
    let file = |file: &Attachment| {
        let text = String::from_utf8(file.bytes.clone()).ok()?;
        Some((file.name.clone(), file.media_type.clone(), text))
    };
    let result = ResultJson {
        format: FORMAT,
        figures: result.figures.clone(),
        readable: result.readable.clone(),
        events: result.events.iter().map(event).collect(),
        files: result.attachments.iter().filter_map(file).collect(),
        scenery: result.scenery.clone(),
    };
    serde_json::to_string(&result).expect("names, texts and numbers are JSON")
}

/// Reads a result from JSON text. Missing parts are empty; events of unknown kinds are left out.
pub(crate) fn read_result(text: &str) -> RunResult {
    let Ok(result) = serde_json::from_str::<ResultJson>(text) else { return RunResult::default() };
    let event =
        |(time_s, kind, text): (f64, String, String)| Some(Event { time_s, kind: EventKind::from_word(&kind)?, text });
    let file =
        |(name, media_type, text): (String, String, String)| Attachment { name, media_type, bytes: text.into_bytes() };
    RunResult {
        figures: result.figures,
        readable: result.readable,
        events: result.events.into_iter().filter_map(event).collect(),
        attachments: result.files.into_iter().map(file).collect(),
        scenery: result.scenery,
    }
}

/// Translation (m), then the rotation matrix row by row.
fn numbers(X: &Pose) -> [f64; 12] {
    let rotation = X.rotation.matrix();
    std::array::from_fn(|k| match k {
        0..3 => X.translation.vector[k],
        _ => rotation[((k - 3) / 3, (k - 3) % 3)],
    })
}

fn pose(numbers: &[f64; 12]) -> Pose {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&numbers[3..]));
    Pose::from_parts(Translation3::new(numbers[0], numbers[1], numbers[2]), rotation)
}

#[cfg(feature = "mcap")]
pub(crate) mod meshes {
    //! Block of the triangles of all meshes, one mesh after the other: vertices, normals (three
    //! `f32` each), triangles (three `u32` each), little endian; compressed with zstd, except in
    //! WebAssembly, which is built without C.

    use super::MeshEntry;
    use crate::LinkMesh;

    /// Name of the compressed block, and of the plain one.
    const NAMES: [&str; 2] = ["meshes.bin.zst", "meshes.bin"];
    /// Name and media type of a block as [`write`] makes it.
    pub(crate) const FILE: &str = NAMES[cfg!(target_family = "wasm") as usize];
    pub(crate) const MEDIA_TYPE: &str =
        ["application/zstd", "application/octet-stream"][cfg!(target_family = "wasm") as usize];
    /// First bytes of zstd data; as a coordinate they would be -1.5e37.
    const ZSTD_MAGIC: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];

    /// Whether a file of a recording is such a block.
    pub(crate) fn is_block(name: &str) -> bool {
        NAMES.contains(&name)
    }

    /// Level of zstd. Surfaces of an arm take a sixth more space than with level 9, whose search
    /// took a sixth of the start-up time of an MCAP file.
    #[cfg(not(target_family = "wasm"))]
    const LEVEL: i32 = 1;

    #[cfg(not(target_family = "wasm"))]
    fn pack(bytes: Vec<u8>) -> std::io::Result<Vec<u8>> {
        zstd::bulk::compress(&bytes, LEVEL)
    }

    #[cfg(target_family = "wasm")]
    fn pack(bytes: Vec<u8>) -> std::io::Result<Vec<u8>> {
        Ok(bytes)
    }

    /// Decompresses a block of `total` bytes.
    #[cfg(not(target_family = "wasm"))]
    fn unpack(block: &[u8], total: usize) -> std::io::Result<Vec<u8>> {
        zstd::bulk::decompress(block, total)
    }

    #[cfg(target_family = "wasm")]
    fn unpack(_: &[u8], _: usize) -> std::io::Result<Vec<u8>> {
        Err(std::io::Error::other("zstd cannot be read here"))
    }

    pub(crate) fn write(meshes: &[LinkMesh]) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        for mesh in meshes {
            // Missing normals are written as zeros, so that the counts determine the size of the
            // block.
            let normals = (0..mesh.positions.len()).map(|k| mesh.normals.get(k).copied().unwrap_or_default());
            let floats = mesh.positions.iter().copied().chain(normals).flatten();
            floats.for_each(|value| bytes.extend(value.to_le_bytes()));
            mesh.triangles.iter().flatten().for_each(|corner| bytes.extend(corner.to_le_bytes()));
        }
        pack(bytes)
    }

    /// Fault in a block.
    #[derive(Debug, thiserror::Error)]
    pub(crate) enum BlockError {
        #[error("its counts of corners are too large")]
        Counts,
        #[error(transparent)]
        Unpack(#[from] std::io::Error),
        #[error("it has {found} bytes, the list of meshes requires {expected}")]
        Length { found: usize, expected: usize },
        #[error("a triangle of mesh {mesh:?} has a corner that is not there")]
        NoCorner { mesh: String },
    }

    /// Reads the meshes described by `entries`.
    pub(crate) fn read(block: &[u8], entries: &[MeshEntry]) -> Result<Vec<LinkMesh>, BlockError> {
        let size = |entry: &MeshEntry| entry.corners.checked_mul(24)?.checked_add(entry.triangles.checked_mul(12)?);
        let total = entries.iter().try_fold(0_usize, |sum, entry| sum.checked_add(size(entry)?));
        // Limit the allocation: no block compresses by a factor of more than 100,000.
        let total = total.filter(|total| *total / 100_000 <= block.len()).ok_or(BlockError::Counts)?;
        let bytes = match block.starts_with(&ZSTD_MAGIC) {
            true => unpack(block, total)?,
            false => block.to_vec(),
        };
        if bytes.len() != total {
            return Err(BlockError::Length { found: bytes.len(), expected: total });
        }
        let mut words = bytes.chunks_exact(4).map(|word| [word[0], word[1], word[2], word[3]]);
        let mut word = || words.next().unwrap_or_default();
        let mut meshes = Vec::new();
        for entry in entries {
            let mut triples = |count: usize| (0..count).map(|_| [word(), word(), word()]).collect::<Vec<_>>();
            let float = |triple: [[u8; 4]; 3]| triple.map(f32::from_le_bytes);
            let positions = triples(entry.corners).into_iter().map(float).collect();
            let normals = triples(entry.corners).into_iter().map(float).collect();
            let triangles: Vec<[u32; 3]> =
                triples(entry.triangles).into_iter().map(|triple| triple.map(u32::from_le_bytes)).collect();
            if triangles.iter().flatten().any(|corner| *corner as usize >= entry.corners) {
                return Err(BlockError::NoCorner { mesh: entry.name.clone() });
            }
            let (link, name, color) = (entry.link, entry.name.clone(), entry.color);
            meshes.push(LinkMesh { link, name, positions, normals, triangles, color, file: None });
        }
        Ok(meshes)
    }
}
