//! The arm with magnified deflections, from the flexible robot and its rigid twin.

use flexarm_spatial::{Pose, rotation_vector};
use nalgebra::{Rotation3, Translation3};

use flexarm_sample::{RunHeader, Sample, TwinSample};

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

    /// Returns the magnification factor.
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
    pub fn magnify(&self, sample: &Sample, to: &mut TwinSample) {
        let (flexible, rigid) = (&sample.flexible, &sample.rigid);
        to.q.clone_from(&flexible.q);
        to.qdot.clone_from(&flexible.qdot);
        to.effort.clone_from(&flexible.effort);
        to.X_WL.clone_from(&rigid.X_WL);
        to.X_WS.clear();
        to.X_WS.resize(flexible.X_WS.len(), Pose::identity());
        // Parents come before their children, as do the stations that carry them.
        for link in 0..self.carriers.len() {
            to.X_WL[link] = match self.carriers[link] {
                Carrier::World => self.placed(
                    &Pose::identity(),
                    &Pose::identity(),
                    &Pose::identity(),
                    &rigid.X_WL[link],
                    &flexible.X_WL[link],
                ),
                Carrier::Link(parent) => self.placed(
                    &to.X_WL[parent],
                    &rigid.X_WL[parent],
                    &flexible.X_WL[parent],
                    &rigid.X_WL[link],
                    &flexible.X_WL[link],
                ),
                Carrier::Station(station) => self.placed(
                    &to.X_WS[station],
                    &self.rigid_station(rigid, station),
                    &flexible.X_WS[station],
                    &rigid.X_WL[link],
                    &flexible.X_WL[link],
                ),
            };
            let mut first = 0;
            for (bent, stations) in &self.bends {
                if *bent == link {
                    for (k, X_LS) in stations.iter().enumerate() {
                        let X_WS = rigid.X_WL[link] * X_LS;
                        to.X_WS[first + k] = self.placed(
                            &to.X_WL[link],
                            &rigid.X_WL[link],
                            &flexible.X_WL[link],
                            &X_WS,
                            &flexible.X_WS[first + k],
                        );
                    }
                }
                first += stations.len();
            }
        }
        to.X_WT = match self.tcp {
            Some(link) => {
                self.placed(&to.X_WL[link], &rigid.X_WL[link], &flexible.X_WL[link], &rigid.X_WT, &flexible.X_WT)
            }
            None => flexible.X_WT,
        };
    }

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

    /// Chains the magnified `carrier`, the relative pose of the rigid robot, and the magnified
    /// difference.
    fn placed(
        &self,
        carrier: &Pose,
        rigid_carrier: &Pose,
        flexible_carrier: &Pose,
        rigid: &Pose,
        flexible: &Pose,
    ) -> Pose {
        let X_rigid = rigid_carrier.inv_mul(rigid);
        let rest = X_rigid.inv_mul(&flexible_carrier.inv_mul(flexible));
        let angle = rotation_vector(rest.rotation.matrix()) * self.factor;
        let turn = Rotation3::from_scaled_axis(angle);
        carrier * X_rigid * Pose::from_parts(Translation3::from(rest.translation.vector * self.factor), turn)
    }
}

/// Returns the stations of one bend as poses in its link, from the world poses of the robot;
/// `first` is the index of its first station.
#[must_use]
pub fn stations_in_link(twin: &TwinSample, link: usize, first: usize, count: usize) -> Vec<Pose> {
    twin.X_WS[first..first + count].iter().map(|X_WS| twin.X_WL[link].inv_mul(X_WS)).collect()
}
