#![doc = include_str!("format.md")]

mod details;
mod document;
mod error;
mod frames;
mod modal;
mod read;
mod rigid_part;
mod text;
mod units;
mod write;

pub use error::{FlexErrorKind, FlexFileError};
pub use read::{parse_flex, parse_flex_bytes, parse_flex_with, read_flex};
pub use write::write_flex;

/// Value of the key `format`.
pub const FORMAT: &str = "flexarm-reduced-link";
/// Format version that this program reads and writes.
pub const VERSION: i64 = 1;
/// Required order of the components.
pub const ORDER: &str = "ux uy uz rx ry rz";
