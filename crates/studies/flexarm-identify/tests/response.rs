//! Stiffness and damping from hammer tests: tables and universal files, coverage of the intervals,
//! wrong units and positions.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use flexarm_identify::{
    Answer, Identification, IdentifyRequest, NominalArm, Parameter, Probe, ResponseSlopes, identify_robot, nominal,
    parameters, structure_slopes,
};
use flexarm_run::{Modelling, Robot};
use nalgebra::{Complex, Vector3};

const POSE: [f64; 6] = [0.1, -1.2, 1.5, 0.3, 0.7, 0.2];
/// Differences of the tested arm: parameter and factor.
const TRUTH: [(&str, f64); 4] = [
    ("link.link_2.stiffness_factor", 0.8),
    ("drive.joint_2.gearbox.stiffness", 1.25),
    ("drive.joint_3.gearbox.stiffness", 0.75),
    ("link.link_2.damping", 1.6),
];
/// Relative noise of each value.
const NOISE: f64 = 0.03;

struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-response-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn kr210() -> Robot {
    Robot::load(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210")).unwrap()
}

/// Normal numbers by Box and Muller from Steele's SplitMix64.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

/// The tested arm, and the test: excited at the tool along z and x, observed along z.
struct Test {
    nominal: NominalArm,
    hz: Vec<f64>,
}

impl Test {
    fn new(robot: &Robot) -> Self {
        let arm = robot.model(&Modelling::default()).unwrap();
        let all = parameters(&arm);
        let changed: Vec<Parameter> =
            TRUTH.iter().map(|(name, _)| all.iter().find(|p| p.name == *name).unwrap().clone()).collect();
        let x: Vec<f64> = TRUTH.iter().map(|(_, factor)| f64::ln(*factor)).collect();
        let hz = (0..50).map(|k| 4.0 + 0.9 * f64::from(k)).collect();
        Self { nominal: nominal(&arm).with(&changed, &x), hz }
    }

    fn response(&self, watched: Vector3<f64>, hit: Vector3<f64>) -> Vec<Complex<f64>> {
        let probe = |direction| Probe { frame: self.nominal.tool.clone(), direction };
        let omega: Vec<f64> = self.hz.iter().map(|hz| TAU * hz).collect();
        let found = structure_slopes(&self.nominal, &[], &POSE, &[probe(watched), probe(hit)]).unwrap();
        let ResponseSlopes { values, .. } = found.response(0, 1, Answer::Accelerance, &omega).unwrap();
        values
    }

    /// Adds proportional noise.
    fn noisy(&self, watched: Vector3<f64>, hit: Vector3<f64>, noise: &mut Noise) -> Vec<Complex<f64>> {
        let one = |H: Complex<f64>| H * Complex::new(NOISE * noise.normal(), NOISE * noise.normal()).exp();
        self.response(watched, hit).into_iter().map(one).collect()
    }
}

fn table(hz: &[f64], values: &[Complex<f64>], factor: f64) -> String {
    let row = |(f, H): (&f64, &Complex<f64>)| format!("{f:?},{:?},{:?}\n", factor * H.re, factor * H.im);
    "hz,re,im\n".to_owned() + &hz.iter().zip(values).map(row).collect::<String>()
}

fn head(extra: &str) -> String {
    let fit: Vec<&str> = TRUTH.iter().map(|(name, _)| *name).collect();
    format!("format = 1\nloss = \"square\"\nfit = {fit:?}\n{extra}\n")
}

fn entry(file: &str, hit: &str, unit: &str) -> String {
    format!(
        "[[response]]\nfile = {file:?}\njoints = {POSE:?}\nwatched_direction = \"z\"\nhit_direction = {hit:?}\nunit = {unit:?}\nstd = {NOISE}\n"
    )
}

fn told(found: &Identification) -> usize {
    let inside = |name: &str, factor: f64| {
        let p = found.parameters.iter().find(|p| p.name == name).unwrap();
        let truth = p.initial * factor;
        usize::from(p.interval[0] <= truth && truth <= p.interval[1])
    };
    TRUTH.iter().map(|(name, factor)| inside(name, *factor)).sum()
}

/// Truth: the tested arm. Of 160 intervals, 144 to 158 contain it by chance in 99 of 100 cases.
#[test]
fn stiffness_and_damping_come_back_from_noisy_responses_with_intervals_that_hold_them() {
    let robot = kr210();
    let test = Test::new(&robot);
    let place = Place::new("coverage");
    let (mut inside, mut all, mut squares, mut misfits) = (0, 0, 0.0, 0);
    let mut noise = Noise(17);
    for seed in 0..40 {
        let (z, x) = (Vector3::z(), Vector3::x());
        place.write("zz.csv", table(&test.hz, &test.noisy(z, z, &mut noise), 1.0));
        place.write("zx.csv", table(&test.hz, &test.noisy(z, x, &mut noise), 1e3));
        let file = head("") + &entry("zz.csv", "z", "m/s2/N") + &entry("zx.csv", "x", "mm/s2/N");
        let path = place.write("measurements.toml", file);
        let output = (seed == 0).then(|| place.0.join("out"));
        let asked = IdentifyRequest { output, overwrite: true, ..IdentifyRequest::default() };
        let found = identify_robot(&robot, &path, &asked).unwrap();
        assert!(found.parameters.iter().all(|p| p.identifiable), "{:?}", found.parameters);
        assert_eq!(found.numbers, 200);
        misfits += usize::from(found.misfit.is_some());
        (inside, all) = (inside + told(&found), all + TRUTH.len());
        for p in &found.parameters {
            let factor = TRUTH.iter().find(|(name, _)| *name == p.name).unwrap().1;
            squares += ((p.value / (p.initial * factor)).ln() * p.value / p.std).powi(2);
        }
        if seed > 0 {
            continue;
        }
        for p in &found.parameters {
            eprintln!("{}: {:.4} -> {:.4} +- {:.4}", p.name, p.initial, p.value, p.std);
        }
        eprintln!("residual {:.3} -> {:.3} {}", found.residual.before, found.residual.after, found.residual.unit);
        // The new robot file has the numbers, including damping.
        let text = std::fs::read_to_string(found.file.unwrap()).unwrap();
        assert!(text.contains("damping = { modal = 0.0") && text.contains("link.link_2.damping ="), "{text}");
        Robot::load(place.0.join("out")).unwrap();
    }
    // Scatter that chance gives once in 500 cases, in 40 fits of two responses each.
    assert!(misfits <= 1, "{misfits} fits with a misfit");
    // For a standard normal distribution over 160: 1 within 0.17 in 99 of 100 cases.
    let spread = (squares / all as f64).sqrt();
    eprintln!("{inside} of {all} intervals hold the truth, errors over deviations {spread:.3}");
    assert!((0.85..1.15).contains(&spread), "{spread}");
    assert!((144..=158).contains(&inside), "{inside} of {all}");
}

/// A universal file with two functions; node 3 is the tool.
fn universal(test: &Test, curves: &[(i64, Vec<Complex<f64>>)], binary: bool) -> Vec<u8> {
    let mut out = Vec::new();
    for (direction, values) in curves {
        let n = values.len();
        let kind = if binary {
            format!("58b     1     2          11  {:10}     0     0           0           0", 24 * n)
        } else {
            "58".into()
        };
        out.extend(format!("    -1\n    {kind}\nblow\nNONE\nNONE\nNONE\nNONE\n").bytes());
        out.extend(
            format!(
                "{:5}{:10}{:5}{:10} {:10}{:10}{:4} {:10}{:10}{:4}\n",
                4, 0, 0, 0, "NONE", 3, 3, "NONE", 3, direction
            )
            .bytes(),
        );
        out.extend(format!("{:10}{n:10}{:10}{:13.5E}{:13.5E}{:13.5E}\n", 6, 0, 0.0, 0.0, 0.0).bytes());
        out.extend(format!("{:10}{:5}{:5}{:5} {:20} {:20}\n", 18, 0, 0, 0, "Frequency", "Hz").bytes());
        out.extend(format!("{:10}{:5}{:5}{:5} {:20} {:20}\n", 12, 0, 0, 0, "Acceleration", "g").bytes());
        out.extend(format!("{:10}{:5}{:5}{:5} {:20} {:20}\n", 13, 0, 0, 0, "Force", "N").bytes());
        out.extend(b"         0    0    0    0 NONE                 NONE\n");
        for (hz, H) in test.hz.iter().zip(values) {
            let H = H / 9.80665;
            match binary {
                true => [*hz, H.re, H.im].iter().for_each(|x| out.extend(x.to_le_bytes())),
                false => out.extend(format!("{hz:21.13E}{:21.13E}{:21.13E}\n", H.re, H.im).bytes()),
            }
        }
        out.extend(b"\n    -1\n");
    }
    out
}

/// Truth: without noise, the tested arm for any format of its responses.
#[test]
fn tables_and_universal_files_of_one_test_tell_the_same() {
    let robot = kr210();
    let test = Test::new(&robot);
    let place = Place::new("universal");
    let (z, x) = (Vector3::z(), Vector3::x());
    let curves = [(3, test.response(z, z)), (1, test.response(z, x))];
    place.write("text.uff", universal(&test, &curves, false));
    place.write("binary.uff", universal(&test, &curves, true));
    place.write("zz.csv", table(&test.hz, &curves[0].1, 1.0));
    let polar =
        curves[1].1.iter().zip(&test.hz).map(|(H, f)| format!("{f:?};{:?};{:?}\n", H.norm(), H.arg().to_degrees()));
    place.write("zx.csv", "hz;magnitude;phase\n".to_owned() + &polar.collect::<String>());
    let node = "[node.3]\nxyz = [0, 0, 0]\n";
    let files = |name: &str| format!("[[response]]\nfile = {name:?}\njoints = {POSE:?}\nstd = 0.01\n");
    let with = |name: &str| head(node) + &files(name);
    let degrees = |text: String| text.replace("format = 1\n", "format = 1\nangle = \"deg\"\n");
    let in_degrees = POSE.map(f64::to_degrees);
    let tables = degrees(head("") + &entry("zz.csv", "z", "m/s2/N") + &entry("zx.csv", "x", "m/s2/N"))
        .replace(&format!("{POSE:?}"), &format!("{in_degrees:?}"));
    let complex = with("binary.uff").replace("std = 0.01", "std = 0.0001\nform = \"complex\"");
    for (name, text) in
        [("text", with("text.uff")), ("binary", with("binary.uff")), ("tables", tables), ("complex", complex)]
    {
        let path = place.write("measurements.toml", text);
        let found = identify_robot(&robot, &path, &IdentifyRequest::default()).unwrap();
        for (p, (_, factor)) in found.parameters.iter().map(|p| (p, TRUTH.iter().find(|(n, _)| *n == p.name).unwrap()))
        {
            // Without noise, the prior alone pulls, by a small part of the deviation.
            let error = (p.value - p.initial * factor).abs() / p.std;
            assert!(error < 0.05, "{name}, {}: {error:e}", p.name);
        }
        let worst = found.parameters.iter().map(|p| {
            let factor = TRUTH.iter().find(|(n, _)| *n == p.name).unwrap().1;
            (p.value / (p.initial * factor) - 1.0).abs()
        });
        eprintln!("{name}: off by {:.1e}", worst.fold(0.0, f64::max));
    }
    for (change, parts) in [
        (["[node.3]", "[node.4]"], &["no [node.3]", "\"4\""][..]),
        (["xyz = [0, 0, 0]", "link = \"lnk\""], &["no moving link \"lnk\"", "link_2"]),
        (["std = 0.01", "std = 0.01\nunit = \"m/N\""], &["times as large", "unit"]),
        (["std = 0.01", "std = 0.01\nunit = \"kg\""], &["unit = \"kg\" is not known", "m/s2/N"]),
        (["std = 0.01", "std = 0.01\nfrom = 1000.0"], &["no nonzero value from 1000"]),
        (["std = 0.01", "std = 0.01\nwatched = \"3\""], &["contains nodes and directions"]),
    ] {
        let path = place.write("wrong.toml", with("text.uff").replace(change[0], change[1]));
        let error = identify_robot(&robot, &path, &IdentifyRequest::default()).unwrap_err().to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
}

/// Truth: the shape of the arm itself.
#[test]
fn shapes_of_modes_tell_how_stiffness_is_shared() {
    let robot = kr210();
    let test = Test::new(&robot);
    let place = Place::new("shapes");
    let arm = robot.model(&Modelling::default()).unwrap();
    let frame = |link: &str| nominal(&arm).model.frame(link).unwrap().clone();
    let (links, axes) = (["link_3", "link_4", "link_6"], [("x", Vector3::x()), ("z", Vector3::z())]);
    let probes: Vec<Probe> =
        links.iter().flat_map(|link| axes.map(|(_, direction)| Probe { frame: frame(link), direction })).collect();
    let found = structure_slopes(&test.nominal, &[], &POSE, &probes).unwrap();
    let mut text = head("");
    links.iter().for_each(|link| text += &format!("[node.{link}]\nlink = {link:?}\n"));
    for mode in 0..3 {
        let phi = found.shapes.column(mode);
        let seen: Vec<f64> = found.structure.rows.iter().map(|row| -7.0 * (row * phi)[0]).collect();
        let nodes: Vec<&str> = links.iter().flat_map(|link| [*link; 2]).collect();
        let directions: Vec<&str> = links.iter().flat_map(|_| axes.map(|(name, _)| name)).collect();
        text += &format!(
            "[[shape]]\njoints = {POSE:?}\nnodes = {nodes:?}\ndirections = {directions:?}\namplitudes = {seen:?}\nstd = 0.002\n"
        );
    }
    let hz: Vec<f64> = found.omega2.iter().take(3).map(|w2| w2.sqrt() / TAU).collect();
    text += &format!("[[frequency]]\njoints = {POSE:?}\nhz = {hz:?}\nstd = 0.01\n");
    let path = place.write("measurements.toml", text.replace(", \"link.link_2.damping\"", ""));
    let answer = identify_robot(&robot, &path, &IdentifyRequest::default()).unwrap();
    for shape in &answer.shapes {
        eprintln!(
            "{}: mode {}, assurance {:.4} -> {:.10}",
            shape.reading, shape.mode, shape.assurance_before, shape.assurance
        );
        assert!(shape.assurance > 1.0 - 1e-9 && shape.assurance_before < 0.99999);
    }
    for p in &answer.parameters {
        let factor = TRUTH.iter().find(|(name, _)| *name == p.name).unwrap().1;
        eprintln!("{}: {:.6} of {:.6}", p.name, p.value, p.initial * factor);
        assert!((p.value - p.initial * factor).abs() < 0.05 * p.std, "{}", p.name);
    }
}

/// Truth: the dampers of the tested arm, each changed by its own factor. A single factor for all
/// six would mix the dampers.
#[test]
fn dampers_of_a_gearbox_of_six_come_back_one_by_one() {
    let place = Place::new("dampers");
    let home = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210_identified").canonicalize().unwrap();
    let text = std::fs::read_to_string(home.join("robot.toml")).unwrap();
    let urdf = home.join("kr210_identified.urdf");
    let six =
        "gearbox = { stiffness = [2e8, 2e8, 4e8, 6e6, 8e6, 3376721.9], damping = [2e5, 2e5, 4e5, 6e3, 8e3, 4481.0] }";
    let text = text
        .replace("\"kr210_identified.urdf\"", &format!("{urdf:?}"))
        .replace("gearbox = { stiffness = 3376721.9, damping = 4481.0 }", six)
        .lines()
        .filter(|line| !line.starts_with("default_trajectory"))
        .fold(String::new(), |all, line| all + line + "\n");
    place.write("robot.toml", text);
    let robot = Robot::load(&place.0).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    let name = |k: usize| format!("drive.joint_2.gearbox.damping[{k}]");
    let dampers: Vec<Parameter> =
        (0..6).map(|k| parameters(&arm).into_iter().find(|p| p.name == name(k)).unwrap()).collect();
    let factors = [1.0, 1.0, 1.0, 1.6, 0.6, 1.3];
    let nominal = nominal(&arm).with(&dampers, &factors.map(f64::ln));
    let hz: Vec<f64> = (0..80).map(|k| 3.0 + 0.5 * f64::from(k)).collect();
    let omega: Vec<f64> = hz.iter().map(|hz| TAU * hz).collect();
    let mut job = "format = 1\nfit = [\"drive.joint_2.gearbox.damping\"]\n".to_owned();
    for (axis, direction) in [("x", Vector3::x()), ("y", Vector3::y()), ("z", Vector3::z())] {
        let probe = Probe { frame: nominal.tool.clone(), direction };
        let found = structure_slopes(&nominal, &[], &POSE, &[probe.clone(), probe]).unwrap();
        let values = found.response(0, 1, Answer::Accelerance, &omega).unwrap().values;
        place.write(&format!("{axis}.csv"), table(&hz, &values, 1.0));
        job += &format!(
            "[[response]]\nfile = \"{axis}.csv\"\njoints = {POSE:?}\nwatched_direction = \"{axis}\"\nhit_direction = \"{axis}\"\n\
             unit = \"m/s2/N\"\nstd = 0.01\n"
        );
    }
    let path = place.write("measurements.toml", job);
    let output = Some(place.0.join("out"));
    let found = identify_robot(&robot, &path, &IdentifyRequest { output, ..IdentifyRequest::default() }).unwrap();
    assert_eq!(found.parameters.len(), 6);
    let mut told = 0;
    for ((p, before), factor) in found.parameters.iter().zip(&dampers).zip(factors) {
        assert_eq!(p.name, before.name);
        let off = p.value / (before.initial * factor) - 1.0;
        eprintln!("{}: {off:.1e}, told {}", p.name, p.identifiable);
        if p.identifiable {
            told += 1;
            assert!(off.abs() < 1e-2, "{}: {off:e}", p.name);
        }
    }
    assert!(told >= 3, "{told}");
    let again = Robot::load(place.0.join("out")).unwrap().model(&Modelling::default()).unwrap();
    for (p, found) in
        parameters(&again).iter().filter(|p| p.name.starts_with("drive.joint_2.gearbox.damping")).zip(&found.parameters)
    {
        assert!((p.initial / found.value - 1.0).abs() < 1e-2, "{}", p.name);
    }
    // The page draws the curves.
    let page = std::fs::read_to_string(found.page.unwrap()).unwrap();
    assert_eq!(page.matches("<h2>Response: ").count(), 3);
}
