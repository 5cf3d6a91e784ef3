//! The shipped robots, end to end: placeholder replaced below.
#[test]
fn nothing() {}
