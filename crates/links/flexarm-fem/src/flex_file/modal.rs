//! Optional table `[modal]` of a reduced-link file: shapes and mass integrals.
//!
//! Symmetric matrices are written as their lower triangles by rows. Of `N_kl` the pairs `k <= l`
//! are written in that order, or none if all are zero (second order unknown).

use nalgebra::{DMatrix, Matrix3, Matrix3xX, Matrix6, Matrix6xX, Vector3};

use super::document::{Node, Table};
use super::error::{FlexErrorKind, FlexFileError};
use super::frames::{pose_lines, read_pose};
use super::text::{numbers, quoted};
use super::units::Units;
use crate::modal::{GeometricStiffness, ModalInterface, ModalLink};
use crate::reduced::ReducedLink;

/// Maximum number of coordinates, more than any link has.
const MAX_COORDINATES: usize = 6000;

/// Keys of the table.
const KEYS: [&str; 13] = [
    "coordinates",
    "interfaces",
    "shapes",
    "mass",
    "first_moment",
    "inertia",
    "C_t",
    "C_r",
    "P",
    "N",
    "K",
    "M",
    "geometric",
];

/// Writes the table as text.
pub(super) fn write_modal(modal: &ModalLink) -> String {
    // Coordinates and interfaces; shapes only if they are not unit columns.
    let n = modal.coordinates();
    let mut text = String::from(
        "\n[modal]                       # shapes with A held: six per interface, then modes; link axes\n",
    );
    // Coordinates and interfaces; shapes only where they are not those of Craig and Bampton.
    text += "coordinates = [\n";
    for label in &modal.labels {
        text += &format!("  {},\n", quoted(label));
    }
    text += "]\ninterfaces = [\n";
    for interface in &modal.interfaces {
        let pose = pose_lines(&interface.X_LI).trim_end().replace('\n', ", ");
        text += &format!("  {{ name = {}, {pose} }},\n", quoted(&interface.name));
    }
    text += "]\n";
    if !modal.is_craig_bampton() {
        let rows = modal.interfaces.iter().flat_map(|i| i.Phi.row_iter().map(|row| numbers(row.iter())));
        text += &list("shapes", rows);
    }
    // Integrals of zeroth to second order over the mass, then stiffness and mass.
    let J = &modal.inertia;
    text += &format!("mass = {:?}\nfirst_moment = {}\n", modal.mass, numbers(modal.first_moment.iter()));
    let moments = [J[(0, 0)], J[(1, 1)], J[(2, 2)], J[(0, 1)], J[(0, 2)], J[(1, 2)]];
    text += &format!("inertia = {}    # about the link origin\n", numbers(moments.iter()));
    text += &list("C_t", modal.C_t.row_iter().map(|row| numbers(row.iter())));
    text += &list("C_r", modal.C_r.row_iter().map(|row| numbers(row.iter())));
    text += &list("P", modal.P.iter().map(nine));
    if modal.has_second_order() {
        let pairs = (0..n).flat_map(|k| (k..n).map(move |l| k * n + l));
        text += &list("N", pairs.map(|at| nine(&modal.N[at])));
    }
    // Symmetric matrices over the coordinates.
    text += &format!("K = {}\nM = {}\n", triangle(&modal.K), triangle(&modal.M));
    // Geometric stiffness per unit acceleration, angular acceleration, product of speeds, load.
    if let Some(G) = &modal.geometric {
        text += "\n[modal.geometric]             # per unit load\n";
        text += &list("acceleration", G.acceleration.iter().map(triangle));
        text += &list("angular", G.angular.iter().map(triangle));
        text += &list("centrifugal", G.centrifugal.iter().map(triangle));
        text += &list("interface", G.interface.iter().flatten().map(triangle));
    }
    text
}

fn list(key: &str, rows: impl Iterator<Item = String>) -> String {
    let rows: String = rows.map(|row| format!("  {row},\n")).collect();
    format!("{key} = [\n{rows}]\n")
}

/// Writes a 3×3 by rows.
fn nine(A: &Matrix3<f64>) -> String {
    numbers(A.transpose().iter())
}

fn triangle(A: &DMatrix<f64>) -> String {
    let places = (0..A.nrows()).flat_map(|i| (0..=i).map(move |j| (i, j)));
    let entries: Vec<f64> = places.map(|place| A[place]).collect();
    numbers(entries.iter())
}

/// Reads the `[modal]` table of a link whose other data is already read.
pub(super) fn read_modal(
    node: &Node<'_, '_>,
    units: &Units,
    link: &ReducedLink,
    agreement: f64,
) -> Result<ModalLink, FlexFileError> {
    let table = node.table()?;
    table.only(&KEYS)?;
    let labels = read_labels(&table)?;
    let n = labels.len();
    let interfaces = read_interfaces(&table, units, n)?;
    let count = interfaces.len();

    let mass = table.require("mass", "the mass of the link without attached bodies")?;
    let value = mass.number()?;
    if !(value > 0.0) {
        return Err(mass.fail(FlexErrorKind::Link, value.to_string(), "a positive mass", ""));
    }
    let [xx, yy, zz, xy, xz, yz] =
        table.require("inertia", "about the link origin")?.numbers::<6>("numbers: xx, yy, zz, xy, xz, yz")?;
    // Matrices first: N is allocated only after the file has shown that it has n coordinates.
    let K = read_triangle(&table.require("K", "lower triangle")?, n)?;
    let M = read_triangle(&table.require("M", "lower triangle")?, n)?;
    let N = match table.get("N") {
        None => vec![Matrix3::zeros(); n * n],
        Some(node) => read_pairs(&node, n)?,
    };
    let modal = ModalLink {
        name: link.name.clone(),
        interfaces,
        mass: value,
        first_moment: table.require("first_moment", "from the link origin")?.vector()?,
        inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        C_t: read_three(&table, "C_t", n)?,
        C_r: read_three(&table, "C_r", n)?,
        P: read_nines(&table.require("P", "one row of nine per coordinate")?, n)?,
        N,
        M,
        K,
        geometric: match table.get("geometric") {
            None => None,
            Some(node) => Some(read_geometric(&node, n, count)?),
        },
        labels,
        X_LA: link.X_LA,
    };
    check_agreement(node, &modal, link, agreement)?;
    Ok(modal)
}

fn read_labels(table: &Table<'_, '_>) -> Result<Vec<String>, FlexFileError> {
    let labels = table.require("coordinates", "a text for each coordinate")?;
    let list = labels.list()?;
    if list.is_empty() || list.len() > MAX_COORDINATES {
        let expected = format!("1 to {MAX_COORDINATES} coordinates");
        return Err(labels.fail(FlexErrorKind::WrongSize, list.len().to_string(), expected, ""));
    }
    list.iter().map(|label| label.text().map(str::to_owned)).collect()
}

/// Reads the interfaces; without `shapes`, each has six unit columns in their order.
fn read_interfaces(table: &Table<'_, '_>, units: &Units, n: usize) -> Result<Vec<ModalInterface>, FlexFileError> {
    let node = table.require("interfaces", "the interfaces but A, distal first")?;
    let list = node.list()?;
    let too_few = list.is_empty() || (table.get("shapes").is_none() && 6 * list.len() > n);
    if too_few {
        let found = format!("{} interface(s) with {n} coordinates", list.len());
        let expected = "one or more, each with six coordinates of its own or with shapes";
        return Err(node.fail(FlexErrorKind::WrongSize, found, expected, ""));
    }
    let mut interfaces = Vec::new();
    for (i, item) in list.iter().enumerate() {
        let entry = item.table()?;
        let name = entry.require("name", "the name of the interface")?.text()?.to_owned();
        let X_LI = read_pose(&entry, units, &["name"])?;
        let unit = |r: usize, c: usize| if c == 6 * i + r { 1.0 } else { 0.0 };
        interfaces.push(ModalInterface { name, X_LI, Phi: Matrix6xX::from_fn(n, unit) });
    }
    if let Some(shapes) = table.get("shapes") {
        for (at, row) in shapes.items(6 * list.len(), "rows, six per interface")?.iter().enumerate() {
            for (k, entry) in row.items(n, "numbers, one per coordinate")?.iter().enumerate() {
                interfaces[at / 6].Phi[(at % 6, k)] = entry.number()?;
            }
        }
    }
    Ok(interfaces)
}

fn read_three(table: &Table<'_, '_>, key: &str, n: usize) -> Result<Matrix3xX<f64>, FlexFileError> {
    let mut A = Matrix3xX::zeros(n);
    for (i, row) in table.require(key, "three rows")?.items(3, "rows: x, y, z")?.iter().enumerate() {
        for (k, entry) in row.items(n, "numbers, one per coordinate")?.iter().enumerate() {
            A[(i, k)] = entry.number()?;
        }
    }
    Ok(A)
}

fn read_nines(node: &Node<'_, '_>, count: usize) -> Result<Vec<Matrix3<f64>>, FlexFileError> {
    let rows = node.items(count, "rows of nine numbers")?;
    rows.iter().map(|row| row.numbers::<9>("numbers: a 3x3 by rows").map(|A| Matrix3::from_row_slice(&A))).collect()
}

/// Reads `N_kl` of the pairs `k <= l`; the others are `N_lk = N_klᵀ`.
fn read_pairs(node: &Node<'_, '_>, n: usize) -> Result<Vec<Matrix3<f64>>, FlexFileError> {
    let pairs = read_nines(node, n * (n + 1) / 2)?;
    let mut N = vec![Matrix3::zeros(); n * n];
    let places = (0..n).flat_map(|k| (k..n).map(move |l| (k, l)));
    for ((k, l), A) in places.zip(pairs) {
        N[l * n + k] = A.transpose();
        N[k * n + l] = A;
    }
    Ok(N)
}

/// Reads the lower triangle of a symmetric n×n matrix.
fn read_triangle(node: &Node<'_, '_>, n: usize) -> Result<DMatrix<f64>, FlexFileError> {
    let entries = node.items(n * (n + 1) / 2, "numbers: the lower triangle by rows")?;
    let mut A = DMatrix::zeros(n, n);
    for ((i, j), entry) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).zip(entries) {
        let value = entry.number()?;
        (A[(i, j)], A[(j, i)]) = (value, value);
    }
    Ok(A)
}

/// Reads `[modal.geometric]`: one n×n matrix per unit load.
fn read_geometric(node: &Node<'_, '_>, n: usize, interfaces: usize) -> Result<GeometricStiffness, FlexFileError> {
    let table = node.table()?;
    table.only(&["acceleration", "angular", "centrifugal", "interface"])?;
    let read = |key: &str, count: usize| -> Result<std::vec::IntoIter<DMatrix<f64>>, FlexFileError> {
        let rows = table.require(key, "one lower triangle per unit load")?.items(count, "rows, one per unit load")?;
        let matrices = rows.iter().map(|row| read_triangle(row, n)).collect::<Result<Vec<_>, _>>()?;
        Ok(matrices.into_iter())
    };
    let take = |from: &mut std::vec::IntoIter<DMatrix<f64>>| from.next().unwrap_or_else(|| DMatrix::zeros(n, n));
    let (mut acceleration, mut angular) = (read("acceleration", 3)?, read("angular", 3)?);
    let (mut centrifugal, mut interface) = (read("centrifugal", 6)?, read("interface", 6 * interfaces)?);
    Ok(GeometricStiffness {
        acceleration: std::array::from_fn(|_| take(&mut acceleration)),
        angular: std::array::from_fn(|_| take(&mut angular)),
        centrifugal: std::array::from_fn(|_| take(&mut centrifugal)),
        interface: (0..interfaces).map(|_| std::array::from_fn(|_| take(&mut interface))).collect(),
    })
}

/// Checks the position of B and, if all static shapes are present, the compliance against the link.
fn check_agreement(
    node: &Node<'_, '_>,
    modal: &ModalLink,
    link: &ReducedLink,
    agreement: f64,
) -> Result<(), FlexFileError> {
    let fail = |found: String| {
        let expected = "the stiffness and the frames of the link";
        Err(node.fail(FlexErrorKind::Link, found, expected, "was one of them edited?"))
    };
    // The first interface is B.
    let p_LB: &Vector3<f64> = &link.X_LB.translation.vector;
    let gap = (modal.interfaces[0].X_LI.translation.vector - p_LB).norm();
    if !(gap <= 1e-9) {
        return fail(format!("an interface {:?} that is {gap:.1e} m from B", modal.interfaces[0].name));
    }
    for (what, A) in [("K", &modal.K), ("M", &modal.M)] {
        if let Some(found) = A.diagonal().iter().find(|a| !(**a > 0.0)) {
            return fail(format!("{found} on the diagonal of {what}"));
        }
    }
    // Truncated eigenmodes have a smaller compliance than the link.
    if !modal.is_craig_bampton() {
        return Ok(());
    }
    let (Ok(of_modal), Ok(of_link)) = (modal.compliance(0), link.tip_compliance()) else {
        return fail("a stiffness that is not positive definite".into());
    };
    let s = of_link.diagonal().map(f64::sqrt);
    let gap = Matrix6::from_fn(|i, j| (of_modal[(i, j)] - of_link[(i, j)]).abs() / (s[i] * s[j])).amax();
    if gap <= agreement { Ok(()) } else { fail(format!("a compliance of B that differs by {gap:.1e}")) }
}
