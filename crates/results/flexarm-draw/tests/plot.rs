//! Curves as pictures.

use flexarm_draw::internals::{PLAN, equally_long, plain, three_digits};
use flexarm_draw::palette::{self, Ground};
use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve, paper_plot, plan_plot};

fn curve(name: &str, y: &[f64]) -> PlotCurve {
    PlotCurve { name: name.into(), x: (1..=y.len()).map(|k| k as f64).collect(), y: y.to_vec(), ..PlotCurve::default() }
}

#[test]
fn curves_and_their_names_are_in_the_picture() {
    let panel =
        |label: &str, logarithmic, curves| Panel { label: label.into(), logarithmic, legend: logarithmic, curves };
    let panels = [
        panel("size", true, vec![curve("a < b", &[1.0, 1e-3, f64::NAN, 0.0])]),
        panel("angle", false, vec![curve("flat", &[2.0, 2.0])]),
    ];
    let marks = [(1.5, "f1".to_owned()), (1.501, "f2".to_owned()), (99.0, "f3".to_owned())];
    let notes = ["at rest".to_owned()];
    let (title, x_label) = ("all of it", "time");
    let plot = LinePlot { title, notes: &notes, x_label, logarithmic_x: true, marks: &marks, panels: &panels };
    let text = plot.svg().unwrap();
    assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
    for word in ["all of it", "at rest", "time", "size", "angle", "a &lt; b", "f1"] {
        assert!(text.contains(word), "{word}");
    }
    // The second name would overlap the first, the third is beyond the axis.
    assert!(!text.contains("f2") && !text.contains("f3"));
    assert!(text.matches("<polyline").count() >= 2);
    assert_eq!(text, plot.svg().unwrap());
}

#[test]
fn a_unit_is_as_long_on_both_axes_of_a_plan() {
    let (x, y) = equally_long((0.0..2.0, 5.0..6.0), &PLAN);
    // The panel of a plan without its margins and the areas of its labels.
    let (wide, high) = (f64::from(1920 - 72 - 168), f64::from(1300 - 48 - 88));
    assert!(((x.end - x.start) / wide - (y.end - y.start) / high).abs() < 1e-15);
    assert!(x.start < 0.0 && x.end > 2.0 && y.start < 5.0 && y.end > 6.0);
    let curves = vec![PlotCurve { x: vec![0.0, 1.0, 0.0], y: vec![0.0, 1.0, 2.0], ..curve("path", &[]) }];
    let panel = Panel { label: "y (mm)".into(), logarithmic: false, legend: true, curves };
    assert!(plan_plot("x (mm)", &panel).unwrap().contains("y (mm)"));
}

#[test]
fn numbers_on_axes_are_short_and_differ_where_they_do() {
    let texts = [0.6000000000000001, 50.0, -0.0, 0.0025, 3.2e-4, 1e-3, 250_000.0].map(plain);
    assert_eq!(texts, ["0.6", "50", "0", "2.5e-3", "3.2e-4", "1e-3", "2.5e5"]);
    assert_eq!([0.012_345, 1234.5].map(three_digits), [0.0123, 1230.0]);
}

#[test]
fn nothing_to_draw_is_an_error() {
    let curves = vec![curve("a", &[0.0, f64::INFINITY])];
    let panel = Panel { label: "size".into(), logarithmic: true, legend: true, curves };
    let error = LinePlot { panels: &[panel], ..LinePlot::default() }.svg().unwrap_err();
    assert!(error.to_string().contains("nothing finite"), "{error}");
}

#[test]
fn axes_have_their_colours_whatever_is_drawn_before_them() {
    let mut curves: Vec<PlotCurve> = ["a", "x", "b", "z"].map(|n| curve(n, &[1.0, 2.0])).into();
    (curves[1].look, curves[3].look) = (CurveLook::Axis(0), CurveLook::Axis(2));
    let panel = Panel { label: "error".into(), logarithmic: false, legend: true, curves };
    let text = paper_plot("", &[panel], &[]).unwrap();
    let colors = [palette::series(0, Ground::Paper), palette::series(1, Ground::Paper)].into_iter();
    for color in colors.chain([0, 2].map(|k| palette::axis(k, Ground::Paper))) {
        let hex = palette::hex(color).to_uppercase();
        assert_eq!(text.matches(&format!("stroke=\"{hex}\"")).count(), 2, "{hex}: the curve and its name");
    }
}

/// Truth: the width of a column, and the units of the picture per millimetre.
#[test]
fn a_figure_for_a_paper_has_the_width_of_a_column_and_names_above_its_panel() {
    let mut curves: Vec<PlotCurve> =
        ["size", "x", "a rather long name", "y", "z"].map(|n| curve(n, &[1.0, 2.0, 1.5])).into();
    (curves[0].look, curves[1].look) = (CurveLook::Total, CurveLook::Dashed);
    let panel = Panel { label: "error (mm)".into(), logarithmic: false, legend: true, curves };
    let text = paper_plot("time (s)", &[panel], &[(0.5, 1.5), (7.0, 8.0)]).unwrap();
    assert!(text.contains("width=\"88mm\"") && text.contains("viewBox=\"0 0 1056 "), "{}", &text[..200]);
    for word in ["size", "a rather long name", "error (mm)", "time (s)"] {
        assert!(text.contains(word), "{word}");
    }
    assert_eq!(text.matches("#EAF1F7").count(), 1, "one band is within the axis");
}
