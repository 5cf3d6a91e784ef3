//! Results that are written all or none.

use std::io::ErrorKind;
use std::path::PathBuf;
use std::rc::Rc;

use flexarm_files::{FileError, check_free, file_stem, private_folder, write_all, writing_unless};

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

/// A folder for a test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("flexarm-files-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn files_of_others_with_a_provisional_name_stay_as_they_are() {
    let folder = folder("others");
    let others = ["a.flex.partial", "flexarm-0.partial"];
    others.iter().for_each(|name| std::fs::write(folder.join(name), "mine").unwrap());
    write_all(&[(folder.join("a.flex"), "new"), (folder.join("b.flex"), "new")]).unwrap();
    assert!(others.iter().all(|name| std::fs::read_to_string(folder.join(name)).unwrap() == "mine"));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 4);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_name_may_be_as_long_as_the_file_system_allows() {
    let folder = folder("long");
    let name = folder.join("n".repeat(255));
    write_all(&[(name.clone(), "new")]).unwrap();
    assert_eq!(std::fs::read_to_string(&name).unwrap(), "new");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
#[cfg(unix)]
fn a_file_that_is_replaced_keeps_its_permissions_and_the_links_to_it() {
    use std::os::unix::fs::{PermissionsExt, symlink};

    let folder = folder("replaced");
    let (file, link, second) = (folder.join("kept/file"), folder.join("link"), folder.join("second"));
    write_all(&[(file.clone(), "old")]).unwrap();
    std::fs::set_permissions(&file, PermissionsExt::from_mode(0o600)).unwrap();
    symlink("kept/file", &link).unwrap();
    symlink(&link, &second).unwrap();
    write_all(&[(second.clone(), "new")]).unwrap();
    assert!(link.is_symlink() && second.is_symlink());
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "new");
    assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
    // A link that leads nowhere yet is in use, and is followed where that is wanted.
    let ahead = folder.join("ahead");
    symlink("kept/later", &ahead).unwrap();
    assert!(matches!(check_free(std::slice::from_ref(&ahead), false), Err(FileError::Taken { .. })));
    write_all(&[(ahead.clone(), "new")]).unwrap();
    assert!(ahead.is_symlink() && folder.join("kept/later").is_file());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
#[cfg(unix)]
fn a_private_folder_is_new_and_its_owner_s_alone() {
    use std::os::unix::fs::PermissionsExt;

    let folder = folder("private");
    let [first, second] = [(); 2].map(|()| private_folder(&folder).unwrap());
    assert_ne!(first, second);
    assert_eq!(first.metadata().unwrap().permissions().mode() & 0o777, 0o700);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
#[cfg(unix)]
fn a_device_is_not_replaced_by_a_file() {
    let error = check_free(&["/dev/null".into()], true).unwrap_err();
    assert!(error.to_string().contains("/dev/null: is a device"), "{error}");
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
