//! Limit of what a compressed file may unpack to.

/// Size that a file of any length may unpack to, bytes.
const MIN: u64 = 256 << 20;
/// Ratio of unpacked to packed bytes that longer files may have: a recording of an arm at rest has
/// less than 100.
const RATIO: u64 = 1000;

/// Returns the number of bytes that a file of `packed` bytes may unpack to.
///
/// ```
/// assert_eq!(flexarm_files::most_unpacked(7_000), 268_435_456);
/// assert_eq!(flexarm_files::most_unpacked(7_000_000), 7_000_000_000);
/// ```
pub fn most_unpacked(packed: u64) -> u64 {
    MIN.max(RATIO.saturating_mul(packed))
}
