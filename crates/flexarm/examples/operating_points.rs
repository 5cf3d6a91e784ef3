//! Compliance and first frequency of the shipped arm at 10,000 poses on all cores:
//! `cargo run --release -p flexarm --no-default-features --example operating_points [POSES]`
//!
//! Each thread has a workspace of its own; the arm is shared. After its first pose a thread allocates nothing.
#![allow(clippy::print_stdout, reason = "an example shows its answer")]

use std::time::Instant;

use flexarm::{Modelling, Robot, Wrench};

/// Pose `k` of a sequence that fills the joint ranges evenly, whatever its length (Kronecker, by roots of primes).
fn pose(k: usize, ranges: &[(f64, f64)], q: &mut Vec<f64>) {
    const PRIMES: [f64; 6] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0];
    q.clear();
    q.extend(ranges.iter().zip(PRIMES).map(|((lower, upper), prime)| {
        // the middle three fifths: an arm does not work at its stops
        lower + (upper - lower) * (0.2 + 0.6 * (prime.sqrt() * k as f64).fract())
    }));
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let poses: usize = std::env::args().nth(1).map_or(Ok(10_000), |text| text.parse())?;
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the checkout");
    let arm = Robot::load(root.join("robots/kr210"))?.flexible(Modelling::default())?;
    let model = &arm.flexible().model;
    let ranges: Vec<(f64, f64)> =
        model.coordinates()[..model.n_actuated()].iter().map(|c| (c.limits.lower, c.limits.upper)).collect();

    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let begin = Instant::now();
    // Stiffest and softest pose of each thread: vertical compliance (m/N), first frequency (Hz).
    let found: Vec<Result<[f64; 4], String>> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|first| {
                let (arm, ranges) = (&arm, &ranges);
                scope.spawn(move || {
                    let mut at = arm.operating_point().map_err(|e| e.to_string())?;
                    let (mut q, mut extremes) = (Vec::new(), [f64::INFINITY, 0.0, f64::INFINITY, 0.0]);
                    for k in (first..poses).step_by(threads) {
                        pose(k, ranges, &mut q);
                        at.solve(&q, &Wrench::zeros()).map_err(|e| e.to_string())?;
                        let (down, hz) = (at.compliance()[(2, 2)], at.frequencies_hz()[0]);
                        let [c_min, c_max, f_min, f_max] = extremes;
                        extremes = [c_min.min(down), c_max.max(down), f_min.min(hz), f_max.max(hz)];
                    }
                    Ok(extremes)
                })
            })
            .collect();
        workers.into_iter().map(|worker| worker.join().unwrap_or_else(|_| Err("a thread died".into()))).collect()
    });
    let seconds = begin.elapsed().as_secs_f64();
    let mut all = [f64::INFINITY, 0.0, f64::INFINITY, 0.0];
    for extremes in found {
        let [c_min, c_max, f_min, f_max] = extremes?;
        all = [all[0].min(c_min), all[1].max(c_max), all[2].min(f_min), all[3].max(f_max)];
    }
    println!("{poses} poses, {threads} threads: {:.1} us per pose", 1e6 * seconds / poses as f64);
    println!("vertical compliance of the tool {:.3} to {:.3} um/N", 1e6 * all[0], 1e6 * all[1]);
    println!("first frequency {:.2} to {:.2} Hz", all[2], all[3]);
    Ok(())
}
