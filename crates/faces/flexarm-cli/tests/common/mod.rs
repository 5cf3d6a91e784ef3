//! Helpers of the command-line tests: a temporary folder with a small robot, the program, its
//! answers.

pub(crate) mod flex;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

use serde_json::Value;

/// Whether the programs that a test starts ignore a signal, because the tests themselves were
/// started that way: by nohup (SIGHUP, 1), in the background of a shell (SIGINT, 2).
#[cfg(unix)]
pub(crate) fn is_ignored(signal: u32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    ignored & (1 << (signal - 1)) != 0
}

/// Signal of Ctrl-C, or if that is ignored, of a job scheduler.
#[cfg(unix)]
pub(crate) fn stop_signal() -> &'static str {
    if is_ignored(2) { "-TERM" } else { "-INT" }
}

/// A beam on a vertical axis with a ball at its end; flexible in [`ROBOT`].
pub(crate) const URDF: &str = r#"<?xml version="1.0"?>
<robot name="beam">
  <link name="base"/>
  <joint name="swing" type="revolute">
    <parent link="base"/>
    <child link="bar"/>
    <axis xyz="0 0 1"/>
    <limit lower="-3.0" upper="3.0" effort="500" velocity="4"/>
  </joint>
  <link name="bar">
    <inertial>
      <origin xyz="0.4 0 0"/>
      <mass value="1.728"/>
      <inertia ixx="0.000288" ixy="0" ixz="0" iyy="0.0923904" iyz="0" izz="0.0922176"/>
    </inertial>
  </link>
  <joint name="weld" type="fixed">
    <parent link="bar"/>
    <child link="ball"/>
    <origin xyz="0.8 0 0"/>
  </joint>
  <link name="ball">
    <inertial>
      <mass value="0.5"/>
      <inertia ixx="0.000125" ixy="0" ixz="0" iyy="0.000125" iyz="0" izz="0.000125"/>
    </inertial>
  </link>
</robot>
"#;

/// Flexible description of the beam; every line that a test replaces is unique.
pub(crate) const ROBOT: &str = r#"format = 1
name = "beam"
urdf = "beam.urdf"
tcp = { link = "ball" }
gravity = [0.0, 0.0, -9.81]

[[flexible_link]]
link = "bar"
distal = "weld"
damping = { modal = 0.03 }
beam = { section = "rectangle", width = 0.02, height = 0.04, material = "aluminium", y_axis = [0.0, 1.0, 0.0] }
"#;

/// A fast swing of 60 degrees and a rest; 1 s.
pub(crate) const SWING: &str = r#"format = 1
unit = "deg"
joints = ["swing"]
start = [0.0]
profile = "quintic"

[[move]]
to = [60.0]
duration = 0.5
hold = 0.5
"#;

/// Relative path and bytes of every file, and an empty entry for every folder.
pub(crate) type Snapshot = BTreeMap<PathBuf, Vec<u8>>;

/// A temporary folder, removed at the end of its test. The program runs in it.
pub(crate) struct Place {
    folder: PathBuf,
}

impl Place {
    /// Creates a folder with `beam.urdf`, `robot.toml` and `swing.toml`.
    pub(crate) fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("flexarm-cli-{}-{count}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let place = Self { folder };
        place.write("beam.urdf", URDF);
        place.write("robot.toml", ROBOT);
        place.write("swing.toml", SWING);
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub(crate) fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).unwrap()
    }

    /// The program, to be run in this folder, without package paths from outside.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexarm"));
        command.args(arguments).current_dir(&self.folder).stdin(Stdio::null());
        for name in ["ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "GAZEBO_MODEL_PATH"] {
            command.env_remove(name);
        }
        command
    }

    pub(crate) fn flexarm(&self, arguments: &[&str]) -> Answer {
        Answer::of(self.command(arguments).output().unwrap())
    }

    /// Runs, requires success and returns the one JSON object on standard output.
    pub(crate) fn json(&self, arguments: &[&str]) -> Value {
        let answer = self.flexarm(&[arguments, &["--json"]].concat());
        assert_eq!(answer.code, 0, "{arguments:?}: {}", answer.err);
        answer.json()
    }

    /// The command must exit with 2, mention every word on standard error, print nothing, and leave
    /// all files unchanged.
    pub(crate) fn refused(&self, arguments: &[&str], words: &[&str]) -> Answer {
        self.refused_by(&mut self.command(arguments), words)
    }

    pub(crate) fn refused_by(&self, command: &mut Command, words: &[&str]) -> Answer {
        let before = self.snapshot();
        let answer = Answer::of(command.output().unwrap());
        let arguments: Vec<&OsStr> = command.get_args().collect();
        assert_eq!(answer.code, 2, "{arguments:?} said {:?} and {:?}", answer.out, answer.err);
        assert_eq!(answer.out, "", "{arguments:?} printed on stdout");
        answer.says(words);
        assert!(self.snapshot() == before, "{arguments:?} touched files");
        answer
    }

    pub(crate) fn snapshot(&self) -> Snapshot {
        fn walk(folder: &Path, top: &Path, found: &mut Snapshot) {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let name = path.strip_prefix(top).unwrap().to_owned();
                if path.is_dir() {
                    found.insert(name, Vec::new());
                    walk(&path, top, found);
                } else {
                    found.insert(name, std::fs::read(&path).unwrap());
                }
            }
        }
        let mut found = Snapshot::new();
        walk(&self.folder, &self.folder, &mut found);
        found
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// Result of a run of the program.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Answer {
    pub(crate) fn of(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the program prints UTF-8");
        let (out, err) = (text(output.stdout), text(output.stderr));
        assert!(!err.contains("panicked"), "{err}");
        let code = output.status.code().unwrap_or_else(|| panic!("ended by a signal: {err}"));
        Self { code, out, err }
    }

    /// Every word must be in the message.
    pub(crate) fn says(&self, words: &[&str]) {
        for word in words {
            assert!(self.err.contains(word), "{word:?} is not in the message:\n{}", self.err);
        }
    }

    /// Standard output must be one line with one JSON object.
    pub(crate) fn json(&self) -> Value {
        assert_eq!(self.out.trim_end().lines().count(), 1, "more than one line: {}", self.out);
        let value: Value = serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e}: {}", self.out));
        assert!(value.is_object());
        value
    }
}

/// Replaces one piece of the text, which must exist.
pub(crate) fn with(text: &str, old: &str, new: &str) -> String {
    assert!(text.contains(old), "{old:?} is not in the text");
    text.replacen(old, new, 1)
}

/// Number of the first line that contains the piece, from 1.
pub(crate) fn line_of(text: &str, piece: &str) -> usize {
    text.lines().position(|l| l.contains(piece)).unwrap_or_else(|| panic!("{piece:?} is not in the text")) + 1
}

/// Pseudorandom bytes, reproducible (xorshift).
pub(crate) fn garbage(length: usize, seed: u64) -> Vec<u8> {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    (0..length)
        .map(|_| {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            (x >> 32) as u8
        })
        .collect()
}

/// A shipped robot.
pub(crate) fn shipped_robot(name: &str) -> String {
    format!("{}/../../../robots/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// A shipped trajectory.
pub(crate) fn shipped_trajectory(file: &str) -> String {
    format!("{}/../../../trajectories/{file}", env!("CARGO_MANIFEST_DIR"))
}

/// A JSON array of numbers.
pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// A JSON array of rows of numbers.
pub(crate) fn matrix(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

/// A table written by the program: names of the columns, and complete rows.
pub(crate) struct Table {
    pub(crate) names: Vec<String>,
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Table {
    pub(crate) fn parse(text: &str) -> Self {
        assert!(text.ends_with('\n'), "the last line is not complete: {:?}", text.lines().last());
        let mut lines = text.lines();
        let names: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let row = |line: &str| {
            let values: Vec<f64> =
                line.split(',').map(|x| x.parse().unwrap_or_else(|e| panic!("{x:?} ({e}) in {line}"))).collect();
            assert_eq!(values.len(), names.len(), "ragged: {line}");
            values
        };
        let rows = lines.map(row).collect();
        Self { names, rows }
    }

    pub(crate) fn column(&self, name: &str) -> Vec<f64> {
        let k =
            self.names.iter().position(|n| n == name).unwrap_or_else(|| panic!("no column {name}: {:?}", self.names));
        self.rows.iter().map(|r| r[k]).collect()
    }

    /// `sqrt(x² + y² + z²)` of three columns.
    pub(crate) fn length(&self, names: [&str; 3]) -> Vec<f64> {
        let [x, y, z] = names.map(|n| self.column(n));
        (0..x.len()).map(|k| (x[k] * x[k] + y[k] * y[k] + z[k] * z[k]).sqrt()).collect()
    }
}

/// Reads the records of an MCAP file from its first magic to its last; returns the count of each
/// opcode.
pub(crate) fn mcap_records(bytes: &[u8]) -> BTreeMap<u8, usize> {
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    assert!(bytes.starts_with(MAGIC), "no MCAP magic at the start");
    assert!(bytes.ends_with(MAGIC), "no MCAP magic at the end: the file is not closed");
    let mut records = BTreeMap::new();
    let mut rest = &bytes[MAGIC.len()..bytes.len() - MAGIC.len()];
    while !rest.is_empty() {
        let length = u64::from_le_bytes(rest[1..9].try_into().unwrap()) as usize;
        *records.entry(rest[0]).or_insert(0) += 1;
        rest = rest.get(9 + length..).expect("a record that is cut off");
    }
    assert_eq!(records.get(&DATA_END), Some(&1), "{records:?}");
    assert_eq!(records.get(&FOOTER), Some(&1), "{records:?}");
    records
}

const FOOTER: u8 = 0x02;
const DATA_END: u8 = 0x0f;

/// Path of a reference data file, in the folder FLEXARM_SHARED or beside the project.
pub(crate) fn reference(name: &str) -> PathBuf {
    let named = std::env::var_os("FLEXARM_SHARED").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|folder| folder.join("shared"));
    let found = named.into_iter().chain(above).map(|shared| shared.join("fe").join(name)).find(|path| path.exists());
    found.unwrap_or_else(|| panic!("there is no fe/{name} below FLEXARM_SHARED or beside the project"))
}
