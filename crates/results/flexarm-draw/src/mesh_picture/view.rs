//! Viewing direction of a link, and projection of its points onto the picture.
//!
//! Start at [`View::fit`]. Vectors in the axes of the scene (link or world), in m; positions on the
//! picture in pixels from the top left. Not here: visibility ([`super::scene`]).

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// A parallel projection onto a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// To the right of the picture, unit.
    pub right: Vector3<f64>,
    /// Up on the picture, unit.
    pub up: Vector3<f64>,
    /// Towards the viewer, unit.
    pub toward: Vector3<f64>,
    /// Pixels per metre.
    pub scale: f64,
    /// Position of the origin, pixels from the top left.
    pub origin: [f64; 2],
}

impl View {
    /// Creates a view in which all `points` fit a box of the picture, `[left, top, width, height]`
    /// in pixels.
    ///
    /// * `right`: direction that points to the right as far as `toward` allows.
    pub fn fit(
        toward: Vector3<f64>,
        right: Vector3<f64>,
        points: impl Iterator<Item = Vector3<f64>>,
        [left, top, width, height]: [f64; 4],
    ) -> Self {
        let toward = toward.normalize();
        let right = (right - toward * toward.dot(&right)).normalize();
        let up = toward.cross(&right);
        let limits = points.fold([f64::MAX, f64::MIN, f64::MAX, f64::MIN], |[a, b, c, d], p| {
            let (x, y) = (right.dot(&p), up.dot(&p));
            [a.min(x), b.max(x), c.min(y), d.max(y)]
        });
        let (dx, dy) = (limits[1] - limits[0], limits[3] - limits[2]);
        let scale = (width / dx.max(1e-12)).min(height / dy.max(1e-12));
        let origin = [
            left + width / 2.0 - scale * (limits[0] + limits[1]) / 2.0,
            top + height / 2.0 + scale * (limits[2] + limits[3]) / 2.0,
        ];
        Self { right, up, toward, scale, origin }
    }

    /// Projects a point: position in pixels from the top left, and depth towards the viewer in the
    /// same unit.
    pub fn project(&self, p: &Vector3<f64>) -> [f64; 3] {
        [
            self.origin[0] + self.scale * self.right.dot(p),
            self.origin[1] - self.scale * self.up.dot(p),
            self.scale * self.toward.dot(p),
        ]
    }
}

/// Directions of a link in its pictures: along it, across it, and out of the plane of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkAxes {
    /// Along the longest extent, from A to B.
    pub along: Vector3<f64>,
    /// Along the second longest extent.
    pub across: Vector3<f64>,
    /// `along x across`.
    pub(super) out: Vector3<f64>,
}

impl LinkAxes {
    /// Uses the axes of the link if it is aligned with one of them to 20 degrees, else its
    /// principal axes.
    pub fn new(points: &[Vector3<f64>], p_AB: &Vector3<f64>) -> Self {
        // Principal axes of the points.
        let centre = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let spread = points.iter().fold(Matrix3::zeros(), |sum, p| sum + (p - centre) * (p - centre).transpose());
        let eigen = SymmetricEigen::new(spread);
        let longest = eigen.eigenvalues.imax();
        let principal = eigen.eigenvectors.column(longest).into_owned();
        let axes = if principal.amax() > 20_f64.to_radians().cos() { Matrix3::identity() } else { eigen.eigenvectors };

        // The longest extent is along the link, towards B; the next one across it.
        let mut axes: Vec<(f64, Vector3<f64>)> = (0..3)
            .map(|k| {
                let axis = axes.column(k).into_owned();
                let span = points
                    .iter()
                    .map(|p| axis.dot(p))
                    .fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
                (span.1 - span.0, axis)
            })
            .collect();
        axes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let positive = |axis: Vector3<f64>| if axis[axis.iamax()] < 0.0 { -axis } else { axis };
        let along = axes[0].1;
        let along =
            if along.dot(p_AB).abs() < 1e-9 * p_AB.norm() { positive(along) } else { along * along.dot(p_AB).signum() };
        let across = positive(axes[1].1);
        Self { along, across, out: along.cross(&across) }
    }

    /// Returns a viewing direction: `turn` about the vertical of the picture, then `tilt` above it,
    /// radians.
    ///
    /// A positive `turn` shows the end B.
    pub fn viewpoint(&self, turn: f64, tilt: f64) -> Vector3<f64> {
        self.along * (turn.sin() * tilt.cos()) + self.across * tilt.sin() + self.out * (turn.cos() * tilt.cos())
    }
}

/// Returns the link axis closest to the direction to the viewer, such as `+y`.
pub(super) fn side_name(direction: &Vector3<f64>) -> String {
    let axis = direction.iamax();
    format!("{}{}", if direction[axis] < 0.0 { '-' } else { '+' }, ["x", "y", "z"][axis])
}
