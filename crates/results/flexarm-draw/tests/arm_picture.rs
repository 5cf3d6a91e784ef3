//! Pictures of an arm.

use flexarm_draw::internals::{ARROW, ELLIPSOID, Ellipsoid, Stage, arrow, on_scale};
use flexarm_draw::mesh_picture::{Image, View, color};
use flexarm_draw::palette::Rgb;
use flexarm_draw::{ArmPictureError, ArmSide, arm_pictures, arm_png};
use flexarm_sample::{LinkInfo, RunHeader, Sample, TwinSample};
use flexarm_spatial::Pose;
use nalgebra::{Matrix2x3, Matrix3, Rotation3, Translation3, Vector3};

/// An arm without surfaces: base, upright link, and a link along x, rotated so that the TCP
/// sags by 2 mm.
fn arm() -> (RunHeader, Sample) {
    let link = |name: &str, parent| LinkInfo { name: name.into(), parent, fixed: false };
    let header = RunHeader {
        links: vec![link("base", None), link("arm", Some(0)), link("tool", Some(1))],
        tcp: "tool".into(),
        has_rigid: true,
        magnification: 100.0,
        color_scale_m: 2e-3,
        ..RunHeader::default()
    };
    let places = |sag: f64| -> Vec<Pose> {
        let turned = Rotation3::from_axis_angle(&Vector3::y_axis(), sag / 1.2);
        let places =
            [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.2, 0.0, 1.0 - sag]].map(|p| Translation3::from(Vector3::from(p)));
        let turns = [Rotation3::identity(), turned, turned];
        places.into_iter().zip(turns).map(|(place, turn)| Pose::from_parts(place, turn)).collect()
    };
    let twin = |sag: f64| TwinSample { X_WL: places(sag), X_WT: places(sag)[2], ..TwinSample::default() };
    let sample = Sample { flexible: twin(2e-3), rigid: twin(0.0), ..Sample::default() };
    (header, sample)
}

fn decoded(png: &[u8]) -> Vec<Rgb> {
    rgba(png).into_iter().map(|p| [p[0], p[1], p[2]]).collect()
}

fn rgba(png: &[u8]) -> Vec<[u8; 4]> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect()
}

#[test]
fn an_arm_without_surfaces_is_drawn_as_rods_with_the_way_of_its_tool() {
    let (header, sample) = arm();
    let size = [450, 350];
    for side in [ArmSide::Side, ArmSide::Oblique] {
        let png = arm_png(&header, &sample, side, size).unwrap();
        assert_eq!(png, arm_png(&header, &sample, side, size).unwrap(), "the same bytes");
        // Without the text at the bottom.
        let mut pixels = decoded(&png);
        pixels.truncate(size[0] * (size[1] - 50));
        let count = |near: Rgb, within: i32| {
            let close = |p: &&Rgb| (0..3).all(|k| (i32::from(p[k]) - i32::from(near[k])).abs() <= within);
            pixels.iter().filter(close).count()
        };
        assert!(count(ARROW, 12) > 8, "{side:?}: {} pixels of the arrow", count(ARROW, 12));
        // The base does not move, so it has the first colour of the scale; the rigid arm is
        // light grey.
        assert!(count(color::magnitude(on_scale(0.0)), 40) > 200, "{side:?}");
        let grey = |p: &&Rgb| p.iter().all(|c| (150..240).contains(c)) && p[0].abs_diff(p[2]) < 24;
        let ghost = pixels.iter().filter(grey).count();
        assert!(ghost > 400, "{side:?}: {ghost} pixels of the ghost");
    }
}

/// Truth: the picture on paper, drawn without transparency.
#[test]
fn a_picture_without_ground_is_the_same_on_white_and_shows_dark_paper_where_there_is_no_arm() {
    let (header, sample) = arm();
    let size = [450, 350];
    let picture = arm_pictures(&header, &sample, &[ArmSide::Oblique], size).unwrap().remove(0);
    let pixels = rgba(&picture.png);
    assert!(pixels.iter().filter(|p| p[3] == 0).count() > pixels.len() / 2, "most of it is ground");
    assert!(pixels.iter().filter(|p| p[3] == 255).count() > 1000, "the arm covers");
    assert!(pixels.iter().filter(|p| (100..220).contains(&p[3])).count() > 400, "the ghost is seen through");
    let stage = Stage::new(&header, &sample).unwrap();
    let view = stage.view(ArmSide::Oblique, size, [13.0, 13.0], None);
    for ground in [[255; 3], [27, 31, 38]] {
        let mut truth = Image::new(size[0], size[1], ground);
        stage.draw(&view, &mut truth);
        arrow(&mut truth, &view, 0.5, &stage.tool, &stage.moved);
        let worst = pixels.iter().zip(truth.rgba.chunks_exact(4)).flat_map(|(p, truth)| {
            let laid = |c: usize| {
                let a = f64::from(p[3]) / 255.0;
                (a * f64::from(p[c]) + (1.0 - a) * f64::from(ground[c]) - f64::from(truth[c])).abs()
            };
            [laid(0), laid(1), laid(2)]
        });
        let worst = worst.fold(0.0, f64::max);
        assert!(worst < 5.0, "{worst} of 255 on {ground:?}"); // rounding of opacity, of colours and of means
    }
    // z is drawn upwards from every side.
    let [right, up] = picture.axes[2];
    assert!(right.abs() < 1e-9 && up > 0.5, "{:?}", picture.axes);
}

#[test]
fn what_cannot_be_drawn_is_an_error() {
    let size = [90, 70];
    let draw = |header: &RunHeader, sample: &Sample| arm_png(header, sample, ArmSide::Side, size).unwrap_err();
    let (header, sample) = arm();
    assert_eq!(draw(&RunHeader { has_rigid: false, ..header.clone() }, &sample), ArmPictureError::NoTwin);
    assert_eq!(draw(&header, &Sample::default()), ArmPictureError::Links { found: 0, expected: 3 });
    let mut diverged = sample.clone();
    diverged.flexible.X_WL[2] = Pose::from(Translation3::new(f64::NAN, 0.0, 0.0));
    assert_eq!(draw(&header, &diverged), ArmPictureError::NotFinite);
    let mut point = sample;
    for twin in [&mut point.flexible, &mut point.rigid] {
        twin.X_WL.fill(Pose::identity());
        twin.X_WT = Pose::identity();
    }
    assert_eq!(draw(&header, &point), ArmPictureError::Nothing);
}

/// Truth: the points `C f` of the ellipsoid for unit forces; none is outside its outline, and
/// some touch it.
#[test]
fn the_outline_of_the_compliance_holds_what_every_force_does() {
    let C = Matrix3::new(3.0, 0.4, -0.2, 0.4, 1.0, 0.3, -0.2, 0.3, 2.0) * 1e-6;
    let ellipsoid = Ellipsoid::new(&C, 2.0).unwrap();
    let (toward, right) = (Vector3::new(0.5, 0.6, 0.4), Vector3::new(0.6, -0.5, 0.0));
    let view = View::fit(toward, right, ellipsoid.corners(&Vector3::zeros()).into_iter(), [0.0, 0.0, 100.0, 100.0]);
    let P = Matrix2x3::from_rows(&[view.right.transpose(), view.up.transpose()]);
    let A = P * ellipsoid.map;
    let inverse = (A * A.transpose()).try_inverse().unwrap();
    let mut largest = 0.0_f64;
    for i in 0..60 {
        for j in 0..60 {
            let (theta, phi) = (0.0523 * f64::from(i), 0.1047 * f64::from(j));
            let force = Vector3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let moved = P * (ellipsoid.map * force);
            largest = largest.max((moved.transpose() * inverse * moved)[0]);
        }
    }
    assert!((0.995..1.0 + 1e-12).contains(&largest), "{largest}"); // measured 0.9995
    let longest = ellipsoid.axes.iter().map(|(axis, _)| axis.norm()).fold(0.0, f64::max);
    assert!((longest - ELLIPSOID * 2.0).abs() < 1e-12);
    assert!(Ellipsoid::new(&Matrix3::zeros(), 2.0).is_none());
}
