//! Arms whose last three axes intersect: three joints position the intersection point, three rotate
//! the tool about it.

use flexarm_spatial::Pose;
use nalgebra::Vector3;

use super::position::{PositionForm, place};
use super::screw::Screw;
use super::trig::{CirclePlane, across, angle_about};
use super::{Candidates, Kind, STRAIGHT};

/// Pose-independent data of the solver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wrist {
    pub(crate) axes: [Screw; 6],
    /// Intersection point at zero joint values (m).
    pub(crate) center: Vector3<f64>,
    pub(crate) form: PositionForm,
    pub(crate) fan: CirclePlane,
    pub(crate) reach: f64,
}

impl Wrist {
    /// `center`: intersection of axes 4 to 6 at zero joint values (m, world); `reach`: size of the
    /// arm (m).
    pub(crate) fn new(axes: [Screw; 6], center: Vector3<f64>, form: PositionForm, reach: f64) -> Self {
        let fan = CirclePlane::new(&axes[3].h, &axes[4].h, &axes[5].h);
        Self { axes, center, form, fan, reach }
    }

    /// Finds all joint values with `E_1 ... E_6 = G`.
    ///
    /// `E_1 E_2 E_3 c = G c` for the intersection point c. With `Q = (R_1 R_2 R_3)ᵀ G_R`, the angle
    /// of joint 5 follows from `h_4 · R_5 h_6 = h_4 · Q h_6`, that of joint 4 from
    /// `R_4 R_5 h_6 = Q h_6`, and that of joint 6 from the remaining rotation.
    pub(crate) fn solve(&self, G: &Pose, hint: &[f64; 6], found: &mut Candidates) {
        let [s1, s2, s3, s4, s5, s6] = &self.axes;
        let p = G.rotation * self.center + G.translation.vector;
        let n = across(&s6.h);
        let (tip, side) = (G.rotation * s6.h, G.rotation * n);
        // Joints 1 to 3 from the position of c.
        let base = [self.axes[0], self.axes[1], self.axes[2]];
        let places = place(self.form, &base, &self.center, &p, &[hint[0], hint[1], hint[2]], self.reach);
        for (group, three) in places.as_slice().iter().enumerate() {
            let [q1, q2, q3] = three.q;
            // Q h_6 and Q n, with n across h_6.
            let (t1, t2, t3) = (s1.at(q1).inverse(), s2.at(q2).inverse(), s3.at(q3).inverse());
            let Q = |v: &Vector3<f64>| t3.vector(&t2.vector(&t1.vector(v)));
            let (tip, side) = (Q(&tip), Q(&side));
            for &q5 in self.fan.angles(&s4.h, &tip).angles() {
                let t5 = s5.at(q5);
                let with_fourth = |q4: f64| {
                    let rest = t5.inverse().vector(&s4.at(q4).inverse().vector(&side));
                    [q1, q2, q3, q4, q5, angle_about(&s6.h, &n, &rest).0]
                };
                let (q4, size) = angle_about(&s4.h, &t5.vector(&s6.h), &tip);
                // Axes 4 and 6 are in line: joint 4 is free, and the hint is one of its values.
                if size < STRAIGHT {
                    found.add(with_fourth(hint[3]), Kind::Representative { group });
                    found.add(with_fourth(q4), Kind::Member { group });
                } else {
                    found.add(with_fourth(q4), Kind::Single { free: three.free });
                }
            }
        }
    }
}
