//! Prints the reference arm as text, rigid (6 coordinates), flexible (18) and with three elastic
//! joints a link (42), for programs that know no URDF with elastic joints:
//! `cargo run --release -p flexarm-testkit --example reference_arm_text`.
//!
//! A line `model NAME` starts each model; then one line per moving body, parents before children:
//!
//! ```text
//! kind  parent  axis(3)  R_PJ(9, rows)  p_PJ(3)  mass  com(3)  Ixx Ixy Ixz Iyy Iyz Izz      about the com, body axes
//! ```
//! `kind` is revolute, prismatic or elastic; `parent` counts bodies from 1, 0 is the world. SI
//! units.
#![allow(clippy::print_stdout, reason = "printing is what this example is for")]
#![allow(non_snake_case, reason = "monogram notation, as in the crates under test")]

use flexarm_kinematics::{JointMotion, Model};
use flexarm_testkit::{arm_of_parts, reference_arm};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arms =
        [("rigid6", reference_arm(false).mechanism), ("flexible18", arm_of_parts(1)), ("flexible42", arm_of_parts(3))];
    for (name, mechanism) in arms {
        let model = Model::new(&mechanism)?;
        println!("model {name}");
        for body in &model.bodies()[1..] {
            let (kind, axis) = match body.motion {
                JointMotion::Axis(motion) if motion.slides() => ("prismatic", motion.axis()),
                JointMotion::Axis(motion) => ("revolute", motion.axis()),
                JointMotion::Elastic(_) => ("elastic", nalgebra::Vector3::zeros()),
                JointMotion::Welded => ("fixed", nalgebra::Vector3::zeros()),
                JointMotion::Interface { .. } => ("interface", nalgebra::Vector3::zeros()),
            };
            let (R, I) = (body.X_PJ.rotation.matrix(), body.inertia.inertia_com());
            let numbers = axis
                .iter()
                .chain(R.transpose().iter())
                .chain(body.X_PJ.translation.vector.iter())
                .copied()
                .chain([body.inertia.mass])
                .chain(body.inertia.com().iter().copied())
                .chain([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|entry| I[entry]))
                .map(|x: f64| (x + 0.0).to_string())
                .collect::<Vec<_>>();
            println!("{kind} {} {}", body.parent, numbers.join(" "));
        }
    }
    Ok(())
}
