//! Studies: runs equal those of files written by hand, no interruption loses a finished run, shards
//! give identical bytes.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use flexarm_log::{DataTable, DataValues};
use flexarm_run::reduce::{ReduceJob, ReduceOptions, ReduceOutputs, reduce};
use flexarm_run::{Error, Modelling, Motion, Robot, RunOptions, Scenario};
use flexarm_sweep::{Finders, Shard, Sweep, SweepError, SweepRequest, merge};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().to_owned()
}

const FINDERS: Finders = Finders {
    robot: |name| root().join("robots").join(name),
    motion: |name| root().join("trajectories").join(name).with_extension("toml"),
};

/// A separate folder for a test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("flexarm-sweep-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn study(folder: &Path, text: &str) -> Result<Sweep, Error> {
    let path = folder.join("study.toml");
    std::fs::write(&path, text).unwrap();
    Sweep::load(&path, &FINDERS)
}

fn request(output: PathBuf) -> SweepRequest {
    SweepRequest { output, overwrite: false, shard: Shard::ALL, threads: Some(2), command: None }
}

fn go_on(_: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn numbers(table: &DataTable, name: &str) -> Vec<f64> {
    match table.column(name) {
        Some(DataValues::Number(values)) => values.clone(),
        other => panic!("{name}: {other:?}"),
    }
}

const REFERENCE: &str = "format = 1\nrobot = \"kr210/beams.toml\"\nmotion = \"point_to_point\"\n";

/// Truth: robot file, motion and options as a user would write them, run separately.
#[test]
fn a_run_has_the_numbers_of_the_files_that_a_person_would_write() {
    let place = folder("by-hand");
    let parameters = "[options]\nstep = 0.004\n[[parameter]]\npath = \"payload.mass\"\nvalues = [30.0, 75.5]\n\
                      [[parameter]]\npath = \"link.link_2.damping.modal\"\nas = \"factor\"\nvalues = [0.5, 2]\n\
                      [[parameter]]\npath = \"motion.speed\"\nvalues = [1.0, 0.8]\n";
    let quick = "metrics = [\"tcp.peak_m\", \"tcp.t_peak_s\", \"tcp.rms_m\", \"tcp.end_m\", \"tcp.static_sag_m\", \"f = frequencies_hz.0\"]\n";
    let whole = quick.replace("\"f =", "\"tcp.overshoot_m\", \"f =");
    let mut tables = Vec::new();
    for (name, metrics) in [("quick", quick), ("whole", &*whole)] {
        let mut sweep = study(&place, &format!("{REFERENCE}{metrics}{parameters}")).unwrap();
        assert_eq!(sweep.runs(), 8);
        let summary = sweep.run(&request(place.join(name)), &mut go_on).unwrap();
        assert_eq!((summary.runs, summary.done, summary.failed), (8, 8, 0));
        tables.push(DataTable::read(Path::new(&summary.file)).unwrap());
    }
    let folder_of_robot = root().join("robots/kr210");
    let text = std::fs::read_to_string(folder_of_robot.join("beams.toml")).unwrap();
    for run in 0..8 {
        let (mass, factor, speed) = ([30.0, 75.5][run / 4], [0.5, 2.0][run / 2 % 2], [1.0, 0.8][run % 2]);
        // By hand: other numbers in the text, in a file next to the shipped one.
        let mut document: toml::Table = toml::from_str(&text).unwrap();
        document["payload"]["mass"] = mass.into();
        let links = document["flexible_link"].as_array_mut().unwrap();
        let link = links.iter_mut().find(|link| link["link"].as_str() == Some("link_2")).unwrap();
        let modal = link["damping"]["modal"].as_float().unwrap();
        link["damping"]["modal"] = (modal * factor).into();
        document["urdf"] = folder_of_robot.join(document["urdf"].as_str().unwrap()).display().to_string().into();
        let by_hand = place.join(format!("{run}.toml"));
        std::fs::write(&by_hand, toml::to_string(&document).unwrap()).unwrap();
        let robot = Robot::load(&by_hand).unwrap();
        let motion = Motion::load(root().join("trajectories/point_to_point.toml"), &robot).unwrap();
        let motion = motion.scaled(1.0 / speed, &robot.rigid_model().unwrap()).unwrap();
        let options = RunOptions { step_s: 0.004, ..RunOptions::default() };
        let arm = robot.model(&Modelling::default()).unwrap();
        let summary = arm.simulate(Scenario::new(motion), &options).unwrap().summary;
        let tcp = summary.tcp.unwrap();
        let expected = [
            ("tcp.peak_m", tcp.peak_m),
            ("tcp.t_peak_s", tcp.t_peak_s),
            ("tcp.rms_m", tcp.rms_m),
            ("tcp.end_m", tcp.end_m),
            ("tcp.static_sag_m", tcp.static_sag_m),
            ("f", summary.frequencies_hz[0]),
        ];
        for (name, value) in expected {
            assert_eq!(numbers(&tables[1], name)[run], value, "whole summary, run {run}, {name}");
            // Four runs in parallel lanes: the same figures from different sums.
            let quick = numbers(&tables[0], name)[run];
            assert!((quick / value - 1.0).abs() < 1e-11, "run {run}, {name}: {quick} {value}"); // measured 2e-13
        }
        assert_eq!(numbers(&tables[1], "tcp.overshoot_m")[run], tcp.overshoot_m);
        assert_eq!(numbers(&tables[0], "payload.mass")[run], mass);
    }
    std::fs::remove_dir_all(&place).unwrap();
}

const SCATTER: &str = "metrics = [\"tcp.peak_m\", \"per_kg = tcp.peak_m / payload.mass\"]\n[options]\nstep = 0.01\n\
                       [[parameter]]\npath = \"payload.mass\"\nvalues = [2.0, 4.0, 6.0]\n\
                       [[parameter]]\npath = \"link.*.stiffness_factor\"\neach = true\ndistribution = \"normal\"\nmean = 1.0\nstd = 0.1\n\
                       [sample]\nmethod = \"sobol\"\ncount = 7\nseed = 3\n";

/// Truth: the table of the runs on one machine.
#[test]
fn shards_in_any_number_and_order_make_the_same_bytes() {
    let place = folder("shards");
    let text = format!("{REFERENCE}{SCATTER}");
    let whole = study(&place, &text).unwrap().run(&request(place.join("whole")), &mut go_on).unwrap();
    assert_eq!((whole.runs, whole.done), (21, 21));
    let bytes = std::fs::read(&whole.file).unwrap();
    for (of, order) in [(1, vec![1]), (2, vec![2, 1]), (5, vec![4, 1, 5, 3, 2]), (21, (1..=21).rev().collect())] {
        let mut folders = Vec::new();
        for number in order {
            let output = place.join(format!("{number}-{of}"));
            let shard = Shard { number, of };
            let mut sweep = study(&place, &text).unwrap();
            sweep.run(&SweepRequest { shard, threads: Some(1), ..request(output.clone()) }, &mut go_on).unwrap();
            folders.push(output);
        }
        let sweep = study(&place, &text).unwrap();
        let merged = merge(&sweep, &folders, &place.join(format!("merged-{of}")), false, None).unwrap();
        assert_eq!(std::fs::read(&merged.file).unwrap(), bytes, "{of} shards");
        assert_eq!(merged.doubles, 0);
    }
    // Shards in one folder, as on a cluster with a shared disk.
    let common = place.join("common");
    for number in [3, 1, 2] {
        let shard = Shard { number, of: 3 };
        study(&place, &text).unwrap().run(&SweepRequest { shard, ..request(common.clone()) }, &mut go_on).unwrap();
    }
    let merged = merge(&study(&place, &text).unwrap(), std::slice::from_ref(&common), &common, false, None).unwrap();
    assert_eq!(std::fs::read(&merged.file).unwrap(), bytes);
    std::fs::remove_dir_all(&place).unwrap();
}

#[test]
fn shards_that_are_missing_twice_there_or_of_another_study_are_told() {
    let place = folder("lacking");
    let text = format!("{REFERENCE}{SCATTER}");
    for number in 1..=3 {
        let request = SweepRequest { shard: Shard { number, of: 3 }, ..request(place.join(number.to_string())) };
        study(&place, &text).unwrap().run(&request, &mut go_on).unwrap();
    }
    let join = |names: &[&str], output: &str| {
        let folders: Vec<PathBuf> = names.iter().map(|name| place.join(name)).collect();
        merge(&study(&place, &text).unwrap(), &folders, &place.join(output), false, None)
    };
    let missing = join(&["1", "3"], "a").unwrap_err();
    assert!(matches!(missing.external(), Some(SweepError::Missing { missing: 7, runs: 21, .. })), "{missing}");
    assert!(missing.to_string().contains("shard 2/3 (all 7)"), "{missing}");
    assert!(!place.join("a/runs.parquet").exists());
    // A duplicate shard counts once.
    let copy = place.join("copy");
    std::fs::create_dir_all(copy.join("parts")).unwrap();
    for name in ["study.json", "parts/2-of-3-0.parquet"] {
        std::fs::copy(place.join("2").join(name), copy.join(name)).unwrap();
    }
    let merged = join(&["1", "2", "3", "copy"], "b").unwrap();
    assert_eq!((merged.done, merged.doubles), (21, 7));
    // A shard of another study.
    let other = text.replace("count = 7", "count = 8");
    let request = SweepRequest { shard: Shard { number: 2, of: 3 }, ..request(place.join("other")) };
    study(&place, &other).unwrap().run(&request, &mut go_on).unwrap();
    let foreign = join(&["1", "2", "3", "other"], "c").unwrap_err();
    assert!(matches!(foreign.external(), Some(SweepError::ForeignShard { .. })), "{foreign}");
    assert!(foreign.to_string().contains("the number of runs (24 and 21)"), "{foreign}");
    let into = study(&place, &text).unwrap().run(&request, &mut go_on).unwrap_err();
    assert!(matches!(into.external(), Some(SweepError::Foreign { .. })), "{into}");
    // A conflicting result.
    let journal = place.join("copy/parts/2-of-3.journal");
    std::fs::write(&journal, "[1,null,[0.5,0.25]]\n").unwrap();
    let twice = join(&["1", "2", "3", "copy"], "d").unwrap_err();
    assert!(matches!(twice.external(), Some(SweepError::Twice { run: 1, .. })), "{twice}");
    let nothing = join(&["1", "nowhere"], "e").unwrap_err();
    assert!(matches!(nothing.external(), Some(SweepError::NoStudy { .. })));
    std::fs::remove_dir_all(&place).unwrap();
}

/// Truth: a folder with points drawn by another program must not be mixed with points of this one.
#[test]
fn a_study_whose_points_were_drawn_differently_is_not_resumed() {
    let place = folder("drawn");
    let text = format!("{REFERENCE}{SCATTER}");
    let request = request(place.join("out"));
    study(&place, &text).unwrap().run(&request, &mut go_on).unwrap();
    let manifest = place.join("out/study.json");
    let known: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&manifest).unwrap()).unwrap();
    let is_drawn = |input: &serde_json::Value| input[0] == "the drawn points";
    for (forget, said) in
        [(false, "the content of the drawn points"), (true, "the drawn points, which only one study has")]
    {
        let mut other = known.clone();
        other["fingerprint"] = "0".into();
        let inputs = other["inputs"].as_array_mut().unwrap();
        let drawn = inputs.iter().position(is_drawn).unwrap();
        if forget {
            inputs.remove(drawn);
        } else {
            inputs[drawn][1] = "0".into();
        }
        std::fs::write(&manifest, other.to_string()).unwrap();
        let refused = study(&place, &text).unwrap().run(&request, &mut go_on).unwrap_err();
        assert!(matches!(refused.external(), Some(SweepError::Foreign { .. })), "{refused}");
        assert!(refused.to_string().contains(said), "{refused}");
    }
    std::fs::remove_dir_all(&place).unwrap();
}

/// Truth: the table of an uninterrupted study.
#[test]
fn a_study_that_was_stopped_goes_on_and_runs_nothing_twice() {
    let place = folder("resume");
    let text = format!("{REFERENCE}{SCATTER}");
    let whole = study(&place, &text).unwrap().run(&request(place.join("whole")), &mut go_on).unwrap();
    let output = place.join("stopped");
    let mut most = 0;
    let mut stop = |done: usize, _: usize| {
        most = done;
        if done >= 5 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let stopped = study(&place, &text).unwrap().run(&request(output.clone()), &mut stop).unwrap_err();
    let Some(SweepError::Stopped { done, runs: 21, .. }) = stopped.external() else { panic!("{stopped}") };
    let done = *done;
    assert!((5..21).contains(&done), "{done}");
    // As if the program had been killed while writing a line: the part is converted back into a
    // truncated journal.
    let part = DataTable::read(&output.join("parts/1-of-1-0.parquet")).unwrap();
    let Some(DataValues::Whole(numbers_of_runs)) = part.column("run") else { panic!("runs") };
    let Some(DataValues::Text(caveats)) = part.column("caveats") else { panic!("caveats") };
    let line = |row: usize| {
        let [peak, per_kg] = ["tcp.peak_m", "per_kg"].map(|name| numbers(&part, name)[row]);
        let caveats = serde_json::to_string(&caveats[row]).unwrap();
        format!("[{},null,[{peak:?},{per_kg:?}],{caveats}]\n", numbers_of_runs[row])
    };
    let journal: String = (0..done).map(line).collect();
    std::fs::remove_file(output.join("parts/1-of-1-0.parquet")).unwrap();
    std::fs::write(output.join("parts/1-of-1.journal"), &journal[..journal.len() - 9]).unwrap();
    let mut first = None;
    let mut watch = |done: usize, _: usize| {
        first.get_or_insert(done);
        ControlFlow::Continue(())
    };
    let resumed = study(&place, &text).unwrap().run(&request(output.clone()), &mut watch).unwrap();
    // All except the run with the truncated line.
    assert!(first.unwrap() >= done - 1, "{first:?} {done}");
    assert_eq!(std::fs::read(&resumed.file).unwrap(), std::fs::read(&whole.file).unwrap());
    assert!(!output.join("parts").exists());
    // Again: nothing is left to do, and nothing changes.
    let again = study(&place, &text).unwrap().run(&request(output), &mut go_on).unwrap();
    assert_eq!((again.done, std::fs::read(&again.file).unwrap()), (21, std::fs::read(&whole.file).unwrap()));
    std::fs::remove_dir_all(&place).unwrap();
}

#[test]
fn a_run_that_fails_is_a_row_with_its_reason_and_the_others_go_on() {
    let place = folder("failing");
    let text = format!(
        "{REFERENCE}metrics = [\"tcp.peak_m\"]\n[options]\nstep = 0.01\n[[parameter]]\npath = \"payload.mass\"\nvalues = [2.0, -1.0, 4.0]\n\
         [[parameter]]\npath = \"motion.speed\"\nvalues = [1.0, 50.0]\n"
    );
    let summary = study(&place, &text).unwrap().run(&request(place.join("out")), &mut go_on).unwrap();
    assert_eq!((summary.runs, summary.done, summary.failed), (6, 2, 4));
    let table = DataTable::read(Path::new(&summary.file)).unwrap();
    let peak = numbers(&table, "tcp.peak_m");
    let Some(DataValues::Text(reasons)) = table.column("reason") else { panic!("reasons") };
    for run in 0..6 {
        assert_eq!(peak[run].is_nan(), reasons[run].is_some());
    }
    assert!(reasons[2].as_ref().unwrap().contains("payload mass is -1"), "{reasons:?}");
    assert!(reasons[1].as_ref().unwrap().starts_with("point_to_point.toml: the trajectory passes"), "{reasons:?}");
    assert_eq!(summary.failures.iter().map(|failure| failure.runs).sum::<usize>(), 4);
    std::fs::remove_dir_all(&place).unwrap();
}

#[test]
fn what_is_wrong_in_a_study_is_told_with_line_and_what_is_near() {
    let place = folder("wrong");
    let fails = |text: &str, parts: &[&str]| {
        let text = format!("{REFERENCE}{text}");
        let told = study(&place, &text).err().unwrap_or_else(|| panic!("{text}")).to_string();
        assert!(parts.iter().all(|part| told.contains(part)), "{text}\n{told}\nexpected {parts:?}");
    };
    let parameter = |text: &str| format!("[[parameter]]\n{text}\n");
    fails(&parameter("path = \"payload.mass\"\nfrom = 1.0"), &["study.toml:4:", "from = ... and to = ..."]);
    // One value of a range would leave out its end.
    let one = parameter("path = \"payload.mass\"\nfrom = 1.0\nto = 2.0\ncount = 1");
    fails(&one, &["study.toml:", "count = 1: expected a whole number from 2"]);
    fails(
        &parameter("path = \"paylod.mass\"\nvalues = [1.0]"),
        &["study.toml:4:1", "matches no entry", "did you mean \"payload.mass\"?"],
    );
    fails(&parameter("path = \"link.lnk_2.damping.modal\"\nvalues = [0.1]"), &["matches no entry", "link_2"]);
    fails(&parameter("path = \"payload.mass\"\nvalues = [1.0]\ndistribution = \"normal\""), &["does not allow values"]);
    fails(&parameter("path = \"payload.mass\"\ndistribution = \"normal\"\nmean = 1.0\nstd = 0.1"), &["[sample]"]);
    fails(&parameter("path = \"options.stp\"\nvalues = [1.0]"), &["there is no option \"stp\"", "step"]);
    fails(&parameter("path = \"motion.speed\"\nvalues = [0.0]"), &["speed 0, expected a positive number"]);
    fails(&parameter("path = \"robot\"\nvalues = [\"nothing_of_this_name\"]"), &["nothing_of_this_name"]);
    fails(&parameter("path = \"payload.mass\"\nas = \"factor\"\nvalues = [\"a\"]"), &["must be a number"]);
    fails("metrics = [\"tcp.peak\"]\n", &["study.toml:4:12", "is not in the summary", "tcp.peak_m"]);
    fails("metrics = [\"tcp.peak_m\"]\nmetric = 1\n", &["unknown field `metric`"]);
    fails("[sample]\ncount = 4\n", &["[sample] has no effect"]);
    let linked = "[[parameter]]\npath = \"payload.mass\"\nlinked = \"a\"\nvalues = [1.0, 2.0]\n\
                  [[parameter]]\npath = \"motion.speed\"\nlinked = \"a\"\nvalues = [1.0]\n";
    fails(linked, &["has 1 values and is linked to \"payload.mass\", which has 2"]);
    std::fs::remove_dir_all(&place).unwrap();
}

/// Truth: the definitions of a grid, of linked values and of a sample repeated at every grid point.
#[test]
fn grids_cross_linked_values_go_along_and_samples_are_the_same_at_every_point() {
    let place = folder("design");
    let text = format!(
        "{REFERENCE}[[parameter]]\npath = \"payload.mass\"\nlinked = \"a\"\nvalues = [1.0, 2.0]\n\
         [[parameter]]\npath = \"motion.speed\"\nlinked = \"a\"\nvalues = [1.0, 0.5]\n\
         [[parameter]]\npath = \"options.links\"\nvalues = [\"lumped\", \"modal\"]\n\
         [[parameter]]\nname = \"k\"\npath = \"link.*.stiffness_factor\"\ndistribution = \"uniform\"\nlow = 0.5\nhigh = 1.5\n\
         [sample]\nmethod = \"latin-hypercube\"\ncount = 3\n"
    );
    let sweep = study(&place, &text).unwrap();
    assert_eq!(sweep.runs(), 2 * 2 * 3);
    assert_eq!(sweep.parameters(), ["payload.mass", "motion.speed", "options.links", "k"]);
    for run in 0..12 {
        let values: Vec<String> = sweep.values(run).iter().map(ToString::to_string).collect();
        let pair = [("1", "1"), ("2", "0.5")][run / 6];
        assert_eq!((&*values[0], &*values[1], &*values[2]), (pair.0, pair.1, ["lumped", "modal"][run / 3 % 2]));
        assert_eq!(values[3], sweep.values(run % 3)[3].to_string());
    }
    std::fs::remove_dir_all(&place).unwrap();
}

/// Truth: the product of both factors as one factor.
#[test]
fn a_factor_goes_on_top_of_a_value_and_of_another_factor() {
    let place = folder("on-top");
    let common = "metrics = [\"tcp.peak_m\", \"f = frequencies_hz.0\"]\n[options]\nstep = 0.01\n";
    let parameter = |path: &str, text: &str| format!("[[parameter]]\npath = \"{path}\"\n{text}\n");
    let two = parameter("link.link_2.beam.wall", "values = [0.02]")
        + &parameter("link.*.beam.wall", "name = \"all\"\nas = \"factor\"\nvalues = [0.5]")
        + &parameter("motion.speed", "values = [0.8]")
        + &parameter("motion.speed", "name = \"override\"\nas = \"factor\"\nvalues = [0.5]");
    let one = parameter("link.link_2.beam.wall", "values = [0.01]")
        + &parameter("link.link_3.beam.wall", "values = [0.005]")
        + &parameter("motion.speed", "values = [0.4]");
    let found: Vec<Vec<f64>> = [two, one]
        .iter()
        .enumerate()
        .map(|(k, text)| {
            let mut sweep = study(&place, &format!("{REFERENCE}{common}{text}")).unwrap();
            let summary = sweep.run(&request(place.join(k.to_string())), &mut go_on).unwrap();
            let table = DataTable::read(Path::new(&summary.file)).unwrap();
            ["tcp.peak_m", "f"].iter().flat_map(|name| numbers(&table, name)).collect()
        })
        .collect();
    assert_eq!(found[0], found[1]);
    std::fs::remove_dir_all(&place).unwrap();
}

/// Truth: closed form: the mass of the beam follows its wall, and the mass of the arm changes by
/// exactly that much.
#[test]
fn a_parameter_that_follows_from_another_changes_the_mass_of_the_arm() {
    let place = folder("derived");
    let text = format!(
        "{REFERENCE}metrics = [\"mass = robot.mass_kg\", \"tcp.peak_m\"]\n[options]\nstep = 0.01\n\
         [[parameter]]\nname = \"wall\"\npath = \"link.link_2.beam.wall\"\nvalues = [0.010, 0.014, 0.020]\n\
         [[parameter]]\nname = \"m\"\npath = \"link.link_2.mass\"\nexpression = \"232.06 + 2700 * 1.15 * 2 * (wall - 0.014) * 0.5\"\n"
    );
    let summary = study(&place, &text).unwrap().run(&request(place.join("out")), &mut go_on).unwrap();
    let table = DataTable::read(Path::new(&summary.file)).unwrap();
    let (mass, m) = (numbers(&table, "mass"), numbers(&table, "m"));
    assert!((m[0] - (232.06 - 2700.0 * 1.15 * 0.004)).abs() < 1e-9 && (m[1] - 232.06).abs() < 1e-12);
    for k in 0..3 {
        assert!((mass[k] - mass[1] - (m[k] - m[1])).abs() < 1e-9, "{mass:?} {m:?}"); // measured 2e-13
    }
    let wrong = text.replace("(wall - 0.014)", "(wal - 0.014)");
    let told = study(&place, &wrong).err().unwrap().to_string();
    assert!(told.contains("not a parameter defined before this one") && told.contains("wall"), "{told}");
    std::fs::remove_dir_all(&place).unwrap();
}

/// Truth: links that `reduce` makes from jobs written by hand, in robot files written by hand.
#[test]
fn a_link_that_is_reduced_again_is_that_of_a_job_written_by_hand() {
    let (place, beam) = (folder("reduced"), root().join("robots/test/one_beam"));
    let job = beam.join("fe/one_beam.reduce.toml");
    let text = format!(
        "format = 1\nrobot = {:?}\nmetrics = [\"sag = tcp.static_sag_m\", \"f = frequencies_hz.0\"]\n\
         [options]\nstep = 0.01\n[reduce]\nbeam_1 = {job:?}\n\
         [[parameter]]\npath = \"reduce.beam_1.material\"\nvalues = [\"aluminium\", \"steel\"]\n",
        beam.join("mesh.toml")
    );
    let summary = study(&place, &text).unwrap().run(&request(place.join("out")), &mut go_on).unwrap();
    assert_eq!((summary.done, summary.failed), (2, 0));
    let table = DataTable::read(Path::new(&summary.file)).unwrap();
    let (sag, f) = (numbers(&table, "sag"), numbers(&table, "f"));
    let robot = std::fs::read_to_string(beam.join("mesh.toml")).unwrap();
    for (k, material) in ["aluminium", "steel"].into_iter().enumerate() {
        let by_hand = std::fs::read_to_string(&job).unwrap().replace("\"aluminium\"", &format!("{material:?}"));
        let flex = place.join(format!("{material}.flex"));
        let outputs = ReduceOutputs { flex: Some(flex.clone()), ..ReduceOutputs::default() };
        let by_hand = ReduceJob::parse(&by_hand, &job).unwrap();
        reduce(&by_hand, &ReduceOptions::default(), Some(&outputs), &mut |_| {}).unwrap();
        let file = place.join(format!("{material}.toml"));
        let at = |name: &str| format!("{:?}", beam.join(name));
        let own = robot.replace("\"one_beam.urdf\"", &at("one_beam.urdf"));
        let own = own.replace("\"../../trajectories/beam_swing.toml\"", &at("../../trajectories/beam_swing.toml"));
        std::fs::write(&file, own.replace("\"fe/one_beam.flex\"", &format!("{flex:?}"))).unwrap();
        let robot = Robot::load(&file).unwrap();
        let found = robot.model(&Modelling::default()).unwrap().modes(None, None, 1).unwrap();
        let sag_m = robot.model(&Modelling::default()).unwrap().statics(None, [0.0; 6]).unwrap().sag_m;
        let wanted = sag_m.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((sag[k] / wanted - 1.0).abs() < 1e-9, "{material}: {} of {wanted}", sag[k]);
        let (wanted, off) = (found.undamped_frequencies_hz[0], |x: f64| (f[k] / x - 1.0).abs());
        assert!(off(wanted).min(off(found.frequencies_hz[0])) < 1e-9, "{material}: {} of {wanted}", f[k]);
    }
    assert!(sag[0] > 1.4 * sag[1], "{sag:?}");
    std::fs::remove_dir_all(&place).unwrap();
}
