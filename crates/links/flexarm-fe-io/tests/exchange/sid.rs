//! Standard Input Data: identities of the body, index orders that differ between files, reading and
//! writing.

use flexarm_fe_io::exchange::{GyroLayout, OeOrder, Sid, SidMatrix, SidNode, modal_link_from_sid, parse_sid, read_sid};
use flexarm_fe_io::mesh::{ReadOptions, read_mesh};
use flexarm_fem::modal::ModalSource;
use flexarm_fem::model::{AssemblyOptions, FeModel, materials};
use flexarm_fem::reduction::{Condensation, CondensationOptions, Interface, InterfaceFrame, Tie};
use flexarm_fem::sparse::ModesWanted;
use flexarm_fem::{ModalLink, Pose, UnitSystem};
use nalgebra::{DMatrix, Matrix3, Matrix3xX, Vector3};
use proptest::prelude::*;

use super::shared::{samples, truth};
use super::sid_writer::{sid_of_modal_link, write_sid};
use crate::common::fixed_cases;

/// Point masses with three shapes: every integral is an explicit sum.
fn point_masses(gyro: GyroLayout, oe: OeOrder, tensor_as_3x3: bool) -> Sid {
    let masses =
        [(1.0, Vector3::new(0.1, 0.2, 0.3)), (2.0, Vector3::new(1.0, -0.4, 0.5)), (0.7, Vector3::new(0.3, 0.9, -0.8))];
    let nq = 3;
    let phi = |i: usize| DMatrix::from_fn(3, nq, |axis, k| ((7 * i + 3 * axis + k) as f64).sin());
    let shape = |i: usize, k: usize| Vector3::from_iterator(phi(i).column(k).iter().copied());
    let zero = |rows, columns| DMatrix::zeros(rows, columns);

    let (mut J0, mut J1) = (Matrix3::zeros(), vec![Matrix3::zeros(); nq]);
    let (mut Gr, mut Oe, mut Ct, mut Me) = (zero(3, 3 * nq), zero(nq, 6), zero(nq, 3), zero(nq, nq));
    for (i, (m, p)) in masses.iter().enumerate() {
        let skew = |r: &Vector3<f64>| r.cross_matrix();
        J0 += skew(p).transpose() * skew(p) * *m;
        for k in 0..nq {
            let u = shape(i, k);
            J1[k] += (skew(p).transpose() * skew(&u) + skew(&u).transpose() * skew(p)) * *m;
            // Gr_k = -2 ∫ p̃ ũ, whose symmetric part is J1_k.
            let gyro_matrix = skew(p) * skew(&u) * (-2.0 * m);
            for (row, axis) in (0..9).map(|n| (n / 3, n % 3)) {
                Gr[(row, gyro.column(nq, axis, k))] += gyro_matrix[(row, axis)];
                Ct[(k, axis)] += if row == 0 { m * u[axis] } else { 0.0 };
            }
            // Centrifugal products: ∫ (x φy + y φx)/..., minus the products of J1.
            let columns = if oe == OeOrder::XyYzXz { [3, 5, 4] } else { [3, 4, 5] };
            for ((a, b), column) in [(0, 1), (0, 2), (1, 2)].into_iter().zip(columns) {
                Oe[(k, column)] += m * (p[a] * u[b] + p[b] * u[a]);
            }
            for l in 0..nq {
                Me[(k, l)] += m * u.dot(&shape(i, l));
            }
        }
    }
    let six = |J: &Matrix3<f64>| {
        DMatrix::from_column_slice(6, 1, &[J[(0, 0)], J[(1, 1)], J[(2, 2)], J[(0, 1)], J[(0, 2)], J[(1, 2)]])
    };
    let as_file = |J: &Matrix3<f64>| if tensor_as_3x3 { DMatrix::from_fn(3, 3, |i, j| J[(i, j)]) } else { six(J) };
    let node = SidNode {
        id: 26,
        rframe: "body ref".into(),
        origin: SidMatrix::linear(
            &DMatrix::from_column_slice(3, 1, masses[0].1.as_slice()),
            &[zero(3, 1), zero(3, 1), zero(3, 1)],
        ),
        phi: SidMatrix::constant(nq, &phi(0)),
        psi: SidMatrix::constant(nq, &zero(3, nq)),
        AP: SidMatrix::linear(&DMatrix::identity(3, 3), &[zero(3, 3), zero(3, 3), zero(3, 3)]),
        sigma: Some(SidMatrix::constant(nq, &zero(6, nq))),
    };
    Sid {
        comment: " point masses = 3".into(),
        mass: 3.7,
        modes: vec!["first = bending".into(), "second".into(), String::new()],
        nodes: vec![node],
        mdCM: SidMatrix::constant(nq, &zero(3, 1)),
        J: SidMatrix::linear(&as_file(&J0), &J1.iter().map(as_file).collect::<Vec<_>>()),
        Ct: SidMatrix::constant(nq, &Ct),
        Cr: SidMatrix::constant(nq, &zero(nq, 3)),
        Me: SidMatrix { structure: 2, ..SidMatrix::constant(nq, &Me) },
        Gr: SidMatrix::constant(nq, &Gr),
        Ge: SidMatrix::constant(nq, &zero(nq, 3 * nq)),
        Oe: SidMatrix::constant(nq, &Oe),
        ksigma: SidMatrix::constant(nq, &zero(nq, 1)),
        Ke: SidMatrix { structure: 4, nrow: nq, ncol: nq, nq, ..SidMatrix::default() },
        De: SidMatrix::constant(nq, &zero(nq, nq)),
        others: vec![("Kgeo".into(), SidMatrix::constant(nq, &Me))],
    }
}

#[test]
fn a_written_body_reads_back_to_the_last_bit() {
    for tensor in [false, true] {
        let sid = point_masses(GyroLayout::ComponentMajor, OeOrder::XyYzXz, tensor);
        let text = write_sid(&sid);
        assert_eq!(parse_sid(&text, "t").unwrap(), sid, "{text}");
        assert_eq!(sid.Ke.m0(), DMatrix::identity(3, 3));
        // CRLF, other indentation and other case of the keywords make no difference.
        let other: String =
            text.lines().map(|line| format!("\t{}\r\n", line.trim().replace("end modal", "END  Modal"))).collect();
        assert_eq!(parse_sid(&other, "t").unwrap(), sid);
    }
}

#[test]
fn the_orders_of_a_file_are_found_by_its_own_identities() {
    for gyro in [GyroLayout::ComponentMajor, GyroLayout::ModeMajor] {
        for oe in [OeOrder::XyYzXz, OeOrder::XyXzYz] {
            for tensor in [false, true] {
                let sid = point_masses(gyro, oe, tensor);
                let found = sid.conventions("t").unwrap();
                assert_eq!((found.gyro, found.oe), (gyro, oe));
                assert!(found.gyro_residual < 1e-14 && found.oe_residual < 1e-14, "{found:?}"); // measured 8e-17, 0
                let J1 = sid.J1(1);
                assert!((sid.Oe(oe)[(1, 4)] + J1[(0, 2)]).abs() < 1e-14);
            }
        }
    }
    let mut wrong = point_masses(GyroLayout::ComponentMajor, OeOrder::XyYzXz, false);
    wrong.Gr.entries0.insert((0, 0), 100.0);
    assert!(wrong.conventions("t").unwrap_err().found.contains("neither order"));
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn the_sample_body_agrees_with_the_reduced_matrices() {
    let folder = samples();
    let path = folder.join("formats/beam_synthetic.SID_FEM");
    let sid = read_sid(&path).unwrap();
    assert_eq!((sid.nq(), sid.nodes.len(), sid.mass), (10, 2, 39.25));
    assert_eq!(sid.modes[0], "B static ux");
    assert_eq!(sid.nodes[1].id, 1002);
    assert_eq!(sid.nodes[1].origin.m0().as_slice(), [1.0, 0.0, 0.0]);

    let found = sid.conventions("sample").unwrap();
    assert_eq!((found.gyro, found.oe), (GyroLayout::ComponentMajor, OeOrder::XyYzXz));
    assert!(found.gyro_residual < 1e-10 && found.oe_residual < 1e-10, "{found:?}"); // measured 8e-13, 0

    // AP1 is the skew matrix of psi: (row, mode, column).
    let psi = sid.nodes[1].psi.m0();
    for k in 0..10 {
        let skew = Vector3::new(psi[(0, k)], psi[(1, k)], psi[(2, k)]).cross_matrix();
        let AP1 = sid.nodes[1].AP.m1(k);
        assert!((0..9).all(|n| AP1[(n / 3, n % 3)] == skew[(n / 3, n % 3)]), "{k}");
    }

    // A clamped: stiffness and mass of the first six shapes are the blocks of B.
    let (K, M) = truth(&folder);
    let error = |a: DMatrix<f64>, b: &DMatrix<f64>| {
        let b = b.view((6, 6), (6, 6));
        let places = (0..36).map(|n| (n / 6, n % 6));
        places.map(|(i, j)| (a[(i, j)] - b[(i, j)]).abs() / (b[(i, i)] * b[(j, j)]).sqrt()).fold(0.0, f64::max)
    };
    // The file comes from another assembly of the same mesh, the truth from CalculiX.
    let (of_K, of_M) = (error(sid.Ke.m0(), &K), error(sid.Me.m0(), &M));
    assert!(of_K < 1e-8, "{of_K:.1e}"); // measured 6e-10
    assert!(of_M < 1e-4, "{of_M:.1e}"); // measured 1.7e-5: CalculiX integrates the mass at four points

    assert_eq!(parse_sid(&write_sid(&sid), "again").unwrap(), sid);
}

#[test]
fn mistakes_are_named_with_line_and_block() {
    let text = write_sid(&point_masses(GyroLayout::ComponentMajor, OeOrder::XyYzXz, false));
    for (from, to, part) in [
        ("          J\n", "          end Cr\n", "end Cr"),
        ("nelastq                          =   3", "nelastq                          =   4", "3 lines ielastq"),
        ("m0( 1, 1)", "m0( 9, 1)", "m0(9,1)"),
        ("nq                     =   3", "nq                     = 999999999", "0 to 10000"),
        ("3.7000000000000002D+00", "nan", "a finite number"),
        ("    1    3    :", "    2    3    :", "as in its first line"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert!(changed != text, "{from}");
        let error = parse_sid(&changed, "t").unwrap_err();
        assert!(error.to_string().contains(part), "{part}: {error}");
    }
}

proptest! {
    #![proptest_config(fixed_cases())]

    #[test]
    fn bodies_that_are_cut_or_changed_do_not_panic(
        cut in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), 32..127_u8), 0..6),
    ) {
        let mut bytes = write_sid(&point_masses(GyroLayout::ModeMajor, OeOrder::XyYzXz, false)).into_bytes();
        for (place, byte) in changes {
            let i = place.index(bytes.len());
            bytes[i] = byte;
        }
        let text = String::from_utf8_lossy(&bytes);
        use_all(&text);
        use_all(&text[..cut.index(text.len())]);
    }

    #[test]
    fn bodies_with_other_sizes_and_structures_do_not_panic(
        changes in prop::collection::vec(
            (
                any::<prop::sample::Index>(),
                prop::sample::select(vec!["order", "nrow", "ncol", "nq", "nqn", "structure", "nelastq", "m0( 6, 1)", "m1( 3, 3, 1)"]),
                prop::sample::select(vec!["0", "1", "2", "3", "4", "6", "9", "10000", "30000"]),
                any::<bool>(),
            ),
            1..4,
        ),
    ) {
        let text = write_sid(&point_masses(GyroLayout::ModeMajor, OeOrder::XyYzXz, false));
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        for (place, key, value, is_new) in changes {
            // Replaces a line with this key, or inserts a new line anywhere.
            let line = format!("{key} = {value}");
            let same: Vec<usize> = (0..lines.len()).filter(|&i| lines[i].trim().starts_with(key)).collect();
            match same.get(place.index(same.len().max(1))) {
                Some(&i) if !is_new => lines[i] = line,
                _ => lines.insert(place.index(lines.len()), line),
            }
        }
        use_all(&lines.join("\n"));
    }
}

/// Calls all methods of a body, if the text is a valid one.
fn use_all(text: &str) {
    let Ok(sid) = parse_sid(text, "t") else { return };
    let of_nodes = sid.nodes.iter().flat_map(|node| {
        [Some(&node.origin), Some(&node.phi), Some(&node.psi), Some(&node.AP), node.sigma.as_ref()]
            .into_iter()
            .flatten()
    });
    for matrix in sid.blocks().map(|(_, matrix)| matrix).chain(of_nodes) {
        let size = matrix.m0().len();
        // As in the parser: 2^20, plus 16 per byte.
        assert!(size <= (1 << 20) + 16 * text.len(), "{size}");
        (0..=matrix.nq.min(8)).for_each(|mode| assert_eq!(matrix.m1(mode).len(), size));
    }
    let _ = (sid.conventions("t"), sid.J0(), write_sid(&sid));
    for (mode, layout) in (0..sid.nq().min(8)).zip([GyroLayout::ModeMajor, GyroLayout::ComponentMajor].iter().cycle()) {
        let _ = (sid.J1(mode), sid.Gr(*layout, mode), sid.Ge(*layout, mode));
    }
    let _ = sid.Oe(OeOrder::XyXzYz);
}

/// Text of the sample body with a block changed: from the block's name to its end.
fn with_block(name: &str, change: impl Fn(&str) -> String) -> String {
    let text = write_sid(&point_masses(GyroLayout::ModeMajor, OeOrder::XyYzXz, false));
    let (head, rest) = text.split_once(&format!(" {name}\n")).unwrap();
    let (block, tail) = rest.split_once(&format!(" end {name}\n")).unwrap();
    let changed = change(block);
    assert!(changed != block, "{block}");
    format!("{head} {name}\n{changed} end {name}\n{tail}")
}

/// Replaces the line with this key by `key = value`.
fn set(block: &str, key: &str, value: usize) -> String {
    let line =
        |line: &str| if line.trim().starts_with(key) { format!("{key} = {value}\n") } else { format!("{line}\n") };
    block.lines().map(line).collect()
}

#[test]
fn structures_of_square_matrices_are_refused_elsewhere() {
    for (name, structures) in [("origin", [1, 2, 4]), ("J", [1, 2, 4]), ("mdCM", [1, 2, 4]), ("Gr", [1, 2, 4])] {
        for structure in structures {
            let text = with_block(name, |block| set(block, "structure", structure));
            let error = parse_sid(&text, "t").unwrap_err();
            assert!(&*error.element == name && error.expected.contains("a square matrix"), "{error}");
        }
    }
    // A unit matrix without entries, and one triangle of a symmetric matrix.
    let unit = with_block("Me", |block| set(&block[..block.find("m0(").unwrap()], "structure", 4));
    assert_eq!(parse_sid(&unit, "t").unwrap().Me.m0(), DMatrix::identity(3, 3));
    let of_lower = |line: &&str| !["m0( 1, 2)", "m0( 1, 3)", "m0( 2, 3)"].iter().any(|upper| line.contains(upper));
    let lower = with_block("Me", |block| block.lines().filter(of_lower).map(|line| format!("{line}\n")).collect());
    let whole = point_masses(GyroLayout::ModeMajor, OeOrder::XyYzXz, false);
    assert_eq!(parse_sid(&lower, "t").unwrap().Me.m0(), whole.Me.m0());
}

#[test]
fn sizes_after_the_first_entry_are_refused() {
    for key in ["order", "nrow", "ncol", "nq", "nqn", "structure"] {
        let error = parse_sid(&with_block("J", |block| format!("{block}{key} = 1\n")), "t").unwrap_err();
        assert!(error.expected.contains("before the first entry"), "{key}: {error}");
    }
}

/// A matrix built by the caller may have any entries.
#[test]
fn entries_outside_of_a_matrix_are_left_out() {
    let matrix = SidMatrix {
        order: 1,
        nrow: 3,
        ncol: 1,
        structure: 2,
        entries0: [((2, 0), 5.0), ((7, 0), 6.0)].into(),
        entries1: [((1, 0, 0), 2.0), ((0, 0, 9), 3.0)].into(),
        ..SidMatrix::default()
    };
    assert_eq!(matrix.m0().as_slice(), [0.0, 0.0, 5.0]);
    assert_eq!(matrix.m1(0).as_slice(), [0.0, 2.0, 0.0]);
}

/// A block of any size, and shape coordinates that are only declared.
#[test]
fn matrices_that_are_much_larger_than_the_file_are_refused() {
    for name in ["Kgeo", "ksigma", "sigma"] {
        let large = |block: &str| set(&set(block, "nrow", 30_000), "ncol", 30_000);
        let error = parse_sid(&with_block(name, large), "t").unwrap_err();
        assert!(error.expected.contains("by the size of the file"), "{name}: {error}");
    }
    let zero = |nrow, ncol| SidMatrix { nrow, ncol, ..SidMatrix::default() };
    let body = |n: usize| Sid {
        modes: vec![String::new(); n],
        mdCM: zero(3, 1),
        J: zero(6, 1),
        Ct: zero(n, 3),
        Cr: zero(n, 3),
        Me: zero(n, n),
        Gr: zero(3, 3 * n),
        Ge: zero(n, 3 * n),
        Oe: zero(n, 6),
        ksigma: zero(n, 1),
        Ke: zero(n, n),
        De: zero(n, n),
        ..Sid::default()
    };
    let of_modes = |n: usize| parse_sid(&write_sid(&body(n)), "t");
    assert_eq!(of_modes(500).unwrap().Ge.m0().len(), 750_000);
    let error = of_modes(10_000).unwrap_err();
    assert!(&*error.element == "Me" && error.expected.contains("by the size of the file"), "{error}");
    assert!(of_modes(10_001).unwrap_err().expected.contains("0 to 10000"));
}

/// Truth: integrals of the sample, computed by another program for the same mesh: `J1`, `Oe`, `Gr`,
/// `Ge`, `Cr` against those of the modal link of that mesh. The sample has eleven digits.
#[test]
#[ignore = "needs the reference data beside the project"]
#[allow(clippy::print_stderr, reason = "measured errors, shown with --nocapture")]
fn the_sample_body_is_the_modal_link_of_its_mesh() {
    let folder = samples();
    let sid = read_sid(folder.join("formats/beam_synthetic.SID_FEM")).unwrap();
    let sample = modal_link_from_sid("sample", &sid).unwrap();
    assert_eq!((sample.coordinates(), sample.interfaces.len()), (10, 1));
    assert!(sample.is_craig_bampton() && sample.geometric.is_none() && sample.has_second_order());
    assert_eq!((&*sample.name, &*sample.interfaces[0].name), ("sample", "1002"));

    // Writing and reading again changes nothing.
    let again = parse_sid(&write_sid(&sid_of_modal_link(&sample)), "again").unwrap();
    let back = modal_link_from_sid("other", &again).unwrap();
    let size = |k: usize| sample.M[(k, k)].sqrt();
    let lever = sample.inertia.amax().sqrt();
    let gaps =
        |a: &ModalLink, b: &ModalLink, sign: &[f64]| {
            let worst = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |w, x| if x <= w { w } else { x });
            let pairs = || (0..100).map(|at| (at / 10, at % 10));
            let matrix =
                |a: &DMatrix<f64>, b: &DMatrix<f64>| {
                    worst(&mut pairs().map(|(k, l)| {
                        (a[(k, l)] - sign[k] * sign[l] * b[(k, l)]).abs() / (b[(k, k)] * b[(l, l)]).sqrt()
                    }))
                };
            let column = |a: &Matrix3xX<f64>, b: &Matrix3xX<f64>, scale: f64| {
                worst(&mut (0..10).map(|k| (a.column(k) - b.column(k) * sign[k]).amax() / (scale * size(k))))
            };
            [
                (a.mass / b.mass - 1.0).abs(),
                (a.first_moment - b.first_moment).amax() / b.first_moment.amax(),
                (a.inertia - b.inertia).amax() / b.inertia.amax(),
                matrix(&a.K, &b.K),
                matrix(&a.M, &b.M),
                column(&a.C_t, &b.C_t, b.mass.sqrt()),
                column(&a.C_r, &b.C_r, lever),
                worst(&mut (0..10).map(|k| (a.P[k] - b.P[k] * sign[k]).amax() / (lever * size(k)))),
                worst(&mut pairs().map(|(k, l)| {
                    (a.N[10 * k + l] - b.N[10 * k + l] * (sign[k] * sign[l])).amax() / (size(k) * size(l))
                })),
            ]
        };
    let show = |what: &str, gaps: &[f64]| {
        eprintln!("{what}: {}", gaps.iter().map(|gap| format!("{gap:.1e}")).collect::<Vec<_>>().join(" "));
    };
    let twice = gaps(&back, &sample, &[1.0; 10]);
    show("sample written and read", &twice);
    assert!(twice.iter().all(|gap| *gap < 1e-12), "{twice:?}"); // measured 1.9e-16

    // The same mesh, reduced by this program.
    let options = ReadOptions { units: UnitSystem::SI, beams: Vec::new() };
    let mesh = read_mesh(folder.join("A1_beam/beam_tet10_h50mm.inp.gz"), &options).unwrap().mesh;
    let interface = |name: &str, set: &str, x: f64| Interface {
        name: name.into(),
        X_LI: Pose::translation(x, 0.0, 0.0),
        nodes: mesh.node_sets[set].clone(),
        tie: Tie::Rigid,
    };
    let interfaces = [interface("A", "INTERFACE_A", 0.0), interface("B", "INTERFACE_B", 1.0)];
    let assembly = AssemblyOptions::default();
    let model = FeModel::assemble(&mesh, &assembly).unwrap();
    let condensation = Condensation::new(&model, &interfaces, CondensationOptions::default()).unwrap();
    let fixed_modes = condensation.fixed_modes(ModesWanted::Count(4)).unwrap();
    let frame = |i: &Interface| InterfaceFrame { name: i.name.clone(), X_LI: i.X_LI, tie: Some(i.tie) };
    let superelement = condensation.superelement(interfaces.iter().map(frame).collect(), &fixed_modes);
    let source = ModalSource {
        mesh: &mesh,
        materials: &materials(&mesh, &assembly).unwrap(),
        quadrature: assembly.quadrature,
        condensation: &condensation,
        interfaces: &interfaces,
        fixed_modes: &fixed_modes,
        superelement: &superelement,
    };
    let direct = source.modal_link("beam", false);
    // The sign of a mode is arbitrary: use that of its mass coupling with the static shapes.
    let sign: Vec<f64> = (0..10)
        .map(|k| {
            let like: f64 = (0..6).map(|l| sample.M[(k, l)] * direct.M[(k, l)]).sum();
            if k < 6 { 1.0 } else { like.signum() }
        })
        .collect();
    let found = gaps(&sample, &direct, &sign);
    show("sample against its mesh", &found);
    assert!(found.iter().all(|gap| *gap < 1e-8), "{found:?}"); // measured 8e-11 (Ke), others 5e-12
}
