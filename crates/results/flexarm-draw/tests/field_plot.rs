//! Values over a plane.

use flexarm_draw::FieldPlot;
use flexarm_draw::palette::{hex, magnitude};

/// Number of colours of the scale beside the field.
const SHADES: u8 = 48;
/// Room above the field (px).
const TOP: u32 = 28;

fn map(values: &[f64], count: [usize; 2]) -> FieldPlot<'_> {
    FieldPlot { ranges: [[0.0, 1.0], [0.0, 2.0]], count, values, equal: true, ..FieldPlot::default() }
}

#[test]
fn equal_neighbours_are_one_rectangle_and_holes_are_none() {
    // Background and scale are rectangles too.
    let cells = |svg: &str| svg.matches("<rect").count() - 1 - usize::from(SHADES);
    assert_eq!(cells(&map(&[1.0; 12], [4, 3]).svg()), 3);
    let mut values = [1.0; 12];
    values[5] = f64::NAN;
    assert_eq!(cells(&map(&values, [4, 3]).svg()), 4);
    assert_eq!(map(&[f64::NAN; 12], [4, 3]).svg(), "");
}

#[test]
fn the_largest_value_has_the_lightest_colour_and_the_lowest_row_is_below() {
    let svg = map(&[0.0, 0.0, 0.0, 1.0], [2, 2]).svg();
    let lightest = hex(magnitude(1.0)).to_uppercase();
    let line = svg.lines().find(|line| line.contains(&lightest)).unwrap();
    // Upper right: at the top of the field.
    assert!(line.contains(&format!("y=\"{TOP}\"")), "{line}");
}

/// Truth: a grid of 240 by 240 cells in blocks of two by two, each with its maximum value.
#[test]
fn a_fine_grid_is_thinned_to_the_largest_of_what_falls_together() {
    let mut values = vec![0.0; 240 * 240];
    values[241] = 1.0;
    let svg = map(&values, [240, 240]).svg();
    let lightest = hex(magnitude(1.0)).to_uppercase();
    assert_eq!(svg.lines().filter(|line| line.contains("<rect") && line.contains(&lightest)).count(), 1);
    assert!(svg.len() < 40_000, "{} bytes", svg.len());
}
