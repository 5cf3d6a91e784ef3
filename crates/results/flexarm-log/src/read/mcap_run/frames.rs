//! Poses of links in the world, from the transforms of an MCAP file. Frames: W world, P parent
//! link, L link, S station along a bent link.

use std::collections::HashMap;

use flexarm_kinematics::Pose;
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use crate::mcap_file::messages::Transforms;
use crate::{RunHeader, Sample};

/// Converts translation and quaternion x, y, z, w.
pub(super) fn pose([x, y, z, qx, qy, qz, qw]: [f64; 7]) -> Pose {
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz));
    Pose::from_parts(Translation3::new(x, y, z), rotation.to_rotation_matrix())
}

/// Trees of frames: converts transforms between neighbours to poses in the world.
pub(super) struct Frames {
    /// Places by frame name.
    places: HashMap<String, FrameOwner>,
    parents: Vec<Option<usize>>,
    /// Last transform of each link of the flexible robot and of the rigid twin, and of each
    /// station.
    X_PL: [Vec<Pose>; 2],
    X_LS: Vec<(usize, Pose)>,
    has_rigid: bool,
    pub(super) has_stations: bool,
}

#[derive(Clone, Copy)]
enum FrameOwner {
    Link { twin: usize, link: usize },
    Station(usize),
}

impl Frames {
    /// Prepares the poses of all frames that the header names.
    pub(super) fn of(header: &RunHeader) -> Self {
        let mut places = HashMap::new();
        for (link, info) in header.links.iter().enumerate() {
            places.insert(info.name.clone(), FrameOwner::Link { twin: 0, link });
            if header.has_rigid {
                places.insert(format!("rigid/{}", info.name), FrameOwner::Link { twin: 1, link });
            }
        }
        // Stations of the bends, in the order of the header.
        let mut X_LS = Vec::new();
        for bend in &header.bends {
            let link = &header.links[bend.link].name;
            for k in 0..bend.X_LS.len() {
                places.insert(format!("{link}/station_{k}"), FrameOwner::Station(X_LS.len()));
                X_LS.push((bend.link, Pose::identity()));
            }
        }
        let identities = vec![Pose::identity(); header.links.len()];
        Self {
            places,
            parents: header.links.iter().map(|link| link.parent).collect(),
            X_PL: [identities.clone(), identities],
            X_LS,
            has_rigid: header.has_rigid,
            has_stations: false,
        }
    }

    pub(super) fn take(&mut self, transforms: Transforms<'_>) {
        for (_, child, X) in transforms {
            let X = pose(X);
            match self.places.get(child) {
                Some(&FrameOwner::Link { twin, link }) => self.X_PL[twin][link] = X,
                Some(&FrameOwner::Station(k)) => {
                    self.X_LS[k].1 = X;
                    self.has_stations = true;
                }
                None => {} // of another tree, for display only
            }
        }
    }

    /// Computes poses in the world from the last transforms.
    pub(super) fn poses(&self, sample: &mut Sample) {
        let twins = [&mut sample.flexible, &mut sample.rigid];
        for (twin, X_PL) in twins.into_iter().zip(&self.X_PL).take(if self.has_rigid { 2 } else { 1 }) {
            twin.X_WL.clear();
            for (parent, X_PL) in self.parents.iter().zip(X_PL) {
                let X_WL = parent.map_or(*X_PL, |parent| twin.X_WL[parent] * X_PL);
                twin.X_WL.push(X_WL);
            }
        }
        let flexible = &mut sample.flexible;
        flexible.X_WS.clear();
        let stations = self.X_LS.iter().map(|(link, X_LS)| flexible.X_WL[*link] * X_LS);
        flexible.X_WS.extend(stations);
    }
}
