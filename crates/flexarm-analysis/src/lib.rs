//! TCP error metrics: peak, RMS, settling, overshoot, path axes, contributions
