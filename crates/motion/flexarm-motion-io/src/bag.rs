//! Bags of one or several files: those listed in `metadata.yaml` of a folder, or all in the folder.
//!
//! Files may be compressed as a whole (`.zstd`); what they hold is recognised by their first bytes.
//! Not here: the contents of the files (`mcap`, `sqlite`).

use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

use flexarm_files::most_unpacked;
use flexarm_settings::Finding;

use crate::assemble::assemble;
use crate::collect::Collector;
use crate::error::{MotionError, PlacedProblem};
use crate::unpack::{Inside, ZSTD_MAGIC, inside_of};
use crate::value::{Node, Value};
use crate::{MessageMotion, Request, mcap, sqlite, yaml};

/// Maximum size of `metadata.yaml` (bytes).
const MAX_METADATA: u64 = 16 << 20;

/// Reads a bag of ROS 2: a folder with `metadata.yaml`, or one file, MCAP or SQLite, which may be
/// compressed as a whole by zstd.
///
/// # Errors
/// [`MotionError::Read`], or [`MotionError::Content`] if the folder is not a bag, a file is none of
/// these, the requested topic does not exist, a message cannot be read, or the bag has no motion of
/// the requested joints. SQLite files are refused without the feature `sqlite`.
pub fn read_bag(path: &Path, request: &Request<'_>) -> Result<MessageMotion, MotionError> {
    let files = if path.is_dir() { files_of(path)? } else { vec![path.to_owned()] };
    read_files(&files, path, request)
}

/// Returns the files of a bag in order.
fn files_of(folder: &Path) -> Result<Vec<PathBuf>, MotionError> {
    let origin = folder.display().to_string();
    let metadata = folder.join("metadata.yaml");
    let mut names = Vec::new();
    if metadata.is_file() {
        let failed = |source| MotionError::Read { path: metadata.clone(), source };
        let mut text = String::new();
        File::open(&metadata).and_then(|file| file.take(MAX_METADATA).read_to_string(&mut text)).map_err(failed)?;
        yaml::documents(&text, &mut |node| {
            let listed = node.get("rosbag2_bagfile_information").and_then(|node| node.get("relative_file_paths"));
            if let Some(Node { value: Value::List(items), .. }) = listed {
                names.extend(items.iter().filter_map(|item| match &item.value {
                    Value::Text(name) => Some(name.to_string()),
                    _ => None,
                }));
            }
            Ok(())
        })
        .map_err(|trouble| trouble.of(&metadata.display().to_string()))?;
    }
    // Older bags list the folder as well; files elsewhere do not belong to the bag.
    let beside = |name: &String| folder.join(Path::new(name).file_name().unwrap_or_default());
    let files: Vec<PathBuf> = match names.is_empty() {
        false => names.iter().map(beside).collect(),
        true => {
            let failed = |source| MotionError::Read { path: folder.to_owned(), source };
            let entries = std::fs::read_dir(folder).map_err(failed)?;
            let mut found: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
            let is_bag = |path: &PathBuf| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let name = name.strip_suffix(".zstd").unwrap_or(&name);
                (name.ends_with(".mcap") || name.ends_with(".db3")) && path.is_file()
            };
            found.retain(is_bag);
            // `bag_10` follows `bag_9`.
            found.sort_by_key(|path| (path.as_os_str().len(), path.clone()));
            found
        }
    };
    let not_a_bag = |what: String| {
        Err(PlacedProblem::new(format!(
            "the folder is not a rosbag2 bag: {what}; expected metadata.yaml and files *.mcap or *.db3 in it"
        ))
        .of(&origin))
    };
    let first = files.first().map(|file| stem(file));
    let other = files.iter().find(|file| Some(stem(file)) != first);
    match files.iter().find(|file| !file.is_file()) {
        _ if files.is_empty() => not_a_bag("there are no files of a bag in it".to_owned()),
        None if names.is_empty() && other.is_some() => {
            not_a_bag("it has no metadata.yaml and files of several bags; give one of the files".to_owned())
        }
        Some(missing) => not_a_bag(format!("{}, which metadata.yaml names, is missing", missing.display())),
        None => Ok(files),
    }
}

/// Name of the bag that a file belongs to: `bag_3.mcap` belongs to `bag`.
fn stem(file: &Path) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let name = name.split('.').next().unwrap_or_default();
    match name.rsplit_once('_') {
        Some((stem, number)) if !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()) => stem.to_owned(),
        _ => name.to_owned(),
    }
}

/// First bytes of a SQLite file.
pub const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";

/// Reads the files of a bag as one.
///
/// * `bag`: name of the bag for messages.
fn read_files(files: &[PathBuf], bag: &Path, request: &Request<'_>) -> Result<MessageMotion, MotionError> {
    let shown = bag.display().to_string();
    let mut collector = Collector::new(*request);
    let (mut broken, mut format) = (Vec::new(), "MCAP bag");
    for file in files {
        let origin = file.display().to_string();
        let mut head = Vec::new();
        let failed = |source| MotionError::Read { path: file.clone(), source };
        let mut open = File::open(file).map_err(failed)?;
        open.by_ref().take(16).read_to_end(&mut head).map_err(failed)?;
        let most = most_unpacked(open.metadata().map_err(failed)?.len());
        // The format is that of the first bytes, whatever the name of the file is.
        let placed = |trouble: PlacedProblem| trouble.of(&origin);
        let ended = if head.starts_with(mcap::MCAP_MAGIC) {
            open.rewind().map_err(failed)?;
            mcap::collect(open, most, &mut collector).map_err(placed)?
        } else if head.starts_with(SQLITE_MAGIC) {
            format = "SQLite bag";
            sqlite::collect_file(file, most, &mut collector)?
        } else if head.starts_with(ZSTD_MAGIC) {
            match inside_of(file, most)? {
                Inside::Mcap(stream) => mcap::collect(stream, most, &mut collector).map_err(placed)?,
                Inside::Database(bytes) => {
                    format = "SQLite bag";
                    sqlite::collect_bytes(bytes, most, &mut collector).map_err(placed)?
                }
            }
        } else {
            let what = "it is neither MCAP nor a database of rosbag2, by its first bytes".to_owned();
            return Err(PlacedProblem::new(what).of(&origin));
        };
        broken.extend(ended.map(|why| (origin, why)));
    }
    finish(collector, &shown, format, &broken)
}

/// Makes the motion of the collected messages; broken files of the bag are named in caveats.
fn finish(
    collector: Collector<'_>,
    shown: &str,
    format: &'static str,
    broken: &[(String, String)],
) -> Result<MessageMotion, MotionError> {
    let was_asked = collector.asked();
    let cut = |trouble: PlacedProblem| match broken.first() {
        // The reason for the missing motion is more important.
        Some((_, why)) if trouble.is_without_motion => {
            PlacedProblem::new(format!("the bag cannot be read: {why}, and there is no motion before"))
        }
        _ => trouble,
    };
    let (topic, others) = collector.choose().map_err(|trouble| cut(trouble).of(shown))?;
    let mut caveats: Vec<Finding> = Vec::new();
    for (file, why) in broken {
        let message = format!("{file}: {why}; it is read up to there ({} messages on {})", topic.count, topic.name);
        caveats.push(Finding::warning("motion-cut", file, message, "recover it, or record it again"));
    }
    if !was_asked {
        caveats.push(chosen(&topic.described(), &others, shown));
    }
    let (name, message) = (topic.name.clone(), topic.message.clone());
    let dropped = topic.foreign.clone();
    let made = assemble(topic, shown, true).map_err(|trouble| trouble.of(shown))?;
    caveats.extend(made.caveats);
    let (trajectory, samples) = (made.trajectory, made.samples);
    Ok(MessageMotion { trajectory, format, topic: Some(name), message, samples, dropped, caveats })
}

/// Finding about the selected topic; a warning if there was a choice.
fn chosen(taken: &str, others: &[String], shown: &str) -> Finding {
    use flexarm_settings::Setting;
    if others.is_empty() {
        let message = format!("{shown}: the motion is that of {taken}, the only topic that has one");
        return Finding::warning("motion-topic", shown, message, "").as_note();
    }
    let message = format!(
        "{shown}: the motion is that of {taken}; others have one too: {}; {} chooses",
        others.join(", "),
        Setting::Topic
    );
    Finding::warning("motion-topic", shown, message, "").mended_by(&[Setting::Topic])
}
