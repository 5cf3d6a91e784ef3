//! Coordinate frames of a recording: the trees of both robots and of the magnified arm, and their
//! transforms.
//!
//! Start at [`Frames::transforms`]. Frames: W world, L link, S station, T tool; a transform is the
//! pose `X_PC` of a child in its parent. Not here: encoding ([`super::messages`]), slabs
//! ([`super::bent`]).

use flexarm_kinematics::Pose;

use super::beat::Beat;
use super::bent::BentLink;
use super::messages::Transform;
use crate::poses::{PoseClock, PoseReasons};
use crate::{LinkInfo, RunHeader, Sample, TwinSample};
use flexarm_draw::Magnifier;

/// Root of all trees.
pub(crate) const WORLD: &str = "world";
/// Maximum rate of frames of the magnified arm (per second of simulated time).
const PICTURES_HZ: u32 = 60;

/// The robots of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tree {
    Flexible,
    Rigid,
    /// Drawn only: with the rate and precision of the animation.
    Magnified,
}

impl Tree {
    /// Name as a namespace of markers.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Flexible => "flexible",
            Self::Rigid => "rigid",
            Self::Magnified => "magnified",
        }
    }

    /// Name of a link's frame in this tree.
    pub(crate) fn frame(self, link: &str) -> String {
        match self {
            Self::Flexible => link.to_owned(),
            Self::Rigid | Self::Magnified => format!("{}/{link}", self.name()),
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Moving {
    Yes,
    No,
}

/// Names of the frames of all trees, and the magnified arm last drawn.
pub(crate) struct Frames {
    links: Vec<LinkFrame>,
    has_rigid: bool,
    /// Link of the TCP, and names of its frame, indexed by [`Tree`].
    tcp: Option<(usize, [String; 3])>,
    /// Link and frame name of each station.
    stations: Vec<(usize, String)>,
    /// Present if deflections are magnified.
    magnifier: Option<Magnifier>,
    magnified: TwinSample,
    /// Links drawn in slabs, with the frame names of the slabs.
    bent: Vec<(BentLink, Vec<String>)>,
    clock: PoseClock,
    pictures: Beat,
    /// Whether the poses of this sample are written, and whether its animation frame is drawn.
    shown: bool,
    due: bool,
    /// Poses of the last sample, if they were not written and are known ([`Frames::keep`]).
    unshown: Sample,
    kept: bool,
}

struct LinkFrame {
    parent: Option<usize>,
    moving: Moving,
    /// Indexed by [`Tree`].
    names: [String; 3],
}

impl Frames {
    pub(crate) fn of(header: &RunHeader) -> Self {
        let all = [Tree::Flexible, Tree::Rigid, Tree::Magnified];
        let frame = |link: &LinkInfo| LinkFrame {
            parent: link.parent,
            moving: if link.fixed { Moving::No } else { Moving::Yes },
            names: all.map(|tree| tree.frame(&link.name)),
        };
        // Frames of the TCP, of stations, and of slabs of bent links.
        let tcp = header.links.iter().position(|link| link.name == header.tcp);
        let station = |link: usize, k: usize| (link, format!("{}/station_{k}", header.links[link].name));
        let stations = header.bends.iter().flat_map(|bend| (0..bend.X_LS.len()).map(|k| station(bend.link, k)));
        let tree = bending_tree(header);
        let bent = tree.into_iter().flat_map(|tree| {
            BentLink::all(header).into_iter().map(move |bent| {
                let link = tree.frame(&header.links[bent.link].name);
                let names = (0..bent.count()).map(|k| slab_frame(&link, k)).collect();
                (bent, names)
            })
        });
        Self {
            links: header.links.iter().map(frame).collect(),
            has_rigid: header.has_rigid,
            tcp: tcp.map(|link| (link, all.map(|tree| format!("{}/tcp", tree.frame(&header.tcp))))),
            stations: stations.collect(),
            magnifier: is_magnified(header).then(|| Magnifier::new(header)),
            magnified: TwinSample::default(),
            bent: bent.collect(),
            clock: PoseClock::default(),
            pictures: Beat::new(PICTURES_HZ),
            shown: true,
            due: false,
            unshown: Sample::default(),
            kept: false,
        }
    }

    /// Advances to a sample; computes the magnified arm if an animation frame is due. Returns
    /// whether the sample's poses are to be written.
    pub(crate) fn advance(&mut self, since_start_ns: u64, sample: &Sample) -> bool {
        let PoseReasons { due, new_peak } = self.clock.take(since_start_ns, sample, self.has_rigid);
        self.shown = due || new_peak;
        self.due = due && self.pictures.due(since_start_ns);
        self.kept = false;
        if let Some(magnifier) = self.magnifier.as_ref().filter(|_| self.due) {
            magnifier.magnify(sample, &mut self.magnified);
        }
        self.shown
    }

    /// Keeps the poses of the last sample passed to [`Frames::advance`], unless they are written.
    pub(crate) fn keep(&mut self, sample: &Sample) {
        if self.shown {
            return;
        }
        self.kept = true;
        let twins = [(&mut self.unshown.flexible, &sample.flexible), (&mut self.unshown.rigid, &sample.rigid)];
        for (twin, now) in twins {
            twin.X_WL.clone_from(&now.X_WL);
            twin.X_WS.clone_from(&now.X_WS);
        }
    }

    /// Returns the transforms of the last sample, once, if its poses were not written.
    pub(crate) fn close(&mut self) -> Option<Vec<Transform<'_>>> {
        std::mem::take(&mut self.kept).then(|| self.transforms(&self.unshown, Moving::Yes))
    }

    /// Whether an animation frame is due at this sample.
    pub(crate) fn is_pictured(&self) -> bool {
        self.due
    }

    /// Returns the magnified arm, if an animation frame is due.
    pub(crate) fn magnified(&self) -> Option<&TwinSample> {
        (self.due && self.magnifier.is_some()).then_some(&self.magnified)
    }

    /// Returns the transforms of either the moving or the fixed frames.
    pub(crate) fn transforms(&self, sample: &Sample, moving: Moving) -> Vec<Transform<'_>> {
        let mut transforms = Vec::with_capacity(3 * self.links.len());
        self.tree(&mut transforms, &sample.flexible, moving, Tree::Flexible);
        if self.has_rigid {
            self.tree(&mut transforms, &sample.rigid, moving, Tree::Rigid);
        }
        if let Some(magnified) = self.magnified() {
            self.tree(&mut transforms, magnified, moving, Tree::Magnified);
        }
        if moving == Moving::Yes {
            // Stations of the bends, relative to their link.
            for ((link, child), X_WS) in self.stations.iter().zip(&sample.flexible.X_WS) {
                let X_PC = sample.flexible.X_WL[*link].inv_mul(X_WS);
                transforms.push(Transform { parent: &self.links[*link].names[0], child, X_PC, coarse: false });
            }
            // Slabs of the bent meshes, which move with the visible arm.
            let (tree, twin) = match &self.magnifier {
                Some(_) => (Tree::Magnified, &self.magnified),
                None => (Tree::Flexible, &sample.flexible),
            };
            for (bent, names) in self.bent.iter().filter(|_| self.due) {
                let parent = &self.links[bent.link].names[tree as usize];
                let slabs = bent.poses(twin).zip(names);
                transforms.extend(slabs.map(|(X_PC, child)| Transform { parent, child, X_PC, coarse: true }));
            }
        }
        transforms
    }

    fn tree<'a>(&'a self, transforms: &mut Vec<Transform<'a>>, twin: &TwinSample, moving: Moving, tree: Tree) {
        let name = |link: &'a LinkFrame| link.names[tree as usize].as_str();
        for (index, link) in self.links.iter().enumerate() {
            let (parent, X_WP) = match link.parent {
                // Children of a moving base link named `world` are given relative to the root.
                Some(parent) if name(&self.links[parent]) != WORLD => (name(&self.links[parent]), twin.X_WL[parent]),
                _ => (WORLD, Pose::identity()),
            };
            let child = name(link);
            // A base link named `world` is the root itself.
            if link.moving == moving && child != parent {
                let coarse = tree == Tree::Magnified;
                transforms.push(Transform { parent, child, X_PC: X_WP.inv_mul(&twin.X_WL[index]), coarse });
            }
        }
        // The TCP frame is fixed in its link.
        if let (Some((link, names)), Moving::No) = (&self.tcp, moving) {
            let (parent, child) = (name(&self.links[*link]), names[tree as usize].as_str());
            transforms.push(Transform { parent, child, X_PC: twin.X_WL[*link].inv_mul(&twin.X_WT), coarse: false });
        }
    }
}

/// Whether a recording has a magnified arm: needs the rigid twin and a factor.
pub(crate) fn is_magnified(header: &RunHeader) -> bool {
    header.has_rigid && header.magnification > 0.0
}

/// Robot whose links are drawn bent: the magnified one if there is one; without magnification, as
/// in a recording of modes, the flexible one; none in a recording of a single robot, whose
/// deflections are too small to be seen.
pub(crate) fn bending_tree(header: &RunHeader) -> Option<Tree> {
    match (is_magnified(header), header.has_rigid) {
        (true, _) => Some(Tree::Magnified),
        (false, true) => Some(Tree::Flexible),
        (false, false) => None,
    }
}

/// Name of the frame of a slab of a link that is drawn bent.
pub(crate) fn slab_frame(link_frame: &str, slab: usize) -> String {
    format!("{link_frame}/bend_{slab}")
}
