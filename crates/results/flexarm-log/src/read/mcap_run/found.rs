//! Data stored once in an MCAP file: names, set-up, attached files, result.
//!
//! Start at [`FileContents::take`], which gets every record, and [`FileContents::header`].
//! Not here: samples ([`super::assembly`]), the text of the header ([`crate::run_json`]).

use std::collections::BTreeMap;
use std::path::Path;

use mcap::records::Record;

use crate::read::{not_a_recording, stem};
use crate::run_json::{self, RESULT_JSON, RUN_JSON, meshes};
use crate::{Attachment, LogError, RunHeader};

/// Name of the attached URDF.
const URDF: &str = "robot.urdf";
/// Metadata groups written by the recorder itself.
const OWN_GROUPS: [&str; 4] = ["flexarm.recording", "flexarm.units", "flexarm.result", "rosbag2"];

/// Contents of a file other than its samples.
#[derive(Default)]
pub(super) struct FileContents {
    library: String,
    topics: BTreeMap<u16, String>,
    pub(super) metadata: Vec<(String, BTreeMap<String, String>)>,
    run: Option<Vec<u8>>,
    pub(super) result: Option<Vec<u8>>,
    mesh_block: Option<Vec<u8>>,
    urdf: Option<Vec<u8>>,
    /// Attached files without a field above.
    pub(super) files: Vec<Attachment>,
    /// Whether the index, which is written last, is present.
    pub(super) whole: bool,
    /// Number of samples found so far; reading stops at two.
    pub(super) samples: u32,
    sequence: Option<u32>,
}

impl FileContents {
    /// Takes what a record says about the whole recording; counts the samples by the messages of
    /// `/tf`.
    pub(super) fn take(&mut self, record: Record<'_>) {
        match record {
            Record::Header(header) => self.library = header.library,
            Record::Channel(channel) => {
                self.topics.insert(channel.id, channel.topic);
            }
            Record::Footer(footer) => self.whole |= footer.summary_start > 0,
            Record::Metadata(group) => self.metadata.push((group.name, group.metadata)),
            Record::Attachment { header, data, .. } => {
                let bytes = data.into_owned();
                // Files that a run has by name; the first of each counts.
                let own = match header.name.as_str() {
                    RUN_JSON => Some(&mut self.run),
                    RESULT_JSON => Some(&mut self.result),
                    name if meshes::is_block(name) => Some(&mut self.mesh_block),
                    URDF => Some(&mut self.urdf),
                    _ => None,
                };
                match own {
                    Some(place) if place.is_none() => *place = Some(bytes),
                    _ => self.files.push(Attachment { name: header.name, media_type: header.media_type, bytes }),
                }
            }
            Record::Message { header, .. }
                if self.sequence != Some(header.sequence)
                    && self.topics.get(&header.channel_id).is_some_and(|topic| topic == "/tf") =>
            {
                (self.sequence, self.samples) = (Some(header.sequence), self.samples + 1);
            }
            _ => {}
        }
    }

    pub(super) fn recording(&self, key: &str) -> Option<&str> {
        let group = self.metadata.iter().find(|(name, _)| name == OWN_GROUPS[0]);
        group.and_then(|(_, pairs)| pairs.get(key)).map(String::as_str)
    }

    /// Returns the header, the number of attached files that belong to it, and a list of missing
    /// parts.
    pub(super) fn header(
        &mut self,
        path: &Path,
        broken: Option<&str>,
    ) -> Result<(RunHeader, usize, Vec<String>), LogError> {
        let cut = |cause: Option<&str>| {
            let cause = cause.unwrap_or("its end is missing");
            let found = format!("an MCAP file that breaks off before it says which run it is ({cause})");
            not_a_recording(path, found, "one with the description of a run")
        };
        if self.recording("robot").is_none() {
            if broken.is_some() || self.library.is_empty() || self.library.starts_with("flexarm") {
                return Err(cut(broken));
            }
            let topics: Vec<&str> = self.topics.values().map(String::as_str).take(5).collect();
            let found = format!("an MCAP file of {:?} with the topics {}", self.library, topics.join(", "));
            return Err(not_a_recording(path, found, "one that flexarm wrote (metadata flexarm.recording)"));
        }
        let Some(run) = &self.run else {
            return if self.samples == 0 { Err(cut(broken)) } else { Ok(self.plain_header(path)) };
        };
        let damaged = |what: String| not_a_recording(path, what, "the description of a run");
        let (mut header, attached, mesh_list) = run_json::read(run).map_err(|error| damaged(error.to_string()))?;
        let mut missing = Vec::new();
        header.urdf = String::from_utf8_lossy(self.urdf.as_deref().unwrap_or_default()).into_owned();
        match &self.mesh_block {
            Some(block) => {
                let what = |error| damaged(format!("{}: {error}", meshes::FILE));
                header.meshes = meshes::read(block, &mesh_list).map_err(what)?;
            }
            None if mesh_list.is_empty() => {}
            None => missing.push("the file breaks off before the surfaces of the links".to_owned()),
        }
        // Mesh files stay attached; their triangles are in the mesh block.
        let mesh_file = |file: &Attachment| file.name.starts_with("meshes/") && !attached.contains(&file.name);
        let mesh_files = self.files.iter().take_while(|file| mesh_file(file)).count();
        let count = (mesh_files + attached.len()).min(self.files.len());
        header.attachments = self.files[..count].to_vec();
        Ok((header, count, missing))
    }

    /// Builds a header from the metadata only: without link poses and surfaces.
    fn plain_header(&self, path: &Path) -> (RunHeader, usize, Vec<String>) {
        let text = |key: &str| self.recording(key).unwrap_or_default().to_owned();
        let list = |key: &str| text(key).split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect();
        let robot = if text("robot").is_empty() { stem(path) } else { text("robot") };
        let groups = self.metadata.iter().filter(|(name, _)| !OWN_GROUPS.contains(&name.as_str()));
        let header = RunHeader {
            robot,
            trajectory: text("trajectory"),
            tcp: text("tcp"),
            joints: list("joints"),
            elements: list("elements"),
            log_rate_hz: text("log_rate_hz").parse().unwrap_or(0.0),
            has_rigid: self.topics.values().any(|topic| topic == "/tcp/rigid"),
            has_static: self.topics.values().any(|topic| topic == "/tcp/static_error"),
            urdf: String::from_utf8_lossy(self.urdf.as_deref().unwrap_or_default()).into_owned(),
            metadata: groups.map(|(name, pairs)| (name.clone(), pairs.clone().into_iter().collect())).collect(),
            ..RunHeader::default()
        };
        (header, 0, vec![format!("the file has no {RUN_JSON}: it gives numbers, but no picture of the arm")])
    }
}
