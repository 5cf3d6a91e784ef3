//! Decodes the bytes of a message by its definition: CDR of either byte order as in ROS 2, and the
//! serialisation of ROS 1.
//!
//! CDR begins with a four-byte header whose second byte gives the byte order; numbers are aligned
//! to their size, counted from the end of the header. ROS 1 has packed little-endian numbers.

use std::rc::Rc;

use crate::definition::{Definitions, Field, Kind, Many};
use crate::value::{Node, Value};

/// Maximum nesting depth of structs.
const MAX_NESTED: usize = 16;
/// Values of bytes have no line and column.
const BYTES: [u32; 2] = [0; 2];

/// Serialisation format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Cdr,
    Ros1,
}

/// Decodes the tree of a message. Errors say why it does not follow its definition, as the end of
/// a sentence.
pub(crate) fn decode(message: &[u8], encoding: Encoding, definitions: &Definitions) -> Result<Node, String> {
    let mut bytes = match encoding {
        Encoding::Ros1 => Bytes { body: message, at: 0, align_to: 1, big: false, has_nul: false },
        Encoding::Cdr => {
            let (big, align_to) = match message {
                [0, 0, _, _, ..] => (true, 8),
                [0, 1, _, _, ..] => (false, 8),
                // Version 2 of CDR aligns to at most four bytes.
                [0, 6, _, _, ..] => (true, 4),
                [0, 7, _, _, ..] => (false, 4),
                [first, second, _, _, ..] => {
                    let read = "read are plain CDR and CDR 2 of either byte order";
                    return Err(format!("its encapsulation is {first:#04x} {second:#04x}; {read}"));
                }
                _ => return Err(format!("it has {} bytes, fewer than the head of a message", message.len())),
            };
            Bytes { body: &message[4..], at: 0, align_to, big, has_nul: true }
        }
    };
    bytes.structure(definitions, &definitions.root, 0)
}

struct Bytes<'m> {
    body: &'m [u8],
    at: usize,
    align_to: usize,
    big: bool,
    has_nul: bool,
}

impl Bytes<'_> {
    fn structure(&mut self, definitions: &Definitions, name: &str, depth: usize) -> Result<Node, String> {
        if depth > MAX_NESTED {
            return Err(format!("its definition is nested more than {MAX_NESTED} deep"));
        }
        let fields = definitions.fields(name).ok_or_else(|| format!("the definition of {name} is missing"))?;
        let mut pairs = Vec::with_capacity(fields.len());
        for field in fields {
            pairs.push((field.name.clone(), self.field(definitions, field, depth)?));
        }
        Ok(Node::new(Value::Map(pairs), BYTES))
    }

    /// Reads a field: one value, a fixed number, or a sequence.
    fn field(&mut self, definitions: &Definitions, field: &Field, depth: usize) -> Result<Node, String> {
        let cut = || format!("it ends within `{}`", field.name);
        let count = match field.many {
            Many::One => return self.value(definitions, field, depth),
            Many::Fixed(count) => count,
            Many::Sequence => self.u32().ok_or_else(cut)? as usize,
        };
        // Every value has at least one byte, except structs without fields.
        if count > self.body.len().saturating_sub(self.at) {
            let name = &field.name;
            return Err(format!("the length of `{name}` is given as {count}, which exceeds the size of the message"));
        }
        if matches!(field.kind, Kind::Text | Kind::Struct(_) | Kind::Time | Kind::Duration | Kind::Other(_)) {
            let items = (0..count).map(|_| self.value(definitions, field, depth)).collect::<Result<_, _>>()?;
            return Ok(Node::new(Value::List(items), BYTES));
        }
        let numbers: Option<Vec<f64>> = (0..count).map(|_| self.number(&field.kind)).collect();
        Ok(Node::new(Value::Numbers(numbers.ok_or_else(cut)?), BYTES))
    }

    /// Reads one value.
    fn value(&mut self, definitions: &Definitions, field: &Field, depth: usize) -> Result<Node, String> {
        let cut = || format!("it ends within `{}`", field.name);
        let value = match &field.kind {
            Kind::Struct(name) => return self.structure(definitions, name, depth + 1),
            Kind::Text => Value::Text(self.text().ok_or_else(cut)?),
            Kind::Other(kind) => return Err(format!("`{}` is of the kind {kind}, which is not read", field.name)),
            Kind::Time => {
                let (sec, nanosec) = (self.u32().ok_or_else(cut)?, self.u32().ok_or_else(cut)?);
                return Ok(time(i64::from(sec), i64::from(nanosec)));
            }
            Kind::Duration => {
                let (sec, nanosec) = (self.u32().ok_or_else(cut)?, self.u32().ok_or_else(cut)?);
                // Both are signed.
                return Ok(time(i64::from(sec.cast_signed()), i64::from(nanosec.cast_signed())));
            }
            Kind::F32 | Kind::F64 => Value::Number(self.number(&field.kind).ok_or_else(cut)?),
            kind => Value::Whole(self.whole(kind).ok_or_else(cut)?),
        };
        Ok(Node::new(value, BYTES))
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let start = self.at.checked_next_multiple_of(N.min(self.align_to))?;
        let end = start.checked_add(N)?;
        let mut bytes: [u8; N] = self.body.get(start..end)?.try_into().ok()?;
        self.at = end;
        if self.big {
            bytes.reverse();
        }
        Some(bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn number(&mut self, kind: &Kind) -> Option<f64> {
        match kind {
            Kind::F64 => self.take().map(f64::from_le_bytes),
            Kind::F32 => self.take().map(|bytes| f64::from(f32::from_le_bytes(bytes))),
            kind => self.whole(kind).map(|whole| whole as f64),
        }
    }

    fn whole(&mut self, kind: &Kind) -> Option<i64> {
        match kind {
            Kind::Bool | Kind::U8 => self.take::<1>().map(|[byte]| i64::from(byte)),
            Kind::I8 => self.take().map(|bytes| i64::from(i8::from_le_bytes(bytes))),
            Kind::U16 => self.take().map(|bytes| i64::from(u16::from_le_bytes(bytes))),
            Kind::I16 => self.take().map(|bytes| i64::from(i16::from_le_bytes(bytes))),
            Kind::U32 => self.take().map(|bytes| i64::from(u32::from_le_bytes(bytes))),
            Kind::I32 => self.take().map(|bytes| i64::from(i32::from_le_bytes(bytes))),
            Kind::U64 => self.take().map(|bytes| i64::try_from(u64::from_le_bytes(bytes)).unwrap_or(i64::MAX)),
            Kind::I64 => self.take().map(i64::from_le_bytes),
            _ => None,
        }
    }

    fn text(&mut self) -> Option<Rc<str>> {
        let length = self.u32()? as usize;
        let end = self.at.checked_add(length)?;
        let mut bytes = self.body.get(self.at..end)?;
        self.at = end;
        if self.has_nul {
            bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        }
        Some(String::from_utf8_lossy(bytes).into())
    }
}

fn time(sec: i64, nanosec: i64) -> Node {
    let pair = |key: &str, value| (Rc::from(key), Node::new(Value::Whole(value), BYTES));
    Node::new(Value::Map(vec![pair("sec", sec), pair("nanosec", nanosec)]), BYTES)
}
