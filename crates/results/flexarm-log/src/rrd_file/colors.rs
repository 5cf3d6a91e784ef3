//! Colours of a recording: those of [`palette`] on a dark ground, and the scale for distances.

use rerun::{Color, Rgba32};

use flexarm_draw::palette::{self, Ground, Rgb};

/// How much of the ghost is seen.
const GHOST_ALPHA: u8 = 0x68;

fn opaque([red, green, blue]: Rgb) -> Color {
    Color(Rgba32::from_rgb(red, green, blue))
}

/// The axis x (0), y (1) or z (2).
pub(crate) fn axis(number: usize) -> Color {
    opaque(palette::axis(number, Ground::Dark))
}

/// A run, link, drive or joint by its number.
pub(crate) fn series(number: usize) -> Color {
    opaque(palette::series(number, Ground::Dark))
}

/// One of the six components of what has this number.
pub(crate) fn component(number: usize, component: usize) -> Color {
    opaque(palette::component(number, component, Ground::Dark))
}

/// A run, link, drive or joint by its number, fainter: what belongs to the rigid twin.
pub(crate) fn faint(number: usize) -> Color {
    opaque(palette::mix(palette::series(number, Ground::Dark), [0; 3], 0.45))
}

/// The rigid twin's lines.
pub(crate) fn rigid() -> Color {
    opaque(palette::rigid(Ground::Dark))
}

/// The size of an error; marks and texts.
pub(crate) fn total() -> Color {
    opaque(palette::total(Ground::Dark))
}

/// The rigid twin's surfaces: its grey, mostly transparent.
pub(crate) fn ghost() -> Rgba32 {
    let [red, green, blue] = palette::rigid(Ground::Dark);
    Rgba32::from_unmultiplied_rgba(red, green, blue, GHOST_ALPHA)
}

/// Colours for a distance: grey where there is none, over yellow to red.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColorScale {
    /// Distance of the last colour (m).
    pub(crate) full_m: f64,
}

impl ColorScale {
    /// Number of steps; few enough that neighbouring instants often share one, too many to be seen.
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
