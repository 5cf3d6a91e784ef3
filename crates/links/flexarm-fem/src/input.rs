//! Reads files into memory, regular files up to a size only: a device may never end, and a pipe
//! without a writer blocks.

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Reads a file of at most `largest` bytes.
///
/// # Errors
/// The error of the operating system; `Other` if the path is not a regular file, `FileTooLarge` if
/// it has more bytes.
pub fn read_file(path: &Path, largest: u64) -> std::io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("this is not a file; give the path of a regular one"));
    }
    let mut bytes = Vec::new();
    // One byte more than allowed, to detect a larger file.
    File::open(path)?.take(largest + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > largest {
        let what = format!("more than {largest} bytes, the limit");
        return Err(std::io::Error::new(std::io::ErrorKind::FileTooLarge, what));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_are_read_and_only_up_to_a_size() {
        let folder = std::env::temp_dir();
        assert!(read_file(&folder, 1000).unwrap_err().to_string().contains("not a file"));
        assert!(
            read_file(Path::new("/dev/null"), 1000).unwrap_err().to_string().contains("give the path of a regular one")
        );
        let path = folder.join(format!("flexarm-input-{}", std::process::id()));
        std::io::Write::write_all(&mut File::create_new(&path).unwrap(), &[7; 1000]).unwrap();
        assert_eq!(read_file(&path, 1000).unwrap().len(), 1000);
        assert!(read_file(&path, 999).unwrap_err().to_string().contains("more than 999 bytes"));
        std::fs::remove_file(&path).unwrap();
    }
}
