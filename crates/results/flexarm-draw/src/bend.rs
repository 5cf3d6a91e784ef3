//! A deformed link: its surface between stations whose motion is given by a run.
//!
//! Between two stations the link is a beam: cubic Hermite deflection across the line, linear
//! stretch and twist along it, plane sections that rotate with the slope of the line
//! (Euler-Bernoulli). For loads at the ends this is the exact deflection line; at the stations it
//! is exact for every model. Before the first station and beyond the last one the surface moves
//! rigidly with that station.
//!
//! Start at [`BendLine`] and [`BentMesh`]. Frames: L link, S station; all vectors in L, in m.
//! Not here: the motion of the stations (`flexarm_run`), magnification ([`crate::Magnifier`]).

use std::collections::HashMap;

use flexarm_sample::{BendInfo, LinkMesh};
use flexarm_spatial::{Pose, rotation_vector};
use nalgebra::{Point3, Rotation3, Translation3, Vector3};

/// Number of slabs into which a surface is cut along the link, so that it can deform.
const SLABS: f64 = 12.0;
/// Maximum ratio of the numbers of triangles after and before cutting, as a bound for irregular
/// meshes.
const GROWTH: usize = 12;

/// Undeformed stations, and the position of points between them.
#[derive(Clone, Debug)]
pub struct BendLine {
    stations: Vec<Vector3<f64>>,
    /// Direction along the link, unit vector.
    axis: Vector3<f64>,
    /// Position of each station along `axis` (m).
    along: Vec<f64>,
}

impl BendLine {
    /// Creates the line through the stations; `None` if there are fewer than two or they are not in
    /// order.
    #[must_use]
    pub fn new(bend: &BendInfo) -> Option<Self> {
        let stations: Vec<Vector3<f64>> = bend.X_LS.iter().map(|X| X.translation.vector).collect();
        let (first, last) = (stations.first()?, stations.last()?);
        let axis = (last - first).try_normalize(1e-9)?;
        let along: Vec<f64> = stations.iter().map(|p| axis.dot(&(p - first))).collect();
        along.windows(2).all(|pair| pair[1] > pair[0]).then_some(Self { stations, axis, along })
    }

    /// Returns the position of a point `p_L` of the link along its line (m): 0 at the first
    /// station, negative before it.
    #[must_use]
    pub fn place(&self, p_L: &Vector3<f64>) -> f64 {
        self.axis.dot(&(p_L - self.stations[0]))
    }

    /// Returns the undeformed point at `s` metres along the line, in L (m). Before the first
    /// station and beyond the last one the outer pieces are continued.
    #[must_use]
    pub fn point(&self, s: f64) -> Point3<f64> {
        let last = self.stations.len() - 1;
        let k = self.along.partition_point(|place| *place <= s).clamp(1, last) - 1;
        let x = (s - self.along[k]) / (self.along[k + 1] - self.along[k]);
        Point3::from(self.stations[k] + (self.stations[k + 1] - self.stations[k]) * x)
    }

    /// Returns the length of the line (m).
    #[must_use]
    pub fn length(&self) -> f64 {
        self.along[self.along.len() - 1]
    }

    /// Returns the line with its stations moved.
    ///
    /// * `moved`: pose of each station in L; its rotation is that of the section, the identity
    ///   where nothing bends.
    ///
    /// # Panics
    /// If there is not one pose per station.
    #[must_use]
    pub fn bent<'a>(&'a self, moved: &'a [Pose]) -> BentLine<'a> {
        assert_eq!(moved.len(), self.stations.len(), "a pose of each station of the line");
        let end = |(X, station): (&Pose, &Vector3<f64>)| {
            (X.translation.vector - station, rotation_vector(X.rotation.matrix()))
        };
        BentLine { line: self, moved, ends: moved.iter().zip(&self.stations).map(end).collect() }
    }
}

/// A line whose stations have moved.
#[derive(Clone, Debug)]
pub struct BentLine<'a> {
    line: &'a BendLine,
    moved: &'a [Pose],
    /// Displacement and rotation vector of each station (link axes).
    ends: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl BentLine<'_> {
    /// Returns the deformed position, in L (m), of the point `p_L` of the undeformed link.
    #[must_use]
    pub fn deformed(&self, p_L: &Vector3<f64>) -> Vector3<f64> {
        self.section(self.line.place(p_L)).transform_point(&Point3::from(*p_L)).coords
    }

    /// Returns the motion of the section at `s` metres along the line: the pose that maps its
    /// undeformed points to the deformed ones, both in L (m).
    #[must_use]
    pub fn section(&self, s: f64) -> Pose {
        match self.between(s) {
            Ok(piece) => {
                let turn = piece.turn();
                Pose::from_parts(Translation3::from(piece.middle + piece.moved() - turn * piece.middle), turn)
            }
            Err(station) => self.moved[station] * Translation3::from(-self.line.stations[station]),
        }
    }

    /// Returns the deformed point at `s` metres along the line (link axes): the position from
    /// [`BentLine::section`], without computing its rotation.
    #[must_use]
    pub fn point(&self, s: f64) -> Point3<f64> {
        match self.between(s) {
            Ok(piece) => Point3::from(piece.middle + piece.moved()),
            Err(_) => self.section(s) * self.line.point(s),
        }
    }

    /// Returns the piece of the line at a position, or the station with which it moves rigidly
    /// there.
    fn between(&self, s: f64) -> Result<Piece, usize> {
        let BendLine { stations, along, .. } = self.line;
        let last = stations.len() - 1;
        if s <= 0.0 {
            return Err(0);
        }
        if s >= along[last] {
            return Err(last);
        }
        let k = along.partition_point(|place| *place <= s).clamp(1, last) - 1;
        let line = stations[k + 1] - stations[k];
        let x = (s - along[k]) / (along[k + 1] - along[k]);
        let length = line.norm();
        let direction = line / length;
        let ends = [self.ends[k], self.ends[k + 1]];
        Ok(Piece { x, line, length, direction, ends, middle: stations[k] + line * x })
    }
}

/// A beam between two stations, and a position on it.
struct Piece {
    /// Position from the first station (0) to the second (1).
    x: f64,
    /// Vector between the stations; its length (m) and direction.
    line: Vector3<f64>,
    length: f64,
    direction: Vector3<f64>,
    /// Displacements and rotation vectors as in [`BentLine`].
    ends: [(Vector3<f64>, Vector3<f64>); 2],
    /// The undeformed position.
    middle: Vector3<f64>,
}

impl Piece {
    /// Displacements of the ends across the line, and slopes there per unit of x.
    fn hermite(&self) -> [Vector3<f64>; 4] {
        let [(u0, theta0), (u1, theta1)] = &self.ends;
        let across = |v: &Vector3<f64>| v - self.direction * self.direction.dot(v);
        [across(u0), across(u1), theta0.cross(&self.line), theta1.cross(&self.line)]
    }

    /// Interpolates the longitudinal component linearly between the ends.
    fn mixed(&self, a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
        self.direction * (self.direction.dot(a) * (1.0 - self.x) + self.direction.dot(b) * self.x)
    }

    /// Displacement of the position (m): linear along the line, cubic Hermite polynomial across it.
    fn moved(&self) -> Vector3<f64> {
        let [v0, v1, slope0, slope1] = self.hermite();
        let x = self.x;
        let (x2, x3) = (x * x, x * x * x);
        let deflection = v0 * (1.0 - 3.0 * x2 + 2.0 * x3)
            + v1 * (3.0 * x2 - 2.0 * x3)
            + slope0 * (x - 2.0 * x2 + x3)
            + slope1 * (x3 - x2);
        self.mixed(&self.ends[0].0, &self.ends[1].0) + deflection
    }

    /// Rotation of the section: slope of the line, the derivative of [`Piece::moved`], and twist.
    fn turn(&self) -> Rotation3<f64> {
        let [v0, v1, slope0, slope1] = self.hermite();
        let x = self.x;
        let x2 = x * x;
        let slope = v0 * (6.0 * x2 - 6.0 * x)
            + v1 * (6.0 * x - 6.0 * x2)
            + slope0 * (1.0 - 4.0 * x + 3.0 * x2)
            + slope1 * (3.0 * x2 - 2.0 * x);
        let twist = self.mixed(&self.ends[0].1, &self.ends[1].1);
        Rotation3::from_scaled_axis(self.direction.cross(&(slope / self.length)) + twist)
    }
}

/// A deformable surface, cut finely enough along the link to look smooth.
#[derive(Clone, Debug)]
pub struct BentMesh {
    /// The undeformed surface, cut.
    pub mesh: LinkMesh,
    line: BendLine,
    /// Per corner: index of the preceding section, and weight of the next one.
    places: Vec<(u32, f32)>,
}

/// Maximum number of corners of a surface between the interfaces, since they are written at every
/// instant.
const CORNERS: usize = 3000;

/// Number of sections whose motion is computed; the motion of corners between two sections is
/// interpolated.
const SECTIONS: usize = 48;

impl BentMesh {
    /// Cuts `mesh` for deformation; `None` if the stations do not form a line.
    #[must_use]
    pub fn new(mesh: &LinkMesh, bend: &BendInfo) -> Option<Self> {
        let line = BendLine::new(bend)?;
        let mut mesh = mesh.clone();
        cut_along(&mut mesh, &line);
        Some(Self::of(mesh, line))
    }

    fn of(mesh: LinkMesh, line: BendLine) -> Self {
        let place = |p: &[f32; 3]| {
            let x = line.place(&Vector3::from(p.map(f64::from))) / line.length() * SECTIONS as f64;
            // The ends are separate sections, rigid with the parts beyond them.
            let section = x.clamp(0.0, SECTIONS as f64 - 1.0).floor();
            (section as u32, (x - section).clamp(0.0, 1.0) as f32)
        };
        let places = mesh.positions.iter().map(place).collect();
        Self { mesh, line, places }
    }

    /// Returns the line along which it deforms.
    #[must_use]
    pub fn line(&self) -> &BendLine {
        &self.line
    }

    /// Returns the corners in L (m) for stations moved to `moved`, as [`BendLine::bent`].
    pub fn positions<'a>(&'a self, moved: &[Pose]) -> impl Iterator<Item = [f32; 3]> + 'a {
        let bent = self.line.bent(moved);
        let at = |k: usize| bent.section(self.line.length() * k as f64 / SECTIONS as f64);
        let sections: Vec<Pose> = (0..=SECTIONS).map(at).collect();
        self.mesh.positions.iter().zip(&self.places).map(move |(p, (section, share))| {
            let (point, share) = (Point3::from(p.map(f64::from)), f64::from(*share));
            let [before, behind] = [0, 1].map(|k| sections[*section as usize + k] * point);
            (before.coords * (1.0 - share) + behind.coords * share).map(|x| x as f32).into()
        })
    }
}

/// The surface of a link in three pieces: rigid with the near interface, deformable, and rigid with
/// the far interface.
#[derive(Clone, Debug)]
pub struct BentPieces {
    /// Piece before the first station; fixed in the frame of the link.
    pub near: LinkMesh,
    /// Piece between the stations.
    pub middle: BentMesh,
    /// Piece beyond the last station; moves with the section at the end.
    pub far: LinkMesh,
}

impl BentPieces {
    /// Cuts `mesh` into pieces; `None` if the stations do not form a line.
    #[must_use]
    pub fn new(mesh: &LinkMesh, bend: &BendInfo) -> Option<Self> {
        let BentMesh { mesh, line, .. } = BentMesh::new(mesh, bend)?;
        let place = |k: &u32| line.place(&Vector3::from(mesh.positions[*k as usize].map(f64::from)));
        let before = |t: &[u32; 3]| t.iter().all(|k| place(k) <= 0.0);
        let beyond = |t: &[u32; 3]| t.iter().all(|k| place(k) >= line.length());
        let (near, far) = (mesh.part(before), mesh.part(beyond));
        let middle = mesh.part(|t| !before(t) && !beyond(t)).simplified(CORNERS);
        let middle = BentMesh::of(middle, line.clone());
        Some(Self { near, middle, far })
    }
}

/// Halves edges until none spans more than one slab of the flexible part of the link.
fn cut_along(mesh: &mut LinkMesh, line: &BendLine) {
    let (slab, most) = (line.length() / SLABS, mesh.triangles.len().max(64) * GROWTH);
    let with_normals = mesh.normals.len() == mesh.positions.len();
    let place = |p: &[f32; 3]| line.place(&Vector3::from(p.map(f64::from))).clamp(0.0, line.length());
    let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
    let mut open = std::mem::take(&mut mesh.triangles);
    while let Some(triangle) = open.pop() {
        // Extent of each edge along the line; the longest one is halved.
        let spans = [0, 1, 2].map(|k| {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            (place(&mesh.positions[a as usize]) - place(&mesh.positions[b as usize])).abs()
        });
        let longest = (0..3).max_by(|a, b| spans[*a].total_cmp(&spans[*b])).unwrap_or(0);
        if spans[longest] <= slab || mesh.triangles.len() + open.len() >= most {
            mesh.triangles.push(triangle);
            continue;
        }
        let [a, b, c] = [0, 1, 2].map(|k| triangle[(longest + k) % 3]);
        // Neighbouring triangles share the middle of their common edge.
        let middle = *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let mean = |x: [f32; 3], y: [f32; 3]| [0, 1, 2].map(|k| 0.5 * (x[k] + y[k]));
            mesh.positions.push(mean(mesh.positions[a as usize], mesh.positions[b as usize]));
            if with_normals {
                let sum = Vector3::from(mean(mesh.normals[a as usize], mesh.normals[b as usize]));
                mesh.normals.push(sum.try_normalize(1e-6).unwrap_or(Vector3::z()).into());
            }
            (mesh.positions.len() - 1) as u32
        });
        open.push([a, middle, c]);
        open.push([middle, b, c]);
    }
}
