//! Packed files, and how much of them is unpacked.

use std::io::Write;

use flexarm_fe_io::internals::{allowed_unpacked, unpacked};

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn a_packed_file_that_grows_without_end_is_refused_early() {
    let bytes = packed(&vec![b'*'; 100_000]);
    let refused = unpacked(&bytes, 1000).unwrap_err();
    assert!(refused.found.contains("unpack to more than 1000 bytes"), "{}", refused.found);
    assert_eq!(unpacked(&bytes, 100_000).unwrap().len(), 100_000);
    assert_eq!(unpacked(&bytes[..bytes.len() / 2], 100_000).unwrap_err().expected, "a whole gzip file");
}

/// Ratio 1000 to 1, beyond any mesh: 71 MB of blanks in 71 kB.
#[test]
fn a_ratio_that_no_mesh_has_is_refused_beyond_64_megabytes() {
    let bytes = packed(&vec![b' '; 71 << 20]);
    assert!(bytes.len() < 1 << 20, "{}", bytes.len());
    assert!(unpacked(&bytes, u64::MAX).unwrap_err().found.contains("unpack to more than"));
    assert_eq!(allowed_unpacked(10 << 20, u64::MAX), 500 << 20);
    assert_eq!(allowed_unpacked(10 << 20, 1 << 20), 1 << 20);
}
