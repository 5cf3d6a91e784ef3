//! Time that a command takes.

use std::time::Instant;

/// Wall time and CPU time since a start. Without an operating system that counts CPU time, in a
/// browser, both are equal.
#[derive(Debug, Clone, Copy)]
pub struct Stopwatch {
    wall: Instant,
    #[cfg(not(target_family = "wasm"))]
    cpu: cpu_time::ProcessTime,
}

impl Stopwatch {
    /// Starts now.
    #[must_use]
    pub fn start() -> Self {
        Self {
            wall: Instant::now(),
            #[cfg(not(target_family = "wasm"))]
            cpu: cpu_time::ProcessTime::now(),
        }
    }

    /// Returns the wall time since the start (s).
    pub fn wall_s(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
    }

    /// Returns the CPU time of all threads of the process since the start (s).
    pub fn cpu_s(&self) -> f64 {
        #[cfg(not(target_family = "wasm"))]
        return self.cpu.elapsed().as_secs_f64();
        #[cfg(target_family = "wasm")]
        self.wall_s()
    }
}
