//! Designs of studies, and evaluation of their results: pure functions on numbers.
//!
//! A study evaluates many points of a unit cube: a [`Sample`] (random, Latin hypercube, Sobol,
//! Saltelli) or a full grid ([`grid_levels`]); a [`Distribution`] maps coordinates to values.
//! [`main_effect`], [`beyond_chance`], [`sobol_indices`], [`spread`] and [`pareto_front`] evaluate
//! the results.
//!
//! ```
//! use flexarm_sweep::statistics::{Distribution, Sample, SampleMethod, sobol_indices};
//!
//! // Which of two springs in series makes more of the scatter of their compliance?
//! let stiffness = [Distribution::Normal { mean: 1e6, std: 1e5 }, Distribution::Normal { mean: 2e6, std: 1e5 }];
//! let sample = Sample::new(SampleMethod::Saltelli, 2, 256, 0).expect("few dimensions");
//! let value = |point, k: usize| stiffness[k].quantile(sample.coordinate(point, k));
//! let compliance: Vec<f64> = (0..sample.points()).map(|p| 1.0 / value(p, 0) + 1.0 / value(p, 1)).collect();
//! let indices = sobol_indices(&compliance, 2, 0).expect("it varies");
//! assert!(indices[0].first > 0.9 && indices[1].first < 0.1);
//! ```
//!
//! Results depend only on their seed: any point follows from its number on any machine. Not here:
//! simulations, files.

pub(crate) mod chance;
mod distribution;
mod effects;
mod indices;
mod random;
mod sample;
mod sobol;

pub use chance::{BeyondChance, beyond_chance};
pub use distribution::Distribution;
pub use effects::{EffectGroup, Grouping, MainEffect, Spread, main_effect, pareto_front, spread};
pub use indices::{SobolIndex, sobol_indices};
pub use sample::{Sample, SampleMethod, grid_levels};
