//! `flexarm sweep`: studies, interruptions, plans for engines.

use std::time::{Duration, Instant};

use crate::common::{self, Place};

/// Speed of the swing and width of the beam, 8 x 25 runs.
const STUDY: &str = r#"format = 1
robot = "robot.toml"
motion = "swing.toml"
metrics = ["peak_mm = 1e3 * tcp.peak_m", "f1_hz = frequencies_hz.0"]

[options]
step = 0.002

[[parameter]]
path = "motion.speed"
from = 0.5
to = 1.0
count = 8

[[parameter]]
path = "link.bar.beam.width"
distribution = "uniform"
low = 0.015
high = 0.025

[sample]
count = 25
"#;

fn place() -> Place {
    let place = Place::new();
    place.write("study.toml", STUDY);
    place
}

#[test]
fn a_study_answers_with_its_figures_a_table_a_page_and_the_best_run() {
    let place = place();
    let found = place.json(&["sweep", "study.toml", "-o", "out"]);
    for (key, value) in [("runs", 200), ("done", 200), ("failed", 0)] {
        assert_eq!(found[key], value);
    }
    assert!(found["wall_s"].as_f64().unwrap() > 0.0 && found["cpu_s"].as_f64().unwrap() > 0.0);
    assert_eq!(found["file"], "out/runs.parquet");
    assert_eq!(found["metrics"][1]["name"], "f1_hz");
    assert!(found["metrics"][1]["shares"]["link.bar.beam.width"].as_f64().unwrap() > 0.9);
    let page = place.text("out/report.html");
    for part in ["<h1>Study study</h1>", "Heat maps", "Main effects", "Pareto front", "Scatter matrix", "Best run"] {
        assert!(page.contains(part), "{part}");
    }
    // The best run, repeated by its command, gives the number of the study.
    let command = found["best"]["command"].as_str().unwrap();
    let words: Vec<&str> = command.split(' ').skip(1).chain(["--no-files"]).collect();
    let again = place.json(&words);
    let (peak, expected) = (again["tcp"]["peak_m"].as_f64().unwrap(), found["best"]["value"].as_f64().unwrap());
    assert!((1e3 * peak / expected - 1.0).abs() < 1e-9, "{peak} {expected}"); // measured 1e-13
    let told = place.flexarm(&["sweep", "study.toml", "-o", "out"]);
    assert!(told.out.contains("200 of 200 runs done") && told.out.contains("peak_mm"), "{}", told.out);
}

/// A study that takes a while, to be interrupted.
fn long() -> String {
    common::with(STUDY, "step = 0.002", "step = 0.00005")
}

#[cfg(unix)]
#[test]
fn a_study_that_is_stopped_or_killed_goes_on_and_makes_the_same_bytes() {
    let place = place();
    place.write("study.toml", long());
    let started = |signal: &str, wanted: usize| {
        let journal = place.path("out/parts/1-of-1.journal");
        let lines = || std::fs::read(&journal).map_or(0, |text| text.iter().filter(|byte| **byte == b'\n').count());
        // More than the existing lines: runs are concurrent, and many may have finished when the
        // previous one was stopped.
        let wanted = lines() + wanted;
        let mut child = place.command(&["sweep", "study.toml", "-o", "out", "--quiet"]).spawn().unwrap();
        let begun = Instant::now();
        while lines() < wanted && child.try_wait().unwrap().is_none() {
            assert!(begun.elapsed() < Duration::from_secs(120), "no run is over");
            std::thread::sleep(Duration::from_millis(2));
        }
        assert!(std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        child.wait().unwrap().code()
    };
    assert_eq!(started("-KILL", 5), None);
    assert_eq!(started("-TERM", 3), Some(1));
    assert!(place.path("out/parts").exists() && !place.path("out/runs.parquet").exists());
    let found = place.json(&["sweep", "study.toml", "-o", "out"]);
    assert_eq!((found["done"].as_u64(), found["doubles"].as_u64()), (Some(200), Some(0)));
    place.json(&["sweep", "study.toml", "-o", "whole"]);
    assert_eq!(place.read("out/runs.parquet"), place.read("whole/runs.parquet"));
}

/// Truth: a run that is interrupted by the end of the program gives no result, and is run when the
/// study continues.
#[cfg(unix)]
#[test]
fn a_study_stops_within_half_a_second_in_the_middle_of_a_run_which_does_not_count() {
    // Without and with the complete summary of a run: the two ways in which runs are executed.
    for (name, metric) in [("quick", "tcp.peak_m"), ("whole", "tcp.overshoot_m")] {
        let place = Place::new();
        let study = format!(
            "format = 1\nrobot = \"robot.toml\"\nmotion = \"swing.toml\"\nmetrics = [\"{metric}\"]\n[options]\nstep = 4e-7\nlog_rate = 100.0\n\
             [[parameter]]\npath = \"motion.speed\"\nvalues = [0.5, 1.0]\n"
        );
        place.write("study.toml", &study);
        let arguments = ["sweep", "study.toml", "-o", "out", "--json", "--threads", "2"];
        for signal in [common::stop_signal(), "-TERM"] {
            // A busy machine may need another attempt.
            let stopped = (0..3).map(|_| {
                let mut command = place.command(&arguments);
                let child = command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn();
                let mut child = child.unwrap();
                std::thread::sleep(Duration::from_millis(700));
                assert!(child.try_wait().unwrap().is_none(), "{name}: it ended before it could be stopped");
                let kill = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status();
                assert!(kill.unwrap().success());
                let begun = Instant::now();
                child.wait().unwrap();
                let took = begun.elapsed();
                (took, common::Answer::of(child.wait_with_output().unwrap()))
            });
            let stopped: Vec<_> = stopped
                .scan(true, |goes_on, (took, answer)| {
                    let again = std::mem::replace(goes_on, took > Duration::from_millis(500));
                    again.then_some((took, answer))
                })
                .collect();
            let (took, answer) = &stopped[stopped.len() - 1];
            assert!(*took < Duration::from_millis(500), "{name}, {signal}: {took:?}");
            assert_eq!((answer.code, answer.out.as_str()), (1, ""), "{name}: {}", answer.err);
            answer.says(&["stopped after 0 of 2 runs", "continues from there"]);
            assert!(!place.path("out/runs.parquet").exists() && !place.path("out/sweep.json").exists());
            assert_eq!(place.read("out/parts/1-of-1.journal"), b"", "{name}");
        }
        place.write("study.toml", common::with(&study, "step = 4e-7", "step = 1e-3"));
        let found = place.json(&["sweep", "study.toml", "-o", "out", "--force"]);
        assert_eq!((found["done"].as_u64(), found["failed"].as_u64()), (Some(2), Some(0)));
    }
}

/// Truth: the first frequency of the beam depends on its width, not on the speed of the swing.
#[test]
fn a_parameter_without_effect_is_not_named_with_twenty_draws() {
    let place = place();
    let mut named = 0;
    for seed in 0..6 {
        let study =
            common::with(STUDY, "from = 0.5\nto = 1.0\ncount = 8", "distribution = \"uniform\"\nlow = 0.5\nhigh = 1.0");
        place.write("study.toml", common::with(&study, "count = 25", &format!("count = 20\nseed = {seed}")));
        let out = format!("out{seed}");
        let found = place.json(&["sweep", "study.toml", "-o", &out]);
        let f1 = &found["metrics"][1];
        assert_eq!(f1["matters"][0], "link.bar.beam.width", "{f1}");
        named += usize::from(f1["matters"].as_array().unwrap().len() > 1);
        let chance = f1["chance"].as_f64().unwrap();
        assert!((0.46..0.47).contains(&chance), "{chance}");
        let page = place.text(&format!("{out}/report.html"));
        assert!(
            page.contains(
                "f1_hz: link.bar.beam.width. Not distinguishable from chance: motion.speed (chance may explain"
            ),
            "{page}"
        );
    }
    assert_eq!(named, 0); // 0.06 expected
}

/// Truth: higher frequencies are better, whatever their name starts with.
#[test]
fn the_best_run_and_the_front_have_high_frequencies_and_small_errors() {
    let place = place();
    let study = common::with(STUDY, "[\"peak_mm", "[\"f1_hz = frequencies_hz.0\", \"peak_mm");
    let study = common::with(&study, ", \"f1_hz = frequencies_hz.0\"]", "]");
    place.write("study.toml", &study);
    let found = place.json(&["sweep", "study.toml", "-o", "out"]);
    let highest = &found["metrics"][0]["max"];
    assert_eq!((&found["best"]["value"], &found["best"]["better"]), (highest, &serde_json::json!("higher")));
    assert_eq!(found["pareto"]["better"], serde_json::json!(["higher", "lower"]));
    let last = found["pareto"]["runs"].as_array().unwrap().last().unwrap();
    let first = &found["pareto"]["runs"][0];
    assert_eq!(first["values"][0], *highest);
    // From the highest frequency on, each has less of both.
    assert!(last["values"][0].as_f64() <= first["values"][0].as_f64());
    assert!(last["values"][1].as_f64() <= first["values"][1].as_f64());
    // The setting in the study takes precedence.
    place.write("study.toml", study + "\n[better]\nf1_hz = \"lower\"\n");
    let found = place.json(&["sweep", "study.toml", "-o", "low"]);
    assert_eq!(found["best"]["value"], found["metrics"][0]["min"]);
    place.write("study.toml", STUDY.to_owned() + "\n[better]\nf2 = \"lower\"\n");
    place.refused(&["sweep", "study.toml", "-o", "x"], &["\"f2\" is not a metric"]);
    place.write("study.toml", STUDY.to_owned() + "\n[better]\nf1_hz = \"more\"\n");
    place.refused(&["sweep", "study.toml", "-o", "x"], &["f1_hz", "\"more\"", "\"lower\" or \"higher\""]);
}

/// Truth: the warnings of `compare` for each run separately.
#[test]
fn what_compare_warns_of_runs_is_said_once_with_their_number() {
    let place = place();
    for (name, metrics) in [("quick", "tcp.peak_m"), ("whole", "tcp.overshoot_m")] {
        let study = format!(
            "format = 1\nrobot = \"robot.toml\"\nmotion = \"swing.toml\"\nmetrics = [\"{metrics}\"]\n[options]\nstep = 0.001\n\
             [[parameter]]\npath = \"gravity[2]\"\nvalues = [-9.81, -98.1, -98.5]\n\
             [[parameter]]\npath = \"options.step\"\nvalues = [0.001, 0.1]\n"
        );
        place.write("study.toml", study);
        let found = place.json(&["sweep", "study.toml", "-o", name]);
        let caveats = found["caveats"].as_array().unwrap();
        let of = |code: &str| {
            caveats.iter().find(|c| c["code"] == code).unwrap_or_else(|| panic!("{name}: no {code} in {caveats:?}"))
        };
        let gravity = of("gravity");
        assert_eq!(
            (gravity["runs"].as_u64(), gravity["worst_run"].as_u64(), gravity["value"].as_f64()),
            (Some(4), Some(4), Some(98.5))
        );
        assert_eq!(gravity["likely"], "about 10 times: the decimal point?");
        let step = of("long-step");
        assert_eq!((step["runs"].as_u64(), step["value"].as_f64()), (Some(3), Some(0.1)));
        assert_eq!(step["likely"], "about 1000 times: milliseconds?");
        let warnings = found["warnings"].as_array().unwrap();
        assert!(
            warnings.iter().any(|text| text.as_str().unwrap().ends_with("(4 of 6 runs; worst in run 4)")),
            "{warnings:?}"
        );
        // With `compare`, run by run.
        for (run, (gravity, step)) in [("-98.1", "0.1"), ("-9.81", "0.001")].into_iter().enumerate() {
            place.write("own.toml", common::with(common::ROBOT, "-9.81", gravity));
            let own = place.json(&["compare", "own.toml", "swing.toml", "--step", step, "--no-files"]);
            // Only the samples of a run show its energy.
            for caveat in own["caveats"].as_array().unwrap().iter().filter(|caveat| caveat["code"] != "energy-open") {
                assert!(
                    caveats.iter().any(|c| c["code"] == caveat["code"]),
                    "{name} {run}: {caveat} is not in {caveats:?}"
                );
            }
        }
        // They also appear if nothing is left to run, on the page and on standard error.
        let again = place.flexarm(&["sweep", "study.toml", "-o", name]);
        again.says(&["gravity is 98.5", "4 of 6 runs"]);
        assert!(place.text(&format!("{name}/report.html")).contains("gravity is 98.5"));
    }
}

#[cfg(unix)]
#[test]
fn a_disk_that_is_full_stops_the_study_with_a_word_and_loses_no_run() {
    let place = place();
    let program = env!("CARGO_BIN_EXE_flexarm");
    let limited = format!("ulimit -f 8; exec {program} sweep study.toml -o out --quiet"); // 4 kB, or 8 in some shells
    let output = std::process::Command::new("sh").args(["-c", &limited]).current_dir(place.path("")).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("1-of-1.journal") && said.contains("cannot be written"), "{said}");
    // Runs finished before the disk was full are stored, as a part.
    assert!(!place.read("out/parts/1-of-1-0.parquet").is_empty());
    let found = place.json(&["sweep", "study.toml", "-o", "out"]);
    assert_eq!(found["done"], 200);
    place.json(&["sweep", "study.toml", "-o", "whole"]);
    assert_eq!(place.read("out/runs.parquet"), place.read("whole/runs.parquet"));
}

#[test]
fn shards_are_planned_run_and_joined_by_a_shell() {
    let place = place();
    place.json(&["sweep", "study.toml", "-o", "whole"]);
    let plan = place.json(&["sweep", "plan", "study.toml", "-n", "3", "--results", "results", "-o", "plan"]);
    assert_eq!(
        (plan["runs"].as_u64(), plan["shards"].as_u64(), plan["engine"].as_str()),
        (Some(200), Some(3), Some("none"))
    );
    let run = std::process::Command::new("sh").arg("plan/run.sh").current_dir(place.path("")).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(place.read("results/runs.parquet"), place.read("whole/runs.parquet"));
    assert_eq!(place.text("plan/shards.txt").lines().count(), 3);
    for (engine, file, part) in
        [("slurm", "shards.sbatch", "#SBATCH --array=1-3"), ("hyperqueue", "submit.py", "SHARDS, CORES")]
    {
        place.json(&["sweep", "plan", "study.toml", "-n", "3", "--engine", engine, "-o", engine]);
        assert!(place.text(&format!("{engine}/{file}")).contains(part));
    }
    // Combining letters and quotes are text of Python, not escapes of another language.
    let results = "re\u{301}sultats \"1\"";
    place.json(&[
        "sweep",
        "plan",
        "study.toml",
        "-n",
        "3",
        "--engine",
        "hyperqueue",
        "--results",
        results,
        "-o",
        "accent",
    ]);
    let script = place.text("accent/submit.py");
    assert!(script.contains("re\u{301}sultats \\\"1\\\"\"") && !script.contains("\\u{"), "{script}");
    place.refused(&["sweep", "plan", "study.toml", "-n", "3", "-o", "plan"], &["exists already", "--force"]);
    place.refused(&["sweep", "plan", "study.toml", "-n", "300", "-o", "p"], &["200 shards"]);
    place.refused(&["sweep", "study.toml", "--shard", "4/3"], &["4/3"]);
    // A shard reports its number, and the missing runs.
    let one = place.json(&["sweep", "study.toml", "--shard", "2/3", "-o", "part"]);
    assert_eq!((one["shard"].as_str(), one["done"].as_u64()), (Some("2/3"), Some(67)));
    let lacking = place.flexarm(&["sweep", "merge", "study.toml", "part", "-o", "joined"]);
    assert_eq!(lacking.code, 1);
    lacking.says(&["133 of 200 runs are missing", "shard 1/3 (all 67)", "shard 3/3 (all 66)"]);
    place.refused(&["sweep", "merge", "study.toml", "nothing"], &["nothing contains no study.json"]);
    place.write("study.toml", common::with(STUDY, "count = 25", "count = 26"));
    place.refused(
        &["sweep", "study.toml", "-o", "whole"],
        &["another study", "the number of runs (200 and 208)", "--force"],
    );
}

#[test]
fn a_study_of_which_no_run_is_left_has_failed() {
    let place = Place::new();
    let study = "format = 1\nrobot = \"robot.toml\"\nmotion = \"swing.toml\"\n[[parameter]]\npath = \"link.bar.beam.width\"\nvalues = ";
    place.write("none.toml", format!("{study}[-1.0]\n"));
    let none = place.flexarm(&["sweep", "none.toml", "-o", "none", "--json"]);
    assert_eq!((none.code, &none.json()["failed"]), (1, &serde_json::json!(1)));
    place.write("some.toml", format!("{study}[-1.0, 0.02]\n"));
    let some = place.flexarm(&["sweep", "some.toml", "-o", "some", "--json"]);
    assert_eq!((some.code, &some.json()["done"]), (0, &serde_json::json!(1)), "{}", some.err);
}
