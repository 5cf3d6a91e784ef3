//! Text that contains `${expressions}` and `$(substitutions)`.
//!
//! Start at `Interpreter::text`: a text of one expression keeps its type, a mixed one is joined.
//! Not here: the value of an expression (`expression`), `$(find ...)` and `$(arg ...)`
//! (`substitution.rs`).

use super::Interpreter;
use super::expression::value::Value;
use super::expression::{ExpressionError, shortened};
use super::scope::Scope;

/// Piece of a text.
#[derive(Debug, PartialEq)]
enum Piece<'t> {
    Plain(&'t str),
    /// Between `${` and `}`.
    Expression(&'t str),
    /// Between `$(` and `)`.
    Substitution(&'t str),
}

/// Splits a text: an expression ends at the first `}`, a substitution at the first `)`; `$${`
/// escapes `${`.
fn pieces(text: &str) -> Result<Vec<Piece<'_>>, ExpressionError> {
    let mut found = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let dollars = rest.len() - rest.trim_start_matches('$').len();
        let opens = rest[dollars..].starts_with(['{', '(']);
        let end = if dollars > 1 && opens {
            found.push(Piece::Plain(&rest[1..=dollars]));
            dollars + 1
        } else if dollars == 1 && opens {
            let (open, close) = if rest.starts_with("${") { ('{', '}') } else { ('(', ')') };
            let end = rest.find(close).ok_or_else(|| {
                let message = format!("{:?} has no closing {close:?}", shortened(rest));
                ExpressionError::new(message).help(format!("close it, or write $${open} for ${open} itself"))
            })?;
            let inner = &rest[2..end];
            found.push(if open == '{' { Piece::Expression(inner) } else { Piece::Substitution(inner) });
            end + 1
        } else {
            // Other dollar signs are plain text, up to the next one.
            let end = rest[dollars..].find('$').map_or(rest.len(), |at| at + dollars);
            found.push(Piece::Plain(&rest[..end]));
            end
        };
        rest = &rest[end..];
    }
    Ok(found)
}

impl Interpreter<'_> {
    /// Value of a text: that of its only piece, or all pieces concatenated.
    pub(crate) fn text(&mut self, text: &str, scope: &Scope) -> Result<Value, ExpressionError> {
        self.charge(text.len())?;
        if !text.contains('$') {
            return Ok(Value::text(text));
        }
        let pieces = pieces(text)?;
        if let [piece] = &pieces[..] {
            return self.piece(piece, scope);
        }
        let mut joined = String::new();
        for piece in &pieces {
            let shown = match self.piece(piece, scope)? {
                Value::Block(_) => return Err(ExpressionError::new("a block of XML cannot be part of a text")),
                value => self.shown(&value)?,
            };
            self.charge(shown.len())?;
            joined.push_str(&shown);
        }
        Ok(Value::text(joined))
    }

    fn piece(&mut self, piece: &Piece<'_>, scope: &Scope) -> Result<Value, ExpressionError> {
        match piece {
            Piece::Plain(text) => Ok(Value::text(text)),
            // The inner text may contain pieces itself.
            Piece::Expression(inner) => {
                let inner = self.inner(inner, scope)?;
                self.expression(&inner, scope)
            }
            Piece::Substitution(inner) => {
                let inner = self.inner(inner, scope)?;
                self.substitution(&inner).map(Value::text)
            }
        }
    }

    /// Value of a text, converted to text.
    pub(crate) fn shown_text(&mut self, text: &str, scope: &Scope) -> Result<String, ExpressionError> {
        let value = self.text(text, scope)?;
        self.shown(&value)
    }

    fn inner(&mut self, text: &str, scope: &Scope) -> Result<String, ExpressionError> {
        self.deeper()?;
        let shown = self.shown_text(text, scope)?;
        self.depth -= 1;
        Ok(shown)
    }
}
