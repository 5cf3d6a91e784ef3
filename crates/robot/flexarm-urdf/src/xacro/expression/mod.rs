//! Expressions between `${` and `}`: those of Python, without access to anything outside the
//! document.
//!
//! Start at [`Interpreter::expression`]. The text is split into tokens, parsed to a tree by
//! precedence, and evaluated; values are printed like Python's `repr`, because this text is
//! inserted in the document. Integers have 128 bits; overflow is an error.

mod arithmetic;
mod evaluate;
mod functions;
mod methods;
mod parse;
mod token;
pub(crate) mod value;

pub(crate) use functions::is_built_in;
pub(crate) use methods::unique;
pub(crate) use parse::KEYWORDS;
use value::Value;

use super::Interpreter;
use super::scope::Scope;

/// An error in an expression; the place is added where the element is known.
#[derive(Debug)]
pub(crate) struct ExpressionError {
    pub(crate) message: String,
    pub(crate) help: String,
}

impl ExpressionError {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), help: String::new() }
    }

    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = help.into();
        self
    }

    /// Prefixes the message with its context.
    pub(crate) fn within(mut self, what: impl AsRef<str>) -> Self {
        self.message = format!("{}: {}", what.as_ref(), self.message);
        self
    }
}

/// Charges memory before it is allocated, and fails at the limit of a document.
type Charge<'c> = dyn FnMut(usize) -> Result<(), ExpressionError> + 'c;

impl Interpreter<'_> {
    /// Evaluates the text of an expression.
    pub(crate) fn expression(&mut self, text: &str, scope: &Scope) -> Result<Value, ExpressionError> {
        self.charge(8 * text.len())?;
        let value = parse::parse(text).and_then(|tree| self.evaluate(&tree, scope));
        value.map_err(|trouble| trouble.within(format!("${{{}}}", shortened(text))))
    }
}

/// Beginning of a text, for messages.
pub(crate) fn shortened(text: &str) -> String {
    let text = text.trim();
    match text.char_indices().nth(80) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
