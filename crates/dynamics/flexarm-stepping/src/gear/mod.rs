//! Gearbox effects other than elasticity: transmission errors, hysteresis, load-dependent friction,
//! and gears that couple several joints.
//!
//! ```text
//! δ = e - ε(q_m)                              ε: transmission error, δ: spring deflection  (1)
//! F = elastic(δ) + Σ k_i s_i                  s_i: deflection of slider i, |s_i| <= r_i    (2)
//! s_i ← clamp(s_i + Δδ, -r_i, r_i)            play operator, state at the ends of steps    (3)
//! on e: F;   on q_m: -ε'(q_m) F               so that F does the work F δ̇                  (4)
//! θ = C^-1 q,  K = C^-T K_m C^-1,  τ_m = Cᵀ τ gears between motors θ and joints q = C θ    (5)
//! ```
//! Sliders in parallel follow Masing's rules: a branch after a reversal is the first loading curve
//! scaled by two, and the loss of a closed cycle does not depend on the rate. Start at
//! [`TransmissionError`], [`Hysteresis`], [`GearCoupling`] and [`LoadFriction`]; [`GearState`] is
//! the state of a run. `setup` adds the laws to an arm; `springs` and `friction` are its forces.
//! Not here: linear springs (`plant`), rotors (in the tree).
//!
//! Sources: [Iwan 1966] for sliders in parallel; [Tuttle & Seering 1996] for (1) with harmonics of
//! the motor.

mod coupling;
mod friction;
pub(crate) mod hysteresis;
mod load_friction;
mod setup;
mod springs;
mod state;
mod transmission;

pub use coupling::GearCoupling;
pub use hysteresis::{Hysteresis, Slider};
pub use load_friction::LoadFriction;
pub use transmission::{Harmonic, TransmissionError};

pub(crate) use state::GearState;
