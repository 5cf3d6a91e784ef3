//! Colours of a recording.

use rerun::{Color, Rgba32};

pub(crate) const RED: u32 = 0xE0_4F_4F_FF;
pub(crate) const GREEN: u32 = 0x5F_BF_5F_FF;
pub(crate) const BLUE: u32 = 0x5B_8D_EF_FF;
pub(crate) const LIGHT: u32 = 0xD8_D8_D8_FF;
pub(crate) const ORANGE: u32 = 0xF2_A1_3B_FF;
/// The rigid twin: bluish, mostly transparent.
pub(crate) const GHOST: u32 = 0x7F_B2_FF_78;

/// Colours of the runs of a study, told apart also by people who see red and green alike (Okabe and Ito 2008).
pub(crate) const RUNS: [u32; 7] =
    [0xE6_9F_00_FF, 0x56_B4_E9_FF, 0x00_9E_73_FF, 0xF0_E4_42_FF, 0xCC_79_A7_FF, 0xD5_5E_00_FF, 0x00_72_B2_FF];

/// Colours for a distance: grey where there is none, over yellow to red.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColorScale {
    /// Distance of the last colour (m).
    pub(crate) full_m: f64,
}

impl ColorScale {
    /// Number of steps; few enough that neighbouring instants often share one, too many to be seen.
    const STEPS: f64 = 40.0;
    const STOPS: [[f64; 3]; 4] =
        [[168.0, 176.0, 190.0], [250.0, 214.0, 110.0], [240.0, 120.0, 48.0], [196.0, 22.0, 40.0]];

    pub(crate) fn color(self, distance_m: f64) -> Color {
        let [red, green, blue] = self.rgb(distance_m);
        Color(Rgba32::from_rgb(red, green, blue))
    }

    pub(crate) fn rgb(self, distance_m: f64) -> [u8; 3] {
        let share = if self.full_m > 0.0 { (distance_m / self.full_m).clamp(0.0, 1.0) } else { 0.0 };
        let x = (share * Self::STEPS).round() / Self::STEPS * (Self::STOPS.len() - 1) as f64;
        let k = (x.floor() as usize).min(Self::STOPS.len() - 2);
        let mix = |c: usize| Self::STOPS[k][c] + (Self::STOPS[k + 1][c] - Self::STOPS[k][c]) * (x - k as f64);
        [0, 1, 2].map(|c| mix(c).round() as u8)
    }
}
