//! Simscape "Reduced Order Flexible Solid": K and M as comma-separated values, and frames.
//!
//! The rows are those of the interfaces in order, translations first, followed by modes. This is
//! our interpretation of the documentation and has not been tested in Simscape.

use flexarm_spatial::Pose;
use nalgebra::{DMatrix, Quaternion, Translation3, UnitQuaternion};

use super::matrix::{LabelledMatrix, Storage, Triplets};
use super::position::ErrorPosition;
use super::text::{Text, words};
use crate::FeFileError;

/// Lines with numbers, without comments.
fn rows<'a>(text: &Text<'a>) -> impl Iterator<Item = (ErrorPosition<'a>, &'a str)> + use<'a> {
    text.lines().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with(['#', '%']))
}

/// Reads a square matrix, one row per line.
pub(super) fn parse_matrix(text: Text<'_>) -> Result<LabelledMatrix, FeFileError> {
    let n = rows(&text).count();
    let mut triplets = Triplets::default();
    for (row, (place, line)) in rows(&text).enumerate() {
        let mut count = 0;
        for word in words(line) {
            // Columns beyond the number of rows are rejected below.
            if count < n {
                triplets.push(row, count, place.number("entry", word)?, &place);
            }
            count += 1;
        }
        if count != n {
            let (found, expected) = (format!("{count} columns"), format!("{n}, as there are rows"));
            return Err(place.fail("row", found, expected, "is the file cut off?"));
        }
    }
    triplets.unlabelled("the matrix", n, &text.file(), Storage::BySize)
}

/// Reads one frame per line: `x, y, z, qw, qx, qy, qz`.
pub(super) fn parse_frames(text: Text<'_>) -> Result<Vec<Pose>, FeFileError> {
    let mut frames = Vec::new();
    for (place, line) in rows(&text) {
        let mut values = words(line);
        let mut v = [0.0; 7];
        for value in &mut v {
            *value = place.next_number("frame", &mut values)?;
        }
        place.end(&mut values)?;
        let quaternion = Quaternion::new(v[3], v[4], v[5], v[6]);
        if !((quaternion.norm() - 1.0).abs() < 1e-6) {
            let found = format!("a quaternion of norm {}", quaternion.norm());
            let expected = "norm 1; the order is w, x, y, z";
            return Err(place.fail("frame", found, expected, ""));
        }
        let R = UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix();
        frames.push(Pose::from_parts(Translation3::new(v[0], v[1], v[2]), R));
    }
    Ok(frames)
}

/// Contents of the files for Simscape.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SimscapeFiles {
    /// `<name>_K.csv`.
    pub stiffness: String,
    /// `<name>_M.csv`.
    pub mass: String,
    /// `<name>_frames.csv`: origin and quaternion w, x, y, z of each interface.
    pub frames: String,
    /// `<name>_load.m`: reads the files into the variables that the block needs.
    pub script: String,
}

/// Writes stiffness, mass and interface frames for Simscape; SI, 17 digits, reads back bit for bit.
///
/// * `name`: prefix of the file names in the script.
/// * `K`, `M`: rows `[ux uy uz rx ry rz]` per interface, then modes, in link axes.
/// * `frames`: pose of each interface in the link, translation in m.
pub fn write_simscape(name: &str, K: &DMatrix<f64>, M: &DMatrix<f64>, frames: &[Pose]) -> SimscapeFiles {
    let matrix = |matrix: &DMatrix<f64>| -> String {
        let line = |values: Vec<String>| values.join(",") + "\n";
        matrix.row_iter().map(|row| line(row.iter().map(|value| format!("{value:e}")).collect())).collect()
    };
    let frame = |X: &Pose| {
        let (p, q) = (X.translation.vector, UnitQuaternion::from_rotation_matrix(&X.rotation));
        format!("{:?},{:?},{:?},{:?},{:?},{:?},{:?}\n", p.x, p.y, p.z, q.w, q.i, q.j, q.k)
    };
    let head = "# origin x,y,z [m], quaternion w,x,y,z of each interface frame in the link frame\n";
    let script = format!(
        "% Reduced Order Flexible Solid {name}: SI units, rows ux uy uz rx ry rz per interface, then modes.\n\
         K = readmatrix('{name}_K.csv');\n\
         M = readmatrix('{name}_M.csv');\n\
         frames = readmatrix('{name}_frames.csv', 'CommentStyle', '#');\n\
         origins = frames(:, 1:3);      % m\n\
         quaternions = frames(:, 4:7);  % w x y z\n\
         damping = 2*0.03*K/(2*pi*100); % stiffness-proportional, 3 % at 100 Hz: adapt\n"
    );
    SimscapeFiles {
        stiffness: matrix(K),
        mass: matrix(M),
        frames: head.to_owned() + &frames.iter().map(frame).collect::<String>(),
        script,
    }
}
