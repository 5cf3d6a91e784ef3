//! Sizes of plots: for the screen, a page, a column of a paper, and a plan.
//!
//! Lengths in units of the picture. Not here: colours (`palette.rs`).

/// Sizes in units of the picture.
#[derive(Clone, Copy, Debug)]
pub struct Style {
    pub(super) panel: (u32, u32),
    pub(super) margin: u32,
    pub(super) x_area: u32,
    pub(super) y_area: u32,
    pub(super) title: u32,
    pub(super) font: u32,
    pub(super) legend_font: u32,
    pub(super) stroke: u32,
    /// Width of the picture on paper (mm); if `None`, units are pixels.
    pub(super) width_mm: Option<f64>,
    pub(super) x_labels: usize,
    /// Whether both axes have the same scale.
    pub(super) equal: bool,
}

pub(super) const SCREEN: Style = Style {
    panel: (960, 340),
    margin: 12,
    x_area: 36,
    y_area: 72,
    title: 18,
    font: 13,
    legend_font: 13,
    stroke: 2,
    width_mm: None,
    x_labels: 11,
    equal: false,
};

/// A picture between paragraphs, 960 browser pixels in half-pixel units.
pub(super) const PAGE: Style = Style {
    panel: (1920, 660),
    margin: 24,
    x_area: 88,
    y_area: 168,
    title: 36,
    font: 30,
    legend_font: 30,
    stroke: 4,
    width_mm: Some(254.0),
    x_labels: 11,
    equal: false,
};

/// A column of a paper, 88 mm, in twelfths of a millimetre: text of 8 points, lines of 0.3 mm.
pub(super) const COLUMN: Style = Style {
    panel: (1056, 560),
    margin: 14,
    x_area: 84,
    y_area: 132,
    title: 36,
    font: 33,
    legend_font: 31,
    stroke: 4,
    width_mm: Some(88.0),
    x_labels: 8,
    equal: false,
};

/// A plan: both axes have the same scale.
pub const PLAN: Style = Style { panel: (1920, 1300), equal: true, ..PAGE };
