//! Results that are written all or none.

use std::io::ErrorKind;
use std::rc::Rc;

use flexarm_files::{FileError, file_stem, write_all, writing_unless};

#[test]
fn results_that_cannot_all_be_written_leave_no_file_and_no_folder() {
    let place = std::env::temp_dir().join(format!("flexarm-files-undo-{}", std::process::id()));
    std::fs::create_dir_all(&place).unwrap();
    let folder = place.join("made/for/it");
    // The second file needs a folder where there is a file.
    let in_the_way = place.join("file");
    std::fs::write(&in_the_way, "x").unwrap();
    let failed = write_all(&[(folder.join("a"), "a"), (in_the_way.join("b"), "b")]);
    assert!(matches!(failed, Err(FileError::Write { path, .. }) if path == in_the_way.join("b")));
    let left: Vec<_> = std::fs::read_dir(&place).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["file"]);
    std::fs::remove_dir_all(&place).unwrap();
}

#[test]
fn what_nobody_wants_any_more_is_not_written() {
    use std::cell::Cell;

    let folder = std::env::temp_dir().join(format!("flexarm-files-unwanted-{}", std::process::id()));
    let files = [(folder.join("a"), "a")];
    let unwanted = Rc::new(Cell::new(false));
    let asked = unwanted.clone();
    writing_unless(
        move || asked.get(),
        || {
            write_all(&files).unwrap();
            std::fs::remove_dir_all(&folder).unwrap();
            unwanted.set(true);
            let refused = write_all(&files);
            assert!(matches!(refused, Err(FileError::Write { source, .. }) if source.kind() == ErrorKind::Interrupted));
            assert!(!folder.exists());
        },
    );
    // Other work of the thread writes as before.
    write_all(&files).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn names_of_links_become_names_of_files() {
    assert_eq!(file_stem("link 2/á*.v1"), "link_2_á_.v1");
}
