//! Full disks, removed folders, signals, concurrent runs: remaining files and messages of a run.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{self, Answer, Place, Table, with};

/// A long run: half a minute of rest in small steps.
const LONG: [&str; 9] = ["compare", "robot.toml", "long.toml", "-o", "result", "--step", "1e-5", "--log-rate", "1000"];

fn place() -> Place {
    let place = Place::new();
    place.write("long.toml", with(common::SWING, "hold = 0.5", "hold = 59.5"));
    place
}

/// A shell command in the test folder, with the program as `$0` and its arguments as `$@`.
fn shell(place: &Place, script: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", script, env!("CARGO_BIN_EXE_flexarm")]).args(arguments).current_dir(place.path("."));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Waits until a run has written some rows of its table.
fn under_way(place: &Place, run: &mut Child) {
    let rows = || std::fs::read_to_string(place.path("result/run.csv")).map_or(0, |table| table.lines().count());
    let started = Instant::now();
    while rows() < 8 {
        assert!(run.try_wait().unwrap().is_none(), "the run was over too soon");
        assert!(started.elapsed() < Duration::from_secs(120), "no samples in two minutes");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn send(signal: &str, run: &Child) {
    assert!(Command::new("kill").args([signal, &run.id().to_string()]).status().unwrap().success());
}

fn ended(run: Child) -> Answer {
    Answer::of(run.wait_with_output().unwrap())
}

/// Last time in a table that may end in the middle of a line (s).
fn last_time(text: &str) -> f64 {
    let table = Table::parse(&text[..=text.rfind('\n').unwrap()]);
    table.column("time").last().copied().unwrap_or(-1.0)
}

/// Recordings that this build writes in addition to the table.
fn recordings() -> Vec<&'static str> {
    let built = [("run.mcap", cfg!(feature = "mcap")), ("run.rrd", cfg!(feature = "rerun"))];
    built.into_iter().filter_map(|(name, is_built)| is_built.then_some(name)).collect()
}

/// Truth: all recordings get the same samples. Uses a RAM disk of 2 MB, in a namespace that ends
/// with its shell.
#[test]
fn on_a_disk_that_fills_up_all_recordings_reach_about_as_far() {
    let place = place();
    std::fs::create_dir(place.path("disk")).unwrap();
    std::fs::create_dir(place.path("left")).unwrap();
    let script =
        "mount -t tmpfs -o size=2m tmpfs disk || exit 77; \"$0\" \"$@\"; code=$?; cp disk/result/* left; exit $code";
    let arguments = ["compare", "robot.toml", "long.toml", "-o", "disk/result", "--log-rate", "1000"];
    let mut command = Command::new("unshare");
    command.args(["-r", "-m", "sh", "-c", script, env!("CARGO_BIN_EXE_flexarm")]).args(arguments);
    let output = command.current_dir(place.path(".")).stdin(Stdio::null()).output();
    let Some(output) = output.ok().filter(|o| !o.stderr.starts_with(b"unshare:") && o.status.code() != Some(77)) else {
        eprintln!("skipped: no disk can be mounted here");
        return;
    };
    let answer = Answer::of(output);
    assert_eq!((answer.code, answer.out.as_str()), (1, ""), "{}", answer.err);
    answer.says(&["disk/result/run.", "the disk is full; free space or choose another folder with -o"]);
    let table = last_time(&place.text("left/run.csv"));
    assert!((0.2..59.0).contains(&table), "{table} s are left in the table");
    for name in recordings() {
        if name == "run.rrd" {
            let left = place.read("left/run.rrd").len();
            assert!(left > 20_000, "{left} bytes are left in the .rrd");
            continue;
        }
        let summary = place.json(&["convert", &format!("left/{name}"), &format!("{name}.csv")]);
        let reached = last_time(&place.text(&format!("{name}.csv")));
        // Flushes are 64 samples apart; an MCAP has complete chunks, of at most half a second.
        let behind = if name == "run.mcap" { 0.7 } else { 0.2 };
        assert!(reached > table - behind, "{name} reaches {reached} s, the table {table} s");
        // A file whose end had no space; one that was closed in time is complete.
        assert!(summary["warnings"].as_array().unwrap().len() <= 1, "{summary}");
    }
}

/// The signal for the file size limit would kill the program without a message.
#[test]
fn a_limit_of_file_sizes_is_an_error_with_the_name_of_the_file() {
    let place = place();
    let arguments = ["compare", "robot.toml", "long.toml", "-o", "result", "--log-rate", "1000"];
    let run = shell(&place, "ulimit -f 2000; exec \"$0\" \"$@\"", &arguments).spawn().unwrap();
    let answer = ended(run);
    assert_eq!((answer.code, answer.out.as_str()), (1, ""), "{}", answer.err);
    answer.says(&["result/run.", "may not grow further", "ulimit -f"]);
}

#[test]
fn a_terminal_that_closes_stops_a_run_unless_it_was_started_to_go_on() {
    if common::is_ignored(1) {
        eprintln!("skipped: the tests were started to go on when the terminal closes");
        return;
    }
    let place = place();
    let mut run = shell(&place, "exec \"$0\" \"$@\"", &LONG).spawn().unwrap();
    under_way(&place, &mut run);
    send("-HUP", &run);
    let answer = ended(run);
    assert_eq!(answer.code, 1, "{}", answer.err);
    answer.says(&["stopped at t = ", "readable"]);
    if cfg!(not(target_os = "linux")) {
        return; // where the signal is unknown, it ends the run as it ends any program
    }

    std::fs::remove_dir_all(place.path("result")).unwrap();
    let mut run = shell(&place, "trap '' HUP; exec \"$0\" \"$@\"", &LONG).spawn().unwrap();
    under_way(&place, &mut run);
    send("-HUP", &run);
    std::thread::sleep(Duration::from_millis(700));
    assert!(run.try_wait().unwrap().is_none(), "the run has stopped, as nobody asked it to");
    send("-TERM", &run);
    let answer = ended(run);
    assert_eq!(answer.code, 1, "{}", answer.err);
    answer.says(&["stopped at t = "]);
}

#[test]
fn a_run_whose_folder_is_removed_ends_with_1_and_says_what_is_lost() {
    let place = place();
    let arguments = ["compare", "robot.toml", "swing.toml", "-o", "result", "--step", "2e-6"];
    let mut run = shell(&place, "exec \"$0\" \"$@\"", &arguments).spawn().unwrap();
    under_way(&place, &mut run);
    std::fs::remove_dir_all(place.path("result")).unwrap();
    let answer = ended(run);
    assert_eq!((answer.code, answer.out.as_str()), (1, ""), "{}", answer.err);
    answer.says(&["result/run.csv", "no longer there"]);
    recordings().iter().for_each(|name| answer.says(&[&format!("result/{name}")]));
    // A folder with only a report would look like a result.
    assert!(!place.path("result").exists());

    // A run stopped by hand must not promise a log either.
    let mut run = shell(&place, "exec \"$0\" \"$@\"", &LONG).spawn().unwrap();
    under_way(&place, &mut run);
    std::fs::remove_dir_all(place.path("result")).unwrap();
    send(common::stop_signal(), &run);
    let answer = ended(run);
    assert_eq!(answer.code, 1, "{}", answer.err);
    answer.says(&["no longer there"]);
    assert!(!answer.err.contains("readable"), "{}", answer.err);
}

#[test]
fn runs_that_start_at_the_same_time_get_folders_of_their_own() {
    let place = Place::new();
    let arguments = ["compare", "robot.toml", "swing.toml"];
    let start = || shell(&place, "exec \"$0\" \"$@\" --json", &arguments).spawn().unwrap();
    let runs: Vec<Child> = (0..4).map(|_| start()).collect();
    let mut tables: Vec<String> = runs
        .into_iter()
        .map(|run| {
            let answer = ended(run);
            assert_eq!(answer.code, 0, "{}", answer.err);
            answer.json()["files"]["csv"].as_str().unwrap().to_owned()
        })
        .collect();
    tables.sort();
    assert_eq!(tables, [1, 2, 3, 4].map(|n| format!("out/beam-swing-00{n}/run.csv")));
    // A refused command leaves no empty folder behind.
    place.refused(&["compare", "robot.toml", "swing.toml", "--step", "-1"], &["step"]);
    std::fs::remove_dir_all(place.path("out")).unwrap();
    place.refused(&["compare", "robot.toml", "swing.toml", "--step", "-1"], &["step"]);
}

#[test]
fn a_file_that_cannot_be_made_leaves_nothing_of_the_others() {
    // A folder at the path of a file.
    let place = Place::new();
    std::fs::create_dir_all(place.path("result/run.csv")).unwrap();
    let before = place.snapshot();
    for force in [&[][..], &["--force"]] {
        let answer = place.flexarm(&[&["compare", "robot.toml", "swing.toml", "-o", "result"], force].concat());
        assert!(answer.code == 1 || answer.code == 2, "{}", answer.err);
        answer.says(&["result/run.csv"]);
        assert!(place.snapshot() == before, "{force:?} left something behind");
    }
    // A disk that is full from the start.
    if cfg!(target_os = "linux") {
        let place = Place::new();
        std::fs::create_dir(place.path("result")).unwrap();
        std::os::unix::fs::symlink("/dev/full", place.path("result/run.csv")).unwrap();
        let answer = place.flexarm(&["compare", "robot.toml", "swing.toml", "-o", "result", "--force"]);
        assert_eq!(answer.code, 1, "{}", answer.err);
        let left: Vec<_> = std::fs::read_dir(place.path("result")).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(left, ["run.csv"]);
    }
}

#[test]
fn a_recording_without_a_sample_has_no_report() {
    let place = Place::new();
    place.json(&["compare", "robot.toml", "swing.toml", "-o", "result"]);
    let table = place.text("result/run.csv");
    place.write("empty/run.csv", &table[..=table.find('\n').unwrap()]);
    place.refused(&["report", "empty"], &["empty/run.csv", "no sample"]);
    place.refused(&["report", "result/run.csv", "empty/run.csv", "-o", "both.html"], &["empty/run.csv", "no sample"]);
    for name in recordings() {
        let whole = place.read(&format!("result/{name}"));
        for length in [0, 4, 16, 300, 2000] {
            place.write(&format!("cut/{name}"), &whole[..length.min(whole.len())]);
            place.refused(&["report", &format!("cut/{name}")], &[name]);
        }
    }
}

/// The hidden temporary folder of a conversion must not appear in messages.
#[test]
fn a_conversion_names_the_files_that_it_was_given_and_leaves_nothing_when_stopped() {
    let place = place();
    place.json(&["run", "robot.toml", "long.toml", "-o", "result", "--log-rate", "1000"]);
    let before = place.snapshot();
    for output in ["whole.csv", "whole.mcap", "whole.rrd", "whole.parquet"] {
        let built = match output.rsplit('.').next() {
            Some("mcap") => cfg!(feature = "mcap"),
            Some("rrd") => cfg!(feature = "rerun"),
            Some("parquet") => cfg!(feature = "parquet"),
            _ => true,
        };
        if !built {
            continue;
        }
        // At several instants, and by a limit on file sizes.
        for milliseconds in [0, 30, 100, 250] {
            let run = shell(&place, "exec \"$0\" \"$@\"", &["convert", "result/run.csv", output]).spawn().unwrap();
            std::thread::sleep(Duration::from_millis(milliseconds));
            let _ = Command::new("kill").args(["-TERM", &run.id().to_string()]).stderr(Stdio::null()).status();
            let output_of_run = run.wait_with_output().unwrap();
            match output_of_run.status.code() {
                // Killed before it had begun, like any program.
                None => assert!(output_of_run.stdout.is_empty()),
                Some(0) => std::fs::remove_file(place.path(output)).unwrap(),
                Some(code) => assert_eq!(code, 1),
            }
            assert!(place.snapshot() == before, "{output} after {milliseconds} ms: something is left");
        }
        let arguments = ["convert", "result/run.csv", output];
        let answer = ended(shell(&place, "ulimit -f 40; exec \"$0\" \"$@\"", &arguments).spawn().unwrap());
        assert_eq!(answer.code, 1, "{}", answer.err);
        assert!(answer.err.starts_with(&format!("error: {output}: ")), "{}", answer.err);
        assert!(place.snapshot() == before, "{output} after a limit: something is left");
    }
}

#[test]
fn a_second_run_into_the_folder_of_one_that_is_under_way_is_refused_and_the_first_goes_on() {
    let place = place();
    let mut first = place.command(&LONG).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    under_way(&place, &mut first);
    let second = place.flexarm(&["compare", "robot.toml", "swing.toml", "-o", "result", "--force"]);
    assert_eq!((second.code, second.out.as_str()), (2, ""), "{}", second.err);
    second.says(&["result", "another run is writing into this folder", "choose another folder"]);
    let rows = place.text("result/run.csv").lines().count();
    send(common::stop_signal(), &first);
    ended(first);
    assert!(place.text("result/run.csv").lines().count() >= rows && place.path("result/summary.json").exists());
    // Afterwards the folder is available.
    place.json(&["compare", "robot.toml", "swing.toml", "-o", "result", "--force"]);
}
