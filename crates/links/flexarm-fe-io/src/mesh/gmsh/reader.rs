//! Reads the numbers of a Gmsh file in order, as text or in binary of either byte order.
//!
//! Start at [`Reader::int`], [`Reader::size`] and [`Reader::real`], which have the C types of the
//! format. Not here: the order of the numbers ([`super::msh2`], [`super::msh4`]).

use crate::FeFileError;
use crate::mesh::source::Source;
use crate::number::{real, shown, unsigned};

/// Encoding of numbers.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Layout {
    /// Words separated by blanks.
    Ascii,
    /// Binary; `size` is the size of `size_t` in Gmsh, 4 or 8 bytes.
    Binary {
        /// Whether the most significant byte is first.
        big_endian: bool,
        /// Size of `size_t`, bytes.
        size: usize,
    },
}

/// Position in the file that advances with every number.
pub(super) struct Reader<'a> {
    pub(super) src: Source<'a>,
    pub(super) pos: usize,
    pub(super) layout: Layout,
}

impl<'a> Reader<'a> {
    /// Number of remaining bytes.
    pub(super) fn left(&self) -> usize {
        self.src.bytes.len() - self.pos
    }

    /// Reads the next word of text.
    pub(super) fn word(&mut self, what: &str) -> Result<&'a [u8], FeFileError> {
        self.skip_blanks();
        let rest = &self.src.bytes[self.pos..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.ended(what));
        }
        self.pos += length;
        Ok(&rest[..length])
    }

    pub(super) fn skip_blanks(&mut self) {
        let rest = &self.src.bytes[self.pos..];
        self.pos += rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(rest.len());
    }

    /// Returns the rest of the line without its end, and moves past it.
    pub(super) fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = &self.src.bytes[self.pos..];
        let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        self.pos += (length + 1).min(rest.len());
        rest[..length].trim_ascii()
    }

    /// Reads a signed integer, C `int`.
    pub(super) fn int(&mut self, what: &str) -> Result<i64, FeFileError> {
        match self.layout {
            Layout::Ascii => {
                let at = self.pos;
                let word = self.word(what)?;
                let (digits, sign) = word.strip_prefix(b"-").map_or((word, 1), |digits| (digits, -1));
                let value = unsigned(digits).and_then(|value| i64::try_from(value).ok());
                value.map(|value| sign * value).ok_or_else(|| self.wrong(at, what, word, "an integer"))
            }
            Layout::Binary { .. } => Ok(i64::from(i32::from_le_bytes(self.bytes(what)?))),
        }
    }

    /// Reads an unsigned integer, C `size_t`.
    pub(super) fn size(&mut self, what: &str) -> Result<u64, FeFileError> {
        match self.layout {
            Layout::Ascii => {
                let at = self.pos;
                let word = self.word(what)?;
                unsigned(word).ok_or_else(|| self.wrong(at, what, word, "an integer, not negative"))
            }
            Layout::Binary { size: 4, .. } => Ok(u64::from(u32::from_le_bytes(self.bytes(what)?))),
            Layout::Binary { .. } => Ok(u64::from_le_bytes(self.bytes(what)?)),
        }
    }

    /// Reads the number of a node or an element in MSH 2, an `int`.
    pub(super) fn id(&mut self, what: &str) -> Result<u64, FeFileError> {
        let at = self.pos;
        let value = self.int(what)?;
        let wrong = || self.wrong(at, what, value.to_string().as_bytes(), "no negative number");
        u64::try_from(value).ok().ok_or_else(wrong)
    }

    /// Reads a real number, C `double`.
    pub(super) fn real(&mut self, what: &str) -> Result<f64, FeFileError> {
        match self.layout {
            Layout::Ascii => {
                let at = self.pos;
                let word = self.word(what)?;
                std::str::from_utf8(word).ok().and_then(real).ok_or_else(|| self.wrong(at, what, word, "a number"))
            }
            Layout::Binary { .. } => Ok(f64::from_le_bytes(self.bytes(what)?)),
        }
    }

    /// Checks a count of items that have at least `parts` integers, sizes and reals each.
    ///
    /// A count that is too large for the rest of the file is rejected before anything is allocated.
    pub(super) fn checked(&self, count: u64, what: &str, parts: [usize; 3]) -> Result<usize, FeFileError> {
        let [ints, sizes, reals] = parts;
        let each = match self.layout {
            Layout::Ascii => 2 * (ints + sizes + reals),
            Layout::Binary { size, .. } => 4 * ints + size * sizes + 8 * reals,
        };
        let fits = self.left().saturating_add(1) / each.max(1);
        match usize::try_from(count) {
            Ok(count) if count <= fits => Ok(count),
            _ => {
                let found = format!("a count of {count}");
                let expected = format!("at most {fits}, for which the file has bytes");
                Err(self.src.error(self.pos, what, found, expected).help("was the file cut off?"))
            }
        }
    }

    /// Reads the word `$End<section>`.
    pub(super) fn end_of(&mut self, section: &str) -> Result<(), FeFileError> {
        let expected = format!("$End{section}");
        self.skip_blanks();
        let at = self.pos;
        let word = self.word(&expected)?;
        if word == expected.as_bytes() {
            return Ok(());
        }
        Err(self.src.error(at, format!("end of ${section}"), shown(word), expected))
    }

    /// Reads the bytes of a number, the least significant one first.
    fn bytes<const N: usize>(&mut self, what: &str) -> Result<[u8; N], FeFileError> {
        let mut bytes = *self.src.bytes[self.pos..].first_chunk::<N>().ok_or_else(|| self.ended(what))?;
        self.pos += N;
        if matches!(self.layout, Layout::Binary { big_endian: true, .. }) {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn ended(&self, what: &str) -> FeFileError {
        let at = self.src.bytes.len();
        self.src.error(at, what, "the end of the file", "more data").help("was the file cut off?")
    }

    fn wrong(&self, from: usize, what: &str, word: &[u8], expected: &str) -> FeFileError {
        // Position of the word itself, not of the blanks before it.
        let blanks = self.src.bytes[from..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        self.src.error(from + blanks, what, shown(word), expected)
    }
}
