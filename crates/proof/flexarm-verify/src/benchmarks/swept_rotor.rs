//! A turning blade with a swept tip: its modes against solids in CalculiX.
//!
//! The aluminium strip of Epps & Chandra (1996) is meshed here, reduced with geometric stiffness, and
//! turned about an axis near its root.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use flexarm::links::reduce::{ReduceJob, ReduceOptions, ReduceOutputs, reduce};
use flexarm::{Modelling, Robot};

use super::FOLDER;
use crate::Error;
use crate::bench::{Bench, columns};

/// One inch (m).
const INCH: f64 = 0.0254;
/// Distance of the root from the axis, lengths of the straight and the swept part, width and
/// thickness (m).
const ROOT: f64 = 2.5 * INCH;
const STRAIGHT: f64 = 31.5 * INCH;
const SWEPT: f64 = 6.0 * INCH;
const WIDTH: f64 = INCH;
const THICKNESS: f64 = 0.063 * INCH;
/// Numbers of elements along the straight and the swept part, and across.
const ALONG: usize = 84;
const TIP: usize = 16;
const ACROSS: usize = 4;
/// Distance from the corner over which cross sections turn into the mitre (m).
const BLEND: f64 = 2.0 * INCH;
/// Nodes of a HEX20 element on a grid of half elements, in CalculiX's order.
const HEX20: [[usize; 3]; 20] = [
    [0, 0, 0],
    [2, 0, 0],
    [2, 2, 0],
    [0, 2, 0],
    [0, 0, 2],
    [2, 0, 2],
    [2, 2, 2],
    [0, 2, 2],
    [1, 0, 0],
    [2, 1, 0],
    [1, 2, 0],
    [0, 1, 0],
    [1, 0, 2],
    [2, 1, 2],
    [1, 2, 2],
    [0, 1, 2],
    [0, 0, 1],
    [2, 0, 1],
    [2, 2, 1],
    [0, 2, 1],
];
/// Number of frequencies of each truth.
pub(super) const COUNT: usize = 8;

/// Frequencies at one sweep angle and speed.
pub(super) struct Spin {
    pub(super) sweep_deg: f64,
    pub(super) speed_rpm: f64,
    /// Frequencies (Hz), and their truth.
    pub(super) found_hz: Vec<f64>,
    pub(super) truth_hz: Vec<f64>,
}

impl Spin {
    /// Returns the maximum relative error of the frequencies.
    pub(super) fn error(&self) -> f64 {
        let errors = self.found_hz.iter().zip(&self.truth_hz).map(|(found, truth)| (found / truth - 1.0).abs());
        if self.found_hz.len() == COUNT { errors.fold(0.0, f64::max) } else { f64::NAN }
    }

    /// Returns whether a swept blade turns, which couples bending and torsion.
    pub(super) fn is_coupled(&self) -> bool {
        self.sweep_deg > 0.0 && self.speed_rpm > 0.0
    }
}

/// Computes the frequencies at all sweep angles and speeds of the truth.
pub(super) fn spins(bench: &Bench, progress: &mut dyn FnMut(f64)) -> Result<Vec<Spin>, Error> {
    let names =
        ["sweep[deg]", "speed[rpm]", "f1[Hz]", "f2[Hz]", "f3[Hz]", "f4[Hz]", "f5[Hz]", "f6[Hz]", "f7[Hz]", "f8[Hz]"];
    let truth = columns(&bench.file(&format!("{FOLDER}/swept_rotor/truth.csv")), names)?;
    let folder = Scratch::new(&bench.scratch)?;
    let (mut spins, mut robot): (Vec<Spin>, Option<Robot>) = (Vec::new(), None);
    for (row, [sweep_deg, speed_rpm, truth_hz @ ..]) in truth.iter().enumerate() {
        progress(row as f64 / truth.len() as f64);
        if spins.last().is_none_or(|spin| spin.sweep_deg != *sweep_deg) {
            robot = None;
        }
        let robot = match &mut robot {
            Some(robot) => robot,
            none => none.insert(blade(&folder.0, sweep_deg.to_radians())?),
        };
        let table = robot.model(&Modelling::default())?.modes(None, Some(&[speed_rpm * TAU / 60.0]), COUNT)?;
        let found_hz = table.undamped_frequencies_hz;
        spins.push(Spin { sweep_deg: *sweep_deg, speed_rpm: *speed_rpm, found_hz, truth_hz: truth_hz.to_vec() });
    }
    Ok(spins)
}

/// Folder for the files of the blade, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(within: &Path) -> Result<Self, Error> {
        let folder = within.join(format!("flexarm-verify-{}", std::process::id()));
        std::fs::create_dir_all(&folder).map_err(|e| fault(&folder, &e))?;
        Ok(Self(folder))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn fault(path: &Path, error: &std::io::Error) -> Error {
    flexarm::Error::File { path: path.to_owned(), what: error.to_string() }.into()
}

/// Makes the blade: mesh, reduced link and robot.
fn blade(folder: &Path, sweep: f64) -> Result<Robot, Error> {
    let tip = [ROOT + STRAIGHT + SWEPT * sweep.cos(), -SWEPT * sweep.sin()];
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).map(|()| path.clone()).map_err(|e| fault(&path, &e))
    };
    // The mesh, reduced between root and tip with geometric stiffness.
    write("blade.inp", &mesh(sweep))?;
    let job = format!(
        r#"mesh = "blade.inp"
link = "blade"
units = "m-kg-s"
modes = 16
geometric = true
material = {{ E = 73.0844e9, nu = 0.325, rho = 2682.46 }}
interface = [
    {{ name = "A", select = "ROOT", xyz = [{ROOT}, 0.0, 0.0] }},
    {{ name = "B", select = "TIP", xyz = [{}, {}, 0.0] }},
]
"#,
        tip[0], tip[1]
    );
    let job = ReduceJob::parse(&job, &folder.join("blade.reduce.toml")).map_err(flexarm::Error::from)?;
    let outputs = ReduceOutputs { folder: None, flex: Some(folder.join("blade.flex")), overwrite: true };
    reduce(&job, &ReduceOptions::default(), Some(&outputs), &mut |_| {})?;
    // A robot that turns it about the axis, without gravity.
    let urdf = format!(
        r#"<robot name="rotor">
  <link name="base"/>
  <link name="blade"/>
  <link name="tip"/>
  <joint name="spin" type="continuous"><parent link="base"/><child link="blade"/><axis xyz="0 0 1"/></joint>
  <joint name="end" type="fixed"><parent link="blade"/><child link="tip"/><origin xyz="{} {} 0"/></joint>
</robot>
"#,
        tip[0], tip[1]
    );
    write("rotor.urdf", &urdf)?;
    let robot = r#"format = 1
urdf = "rotor.urdf"
tcp = { link = "tip" }
gravity = [0.0, 0.0, 0.0]
flexible_link = [
    { link = "blade", distal = "end", model = "modal", modes = 16, geometric_stiffening = true, reduced = "blade.flex" },
]
"#;
    Ok(Robot::load(&write("robot.toml", robot)?)?)
}

/// Returns the position (m) of a node: half elements along, across and through the blade.
fn position(sweep: f64, [i, j, k]: [usize; 3]) -> [f64; 3] {
    let (y, z) = ((j as f64 / (2 * ACROSS) as f64 - 0.5) * WIDTH, (k as f64 / 2.0 - 0.5) * THICKNESS);
    let s = (i as f64 - (2 * ALONG) as f64) / 2.0;
    let s = s * if s < 0.0 { STRAIGHT / ALONG as f64 } else { SWEPT / TIP as f64 };
    let lean = y * (sweep / 2.0).tan() * (1.0 - s.abs() / BLEND).max(0.0);
    if s <= 0.0 {
        return [ROOT + STRAIGHT + s + lean, y, z];
    }
    let (x, sin, cos) = (s - lean, sweep.sin(), sweep.cos());
    [ROOT + STRAIGHT + x * cos + y * sin, y * cos - x * sin, z]
}

/// Returns the mesh of a blade, 400 HEX20 elements, as an input file of CalculiX.
fn mesh(sweep: f64) -> String {
    let mut numbers = std::collections::BTreeMap::new();
    let (mut nodes, mut elements) = (String::new(), String::new());
    for i in 0..ALONG + TIP {
        for j in 0..ACROSS {
            let own = HEX20.map(|[a, b, c]| {
                let at = [2 * i + a, 2 * j + b, c];
                let next = numbers.len() + 1;
                *numbers.entry(at).or_insert_with(|| {
                    let [x, y, z] = position(sweep, at);
                    let _ = writeln!(nodes, "{next}, {x}, {y}, {z}");
                    next
                })
            });
            let own: Vec<String> = own.iter().map(usize::to_string).collect();
            let _ = writeln!(elements, "{}, {},\n{}", i * ACROSS + j + 1, own[..10].join(", "), own[10..].join(", "));
        }
    }
    let set = |name: &str, end: usize| {
        let own = numbers.iter().filter(|(at, _)| at[0] == end).map(|(_, number)| format!("{number},\n"));
        format!("*NSET, NSET={name}\n{}", own.collect::<String>())
    };
    let sets = [set("ROOT", 0), set("TIP", 2 * (ALONG + TIP))].concat();
    format!("*NODE\n{nodes}*ELEMENT, TYPE=C3D20, ELSET=BLADE\n{elements}{sets}")
}
