//! Charts of studies.

use flexarm_draw::FieldPlot;
use flexarm_draw::charts::{
    BarPair, EffectPanel, ScatterPlot, bar_pairs, effects, histogram, rank_correlation, scatter_matrix,
};
use flexarm_draw::internals::{bars, range, wrapped};

/// Truth: Spearman's coefficient is 1 for an increasing curve and -1 for a decreasing one; 1,
/// 2, 3, 4 against 2, 1, 4, 3 by the formula 1 - 6 sum d^2 / (n (n^2 - 1)) = 0.6.
#[test]
fn rank_correlations_are_those_of_the_formula() {
    let x = [1.0, 2.0, 3.0, 4.0];
    assert!((rank_correlation(&x, &x.map(|x: f64| x.exp())) - 1.0).abs() < 1e-15);
    assert!((rank_correlation(&x, &x.map(|x| -x * x * x)) + 1.0).abs() < 1e-15);
    assert!((rank_correlation(&x, &[2.0, 1.0, 4.0, 3.0]) - 0.6).abs() < 1e-15);
    assert!(rank_correlation(&x, &[1.0; 4]).is_nan());
}

/// The letters of all texts of a picture, concatenated.
fn texts(svg: &str) -> String {
    svg.split("</text>").filter_map(|part| part.rsplit_once('>')).map(|(_, words)| words.trim_matches('\n')).collect()
}

#[test]
fn names_that_end_alike_stay_apart_in_every_chart() {
    let names: Vec<String> = (1..=6).map(|k| format!("drive.joint_{k}.gearbox.stiffness (% of the file)")).collect();
    let points = vec![[1.0, 2.0, 0.1], [2.0, 3.0, 0.1]];
    let y_label = "links.link_2.peak_contribution_m / links.link_3.peak_contribution_m";
    let panel = |name| EffectPanel { x_label: name, y_label, points: points.clone() };
    let panels = names.iter().map(|name| panel(name)).collect();
    let values = [1.0, 2.0];
    let columns: Vec<(&str, &[f64])> = names.iter().map(|name| (name.as_str(), &values[..])).collect();
    let bar = |name| BarPair { name, values: [[0.5, 0.4, 0.6]; 2] };
    let bars: Vec<BarPair<'_>> = names.iter().map(|name| bar(name)).collect();
    let charts = [effects(&[panels]), scatter_matrix(&columns), bar_pairs("t", ["a", "b"], &bars)];
    for (svg, name) in charts.iter().flat_map(|svg| names.iter().map(move |name| (svg, name))) {
        assert!(texts(svg).contains(name.as_str()), "{name} is not whole in {}", texts(svg));
    }
    assert!(texts(&charts[0]).contains(y_label));
    let cells = ["1", "2"].map(str::to_owned);
    let map =
        FieldPlot { labels: [&names[0], y_label], names: Some([&cells; 2]), values: &[1.0; 4], ..FieldPlot::default() };
    let map = map.svg();
    assert!(texts(&map).contains(y_label) && texts(&map).contains(names[0].as_str()));
    assert_eq!(wrapped("drive.joint_2.gearbox", 10), ["drive.", "joint_2.", "gearbox"]);
    assert_eq!(wrapped("abcdefghijklmnop", 8), ["abcdefgh", "ijklmnop"]);
}

/// Truth: counted by hand; the range exceeds the numbers by a twentieth on both sides.
#[test]
fn bars_count_every_finite_number_once() {
    let values = [0.0, 1.0, 1.0, 4.0, f64::NAN, 10.0];
    let heights: Vec<f64> = bars(&values, range(values.into_iter()), 3).iter().map(|[_, (_, count)]| *count).collect();
    assert_eq!(heights, [3.0, 1.0, 1.0]);
}

#[test]
fn charts_of_nothing_and_of_what_does_not_vary_are_pictures_without_nan() {
    let names = ["a <b>".to_owned(), "c".to_owned()];
    let map = FieldPlot { names: Some([&names, &names[..1]]), values: &[1.0, f64::NAN], ..FieldPlot::default() };
    let panel = EffectPanel { x_label: "x", y_label: "y", points: vec![[1.0, 2.0, 0.0]] };
    let pair = BarPair { name: "p", values: [[0.5, 0.4, 0.6], [0.7, 0.6, 0.9]] };
    let plot = ScatterPlot {
        points: &[[1.0, f64::NAN], [1.0, 1.0]],
        front: &[[1.0, 1.0]],
        best: Some([1.0, 1.0]),
        ..ScatterPlot::default()
    };
    let matrix = scatter_matrix(&[("a", &[1.0, 1.0]), ("b", &[f64::NAN, 2.0])]);
    for svg in [
        map.svg(),
        effects(&[vec![panel]]),
        bar_pairs("t", ["first", "total"], &[pair]),
        plot.svg(),
        matrix,
        effects(&[]),
        scatter_matrix(&[]),
        histogram("h", &[2.0, f64::NAN, 2.0], 5),
    ] {
        assert!(
            svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"),
            "{svg}"
        );
        assert!(!svg.contains("<b>"));
    }
}
