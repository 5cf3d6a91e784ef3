//! Errors in a program: the cause as a variant with its numbers, the setting that fixes it as a
//! value, and a sentence with the library's own names.

use std::path::{Path, PathBuf};

use flexarm::errors::StepError;
use flexarm::links::LinkError;
use flexarm::links::reduce::{ReduceJob, ReduceOptions, UrdfEntry, reduce};
use flexarm::motions::AppliedLoad;
use flexarm::poses::ResponseRequest;
use flexarm::settings::Setting;
use flexarm::steppers::{ConstraintForm, SpookPreset, SpookSettings};
use flexarm::{Error, Fault, LinkModel, Modelling, Motion, Robot, RunOptions, StepperKind, Wrench};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..")
}

fn beam() -> (Robot, Motion) {
    let robot = Robot::load(root().join("robots/test/one_beam")).unwrap();
    let motion = Motion::from_samples(&[0.0, 1.0], &[0.0, 0.0], &robot).unwrap();
    (robot, motion)
}

/// Returns the error of a run with these options.
fn refused(modelling: Modelling, change: impl FnOnce(&mut RunOptions)) -> Error {
    let (robot, motion) = beam();
    let mut options = RunOptions::default();
    change(&mut options);
    robot.model(&modelling).and_then(|arm| arm.simulate(&motion, &options)).map(drop).expect_err("it is refused")
}

#[test]
fn a_number_that_makes_no_sense_is_a_value_with_what_is_expected() {
    let error = refused(Modelling::default(), |options| options.step_s = 2.0);
    assert!(matches!(error, Error::Value(_)));
    assert_eq!(error.to_string(), "the step (step_s 2 s) is longer than the motion (1 s)");
    assert_eq!(error.fault(), Fault::Input);
    let error = refused(Modelling::default(), |options| options.log_rate_hz = -1.0);
    assert_eq!(error.to_string(), "log_rate_hz: the log rate must be positive, found -1 Hz");
    let error = refused(Modelling::default(), |options| options.magnification = Some(1e9));
    let text = "the factor of deflections (magnification) is 1e9: expected one from 0.001 to 1000000";
    assert!(error.to_string().starts_with(text), "{error}");
}

#[test]
fn an_unstable_step_tells_the_largest_stable_one_and_what_to_set() {
    let error = refused(Modelling::default(), |options| (options.stepper, options.step_s) = (StepperKind::Rk4, 0.01));
    assert_eq!(error.fault(), Fault::Input);
    let Error::Step { source, partial: false } = error else { panic!("{error}") };
    assert_eq!(source.settings(), [Setting::Step, Setting::Stepper]);
    let StepError::UnstableStep { h, highest_hz, largest_s, .. } = source else { panic!("{source}") };
    // The stability limit of RK4 on the imaginary axis, 2 sqrt(2), with a margin for damping.
    assert!(h == 0.01 && largest_s < 2.9 / (std::f64::consts::TAU * highest_hz), "{h} {highest_hz} {largest_s}");
}

#[test]
fn a_model_that_no_link_has_is_told_with_the_count_that_was_asked_for() {
    let modal = Modelling { links: LinkModel::Modal, ..Modelling::default() };
    let error = refused(Modelling { segments: Some(3), ..modal }, |_| {});
    assert!(
        matches!(error, Error::Modelling(_)) && error.to_string().starts_with("3 segments are requested"),
        "{error}"
    );
    assert!(error.to_string().ends_with(": add links lumped"), "{error}");
    let spook = SpookSettings { form: ConstraintForm::Local, preset: SpookPreset::Exact };
    let error = refused(modal, |options| options.stepper = StepperKind::Spook(spook));
    assert!(matches!(error, Error::Step { source: StepError::ModalLinks, .. }), "{error}");
    assert_eq!(error.fault(), Fault::Input);
}

#[test]
fn poses_loads_and_responses_name_joint_frame_and_bound() {
    let (robot, _) = beam();
    let modelling = Modelling::default();
    let joints = robot.rigid_model().unwrap().n_actuated();
    let error = robot.model(&modelling).unwrap().modes(Some(&vec![0.0; joints + 1]), None, 3).unwrap_err();
    let text = format!("{} joint values given, the robot has {joints} movable joints: [", joints + 1);
    assert!(matches!(error, Error::Pose(_)) && error.to_string().starts_with(&text), "{error}");
    let error = robot.model(&modelling).unwrap().modes(Some(&vec![f64::NAN; joints]), None, 3).unwrap_err();
    assert!(error.to_string().ends_with("at NaN is at no finite number"), "{error}");
    let error = AppliedLoad::sampled("tcp", &[0.0, 0.0], &[Wrench::zeros(), Wrench::zeros()]).err().unwrap();
    assert!(matches!(error, Error::Load(_)) && error.to_string().contains("2 times"), "{error}");
    let request = ResponseRequest { points: 1, ..ResponseRequest::default() };
    let error = robot.model(&modelling).unwrap().response(None, &request).unwrap_err();
    assert_eq!(error.to_string(), "points must lie between 2 and 100000, found 1");
}

#[test]
fn what_the_link_maker_finds_has_one_place_beside_what_the_rest_finds() {
    let options = ReduceOptions::default();
    let refused = |job: &ReduceJob| reduce(job, &options, None, &mut |_| {}).unwrap_err();
    // A missing file is a file error for any function.
    let error = Error::from(ReduceJob::load(Path::new("no_such_mesh.msh")).unwrap_err());
    assert!(matches!(&error, Error::File { path, .. } if path == Path::new("no_such_mesh.msh")), "{error}");
    // An invalid number of a job is an error of the link maker.
    let mesh = root().join("crates/links/flexarm-fe-io/tests/data/three_blocks_v41_ascii.msh");
    let error = refused(&ReduceJob { modes: Some(2000), ..ReduceJob::for_mesh(&mesh) });
    assert!(matches!(error, Error::Link(LinkError::Job(_))), "{error}");
    assert_eq!(error.to_string(), "modes 2000: at most 1000 modes can be kept");
    // The robot of a job is read by the facade.
    let urdf =
        UrdfEntry { file: root().join("robots/kr210/no_such.urdf"), link: "link_2".into(), ..UrdfEntry::default() };
    let error = refused(&ReduceJob { urdf: Some(urdf), ..ReduceJob::for_mesh(&mesh) });
    assert!(matches!(error, Error::Urdf(_)), "{error}");
    assert_eq!(error.fault(), Fault::Input);
}
