//! TOML document in which every value has a position, so that errors can point to it.
//!
//! Start at [`Document::root`]; [`Table`] and [`Node`] check keys, types and sizes.
//!
//! Not here: the keys of a link file (`read`, `details`).

use std::ops::Range;

use nalgebra::Vector3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{FlexErrorKind, FlexFileError};
use crate::error::FemError;

/// The text and its name in messages.
pub(super) struct Document<'d> {
    pub(super) text: &'d str,
    pub(super) origin: &'d str,
}

/// Table with its path from the root.
pub(super) struct Table<'d, 't> {
    document: &'d Document<'d>,
    path: String,
    span: Range<usize>,
    map: &'d DeTable<'t>,
}

/// Value with its path from the root.
pub(super) struct Node<'d, 't> {
    document: &'d Document<'d>,
    pub(super) path: String,
    value: &'d Spanned<DeValue<'t>>,
}

impl<'d> Document<'d> {
    /// Creates an error at a byte range of the text.
    pub(super) fn fail(
        &self,
        at: Range<usize>,
        element: &str,
        kind: FlexErrorKind,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
        help: impl Into<Box<str>>,
    ) -> FlexFileError {
        let (line, column) = line_and_column(self.text, at.start);
        FlexFileError {
            kind,
            origin: self.origin.into(),
            line,
            column,
            element: element.into(),
            found: found.into(),
            expected: expected.into(),
            help: help.into(),
            source: None,
        }
    }

    pub(super) fn root<'t>(&'d self, parsed: &'d Spanned<DeTable<'t>>) -> Table<'d, 't> {
        Table { document: self, path: String::new(), span: 0..0, map: parsed.get_ref() }
    }
}

/// Line and column (in characters) of a byte offset, both from 1.
fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let mut end = offset.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = &text[..end];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = before.matches('\n').count() + 1;
    (line, before[line_start..].chars().count() + 1)
}

impl<'d, 't> Table<'d, 't> {
    fn element(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// Returns the value of an optional key.
    pub(super) fn get(&self, key: &str) -> Option<Node<'d, 't>> {
        let value = self.map.get(key)?;
        Some(Node { document: self.document, path: self.element(key), value })
    }

    /// Returns the value of a required key.
    pub(super) fn require(&self, key: &str, help: &str) -> Result<Node<'d, 't>, FlexFileError> {
        self.get(key).ok_or_else(|| {
            let expected = format!("the key {key:?}");
            self.fail(key, FlexErrorKind::MissingKey, "nothing", expected, help)
        })
    }

    /// Rejects every key that is not in `known`.
    pub(super) fn only(&self, known: &[&str]) -> Result<(), FlexFileError> {
        let is_unknown = |key: &&Spanned<_>| {
            let key: &std::borrow::Cow<'_, str> = key.get_ref();
            !known.contains(&key.as_ref())
        };
        let Some(key) = self.map.keys().find(is_unknown) else { return Ok(()) };
        let name = key.get_ref();
        Err(self.document.fail(
            key.span(),
            &self.element(name),
            FlexErrorKind::UnknownKey,
            format!("the key {name:?}"),
            format!("one of {}", known.join(", ")),
            "correct the spelling or remove it; notes belong into comments or [provenance]",
        ))
    }

    /// Creates an error about a key, at the head of this table.
    pub(super) fn fail(
        &self,
        key: &str,
        kind: FlexErrorKind,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
        help: impl Into<Box<str>>,
    ) -> FlexFileError {
        let element = self.element(key);
        self.document.fail(self.span.clone(), &element, kind, found, expected, help)
    }
}

impl<'d, 't> Node<'d, 't> {
    /// Creates an error at this value.
    pub(super) fn fail(
        &self,
        kind: FlexErrorKind,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
        help: impl Into<Box<str>>,
    ) -> FlexFileError {
        self.document.fail(self.value.span(), &self.path, kind, found, expected, help)
    }

    /// Creates an error for a well-formed element that is invalid in a link.
    pub(super) fn refused(&self, cause: FemError, expected: &str) -> FlexFileError {
        let error = self.fail(FlexErrorKind::Link, cause.to_string(), expected, "");
        FlexFileError { source: Some(Box::new(cause)), ..error }
    }

    fn wrong_type(&self, expected: &str) -> FlexFileError {
        let found = match self.value.get_ref() {
            DeValue::String(text) => format!("the text {:?}", text.as_ref()),
            DeValue::Boolean(value) => value.to_string(),
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.to_string(),
            other => format!("a value of type {}", other.type_str()),
        };
        self.fail(FlexErrorKind::WrongType, found, expected, "")
    }

    pub(super) fn text(&self) -> Result<&'d str, FlexFileError> {
        self.value.get_ref().as_str().ok_or_else(|| self.wrong_type("text in quotes"))
    }

    /// Returns the text if it is one of `known`.
    pub(super) fn word(&self, known: &[&str], help: &str) -> Result<&'d str, FlexFileError> {
        let text = self.text()?;
        if known.contains(&text) {
            return Ok(text);
        }
        let known: Vec<_> = known.iter().map(|word| format!("{word:?}")).collect();
        Err(self.fail(FlexErrorKind::Word, format!("{text:?}"), known.join(" or "), help))
    }

    pub(super) fn integer(&self) -> Result<i64, FlexFileError> {
        match self.value.get_ref() {
            DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix()).ok(),
            _ => None,
        }
        .ok_or_else(|| self.wrong_type("a whole number"))
    }

    /// Returns a finite number; integers are accepted as well.
    pub(super) fn number(&self) -> Result<f64, FlexFileError> {
        let written = match self.value.get_ref() {
            DeValue::Float(number) => number.as_str(),
            DeValue::Integer(number) if number.radix() == 10 => number.as_str(),
            _ => return Err(self.wrong_type("a decimal number")),
        };
        match written.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.fail(
                FlexErrorKind::NotFinite,
                written,
                "a finite number",
                "NaN and infinity in a matrix mean that the program that wrote it failed",
            )),
        }
    }

    /// Returns the entries of an array of exactly `length` values.
    pub(super) fn items(&self, length: usize, what: &str) -> Result<Vec<Self>, FlexFileError> {
        let items = self.list()?;
        if items.len() == length {
            return Ok(items);
        }
        let (found, expected) = (format!("{} entries", items.len()), format!("{length} {what}"));
        Err(self.fail(FlexErrorKind::WrongSize, found, expected, "is the file cut off?"))
    }

    /// Returns the entries of an array of any length.
    pub(super) fn list(&self) -> Result<Vec<Self>, FlexFileError> {
        let array = self.value.get_ref().as_array().ok_or_else(|| self.wrong_type("an array"))?;
        let node = |(i, value)| Node { document: self.document, path: format!("{}[{i}]", self.path), value };
        Ok(array.iter().enumerate().map(node).collect())
    }

    /// Returns an array of exactly N numbers.
    pub(super) fn numbers<const N: usize>(&self, what: &str) -> Result<[f64; N], FlexFileError> {
        let mut result = [0.0; N];
        for (slot, item) in result.iter_mut().zip(self.items(N, what)?) {
            *slot = item.number()?;
        }
        Ok(result)
    }

    pub(super) fn vector(&self) -> Result<Vector3<f64>, FlexFileError> {
        self.numbers::<3>("numbers: x, y, z").map(Vector3::from)
    }

    pub(super) fn table(&self) -> Result<Table<'d, 't>, FlexFileError> {
        let map = self.value.get_ref().as_table().ok_or_else(|| self.wrong_type("a table"))?;
        let (path, span) = (self.path.clone(), self.value.span());
        Ok(Table { document: self.document, path, span, map })
    }
}
