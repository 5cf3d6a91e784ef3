//! Valid meshes reduce without a warning, meshes with one fault each are refused or reported: both
//! are counted.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use flexarm_linkmaker::LinkError;
use flexarm_linkmaker::reduce::{
    At, InterfaceEntry, MaterialChoice, QuadratureChoice, ReduceJob, ReduceSummary, Reduction, Tie,
};

fn reduce(job: &ReduceJob) -> Result<ReduceSummary, LinkError> {
    Reduction::open(job, None, &mut |_| {})?.finish(None, &mut |_| {})
}

/// A bar of 600 x 60 x 40 mm along x as a CalculiX deck in memory, so that single entries can be
/// corrupted.
#[derive(Clone)]
struct Bar {
    kind: &'static str,
    /// Position by node number, mm.
    nodes: BTreeMap<usize, [f64; 3]>,
    elements: Vec<Vec<usize>>,
    /// Material of the deck: E, nu, rho in mm-t-s.
    material: [f64; 3],
    sets: BTreeMap<&'static str, Vec<usize>>,
}

const SIZE: [f64; 3] = [600.0, 60.0, 40.0];
const TET_EDGES: &[[usize; 2]] = &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
const WEDGE_EDGES: &[[usize; 2]] = &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];
const BRICK_EDGES: &[[usize; 2]] =
    &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

/// Corners of the elements in one cell (bits 0, 1, 2 of a number: x, y, z), and the edges with
/// mid-side nodes.
fn shape(kind: &str) -> (Vec<Vec<usize>>, &'static [[usize; 2]]) {
    let tets = vec![
        vec![0, 1, 3, 7],
        vec![0, 2, 6, 7],
        vec![0, 4, 5, 7],
        vec![0, 5, 1, 7],
        vec![0, 3, 2, 7],
        vec![0, 6, 4, 7],
    ];
    let wedges = vec![vec![0, 1, 3, 4, 5, 7], vec![0, 3, 2, 4, 7, 6]];
    let bricks = vec![vec![0, 1, 3, 2, 4, 5, 7, 6]];
    match kind {
        "C3D4" => (tets, &[]),
        "C3D10" => (tets, TET_EDGES),
        "C3D6" => (wedges, &[]),
        "C3D15" => (wedges, WEDGE_EDGES),
        "C3D20" => (bricks, BRICK_EDGES),
        _ => (bricks, &[]),
    }
}

impl Bar {
    /// Dimensions in cells; sets A and B at its ends.
    fn new(kind: &'static str, cells: [usize; 3]) -> Self {
        let (corners, edges) = shape(kind);
        let mut nodes: BTreeMap<usize, [f64; 3]> = BTreeMap::new();
        // A node number encodes the position on a grid of half cells.
        let mut number = |at: [usize; 3]| {
            let id = 1 + at[0] + 1000 * at[1] + 100_000 * at[2];
            nodes.insert(id, [0, 1, 2].map(|c| SIZE[c] * at[c] as f64 / (2 * cells[c]) as f64));
            id
        };
        let mut elements = Vec::new();
        for k in 0..cells.iter().product() {
            let cell: [usize; 3] = [k % cells[0], k / cells[0] % cells[1], k / (cells[0] * cells[1])];
            for element in &corners {
                let places: Vec<[usize; 3]> =
                    element.iter().map(|bits| [0, 1, 2].map(|c| 2 * (cell[c] + (bits >> c & 1)))).collect();
                let mut ids: Vec<usize> = places.iter().map(|place| number(*place)).collect();
                ids.extend(edges.iter().map(|[a, b]| number([0, 1, 2].map(|c| (places[*a][c] + places[*b][c]) / 2))));
                elements.push(ids);
            }
        }
        let at = |x: f64| nodes.iter().filter(|(_, p)| p[0] == x).map(|(id, _)| *id).collect::<Vec<_>>();
        let sets = BTreeMap::from([("A", at(0.0)), ("B", at(SIZE[0]))]);
        Self { kind, elements, material: [210_000.0, 0.3, 7.85e-9], sets, nodes }
    }

    fn deck(&self) -> String {
        let mut text = String::from("*NODE\n");
        for (id, p) in &self.nodes {
            let _ = writeln!(text, "{id}, {:.12}, {:.12}, {:.12}", p[0], p[1], p[2]);
        }
        let _ = writeln!(text, "*ELEMENT, TYPE={}, ELSET=BODY", self.kind);
        for (k, nodes) in self.elements.iter().enumerate() {
            let words: Vec<String> =
                std::iter::once(k + 1).chain(nodes.iter().copied()).map(|n| n.to_string()).collect();
            let lines: Vec<String> = words.chunks(12).map(|words| words.join(", ")).collect();
            let _ = writeln!(text, "{}", lines.join(",\n"));
        }
        for (name, nodes) in &self.sets {
            let words: Vec<String> = nodes.iter().map(ToString::to_string).collect();
            let lines: Vec<String> = words.chunks(12).map(|words| words.join(", ")).collect();
            let _ = writeln!(text, "*NSET, NSET={name}\n{}", lines.join(",\n"));
        }
        let [young, nu, rho] = self.material;
        let _ = writeln!(
            text,
            "*MATERIAL, NAME=M\n*ELASTIC\n{young:e}, {nu}\n*DENSITY\n{rho:e}\n*SOLID SECTION, ELSET=BODY, MATERIAL=M"
        );
        text
    }

    /// Gives the elements that `far` selects by the mean of their corners separate nodes where
    /// these satisfy `at`.
    fn split(&mut self, far: impl Fn([f64; 3]) -> bool, at: impl Fn(&[f64; 3]) -> bool) {
        let mean = |nodes: &[usize], bar: &Self| {
            [0, 1, 2].map(|c| nodes.iter().map(|n| bar.nodes[n][c]).sum::<f64>() / nodes.len() as f64)
        };
        let is_far: Vec<bool> = self.elements.iter().map(|nodes| far(mean(nodes, self))).collect();
        let mut new: BTreeMap<usize, usize> = BTreeMap::new();
        for (nodes, _) in self.elements.iter_mut().zip(is_far).filter(|(_, far)| *far) {
            for node in nodes.iter_mut().filter(|node| at(&self.nodes[node])) {
                let twin = 50_000_000 + *node;
                new.insert(*node, twin);
                *node = twin;
            }
        }
        for (old, twin) in new {
            self.nodes.insert(twin, self.nodes[&old]);
        }
    }
}

/// A folder that is removed when the test ends.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("flexarm-mutations-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn job(mesh: &Path) -> ReduceJob {
    let entry = |name: &str| InterfaceEntry {
        name: Some(name.into()),
        select: Some(name.parse().unwrap()),
        at: Some(At::Centroid),
        ..InterfaceEntry::default()
    };
    let mut job = ReduceJob::for_mesh(mesh);
    job.units = Some("mm-t-s".parse().unwrap());
    job.modes = Some(4);
    job.interface = vec![entry("A"), entry("B")];
    job
}

/// All messages about a mesh: the error, or the warnings.
fn messages(deck: &str, change: impl Fn(&mut ReduceJob)) -> Vec<String> {
    let folder = Folder::new();
    let path = folder.0.join("bar.inp");
    std::fs::write(&path, deck).unwrap();
    let mut job = job(&path);
    change(&mut job);
    match reduce(&job) {
        // Excluded: two rigid parts are coarse for a uniform bar, which is no fault of the mesh;
        // and the note on the interpretation of C3D8.
        Ok(summary) => summary
            .warnings
            .into_iter()
            .filter(|warning| {
                !warning.contains("first frequency with two rigid parts differs")
                    && !warning.contains("read with incompatible modes")
            })
            .collect(),
        Err(error) => vec![error.to_string()],
    }
}

#[test]
fn sound_meshes_of_every_kind_reduce_without_a_false_alarm() {
    let mut checked = 0;
    let mut see = |what: String, deck: String, change: &dyn Fn(&mut ReduceJob)| {
        let said = messages(&deck, change);
        assert!(said.is_empty(), "{what}: {said:?}");
        checked += 1;
    };
    for (kind, cells) in [
        ("C3D10", [12, 2, 1]),
        ("C3D10", [20, 2, 2]),
        ("C3D10", [6, 1, 1]),
        ("C3D20", [6, 1, 1]),
        ("C3D20", [12, 2, 2]),
        ("C3D15", [8, 1, 1]),
        ("C3D15", [12, 2, 2]),
        // Bricks with incompatible modes can bend in one layer.
        ("C3D8", [24, 6, 4]),
        ("C3D8I", [24, 6, 4]),
        ("C3D8", [36, 8, 6]),
    ] {
        let bar = Bar::new(kind, cells);
        see(format!("{kind} {cells:?}"), bar.deck(), &|_| {});
        see(format!("{kind} {cells:?}, distributing"), bar.deck(), &|job| job.tie = Some(Tie::Distributing));
    }
    // Realistic materials, units and shapes.
    let bar = Bar::new("C3D20", [6, 1, 1]);
    for material in
        ["steel", "aluminium", "cast_iron", "ductile_iron", "113e9,0.34,4430", "2.3e9,0.39,1050", "135e9,0.3,1600"]
    {
        let choice: MaterialChoice = material.parse().unwrap();
        let mut none = bar.deck();
        none.truncate(none.find("*MATERIAL").unwrap());
        see(material.into(), none, &|job| job.material = Some(choice));
    }
    let mut metres = bar.clone();
    metres.nodes.values_mut().for_each(|p| *p = p.map(|x| x * 1e-3));
    metres.material = [210e9, 0.3, 7850.0];
    see("metres".into(), metres.deck(), &|job| job.units = Some("m-kg-s".parse().unwrap()));
    let mut bent = Bar::new("C3D10", [12, 2, 2]);
    // An arc of 60 degrees, with mid-side nodes on it.
    bent.nodes.values_mut().for_each(|p| {
        let (angle, radius) = (p[0] / 573.0, 573.0 + p[1]);
        *p = [radius * angle.sin(), radius * angle.cos(), p[2]];
    });
    see("an arc".into(), bent.deck(), &|_| {});
    let mut thin = Bar::new("C3D20", [20, 4, 1]);
    thin.nodes.values_mut().for_each(|p| p[2] *= 0.1);
    see("a plate of 4 mm".into(), thin.deck(), &|_| {});
    eprintln!("false alarms: 0 of {checked} sound meshes");
    assert_eq!(checked, 30);
}

/// The fault, the deck, changes of the job, and a word that must be in the answer.
type Fault = (&'static str, String, Box<dyn Fn(&mut ReduceJob)>, &'static str);

fn same() -> Box<dyn Fn(&mut ReduceJob)> {
    Box::new(|_| {})
}

/// Faults of elements and their shapes.
fn element_faults() -> Vec<Fault> {
    let quadratic = Bar::new("C3D10", [12, 2, 1]);
    let mut list: Vec<Fault> = Vec::new();
    for (what, kind, cells) in [
        ("linear tetrahedra, one layer", "C3D4", [12, 1, 1]),
        ("linear tetrahedra, two layers", "C3D4", [24, 2, 2]),
        ("linear tetrahedra, four layers", "C3D4", [24, 4, 4]),
        ("linear wedges, one layer", "C3D6", [12, 1, 1]),
        ("linear wedges, two layers", "C3D6", [12, 2, 2]),
    ] {
        list.push((what, Bar::new(kind, cells).deck(), same(), "too stiff"));
    }
    let full: Box<dyn Fn(&mut ReduceJob)> = Box::new(|job| job.quadrature = Some(QuadratureChoice::Calculix));
    list.push(("bricks without incompatible modes", Bar::new("C3D8", [12, 1, 1]).deck(), full, "too stiff"));

    let mut mirrored = quadratic.clone();
    mirrored.nodes.values_mut().for_each(|p| p[1] = -p[1]);
    list.push(("a mirrored mesh", mirrored.deck(), same(), "node order"));
    let mut one = quadratic.clone();
    one.elements[7].swap(0, 1);
    list.push(("one folded element", one.deck(), same(), "inverted"));
    let mut sliver = Bar::new("C3D4", [12, 6, 6]);
    // Almost in the plane of three neighbours, within only one element.
    let [a, b, c, d] = sliver.elements[100][..] else { unreachable!() };
    let p = [a, b, c].map(|n| sliver.nodes[&n]);
    let centre = [0, 1, 2].map(|k| (p[0][k] + p[1][k] + p[2][k]) / 3.0);
    let far = sliver.nodes[&d];
    sliver.nodes.insert(d, [0, 1, 2].map(|k| centre[k] + 1e-4 * (far[k] - centre[k])));
    list.push(("a flattened element", sliver.deck(), same(), ""));
    let mut off = quadratic.clone();
    let middle = off.elements[30][5];
    off.nodes.get_mut(&middle).unwrap()[1] += 25.0;
    list.push(("a mid-side node far off", off.deck(), same(), ""));
    list
}

/// Faults of connection.
fn connection_faults() -> Vec<Fault> {
    let quadratic = Bar::new("C3D10", [12, 2, 1]);
    let mut list: Vec<Fault> = Vec::new();
    for (what, kind) in [("a crack in quadratic tetrahedra", "C3D10"), ("a crack in bricks", "C3D20")] {
        let mut cracked = Bar::new(kind, [12, 2, 2]);
        cracked.split(|p| p[0] > 300.0, |p| p[0] == 300.0 && p[1] > 30.0);
        list.push((what, cracked.deck(), same(), "lie in one place"));
    }
    let mut apart = quadratic.clone();
    apart.split(|p| p[0] > 300.0, |p| p[0] == 300.0);
    list.push(("two parts that were never joined", apart.deck(), same(), "merge"));
    let mut second = quadratic.clone();
    second.split(|p| p[0] > 300.0, |p| p[0] >= 300.0);
    second.nodes.iter_mut().filter(|(id, _)| **id > 50_000_000).for_each(|(_, p)| p[0] += 50.0);
    second.sets.insert("B", second.nodes.iter().filter(|(_, p)| p[0] == 650.0).map(|(id, _)| *id).collect());
    list.push(("a part of something else", second.deck(), same(), "share no node"));
    for (what, kind, keep, word) in [
        ("a hinge along an edge of tetrahedra", "C3D10", 0.0, "hinge"),
        ("a hinge along an edge of bricks", "C3D20", 0.0, "hinge"),
        ("a hinge in a point", "C3D20", 20.0, "hinge"),
    ] {
        let mut hinge = Bar::new(kind, [12, 2, 2]);
        hinge.split(|p| p[0] > 300.0, |p| p[0] == 300.0 && !(p[1] == 60.0 && p[2] >= 2.0 * keep));
        list.push((what, hinge.deck(), same(), word));
    }
    let mut hanging = Bar::new("C3D8", [4, 1, 1]).deck();
    let mut second = Bar::new("C3D20", [4, 1, 1]);
    second.nodes.values_mut().for_each(|p| p[0] += SIZE[0]);
    // Bricks with mid-side nodes on the end face of bricks without.
    let renamed = |n: &usize| if second.nodes[n][0] == SIZE[0] && is_corner(*n) { n + 8 } else { n + 20_000_000 };
    let mut nodes = String::from("*NODE\n");
    for (id, p) in second.nodes.iter().filter(|(id, _)| renamed(id) > 20_000_000) {
        let _ = writeln!(nodes, "{}, {}, {}, {}", renamed(id), p[0], p[1], p[2]);
    }
    let mut elements = String::from("*ELEMENT, TYPE=C3D20, ELSET=BODY\n");
    for (k, ids) in second.elements.iter().enumerate() {
        let ids: Vec<String> = ids.iter().map(|n| renamed(n).to_string()).collect();
        let _ = writeln!(elements, "{}, {},\n{}", 900 + k, ids[..10].join(", "), ids[10..].join(", "));
    }
    hanging = hanging.replacen("*NODE\n", &nodes, 1).replacen("*NSET", &format!("{elements}*NSET"), 1);
    list.push(("mid-side nodes that hang", hanging, same(), "without fitting"));
    list
}

/// Corners are at even positions of the grid of half cells.
fn is_corner(id: usize) -> bool {
    let at = [(id - 1) % 1000, (id - 1) / 1000 % 100, (id - 1) / 100_000];
    at.iter().all(|k| k % 2 == 0)
}

/// Faults of interfaces.
fn interface_faults() -> Vec<Fault> {
    let bar = Bar::new("C3D10", [12, 2, 2]);
    let mut list: Vec<Fault> = Vec::new();
    for kind in ["C3D10", "C3D15", "C3D20"] {
        let mut corners = Bar::new(kind, [12, 2, 2]);
        corners.sets.values_mut().for_each(|set| set.retain(|id| is_corner(*id)));
        list.push(("sets of corner nodes", corners.deck(), same(), "mid-side nodes"));
    }
    let with = |name: &'static str, keep: &dyn Fn(&[f64; 3]) -> bool| {
        let mut bar = bar.clone();
        bar.sets.insert(name, bar.nodes.iter().filter(|(_, p)| keep(p)).map(|(id, _)| *id).collect());
        bar.deck()
    };
    let edge = |p: &[f64; 3]| p[0] == 600.0 && p[2] == 0.0;
    list.push(("an interface on an edge", with("B", &edge), same(), "line"));
    list.push(("an interface of one node", with("B", &|p| edge(p) && p[1] == 0.0), same(), "one point"));
    list.push(("an interface inside the body", with("B", &|p| p[0] == 550.0), same(), "inside the body"));
    let scattered = |p: &[f64; 3]| p[0] == 600.0 && (p[1] == 0.0 || p[1] == 60.0) && (p[2] == 0.0 || p[2] == 40.0);
    list.push(("an interface of four single nodes", with("B", &scattered), same(), "no face of the surface"));
    list.push(("interfaces that overlap", with("B", &|p| p[2] == 0.0), same(), "overlap"));
    let place = |xyz: [f64; 3]| -> Box<dyn Fn(&mut ReduceJob)> {
        Box::new(move |job| (job.interface[1].at, job.interface[1].xyz) = (None, Some(xyz)))
    };
    list.push(("a frame in m in a mesh in mm", bar.deck(), place([0.6, 0.03, 0.02]), "in the unit of the mesh"));
    list.push(("a frame far away", bar.deck(), place([600.0, 30.0, 900.0]), "from the centroid of its nodes"));
    list
}

/// Faults of units and materials.
fn material_faults() -> Vec<Fault> {
    let bar = Bar::new("C3D20", [6, 1, 1]);
    let mut list: Vec<Fault> = Vec::new();
    for (what, material, word) in [
        ("E in Pa with mm-t-s", [2.1e11, 0.3, 7.85e-9], "Young's modulus E is 2.100e17 Pa (2.1000e11 in units mm-t-s)"),
        ("density in kg/m3 with mm-t-s", [2.1e5, 0.3, 7850.0], "t/mm3"),
        ("density in kg/mm3 with mm-t-s", [2.1e5, 0.3, 7.85e-6], "density"),
        ("density zero", [2.1e5, 0.3, 0.0], "density"),
        ("nu of rubber", [2.1e5, 0.4998, 7.85e-9], "rubber"),
        ("incompressible", [2.1e5, 0.5, 7.85e-9], "Poisson"),
        ("nu below zero", [2.1e5, -0.9, 7.85e-9], "sign"),
        ("nu above a half", [2.1e5, 0.7, 7.85e-9], "Poisson"),
        ("E below zero", [-2.1e5, 0.3, 7.85e-9], "modulus"),
    ] {
        list.push((what, Bar { material, ..bar.clone() }.deck(), same(), word));
    }
    let steel: MaterialChoice = "steel".parse().unwrap();
    let metres = move |job: &mut ReduceJob, units: &str| {
        (job.units, job.material) = (Some(units.parse().unwrap()), Some(steel));
    };
    list.push(("mm declared as m", bar.deck(), Box::new(move |job| metres(job, "m-kg-s")), "millimetres"));
    let mut small = bar.clone();
    small.nodes.values_mut().for_each(|p| *p = p.map(|x| x * 1e-3));
    list.push(("m declared as mm", small.deck(), Box::new(move |job| metres(job, "mm-t-s")), "With m for mm"));
    list
}

#[test]
fn every_spoilt_mesh_is_refused_or_told_with_the_word_that_helps() {
    let faults: Vec<Fault> =
        [element_faults(), connection_faults(), interface_faults(), material_faults()].into_iter().flatten().collect();
    let total = faults.len();
    let mut missed = Vec::new();
    for (what, deck, change, word) in faults {
        let said = messages(&deck, change);
        if said.is_empty() || !said.iter().any(|sentence| sentence.contains(word)) {
            missed.push(format!("{what}: {said:?}"));
        }
    }
    eprintln!("caught: {} of {total} spoilt meshes", total - missed.len());
    assert!(missed.is_empty(), "{}", missed.join("\n"));
    assert_eq!(total, 39);
}

/// Truth: the bar without the crack.
#[test]
fn merging_closes_a_crack() {
    let whole = Bar::new("C3D10", [12, 2, 2]);
    let mut cracked = whole.clone();
    cracked.split(|p| p[0] > 300.0, |p| p[0] == 300.0 && p[1] > 30.0);
    let folder = Folder::new();
    let softness = |bar: &Bar, merge: Option<f64>| {
        let path = folder.0.join("bar.inp");
        std::fs::write(&path, bar.deck()).unwrap();
        let job = ReduceJob { merge, ..job(&path) };
        reduce(&job).unwrap().statics.compliance[1][1]
    };
    let truth = softness(&whole, None);
    assert!(softness(&cracked, None) / truth > 1.1);
    let error = softness(&cracked, Some(1e-3)) / truth - 1.0;
    assert!(error.abs() < 1e-9, "{error:.1e}");
}

/// Truth: the same mesh in second order, reduced separately, through another program path.
#[test]
fn the_estimate_of_the_stiffness_of_linear_elements_is_what_quadratic_ones_give() {
    let folder = Folder::new();
    let reduced = |kind: &'static str, cells: [usize; 3], tie: Tie| {
        let path = folder.0.join("bar.inp");
        std::fs::write(&path, Bar::new(kind, cells).deck()).unwrap();
        let job = ReduceJob { tie: Some(tie), ..job(&path) };
        reduce(&job).unwrap()
    };
    for (first, second) in [("C3D4", "C3D10"), ("C3D6", "C3D15"), ("C3D8", "C3D20")] {
        let (coarse, truth) = (reduced(first, [12, 2, 2], Tie::Rigid), reduced(second, [12, 2, 2], Tie::Rigid));
        let ratios = coarse.checks.order_ratios.unwrap();
        for (k, ratio) in ratios.iter().enumerate() {
            let exact = truth.statics.compliance[k][k] / coarse.statics.compliance[k][k];
            assert!((ratio / exact - 1.0).abs() < 5e-3, "{first} {k}: {ratio:.4} instead of {exact:.4}");
        }
        assert_eq!(truth.checks.order_ratio, None);
    }
}

/// Truth: on rectangular bricks the points of CalculiX integrate stiffness and mass as exactly as
/// flexarm's rules.
#[test]
fn c3d8i_keeps_its_incompatible_modes_under_the_rules_of_calculix() {
    let folder = Folder::new();
    let frequency = |kind: &'static str, quadrature: QuadratureChoice| {
        let path = folder.0.join("bar.inp");
        std::fs::write(&path, Bar::new(kind, [12, 1, 1]).deck()).unwrap();
        let job = ReduceJob { quadrature: Some(quadrature), ..job(&path) };
        reduce(&job).unwrap().frequencies_hz[0]
    };
    let truth = frequency("C3D8I", QuadratureChoice::Exact);
    let error = frequency("C3D8I", QuadratureChoice::Calculix) / truth - 1.0;
    assert!(error.abs() < 1e-10, "{error:.1e}");
    // C3D8 has none there, as `calculix` implies, and is too stiff.
    assert!(frequency("C3D8", QuadratureChoice::Calculix) / truth > 1.1);

    let both = Bar::new("C3D8I", [4, 1, 1]).deck().replacen(
        "*NSET",
        "*ELEMENT, TYPE=C3D8, ELSET=BODY\n99, 1, 2, 3, 4, 5, 6, 7, 8\n*NSET",
        1,
    );
    let both = both.replacen("99, 1, 2, 3, 4, 5, 6, 7, 8", &twin_brick(), 1);
    let said = messages(&both, |job| job.quadrature = Some(QuadratureChoice::Calculix));
    assert!(said.iter().any(|sentence| sentence.contains("C3D8I as well as C3D8")), "{said:?}");
}

/// A brick beyond the end of a bar of four cells, as a line of a deck, with its far nodes.
fn twin_brick() -> String {
    let id = |at: [usize; 3]| 1 + at[0] + 1000 * at[1] + 100_000 * at[2];
    let near = [[8, 0, 0], [8, 2, 0], [8, 2, 2], [8, 0, 2]].map(id);
    let far = near.map(|n| n + 30_000_000);
    let order = [near[0], far[0], far[1], near[1], near[3], far[3], far[2], near[2]].map(|n| n.to_string());
    let places = [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]];
    let nodes: Vec<String> = far.iter().zip(places).map(|(n, [y, z])| format!("{n}, 700.0, {y}, {z}")).collect();
    format!("99, {}\n*NODE\n{}", order.join(", "), nodes.join("\n"))
}
