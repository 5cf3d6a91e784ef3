//! The report of a run: its numbers, its plots and the plan of the path.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flexarm_log::{ElasticSample, Trace, TraceRow};
use flexarm_run::internals::{short, thinned};
use flexarm_run::{PathFigures, ReportRun, Summary, html};
use nalgebra::Vector3;
use proptest::prelude::*;
use serde_json::Value;

/// Magnitude below which numbers of the page are zero.
const SMALLEST: f64 = 1e-300;

/// Truth: the value of the digits, and both forms as written by the standard library.
#[test]
fn a_number_is_written_in_the_shorter_of_both_forms() {
    let check = |x: f64, digits: usize| {
        let x = if x.abs() < SMALLEST { 0.0 } else { x };
        let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap();
        let rounded = if rounded == 0.0 { 0.0 } else { rounded };
        let (plain, scientific) = (format!("{rounded}"), format!("{rounded:e}"));
        let truth = if scientific.len() < plain.len() { scientific } else { plain };
        assert_eq!(short(x, digits), truth, "{x:?} with {digits} digits");
    };
    let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
    let mut random = || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed
    };
    for _ in 0..50_000 {
        let (mantissa, power) = (random() as i64 as f64 / i64::MAX as f64, (random() % 30) as i32 - 15);
        [1, 3, 5, 7].into_iter().for_each(|digits| check(mantissa * 10f64.powi(power), digits));
        let any = f64::from_bits(random());
        check(if any.is_finite() { any } else { 0.5 }, 5);
        check((random() % 3000) as f64 * 10f64.powi(power / 3), 5);
    }
    for x in [0.0, -0.0, 1.0, -1.0, 10.0, 99999.6, 1e15, 1.1e-300, 1.5e300, -120.0, 0.001, 0.01, 1000.0] {
        check(x, 5);
    }
    // Midpoints between two numbers and their neighbours, powers of ten and their neighbours.
    for k in 0..20_000_i32 {
        let middle = (f64::from(10_000 + 4 * k) + 0.5) * 10f64.powi(k % 25 - 12);
        let ten = 10f64.powi(k % 600 - 300);
        for x in [middle, ten, 9.99995 * ten, 9.9999949 * ten] {
            for x in [x.next_down(), x, -x, x.next_up()] {
                [1, 5, 6, 9].into_iter().for_each(|digits| check(x, digits));
            }
        }
    }
    assert_eq!([f64::NAN, f64::INFINITY, 1e-310].map(|x| short(x, 5)), ["null", "null", "0"]);
}

/// Truth: a circle in the plane x, y with a constant sag and an error of 1 mm outwards.
#[test]
fn a_sag_is_no_error_of_the_shape_and_errors_are_enlarged_by_a_round_number() {
    let point = |k: u32| {
        let a = f64::from(k) * std::f64::consts::TAU / 100.0;
        let e = Vector3::new(a.cos(), a.sin(), 0.0) * 1e-3 - Vector3::z() * 4e-3;
        [0.3 * a.cos(), 0.3 * a.sin(), 1.0, e.x, e.y, e.z]
    };
    let figures =
        PathFigures { points: (0..=100).map(point).collect(), offset_m: [0.0, 0.0, -4e-3], ..PathFigures::default() };
    let page = |path| {
        let summary = Summary { path: Some(path), ..Summary::default() };
        html(&[ReportRun { label: "run", summary: &summary, trace: &Trace::default() }])
    };
    let drawn = page(figures);
    // 0.06 of 300 mm is 18 mm.
    assert!(drawn.contains("the tool with its error enlarged 10 times, less"), "{drawn}");
    let (_, picture) = drawn.split_once("src=\"data:image/svg+xml;base64,").unwrap();
    let picture = STANDARD.decode(picture.split_once('"').unwrap().0).unwrap();
    let svg = String::from_utf8(picture).unwrap();
    for word in ["x (mm)", "y (mm)", "error x 10,"] {
        assert!(svg.contains(word), "{word}");
    }
    let none = page(PathFigures::default());
    assert!(none.contains("Across the path of the tool") && !none.contains("its error enlarged"));
}

proptest! {
    /// Truth: the extremes of the curves themselves.
    #[test]
    fn thinning_keeps_the_ends_and_the_extremes_of_every_curve(
        (length, most) in (1_usize..20_000, 50_usize..3000),
        spikes in prop::collection::vec((0.0..1.0, -50.0..50.0), 1..6),
    ) {
        let wave = |c: usize, k: usize| (0.01 * k as f64 + c as f64).sin();
        let mut curves: Vec<Vec<f64>> =
            (0..spikes.len()).map(|c| (0..length).map(|k| wave(c, k)).collect()).collect();
        for (curve, (place, height)) in curves.iter_mut().zip(&spikes) {
            curve[(place * length as f64) as usize] = *height;
        }
        let slices: Vec<&[f64]> = curves.iter().map(Vec::as_slice).collect();
        let keep = thinned(&slices, length, most);
        prop_assert!(keep.windows(2).all(|pair| pair[0] < pair[1]), "ascending");
        prop_assert_eq!((keep[0], keep[keep.len() - 1]), (0, length - 1));
        prop_assert!(keep.len() <= most + 2, "{} of at most {}", keep.len(), most);
        for curve in &slices {
            let extremes = |values: &mut dyn Iterator<Item = f64>| {
                values.fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)))
            };
            let all = extremes(&mut curve.iter().copied());
            prop_assert_eq!(extremes(&mut keep.iter().map(|k| curve[*k])), all);
        }
    }
}

#[test]
fn springs_that_only_turn_have_no_plots_of_forces() {
    let mut trace = Trace::default();
    trace.header.elements = vec!["spring".into()];
    let mut element = ElasticSample::default();
    (element.load[5], element.deflection[5]) = (3.0, 1e-3);
    for time_s in [0.0, 0.1] {
        trace.rows.push(TraceRow { time_s, elastic: vec![element], ..TraceRow::default() });
    }
    let page = html(&[ReportRun { label: "run", summary: &Summary::default(), trace: &trace }]);
    let (_, data) = page.split_once("<script type=\"application/json\" id=\"data\">").unwrap();
    let data: Value = serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap();
    let ids = data["runs"][0]["plots"].as_array().unwrap().iter().map(|plot| plot["id"].as_str().unwrap());
    let ids: Vec<&str> = ids.filter(|id| id.starts_with("element_")).collect();
    assert_eq!(ids, ["element_moment", "element_turn"]);
}

#[test]
fn numbers_that_are_none_do_not_hide_the_others() {
    let mut curve = vec![0.0; 1000];
    (curve[10], curve[500], curve[700]) = (f64::NAN, 3.0, f64::INFINITY);
    assert!(thinned(&[&curve], 1000, 100).contains(&500));
    assert_eq!(thinned(&[], 3, 100), [0, 1, 2]);
}
