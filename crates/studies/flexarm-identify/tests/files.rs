//! Practical measurements and typical mistakes: axes of instruments, loads with inertia, units of
//! loads, joints in another order.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use flexarm_identify::{
    Component, Identification, IdentifyRequest, LoadCase, MeasuredArm, Measurements, Parameter, PlanRequest, Reading,
    ReadingKind, Row, Target, identify_robot, nominal, parameters, plan_measurements,
};
use flexarm_kinematics::Wrench;
use flexarm_run::{Error, Modelling, Robot};
use flexarm_testkit::Draw;
use nalgebra::{DVector, Rotation3, Vector3};

/// Noise of a laser tracker (m).
const NOISE: f64 = 3e-5;
const TRUTH: [f64; 6] = [0.4, -0.5, 0.3, -0.4, 0.5, -0.3];

fn robot() -> Robot {
    Robot::load(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210_identified")).unwrap()
}

struct Place {
    folder: PathBuf,
    robot: Robot,
    draw: Draw,
    parameters: Vec<Parameter>,
}

/// Poses with the applied load.
type Loads = Vec<(Vec<f64>, LoadCase)>;

impl Drop for Place {
    fn drop(&mut self) {
        let _gone = std::fs::remove_dir_all(&self.folder);
    }
}

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-identify-files-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let robot = robot();
        let arm = robot.model(&Modelling::default()).unwrap();
        let parameters = parameters(&arm).into_iter().filter(|p| p.name.ends_with(".stiffness")).collect();
        Self { folder, robot, draw: Draw(9), parameters }
    }

    fn normal(&mut self) -> f64 {
        let (u, v) = (self.draw.between(1e-12, 1.0), self.draw.between(0.0, std::f64::consts::TAU));
        (-2.0 * u.ln()).sqrt() * v.cos()
    }

    fn poses(&mut self, count: usize) -> Vec<Vec<f64>> {
        let middle = [0.0, -0.9, 1.2, 0.0, 0.3, 0.0];
        let pose = |draw: &mut Draw| -> Vec<f64> {
            [1.5, 0.6, 0.7, 2.0, 1.2, 2.0].iter().zip(middle).map(|(range, m)| m + range * draw.signed()).collect()
        };
        (0..count).map(|_| pose(&mut self.draw)).collect()
    }

    /// Displacements (m) of the measured arm between two loads, with noise.
    fn shown(&mut self, loads: &[(Vec<f64>, LoadCase)], target: Option<Vector3<f64>>) -> Vec<[f64; 3]> {
        let arm = self.robot.model(&Modelling::default()).unwrap();
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let readings = loads.iter().map(|(q, load)| {
            let kind = match target {
                None => ReadingKind::Displacement {
                    before: LoadCase::none(),
                    after: load.clone(),
                    point: Vector3::new(0.4, 0.0, 0.0),
                    rows: axes.map(|d| Row { of: Component::along(d), value: 0.0, std: NOISE }).to_vec(),
                },
                Some(_) => ReadingKind::Place {
                    load: load.clone(),
                    target: 0,
                    instrument: 0,
                    rows: (0..3).map(|of| Row { of, value: 0.0, std: NOISE }).collect(),
                },
            };
            Reading { name: "a".into(), q: q.clone(), kind }
        });
        let measurements = Measurements {
            readings: readings.collect(),
            targets: target.map(Target::Known).into_iter().collect(),
            instruments: vec![flexarm_identify::Instrument::Known(nalgebra::IsometryMatrix3::identity())],
            ..Measurements::default()
        };
        let model = MeasuredArm { nominal: &nominal(&arm), parameters: &self.parameters, measurements: &measurements };
        let values = model.predicted(&DVector::from_column_slice(&TRUTH)).unwrap();
        values.chunks_exact(3).map(|d| [0, 1, 2].map(|k| d[k] + NOISE * self.normal())).collect()
    }

    fn pulls(&mut self, count: usize) -> (Loads, Vec<[f64; 3]>) {
        let loads: Loads = self
            .poses(count)
            .into_iter()
            .enumerate()
            .map(|(k, q)| {
                let force = [-Vector3::z(), Vector3::x(), Vector3::y()][k % 3] * 2000.0;
                (
                    q,
                    LoadCase {
                        wrench: Wrench::new(force, Vector3::zeros()),
                        at: Vector3::new(0.4, 0.0, 0.0),
                        ..LoadCase::none()
                    },
                )
            })
            .collect();
        let shown = self.shown(&loads, None);
        (loads, shown)
    }

    /// Writes a table of pulls in m and rad.
    fn table(&self, loads: &[(Vec<f64>, LoadCase)], shown: &[[f64; 3]], force: f64) {
        let mut text = String::from("joint_1,joint_2,joint_3,joint_4,joint_5,joint_6,fx,fy,fz,dx,dy,dz\n");
        for ((q, load), d) in loads.iter().zip(shown) {
            q.iter().for_each(|q| write!(text, "{q},").unwrap());
            let f = load.wrench.force * force;
            writeln!(text, "{},{},{},{},{},{}", f.x, f.y, f.z, d[0], d[1], d[2]).unwrap();
        }
        std::fs::write(self.folder.join("pulls.csv"), text).unwrap();
    }

    fn identify(&self, text: &str) -> Result<Identification, Error> {
        let path = self.folder.join("job.toml");
        std::fs::write(&path, text).unwrap();
        let output = Some(self.folder.join("out"));
        identify_robot(&self.robot, &path, &IdentifyRequest { output, overwrite: true, ..IdentifyRequest::default() })
    }

    /// Errors over deviations of the identified parameters.
    fn off(found: &Identification) -> Vec<f64> {
        let z = |(p, x): (&flexarm_identify::FittedParameter, &f64)| (p.value - p.initial * x.exp()) / p.std;
        found.parameters.iter().zip(&TRUTH).filter(|(p, _)| p.identifiable).map(z).collect()
    }
}

const JOB: &str = "format = 1\n[[displacement]]\nfile = \"pulls.csv\"\nload = { at = [0.4, 0, 0] }\npoint = [0.4, 0, 0]\nstd = 3e-5\n";

/// Truth: the synthetic arm and the rotation of the instrument.
#[test]
fn displacements_in_the_axes_of_an_instrument_are_refused_without_it_and_met_with_it() {
    let mut place = Place::new("axes");
    let (loads, shown) = place.pulls(18);
    let rpy = [0.3, -0.2, 2.0];
    let R_WI = Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]);
    let seen: Vec<[f64; 3]> = shown.iter().map(|d| (R_WI.inverse() * Vector3::from(*d)).into()).collect();
    place.table(&loads, &seen, 1.0);
    let error = place.identify(JOB).unwrap_err().to_string();
    assert!(
        error.contains("axes of the instrument") && error.contains("rpy = [17.") && error.contains("114."),
        "{error}"
    );
    for (entry, known) in [(format!("rpy = {rpy:?}"), true), (String::new(), false)] {
        let job = format!("{JOB}instrument = \"tracker\"\n[instrument.tracker]\n{entry}\n");
        let found = place.identify(&job).unwrap();
        let off = Place::off(&found);
        eprintln!("known {known}: {off:.2?}");
        assert!(found.misfit.is_none() && off.len() == 6 && off.iter().all(|z| z.abs() < 4.0), "{off:?}");
        assert_eq!(found.instruments.is_empty(), known);
        if let Some(frame) = found.instruments.first() {
            assert!(frame.rpy.iter().zip(rpy).all(|(a, b)| (a - b).abs() < 1.5e-2), "{:?}", frame.rpy);
        }
        let page = std::fs::read_to_string(place.folder.join("out/identification.html")).unwrap();
        assert_eq!(page.contains("Instrument tracker"), !known);
        assert!(page.contains("Residuals of displacements [mm]"));
        assert!(!page.contains("measured and expected"));
    }
}

#[test]
fn joint_values_in_another_order_are_recognised_of_displacements_and_places() {
    let mut place = Place::new("order");
    let (mut loads, shown) = place.pulls(18);
    // A table whose columns are named from the tool to the base.
    loads.iter_mut().for_each(|(q, _)| q.reverse());
    place.table(&loads, &shown, 1.0);
    let error = place.identify(JOB).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("[\"joint_6\", \"joint_5\", \"joint_4\", \"joint_3\", \"joint_2\", \"joint_1\"]"), "{text}");
    assert_eq!(error.fault(), flexarm_run::Fault::Input);
    // Positions, with two joints exchanged.
    let target = Vector3::new(0.0, 0.05, 0.03);
    let loads: Vec<_> = place.poses(20).into_iter().map(|q| (q, LoadCase::none())).collect();
    let shown = place.shown(&loads, Some(target));
    let mut text = String::from("joint_1,joint_2,joint_3,joint_5,joint_4,joint_6,x,y,z\n");
    for ((q, _), p) in loads.iter().zip(&shown) {
        q.iter().for_each(|q| write!(text, "{q},").unwrap());
        writeln!(text, "{},{},{}", p[0] + 1.0, p[1], p[2]).unwrap();
    }
    std::fs::write(place.folder.join("places.csv"), text).unwrap();
    let job =
        "format = 1\n[instrument.t]\n[target.b]\nxyz = [0, 0.05, 0.03]\n[[place]]\nfile = \"places.csv\"\nstd = 3e-5\n";
    let text = place.identify(job).unwrap_err().to_string();
    assert!(text.contains("\"joint_3\", \"joint_5\", \"joint_4\", \"joint_6\"]"), "{text}");
}

#[test]
fn kilograms_given_as_newtons_and_newtons_given_as_kilograms_are_told_with_the_slip() {
    let mut place = Place::new("kg");
    let (loads, shown) = place.pulls(18);
    place.table(&loads, &shown, 1.0 / 9.81);
    let told = |found: &Identification| found.caveats.iter().find(|caveat| caveat.code == "load-unit").cloned();
    let caveat = told(&place.identify(JOB).unwrap()).expect("kg as N");
    eprintln!("{}", caveat.message);
    assert!(caveat.likely.contains("kg given as N") && caveat.value.is_some_and(|ratio| (5.0..20.0).contains(&ratio)));
    place.table(&loads, &shown, 1.0);
    assert!(told(&place.identify(JOB).unwrap()).is_none());
    // A load of 100 kg at the tool, entered as 981.
    let carried =
        flexarm_kinematics::SpatialInertia::from_com(100.0, &Vector3::new(0.4, 0.0, 0.0), &nalgebra::Matrix3::zeros());
    let loads: Vec<_> = place.poses(18).into_iter().map(|q| (q, LoadCase { carried, ..LoadCase::none() })).collect();
    let shown = place.shown(&loads, None);
    for (mass, slipped) in [(981.0, true), (100.0, false)] {
        let mut text = String::from("joint_1,joint_2,joint_3,joint_4,joint_5,joint_6,mass,cx,cy,cz,dx,dy,dz\n");
        for ((q, _), d) in loads.iter().zip(&shown) {
            q.iter().for_each(|q| write!(text, "{q},").unwrap());
            writeln!(text, "{mass},0.4,0,0,{},{},{}", d[0], d[1], d[2]).unwrap();
        }
        std::fs::write(place.folder.join("pulls.csv"), text).unwrap();
        let found = place.identify(&JOB.replace("load = { at = [0.4, 0, 0] }\n", "")).unwrap();
        assert_eq!(told(&found).is_some_and(|caveat| caveat.likely.contains("N given as kg")), slipped);
        if !slipped {
            let off = Place::off(&found);
            assert!(off.len() >= 4 && off.iter().all(|z| z.abs() < 4.0), "{off:?}");
        }
    }
}

/// Truth: frequencies of the arm itself; a load with 1 kg m² about its centre lowers them.
#[test]
fn inertia_of_loads_and_relative_deviations_of_frequencies_count() {
    let place = Place::new("hz");
    let job = |load: &str, std: &str| {
        format!("format = 1\n[[frequency]]\njoints = [0, -1, 1, 0, 0.5, 0]\n{load}\nhz = [8.0, 10.0]\n{std}\n")
    };
    let expected = |load: &str| {
        let found = place.identify(&job(load, "std_relative = 0.01")).unwrap();
        found.compared.iter().map(|c| (c.before, c.std)).collect::<Vec<_>>()
    };
    let point = expected("load = { mass = 50, com = [0, 0, 0.2] }");
    let body = expected("load = { mass = 50, com = [0, 0, 0.2], inertia = [20, 20, 20, 0, 0, 0] }");
    assert!(body[0].0 < point[0].0 - 1e-3, "{body:?} {point:?}");
    // One per cent of each frequency, and the error of the model.
    assert!((body[0].1 / body[1].1 - 0.8).abs() < 1e-9 && body[0].1 >= 0.08, "{body:?}");
    let refused = |load: &str, std: &str, part: &str| {
        let error = place.identify(&job(load, std)).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    };
    refused("load = { mass = 50, inertia = [20, 1, 1, 0, 0, 0] }", "std = 0.1", "which are not physical");
    refused("load = { inertia = [1, 1, 1, 0, 0, 0] }", "std = 0.1", "no mass");
    refused("", "std = 0.1\nstd_relative = 0.01", "keep one of them");
    // The frequencies of the arm itself in rad/s.
    let own = expected("");
    let radians = own.iter().map(|(hz, _)| (std::f64::consts::TAU * hz).to_string()).collect::<Vec<_>>().join(", ");
    let error = place.identify(&job("", "").replace("8.0, 10.0", &radians)).unwrap_err().to_string();
    assert!(error.contains("divide numbers in rad/s by 2 pi"), "{error}");
}

/// Truth: the synthetic position of the target. It is declared with an error of 1 mm and a
/// deviation of 1 mm.
#[test]
fn a_target_that_is_known_with_a_deviation_is_found_between_what_is_said_and_what_is_seen() {
    let mut place = Place::new("target");
    let target = Vector3::new(0.3, 0.05, 0.03);
    let loads: Vec<_> = place
        .poses(24)
        .into_iter()
        .enumerate()
        .map(|(k, q)| {
            let wrench = Wrench::new(Vector3::new(0.0, 0.0, -2000.0 * (k % 2) as f64), Vector3::zeros());
            (q, LoadCase { wrench, at: Vector3::new(0.4, 0.0, 0.0), ..LoadCase::none() })
        })
        .collect();
    let shown = place.shown(&loads, Some(target));
    let mut text = String::from("joint_1,joint_2,joint_3,joint_4,joint_5,joint_6,fx,fy,fz,x,y,z\n");
    for ((q, load), p) in loads.iter().zip(&shown) {
        q.iter().for_each(|q| write!(text, "{q},").unwrap());
        writeln!(text, "0,0,{},{},{},{}", load.wrench.force.z, p[0], p[1], p[2]).unwrap();
    }
    std::fs::write(place.folder.join("places.csv"), text).unwrap();
    let job = |std: &str| {
        format!(
            "format = 1\n[instrument.t]\nxyz = [0, 0, 0]\nrpy = [0, 0, 0]\nstd = 1e-3\nstd_rotation = 1e-3\n[target.b]\nxyz = [0.301, 0.05, 0.03]\n\
             {std}\n[[place]]\nfile = \"places.csv\"\nload = {{ at = [0.4, 0, 0] }}\nstd = 3e-5\n"
        )
    };
    let found = place.identify(&job("std = 1e-3")).unwrap();
    let off = Place::off(&found);
    let b = Vector3::from(found.targets[0].xyz);
    eprintln!("target {:.1e} m off, {off:.2?}, misfit {:?}", (b - target).norm(), found.misfit);
    assert!((b - target).norm() < 1e-4 && found.misfit.is_none() && off.iter().all(|z| z.abs() < 4.0), "{off:?}");
    // Declared as exact: the readings do not fit.
    assert!(place.identify(&job("")).unwrap().misfit.is_some());
}

#[test]
fn plans_and_identifications_tell_what_check_tells_of_the_robot() {
    let mut place = Place::new("check");
    let urdf = place.robot.urdf_path.canonicalize().unwrap();
    let text = std::fs::read_to_string(&place.robot.path).unwrap();
    // A payload of thirteen times the mass of the robot.
    let text = text.replace("\"kr210_identified.urdf\"", &format!("{urdf:?}"));
    let text: String = text.lines().filter(|l| !l.starts_with("default_")).fold(String::new(), |all, l| all + l + "\n");
    let text = text + "\n[payload]\nlink = \"tool0\"\nmass = 12000.0\ncom = [0.1, 0.0, 0.2]\n";
    std::fs::write(place.folder.join("robot.toml"), text).unwrap();
    place.robot = Robot::load(&place.folder).unwrap();
    let findings = flexarm_run::check(&place.folder, None, &flexarm_run::LoadOptions::default());
    let told: Vec<&str> = findings.iter().filter(|f| f.code == "payload-mass").map(|f| f.code.as_str()).collect();
    assert!(!told.is_empty(), "{findings:?}");
    let plan = plan_measurements(&place.robot, &PlanRequest::new(8)).unwrap();
    assert!(plan.caveats.iter().any(|caveat| caveat.code == "payload-mass"), "{:?}", plan.caveats);
    assert!(plan.warnings.iter().any(|text| text.contains("payload")), "{:?}", plan.warnings);
}

/// Two dial gauge readings of 1 mm where the robot file predicts half of it.
#[test]
fn what_the_readings_know_less_than_within_a_factor_of_two_is_not_claimed() {
    let place = Place::new("gauge");
    let reading = |q2: f64| {
        format!(
            "[[displacement]]\njoints = [0, {q2}, 1.2, 0, 0.3, 0]\nload = {{ force = [0, 0, -500] }}\ndirection = [0, 0, 1]\n\
             value = -0.001\nstd = 3e-5\n"
        )
    };
    let found = place.identify(&format!("format = 1\nuncertainty = 1000\n{}{}", reading(-0.9), reading(-0.7))).unwrap();
    for p in &found.parameters {
        eprintln!("{}: {:.3e} +- {:.1e}, told {}", p.name, p.value, p.std, p.identifiable);
        match p.identifiable {
            true => assert!(p.std / p.value <= 2f64.ln(), "{p:?}"),
            false => assert!(p.std.is_nan(), "{p:?}"),
        }
    }
    let json = serde_json::to_value(&found).unwrap();
    let third = &json["parameters"][2];
    assert!(third["std"].is_null() && third["identifiable"] == false, "{third}");
}
