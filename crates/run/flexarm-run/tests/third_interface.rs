//! Links with load on a third interface: springs between rigid parts support only two, so such a
//! link is modal or refused.

use std::path::PathBuf;

use flexarm_fem::{BeamLink, BeamTheory, LinkDetails, Material, ModalInterface, ReducedLink, Section, write_flex};
use flexarm_kinematics::Pose;
use flexarm_run::{LinkModel, LoadOptions, Modelling, Robot, check};
use nalgebra::Matrix6xX;

const L: f64 = 0.9;
const TUBE: Section = Section::Tube { outer_diameter: 0.06, wall: 0.003 };

/// A tube along x, clamped at its origin, with a third interface at the fraction `at`, by its exact
/// static shapes.
fn branched(at: f64) -> ReducedLink {
    let mut straight = BeamLink::new("boom", TUBE, Material::STEEL, L);
    straight.theory = BeamTheory::EulerBernoulli;
    let mut modal = straight.modal(0).unwrap();
    let (x, x2, x3) = (at, at * at, at * at * at);
    // Hermite cubics of a displacement and of a rotation at the far end, and their slopes.
    let (v, vs) = (3.0 * x2 - 2.0 * x3, (6.0 * x - 6.0 * x2) / L);
    let (r, rs) = (L * (x3 - x2), 3.0 * x2 - 2.0 * x);
    let mut Phi = Matrix6xX::zeros(6);
    let bending = [(1, 1, v), (5, 1, vs), (1, 5, r), (5, 5, rs), (2, 2, v), (4, 2, -vs), (2, 4, -r), (4, 4, rs)];
    for (row, column, value) in [(0, 0, x), (3, 3, x)].into_iter().chain(bending) {
        Phi[(row, column)] = value;
    }
    modal.interfaces.push(ModalInterface { name: "bracket".into(), X_LI: Pose::translation(at * L, 0.0, 0.0), Phi });
    let mut reduced = straight.reduce().unwrap();
    reduced.details = Some(Box::new(LinkDetails { modal: Some(modal), ..LinkDetails::default() }));
    reduced
}

/// A folder with the tube on a joint, a camera of some mass (kg) on the bracket and a tool at the
/// far end.
struct Place(PathBuf);

impl Place {
    fn new(name: &str, link: &ReducedLink) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-third-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("boom.flex"), write_flex(link)).unwrap();
        Self(folder)
    }

    fn robot(&self, at: f64, camera: f64, keys: &str) -> Result<Robot, flexarm_run::Error> {
        let body = |name: &str, mass: f64| {
            format!(
                "<link name=\"{name}\"><inertial><mass value=\"{mass}\"/>\
                 <inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
            )
        };
        let fixed = |joint: &str, child: &str, x: f64| {
            format!(
                "<joint name=\"{joint}\" type=\"fixed\"><parent link=\"boom\"/><child link=\"{child}\"/><origin xyz=\"{x} 0 0\"/></joint>"
            )
        };
        let text = format!(
            "<robot name=\"arm\"><link name=\"base\"/>{}{}{}<joint name=\"swing\" type=\"revolute\"><parent link=\"base\"/>\
             <child link=\"boom\"/><axis xyz=\"0 0 1\"/><limit lower=\"-3\" upper=\"3\" effort=\"1e6\" velocity=\"3\"/></joint>{}{}</robot>",
            body("boom", 4.0),
            body("camera", camera),
            body("tool", 0.5),
            fixed("bolts", "camera", at * L),
            fixed("flange", "tool", L)
        );
        std::fs::write(self.0.join("arm.urdf"), text).unwrap();
        let file = format!(
            "format = 1\nurdf = \"arm.urdf\"\ngravity = [0.0, 0.0, -9.81]\ntcp = {{ link = \"tool\" }}\n\n[[flexible_link]]\nlink = \"boom\"\n\
             distal = \"flange\"\nreduced = \"boom.flex\"\n{keys}"
        );
        std::fs::write(self.0.join("robot.toml"), file).unwrap();
        Robot::load(self.0.join("robot.toml"))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

/// Truth: closed form. A camera of weight F at the distance a lowers the end by
/// `F a² (3 l - a)/(6 EI)`; measured within 3e-7, and previously 1.9 times that, with the camera
/// attached to one of two rigid parts.
#[test]
fn a_camera_on_a_third_interface_bends_the_link_as_in_closed_form_whatever_model_is_asked_for() {
    let EI = Material::STEEL.E * TUBE.properties(Material::STEEL.nu).unwrap().I_z;
    for at in [0.4, 0.7] {
        let place = Place::new(&format!("sag{at}"), &branched(at));
        let overrides = [LinkModel::AsFiled, LinkModel::Lumped, LinkModel::Modal];
        for (keys, links) in ["", "model = \"lumped\"\n", "model = \"modal\"\n"].into_iter().zip(overrides) {
            let modelling = Modelling { links, ..Modelling::default() };
            let sag = |camera: f64| {
                let robot = place.robot(at, camera, keys).unwrap();
                robot.model(&modelling).unwrap().statics(None, [0.0; 6]).unwrap().sag_m[2]
            };
            // Small, so that the sine equals the slope; the tube's own weight is in both.
            let (more, a) = (0.2, at * L);
            let lowered = sag(1.0 + more) - sag(1.0);
            let truth = -9.81 * more * a * a * (3.0 * L - a) / (6.0 * EI);
            eprintln!("at {at}, {keys:?}: {:.1e}", lowered / truth - 1.0);
            assert!((lowered / truth - 1.0).abs() < 1e-5, "{lowered:e} {truth:e}");
        }
        let robot = place.robot(at, 1.0, "").unwrap();
        let told = robot.model(&Modelling::default()).unwrap().statics(None, [0.0; 6]).unwrap().warnings.join("\n");
        for word in ["\"boom\"", "is modal", "\"bolts\"", "\"bracket\""] {
            assert!(told.contains(word), "{word}: {told}");
        }
        let findings = check(&place.0.join("robot.toml"), None, &LoadOptions::default());
        assert!(findings.iter().any(|finding| finding.code == "third-interface"), "{findings:?}");
    }
}

#[test]
fn a_joint_a_little_off_the_third_interface_hangs_on_it_all_the_same() {
    let place = Place::new("off", &branched(0.7));
    let sag = |at: f64| {
        let robot = place.robot(at, 3.0, "").unwrap();
        assert!(robot.model(&Modelling::default()).unwrap().links_model() == "modal");
        robot.model(&Modelling::default()).unwrap().statics(None, [0.0; 6]).unwrap().sag_m[2]
    };
    let (there, beside) = (sag(0.7), sag(0.702));
    assert!((beside / there - 1.0).abs() < 0.01, "{there:e} {beside:e}"); // measured 3e-3, the longer lever
}

/// If only a wrong answer were possible, masses are requested, with the names of joint and
/// interface.
#[test]
fn without_masses_for_modes_a_third_interface_is_refused() {
    let place = Place::new("refused", &branched(0.7));
    // More modes than available: the modal link cannot be built, and the lumped one is no
    // alternative.
    let error = place.robot(0.7, 3.0, "modes = 5\n").unwrap_err().to_string();
    for word in ["\"boom\"", "\"bolts\"", "\"bracket\"", "two interfaces"] {
        assert!(error.contains(word), "{word}: {error}");
    }
}
