//! Dates and paths in the files of a link.

use std::path::Path;

use flexarm_linkmaker::internals::{date, from_folder};

/// Truth: calendar dates.
#[test]
fn days_since_1970_are_dates() {
    for (days, text) in [(0, "1970-01-01"), (59, "1970-03-01"), (11_016, "2000-02-29"), (20_089, "2025-01-01")] {
        assert_eq!(date(days), text);
    }
}

#[test]
fn a_path_is_relative_within_one_tree_only() {
    let way = |folder: &str, path: &str| from_folder(Path::new(folder), Path::new(path));
    assert_eq!(way("/a/out/x-001", "/a/meshes/x.msh"), Path::new("../../meshes/x.msh"));
    assert_eq!(way("/a/out", "/b/x.msh"), Path::new("/b/x.msh"));
    assert_eq!(way("/a/b/../c", "/a/./c/x.msh"), Path::new("x.msh"));
}
