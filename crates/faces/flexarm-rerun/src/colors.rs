//! Colours of a recording: those of [`palette`] on a dark background, and the scale for distances.
//!
//! Numbers are those of runs, links, drives or joints. Not here: the palette (`flexarm-draw`), views
//! (`layout.rs`).

use rerun::{Color, Rgba32};

use flexarm_draw::palette::{self, Ground, Rgb};

/// Opacity of the rigid twin's surfaces.
const GHOST_ALPHA: u8 = 0x68;

fn opaque([red, green, blue]: Rgb) -> Color {
    Color(Rgba32::from_rgb(red, green, blue))
}

/// Colour of axis x (0), y (1) or z (2).
pub(crate) fn axis(number: usize) -> Color {
    opaque(palette::axis(number, Ground::Dark))
}

/// Colour of a run, link, drive or joint by its number.
pub(crate) fn series(number: usize) -> Color {
    opaque(palette::series(number, Ground::Dark))
}

/// Colour of one of the six components of the item with this number.
pub(crate) fn component(number: usize, component: usize) -> Color {
    opaque(palette::component(number, component, Ground::Dark))
}

/// Fainter colour of a run, link, drive or joint by its number, for the rigid twin.
pub(crate) fn faint(number: usize) -> Color {
    opaque(palette::mix(palette::series(number, Ground::Dark), [0; 3], 0.45))
}

/// Colour of the rigid twin's lines.
pub(crate) fn rigid() -> Color {
    opaque(palette::rigid(Ground::Dark))
}

/// Colour of error norms, marks and texts.
pub(crate) fn total() -> Color {
    opaque(palette::total(Ground::Dark))
}

/// Colour of the rigid twin's surfaces: its grey, mostly transparent.
pub(crate) fn ghost() -> Rgba32 {
    let [red, green, blue] = palette::rigid(Ground::Dark);
    Rgba32::from_unmultiplied_rgba(red, green, blue, GHOST_ALPHA)
}

/// Colour scale for a distance: from grey at zero through yellow to red.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColorScale {
    /// Distance of the last colour (m).
    pub(crate) full_m: f64,
}

impl ColorScale {
    /// Number of steps: few enough that neighbouring samples often share one, too many to be
    /// noticed.
    pub(crate) const STEPS: u32 = 40;
    const STOPS: [[f64; 3]; 4] =
        [[168.0, 176.0, 190.0], [250.0, 214.0, 110.0], [240.0, 120.0, 48.0], [196.0, 22.0, 40.0]];

    pub(crate) fn color(self, distance_m: f64) -> Color {
        let [red, green, blue] = self.rgb(distance_m);
        Color(Rgba32::from_rgb(red, green, blue))
    }

    pub(crate) fn rgb(self, distance_m: f64) -> [u8; 3] {
        let share = if self.full_m > 0.0 { (distance_m / self.full_m).clamp(0.0, 1.0) } else { 0.0 };
        let steps = f64::from(Self::STEPS);
        let x = (share * steps).round() / steps * (Self::STOPS.len() - 1) as f64;
        let k = (x.floor() as usize).min(Self::STOPS.len() - 2);
        let mix = |c: usize| Self::STOPS[k][c] + (Self::STOPS[k + 1][c] - Self::STOPS[k][c]) * (x - k as f64);
        [0, 1, 2].map(|c| mix(c).round() as u8)
    }
}
