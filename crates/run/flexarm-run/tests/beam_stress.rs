//! Stress of a link that is a beam over a run and at a pose, against statics and the drive torque.

use std::path::{Path, PathBuf};

use flexarm_run::{LinkModel, Modelling, Motion, Robot, Run, RunOptions, Scenario};

/// The shipped beam with stress and a pair of gauges on both sides of its root, in a folder of its
/// own.
struct Beam {
    folder: PathBuf,
}

impl Drop for Beam {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

const GAUGES: &str =
    "\n[[strain_gauge]]\nname = \"left\"\nlink = \"beam_1\"\nat = [0.0, 0.01, 0.0]\ndirection = [1.0, 0.0, 0.0]\n
[[strain_gauge]]\nname = \"right\"\nlink = \"beam_1\"\nat = [0.0, -0.01, 0.0]\ndirection = [1.0, 0.0, 0.0]\n";

impl Beam {
    fn new(name: &str, change: impl Fn(&str) -> String) -> Self {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().join("robots/test/one_beam");
        let folder = std::env::temp_dir().join(format!("flexarm beam {name} {}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::copy(shipped.join("one_beam.urdf"), folder.join("one_beam.urdf")).unwrap();
        let text = std::fs::read_to_string(shipped.join("robot.toml")).unwrap();
        let text = text.lines().filter(|line| !line.starts_with("default_trajectory"));
        let text = text.map(|line| format!("{line}\n")).collect::<String>();
        std::fs::write(folder.join("robot.toml"), change(&text.replace("model = \"lumped\"", "stress = true")))
            .unwrap();
        Self { folder }
    }

    fn robot(&self) -> Robot {
        Robot::load(&self.folder).unwrap()
    }

    /// Swings by 0.6 rad in 0.4 s.
    fn swing(&self, modelling: Modelling) -> Run {
        let robot = self.robot();
        let times: Vec<f64> = (0..=600).map(|k| 1e-3 * f64::from(k)).collect();
        let s = |t: f64| (t / 0.4).min(1.0);
        let angles: Vec<f64> =
            times.iter().map(|t| 0.6 * s(*t).powi(3) * (10.0 - s(*t) * (15.0 - 6.0 * s(*t)))).collect();
        let motion = Motion::from_samples(&times, &angles, &robot).unwrap();
        robot.model(&modelling).unwrap().simulate(Scenario::new(motion), &RunOptions::default()).unwrap()
    }
}

fn parts(segments: usize) -> Modelling {
    Modelling { links: LinkModel::Lumped, segments: Some(segments), ..Modelling::default() }
}

/// Truth: (m_tip l + m l/2) g c / I, at the top and bottom of the root.
#[test]
fn a_held_beam_bears_the_bending_stress_of_its_weight_and_load_at_its_root() {
    let beam = Beam::new("statics", str::to_owned);
    for segments in [2, 8] {
        let held = beam.robot().model(&parts(segments)).unwrap().statics(Some(&[0.3]), [0.0; 6]).unwrap();
        let link = &held.stress[0];
        let truth = 9.81 * (0.5 * 0.8 + 1.728 * 0.4) * 0.02 / (0.02 * 0.04_f64.powi(3) / 12.0);
        let off = link.peak_pa / truth - 1.0;
        eprintln!("{segments} parts: {:.3} MPa, {off:.1e}", 1e-6 * link.peak_pa);
        // The beam hangs by a milliradian, which shortens the lever.
        assert!(off.abs() < 2e-5, "{off:e}");
        assert_eq!((link.left_out, link.worst[0].position_m[0]), (0, 0.0));
        assert_eq!(link.worst[0].material.as_deref(), Some("EN AW-6082 T6"));
    }
}

/// Truth: the torque of the drive, which the root of the beam transmits. Half the difference of both
/// gauges is bending, M c/(E I).
#[test]
fn gauges_at_the_root_of_a_swinging_beam_read_the_torque_of_its_drive() {
    // The torque of dampers is not in the stress.
    let beam = Beam::new("swing", |text| text.replace("modal = 0.03", "modal = 0.0") + GAUGES);
    // Two parts: the deflection turns the levers (1.2e-4). Four: loads between the springs (7.6e-3).
    for (segments, bound) in [(2, 5e-4), (4, 2e-2)] {
        let run = beam.swing(parts(segments));
        let column = |name: &str| run.columns.column(name).unwrap().values.clone();
        let (gauges, torque) = (column("gauge"), column("effort"));
        let by_torque = 0.01 / (70e9 * 0.04 * 0.02_f64.powi(3) / 12.0);
        let largest = torque.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let off = gauges
            .as_chunks::<2>()
            .0
            .iter()
            .zip(torque.iter())
            .map(|([left, right], torque)| (0.5 * (left - right) / by_torque - torque).abs() / largest);
        let off = off.fold(0.0, f64::max);
        eprintln!("{segments} parts: {off:.1e} of {largest:.1} N m");
        assert!(off < bound, "{segments}: {off:e}");
        assert_eq!(run.columns.gauges, ["left_strain", "right_strain"]);
        assert!(run.summary.stress[0].damage.is_some());
    }
}

#[test]
fn stress_of_a_beam_is_computed_only_if_it_is_asked_for_and_there_is_an_outline() {
    let silent = Beam::new("silent", |text| text.replace("stress = true", ""));
    assert!(silent.robot().model(&Modelling::default()).unwrap().statics(None, [0.0; 6]).unwrap().stress.is_empty());
    let refused = |name: &str, change: &dyn Fn(&str) -> String, said: &str| {
        let beam = Beam::new(name, change);
        let error = Robot::load(&beam.folder).unwrap_err().to_string();
        assert!(error.contains(said) && error.contains("robot.toml"), "{error}");
    };
    refused("unasked", &|text| text.replace("stress = true", "") + GAUGES, "set stress = true");
    let bar = "section = \"given\", EA = 1e7, EI_y = 1e3, EI_z = 1e3, GJ = 1e3, mass_per_length = 2.0, rotary_y = 1e-4, rotary_z = 1e-4";
    let shape = "section = \"rectangle\", width = 0.02, height = 0.04, material = \"aluminium\"";
    refused("given", &|text| text.replace(shape, bar), "give the shape of the section");

    let rigid = Modelling { links: LinkModel::Rigid, ..Modelling::default() };
    let stiff = Beam::new("rigid", str::to_owned);
    assert!(stiff.robot().model(&rigid).unwrap().statics(None, [0.0; 6]).unwrap().stress.is_empty());
    let modal = Modelling { links: LinkModel::Modal, ..Modelling::default() };
    let run = Beam::new("modal", str::to_owned).swing(modal);
    let caveat = run.summary.caveats.iter().find(|caveat| caveat.code == "no-stress").unwrap();
    assert!(run.summary.stress.is_empty() && caveat.message.contains("beam with modes"), "{caveat:?}");
}

/// Truth: the weight beyond each plane, m_tip + m (1 - x/l), and its moment; a horizontal beam has no
/// tension and no torsion.
#[test]
fn the_section_forces_of_a_held_beam_are_shear_and_moment_of_the_weight_beyond_each_plane() {
    let beam = Beam::new("section forces", str::to_owned);
    let (g, m, tip, l) = (9.81, 1.728, 0.5, 0.8);
    for segments in [2, 8] {
        let held = beam.robot().model(&parts(segments)).unwrap().statics(Some(&[0.3]), [0.0; 6]).unwrap();
        let planes = &held.stress[0].section_forces;
        assert_eq!((planes.len(), planes[20].at_m), (21, l));
        let mut off = [0.0_f64; 2];
        for plane in planes {
            assert_eq!(plane.lowest, plane.highest);
            let [n, v_y, v_z, t, m_y, m_z] = plane.highest;
            let x = plane.at_m;
            let shear = g * (tip + m * (1.0 - x / l));
            let moment = g * (tip * (l - x) + m * (l - x).powi(2) / (2.0 * l));
            off[0] = off[0].max((v_y.hypot(v_z) / shear - 1.0).abs());
            off[1] = off[1].max((m_y.hypot(m_z) - moment).abs() / (g * (tip + 0.5 * m) * l));
            assert!(n.abs() < 3e-3 * shear && t.abs() < 1e-6, "{n} {t}");
        }
        eprintln!("{segments} parts: shear off by {:.1e}, moment by {:.1e}", off[0], off[1]);
        assert!(off[0] < 2e-5 && off[1] < 2e-5, "{off:?}"); // measured
    }
}

/// Truth: the damage at stress points on all places of the surface. Tension and compression sides have
/// the same largest stress, but not the same damage.
#[test]
fn the_most_damaged_place_is_that_of_the_largest_damage_among_all_places_of_the_surface() {
    let places = (0..=20).flat_map(|plane| {
        let sides = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)];
        sides.map(|(y, z)| [0.04 * f64::from(plane), 0.01 * f64::from(y), 0.02 * f64::from(z)])
    });
    let points = places.enumerate().map(|(k, [x, y, z])| {
        format!("\n[[stress_point]]\nname = \"p{k}\"\nlink = \"beam_1\"\nat = [{x}, {y}, {z}]\n")
    });
    let points: String = points.collect();
    let beam = Beam::new("fatigue", |text| text.to_owned() + &points);
    let link = beam.swing(parts(4)).summary.stress.remove(0);
    assert_eq!((link.points.len(), link.nodes), (168, 168));
    let of_point = |k: usize| link.points[k].place.damage.unwrap();
    let truth = (0..168).max_by(|a, b| of_point(*a).total_cmp(&of_point(*b))).unwrap();
    let found = link.most_damaged.unwrap();
    eprintln!("most damaged {:?}, worst {:?}", found, link.worst[0]);
    assert_eq!(found, link.points[truth].place);
    assert_eq!(link.damage, found.damage);
    assert!(found.damage > link.points[0].place.damage);
}
