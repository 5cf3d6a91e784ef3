//! Arrow files as other programs read them: with the reader of the Arrow library.

use crate::synthetic;
use std::fs::File;
use std::path::{Path, PathBuf};

use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use arrow_array::{Array, RecordBatch};
use arrow_ipc::reader::{FileReader, StreamReader};
use arrow_ipc::writer::FileWriter;
use arrow_schema::DataType;
use flexarm_log::{CreateOptions, CsvRecorder, LogError, Recorder, RecordingFormat, RunResult, open_recording};

/// Number of samples, enough for more than one record batch.
const SAMPLES: u64 = 20_000;

fn write(mut recorder: impl Recorder, samples: u64) {
    recorder.begin(&synthetic::header()).unwrap();
    (0..samples).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    recorder.finish(&synthetic::result()).unwrap();
}

fn arrow(name: &str, samples: u64) -> PathBuf {
    let path = synthetic::scratch(name);
    write(flexarm_log::ArrowRecorder::create(&path, CreateOptions::default().with_overwrite(true)), samples);
    path
}

fn bits(batches: &[RecordBatch], column: usize) -> Vec<u64> {
    let values = |batch: &RecordBatch| {
        let array = batch.column(column).as_primitive::<Float64Type>().clone();
        assert_eq!(array.null_count(), 0);
        array.values().iter().map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    batches.iter().flat_map(values).collect()
}

/// Truth: the CSV of the same run, whose numbers read back exactly.
#[test]
fn other_readers_find_the_columns_of_the_csv_to_the_last_bit_in_a_file_and_in_its_stream() {
    let path = arrow("columns.arrow", SAMPLES);
    let table = synthetic::scratch("columns.csv");
    write(CsvRecorder::create(&table, CreateOptions::default().with_overwrite(true)), SAMPLES);
    let text = std::fs::read_to_string(&table).unwrap();
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let rows: Vec<Vec<u64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|field| field.parse::<f64>().unwrap().to_bits()).collect())
        .collect();

    let file = FileReader::try_new(File::open(&path).unwrap(), None).unwrap();
    let schema = file.schema();
    assert_eq!(schema.fields().iter().map(|field| field.name().as_str()).collect::<Vec<_>>(), names);
    assert!(schema.fields().iter().all(|field| *field.data_type() == DataType::Float64 && !field.is_nullable()));
    let batches: Vec<RecordBatch> = file.map(Result::unwrap).collect();
    assert_eq!(batches.iter().map(RecordBatch::num_rows).collect::<Vec<_>>(), [16_384, 3_616]);
    // After its first 64 bytes a file is a stream.
    let bytes = std::fs::read(&path).unwrap();
    let stream: Vec<RecordBatch> = StreamReader::try_new(&bytes[64..], None).unwrap().map(Result::unwrap).collect();
    for (column, name) in names.iter().enumerate() {
        let expected: Vec<u64> = rows.iter().map(|row| row[column]).collect();
        assert!(bits(&batches, column) == expected, "{name}");
        assert!(bits(&stream, column) == expected, "{name}");
    }
    [path, table].iter().for_each(|path| std::fs::remove_file(path).unwrap());
}

/// Truth: the data given to the recorder.
#[test]
fn names_set_up_and_result_are_metadata_of_the_schema_and_come_back() {
    let path = arrow("texts.feather", 10);
    let texts = FileReader::try_new(File::open(&path).unwrap(), None).unwrap().schema().metadata().clone();
    let header = synthetic::header();
    assert_eq!((&texts["robot"], &texts["trajectory"]), (&header.robot, &header.trajectory));
    assert!(texts["units"].starts_with("SI: m, rad, s"));
    for (label, value) in &synthetic::result().figures {
        assert_eq!(&texts[&format!("figure.{label}")], value);
    }
    let mut run = open_recording(&path, RecordingFormat::from_path(&path).unwrap()).unwrap();
    assert_eq!(run.header().joints, header.joints);
    assert_eq!(run.header().metadata, header.metadata);
    let of_text = |name: &str| header.attachments.iter().find(|file| file.name == name).cloned();
    for file in &run.header().attachments {
        assert_eq!(Some(file.clone()), of_text(&file.name));
    }
    assert!(run.missing().is_empty());
    let result: RunResult = run.replay(&mut |_| Ok(())).unwrap();
    assert_eq!((result.figures, result.events), (synthetic::result().figures, synthetic::result().events));
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_cut_arrow_file_is_an_error_and_never_a_panic() {
    let path = arrow("cut.arrow", 50);
    let file = std::fs::read(&path).unwrap();
    for bytes in (0..40).map(|k| k * file.len() / 40).chain(file.len() - 40..file.len()) {
        std::fs::write(&path, &file[..bytes]).unwrap();
        let error = read(&path).unwrap_err();
        assert!(matches!(error, LogError::NotARecording { .. }), "{bytes}: {error}");
    }
    std::fs::remove_file(path).unwrap();
}

fn read(path: &Path) -> Result<u64, LogError> {
    let mut samples = 0;
    open_recording(path, RecordingFormat::Arrow)?.replay(&mut |_| {
        samples += 1;
        Ok(())
    })?;
    Ok(samples)
}

/// The same run gives the same bytes on any day; there is no file until it is complete.
#[test]
fn an_arrow_file_is_there_whole_or_not_at_all_and_does_not_depend_on_the_clock() {
    let [a, b] = ["once.arrow", "twice.arrow"].map(|name| arrow(name, 100));
    assert!(std::fs::read(&a).unwrap() == std::fs::read(&b).unwrap());
    let mut killed = flexarm_log::ArrowRecorder::create(&b, CreateOptions::default().with_overwrite(true));
    killed.begin(&synthetic::header()).unwrap();
    killed.record(&synthetic::sample(0)).unwrap();
    drop(killed);
    assert!(std::fs::read(&a).unwrap() == std::fs::read(&b).unwrap());
    [a, b].iter().for_each(|path| std::fs::remove_file(path).unwrap());
}

/// A table of another program: with an additional column, in another order, without texts.
#[test]
fn a_table_of_another_program_is_read_and_one_that_lacks_a_column_is_refused() {
    let path = arrow("foreign.arrow", 20);
    let batch = FileReader::try_new(File::open(&path).unwrap(), None).unwrap().next().unwrap().unwrap();
    let all: Vec<usize> = (0..batch.num_columns()).rev().collect();
    let save = |columns: &[usize]| {
        let batch = batch.project(columns).unwrap();
        let schema = batch.schema().as_ref().clone().with_metadata(Default::default());
        let batch = RecordBatch::try_new(schema.into(), batch.columns().to_vec()).unwrap();
        let mut writer = FileWriter::try_new(File::create(&path).unwrap(), &batch.schema()).unwrap();
        writer.write(&batch).unwrap();
        writer.finish().unwrap();
    };
    save(&all);
    assert_eq!(read(&path).unwrap(), 20);
    let run = open_recording(&path, RecordingFormat::Arrow).unwrap();
    assert_eq!(run.header().robot, path.file_stem().unwrap().to_string_lossy());
    assert_eq!(run.header().log_rate_hz, synthetic::RATE_HZ);
    assert_eq!(run.missing().len(), 1);
    let truth = synthetic::sample(7);
    let (mut run, mut seen) = (run, None);
    run.replay(&mut |sample| {
        if sample.time_s == truth.time_s {
            seen = Some(sample.clone());
        }
        Ok(())
    })
    .unwrap();
    // Without a header the joints are in the order of the columns.
    assert_eq!(run.header().joints, ["joint_3", "joint_2", "joint_1"]);
    assert_eq!(seen.unwrap().flexible.q, truth.flexible.q.into_iter().rev().collect::<Vec<_>>());
    save(&all[..5]);
    assert!(read(&path).unwrap_err().to_string().contains("missing here: time"), "{}", read(&path).unwrap_err());
    std::fs::remove_file(path).unwrap();
}
