//! The arm with magnified deflections, from the flexible robot and its rigid twin.
//!
//! Start at [`Magnifier`]. Frames: W world, L link, S station along a bent link, T tool, P the
//! carrier of a frame: its parent link, or a station of it. Not here: the surface of a bent link
//! ([`crate::BentMesh`]), drawing ([`crate::arm_png`]).

use flexarm_sample::{RunHeader, Sample, TwinSample};
use flexarm_spatial::{Pose, rotation_vector};
use nalgebra::{Rotation3, Translation3};

/// Magnifies deflections for drawing.
///
/// Every frame is treated relative to its carrier: the difference between the relative poses of the
/// flexible robot and of the rigid twin is multiplied (its translation, and its rotation as a
/// rotation vector), then the frames are chained again from the base. Joints therefore stay
/// connected and rigid links stay rigid at any factor; with factor 1 the result is the flexible
/// robot.
#[derive(Clone, Debug)]
pub struct Magnifier {
    factor: f64,
    /// Carrier of each link.
    carriers: Vec<Carrier>,
    /// Link and undeformed stations of each bend.
    bends: Vec<(usize, Vec<Pose>)>,
    tcp: Option<usize>,
}

#[derive(Clone, Copy, Debug)]
enum Carrier {
    World,
    Link(usize),
    /// Station by its index in [`TwinSample::X_WS`].
    Station(usize),
}

impl Magnifier {
    /// Uses the factor of the header, or 1 if it has none.
    #[must_use]
    pub fn new(header: &RunHeader) -> Self {
        let factor = if header.magnification > 0.0 { header.magnification } else { 1.0 };
        let parent = |link: &flexarm_sample::LinkInfo| link.parent.map_or(Carrier::World, Carrier::Link);
        let mut carriers: Vec<Carrier> = header.links.iter().map(parent).collect();
        let (mut bends, mut first) = (Vec::new(), 0);
        for bend in &header.bends {
            for &(link, station) in &bend.carries {
                carriers[link] = Carrier::Station(first + station);
            }
            bends.push((bend.link, bend.X_LS.clone()));
            first += bend.X_LS.len();
        }
        let tcp = header.links.iter().position(|link| link.name == header.tcp);
        Self { factor, carriers, bends, tcp }
    }

    /// Returns the magnification factor. 1 draws deflections as they are.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Returns the magnified poses of links, stations and TCP. Joint values are those of the
    /// flexible robot.
    #[must_use]
    pub fn magnified(&self, sample: &Sample) -> TwinSample {
        let mut to = TwinSample::default();
        self.magnify(sample, &mut to);
        to
    }

    /// Like [`Magnifier::magnified`], into an existing sample.
    ///
    /// # Panics
    /// If a robot of the sample has not one pose per link of the header.
    pub fn magnify(&self, sample: &Sample, to: &mut TwinSample) {
        let (flexible, rigid, links) = (&sample.flexible, &sample.rigid, self.carriers.len());
        assert!([flexible, rigid].iter().all(|twin| twin.X_WL.len() == links), "a pose of each link of both robots");
        to.q.clone_from(&flexible.q);
        to.qdot.clone_from(&flexible.qdot);
        to.effort.clone_from(&flexible.effort);
        to.X_WL.clone_from(&rigid.X_WL);
        to.X_WS.clear();
        to.X_WS.resize(flexible.X_WS.len(), Pose::identity());
        // Parents come before their children, as do the stations that carry them.
        for link in 0..links {
            let carrier = match self.carriers[link] {
                Carrier::World => [Pose::identity(); 3],
                Carrier::Link(parent) => [to.X_WL[parent], rigid.X_WL[parent], flexible.X_WL[parent]],
                Carrier::Station(k) => [to.X_WS[k], self.rigid_station(rigid, k), flexible.X_WS[k]],
            };
            to.X_WL[link] = self.placed(carrier, &rigid.X_WL[link], &flexible.X_WL[link]);
            // The stations of a link are carried by its frame.
            let own = [to.X_WL[link], rigid.X_WL[link], flexible.X_WL[link]];
            let mut first = 0;
            for (bent, stations) in &self.bends {
                if *bent == link {
                    for (k, X_LS) in stations.iter().enumerate() {
                        let X_WS = rigid.X_WL[link] * X_LS;
                        to.X_WS[first + k] = self.placed(own, &X_WS, &flexible.X_WS[first + k]);
                    }
                }
                first += stations.len();
            }
        }
        to.X_WT = match self.tcp {
            Some(link) => {
                let carrier = [to.X_WL[link], rigid.X_WL[link], flexible.X_WL[link]];
                self.placed(carrier, &rigid.X_WT, &flexible.X_WT)
            }
            None => flexible.X_WT,
        };
    }

    /// Pose `X_WS` of a station of the rigid twin, which has no bends.
    fn rigid_station(&self, rigid: &TwinSample, station: usize) -> Pose {
        let mut first = 0;
        for (link, stations) in &self.bends {
            if let Some(X_LS) = stations.get(station - first) {
                return rigid.X_WL[*link] * X_LS;
            }
            first += stations.len();
        }
        Pose::identity()
    }

    /// Pose `X_WL` of a magnified frame: its magnified carrier, the relative pose of the rigid
    /// robot, and the magnified difference.
    ///
    /// ```text
    /// X_WL = X_WP X_PL D^factor,   D = X_PL⁻¹ X_PL',   X_PL of the rigid, X_PL' of the flexible robot
    /// ```
    /// * `X_WP`: carrier of the magnified, rigid and flexible robot.
    fn placed(&self, [X_WP, rigid_X_WP, flexible_X_WP]: [Pose; 3], rigid_X_WL: &Pose, flexible_X_WL: &Pose) -> Pose {
        let X_PL = rigid_X_WP.inv_mul(rigid_X_WL);
        let D = X_PL.inv_mul(&flexible_X_WP.inv_mul(flexible_X_WL));
        let R = Rotation3::from_scaled_axis(rotation_vector(D.rotation.matrix()) * self.factor);
        X_WP * X_PL * Pose::from_parts(Translation3::from(D.translation.vector * self.factor), R)
    }
}

/// Returns the stations of one bend as poses `X_LS` in its link, from the world poses of the robot.
///
/// * `first`, `count`: index of its first station in [`TwinSample::X_WS`], and their number.
///
/// # Panics
/// If the sample has fewer stations or no such link.
#[must_use]
pub fn stations_in_link(twin: &TwinSample, link: usize, first: usize, count: usize) -> Vec<Pose> {
    twin.X_WS[first..first + count].iter().map(|X_WS| twin.X_WL[link].inv_mul(X_WS)).collect()
}
