//! Ellipsoid of the compliance at the TCP: its image in a view, and its principal axes. World axes.
//!
//! Start at [`Ellipsoid::new`]. Not here: the compliance (`flexarm-run`), the arm (`skin.rs`).

use nalgebra::{Matrix2x3, Matrix3, SymmetricEigen, Vector3};

use crate::arm_picture::legend::short;
use crate::mesh_picture::draw::{Align, Style, text_width};
use crate::mesh_picture::{Image, Rgb, View, color};

/// Displacements of the TCP under a force of constant magnitude in all directions.
pub struct Ellipsoid {
    /// Map from the direction of the force to the drawn displacement (m).
    pub map: Matrix3<f64>,
    /// Principal axes: drawn displacement (m), compliance (m/N).
    pub axes: [(Vector3<f64>, f64); 3],
}

/// Length of the longest half axis, as a share of the size of the arm.
pub const ELLIPSOID: f64 = 0.13;
/// Number of segments of the outline.
const OUTLINE_PIECES: usize = 96;
const ELLIPSOID_COLOR: Rgb = [126, 46, 132];

impl Ellipsoid {
    /// Scales the ellipsoid of the compliance `C` (m/N, W axes) to the size of the arm (m); `None`
    /// for a rigid arm.
    pub fn new(C: &Matrix3<f64>, size: f64) -> Option<Self> {
        let eigen = SymmetricEigen::new(0.5 * (C + C.transpose()));
        let largest = eigen.eigenvalues.amax();
        if !(largest > 0.0 && largest.is_finite() && size > 0.0) {
            return None;
        }
        let scale = ELLIPSOID * size / largest;
        let axes = [0, 1, 2].map(|k| {
            let value = eigen.eigenvalues[k];
            (eigen.eigenvectors.column(k) * value * scale, value)
        });
        Some(Self { map: scale * C, axes })
    }

    /// Ends of the axes about a position.
    pub fn corners(&self, at: &Vector3<f64>) -> Vec<Vector3<f64>> {
        self.axes.iter().flat_map(|(axis, _)| [at + axis, at - axis]).collect()
    }

    /// Draws the outline, which is an ellipse, and the axes with their values.
    pub(super) fn draw(&self, image: &mut Image, view: &View, unit: f64, at: &Vector3<f64>) {
        let point = |p: &Vector3<f64>| {
            let [x, y, _] = view.project(p);
            [x, y]
        };
        // The outline is the image of unit forces in the picture plane: with P the projection onto
        // the plane, its half axes are the eigenvectors of P C Cᵀ Pᵀ, their squared lengths the
        // eigenvalues.
        let P = Matrix2x3::from_rows(&[view.right.transpose(), view.up.transpose()]);
        let A = P * self.map;
        let eigen = SymmetricEigen::new(A * A.transpose());
        let half = [0, 1].map(|k| P.transpose() * eigen.eigenvectors.column(k) * eigen.eigenvalues[k].max(0.0).sqrt());
        let place = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / OUTLINE_PIECES as f64).sin_cos();
            point(&(at + half[0] * cos + half[1] * sin))
        };
        for k in 0..OUTLINE_PIECES {
            image.line(place(k), place(k + 1), 2.2 * unit, ELLIPSOID_COLOR, 0.9);
        }
        for (axis, value) in &self.axes {
            let ends = [at - axis, at + axis].map(|p| point(&p));
            image.line(ends[0], ends[1], 1.4 * unit, ELLIPSOID_COLOR, 0.8);
            let length = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
            // An axis that points at the viewer has no label.
            if length > 44.0 * unit {
                let right = usize::from(ends[1][0] > ends[0][0]);
                let [x, y] = ends[right];
                let style = Style::new(14.0 * unit, ELLIPSOID_COLOR).bold().halo(color::PAPER);
                let text = format!("{} µm/N", short(1e6 * value));
                // Keep the text within the picture.
                let most = image.width as f64 - text_width(&text, style) - 6.0 * unit;
                image.text(&text, [(x + 5.0 * unit).min(most), y - 6.0 * unit], Align::Left, style);
            }
        }
    }
}
