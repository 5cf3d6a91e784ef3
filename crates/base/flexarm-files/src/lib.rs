//! Reading of text files with the position of errors in them; writing of results to disk, all or
//! none.
//!
//! ```
//! use flexarm_files::{FileError, Source, check_free, write_all};
//!
//! // What is wrong in a text is said with line and column.
//! let text = "format = 1\nmodes = -3\n";
//! let error = Source::new("arm.toml".as_ref(), text, "robot").error(19..21, "modes is -3, at least 0 is needed");
//! assert_eq!(error.to_string(), "arm.toml:2:9: modes is -3, at least 0 is needed");
//!
//! // Results come together, and what is there is not replaced unasked.
//! let folder = std::env::temp_dir().join(format!("flexarm-files-{}", std::process::id()));
//! let files = ["link.flex", "summary.json"].map(|name| (folder.join(name), "..."));
//! let paths = files.clone().map(|(path, _)| path);
//! check_free(&paths, false)?;
//! write_all(&files)?;
//! assert!(matches!(check_free(&paths, false), Err(FileError::Taken { .. })));
//! # std::fs::remove_dir_all(&folder).unwrap();
//! # Ok::<(), FileError>(())
//! ```
//!
//! Not here: the meaning of the files.

mod error;
mod number_table;
mod results;
mod text;
mod unpacked;
mod yaml;

pub use error::{FileError, taken};
pub use number_table::NumberTable;
pub use results::{Partial, Undo, check_apart, check_free, file_stem, private_folder, write_all, writing_unless};
pub use text::{Source, TextFileError, named_file, read_file, read_text};
pub use unpacked::most_unpacked;
pub use yaml::{YamlError, YamlNode, YamlValue, read_yaml};
