//! Readers of robot programs as used on controllers: KUKA KRL, ABB RAPID, URScript and G-code.
//!
//! ```
//! use flexarm_path::program::{Item, MoveKind};
//! use flexarm_programs::{Language, ReadOptions, read_program, recognise};
//!
//! let text = b"DEF square()\n\
//!     $VEL.CP = 0.25\n\
//!     PTP {A1 0, A2 -90, A3 90, A4 0, A5 45, A6 0}\n\
//!     LIN {X 1500, Y 0, Z 1200, A 0, B 90, C 0}\n\
//!     LIN {Y 100}\n\
//!     END\n";
//! assert_eq!(recognise(text, "square.src"), Some(Language::Krl));
//!
//! let program = read_program("square.src".as_ref(), text, &ReadOptions::default())?;
//! let Item::Move(last) = &program.items[2] else { panic!() };
//! assert_eq!((last.place.to_string().as_str(), last.statement.as_str()), ("square.src:5:1", "LIN {Y 100}"));
//! assert!(matches!(last.kind, MoveKind::Line));
//! assert_eq!(last.speed.linear_m_s, Some(0.25));
//! # Ok::<(), flexarm_programs::ProgramError>(())
//! ```
//!
//! A reader executes the program: variables are computed, loops counted, routines called. A
//! statement that cannot affect the motion is skipped with a note; one that could and is not
//! supported is an error with file, line, column and statement. Units are converted here.
//!
//! Modules: one per language, and `common` with expressions, statements and the interpreter.
//!
//! Not here: planning of the moves ([`flexarm_path`]), and the robot that runs them.
#![allow(non_snake_case, reason = "monogram notation: X_WB, X_FT, R_BT; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

mod common;
mod gcode;
mod krl;
mod options;
mod rapid;
mod recognise;
mod rewrite;
mod urscript;

use std::path::{Path, PathBuf};

use flexarm_files::{Source, TextFileError};
use flexarm_path::program::Program;

use common::recorder::Recorded;
use common::{Fail, Text};
pub use options::{ForwardKinematics, GCodeOptions, Language, ReadOptions, Rotary};
pub use recognise::recognise;
pub use rewrite::{NewTarget, ProgramText, Rewritten, read_program_text};

/// Error of reading a robot program.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProgramError {
    /// No language was recognised.
    #[error("{}: this is not a readable robot program: KUKA KRL, ABB RAPID, URScript and G-code are read; if it is one of them, name it (`language`)", path.display())]
    Unknown {
        /// The file.
        path: PathBuf,
    },
    /// A statement cannot be read, or its effect is unknown.
    #[error(transparent)]
    Statement(#[from] TextFileError),
    /// The program ends without a move.
    #[error("{}: the program ({language}) runs through without a move: {hint}", path.display())]
    NoMoves {
        /// The file.
        path: PathBuf,
        /// Language as which the file was read.
        language: &'static str,
        /// Possible reason.
        hint: &'static str,
    },
}

/// Reads the moves of a robot program.
///
/// * `path`: path of the file, for messages and for finding companion files
///   ([`ReadOptions::find_companions`]).
/// * `bytes`: content of the file, UTF-8 or Latin-1.
///
/// Angles of the result are in rad and lengths in m, regardless of the language.
///
/// # Errors
/// [`ProgramError::Unknown`] if no language is recognised; [`ProgramError::Statement`] at the first
/// statement that cannot be read, that depends on a value known only to the controller, or whose
/// effect on the motion is unknown; [`ProgramError::NoMoves`] if nothing moves.
pub fn read_program(path: &Path, bytes: &[u8], options: &ReadOptions<'_>) -> Result<Program, ProgramError> {
    read_recorded(path, bytes, options).map(|(recorded, ..)| recorded.program)
}

/// Reads a program with its language, its texts and the places of its targets.
fn read_recorded(
    path: &Path,
    bytes: &[u8],
    options: &ReadOptions<'_>,
) -> Result<(Recorded, Language, Vec<Text>), ProgramError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let Some(language) = options.language.or_else(|| recognise(bytes, &name)) else {
        return Err(ProgramError::Unknown { path: path.to_owned() });
    };
    // The reader may add further files to the texts.
    let mut texts = vec![Text::new(path, &decode(bytes))];
    let read = match language {
        Language::Krl => krl::read(&mut texts, options),
        Language::Rapid => rapid::read(&mut texts, options),
        Language::UrScript => urscript::read(&mut texts, options),
        Language::GCode => gcode::read(&mut texts, options),
    };
    let recorded = read.map_err(|fail| ProgramError::Statement(place(&texts, &fail)))?;
    if recorded.program.items.is_empty() {
        let hint = match language {
            Language::Krl => {
                "is this the data list (.dat) instead of the program (.src), or is another routine meant (`entry`)?"
            }
            Language::Rapid => "is another routine than `main` meant (`entry`)?",
            Language::UrScript => "is another routine meant (`entry`)?",
            Language::GCode => "it has no G0 to G3 with a coordinate",
        };
        return Err(ProgramError::NoMoves { path: path.to_owned(), language: language.name(), hint });
    }
    Ok((recorded, language, texts))
}

/// Converts an error to one with place and excerpt for the user.
fn place(texts: &[Text], fail: &Fail) -> TextFileError {
    let text = &texts[fail.span.file];
    let excerpt = text.excerpt(fail.span);
    let message = if excerpt.is_empty() { fail.message.clone() } else { format!("`{excerpt}`: {}", fail.message) };
    Source::new(&text.path, &text.text, "program").error(fail.span.start..fail.span.end, message)
}

/// Decodes UTF-8, otherwise Latin-1, in which every byte is valid; line ends are kept.
pub(crate) fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.trim_start_matches('\u{feff}').to_owned(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}

/// Text of assignments from the given values; each line is one entry.
pub(crate) fn given_text(options: &ReadOptions<'_>, assign: &str, end: &str) -> Text {
    let lines = options.given.iter().map(|(name, value)| format!("{name}{assign}{value}{end}\n"));
    Text::new(Path::new("given"), &lines.collect::<String>())
}
