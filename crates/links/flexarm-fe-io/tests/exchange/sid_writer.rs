//! Standard Input Data written from modal links, the inverse of what the library reads.

use flexarm_fe_io::exchange::{GyroLayout, Sid, SidMatrix, SidNode};
use flexarm_fem::modal::{PRODUCTS, axial};
use flexarm_fem::{ModalLink, Pose};
use nalgebra::{DMatrix, Matrix3, Matrix3xX, Matrix6xX, Vector3};

/// Columns of `Oe` for [`PRODUCTS`], in the written order xx yy zz xy yz xz.
const OE_COLUMNS: [usize; 6] = [0, 1, 2, 3, 5, 4];

/// `φᵀ [ω]x² s` per product of ω, from `A = ∫ s φᵀ dm`.
fn centrifugal(A: &Matrix3<f64>) -> [f64; 6] {
    PRODUCTS.map(|(a, b)| if a == b { A[(a, a)] - A.trace() } else { A[(a, b)] + A[(b, a)] })
}

/// Matrices of the inertia forces.
struct InertiaTerms {
    Gr: DMatrix<f64>,
    Ge: DMatrix<f64>,
    Oe0: DMatrix<f64>,
    /// First-order parts, by mode.
    Ct1: Vec<DMatrix<f64>>,
    Cr1: Vec<DMatrix<f64>>,
    Oe1: Vec<DMatrix<f64>>,
}

impl InertiaTerms {
    fn of(link: &ModalLink) -> Self {
        let (n, G) = (link.coordinates(), link.geometric.as_ref());
        let (mut Gr, mut Ge) = (DMatrix::zeros(3, 3 * n), DMatrix::zeros(n, 3 * n));
        let mut Oe0 = DMatrix::zeros(n, 6);
        let zeros = |columns| vec![DMatrix::zeros(n, columns); n];
        let (mut Ct1, mut Cr1, mut Oe1) = (zeros(3), zeros(3), zeros(6));
        for k in 0..n {
            let gyro = (Matrix3::identity() * link.P[k].trace() - link.P[k].transpose()) * 2.0;
            for (row, axis) in (0..9).map(|e| (e / 3, e % 3)) {
                Gr[(row, GyroLayout::ComponentMajor.column(n, axis, k))] = gyro[(row, axis)];
            }
            for (value, at) in centrifugal(&link.P[k]).into_iter().zip(OE_COLUMNS) {
                Oe0[(k, at)] = value;
            }
            for l in 0..n {
                let cross = axial(&link.N[l * n + k]);
                for axis in 0..3 {
                    Ge[(k, GyroLayout::ComponentMajor.column(n, axis, l))] = 2.0 * cross[axis];
                    Ct1[l][(k, axis)] = G.map_or(0.0, |G| G.acceleration[axis][(k, l)]);
                    Cr1[l][(k, axis)] = cross[axis] + G.map_or(0.0, |G| G.angular[axis][(k, l)]);
                }
                for (i, value) in centrifugal(&link.N[k * n + l]).into_iter().enumerate() {
                    Oe1[l][(k, OE_COLUMNS[i])] = value + G.map_or(0.0, |G| G.centrifugal[i][(k, l)]);
                }
            }
        }
        Self { Gr, Ge, Oe0, Ct1, Cr1, Oe1 }
    }
}

/// Converts a modal link to Standard Input Data, SI; node 1 is A, the others follow in order.
///
/// `De` is zero, because a modal link has no damping.
pub(crate) fn sid_of_modal_link(link: &ModalLink) -> Sid {
    let n = link.coordinates();
    let dense = |A: &Matrix3xX<f64>| DMatrix::from_fn(n, 3, |k, a| A[(a, k)]);
    let column = |v: &Vector3<f64>| DMatrix::from_column_slice(3, 1, v.as_slice());
    let six = |J: &Matrix3<f64>| DMatrix::from_iterator(6, 1, PRODUCTS.into_iter().map(|place| J[place]));
    let J1 = |P: &Matrix3<f64>| Matrix3::identity() * (2.0 * P.trace()) - (P + P.transpose());
    let square = |A: &DMatrix<f64>| SidMatrix { structure: 2, ..SidMatrix::constant(n, A) };
    let G = link.geometric.as_ref();
    let InertiaTerms { Gr, Ge, Oe0, Ct1, Cr1, Oe1 } = InertiaTerms::of(link);
    let first: Vec<_> = (0..n).map(|k| column(&link.C_t.column(k).into_owned())).collect();
    let turning: Vec<_> = link.P.iter().map(|P| six(&J1(P))).collect();
    let mut nodes = vec![node(1, &link.X_LA, &Matrix6xX::zeros(n), None)];
    for (i, interface) in link.interfaces.iter().enumerate() {
        nodes.push(node(i as i64 + 2, &interface.X_LI, &interface.Phi, G.map(|G| &G.interface[i])));
    }
    let one_line = |text: &str| text.replace(['\n', '\r', '|'], " ").trim().to_owned();
    let names: Vec<_> = link.interfaces.iter().map(|interface| one_line(&interface.name)).collect();
    Sid {
        comment: format!(" modal link | {} | A | {}", one_line(&link.name), names.join(" | ")),
        mass: link.mass,
        modes: link.labels.iter().map(|label| one_line(label)).collect(),
        nodes,
        mdCM: SidMatrix::linear(&column(&link.first_moment), &first),
        J: SidMatrix::linear(&six(&link.inertia), &turning),
        Ct: if G.is_some() {
            SidMatrix::linear(&dense(&link.C_t), &Ct1)
        } else {
            SidMatrix::constant(n, &dense(&link.C_t))
        },
        Cr: SidMatrix::linear(&dense(&link.C_r), &Cr1),
        Me: square(&link.M),
        Gr: SidMatrix::constant(n, &Gr),
        Ge: SidMatrix::constant(n, &Ge),
        Oe: SidMatrix::linear(&Oe0, &Oe1),
        ksigma: SidMatrix::constant(n, &DMatrix::zeros(n, 1)),
        Ke: square(&link.K),
        De: SidMatrix::constant(n, &DMatrix::zeros(n, n)),
        others: G.map_or_else(Vec::new, |G| {
            let all: Vec<_> = G.interface.iter().flatten().cloned().collect();
            vec![
                ("K0t".into(), side_by_side(n, &G.acceleration)),
                ("K0r".into(), side_by_side(n, &G.angular)),
                ("K0omega".into(), side_by_side(n, &G.centrifugal)),
                ("K0F".into(), side_by_side(n, &all)),
            ]
        }),
    }
}

fn node(id: i64, X: &Pose, Phi: &Matrix6xX<f64>, G: Option<&[DMatrix<f64>; 6]>) -> SidNode {
    let n = Phi.ncols();
    let vector = |v: &Vector3<f64>| DMatrix::from_column_slice(3, 1, v.as_slice());
    let dense = |A: &Matrix3<f64>| DMatrix::from_column_slice(3, 3, A.as_slice());
    let half = |k: usize, at: usize| Vector3::from_fn(|a, _| Phi[(at + a, k)]);
    let R = *X.rotation.matrix();
    let shapes = |at: usize| {
        let m0 = DMatrix::from_fn(3, n, |a, k| Phi[(at + a, k)]);
        match G {
            None => SidMatrix::constant(n, &m0),
            Some(G) => {
                let m1 = (0..n).map(|k| DMatrix::from_fn(3, n, |a, j| -G[at + a][(j, k)])).collect::<Vec<_>>();
                SidMatrix::linear(&m0, &m1)
            }
        }
    };
    let moves = (0..n).map(|k| vector(&half(k, 0))).collect::<Vec<_>>();
    let turns = (0..n).map(|k| dense(&(half(k, 3).cross_matrix() * R))).collect::<Vec<_>>();
    SidNode {
        id,
        rframe: "body ref".into(),
        origin: SidMatrix::linear(&vector(&X.translation.vector), &moves),
        phi: shapes(0),
        psi: shapes(3),
        AP: SidMatrix::linear(&dense(&R), &turns),
        sigma: None,
    }
}

fn side_by_side(n: usize, G: &[DMatrix<f64>]) -> SidMatrix {
    SidMatrix::constant(n, &DMatrix::from_fn(n, n * G.len(), |k, at| G[at / n][(k, at % n)]))
}

/// Writes a `.SID_FEM` file with 17 digits; it reads back bit for bit.
///
/// Index orders are those of the struct; see [`Sid::conventions`].
pub(crate) fn write_sid(sid: &Sid) -> String {
    let mut text =
        format!("{:5} {:4}    :{}\n part\n     new modal\n          refmod\n", sid.nodes.len(), sid.nq(), sid.comment);
    let mut line = |indent: usize, key: &str, value: &str| {
        text += &format!("{:indent$}{key:width$}= {value}\n", "", width = 48 - indent);
    };
    line(15, "mass", &number(sid.mass));
    line(15, "nelastq", &format!("{:3}", sid.nq()));
    for (k, mode) in sid.modes.iter().enumerate() {
        line(15, &format!("ielastq ({:4})", k + 1), mode);
    }
    text += "          end refmod\n          frame\n";
    for node in &sid.nodes {
        text += &format!("{:15}{:33}= {:8}\n", "", "new node", node.id);
        text += &format!("{:20}{:28}= {}\n", "", "rframe", node.rframe);
        let blocks = [Some(&node.origin), Some(&node.phi), Some(&node.psi), Some(&node.AP), node.sigma.as_ref()];
        for (name, block) in ["origin", "phi", "psi", "AP", "sigma"].into_iter().zip(blocks) {
            if let Some(block) = block {
                matrix(&mut text, 20, name, block);
            }
        }
        text += "               end node\n";
    }
    text += "          end frame\n";
    for (name, block) in sid.blocks() {
        matrix(&mut text, 10, name, block);
    }
    text += "     end modal\n end part\n";
    text
}

fn matrix(text: &mut String, indent: usize, name: &str, matrix: &SidMatrix) {
    *text += &format!("{:indent$}{name}\n", "");
    let inner = indent + 5;
    let mut line = |key: String, value: String| {
        *text += &format!("{:inner$}{key:width$}= {value}\n", "", width = 48 - inner);
    };
    for (key, value) in [
        ("order", usize::from(matrix.order)),
        ("nrow", matrix.nrow),
        ("ncol", matrix.ncol),
        ("nq", matrix.nq),
        ("nqn", matrix.nqn),
        ("structure", usize::from(matrix.structure)),
    ] {
        line(key.into(), format!("{value:3}"));
    }
    for ((row, column), value) in &matrix.entries0 {
        line(format!("m0({:2},{:2})", row + 1, column + 1), number(*value));
    }
    for ((row, mode, column), value) in &matrix.entries1 {
        line(format!("m1({:2},{:2},{:2})", row + 1, mode + 1, column + 1), number(*value));
    }
    *text += &format!("{:indent$}end {name}\n", "");
}

fn number(value: f64) -> String {
    let text = format!("{value:.16e}");
    let (digits, exponent) = text.split_once('e').unwrap();
    format!("{digits:>19}D{:+03}", exponent.parse::<i32>().unwrap())
}
