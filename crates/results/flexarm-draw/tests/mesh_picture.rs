//! Pictures of a reduction, checked by counting pixels.

use std::path::PathBuf;

use flexarm_draw::mesh_picture::scene::{Layer, Paint, Scene, render};
use flexarm_draw::mesh_picture::{Image, MeshPictures, PictureError, Rgb, View, color};
use flexarm_fe_io::mesh::{ReadOptions, read_mesh};
use flexarm_fem::reduction::{CondensationOptions, Interface, Tie};
use flexarm_fem::sparse::ModesWanted;
use flexarm_fem::{
    ElementBlock, ElementKind, GateLimits, LinkPlan, Material, Mesh, MeshReduction, Pose, Provenance, SplitAt,
    UnitSystem, reduce_mesh,
};
use nalgebra::Vector3;

/// Truth: the scene on paper, and four samples per pixel: the background shows through in quarters.
/// Thin and large triangles, some of them partly outside.
#[test]
fn a_layer_lies_over_any_ground_as_the_scene_does() {
    let mut seed = 7_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as f64 / (1_u64 << 31) as f64 * 1.6 - 0.8
    };
    let positions: Vec<Vector3<f64>> = (0..90).map(|_| Vector3::new(random(), random(), 0.3 * random())).collect();
    let triangles: Vec<[u32; 3]> = (0..30).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let values: Vec<f64> = positions.iter().map(|p| p.x.abs()).collect();
    let paint = Paint::Magnitude { values: &values, peak: 0.8 };
    let scene = Scene { positions: &positions, triangles: &triangles, paint, marks: &[] };
    let box_of_view = [10.0, 10.0, 180.0, 130.0];
    let seen = positions.iter().copied().take(60);
    let view = View::fit(Vector3::new(0.2, 0.3, 1.0), Vector3::x(), seen, box_of_view);
    let layer = Layer::new(&scene, &view, 200, 150);
    let drawn = render(&scene, &view, 200, 150);
    let [white, dark] = [[255; 3], [27, 31, 38]];
    let [on_white, on_dark] = [white, dark].map(|ground| {
        let mut over = Image::new(200, 150, ground);
        layer.lay_over(&mut over, 1.0);
        over
    });
    let pixels = on_white.rgba.chunks_exact(4).zip(on_dark.rgba.chunks_exact(4)).zip(drawn.rgba.chunks_exact(4));
    for ((on_white, on_dark), drawn) in pixels {
        for c in 0..3 {
            assert!(on_white[c].abs_diff(drawn[c]) <= 1, "{on_white:?} {drawn:?}"); // both are rounded
            let quarters = 4.0 * f64::from(on_white[c] - on_dark[c]) / f64::from(white[c] - dark[c]);
            assert!((quarters - quarters.round()).abs() < 0.03, "{on_white:?} {on_dark:?}"); // rounding of both
        }
    }
    let ground_left = on_white.rgba.chunks_exact(4).filter(|pixel| pixel[..3] == white).count();
    assert!((1000..25_000).contains(&ground_left), "{ground_left}");
    let outline: Vec<f32> = layer.outline().map(|(.., share)| share).collect();
    assert!(outline.iter().any(|share| *share > 0.9) && (500..15_000).contains(&outline.len()), "{}", outline.len());
}

/// A steel bar of bricks along x, 0.8 x 0.1 x 0.06 m.
fn bar() -> Mesh {
    let cells = [10_u32, 3, 2];
    let at = |i: u32, j: u32, k: u32| i + 11 * (j + 4 * k);
    let mut mesh = Mesh::default();
    for (k, j, i) in (0..3).flat_map(|k| (0..4).flat_map(move |j| (0..11).map(move |i| (k, j, i)))) {
        mesh.nodes.push(Vector3::new(0.08 * f64::from(i), 0.1 / 3.0 * f64::from(j), 0.03 * f64::from(k)));
        mesh.node_ids.push(u64::from(at(i, j, k)) + 1);
    }
    let mut connectivity = Vec::new();
    for (k, j, i) in (0..cells[2]).flat_map(|k| (0..cells[1]).flat_map(move |j| (0..cells[0]).map(move |i| (k, j, i))))
    {
        for k in [k, k + 1] {
            connectivity.extend([at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)]);
        }
    }
    let ids = (1..=connectivity.len() as u64 / 8).collect();
    mesh.regions = vec![flexarm_fem::mesh::Region { name: "bar".into(), material: Some(Material::STEEL), beam: None }];
    mesh.blocks = vec![ElementBlock { kind: ElementKind::Hex8, region: 0, ids, connectivity }];
    mesh
}

fn interface(mesh: &Mesh, name: &str, at: [f64; 3], chosen: impl Fn(&Vector3<f64>) -> bool) -> Interface {
    let nodes = (0..).zip(&mesh.nodes).filter(|(_, p)| chosen(p)).map(|(node, _)| node).collect();
    Interface { name: name.into(), X_LI: Pose::translation(at[0], at[1], at[2]), nodes, tie: Tie::Rigid }
}

/// Both end faces of the bar.
fn ends(mesh: &Mesh) -> Vec<Interface> {
    vec![
        interface(mesh, "A", [0.0, 0.05, 0.03], |p| p.x < 1e-9),
        interface(mesh, "B", [0.8, 0.05, 0.03], |p| p.x > 0.8 - 1e-9),
    ]
}

fn reduce(mesh: &Mesh, interfaces: &[Interface]) -> MeshReduction {
    let plan = LinkPlan {
        name: "bar".into(),
        interfaces: interfaces.to_vec(),
        assembly: Default::default(),
        condensation: CondensationOptions::default(),
        modes: ModesWanted::Count(4),
        split: SplitAt::MidLength,
        chains: Vec::new(),
        attached: Vec::new(),
        geometric: false,
        stress: false,
        judged_modes: 4,
        limits: GateLimits::default(),
        provenance: Provenance::default(),
    };
    reduce_mesh(mesh, &plan, &mut |_| ()).unwrap()
}

/// Pixels of `[left, right) x [top, bottom)` with a colour that `wanted` accepts.
fn pixels(image: &Image, [left, right, top, bottom]: [usize; 4], wanted: impl Fn(Rgb) -> bool) -> Vec<(usize, usize)> {
    let all = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
    all.filter(|(x, y)| wanted(image.pixel(*x, *y))).collect()
}

/// Whether a colour is `wanted` with more or less light: the same ratio of red, green and blue.
fn is_shade_of(wanted: Rgb) -> impl Fn(Rgb) -> bool {
    move |color| {
        let [a, b] = [wanted, color].map(|c| Vector3::from(c.map(f64::from)));
        let spread = b.max() - b.min();
        spread > 60.0 && a.normalize().dot(&b.normalize()) > 0.995
    }
}

const VIEWS: [[usize; 4]; 2] = [[0, 1200, 60, 330], [0, 1200, 340, 610]];
const LEGEND: [usize; 4] = [1215, 1600, 60, 900];

/// Opposite directions: every flat face points at the viewer in one of the first two views.
#[test]
fn each_tied_end_face_fills_an_area_of_its_colour_in_one_of_two_opposite_views() {
    let mesh = bar();
    let interfaces = ends(&mesh);
    let reduction = reduce(&mesh, &interfaces);
    let sheet = MeshPictures::new(&mesh, &interfaces, &reduction).unwrap().render_interfaces();
    for number in 0..2 {
        let counts = VIEWS.map(|view| pixels(&sheet, view, is_shade_of(color::interface(number))).len());
        let (more, less) = (counts[0].max(counts[1]), counts[0].min(counts[1]));
        assert!(more > 2000 && less < more / 3, "{counts:?}"); // the lesser: name and spokes
    }
    // A is on the left and B on the right, from either side.
    let column = |number: usize, view: [usize; 4]| {
        let found = pixels(&sheet, view, is_shade_of(color::interface(number)));
        found.iter().map(|(x, _)| *x).sum::<usize>() / found.len()
    };
    assert!(VIEWS.iter().all(|view| column(0, *view) + 400 < column(1, *view)));
    assert!(VIEWS.iter().all(|view| pixels(&sheet, *view, |c| c == color::CUT).len() > 50), "no cut is seen");
}

#[test]
fn a_load_across_the_tip_moves_the_tip_most_and_the_held_end_not_at_all() {
    let mesh = bar();
    let interfaces = ends(&mesh);
    let reduction = reduce(&mesh, &interfaces);
    let sheet = MeshPictures::new(&mesh, &interfaces, &reduction).unwrap().render_unit_loads();
    // Panel Fy, second in the first row, between its heading and its colour bar.
    let panel = [880, 1600, 110, 286];
    let column = |value: f64| {
        let mut found: Vec<_> =
            pixels(&sheet, panel, is_shade_of(color::magnitude(value))).into_iter().map(|(x, _)| x).collect();
        found.sort_unstable();
        assert!(found.len() > 200, "{} pixels at {value}", found.len());
        found[found.len() / 2]
    };
    let columns = [0.02, 0.5, 0.98].map(column);
    assert!(columns[0] + 100 < columns[1] && columns[1] + 60 < columns[2], "{columns:?}");
}

#[test]
fn single_tied_nodes_without_a_whole_face_are_told_in_red() {
    let mesh = bar();
    let red = |interfaces: &[Interface]| {
        let reduction = reduce(&mesh, interfaces);
        let sheet = MeshPictures::new(&mesh, interfaces, &reduction).unwrap().render_interfaces();
        pixels(&sheet, LEGEND, |c| c == color::ALERT).len()
    };
    let good = ends(&mesh);
    // Two edges of the end face: nodes without a common face.
    let edges = interface(&mesh, "B", [0.8, 0.05, 0.03], |p| p.x > 0.8 - 1e-9 && !(0.01..0.09).contains(&p.y));
    // The excessive stiffness of first-order bricks is reported in red as well.
    assert!(red(&[good[0].clone(), edges]) > red(&good) + 100);
}

#[test]
fn the_same_reduction_gives_the_same_bytes_of_a_png() {
    let mesh = bar();
    let interfaces = ends(&mesh);
    let reduction = reduce(&mesh, &interfaces);
    let draw = || -> Vec<Vec<u8>> {
        let pictures = MeshPictures::new(&mesh, &interfaces, &reduction).unwrap();
        let sheets = [pictures.render_interfaces(), pictures.render_unit_loads(), pictures.render_modes().unwrap()];
        sheets.iter().map(|sheet| sheet.to_png().unwrap()).collect()
    };
    let (first, second) = (draw(), draw());
    assert!(first == second);

    let mut reader = png::Decoder::new(std::io::Cursor::new(&first[0])).read_info().unwrap();
    let mut rgba = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut rgba).unwrap();
    assert_eq!((info.width, info.height), (1600, 900));
    let pictures = MeshPictures::new(&mesh, &interfaces, &reduction).unwrap();
    assert!(rgba == pictures.render_interfaces().rgba);
}

#[test]
fn what_cannot_be_drawn_is_an_error_and_not_a_panic() {
    let mesh = bar();
    let interfaces = ends(&mesh);
    let mut reduction = reduce(&mesh, &interfaces);
    let error = |mesh: &Mesh, interfaces: &[Interface], reduction: &MeshReduction| {
        MeshPictures::new(mesh, interfaces, reduction).unwrap_err().to_string()
    };
    assert!(error(&Mesh::default(), &interfaces, &reduction).contains("no elements"));
    let mut smaller = mesh.clone();
    smaller.blocks[0].ids.truncate(5);
    smaller.blocks[0].connectivity.truncate(8 * 5);
    assert!(error(&smaller, &interfaces, &reduction).contains("another mesh"));
    let stray = [interfaces[0].clone(), Interface { nodes: vec![132], ..interfaces[1].clone() }];
    assert!(error(&mesh, &stray, &reduction).contains("\"B\""));
    reduction.held_modes = flexarm_fem::sparse::Modes::none(reduction.unit_loads.nrows());
    let modes = MeshPictures::new(&mesh, &interfaces, &reduction).unwrap().render_modes();
    assert!(matches!(modes, Err(PictureError::NoModes)));
    reduction.unit_loads[(7, 2)] = f64::NAN;
    assert!(error(&mesh, &interfaces, &reduction).contains("not finite"));
}

#[test]
fn a_frame_of_beam_elements_is_drawn_as_rods_that_bend() {
    let mut mesh = bar();
    mesh.nodes = (0..9).map(|k| Vector3::new(0.1 * f64::from(k), 0.0, 0.0)).collect();
    mesh.node_ids = (1..10).collect();
    mesh.regions[0].beam = Some(flexarm_fem::mesh::BeamProperties {
        section: flexarm_fem::Section::Tube { outer_diameter: 0.08, wall: 0.005 },
        y_axis: Vector3::y(),
        theory: flexarm_fem::BeamTheory::Timoshenko,
    });
    let connectivity = (0..8).flat_map(|k| [k, k + 1]).collect();
    mesh.blocks = vec![ElementBlock { kind: ElementKind::Beam2, region: 0, ids: (1..9).collect(), connectivity }];
    let interfaces =
        [interface(&mesh, "A", [0.0; 3], |p| p.x < 1e-9), interface(&mesh, "B", [0.8, 0.0, 0.0], |p| p.x > 0.79)];
    let reduction = reduce(&mesh, &interfaces);
    let pictures = MeshPictures::new(&mesh, &interfaces, &reduction).unwrap();
    assert_eq!(pixels(&pictures.render_interfaces(), LEGEND, |c| c == color::ALERT), []);
    let sheet = pictures.render_unit_loads();
    assert!(pixels(&sheet, [880, 1600, 110, 286], is_shade_of(color::magnitude(0.98))).len() > 50);
}

/// Truth: areas of plane figures.
#[test]
fn nearer_triangles_hide_farther_ones_and_keep_their_area() {
    let z = |z: f64| [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(|[x, y]| Vector3::new(x, y, z));
    let mut near = z(0.5);
    near.iter_mut().for_each(|p| *p = Vector3::new(0.5 * p.x + 0.5, 0.5 * p.y + 0.5, p.z));
    // The nearer one first: order must not matter.
    let positions: Vec<_> = near.into_iter().chain(z(0.0)).collect();
    let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    let (front, back) = ([250, 30, 20], [20, 40, 250]);
    let colors = [[front; 2], [front; 2], [back; 2], [back; 2]];
    let paint = Paint::Faces { colors: &colors, bright: &[false; 4], side: &[0.0; 8] };
    let scene = Scene { positions: &positions, triangles: &triangles, paint, marks: &[] };
    let view = View::fit(Vector3::z(), Vector3::x(), positions.iter().copied(), [10.0, 10.0, 200.0, 200.0]);
    let image = render(&scene, &view, 220, 220);
    let count = |wanted| pixels(&image, [0, 220, 0, 220], is_shade_of(wanted)).len() as f64;
    // Outlines darken a rim of one pixel.
    assert!((count(front) / 1e4 - 1.0).abs() < 0.05, "{}", count(front));
    assert!((count(back) / 3e4 - 1.0).abs() < 0.05, "{}", count(back));
}

/// The lower arm of the reference data: flanges that face opposite sides.
#[test]
#[ignore = "needs the reference data beside the project"]
fn the_flanges_of_the_lower_arm_show_one_on_each_side() {
    let named = std::env::var_os("FLEXARM_SHARED").map(PathBuf::from);
    let up = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let mut shared = named.into_iter().chain(up.ancestors().map(|folder| folder.join("shared")));
    let name = "fe/A2_lower_arm/arm_tet10_h30mm.inp.gz";
    let path = shared.find_map(|folder| Some(folder.join(name)).filter(|path| path.exists())).expect("the mesh");
    let mesh = read_mesh(path, &ReadOptions { units: UnitSystem::SI, beams: Vec::new() }).unwrap().mesh;
    let flange = |name: &str, set: &str, at: [f64; 3]| {
        let nodes = mesh.node_sets[set].clone();
        Interface { name: name.into(), X_LI: Pose::translation(at[0], at[1], at[2]), nodes, tie: Tie::Rigid }
    };
    let interfaces = [flange("A", "INTERFACE_A", [0.0, -0.075, 0.0]), flange("B", "INTERFACE_B", [0.04, 0.11, 1.1])];
    let reduction = reduce(&mesh, &interfaces);
    let sheet = MeshPictures::new(&mesh, &interfaces, &reduction).unwrap().render_interfaces();
    let count = |view: usize, number: usize| pixels(&sheet, VIEWS[view], is_shade_of(color::interface(number))).len();
    assert!(count(0, 1) > 3 * count(1, 1), "B is seen from the first side: {} {}", count(0, 1), count(1, 1));
    assert!(count(1, 0) > 3 * count(0, 0), "A is seen from the other side: {} {}", count(0, 0), count(1, 0));
}
