//! One motion in every format, written by the Python packages of ROS
//! (`tools/make_motion_fixtures.py`): the same samples as in the library's own CSV.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use flexarm_motion_io::{MessageMotion, MotionError, Request, TextFormat, read_bag, read_text, write_joint_trajectory};
use flexarm_trajectory::Trajectory;

const JOINTS: [&str; 2] = ["joint_1", "joint_2"];
const ROBOT: Request<'static> = Request { joints: Some(&JOINTS), topic: None };
/// Maximum difference from the CSV (rad, rad/s, rad/s²).
const SAME: f64 = 1e-9;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(data(name)).unwrap()
}

fn truth(name: &str) -> Trajectory {
    Trajectory::parse_csv(&text(name), name).unwrap().with_joint_order(&JOINTS).unwrap()
}

/// Maximum differences of positions, velocities and accelerations at 1000 times.
fn differences(a: &Trajectory, b: &Trajectory) -> [f64; 3] {
    let b = b.with_joint_order(&a.joints().iter().map(String::as_str).collect::<Vec<_>>()).unwrap();
    let n = a.joints().len();
    let mut worst = [0.0f64; 3];
    for i in 0..=1000 {
        let t = a.duration() * f64::from(i) / 1000.0;
        let mut x = vec![vec![0.0; n]; 6];
        let [q, v, acc, p, w, b_acc] = &mut x[..] else { unreachable!() };
        a.sample(t, q, v, acc);
        b.sample(t, p, w, b_acc);
        for (k, (left, right)) in [(&*q, &*p), (&*v, &*w), (&*acc, &*b_acc)].into_iter().enumerate() {
            let most = left.iter().zip(right).map(|(l, r)| (l - r).abs()).fold(0.0, f64::max);
            worst[k] = worst[k].max(most);
        }
    }
    worst
}

fn assert_same(motion: &MessageMotion, csv: &str, what: &str) {
    let truth = truth(csv);
    assert!(
        (motion.trajectory.duration() - truth.duration()).abs() < 1e-12,
        "{what}: {}",
        motion.trajectory.duration()
    );
    let [q, v, a] = differences(&motion.trajectory, &truth);
    println!("{what}: {q:.1e} rad, {v:.1e} rad/s, {a:.1e} rad/s^2");
    assert!(q <= SAME && v <= SAME && a <= 1e-6, "{what}: {q:e} {v:e} {a:e}");
    assert_eq!(motion.samples, 26, "{what}");
}

fn told(motion: &MessageMotion) -> Vec<String> {
    motion.caveats.iter().map(|c| format!("{} {}: {}", c.severity.word(), c.code, c.message)).collect()
}

#[test]
fn a_joint_trajectory_as_text_is_the_motion_of_the_csv() {
    for name in ["plan.yaml", "plan_ros1.yaml", "plan.json", "plan_floats.json", "display.yaml"] {
        let motion = read_text(&text(name), name, &ROBOT).unwrap();
        assert_same(&motion, "plan.csv", name);
        assert_eq!(motion.dropped, ["gripper_finger_joint"], "{name}");
        assert_eq!(motion.message, "trajectory_msgs/JointTrajectory");
        assert_eq!(motion.format, if name.ends_with("json") { "JSON message" } else { "YAML message" });
    }
}

/// The robot's joint is renamed, so that the name in the file is misspelt.
#[test]
fn a_misspelt_joint_is_an_error_in_every_text_and_every_bag() {
    let robot = Request { joints: Some(&["joint_1", "jiont_2"]), topic: None };
    let truth = "\"joint_2\" is not a joint of the robot; did you mean \"jiont_2\"? rename it";
    for name in ["plan.yaml", "plan_ros1.yaml", "plan.json", "plan_floats.json", "display.yaml", "echo.yaml"] {
        let found = refusal(read_text(&text(name), name, &robot));
        assert!(found.contains(truth), "{name}: {found}");
    }
    for name in ["states_zstd.mcap", "states_ros1.mcap", "plan.mcap"] {
        let found = refusal(read_bag(&data(name), &robot));
        assert!(found.contains(truth), "{name}: {found}");
    }
}

#[test]
fn json_with_tabs_and_a_state_with_too_few_velocities_are_read() {
    let tabs = text("plan.json").replace("\n ", "\n\t").replace("\t ", "\t\t");
    assert!(tabs.contains("\t\t"));
    assert_same(&read_text(&tabs, "tabs", &ROBOT).unwrap(), "plan.csv", "JSON with tabs");
    let one = |k: i64| {
        format!("header: {{stamp: {}}}\nname: [joint_1, finger]\nposition: [{k}, 0]\nvelocity: [1.0]\n---\n", 100 + k)
    };
    let motion = read_text(&(0..4).map(one).collect::<String>(), "few", &ROBOT).unwrap();
    assert!(told(&motion).iter().any(|line| line.contains("the velocities of 4 messages are not one for each joint")));
}

#[test]
fn states_printed_by_ros2_topic_echo_are_the_motion_of_the_csv_whatever_the_order_of_the_joints() {
    let motion = read_text(&text("echo.yaml"), "echo.yaml", &ROBOT).unwrap();
    assert_same(&motion, "states.csv", "echo.yaml");
    assert_eq!(motion.message, "sensor_msgs/JointState");
}

#[test]
fn mcap_files_of_every_packing_and_byte_order_are_the_motion_of_the_csv() {
    for name in
        ["states_zstd.mcap", "states_lz4.mcap", "states_plain.mcap", "states_big_endian.mcap", "states_ros1.mcap"]
    {
        let motion = read_bag(&data(name), &ROBOT).unwrap();
        assert_same(&motion, "states.csv", name);
        assert_eq!((motion.format, motion.topic.as_deref()), ("MCAP bag", Some("/joint_states")), "{name}");
        assert_eq!(motion.dropped, ["gripper_finger_joint"], "{name}");
    }
    for name in ["plan.mcap", "nested_plan.mcap"] {
        assert_same(&read_bag(&data(name), &ROBOT).unwrap(), "plan.csv", name);
    }
}

/// A bag of zeros: 30 kB of chunks that each are within the bound of a chunk, or plain chunks in a
/// file that is packed as a whole.
#[test]
fn a_small_file_does_not_unpack_without_end() {
    for (compression, ending) in [(Some(mcap::Compression::Zstd), "mcap"), (None, "mcap.zstd")] {
        let mut bytes = Cursor::new(Vec::new());
        let options = mcap::WriteOptions::new().compression(compression).chunk_size(Some(16 << 20));
        let mut writer = options.create(&mut bytes).unwrap();
        let channel_id = writer.add_channel(0, "/zeros", "cdr", &BTreeMap::new()).unwrap();
        for sequence in 0..17 {
            let header = mcap::records::MessageHeader { channel_id, sequence, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, &vec![0; 16 << 20]).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        let mut bytes = bytes.into_inner();
        if compression.is_none() {
            bytes = zstd::bulk::compress(&bytes, 1).unwrap();
        }
        assert!(bytes.len() < 268_435, "{}", bytes.len());
        let path = std::env::temp_dir().join(format!("flexarm-unpack-{}.{ending}", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        let error = read_bag(&path, &ROBOT).unwrap_err().to_string();
        std::fs::remove_file(&path).unwrap();
        assert!(error.contains("it unpacks to more than 268435456 bytes"), "{ending}: {error}");
    }
}

#[test]
fn the_set_point_of_a_controller_is_taken_and_not_what_was_measured() {
    let motion = read_bag(&data("controller.mcap"), &ROBOT).unwrap();
    assert_same(&motion, "states.csv", "controller.mcap");
}

#[test]
fn sqlite_bags_and_folders_with_metadata_are_the_motion_of_the_csv() {
    let bags = ["bag_mcap", "bag_sqlite", "bag_messages_packed", "bag_file_packed"];
    for name in bags.into_iter().take(if cfg!(feature = "sqlite") { 4 } else { 1 }) {
        assert_same(&read_bag(&data(name), &ROBOT).unwrap(), "states.csv", name);
    }
    if cfg!(not(feature = "sqlite")) {
        let error = read_bag(&data("old.db3"), &ROBOT).unwrap_err().to_string();
        assert!(error.contains("feature sqlite"), "{error}");
        return;
    }
    assert_same(&read_bag(&data("old.db3"), &ROBOT).unwrap(), "states.csv", "old.db3");
    let packed = data("bag_file_packed/bag_file_packed.db3.zstd");
    let motion = read_bag(&packed, &ROBOT).unwrap();
    assert_same(&motion, "states.csv", "a packed file alone");
    assert_eq!(motion.format, "SQLite bag");
}

#[test]
fn of_two_topics_the_states_are_taken_and_the_choice_is_told_and_can_be_made() {
    let path = data("both.mcap");
    let motion = read_bag(&path, &ROBOT).unwrap();
    assert_eq!(motion.topic.as_deref(), Some("/joint_states"));
    let said = told(&motion);
    assert!(
        said.iter()
            .any(|line| line.starts_with("warning motion-topic") && line.contains("/arm_controller/controller_state")),
        "{said:#?}"
    );
    let asked = Request { topic: Some("arm_controller/controller_state"), ..ROBOT };
    let motion = read_bag(&path, &asked).unwrap();
    assert_eq!(motion.topic.as_deref(), Some("/arm_controller/controller_state"));
    assert!(!told(&motion).iter().any(|line| line.contains("motion-topic")));
}

#[test]
fn without_a_robot_every_joint_is_kept() {
    let motion = read_bag(&data("states_zstd.mcap"), &Request::default()).unwrap();
    assert_eq!(motion.trajectory.joints(), ["joint_1", "joint_2", "gripper_finger_joint"]);
    assert!(motion.dropped.is_empty());
}

#[test]
fn what_is_written_as_a_joint_trajectory_reads_back_as_the_same_motion() {
    let truth = truth("plan.csv");
    for format in [TextFormat::Yaml, TextFormat::Json] {
        // At the rate of the samples the pieces are the same polynomials.
        let text = write_joint_trajectory(&truth, 50.0, format).unwrap();
        let back = read_text(&text, "back", &Request::default()).unwrap();
        let [q, v, a] = differences(&back.trajectory, &truth);
        assert!(q < 1e-12 && v < 1e-10 && a < 1e-8, "{format:?}: {q:e} {v:e} {a:e}");
    }
}

#[test]
fn a_bag_that_is_cut_off_is_read_up_to_there_and_says_so() {
    let place = std::env::temp_dir().join(format!("flexarm-motion-cut-{}", std::process::id()));
    std::fs::create_dir_all(&place).unwrap();
    let folder = data("bag_sqlite/bag_sqlite.db3");
    let cut = |part: f64| {
        let whole = std::fs::read(&folder).unwrap();
        let path = place.join("cut.db3");
        std::fs::write(&path, &whole[..(part * whole.len() as f64) as usize]).unwrap();
        read_bag(&path, &ROBOT)
    };
    // A database has its pages in any order: the remainder is a part of the motion, or an error.
    let refusal = if cfg!(feature = "sqlite") { "cannot be read" } else { "feature sqlite" };
    for part in [0.9, 0.8, 0.6, 0.4] {
        match cut(part) {
            Ok(motion) => assert!(motion.samples <= 26 && motion.trajectory.duration() > 0.0),
            Err(error) => assert!(error.to_string().contains(refusal), "{part}: {error}"),
        }
    }
    for name in ["states_zstd.mcap", "states_lz4.mcap", "states_plain.mcap"] {
        let whole = std::fs::read(data(name)).unwrap();
        let path = place.join(name);
        let mut last = usize::MAX;
        for part in [0.75, 0.5, 0.4] {
            std::fs::write(&path, &whole[..(part * whole.len() as f64) as usize]).unwrap();
            match read_bag(&path, &ROBOT) {
                Ok(motion) => {
                    assert!(motion.samples < 27 && motion.samples <= last, "{name}");
                    last = motion.samples;
                    let d = motion.trajectory.duration();
                    assert!((d - 0.02 * (motion.samples - 1) as f64).abs() < 1e-9, "{name} {d}");
                    if part < 0.7 {
                        assert!(
                            told(&motion).iter().any(|line| line.contains("motion-cut")),
                            "{name}: {:#?}",
                            told(&motion)
                        );
                    }
                }
                Err(error) => assert!(
                    error.to_string().contains("end is missing") || error.to_string().contains("packed"),
                    "{error}"
                ),
            }
        }
    }
    std::fs::remove_dir_all(&place).unwrap();
}

// -------------------------------------------------------------------------------------------------------
// what is odd, as text

fn state(stamp_ns: i64, joints: &[(&str, f64, Option<f64>)]) -> String {
    let list = |values: Vec<String>| format!("[{}]", values.join(", "));
    let velocities: Vec<String> = joints
        .iter()
        .filter_map(|(_, _, v)| v.map(|v| if v.is_nan() { ".nan".into() } else { format!("{v:?}") }))
        .collect();
    format!(
        "header: {{stamp: {{sec: {}, nanosec: {}}}, frame_id: ''}}\nname: {}\nposition: {}\nvelocity: {}\neffort: []\n---\n",
        stamp_ns / 1_000_000_000,
        stamp_ns % 1_000_000_000,
        list(joints.iter().map(|(name, ..)| (*name).to_owned()).collect()),
        list(joints.iter().map(|(_, q, _)| if q.is_nan() { ".nan".into() } else { format!("{q:?}") }).collect()),
        list(velocities),
    )
}

const T0: i64 = 1_700_000_000_000_000_000;

fn at(motion: &MessageMotion, t: f64) -> Vec<f64> {
    let n = motion.trajectory.joints().len();
    let mut q = vec![0.0; n];
    motion.trajectory.sample(t, &mut q, &mut vec![0.0; n], &mut vec![0.0; n]);
    q
}

#[test]
fn publishers_of_different_joints_on_one_topic_keep_their_own_times() {
    // joint_1 every 10 ms; joint_2 every 25 ms, offset by 4 ms; a gripper in between.
    let mut messages: Vec<(i64, String)> = Vec::new();
    for k in 0..41 {
        let t = 10_000_000 * k;
        messages.push((t, state(T0 + t, &[("joint_1", 0.5 * (t as f64 * 1e-9), None)])));
    }
    for k in 0..16 {
        let t = 4_000_000 + 25_000_000 * k;
        messages.push((t, state(T0 + t, &[("joint_2", 1.0 - 2.0 * (t as f64 * 1e-9), None), ("finger", 0.1, None)])));
    }
    messages.sort_by_key(|(t, _)| *t);
    let text: String = messages.into_iter().map(|(_, text)| text).collect();
    let motion = read_text(&text, "two publishers", &ROBOT).unwrap();
    assert!((motion.trajectory.duration() - 0.4).abs() < 1e-12);
    let q = at(&motion, 0.2);
    assert!((q[0] - 0.1).abs() < 1e-9 && (q[1] - 0.6).abs() < 1e-9, "{q:?}");
    // Before its first sample, by less than two of its steps, it is extrapolated at its initial
    // speed, without a velocity jump at the start.
    assert!((at(&motion, 0.001)[1] - 0.998).abs() < 1e-9, "{:?}", at(&motion, 0.001));
    assert!(motion.trajectory.velocity_jumps().iter().all(|jump| jump.time_s == 0.0 || jump.time_s == 0.4));
    assert_eq!(motion.dropped, ["finger"]);
}

/// Truth: the messages left out.
#[test]
fn a_gap_between_messages_is_told_once_with_all_its_joints() {
    let message = |k: i64| {
        let q = (0.02 * k as f64).sin();
        state(T0 + 20_000_000 * k, &[("joint_1", q, None), ("joint_2", -q, None)])
    };
    let gaps = |kept: &dyn Fn(&i64) -> bool| -> Vec<String> {
        let text: String = (0..200).filter(kept).map(message).collect();
        let motion = read_text(&text, "t", &ROBOT).unwrap();
        let warnings = motion.trajectory.warnings().into_iter().map(|warning| warning.to_string());
        warnings.filter(|warning| warning.starts_with("no sample of")).collect()
    };
    assert_eq!(gaps(&|_| true), [] as [&str; 0]);
    let found = gaps(&|k| !(101..121).contains(k));
    let truth =
        "no sample of \"joint_1\", \"joint_2\" for 0.4200 s, from t = 2.0000 s to 2.4200 s (samples 101 and 102)";
    assert!(found.len() == 1 && found[0].starts_with(truth), "{found:?}");
}

#[test]
fn velocities_that_are_no_numbers_or_not_those_of_the_positions_are_not_used_and_told() {
    let wave = |k: i64| (0.2 * (k as f64) * 0.02 * std::f64::consts::PI).sin();
    let text = |v: &dyn Fn(i64) -> Option<f64>| -> String {
        (0..51).map(|k| state(T0 + 20_000_000 * k, &[("joint_1", wave(k), v(k))])).collect()
    };
    let plain = read_text(&text(&|_| None), "none", &ROBOT).unwrap();
    for (what, v) in [("zeros", Some(0.0)), ("nan", Some(f64::NAN))] {
        let motion = read_text(&text(&|_| v), what, &ROBOT).unwrap();
        assert_eq!(differences(&motion.trajectory, &plain.trajectory)[0], 0.0, "{what}");
    }
    let zeros = told(&read_text(&text(&|_| Some(0.0)), "zeros", &ROBOT).unwrap());
    assert!(zeros.iter().any(|line| line.contains("not those of the positions")), "{zeros:#?}");
    let mixed = told(&read_text(&text(&|k| Some(if k == 7 { f64::NAN } else { 0.1 })), "mixed", &ROBOT).unwrap());
    assert!(
        mixed.iter().any(|line| line.contains("not numbers at every sample") && line.contains("50 of 51")),
        "{mixed:#?}"
    );
}

#[test]
fn repeated_stamps_disorder_and_positions_that_are_no_numbers_are_left_out_and_told() {
    let mut text: String = (0..20).map(|k| state(T0 + 10_000_000 * k, &[("joint_1", 0.01 * k as f64, None)])).collect();
    text += &state(T0 + 190_000_000, &[("joint_1", 0.19, None)]);
    text += &state(T0 + 210_000_000, &[("joint_1", 0.21, None)]);
    text += &state(T0 + 200_000_000, &[("joint_1", 0.20, None)]);
    text += &state(T0 + 220_000_000, &[("joint_1", f64::NAN, None)]);
    text += &state(T0 + 230_000_000, &[("joint_1", 0.23, None)]);
    let motion = read_text(&text, "odd", &ROBOT).unwrap();
    assert_eq!(motion.samples, 23);
    assert!((at(&motion, 0.205)[0] - 0.205).abs() < 1e-9);
    let said = told(&motion).join("\n");
    assert!(said.contains("1 samples have the time of the one before"), "{said}");
    assert!(said.contains("1 samples came out of order"), "{said}");
    assert!(said.contains("1 of 25 positions are not numbers"), "{said}");
}

#[test]
fn plans_of_one_message_follow_each_other_and_a_start_that_is_told_is_where_the_motion_begins() {
    let plan = |from: f64, to: f64, first: f64| {
        format!(
            "{{joint_trajectory: {{joint_names: [joint_1], points: [{{positions: [{from}], velocities: [0], time_from_start: {first}}}, \
             {{positions: [{to}], velocities: [0], time_from_start: 1.0}}]}}}}"
        )
    };
    let text = format!("trajectory: [{}, {}]", plan(0.0, 0.5, 0.0), plan(0.5, 0.2, 0.0));
    let motion = read_text(&text, "two", &ROBOT).unwrap();
    assert_eq!(motion.trajectory.duration(), 2.0);
    assert!((at(&motion, 1.0)[0] - 0.5).abs() < 1e-12 && (at(&motion, 2.0)[0] - 0.2).abs() < 1e-12);

    let gap = format!("trajectory: [{}, {}]", plan(0.0, 0.5, 0.0), plan(0.7, 0.2, 0.0));
    let error = read_text(&gap, "gap", &ROBOT).unwrap_err().to_string();
    assert!(
        error.contains("trajectory 2 has joint \"joint_1\" at 0.7 where the one before ends with it at 0.5"),
        "{error}"
    );

    let start = "trajectory_start: {joint_state: {name: [joint_1], position: [-0.1]}}\n";
    let text = format!("{start}trajectory: [{}]", plan(0.0, 0.5, 0.25));
    let motion = read_text(&text, "start", &ROBOT).unwrap();
    assert_eq!(motion.trajectory.duration(), 1.0);
    assert!((at(&motion, 0.0)[0] + 0.1).abs() < 1e-12 && at(&motion, 0.25)[0].abs() < 1e-12);
    // Without it the motion begins with the first point, with a caveat.
    let motion = read_text(&format!("trajectory: [{}]", plan(0.0, 0.5, 0.25)), "no start", &ROBOT).unwrap();
    assert_eq!(motion.trajectory.duration(), 0.75);
    assert!(told(&motion).iter().any(|line| line.contains("the first point is at 0.25 s")));
}

#[test]
fn a_later_trajectory_takes_the_place_of_what_is_left_of_the_one_before() {
    let plan = |sec: i64, from: f64, to: f64| {
        format!(
            "header: {{stamp: {{sec: {sec}, nanosec: 0}}}}\njoint_names: [joint_1]\npoints:\n\
             - {{positions: [{from}], velocities: [0.0], time_from_start: {{sec: 0, nanosec: 0}}}}\n\
             - {{positions: [{to}], velocities: [0.0], time_from_start: {{sec: 2, nanosec: 0}}}}\n---\n"
        )
    };
    // The second begins five seconds later: the robot waits in between.
    let motion = read_text(&(plan(100, 0.0, 1.0) + &plan(105, 1.0, 0.0)), "wait", &ROBOT).unwrap();
    assert_eq!(motion.trajectory.duration(), 7.0);
    for t in [2.0, 3.0, 4.5, 5.0] {
        assert!((at(&motion, t)[0] - 1.0).abs() < 1e-12, "{t}: {:?}", at(&motion, t));
    }
    assert!((at(&motion, 6.0)[0] - 0.5).abs() < 1e-12);
    assert!(told(&motion).iter().any(|line| line.contains("2 trajectories: each begins at its header stamp")));
}

#[test]
fn a_stream_of_single_points_is_the_way_through_them() {
    // As in servoing: every 10 ms the goal for 10 ms later.
    let goal = |t: f64| 0.3 * (2.0 * t).sin();
    let text: String = (0..100)
        .map(|k| {
            // Some messages are slightly late; the goal corresponds to the actual time.
            let ns = 10_000_000 * k + [0, 200_000, 0, 350_000][k as usize % 4];
            let q = goal(1e-9 * (ns + 10_000_000) as f64);
            format!(
                "header: {{stamp: {{sec: 7, nanosec: {ns}}}}}\njoint_names: [joint_1]\npoints:\n- {{positions: [{q:?}], \
                 time_from_start: {{sec: 0, nanosec: 10000000}}}}\n---\n"
            )
        })
        .collect();
    let motion = read_text(&text, "servo", &ROBOT).unwrap();
    let mut worst = 0.0f64;
    for k in 0..990 {
        let t = 0.001 * f64::from(k);
        // Before an early message the path to the previous point is left slightly early; measured
        // 5.5e-6.
        worst = worst.max((at(&motion, t)[0] - goal(t + 0.01)).abs());
    }
    println!("stream of points: {worst:.1e} rad");
    assert!(worst < 2e-5, "{worst:e}");
    let fastest = motion.trajectory.peak()[0].velocity.value;
    // The goal moves at 0.6 rad/s; stops before late points would require a higher speed
    // afterwards.
    assert!(fastest < 0.65, "{fastest}");
    // A message that arrives halfway: the joint is between the points of the previous one, and
    // reverses.
    let plan = |sec: f64, to: f64| {
        format!(
            "header: {{stamp: {sec}}}\njoint_names: [joint_1]\npoints:\n- {{positions: [0.0], time_from_start: 0.5}}\n\
             - {{positions: [{to}], time_from_start: 1.5}}\n---\n"
        )
    };
    let motion = read_text(&(plan(100.0, 1.0) + &plan(101.0, 0.2)), "turn", &ROBOT).unwrap();
    assert!((at(&motion, 0.5)[0] - 0.5).abs() < 1e-12 && at(&motion, 1.0)[0].abs() < 1e-12);
    assert!((motion.trajectory.duration() - 2.0).abs() < 1e-12 && (at(&motion, 2.0)[0] - 0.2).abs() < 1e-12);
}

// -------------------------------------------------------------------------------------------------------------------
// refused

fn refusal(result: Result<MessageMotion, MotionError>) -> String {
    result.map(|motion| motion.trajectory.duration()).unwrap_err().to_string()
}

#[test]
fn what_is_wrong_with_a_text_is_told_with_its_line_and_column() {
    let points = "joint_names: [joint_1, joint_2]\npoints:\n";
    let cases = [
        ("a: [1, 2]\nb: [3, 4", "t:3:1: the text is neither YAML nor JSON:"),
        ("a: 1\nb: 2\n", "t: there is no motion in the text: expected a JointTrajectory (`joint_names` and `points`)"),
        (
            &format!("{points}- positions: [0.0]\n  time_from_start: 0.0\n"),
            "t:3:3: `positions` has 1 values for 2 joints; expected one for each name",
        ),
        (
            &format!(
                "{points}- {{positions: [0, 0], time_from_start: 0.0}}\n- {{positions: [0, 1, 2], time_from_start: 1.0}}\n"
            ),
            "t:4:3: `positions` has 3 values for 2 joints; expected one for each name (point 2)",
        ),
        (
            "name: [joint_1]\nposition: [0.0, 1.0]\n",
            "t:1:1: `position` has 2 values for 1 joints; expected one for each name",
        ),
        (
            &format!("{points}- positions: []\n  velocities: [1, 1]\n  time_from_start: 0.0\n"),
            "t:3:3: `positions` has 0 values for 2 joints; expected one for each name: a trajectory without positions",
        ),
        (
            &format!("{points}- positions: [0, 0]\n"),
            "t:3:3: point 1 has no `time_from_start`; expected sec and nanosec, or seconds",
        ),
        (
            &format!(
                "{points}- {{positions: [0, 0], time_from_start: 1.0}}\n- {{positions: [1, 1], time_from_start: 1.0}}\n"
            ),
            "t:4:3: point 2 is at 1 s, the one before it at 1 s: `time_from_start` must increase",
        ),
        (
            &format!("{points}- {{positions: [0, .nan], time_from_start: 1.0}}\n"),
            "t:3:3: joint \"joint_2\", point 1: the position is NaN; expected a finite number",
        ),
        (
            &format!("{points}- {{positions: [0, 0, '...'], time_from_start: 1.0}}\n"),
            "t:3:22: an array was shortened when it was printed; print it whole (ros2 topic echo --full-length, without --no-arr)",
        ),
        (
            &format!("{points}- {{positions: [0, 0], time_from_start: 0.0}}\n- '...'\n"),
            "t:4:3: an array was shortened when it was printed; print it whole (ros2 topic echo --full-length,",
        ),
        (
            "joint_names: [joint_1, '...']\npoints: []\n",
            "t:1:24: an array was shortened when it was printed; print it whole (ros2 topic echo --full-length,",
        ),
        (
            "joint_names: [joint_1]\npoints: '<sequence type: trajectory_msgs/msg/JointTrajectoryPoint, length: 9>'\n",
            "t:2:9: an array was shortened when it was printed; print it whole (ros2 topic echo --full-length, without --no-arr)",
        ),
        (
            &format!("{points}- {{time_from_start: 1.0}}\n"),
            "t:3:3: point 1 has no `positions`; expected a position for each joint; ros2 topic echo prints them all with --full-length",
        ),
        (
            &format!("{points}- {{positions: [0, zero], time_from_start: 1.0}}\n"),
            "t:3:19: `positions` is the text \"zero\"; expected numbers alone",
        ),
        (
            "joint_names: [joint_1, joint_1]\npoints:\n- {positions: [0, 0], time_from_start: 1.0}\n",
            "t:1:14: joint \"joint_1\" is named twice in one message",
        ),
        (
            "name: [joint_1]\nposition: [0.0]\n---\nname: [joint_1]\nposition: [0.1]\n",
            "t: the messages have no time stamps (`header`, `stamp`)",
        ),
        (
            &format!("{points}- {{positions: [0, 0], time_from_start: soon}}\n"),
            "t:3:40: `time_from_start` is the text \"soon\"; expected sec and nanosec, secs and nsecs, or seconds",
        ),
        (
            &format!("{points}- {{positions: [0, 0], time_from_start: 0}}\n"),
            "t: 1 rows of samples; expected at least 2",
        ),
        (
            "joint_names: [a, b]\npoints:\n- {positions: [0, 0], time_from_start: 0}\n- {positions: [0, 1], time_from_start: 1}\n",
            "t: none of the names \"a\", \"b\" is a joint of the robot, which has \"joint_1\", \"joint_2\"",
        ),
    ];
    for (text, expected) in cases {
        let found = refusal(read_text(text, "t", &ROBOT));
        assert!(found.starts_with(expected), "{text}\nfound    {found}\nexpected {expected}");
    }
    let backwards = state(T0 + 50_000_000_000, &[("joint_1", 0.0, None)]) + &state(T0, &[("joint_1", 1.0, None)]);
    let found = refusal(read_text(&backwards, "t", &ROBOT));
    assert!(found.starts_with("t: the time stamps jump back by 50 s at sample 2 of joint \"joint_1\""), "{found}");
    let found = refusal(read_text("a: 1", "t", &Request { topic: Some("/x"), ..ROBOT }));
    assert!(found.contains("a text of messages has none"), "{found}");
}

#[test]
fn aliases_that_multiply_and_deep_nesting_are_refused() {
    let mut bomb = "a0: &a0 [1,1,1,1,1,1,1,1,1,1]\n".to_owned();
    for k in 1..12 {
        let inner = format!("*a{}, ", k - 1).repeat(10);
        bomb += &format!("a{k}: &a{k} [{}]\n", inner.trim_end_matches(", "));
    }
    let found = refusal(read_text(&bomb, "t", &ROBOT));
    assert!(found.contains("more than 20000000 numbers"), "{found}");
    let found = refusal(read_text(&"[".repeat(100_000), "t", &ROBOT));
    assert!(found.contains("nested more than 40 deep") || found.contains("neither YAML"), "{found}");
}

#[test]
fn what_is_wrong_with_a_bag_is_told() {
    let asked = |topic| Request { topic: Some(topic), ..ROBOT };
    let found = refusal(read_bag(&data("both.mcap"), &asked("/nothing")));
    assert!(found.contains("the topic \"/nothing\" (topic) is not in the file; topics with motions are /arm_controller/controller_state (control_msgs/msg/JointTrajectoryControllerState, 26 messages)"), "{found}");
    let found = refusal(read_bag(&data("states_zstd.mcap"), &asked("/chatter")));
    assert!(found.contains("has messages of the type std_msgs/msg/String, which hold no motion"), "{found}");
    let other = Request { joints: Some(&["axis_1"]), topic: None };
    let found = refusal(read_bag(&data("states_zstd.mcap"), &other));
    assert!(
        found.contains("none of the names \"gripper_finger_joint\", \"joint_1\", \"joint_2\" is a joint of the robot"),
        "{found}"
    );
    let found = refusal(read_bag(&data(""), &ROBOT));
    assert!(found.contains("it has no metadata.yaml and files of several bags; give one of the files"), "{found}");
    let found = refusal(read_bag(&data("nothing"), &ROBOT));
    assert!(found.starts_with("cannot read motion "), "{found}");
}

/// Unrealistic sizes: no memory is allocated for them, and the problem is reported.
#[test]
fn sizes_that_a_bag_makes_up_are_refused() {
    let place = std::env::temp_dir().join(format!("flexarm-motion-sizes-{}", std::process::id()));
    std::fs::create_dir_all(&place).unwrap();
    let record = |kind: u8, length: u64, body: &[u8]| [&[kind][..], &length.to_le_bytes(), body].concat();
    let chunk = |packing: &str, size: u64, packed: &[u8]| {
        let name = [&(packing.len() as u32).to_le_bytes(), packing.as_bytes()].concat();
        let sizes = [&size.to_le_bytes()[..], &1_u32.to_le_bytes()].concat();
        let body = [&[0; 16][..], &sizes, &name, &(packed.len() as u64).to_le_bytes(), packed].concat();
        record(6, body.len() as u64, &body)
    };
    let long_text = [&[1, 0][..], &u32::MAX.to_le_bytes(), b"pkg"].concat();
    let cases = [
        (record(5, 1 << 50, b"bytes"), "has a length of 1125899906842624 bytes; the limit is 268435456"),
        (record(5, 200 << 20, b"bytes"), "its end is missing"),
        (record(3, long_text.len() as u64, &long_text), "a record ends within a value"),
        (chunk("zstd", 1 << 40, b"bytes"), "has a length of 1099511627776 bytes; the limit is 268435456"),
        (chunk("lz4", 1 << 20, b"bytes"), "its compressed content is damaged or incomplete"),
        (chunk("zstd", 1 << 20, b"bytes"), "its compressed content is damaged or incomplete"),
        (chunk("brotli", 1 << 20, b"bytes"), "a chunk is packed by \"brotli\"; read are zstd, lz4 and none"),
    ];
    for (bytes, expected) in cases {
        let path = place.join("made_up.mcap");
        std::fs::write(&path, [b"\x89MCAP0\r\n", &bytes[..]].concat()).unwrap();
        let found = refusal(read_bag(&path, &ROBOT));
        assert!(found.contains(expected) && found.contains("no motion before"), "{expected}: {found}");
    }
    std::fs::remove_dir_all(&place).unwrap();
}

#[test]
fn bytes_changed_anywhere_in_a_bag_end_in_a_motion_or_an_error() {
    let place = std::env::temp_dir().join(format!("flexarm-motion-bytes-{}", std::process::id()));
    std::fs::create_dir_all(&place).unwrap();
    let mut seed = 1_u64;
    let mut random = |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    for name in ["states_plain.mcap", "states_lz4.mcap", "states_zstd.mcap", "old.db3"] {
        let whole = std::fs::read(data(name)).unwrap();
        for _ in 0..60 {
            let mut bytes = whole.clone();
            for _ in 0..1 + random(8) {
                let at = random(bytes.len());
                bytes[at] = [0, 0xFF, 0x7F, random(256) as u8][random(4)];
            }
            let path = place.join(name);
            std::fs::write(&path, &bytes).unwrap();
            let read = read_bag(&path, &ROBOT);
            match read {
                Ok(motion) => assert!(motion.trajectory.duration() > 0.0),
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
    std::fs::remove_dir_all(&place).unwrap();
}
