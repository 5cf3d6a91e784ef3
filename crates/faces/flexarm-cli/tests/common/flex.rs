//! Reduced-link files of the beam in `super::URDF`, valid and corrupted.

/// Square matrix as rows.
pub(crate) type Rows = Vec<Vec<f64>>;

const LENGTH: f64 = 0.8;

/// Stiffness at the far end of a clamped Euler-Bernoulli beam along x: 20 mm x 40 mm, 0.8 m,
/// aluminium.
pub(crate) fn stiffness_6() -> Rows {
    let (e, g, l, width, height) = (70e9, 26e9, LENGTH, 0.02f64, 0.04f64);
    let (area, i_y, i_z) = (width * height, width * height.powi(3) / 12.0, height * width.powi(3) / 12.0);
    let torsion = 0.229 * height * width.powi(3);
    let mut k = vec![vec![0.0; 6]; 6];
    k[0][0] = e * area / l;
    k[3][3] = g * torsion / l;
    k[1][1] = 12.0 * e * i_z / l.powi(3);
    k[2][2] = 12.0 * e * i_y / l.powi(3);
    k[4][4] = 4.0 * e * i_y / l;
    k[5][5] = 4.0 * e * i_z / l;
    for (row, column, value) in [(1, 5, -6.0 * e * i_z / (l * l)), (2, 4, 6.0 * e * i_y / (l * l))] {
        k[row][column] = value;
        k[column][row] = value;
    }
    k
}

/// The same beam free at both ends, A then B: `[[Adᵀ K Ad, -Adᵀ K], [-K Ad, K]]`, with
/// `u_B = Ad u_A` for rigid motions.
pub(crate) fn stiffness_12() -> Rows {
    let k = stiffness_6();
    let mut ad: Rows = (0..6).map(|i| (0..6).map(|j| if i == j { 1.0 } else { 0.0 }).collect()).collect();
    ad[1][5] = LENGTH;
    ad[2][4] = -LENGTH;
    let transposed: Rows = (0..6).map(|i| (0..6).map(|j| ad[j][i]).collect()).collect();
    let k_ad = product(&k, &ad);
    let (aa, ab) = (product(&transposed, &k_ad), product(&transposed, &k));
    let row = |left: &[f64], right: &[f64], signs: (f64, f64)| {
        left.iter().map(|x| signs.0 * x).chain(right.iter().map(|x| signs.1 * x)).collect()
    };
    let upper = (0..6).map(|i| row(&aa[i], &ab[i], (1.0, -1.0)));
    upper.chain((0..6).map(|i| row(&k_ad[i], &k[i], (-1.0, 1.0)))).collect()
}

fn product(a: &Rows, b: &Rows) -> Rows {
    let entry = |row: &Vec<f64>, j: usize| row.iter().zip(b).map(|(x, other)| x * other[j]).sum();
    a.iter().map(|row| (0..b[0].len()).map(|j| entry(row, j)).collect()).collect()
}

/// Text of a `.flex` file for the link `bar`; `matrix` is 6×6 or 12×12.
pub(crate) fn text(matrix: &Rows) -> String {
    let n = matrix.len();
    let rows: String = matrix.iter().map(|r| format!("  {r:?},\n")).collect();
    let part = |name: &str, x: f64| {
        format!(
            "\n[[part]]\nname = \"{name}\"\nmass = 0.864\ncom = [{x:?}, 0.0, 0.0]\n\
             inertia = [1.44e-4, 1.16352e-2, 1.15488e-2, 0.0, 0.0, 0.0]\n"
        )
    };
    format!(
        "format = \"flexarm-reduced-link\"\nversion = 1\nlink = \"bar\"\n\n\
         [units]\nlength = \"m\"\nforce = \"N\"\nmass = \"kg\"\n\n\
         [interface.A]\nxyz = [0.0, 0.0, 0.0]\n\n[interface.B]\nxyz = [0.8, 0.0, 0.0]\n\n\
         [stiffness]\nkind = \"{n}x{n}\"\naxes = \"link\"\norder = \"ux uy uz rx ry rz\"\nmatrix = [\n{rows}]\n{}{}",
        part("proximal", 0.2),
        part("distal", 0.6)
    )
}

/// The robot file with `reduced = "bar.flex"` in place of the beam.
pub(crate) fn robot() -> String {
    let lines = super::ROBOT.lines().map(|l| if l.starts_with("beam = ") { "reduced = \"bar.flex\"" } else { l });
    lines.map(|l| format!("{l}\n")).collect()
}
