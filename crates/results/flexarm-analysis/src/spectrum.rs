//! The strongest spectral line of a vibration, resolved between the bins of the transform.
//!
//! The signal is tapered and transformed by a radix-2 FFT of twice its length; the highest peak is
//! refined by golden-section search on the exact transform. 10 s at 1 kHz take a few milliseconds.
//! Start at [`strongest_line`]. Not here: choice of the interval of a record (`metrics`, `hold`).

use std::f64::consts::{PI, TAU};

/// Maximum number of samples that are transformed.
const MAX_SAMPLES: usize = 1 << 14;
/// Minimum number of samples for a spectrum.
const FEWEST_SAMPLES: usize = 16;
/// Minimum number of cycles of a line within the record.
const FEWEST_CYCLES: f64 = 1.5;
/// Minimum ratio of the power of a line to the lowest power between DC and it.
const PROMINENCE: f64 = 4.0;

/// Steps of the peak search: they reduce two bins to 2e-5 of a bin.
const REFINEMENTS: usize = 24;

/// Window applied to the signal before the transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taper {
    /// Full weight at the start, fading out by `cos²`: for a decaying vibration. A long signal is
    /// truncated.
    FadeOut,
    /// Fading in and out by `sin²` (Hann): for a signal without a distinguished start. A long
    /// signal is averaged in blocks.
    Both,
}

/// A spectral line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralLine {
    /// Frequency, Hz.
    pub hz: f64,
    /// Amplitude of the undamped sinusoid with this line, in the unit of the signal, all components
    /// together (root of the sum of squares). Smaller than the initial amplitude of a decaying
    /// vibration.
    pub amplitude: f64,
}

/// Finds the strongest line of a signal with three components, over all components together.
///
/// * `times`: s, strictly increasing; the signal is interpolated to uniform steps.
/// * `signal`: one entry per time, any unit; its weighted mean is removed.
///
/// Returns `None` if there is no line: fewer than 16 samples, nothing that repeats at least one and
/// a half times and exceeds the spectrum below it by 6 dB, or an amplitude within the rounding of
/// the signal.
///
/// Relative accuracy of the frequency for an undamped sinusoid with `n` cycles in the record: about
/// `0.2 / n²`.
pub fn strongest_line(times: &[f64], signal: &[[f64; 3]], taper: Taper) -> Option<SpectralLine> {
    strongest_line_from(times, signal, taper, 0.0)
}

/// Like [`strongest_line`], not below a frequency (Hz).
pub(crate) fn strongest_line_from(
    times: &[f64],
    signal: &[[f64; 3]],
    taper: Taper,
    lowest_hz: f64,
) -> Option<SpectralLine> {
    if times.len() < FEWEST_SAMPLES || times.len() != signal.len() {
        return None;
    }
    let tapered = Tapered::new(times, signal, taper);
    let bins = (2 * tapered.samples.len()).next_power_of_two();
    let power = tapered.power_spectrum(bins);
    let bin_hz = 1.0 / (bins as f64 * tapered.step);

    // Local maxima with enough cycles, away from the Nyquist frequency.
    let few_cycles = FEWEST_CYCLES / (tapered.samples.len() as f64 * tapered.step);
    let first = (few_cycles.max(lowest_hz) / bin_hz).ceil() as usize;
    let is_peak = |k: &usize| power[*k] >= power[k - 1] && power[*k] > power[k + 1];
    let peak = (first.max(1)..bins / 2 - 1).filter(is_peak).max_by(|&a, &b| power[a].total_cmp(&power[b]))?;
    let valley = power[1..=peak].iter().copied().fold(f64::INFINITY, f64::min);
    if power[peak] < PROMINENCE * valley {
        return None;
    }

    let (low, high) = ((peak - 1) as f64 * bin_hz, (peak + 1) as f64 * bin_hz);
    let hz = golden_maximum(|hz| tapered.power_at(hz), low, high, REFINEMENTS);
    let amplitude = 2.0 * tapered.power_at(hz).sqrt() / tapered.weight;
    (amplitude > 1e-12 * tapered.scale).then_some(SpectralLine { hz, amplitude })
}

/// Amplitude spectrum.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AmplitudeSpectrum {
    /// Frequencies, Hz, evenly spaced from 0.
    pub hz: Vec<f64>,
    /// Amplitude of the sinusoid with this spectral value, per component, in the unit of the
    /// signal.
    pub amplitude: Vec<[f64; 3]>,
}

/// Computes the spectrum of a signal with three components without its mean, with a Hann window
/// (`sin²`).
///
/// * `times`: s, strictly increasing; the signal is interpolated to uniform steps.
///
/// A steady sinusoid of amplitude `a` gives a line of height `a` (1 % less between two
/// frequencies), a decaying vibration a lower one; for a duration `T` lines are `4/T` wide at their
/// base. Returns `None` for fewer than 16 samples.
pub fn amplitude_spectrum(times: &[f64], signal: &[[f64; 3]]) -> Option<AmplitudeSpectrum> {
    if times.len() < FEWEST_SAMPLES || times.len() != signal.len() {
        return None;
    }
    let tapered = Tapered::new(times, signal, Taper::Both);
    let bins = (4 * tapered.samples.len()).next_power_of_two();
    let (mut amplitude, twiddles) = (vec![[0.0; 3]; bins / 2], twiddles(bins));
    for component in 0..3 {
        for (slot, [re, im]) in amplitude.iter_mut().zip(tapered.transform(component, &twiddles)) {
            slot[component] = 2.0 * re.hypot(im) / tapered.weight;
        }
    }
    let bin_hz = 1.0 / (bins as f64 * tapered.step);
    Some(AmplitudeSpectrum { hz: (0..bins / 2).map(|k| k as f64 * bin_hz).collect(), amplitude })
}

/// A uniformly sampled signal without its mean, times the window.
struct Tapered {
    samples: Vec<[f64; 3]>,
    /// Sampling interval, s.
    step: f64,
    /// Sum of the window weights.
    weight: f64,
    /// Maximum absolute value before the mean was removed.
    scale: f64,
}

impl Tapered {
    /// Tapers a signal (times in s) for the transform.
    fn new(times: &[f64], signal: &[[f64; 3]], taper: Taper) -> Self {
        let scale = signal.iter().flatten().fold(0.0, |peak: f64, x| peak.max(x.abs()));
        // Equal intervals of time. A longer signal is cut at its end, or averaged over blocks.
        let (mut samples, step) = match taper {
            Taper::FadeOut => {
                let n = times.len().min(MAX_SAMPLES);
                evenly(&times[..n], &signal[..n])
            }
            Taper::Both => {
                let (samples, step) = evenly(times, signal);
                let block = samples.len().div_ceil(MAX_SAMPLES);
                (samples.chunks_exact(block).map(mean).collect(), step * block as f64)
            }
        };

        let n = samples.len() as f64;
        // Taper; the mean that it weights is subtracted first.
        let shape = |k: usize| match taper {
            Taper::FadeOut => (0.5 * PI * k as f64 / n).cos().powi(2),
            Taper::Both => (PI * (k as f64 + 0.5) / n).sin().powi(2),
        };
        let shape: Vec<f64> = (0..samples.len()).map(shape).collect();
        let weight: f64 = shape.iter().sum();
        for component in 0..3 {
            let sum: f64 = samples.iter().zip(&shape).map(|(x, shape)| shape * x[component]).sum();
            samples.iter_mut().for_each(|x| x[component] -= sum / weight);
        }
        for (x, shape) in samples.iter_mut().zip(&shape) {
            *x = x.map(|value| value * shape);
        }
        Self { samples, step, weight, scale }
    }

    /// Squared magnitude of the transform at the first half of `bins` frequencies.
    fn power_spectrum(&self, bins: usize) -> Vec<f64> {
        let (mut power, twiddles) = (vec![0.0; bins / 2], twiddles(bins));
        for component in 0..3 {
            for (sum, [re, im]) in power.iter_mut().zip(&self.transform(component, &twiddles)) {
                *sum += re * re + im * im;
            }
        }
        power
    }

    /// Transform of one component, zero-padded to the length of the [`twiddles`].
    fn transform(&self, component: usize, twiddles: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut data = vec![[0.0; 2]; 2 * twiddles.len()];
        for (slot, x) in data.iter_mut().zip(&self.samples) {
            slot[0] = x[component];
        }
        fft(&mut data, twiddles);
        data
    }

    /// Squared magnitude of the transform at any frequency, by a rotating phasor.
    fn power_at(&self, hz: f64) -> f64 {
        let (turn_im, turn_re) = (TAU * hz * self.step).sin_cos();
        let (mut re, mut im) = (1.0, 0.0);
        let mut sums = [[0.0; 2]; 3];
        for x in &self.samples {
            for (sum, value) in sums.iter_mut().zip(x) {
                sum[0] += value * re;
                sum[1] -= value * im;
            }
            (re, im) = (re * turn_re - im * turn_im, re * turn_im + im * turn_re);
        }
        sums.iter().flatten().map(|part| part * part).sum()
    }
}

/// Interpolates linearly to equally many uniform steps.
fn evenly(times: &[f64], signal: &[[f64; 3]]) -> (Vec<[f64; 3]>, f64) {
    let last = times.len() - 1;
    let step = (times[last] - times[0]) / last as f64;
    let mut i = 0;
    let at = |k: usize| {
        let t = times[0] + k as f64 * step;
        while i + 2 <= last && times[i + 1] <= t {
            i += 1;
        }
        let part = ((t - times[i]) / (times[i + 1] - times[i])).clamp(0.0, 1.0);
        std::array::from_fn(|c| signal[i][c] + part * (signal[i + 1][c] - signal[i][c]))
    };
    ((0..=last).map(at).collect(), step)
}

fn mean(block: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|c| block.iter().map(|x| x[c]).sum::<f64>() / block.len() as f64)
}

/// `exp(-2πi k/n)` for `k < n/2`.
fn twiddles(n: usize) -> Vec<[f64; 2]> {
    let at = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
        [cos, -sin]
    };
    (0..n / 2).map(at).collect()
}

/// In-place radix-2 transform, decimation in time; the length is a power of two, with `twiddles`
/// for that length.
fn fft(data: &mut [[f64; 2]], twiddles: &[[f64; 2]]) {
    let n = data.len();
    // Bit reversal, then butterflies of growing span.
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> (usize::BITS - bits);
        if i < j {
            data.swap(i, j);
        }
    }
    let mut span = 1;
    while span < n {
        let stride = n / (2 * span);
        for start in (0..n).step_by(2 * span) {
            for k in 0..span {
                let [w_re, w_im] = twiddles[k * stride];
                let ([a_re, a_im], [b_re, b_im]) = (data[start + k], data[start + k + span]);
                let (t_re, t_im) = (b_re * w_re - b_im * w_im, b_re * w_im + b_im * w_re);
                data[start + k] = [a_re + t_re, a_im + t_im];
                data[start + k + span] = [a_re - t_re, a_im - t_im];
            }
        }
        span *= 2;
    }
}

/// Finds the maximum of a function with one peak in the interval, by golden-section search; each
/// step reduces the interval by the factor 0.618.
pub(crate) fn golden_maximum(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64, steps: usize) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut left, mut right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut f_left, mut f_right) = (f(left), f(right));
    for _ in 0..steps {
        if f_left > f_right {
            (high, right, f_right) = (right, left, f_left);
            left = high - GOLDEN * (high - low);
            f_left = f(left);
        } else {
            (low, left, f_left) = (left, right, f_right);
            right = low + GOLDEN * (high - low);
            f_right = f(right);
        }
    }
    0.5 * (low + high)
}
