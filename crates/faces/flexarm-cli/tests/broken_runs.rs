//! Remains of a run that is killed or that fills the disk: files that are readable up to that
//! point, and one clear message.

use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::common::{self, Answer, Place, Table, with};

/// A long run with much output: half a minute of rest in small steps.
const LONG: [&str; 9] = ["compare", "robot.toml", "long.toml", "-o", "result", "--step", "1e-5", "--log-rate", "1000"];

fn place() -> Place {
    let place = Place::new();
    place.write("long.toml", with(common::SWING, "hold = 0.5", "hold = 59.5"));
    place
}

/// Returns the last time in any whole chunk of a file, since the start of the run (s), and whether
/// the file ends with a whole record or its closing mark. A chunk record begins with the first and
/// last time of its messages.
fn last_time(file: &[u8]) -> (Option<f64>, bool) {
    const CHUNK: u8 = 0x06;
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    let (mut rest, mut last) = (file.strip_prefix(MAGIC).unwrap_or_default(), None);
    while let Some(length) = rest.get(1..9).map(|bytes| u64::from_le_bytes(bytes.try_into().unwrap()) as usize) {
        let Some(behind) = rest.get(9 + length..) else { break };
        if rest[0] == CHUNK {
            let end = u64::from_le_bytes(rest[17..25].try_into().unwrap());
            last = last.max(Some(end));
        }
        rest = behind;
    }
    // Times have a date: 2000-01-01.
    (last.map(|nanoseconds| (nanoseconds - 946_684_800_000_000_000) as f64 * 1e-9), rest.is_empty() || rest == MAGIC)
}

/// Truth: the guarantee of the recorders that at most the last moment is lost: for an MCAP one
/// chunk, which is half a second of motion. The recording after the kill must go beyond its state
/// one second before, since the run continued in that second.
#[test]
fn a_killed_run_leaves_recordings_up_to_the_last_moment() {
    let place = place();
    let mut run = place.command(&LONG).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let reached = || std::fs::read(place.path("result/run.mcap")).ok().and_then(|file| last_time(&file).0);
    let begin = Instant::now();
    // Wait until the run has started.
    while reached().is_none_or(|t| t < 0.5) {
        assert!(run.try_wait().unwrap().is_none(), "the run was over too soon");
        assert!(begin.elapsed() < Duration::from_secs(60), "the run does not get going");
        std::thread::sleep(Duration::from_millis(50));
    }
    let before = reached().unwrap();
    std::thread::sleep(Duration::from_secs(1));
    assert!(run.try_wait().unwrap().is_none(), "the run was over too soon");
    run.kill().unwrap(); // SIGKILL
    run.wait().unwrap();
    let after = reached().unwrap();
    assert!(after > before, "nothing was written in the last second: {after} s after {before} s");
    // The table may end in the middle of a line.
    let text = place.text("result/run.csv");
    let table = Table::parse(&text[..=text.rfind('\n').unwrap()]);
    assert!(*table.column("time").last().unwrap() > before);
    // Read back by the program itself, the recording reaches as far.
    let summary = place.json(&["convert", "result/run.mcap", "left.csv"]);
    let reached = Table::parse(&place.text("left.csv")).column("time").last().copied().unwrap();
    assert!(reached > before, "{reached} s, {before} s a second before the kill");
    assert!(summary["warnings"].as_array().unwrap().len() == 1, "{summary}");
    if cfg!(feature = "rerun") {
        let left = place.read("result/run.rrd").len();
        assert!(left > 20_000, "{left} bytes are left in the .rrd");
    }
    // A report can be made from the remains.
    let report = place.json(&["report", "result/run.mcap", "-o", "left.html"]);
    // In between is the number of kept samples, if a fast machine has got that far.
    let warnings: Vec<&str> =
        report["warnings"].as_array().unwrap().iter().map(|text| text.as_str().unwrap()).collect();
    let broken = |text: &&str| text.contains("was not finished") || text.contains("breaks off");
    assert!(warnings.iter().any(broken) && warnings.iter().any(|text| text.contains("no result")), "{report}");
    assert!(place.text("left.html").contains("TCP error"));
}

/// The program under a limit on file sizes (in the shell's blocks of 512 or 1024 bytes); writing
/// beyond it is an error as on a full disk.
fn limited(place: &Place, blocks: u32, arguments: &[&str]) -> Answer {
    let program = env!("CARGO_BIN_EXE_flexarm");
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    let mut command = std::process::Command::new("sh");
    command.args(["-c", &script, program]).args(arguments).current_dir(place.path(".")).stdin(Stdio::null());
    Answer::of(command.output().unwrap())
}

#[test]
fn a_recording_that_may_not_grow_ends_the_run_with_its_name_and_reads_up_to_there() {
    let place = place();
    let arguments = ["compare", "robot.toml", "long.toml", "-o", "result", "--log-rate", "1000"];
    let answer = limited(&place, 4000, &arguments);
    assert_eq!((answer.code, answer.out.as_str()), (1, ""));
    answer.says(&["result/run.", "may not grow further", "File too large"]);
    assert_eq!(answer.err.matches("error:").count(), 1, "{}", answer.err);
    // Closing the files fails as well; the first error counts.
    assert!(!answer.err.contains("index") && !answer.err.contains("last samples"), "{}", answer.err);
    let (last, whole) = last_time(&place.read("result/run.mcap"));
    assert!(last.is_some_and(|last| (0.1..59.0).contains(&last)) && whole, "{last:?} s are left");
    if cfg!(feature = "rerun") {
        let left = place.read("result/run.rrd").len();
        assert!(left > 20_000, "{left} bytes are left in the .rrd");
    }
}

/// Messages to a closed terminal are lost, the exit code is not.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_under_standard_error_does_not_end_a_command() {
    let place = Place::new();
    place.write(
        "heavy.toml",
        common::ROBOT
            .replace("[[flexible_link]]", "payload = { mass = 90.0, com = [0.0, 0.0, 0.0] }\n\n[[flexible_link]]"),
    );
    let code = |arguments: &[&str]| {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        place.command(arguments).stdout(Stdio::null()).stderr(full).status().unwrap().code()
    };
    assert_eq!(code(&["check", "none.toml"]), Some(2));
    let warned = ["compare", "heavy.toml", "swing.toml", "--no-files"];
    place.flexarm(&warned).says(&["warning"]);
    assert_eq!(code(&warned), Some(0));
}

/// Writing the first file fails at once: the device is always full.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_named_with_what_to_do() {
    for file in ["run.mcap", "run.csv"] {
        let place = Place::new();
        std::fs::create_dir(place.path("result")).unwrap();
        std::os::unix::fs::symlink("/dev/full", place.path(&format!("result/{file}"))).unwrap();
        let answer = place.flexarm(&["compare", "robot.toml", "swing.toml", "-o", "result", "--force"]);
        assert_eq!((answer.code, answer.out.as_str()), (1, ""), "{file}");
        answer.says(&[&format!("result/{file}"), "the disk is full; free space or choose another folder with -o"]);
        assert_eq!(answer.err.matches("error:").count(), 1, "{}", answer.err);
    }
}

#[test]
fn a_full_disk_has_one_exit_code_also_for_an_fmu() {
    let place = place();
    // The FMU is compressed: a library of one letter would fit on the disk.
    place.write("library.so", common::garbage(100_000, 1));
    let answer = limited(&place, 40, &["export-fmu", "robot.toml", "--library", "library.so", "-o", "arm.fmu"]);
    assert_eq!((answer.code, answer.out.as_str()), (1, ""), "{}", answer.err);
    answer.says(&["arm.fmu", "cannot be written"]);
}
