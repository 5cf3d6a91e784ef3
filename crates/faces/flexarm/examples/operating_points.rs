//! Compliance and first frequency of the shipped arm at 10,000 poses on all cores:
//! `cargo run --release -p flexarm --no-default-features --example operating_points [POSES [ROBOT]]`
//!
//! Two variants: one pose after another in a workspace per thread, which does not allocate after
//! its first pose, and all poses in one call, which processes four poses at a time. Both give
//! bitwise equal results.
#![allow(clippy::print_stdout, reason = "an example shows its answer")]

use std::time::Instant;

use flexarm::{Arm, Modelling, Robot, Wrench};

/// Pose `k` of a low-discrepancy sequence that fills the joint ranges evenly for any length
/// (Kronecker, with square roots of primes).
fn pose(k: usize, ranges: &[(f64, f64)], q: &mut Vec<f64>) {
    const PRIMES: [f64; 6] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0];
    q.extend(ranges.iter().zip(PRIMES).map(|((lower, upper), prime)| {
        // the middle three fifths: an arm does not work at its limits
        lower + (upper - lower) * (0.2 + 0.6 * (prime.sqrt() * k as f64).fract())
    }));
}

/// Vertical compliance of the TCP (m/N) and first frequency (Hz) at each pose, sequentially on each
/// thread.
fn one_by_one(arm: &Arm, poses: &[f64], joints: usize, threads: usize) -> Result<Vec<[f64; 2]>, String> {
    let share = (poses.len() / joints).div_ceil(threads) * joints;
    let parts: Vec<Result<Vec<[f64; 2]>, String>> = std::thread::scope(|scope| {
        let work = |poses| {
            move || {
                let mut at = arm.operating_point().map_err(|e| e.to_string())?;
                let answer = |q: &[f64]| {
                    at.solve(q, &Wrench::zeros()).map_err(|e| e.to_string())?;
                    Ok([at.compliance()[(2, 2)], at.frequencies_hz()[0]])
                };
                <[f64]>::chunks_exact(poses, joints).map(answer).collect()
            }
        };
        let workers: Vec<_> = poses.chunks(share).map(|poses| scope.spawn(work(poses))).collect();
        workers.into_iter().map(|worker| worker.join().unwrap_or_else(|_| Err("a thread died".into()))).collect()
    });
    Ok(parts.into_iter().collect::<Result<Vec<_>, _>>()?.concat())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let poses: usize = arguments.next().map_or(Ok(10_000), |text| text.parse())?;
    let robot = arguments.next().unwrap_or_else(|| "kr210".into());
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the checkout");
    let arm = Robot::load(root.join("robots").join(robot))?.model(&Modelling::default())?;
    let model = &arm.model;
    let ranges: Vec<(f64, f64)> =
        model.coordinates()[..model.n_actuated()].iter().map(|c| (c.limits.lower, c.limits.upper)).collect();
    let (mut all, joints) = (Vec::new(), ranges.len());
    (0..poses).for_each(|k| pose(k, &ranges, &mut all));

    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let begin = Instant::now();
    let alone = one_by_one(&arm, &all, joints, threads)?;
    let (seconds, begin) = (begin.elapsed().as_secs_f64(), Instant::now());
    let together = arm.operating_points(&all, &Wrench::zeros())?;
    let told = |seconds: f64| 1e6 * seconds / poses as f64;
    let faster = told(begin.elapsed().as_secs_f64());
    println!("{poses} poses, {threads} threads: {:.1} us per pose one by one, {faster:.1} in one call", told(seconds));

    let mut extremes = [f64::INFINITY, 0.0, f64::INFINITY, 0.0];
    for (k, [down, hz]) in alone.into_iter().enumerate() {
        let same =
            down == together.compliance[36 * k + 14] && hz == together.frequencies_hz[together.frequencies() * k];
        assert!(same, "pose {k} has other bits in one call");
        let [c_min, c_max, f_min, f_max] = extremes;
        extremes = [c_min.min(down), c_max.max(down), f_min.min(hz), f_max.max(hz)];
    }
    let [c_min, c_max, f_min, f_max] = extremes;
    println!("vertical compliance of the tool {:.3} to {:.3} um/N", 1e6 * c_min, 1e6 * c_max);
    println!("first frequency {f_min:.2} to {f_max:.2} Hz");
    Ok(())
}
