//! Metadata of a bag of ROS 2: the record `rosbag2` in the file, and the file `metadata.yaml` of a
//! folder.
//!
//! The form is version 5 of rosbag2's metadata, which all its releases since Humble read. It is
//! written as JSON, which is YAML.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::{Record, op};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader};
use mcap::{McapError, McapResult, Summary};
use serde_json::{Value, json};

use crate::LogError;

/// Name of the record, and the key of its text.
const RECORD: &str = "rosbag2";
const TEXT: &str = "serialized_metadata";
/// Bytes of a record's opcode and length.
const RECORD_HEAD: usize = 9;

/// Topics and times of a bag that is being written.
#[derive(Default)]
pub(crate) struct Bag {
    topics: Vec<Topic>,
    /// Times of the first and the last message (ns).
    span: Option<(u64, u64)>,
}

struct Topic {
    name: String,
    kind: String,
    quality_of_service: String,
    messages: u64,
}

impl Bag {
    /// Adds a topic; channels are numbered in this order, from 1.
    pub(crate) fn add(&mut self, name: &str, kind: &str, quality_of_service: &str) {
        let [name, kind, quality_of_service] = [name, kind, quality_of_service].map(str::to_owned);
        self.topics.push(Topic { name, kind, quality_of_service, messages: 0 });
    }

    pub(crate) fn count(&mut self, channel: u16, time_ns: u64) {
        self.topics[usize::from(channel) - 1].messages += 1;
        let (first, last) = self.span.unwrap_or((time_ns, time_ns));
        self.span = Some((first.min(time_ns), last.max(time_ns)));
    }

    /// Returns the record. The name of the file, on which its bytes must not depend, is left open:
    /// readers of the file know it.
    pub(crate) fn record(&self) -> mcap::records::Metadata {
        let (first, last) = self.span.unwrap_or_default();
        let count: u64 = self.topics.iter().map(|topic| topic.messages).sum();
        let start = json!({ "nanoseconds_since_epoch": first });
        let duration = json!({ "nanoseconds": last - first });
        let topic = |topic: &Topic| {
            json!({
                "topic_metadata": {
                    "name": topic.name, "type": topic.kind, "serialization_format": "cdr",
                    "offered_qos_profiles": topic.quality_of_service,
                },
                "message_count": topic.messages,
            })
        };
        let text = json!({
            "version": 5, "storage_identifier": "mcap", "relative_file_paths": [""],
            "starting_time": start, "duration": duration, "message_count": count,
            "topics_with_message_count": self.topics.iter().map(topic).collect::<Vec<_>>(),
            "compression_format": "", "compression_mode": "",
            "files": [{ "path": "", "starting_time": start, "duration": duration, "message_count": count }],
        });
        mcap::records::Metadata { name: RECORD.into(), metadata: BTreeMap::from([(TEXT.into(), text.to_string())]) }
    }
}

/// Returns the contents of the file `metadata.yaml` that makes the folder of an MCAP file a bag of
/// ROS 2; `None` if the file is not one that [`McapRecorder`](crate::McapRecorder) finished.
///
/// # Errors
/// [`LogError::Io`] if the file cannot be read.
pub fn rosbag2_metadata(path: &Path) -> Result<Option<String>, LogError> {
    let error = LogError::io(path, "read the recording");
    let text = File::open(path).map_err(McapError::from).and_then(|mut file| bag_text(&mut file));
    let text = match text {
        Err(McapError::Io(cause)) => return Err(error(cause)),
        text => text.ok().flatten(),
    };
    let Some(Ok(mut bag)) = text.map(|text| serde_json::from_str::<Value>(&text)) else { return Ok(None) };
    let name = json!(path.file_name().unwrap_or_default().to_string_lossy());
    bag["relative_file_paths"] = json!([name]);
    bag["files"][0]["path"] = name;
    Ok(Some(format!("{:#}\n", json!({ "rosbag2_bagfile_information": bag }))))
}

/// Returns the text of the record that [`Bag::record`] made.
fn bag_text(file: &mut File) -> McapResult<Option<String>> {
    let summary = summary(file)?.unwrap_or_default();
    let Some(index) = summary.metadata_indexes.iter().find(|index| index.name == RECORD) else { return Ok(None) };
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(index.offset))?;
    file.take(index.length).read_to_end(&mut bytes)?;
    match mcap::parse_record(op::METADATA, bytes.get(RECORD_HEAD..).unwrap_or_default())? {
        Record::Metadata(mut record) => Ok(record.metadata.remove(TEXT)),
        _ => Ok(None),
    }
}

/// Reads the index at the end of a file.
fn summary(file: &mut File) -> McapResult<Option<Summary>> {
    let mut reader = SummaryReader::new();
    while let Some(event) = reader.next_event() {
        match event? {
            SummaryReadEvent::ReadRequest(size) => {
                let read = file.read(reader.insert(size))?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to)?),
        }
    }
    Ok(reader.finish())
}
