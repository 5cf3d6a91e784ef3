//! Recordings read back, and written again in other formats. Truth: the samples of `synthetic`.

use crate::synthetic;
use std::path::{Path, PathBuf};

use flexarm_kinematics::Pose;
use flexarm_log::{
    ContentLevel, CreateOptions, LogError, Recorder, RecordingFormat, RunHeader, RunResult, RunSource, Sample,
    open_recording,
};

/// Number of samples of most tests, enough for more than one chunk of MCAP.
const SAMPLES: u64 = 400;

fn recorder(path: &Path, format: RecordingFormat) -> Box<dyn Recorder> {
    let options = CreateOptions::default().with_overwrite(true);
    format.recorder(path, options).expect("only formats of this build are asked for")
}

/// Formats of this build whose numbers are read back exactly.
fn exact_formats() -> Vec<RecordingFormat> {
    let exact = |format: &RecordingFormat| format.is_built_in() && format.info().content != ContentLevel::Pictures;
    RecordingFormat::ALL.into_iter().filter(exact).collect()
}

fn scratch(name: &str, format: RecordingFormat) -> PathBuf {
    synthetic::scratch(&format!("{name}.{}", format.extension()))
}

/// Writes a recording of the synthetic run, with or without the rigid twin.
fn written(name: &str, format: RecordingFormat, header: &RunHeader, samples: u64) -> PathBuf {
    let path = scratch(name, format);
    let mut recorder = recorder(&path, format);
    recorder.begin(header).unwrap();
    (0..samples).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    recorder.finish(&synthetic::result()).unwrap();
    path
}

/// Reads header, samples, result and warnings of a recording.
fn read(path: &Path, format: RecordingFormat) -> Result<(RunHeader, Vec<Sample>, RunResult, Vec<String>), LogError> {
    let mut source: Box<dyn RunSource> = open_recording(path, format)?;
    let mut samples = Vec::new();
    let result = source.replay(&mut |sample| {
        samples.push(sample.clone());
        Ok(())
    })?;
    Ok((source.header().clone(), samples, result, source.warnings()))
}

/// Converts a recording to another format.
fn converted(from: &Path, format: RecordingFormat, name: &str, to: RecordingFormat) -> PathBuf {
    let path = scratch(name, to);
    let mut source = open_recording(from, format).unwrap();
    let mut recorder = recorder(&path, to);
    recorder.begin(source.header()).unwrap();
    let result = source.replay(&mut |sample| recorder.record(sample)).unwrap();
    recorder.finish(&result).unwrap();
    path
}

fn remove(paths: &[&PathBuf]) {
    paths.iter().for_each(|path| std::fs::remove_file(path).unwrap());
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn distance(a: &Pose, b: &Pose) -> f64 {
    (a.to_homogeneous() - b.to_homogeneous()).norm()
}

fn assert_same_but_time(found: &[u8], expected: &[u8]) {
    let lines = |bytes: &[u8]| -> Vec<String> { str::from_utf8(bytes).unwrap().lines().map(str::to_owned).collect() };
    assert_eq!(lines(found).len(), lines(expected).len());
    for (found, expected) in lines(found).iter().zip(&lines(expected)).skip(1) {
        let ((t, found), (truth, expected)) = (found.split_once(',').unwrap(), expected.split_once(',').unwrap());
        assert_eq!(found, expected);
        let (t, truth): (f64, f64) = (t.parse().unwrap(), truth.parse().unwrap());
        assert!((t - truth).abs() < 1e-15, "{t:?} and {truth:?}");
    }
}

/// The bytes of the table are compared: numbers are written as the shortest text that reads back,
/// so equal bytes mean equal numbers.
#[test]
fn a_table_is_the_same_bytes_whatever_formats_it_went_through() {
    for (twin, has_rigid) in [("twin", true), ("alone", false)] {
        let header = RunHeader { has_rigid, ..synthetic::header() };
        let direct = written(&format!("direct-{twin}"), RecordingFormat::Csv, &header, SAMPLES);
        let expected = std::fs::read(&direct).unwrap();
        for from in exact_formats() {
            let first = written(&format!("first-{twin}-{}", from.extension()), from, &header, SAMPLES);
            for to in exact_formats() {
                let name = format!("{twin}-{}-{}", from.extension(), to.extension());
                let second = converted(&first, from, &name, to);
                let table = converted(&second, to, &format!("{name}-table"), RecordingFormat::Csv);
                let found = std::fs::read(&table).unwrap();
                match (from, to) {
                    // MCAP has whole nanoseconds, and CSV does not give the step of which its times
                    // are multiples.
                    (RecordingFormat::Csv, RecordingFormat::Mcap) => assert_same_but_time(&found, &expected),
                    _ => assert!(found == expected, "{from} to {to}, {twin}"),
                }
                remove(&[&second, &table]);
            }
            remove(&[&first]);
        }
        remove(&[&direct]);
    }
}

/// Truth: the table of the same run. Both are of version 0.1.0 as of November 2026, whose arrays had
/// no names and whose errors were twists (`compare one_beam beam_swing --log-rate 2`).
#[cfg(feature = "mcap")]
#[test]
fn an_mcap_file_from_before_the_curves_had_names_gives_the_same_numbers() {
    let older = |format: RecordingFormat| {
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
        read(&data.join(format!("older.{}", format.extension())), format).unwrap().1
    };
    let (found, truth) = (older(RecordingFormat::Mcap), older(RecordingFormat::Csv));
    assert_eq!((found.len(), truth.len()), (11, 11));
    for (found, truth) in found.iter().zip(&truth) {
        let numbers = |sample: &Sample| {
            let elastic = sample.elastic.iter().flat_map(|element| [element.deflection, element.load]).flatten();
            let energy = [sample.energy.kinetic, sample.energy.potential, sample.energy.elastic];
            let errors = [&sample.error_world[..], &sample.error_path[..3], &sample.static_m, &energy];
            let all = errors.concat().into_iter().chain(sample.contributions.concat()).chain(elastic);
            bits(&all.collect::<Vec<_>>())
        };
        assert_eq!(numbers(found), numbers(truth));
    }
    assert!(truth.iter().any(|sample| sample.error_world[2] != 0.0));
}

#[cfg(feature = "mcap")]
#[test]
fn an_mcap_file_gives_back_every_number_to_the_last_bit_and_poses_to_rounding() {
    let path = written("whole", RecordingFormat::Mcap, &synthetic::header(), SAMPLES);
    let (_, samples, _, warnings) = read(&path, RecordingFormat::Mcap).unwrap();
    assert_eq!(samples.len() as u64, SAMPLES);
    assert!(warnings.is_empty(), "{warnings:?}");
    let mut worst = 0.0_f64;
    let with_poses = synthetic::samples_with_poses(SAMPLES);
    let mut posed = synthetic::sample(0);
    for (step, found) in (0..).zip(&samples) {
        let truth = synthetic::sample(step);
        // Poses of links are those of the last sample with poses.
        if with_poses.contains(&step) {
            posed = synthetic::sample(step);
        }
        for (found, truth) in [(&found.flexible, &posed.flexible), (&found.rigid, &posed.rigid)] {
            assert_eq!(found.X_WL.len(), truth.X_WL.len());
            let (links, stations) = (found.X_WL.iter().zip(&truth.X_WL), found.X_WS.iter().zip(&truth.X_WS));
            worst = links.chain(stations).map(|(found, truth)| distance(found, truth)).fold(worst, f64::max);
        }
        assert_eq!((found.time_s.to_bits(), found.step), (truth.time_s.to_bits(), truth.step));
        for (found, truth) in [(&found.flexible, &truth.flexible), (&found.rigid, &truth.rigid)] {
            assert_eq!(bits(&found.q), bits(&truth.q));
            assert_eq!(bits(&found.qdot), bits(&truth.qdot));
            assert_eq!(bits(&found.effort), bits(&truth.effort));
            assert_eq!(bits(found.X_WT.translation.vector.as_slice()), bits(truth.X_WT.translation.vector.as_slice()));
            worst = worst.max(distance(&found.X_WT, &truth.X_WT));
        }
        assert_eq!(found.flexible.X_WS.len(), truth.flexible.X_WS.len());
        assert_eq!(found.contributions, truth.contributions);
        assert_eq!(found.gauges, truth.gauges);
        assert_eq!(bits(&found.error_world), bits(&truth.error_world));
        assert_eq!(bits(&found.error_path), bits(&truth.error_path));
        assert_eq!(bits(&found.static_m), bits(&truth.static_m));
        assert_eq!(found.elastic, truth.elastic);
        assert_eq!(found.energy, truth.energy);
        assert_eq!(bits(&found.solver), bits(&truth.solver));
    }
    assert!(worst < 1e-13, "{worst:e}");
    remove(&[&path]);
}

/// Parts of the header without a topic are in the attachments; meshes are read back as the
/// triangles drawn.
#[cfg(feature = "mcap")]
#[test]
fn an_mcap_file_gives_back_its_header_with_the_meshes() {
    let mesh_file = synthetic::scratch("attached.stl");
    std::fs::write(&mesh_file, "solid").unwrap();
    let mut truth = synthetic::header();
    truth.prismatic = vec![false, true, false];
    truth.meshes[2].file = Some(mesh_file.clone());
    let path = written("header", RecordingFormat::Mcap, &truth, 3);
    remove(&[&mesh_file]); // the recording must not need it any more

    let (header, _, result, _) = read(&path, RecordingFormat::Mcap).unwrap();
    truth.meshes[2].file = None;
    assert_eq!(header.meshes, truth.meshes);
    let mut names: Vec<&str> = header.attachments.iter().map(|file| file.name.as_str()).collect();
    assert!(names.remove(0).starts_with("meshes/"), "files of meshes stay attached: {names:?}");
    assert_eq!(header.attachments[1..], truth.attachments);
    let plain = |header: &RunHeader| {
        let empty = RunHeader { meshes: Vec::new(), attachments: Vec::new(), ..header.clone() };
        format!("{empty:?}")
    };
    assert_eq!(plain(&header), plain(&truth));
    let truth = synthetic::result();
    assert_eq!((result.figures, result.readable, result.events), (truth.figures, truth.readable, truth.events));

    // A second conversion gives the same header: no loss accumulates.
    let again = converted(&path, RecordingFormat::Mcap, "header-again", RecordingFormat::Mcap);
    let (second, ..) = read(&again, RecordingFormat::Mcap).unwrap();
    assert_eq!(format!("{second:?}"), format!("{header:?}"));
    remove(&[&path, &again]);
}

#[cfg(feature = "parquet")]
#[test]
fn a_parquet_file_gives_back_names_result_and_events() {
    let truth = synthetic::header();
    let path = written("names", RecordingFormat::Parquet, &truth, 20_000); // two row groups
    let (header, samples, result, _) = read(&path, RecordingFormat::Parquet).unwrap();
    assert_eq!((header.robot, header.trajectory, header.tcp), (truth.robot, truth.trajectory, truth.tcp));
    assert_eq!((header.joints, header.elements), (truth.joints, truth.elements));
    assert_eq!((header.metadata, header.attachments), (truth.metadata, truth.attachments));
    assert_eq!(header.log_rate_hz, synthetic::RATE_HZ);
    assert_eq!(result, synthetic::result());
    assert_eq!(samples.len(), 20_000);
    assert_eq!(samples[19_999].step, synthetic::sample(19_999).step);
    assert!(samples[0].flexible.qdot.iter().all(|v| v.is_nan()), "what is not in a table is not made up");
    remove(&[&path]);
}

#[test]
fn a_table_is_read_by_the_names_of_its_columns() {
    let path = written("names-of", RecordingFormat::Csv, &synthetic::header(), 10);
    let (header, samples, ..) = read(&path, RecordingFormat::Csv).unwrap();
    assert_eq!((header.joints, header.elements), (synthetic::header().joints, synthetic::header().elements));
    assert_eq!(header.log_rate_hz, synthetic::RATE_HZ);
    assert!(header.has_rigid && header.links.is_empty());

    // The same columns in another order, with an unknown one added.
    let text = std::fs::read_to_string(&path).unwrap();
    let shuffled: String = text
        .lines()
        .enumerate()
        .map(|(k, line)| {
            let mut fields: Vec<&str> = line.split(',').collect();
            fields.rotate_left(9);
            format!("{},{}\n", fields.join(","), if k == 0 { "note" } else { "text" })
        })
        .collect();
    std::fs::write(&path, shuffled).unwrap();
    let (_, reordered, ..) = read(&path, RecordingFormat::Csv).unwrap();
    for (a, b) in samples.iter().zip(&reordered) {
        assert_eq!(a.error_world, b.error_world);
        assert_eq!(a.elastic, b.elastic);
        assert_eq!(bits(&a.rigid.effort), bits(&b.rigid.effort));
    }
    remove(&[&path]);
}

/// Reads a file cut at a position: returns the error, or the number of samples before the cut after
/// comparing them with the originals.
fn cut_at(file: &[u8], bytes: usize, path: &Path, format: RecordingFormat) -> Result<usize, LogError> {
    std::fs::write(path, &file[..bytes]).unwrap();
    let (_, samples, _, warnings) = read(path, format)?;
    for (step, found) in (0..).zip(&samples) {
        let truth = synthetic::sample(step);
        assert_eq!(found.time_s.to_bits(), truth.time_s.to_bits());
        assert_eq!(bits(&found.error_world), bits(&truth.error_world), "cut at {bytes}, sample {step}");
        assert_eq!(found.energy, truth.energy);
    }
    if bytes + 8 >= file.len() && format == RecordingFormat::Mcap {
        return Ok(samples.len()); // only the closing magic is missing
    }
    assert!(!warnings.is_empty(), "a file cut at {bytes} of {} bytes gives no warning", file.len());
    assert!(warnings[0].starts_with(&path.display().to_string()), "{warnings:?}");
    Ok(samples.len())
}

/// Cut positions: all of the first 300, then at larger distances, and all near the end.
fn cuts(length: usize) -> impl Iterator<Item = usize> {
    let step = length / 300 + 1;
    (0..length.min(300)).chain((300..length).step_by(step)).chain(length.saturating_sub(120)..length)
}

#[cfg(feature = "mcap")]
#[test]
fn a_cut_mcap_file_gives_the_samples_before_the_cut_or_a_clear_error() {
    let path = written("cut", RecordingFormat::Mcap, &synthetic::header(), SAMPLES);
    let file = std::fs::read(&path).unwrap();
    let mut most = 0;
    for bytes in cuts(file.len()) {
        match cut_at(&file, bytes, &path, RecordingFormat::Mcap) {
            Ok(samples) => {
                assert!(samples >= most, "{samples} samples of {bytes} bytes, {most} of fewer");
                most = samples;
            }
            Err(LogError::NotARecording { found, .. }) => {
                assert!(most == 0, "{found}");
                let plain = found.contains("breaks off") || found.contains("empty") || found == "something else";
                assert!(plain || found.starts_with("text"), "{found}");
            }
            Err(error) => panic!("cut at {bytes}: {error}"),
        }
    }
    assert_eq!(most as u64, SAMPLES, "the index at the end is not needed");
    remove(&[&path]);
}

/// A kill leaves whole chunks.
#[cfg(feature = "mcap")]
#[test]
fn what_a_killed_run_left_is_read_up_to_its_last_chunk() {
    let path = scratch("killed", RecordingFormat::Mcap);
    let copy = scratch("killed-copy", RecordingFormat::Mcap);
    let mut recorder = flexarm_log::McapRecorder::create(&path, CreateOptions::default().with_overwrite(true));
    recorder.begin(&synthetic::header()).unwrap();
    for step in 0..600_u64 {
        recorder.record(&synthetic::sample(step)).unwrap();
        if step % 43 == 0 {
            std::fs::copy(&path, &copy).unwrap();
            let (_, samples, _, warnings) = read(&copy, RecordingFormat::Mcap).unwrap();
            let left = samples.len() as u64;
            assert!((step + 1).saturating_sub(250) <= left && left <= step + 1, "{left} of {step}");
            let reached = samples.last().map_or(0.0, |sample| sample.time_s);
            let seconds = format!("{left} samples, up to t = {reached} s");
            assert!(warnings[0].contains("not finished") && warnings[0].contains(&seconds), "{warnings:?}");
        }
    }
    drop(recorder);
    remove(&[&path, &copy]);
}

/// Flipped bits change a checksum, a size or a name; they must never crash the program or change a
/// number unnoticed.
#[cfg(feature = "mcap")]
#[test]
fn a_damaged_mcap_file_gives_no_wrong_number() {
    let path = written("flipped", RecordingFormat::Mcap, &synthetic::header(), SAMPLES);
    let file = std::fs::read(&path).unwrap();
    for at in (0..file.len()).step_by(file.len() / 400 + 1) {
        let mut damaged = file.clone();
        damaged[at] ^= 0x41;
        std::fs::write(&path, &damaged).unwrap();
        let Ok((header, samples, ..)) = read(&path, RecordingFormat::Mcap) else { continue };
        if header.step_s != synthetic::STEP_S || header.elements.len() != 1 {
            continue; // run.json has no checksum that readers must check
        }
        for (step, found) in (0..).zip(&samples) {
            assert_eq!(
                bits(&found.error_world),
                bits(&synthetic::sample(step).error_world),
                "byte {at}, sample {step}"
            );
        }
    }
    remove(&[&path]);
}

#[test]
fn a_cut_csv_file_gives_its_whole_lines() {
    let path = written("cut", RecordingFormat::Csv, &synthetic::header(), 40);
    let file = std::fs::read(&path).unwrap();
    let head = file.iter().position(|byte| *byte == b'\n').unwrap() + 1;
    let mut lines = 0;
    for bytes in (head..file.len()).step_by(7) {
        if file[bytes - 1] == b'\n' {
            continue; // a complete table
        }
        let samples = cut_at(&file, bytes, &path, RecordingFormat::Csv).unwrap();
        assert_eq!(samples, file[head..bytes].iter().filter(|byte| **byte == b'\n').count());
        lines = samples;
    }
    assert_eq!(lines, 39);
    // A file cut within the column names is an error.
    for bytes in (1..head - 1).step_by(5) {
        std::fs::write(&path, &file[..bytes]).unwrap();
        let error = read(&path, RecordingFormat::Csv).map(|_| ()).unwrap_err();
        assert!(matches!(error, LogError::NotARecording { .. }), "{error}");
    }
    remove(&[&path]);
}

#[cfg(feature = "parquet")]
#[test]
fn a_cut_parquet_file_is_an_error_and_never_a_panic() {
    let path = written("cut", RecordingFormat::Parquet, &synthetic::header(), 50);
    let file = std::fs::read(&path).unwrap();
    for bytes in cuts(file.len()) {
        std::fs::write(&path, &file[..bytes]).unwrap();
        let error = read(&path, RecordingFormat::Parquet).map(|_| ()).unwrap_err();
        assert!(matches!(error, LogError::NotARecording { .. }), "{bytes}: {error}");
    }
    remove(&[&path]);
}

/// A Parquet file is either complete or absent; an existing one is kept until then.
#[cfg(feature = "parquet")]
#[test]
fn a_parquet_file_has_its_name_only_when_it_is_finished() {
    let path = scratch("finished", RecordingFormat::Parquet);
    let begun = |options| {
        let mut recorder = flexarm_log::ParquetRecorder::create(&path, options);
        recorder.begin(&synthetic::header()).map(|()| recorder)
    };
    let folder = || {
        let stem = path.file_name().unwrap().to_string_lossy().into_owned();
        let files = std::fs::read_dir(path.parent().unwrap()).unwrap().map(|entry| entry.unwrap().file_name());
        files.filter(|name| name.to_string_lossy().starts_with(&stem)).count()
    };
    let mut killed = begun(CreateOptions::default()).unwrap();
    killed.record(&synthetic::sample(0)).unwrap();
    assert!(!path.exists());
    drop(killed);
    assert_eq!(folder(), 0, "nothing is left of a run that was given up");

    let mut first = begun(CreateOptions::default()).unwrap();
    first.record(&synthetic::sample(0)).unwrap();
    first.finish(&RunResult::default()).unwrap();
    assert_eq!(folder(), 1);
    assert!(matches!(begun(CreateOptions::default()), Err(LogError::Exists { .. })));
    let before = std::fs::read(&path).unwrap();
    drop(begun(CreateOptions::default().with_overwrite(true)).unwrap());
    assert!(std::fs::read(&path).unwrap() == before);
    remove(&[&path]);
}

/// The same run gives the same bytes on any day.
#[cfg(feature = "parquet")]
#[test]
fn a_parquet_file_does_not_depend_on_the_clock() {
    let [a, b] = ["once", "twice"].map(|name| written(name, RecordingFormat::Parquet, &synthetic::header(), 100));
    assert!(std::fs::read(&a).unwrap() == std::fs::read(&b).unwrap());
    remove(&[&a, &b]);
}

#[test]
fn what_is_no_recording_is_refused_with_what_it_is() {
    let path = synthetic::scratch("strange");
    let mut cases: Vec<(&[u8], RecordingFormat, &str)> = vec![
        (b"", RecordingFormat::Csv, "an empty file"),
        (b"time,x\n0,1\n", RecordingFormat::Csv, "a table with the columns time, x"),
        (b"1,2\n3,4\n", RecordingFormat::Csv, "a table with the columns 1, 2"),
        (b"\0\x01\x02\x03", RecordingFormat::Csv, "something else"),
        (b"PAR1....PAR1", RecordingFormat::Csv, "a file in the format Parquet"),
    ];
    if RecordingFormat::Mcap.is_built_in() {
        cases.push((b"hello\nyou\n", RecordingFormat::Mcap, "text, beginning \"hello\""));
        cases.push((b"\x89MCAP", RecordingFormat::Mcap, "breaks off"));
        cases.push((b"", RecordingFormat::Mcap, "an empty file"));
    }
    if RecordingFormat::Parquet.is_built_in() {
        cases.push((b"PAR1....PAR1", RecordingFormat::Parquet, "a damaged file"));
        cases.push((b"\x89MCAP0\r\n", RecordingFormat::Parquet, "a file in the format MCAP"));
    }
    for (bytes, format, words) in cases {
        std::fs::write(&path, bytes).unwrap();
        let error = open_recording(&path, format).map(|_| ()).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, LogError::NotARecording { .. }), "{text}");
        assert!(text.starts_with(&path.display().to_string()) && text.contains("expected"), "{text}");
        assert!(text.contains(words), "{text}");
    }
    remove(&[&path]);

    let folder = std::env::temp_dir();
    let error = open_recording(&folder, RecordingFormat::Csv).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("a folder") && error.contains("run.csv"), "{error}");
}

#[cfg(feature = "mcap")]
#[test]
fn an_mcap_file_of_another_program_is_refused_with_its_topics() {
    let path = scratch("foreign", RecordingFormat::Mcap);
    let mut writer =
        mcap::WriteOptions::new().library("rosbag2").create(std::fs::File::create(&path).unwrap()).unwrap();
    let channel = writer.add_channel(0, "/camera/image", "cdr", &std::collections::BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, &[1, 2, 3]).unwrap();
    writer.finish().unwrap();
    drop(writer);
    let error = open_recording(&path, RecordingFormat::Mcap).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("rosbag2") && error.contains("/camera/image"), "{error}");
    remove(&[&path]);
}

/// Parquet file of another program: refused with its columns, unless it has the columns of a
/// recording.
#[cfg(feature = "parquet")]
#[test]
fn a_parquet_file_of_another_program_is_read_by_its_columns_or_refused() {
    use parquet::data_type::DoubleType;
    let path = scratch("foreign", RecordingFormat::Parquet);
    let write = |names: &[&str], kind: &str| {
        let fields: Vec<String> = names.iter().map(|name| format!("REQUIRED {kind} {name};")).collect();
        let schema = format!("message schema {{ {} }}", fields.join(" "));
        let schema = parquet::schema::parser::parse_message_type(&schema).unwrap();
        let file = std::fs::File::create(&path).unwrap();
        let mut writer =
            parquet::file::writer::SerializedFileWriter::new(file, schema.into(), Default::default()).unwrap();
        if kind == "DOUBLE" {
            let mut group = writer.next_row_group().unwrap();
            let mut value = 0.0;
            while let Some(mut column) = group.next_column().unwrap() {
                column.typed::<DoubleType>().write_batch(&[value, value + 0.5], None, None).unwrap();
                column.close().unwrap();
                value += 1.0;
            }
            group.close().unwrap();
        }
        writer.close().unwrap();
    };
    let error = || open_recording(&path, RecordingFormat::Parquet).map(|_| ()).unwrap_err().to_string();
    write(&["city", "price"], "DOUBLE");
    assert!(error().contains("city, price") && error().contains("flexible_x_m"), "{}", error());

    let energies = ["kinetic_energy_j", "potential_energy_j", "elastic_energy_j"];
    let names: Vec<&str> =
        ["time", "flexible_x_m", "flexible_y_m", "flexible_z_m"].into_iter().chain(energies).collect();
    write(&names, "FLOAT");
    assert!(error().contains("column time of type FLOAT"), "{}", error());
    write(&names, "DOUBLE");
    let (header, samples, ..) = read(&path, RecordingFormat::Parquet).unwrap();
    assert_eq!((samples.len(), header.log_rate_hz, samples[1].energy.elastic), (2, 2.0, 6.5));
    remove(&[&path]);
}

/// A write-only format is refused, with the name of the file to read instead.
#[test]
fn a_rerun_file_is_not_read_back() {
    let path = scratch("viewed", RecordingFormat::Rrd);
    std::fs::write(&path, b"RRF2").unwrap();
    let error = open_recording(&path, RecordingFormat::Rrd).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("MCAP, Parquet or CSV") && error.contains("run.mcap"), "{error}");
    remove(&[&path]);
}
