//! A cast lower arm: from a mesh of tetrahedra to a link, each step against the mesh and against two other programs.

use flexarm::{Modelling, Robot};
use flexarm_draw::{CurveLook, Panel, PlotCurve};
use flexarm_fem::chain::Chain;
use flexarm_fem::reduction::Tie;
use flexarm_fem::{ElasticSplit, UnitSystem};
use nalgebra::{Matrix6, Vector3, Vector6};

use crate::Error;
use crate::Pace;
use crate::bench::{
    Bench, LOADS, LUMPED, Rig, Stored, Worst, column_error, compliance_error, damped, larger, modal, parts,
    small_loads, weight_response, weightless,
};
use crate::meshed::{Condensed, Meshed, inverse};
use crate::page::{Bound, Case, Figure, Table, bare_error, digits, error, fixed, signed, word};

const ROBOT: &str = "robots/lower_arm/robot.toml";
const MESH: &str = "robots/lower_arm/lower_arm.msh.gz";
/// The frame at interface B.
const B: Option<&str> = Some("flange");
const G: f64 = 9.81;
/// Frequencies that are compared.
const MODES: usize = 6;
const AXES: [&str; 3] = ["x", "y", "z"];

/// What the mesh says, with A held.
struct Truth {
    /// Its name in claims.
    name: &'static str,
    /// Whether it is the mesh itself, and not what the link file keeps of it.
    whole: bool,
    C: Matrix6<f64>,
    /// Motion of B under weight along x, y, z.
    sag: [Vector6<f64>; 3],
    hz: Vec<f64>,
}

impl Truth {
    fn new(condensed: &Condensed<'_>) -> Result<Self, Error> {
        let sag = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| condensed.under_acceleration(&(G * axis)));
        Ok(Self { name: "the mesh", whole: true, C: condensed.compliance()?, sag, hz: condensed.held_hz(MODES)? })
    }

    /// From the condensed matrices of the link file, which have no more than a few modes.
    fn filed(robot: &Robot, hz: Vec<f64>) -> Result<Self, Error> {
        let reduced = &robot.flexible[0].flexible.reduced;
        let element = reduced.details.as_ref().and_then(|details| details.superelement.as_ref());
        let element = element.ok_or(Error::NoCondensedMass)?;
        let C = inverse(&reduced.K_BB).ok_or(Error::SingularLink)?;
        let sag = [0, 1, 2].map(|axis| {
            // Both interfaces move alike, and the mass says what that loads B with.
            let load = element.M.column(axis) + element.M.column(6 + axis);
            C * Vector6::from_fn(|i, _| G * load[6 + i])
        });
        Ok(Self { name: "matrices of the link file", whole: false, C, sag, hz })
    }

    fn stored(stored: &Stored) -> Result<Self, Error> {
        let [x, y, z] = AXES.map(|axis| stored.vector6(&format!("gravity/{axis}")));
        let hz = stored.numbers("frequencies_hz")?.into_iter().take(MODES).collect();
        Ok(Self { name: "", whole: true, C: stored.matrix6("C_BB")?, sag: [x?, y?, z?], hz })
    }
}

/// The case.
pub(crate) fn case(bench: &Bench, _pace: &mut Pace<'_>) -> Result<Case, Error> {
    let mut case = Case::new("lower-arm", "3. Lower arm");
    let mut robot = bench.robot(ROBOT)?;
    // The truths are those of the casting alone.
    for link in robot.rigid.links.iter_mut().filter(|link| link.name == "flange") {
        link.inertia = None;
    }
    let calculix = bench.stored("lower_arm_calculix.json")?;
    let ngsolve = bench.stored("lower_arm_ngsolve.json")?;
    let others = [("CalculiX", Truth::stored(&calculix)?), ("NGSolve", Truth::stored(&ngsolve)?)];
    let programs = format!("{}; {}", calculix.provenance(), ngsolve.provenance());
    let about = "`robots/lower_arm`: an aluminium casting of 22.02 kg, 1.1 m between its axes, bowed, hollow, without a plane of symmetry, meshed with TET10; the disc at its end is left out. Its seat A is held, seat \
        B is loaded and watched; both are tied rigidly unless said otherwise. The link is `lower_arm.flex`, made from this mesh by `flexarm reduce`: the 6x6 at B, two parts, chains of 3, 4 and 8 parts, ten modes. \
        Axes of the link, z from A towards B. By hand: `flexarm reduce robots/lower_arm/lower_arm.reduce.toml`, `flexarm modes lower_arm --segments 4`.";
    if bench.quick {
        case.text(format!(
            "{about} Truth, in this quick run, instead of the mesh: the matrices of the link file, and frequencies by NGSolve. Other programs: {programs}."
        ));
        let truth = Truth::filed(&robot, others[1].1.hz.clone())?;
        flange_loads(&mut case, &robot, &truth, &others)?;
        weight(&mut case, &robot, &truth, &others)?;
        frequencies(&mut case, &robot, &truth, &others)?;
        return Ok(case);
    }
    let units = "mm-t-s".parse::<UnitSystem>()?;
    let mesh = Meshed::read(bench, MESH, units)?;
    let reduced = &robot.flexible[0].flexible.reduced;
    let (p_A, p_B) = (reduced.X_LA.translation.vector, reduced.X_LB.translation.vector);
    case.text(format!(
        "{about} Truth: the whole mesh, {} degrees of freedom, assembled and condensed here, which is judged first against two other programs on the same mesh: {programs}.",
        mesh.size()
    ));
    let condensed = mesh.condensed([Tie::Rigid; 2], p_A, p_B)?;
    let truth = Truth::new(&condensed)?;
    flange_loads(&mut case, &robot, &truth, &others)?;
    weight(&mut case, &robot, &truth, &others)?;
    limit_of_parts(&mut case, &mesh, &condensed, &truth)?;
    frequencies(&mut case, &robot, &truth, &others)?;
    ties(&mut case, &mesh, [p_A, p_B], &truth, [&calculix, &ngsolve])?;
    Ok(case)
}

/// Six loads at B: other programs and every method against the mesh.
fn flange_loads(case: &mut Case, robot: &Robot, truth: &Truth, others: &[(&str, Truth)]) -> Result<(), Error> {
    case.heading("Six loads at the flange");
    let mut methods: Vec<(String, Matrix6<f64>)> =
        others.iter().map(|(name, other)| ((*name).to_owned(), other.C)).collect();
    let filed = inverse(&robot.flexible[0].flexible.reduced.K_BB);
    methods.push(("link file".into(), filed.ok_or(Error::SingularLink)?));
    let (light, usual) = (damped(weightless(robot.clone())), small_loads(&truth.C));
    let mut loads = usual;
    loads[2] *= 0.1;
    let two = Rig::new(&light, &parts(2), B)?;
    for (name, kind) in LUMPED {
        let C = two.compliance(&loads, |rig, wrench| rig.settled(wrench, kind, 5e-4))?;
        methods.push((format!("{name}, 2 parts"), C));
    }
    let direct: [(&str, Modelling); 5] = [
        ("3 parts", parts(3)),
        ("4 parts", parts(4)),
        ("8 parts", parts(8)),
        ("modal, 0 modes", modal(0)),
        ("modal, 10 modes", modal(10)),
    ];
    for (name, modelling) in &direct {
        methods.push(((*name).into(), Rig::new(&light, modelling, B)?.compliance(&loads, Rig::statics)?));
    }
    let mut table = Table::new(
        "Motion of B along each load, per unit of it, and the error of the others: the largest of the six components of the motion of B, over `sqrt(C_ii C_jj)`. Compliant constraints and \
         spring-damper run in time until they rest, loads that move B by 10 µm or 10 µrad (F_z: 1 µm), up and down.",
        &["load", if truth.whole { "mesh [µm, µrad per N, N m]" } else { "link file [µm, µrad per N, N m]" }],
    );
    table.columns.extend(methods.iter().map(|(name, _)| name.clone()));
    for (j, load) in LOADS.iter().enumerate() {
        let mut row = vec![word(*load), digits(1e6 * truth.C[(j, j)], 6)];
        row.extend(methods.iter().map(|(_, C)| error(column_error(C, &truth.C, j))));
        table.rows.push(row);
    }
    case.table(table);
    for (k, (name, C)) in methods.iter().enumerate() {
        let worst = compliance_error(C, &truth.C);
        // Other programs judge the mesh, the mesh judges the rest; a file does not judge itself.
        let (text, by) = match k {
            _ if k < others.len() => (format!("casting, loads at the flange, {}", truth.name), name.as_str()),
            _ if k == others.len() && !truth.whole => continue,
            _ => (format!("casting, loads at the flange, {name}"), truth.name),
        };
        case.claim(text, by, worst, Bound::AtMost(1e-7));
    }
    let wrench = Vector6::new(0.0, 0.0, usual[2], 0.0, 0.0, 0.0);
    let column = (two.statics(&wrench)? - two.statics(&-wrench)?) / (2.0 * usual[2]);
    let mut C = truth.C;
    C.set_column(2, &column);
    case.text(format!(
        "The link file holds all digits. F_z pushes along the casting, which is forty times stiffer that way than across: what moves B by 10 µm, {:.0} N, bends it sideways by 50 µm and acts on the bent link. \
         Parts that turn feel this, by {} with that load; it falls with the square of the load, so it is geometry, and a tenth of it was taken here. Modal links without stiffness by load are linear.",
        usual[2],
        bare_error(column_error(&C, &truth.C, 2))
    ));
    Ok(())
}

/// Errors of shift and rotation as vectors, over their sizes.
fn parted(u: &Vector6<f64>, truth: &Vector6<f64>) -> [f64; 2] {
    [0, 3].map(|from| {
        let size = truth.fixed_rows::<3>(from);
        (u.fixed_rows::<3>(from) - size).norm() / size.norm()
    })
}

/// Models of the link: word, number of parts if lumped, modelling.
fn models() -> Vec<(String, Option<usize>, Modelling)> {
    let lumped = [2, 3, 4, 8].map(|n| (format!("{n} parts"), Some(n), parts(n)));
    lumped.into_iter().chain([0, 5, 10].map(|m| (format!("modal, {m} modes"), None, modal(m)))).collect()
}

/// Own weight in three directions.
fn weight(case: &mut Case, robot: &Robot, truth: &Truth, others: &[(&str, Truth)]) -> Result<(), Error> {
    case.heading("Own weight in three directions");
    let sizes = truth.sag.iter().zip(AXES).map(|(u, axis)| {
        let [shift, turn] = [0, 3].map(|from| 1e6 * u.fixed_rows::<3>(from).norm());
        format!("{axis} {} µm and {} µrad", plain(shift), plain(turn))
    });
    let mut table = Table::new(
        format!(
            "Motion of B under 9.81 m/s² along an axis, casting alone; by {} {}. Errors of the shift and of the rotation as vectors, over their sizes. The robot: a hundredth of the weight up and \
             down, so linear.",
            truth.name,
            sizes.collect::<Vec<_>>().join(", ")
        ),
        &["model", "x, shift", "x, rotation", "y, shift", "y, rotation", "z, shift", "z, rotation"],
    );
    let mut other_programs = 0.0f64;
    for (name, other) in others {
        let errors: Vec<f64> = other.sag.iter().zip(&truth.sag).flat_map(|(u, truth)| parted(u, truth)).collect();
        other_programs = larger(other_programs, errors.iter().copied().worst());
        table.rows.push(std::iter::once(word(*name)).chain(errors.into_iter().map(error)).collect());
    }
    let (mut modal_worst, mut lumped) = (0.0f64, Vec::new());
    for (name, n, modelling) in models() {
        let mut errors = Vec::new();
        for (axis, truth) in [Vector3::x(), Vector3::y(), Vector3::z()].iter().zip(&truth.sag) {
            let u = weight_response(robot, &modelling, B, &(G * axis))?;
            errors.extend(parted(&u, truth));
        }
        let worst = errors.iter().copied().worst();
        match n {
            None => modal_worst = larger(modal_worst, worst),
            Some(n) => lumped.push((n, errors.clone())),
        }
        table.rows.push(std::iter::once(word(name)).chain(errors.into_iter().map(error)).collect());
    }
    case.table(table);
    case.text(
        "Modal links have it exactly with any number of modes; without modes they are Guyan's condensation. Two parts carry the weight at two points and miss about a sixth, as a uniform bar does; with more parts the error falls at first with the square of their length, \
         then no longer, and along z it stays large. The cause is below.",
    );
    case.claim(
        format!("casting, own weight, {}", truth.name),
        "CalculiX and NGSolve",
        other_programs,
        Bound::AtMost(1e-7),
    );
    case.claim(
        "casting, own weight, modal link with any number of modes",
        "the mesh",
        modal_worst,
        Bound::AtMost(1e-7),
    );
    for (n, errors) in lumped.iter().filter(|(n, _)| [2, 8].contains(n)) {
        let (across, along) = if *n == 2 { (0.3, 0.6) } else { (0.02, 0.17) };
        case.claim(
            format!("casting, weight across (x, y), {n} parts, shift"),
            "the mesh",
            larger(errors[0], errors[2]),
            Bound::AtMost(across),
        );
        case.claim(format!("casting, weight along z, {n} parts, shift"), "the mesh", errors[4], Bound::AtMost(along));
    }
    Ok(())
}

/// A number of a caption, four digits.
fn plain(x: f64) -> String {
    digits(x, 4).print()
}

/// Motion of B of a chain under weight, in closed form: the weight of all parts beyond a joint yields it.
fn chain_under_weight(chain: &Chain, g: &Vector3<f64>, p_B: &Vector3<f64>) -> Vector6<f64> {
    chain.sag(p_B, g).unwrap_or_else(|| Vector6::repeat(f64::NAN))
}

/// Where the sag of chains ends as parts become short, and what it misses.
fn limit_of_parts(case: &mut Case, mesh: &Meshed, condensed: &Condensed<'_>, truth: &Truth) -> Result<(), Error> {
    case.heading("What parts cannot see");
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let (p_A, p_B) = condensed.points();
    let along = p_B - p_A;
    let mut table = Table::new(
        "Weight as above, shift of B: error of chains of any number of parts, made from the mesh here, in closed form (2 to 8 parts: the numbers of the table above). Then what the weight of the first part alone, from its end at A to the \
         first joint, moves B by in the mesh, over the shift by all of the weight; in a chain it is nothing, for that part is held. Frequencies, with A held, over those of the mesh, less one.",
        &[
            "parts",
            "mass of the first part [kg]",
            "x",
            "y",
            "z",
            "first part alone, x",
            "first part alone, y",
            "first part alone, z",
            "f_1",
            "f_2",
            "f_3",
        ],
    );
    let mut curves: Vec<PlotCurve> = ["weight along", "first part alone, along"]
        .iter()
        .flat_map(|what| AXES.map(|axis| format!("{what} {axis}")))
        .map(|name| PlotCurve { name, look: CurveLook::Marked, ..PlotCurve::default() })
        .collect();
    let mut at_the_end = f64::NAN;
    for n in [2_u8, 3, 4, 8, 16, 32, 64] {
        let chain = condensed.chain(mesh, n.into())?;
        let p_S = chain.joints[0].X_LS.translation.vector;
        let first_joint = (p_S - p_A).dot(&along) / along.norm_squared();
        let size =
            |u: &Vector6<f64>, axis: usize| u.fixed_rows::<3>(0).norm() / truth.sag[axis].fixed_rows::<3>(0).norm();
        let missed = [0, 1, 2].map(|k| truth.sag[k] - chain_under_weight(&chain, &(G * axes[k]), &p_B));
        let first = [0, 1, 2].map(|k| condensed.under_weight_between(&(G * axes[k]), f64::NEG_INFINITY, first_joint));
        let cells: Vec<f64> = [&missed, &first].iter().flat_map(|u| [0, 1, 2].map(|k| size(&u[k], k))).collect();
        for (curve, e) in curves.iter_mut().zip(&cells) {
            curve.x.push(f64::from(n));
            curve.y.push(*e);
        }
        at_the_end = cells[2];
        let mut row = vec![fixed(f64::from(n), 0), fixed(chain.parts[0].mass, 2)];
        row.extend(cells.iter().map(|e| error(*e)));
        row.extend(chain.held_frequencies_hz().iter().zip(&truth.hz).take(3).map(|(f, mesh)| signed(f / mesh - 1.0)));
        table.rows.push(row);
    }
    case.table(table);
    let chain = condensed.chain(mesh, 64)?;
    let fraction = |joint: &ElasticSplit| (joint.X_LS.translation.vector - p_A).dot(&along) / along.norm_squared();
    let joints: Vec<f64> = chain.joints.iter().map(fraction).collect();
    let mut bands = Table::new(
        "Where 64 parts miss it: difference of the shift by the weight of a stretch of the casting, chain against mesh, over the shift by all of the weight. From joint to joint, by the place of the part's first joint on the way from A to B.",
        &["stretch", "mass [kg]", "x", "y", "z"],
    );
    let stretches =
        [("first part", -1.0, 0.0), ("to 0.2", 0.0, 0.2), ("0.2 to 0.9", 0.2, 0.9), ("beyond 0.9", 0.9, 2.0)];
    let mut away_from_the_seat = 0.0;
    for (name, low, high) in stretches {
        // Part k lies between joint k - 1 and joint k.
        let start = |k: usize| if k == 0 { -1.0 } else { joints[k - 1] };
        let inside: Vec<usize> = (0..chain.parts.len()).filter(|k| (low..high).contains(&start(*k))).collect();
        let mut only = chain.clone();
        for (_, part) in only.parts.iter_mut().enumerate().filter(|(k, _)| !inside.contains(k)) {
            part.mass = 0.0;
        }
        let from = inside.first().map_or(0.0, |k| if *k == 0 { f64::NEG_INFINITY } else { start(*k) });
        let to = inside.last().and_then(|k| joints.get(*k)).copied().unwrap_or(f64::INFINITY);
        let missed = [0, 1, 2].map(|k| {
            let g = G * axes[k];
            let apart = condensed.under_weight_between(&g, from, to) - chain_under_weight(&only, &g, &p_B);
            apart.fixed_rows::<3>(0).norm() / truth.sag[k].fixed_rows::<3>(0).norm()
        });
        if low >= 0.2 {
            away_from_the_seat += missed[2];
        }
        let mut row = vec![word(name), fixed(only.parts.iter().map(|part| part.mass).sum(), 2)];
        row.extend(missed.map(error));
        bands.rows.push(row);
    }
    case.table(bands);
    case.text(
        "The seat A faces sideways (-y), so near it the casting is not a chain of slices from A to B: four kilograms lie behind the plane through A, and more beside the seat. All of it hangs on the wall of the seat and turns it, but a \
         chain hangs the first part on A itself, and what is beside the seat on a share of its wall, however short its parts. Along z this weight hardly bends the arm, so what it does to the seat is much of all there is. What is left across, 0.3 %, is spread over the hollow body: energy up to a section is the work of its \
         force on its mean motion only while sections move rigidly, and thin-walled ones do not. The frequencies end where the sag does. In a bar the error goes to zero.",
    );
    case.claim(
        "casting, weight along z, 64 parts: what parts in a row cannot see, an effect of the shape",
        "the mesh",
        at_the_end,
        Bound::AtLeast(0.03),
    );
    case.claim(
        "casting, weight along z, 64 parts: what they miss of all that lies beyond 0.2 of the way from A",
        "the mesh",
        away_from_the_seat,
        Bound::AtMost(8e-3),
    );
    case.figure(Figure {
        name: "lower-arm-weight".into(),
        caption: "Casting under its own weight: error of the shift of B over the number of parts, and what the weight of the first part has in it".into(),
        x_label: "parts".into(),
        logarithmic_x: true,
        panels: vec![Panel { label: "relative error".into(), logarithmic: true, legend: true, curves }],
    });
    Ok(())
}

/// Frequencies with A held.
fn frequencies(case: &mut Case, robot: &Robot, truth: &Truth, others: &[(&str, Truth)]) -> Result<(), Error> {
    case.heading("Frequencies");
    let hz: Vec<String> = truth.hz.iter().map(|f| format!("{f:.3}")).collect();
    let mut table = Table::new(
        format!(
            "A held, B free, casting alone, without weight; by {} {} Hz. Relative differences.",
            if truth.whole { truth.name } else { "NGSolve" },
            hz.join(", ")
        ),
        &["model", "elastic coordinates"],
    );
    table.columns.extend((1..=MODES).map(|k| format!("f_{k}")));
    let relative = |f: &[f64]| f.iter().zip(&truth.hz).map(|(f, truth)| f / truth - 1.0).collect::<Vec<f64>>();
    let worst = |errors: &[f64]| errors.iter().copied().worst();
    for ((name, other), bound) in others.iter().zip([5e-6, 1e-7]) {
        let errors = relative(&other.hz);
        if truth.whole {
            let text = format!("casting, six frequencies, {}", truth.name);
            case.claim(text, *name, worst(&errors), Bound::AtMost(bound));
        }
        let cells = [word(*name), word("")].into_iter();
        table.rows.push(cells.chain(errors.into_iter().map(signed)).collect());
    }
    let mut curves = Vec::new();
    for (name, _, modelling) in models() {
        let rig = Rig::new(&weightless(robot.clone()), &modelling, B)?;
        let errors = relative(&rig.arm.modes.frequencies_hz());
        let cells = [word(&name), fixed(rig.arm.model.n_elastic() as f64, 0)].into_iter();
        table.rows.push(cells.chain(errors.iter().map(|e| signed(*e))).collect());
        let (x, y) = (1..=errors.len()).map(|k| k as f64).zip(errors.iter().map(|e| e.abs())).unzip();
        curves.push(PlotCurve { name: name.clone(), look: CurveLook::Marked, x, y });
        let bounds = match name.as_str() {
            "2 parts" => Some((2, 0.07)),
            "8 parts" => Some((2, 3.5e-3)),
            "modal, 0 modes" => Some((2, 6.6e-3)),
            "modal, 10 modes" => Some((MODES, 0.01)),
            _ => None,
        };
        if let Some((count, bound)) = bounds {
            let what = if count == MODES { "six frequencies" } else { "first two frequencies" };
            case.claim(format!("casting, {what}, {name}"), "the mesh", worst(&errors[..count]), Bound::AtMost(bound));
        }
    }
    case.table(table);
    let element = robot.flexible[0].flexible.reduced.details.as_ref().and_then(|details| details.superelement.as_ref());
    let fixed_hz = element.map(|element| element.fixed_frequencies_hz()).unwrap_or_default();
    let (low, high) = (fixed_hz.first().copied().unwrap_or(f64::NAN), fixed_hz.last().copied().unwrap_or(f64::NAN));
    case.text(format!(
        "CalculiX integrates the mass of this element with four points, which is not exact; the difference grows with the frequency. In f_1 the casting bends across (B moves along y), in f_2 along x: two parts have them 3 % high, a bar 2 %; \
         more parts come to 0.1 %, which is their end (table above). f_4 twists, f_3, f_5 and f_6 bend once more, and parts are too few for these until there are eight. Modal links come from above: without modes f_3 and beyond are made of static shapes \
         alone; ten modes with both seats held ({low:.0} to {high:.0} Hz) bring all six within half a per cent, and more would be needed for the last digits, since shapes that hold the seats are slow to make one that lets B go."
    ));
    case.figure(Figure {
        name: "lower-arm-frequencies".into(),
        caption: "Casting with A held: error of each frequency, by model".into(),
        x_label: "frequency number".into(),
        logarithmic_x: false,
        panels: vec![Panel { label: "relative error".into(), logarithmic: true, legend: true, curves }],
    });
    Ok(())
}

/// Rigid ties against distributing ones.
fn ties(
    case: &mut Case,
    mesh: &Meshed,
    [p_A, p_B]: [Vector3<f64>; 2],
    truth: &Truth,
    stored: [&Stored; 2],
) -> Result<(), Error> {
    case.heading("Rigid or distributing ties");
    let mut table = Table::new(
        "The same mesh, seats tied rigidly (RBE2) or by the mean of their nodes (RBE3, equal weights): compliance along each load and frequencies, over those of rigid ties, less one.",
        &["A", "B"],
    );
    table.columns.extend(LOADS.iter().map(|load| (*load).to_owned()));
    table.columns.extend((1..=3).map(|k| format!("f_{k}")));
    let mut softest = f64::INFINITY;
    for ties in [[Tie::Distributing, Tie::Rigid], [Tie::Rigid, Tie::Distributing], [Tie::Distributing; 2]] {
        let condensed = mesh.condensed(ties, p_A, p_B)?;
        let (C, hz) = (condensed.compliance()?, condensed.held_hz(3)?);
        let diagonal: Vec<f64> = (0..6).map(|j| C[(j, j)] / truth.C[(j, j)] - 1.0).collect();
        let mut row = vec![word(ties[0].name()), word(ties[1].name())];
        row.extend(diagonal.iter().map(|e| signed(*e)));
        row.extend(hz.iter().zip(&truth.hz).map(|(f, truth)| signed(f / truth - 1.0)));
        table.rows.push(row);
        if ties == [Tie::Distributing; 2] {
            softest = diagonal.iter().copied().fold(softest, f64::min);
            for (name, stored) in ["CalculiX", "NGSolve"].iter().zip(stored) {
                let other = compliance_error(&stored.matrix6("C_BB_distributing")?, &C);
                case.claim(
                    "casting, distributing ties, loads at the flange, the mesh",
                    *name,
                    other,
                    Bound::AtMost(1e-7),
                );
            }
        }
    }
    case.table(table);
    case.text(
        "Nothing else here matters as much. A rigid tie makes the seat as stiff as a plate that never gives; a distributing one lets its ring and the wall behind it go out of shape, as if the neighbour were soft. The seat A, wide and on a wall of 26 mm, decides \
         about forces across and the frequencies, B about what turns it. A finer mesh (484 instead of 41 thousand degrees of freedom) changes the diagonal by 0.2 to 3.0 % (README of the robot), the other programs agree to nine digits, and the parts and modes of a \
         link are exact under end loads. What is bolted to the seat lies between the two ties, and no program knows it.",
    );
    case.claim(
        "casting, what distributing ties add to every entry of the compliance's diagonal: an effect of the tie",
        "rigid ties",
        softest,
        Bound::AtLeast(0.06),
    );
    Ok(())
}
