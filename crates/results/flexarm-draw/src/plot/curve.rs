//! Curves and panels of a plot.
//!
//! Plain data in the units of the axes. Not here: drawing (`mod.rs`).

/// Style of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CurveLook {
    /// With its own colour.
    #[default]
    Plain,
    /// Black and slightly wider: the magnitude of the others.
    Total,
    /// With its own colour, dashed: the reference of a comparison.
    Dashed,
    /// With its own colour, a dot at each point: values measured or computed only there.
    Dots,
    /// Like [`CurveLook::Plain`], with a dot at each point.
    Marked,
    /// In the colour of axis x (0), y (1) or z (2).
    Axis(usize),
    /// In the colour of the link, spring or joint of this index.
    Part(usize),
    /// Dashed, in the grey of the rigid twin.
    Rigid,
}

impl CurveLook {
    pub(super) fn is_dashed(self) -> bool {
        matches!(self, Self::Dashed | Self::Rigid)
    }

    /// Returns whether its colour is the next one in the order of the plot.
    pub(super) fn is_counted(self) -> bool {
        matches!(self, Self::Plain | Self::Dashed | Self::Dots | Self::Marked)
    }
}

/// A curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotCurve {
    /// Name in the legend.
    pub name: String,
    /// Style.
    pub look: CurveLook,
    /// Abscissae, ascending.
    pub x: Vec<f64>,
    /// Ordinates, one per x.
    pub y: Vec<f64>,
}

/// Curves that share a vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Label of the vertical axis.
    pub label: String,
    /// Whether the vertical axis is logarithmic; values that are not positive are left out.
    pub logarithmic: bool,
    /// Whether its curves are named in a legend.
    pub legend: bool,
    /// Curves; those with the same name have the same colour in all panels.
    pub curves: Vec<PlotCurve>,
}
