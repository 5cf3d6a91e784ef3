//! Damaged recordings: reading them ends with samples or with an error, in bounded memory, whatever
//! their bytes.

use crate::synthetic;
use flexarm_log::{CreateOptions, RecordingFormat, open_recording};
use flexarm_testkit::allocations::most_bytes;

/// Maximum memory for reading a small file (bytes).
const MAX_BYTES: usize = 200 << 20;
const CHANGES: u64 = 1000;

/// Pseudo-random numbers with a fixed sequence (xorshift).
fn next(seed: &mut u64) -> u64 {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    *seed
}

/// Applies a change of a kind that broke readers: an inverted byte, zeros, truncation, and absurd
/// lengths.
fn changed(file: &[u8], kind: u64, seed: &mut u64) -> Vec<u8> {
    let mut file = file.to_vec();
    let at = (next(seed) % (file.len() as u64 - 8)) as usize;
    let lengths = [1_u64 << 31, 1 << 63, u64::MAX, 1 << 40];
    match kind % 5 {
        0 | 1 => file[at] = !file[at],
        2 => file[at..at + 8].fill(0),
        3 => file.truncate(at),
        _ => file[at..at + 8].copy_from_slice(&lengths[(next(seed) % 4) as usize].to_le_bytes()),
    }
    file
}

#[test]
fn a_damaged_recording_is_read_or_refused_in_bounded_memory() {
    for format in RecordingFormat::ALL.into_iter().filter(|format| format.is_built_in() && format.is_read_back()) {
        let path = synthetic::scratch(&format!("damaged.{}", format.extension()));
        let options = CreateOptions::default().with_overwrite(true);
        let mut recorder = format.recorder(&path, options).unwrap();
        recorder.begin(&synthetic::header()).unwrap();
        (0..60).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
        recorder.finish(&synthetic::result()).unwrap();
        drop(recorder);
        let whole = std::fs::read(&path).unwrap();
        let mut seed = 0x9e37_79b9_7f4a_7c15;
        let (mut read, mut refused) = (0, 0);
        for kind in 0..CHANGES {
            std::fs::write(&path, changed(&whole, kind, &mut seed)).unwrap();
            let mut outcome = Ok(());
            let most = most_bytes(|| {
                outcome = open_recording(&path, format).and_then(|mut run| run.replay(&mut |_| Ok(())).map(|_| ()));
            });
            assert!(most < MAX_BYTES, "{format}, change {kind}: {most} bytes");
            match outcome {
                Ok(()) => read += 1,
                Err(error) => {
                    assert!(error.to_string().contains(&format!("damaged.{}", format.extension())), "{error}");
                    refused += 1;
                }
            }
        }
        assert!(read > 0 && refused > 0, "{format}: {read} read, {refused} refused");
        std::fs::remove_file(path).unwrap();
    }
}
