//! Files that are written and read in spite of faults.

use flexarm_log::internals::{CACHED, REACH, WrittenBehind};
#[cfg(feature = "mcap")]
use flexarm_log::internals::{CAUGHT, WholeRecords, caught};
#[cfg(feature = "mcap")]
use std::fs::File;
#[cfg(feature = "mcap")]
use std::io::Write;

/// Truth: counted piece by piece. The first call for a page starts writing it, a later one
/// drops it.
#[test]
fn what_is_far_behind_is_let_go_of_and_the_beginning_is_not() {
    let (mut behind, mut given) = (WrittenBehind::default(), Vec::new());
    let end = CACHED + 20 * REACH;
    for written in (0..=end).step_by(300_000) {
        given.extend(behind.next(written));
    }
    assert!(given.iter().all(|range| range.start >= CACHED && range.end <= end));
    for piece in (CACHED..end - REACH).step_by(1 << 20) {
        let times = given.iter().filter(|range| range.contains(&piece)).count();
        assert!((6..=8).contains(&times), "{times} times about {piece}");
    }
    assert!((100..=160).contains(&given.len()), "{} times in all", given.len());
    // Short files stay cached.
    let mut short = WrittenBehind::default();
    assert!((0..CACHED).step_by(1 << 20).all(|written| short.next(written).is_none()));
}

/// Truth: a file opened for reading refuses every write.
#[cfg(feature = "mcap")]
#[test]
fn a_write_that_fails_leaves_the_file_as_it_was_and_loses_nothing() {
    let path = std::env::temp_dir().join(format!("flexarm-mcap-fails-{}", std::process::id()));
    let mut sink = WholeRecords::new(File::create(&path).unwrap());
    let read = || std::fs::read_to_string(&path).unwrap();
    sink.write_all(b"one ").unwrap();
    assert_eq!(read(), "");
    sink.flush().unwrap();
    let writable = std::mem::replace(&mut sink.file, File::open(&path).unwrap());
    sink.write_all(b"two ").unwrap();
    assert!(sink.flush().is_err());
    assert_eq!(read(), "one ");
    sink.file = writable;
    sink.write_all(b"three").unwrap();
    sink.flush().unwrap();
    assert_eq!(read(), "one two three");
    std::fs::remove_file(&path).unwrap();
}

#[cfg(feature = "mcap")]
#[test]
fn a_panic_behind_the_wall_is_an_error_with_its_words() {
    assert_eq!(caught(|| 1 + 1), Ok(2));
    let (empty, k) = (Vec::<u8>::new(), 3);
    let error = caught(|| empty[k]).unwrap_err();
    assert!(error.to_string().contains("index out of bounds"), "{error}");
    assert!(!CAUGHT.get());
}
