#![doc = include_str!("format.md")]

mod details;
mod document;
mod error;
mod frames;
mod modal;
mod read;
mod units;
mod write;

pub use error::{FlexErrorKind, FlexFileError};
pub use read::{parse_flex, parse_flex_bytes, parse_flex_with, read_flex};
pub use write::write_flex;

/// Value of `format` in every file.
pub const FORMAT: &str = "flexarm-reduced-link";
/// The version that this program reads and writes.
pub const VERSION: i64 = 1;
/// The only order of components.
pub const ORDER: &str = "ux uy uz rx ry rz";
