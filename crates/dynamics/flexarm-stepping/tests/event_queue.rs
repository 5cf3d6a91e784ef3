//! Order of the events of a run.

use std::sync::Arc;

use flexarm_kinematics::{Joint, JointKind, Link, LinkInertia, Mechanism, Model, Pose, SpatialInertia};
use flexarm_stepping::internals::EventQueue;
use flexarm_stepping::*;
use nalgebra::{Matrix3, Matrix6, Vector3};

/// Times that differ by less than this are equal (s).
const SAME_TIME: f64 = 1e-9;

/// A motion at rest whose velocity is said to jump at given times.
struct Jumps(Vec<f64>);

impl PrescribedMotion for Jumps {
    fn sample(&self, _t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        [q, qdot, qddot].into_iter().for_each(|x| x.fill(0.0));
    }

    fn velocity_jumps(&self) -> Vec<f64> {
        self.0.clone()
    }
}

fn plant(jumps: &[f64], sample_s: Option<f64>) -> Plant {
    let mut slide = Mechanism::new("slide");
    slide.links.push(Link { name: "base".into(), inertia: None });
    let inertia = LinkInertia { mass: 2.0, com: Vector3::zeros(), inertia_com: Matrix3::identity() };
    slide.links.push(Link { name: "body".into(), inertia: Some(inertia) });
    slide.joints.push(Joint::new("x", JointKind::Prismatic(Vector3::x_axis()), "base", "body", Pose::identity()));
    let model = Arc::new(Model::new(&slide).unwrap());
    let motion = Arc::new(Jumps(jumps.to_vec()));
    let mut plant = Plant::new::<(String, Matrix6<f64>, Damping)>(Arc::clone(&model), vec![], motion).unwrap();
    plant.servo = sample_s.map(|sample_s| Arc::new(Servo { sample_s, axes: Vec::new(), rigid: model }));
    plant
}

fn queue(jumps: &[f64], sample_s: Option<f64>) -> EventQueue {
    EventQueue::of(&plant(jumps, sample_s))
}

#[test]
fn what_is_asked_for_at_a_jump_belongs_to_the_side_from_which_it_is_asked() {
    let mut events = queue(&[0.5, 0.5 + 0.4 * SAME_TIME, 0.7], None);
    assert_eq!(events.side(0.3), 0.3);
    assert!(events.side(0.5) < 0.5 && events.side(0.6) < 0.5);
    let (before, after) = events.pass_jumps(0.5).unwrap();
    assert!(before < 0.5 && after > 0.5 + 0.4 * SAME_TIME, "both jumps are over at once: {before} {after}");
    assert!(events.side(0.5) > 0.5 && events.side(0.6) == 0.6 && events.side(0.8) < 0.7);
    assert_eq!(events.pass_jumps(0.6), None);
}

/// A step that ends at an event up to rounding ends exactly there: no second step of the length
/// of a rounding error.
#[test]
fn an_event_at_the_end_of_a_step_but_for_rounding_is_at_its_end() {
    let events = queue(&[0.1 + 0.2], None);
    assert_eq!(events.next(0.2, 0.3), Some(0.3));
    assert_eq!(events.next(0.2, 0.25), Some(0.1 + 0.2));
}

/// Truth: a clock of 1 ms has 1001 samples from 0 to 1 s, whether times are sums of steps or
/// multiples of them.
#[test]
fn a_controller_takes_each_sample_once() {
    for h in [1e-3, 2.5e-4] {
        let mut events = queue(&[], Some(1e-3));
        let (mut t, mut sum, mut taken) = (0.0, 0.0, [0, 0]);
        taken[0] += usize::from(events.sample_due(t));
        while sum < 1.0 - 0.5 * h {
            sum += h;
            t = events.next(t, sum).unwrap().min(sum);
            taken[usize::from(t > 0.5 + SAME_TIME)] += usize::from(events.sample_due(t));
            assert!(!events.sample_due(t));
            assert_eq!(t, sum, "samples are at ends of steps");
        }
        assert_eq!(taken, [501, 500], "{h}");
    }
}

#[test]
fn a_payload_is_carried_from_its_time_on_and_not_before() {
    let change = |t: f64| InertiaChange { t, body: 1, inertia: SpatialInertia::zeros() };
    let mut plant = plant(&[], None);
    plant.inertia_changes = vec![change(0.5), change(0.5), change(0.9)];
    let mut events = EventQueue::of(&plant);
    assert!(events.change_before(0.5).is_none() && events.due_change(0.4).is_none());
    let numbers: Vec<usize> = std::iter::from_fn(|| events.due_change(0.5).map(|(number, _)| number)).collect();
    assert_eq!(numbers, [0, 1]);
    assert!(events.due_change(0.6).is_none() && events.change_before(1.0).is_some());
}
