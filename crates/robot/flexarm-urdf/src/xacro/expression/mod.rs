//! Expressions between `${` and `}`: Python's, without anything that could leave the document.
//!
//! Start at [`Interpreter::expression`]. Tokens, a tree by precedence, then values; what a value
//! prints as is Python's `repr`, because that is what ends up in the document. Whole numbers have
//! 128 bits; passing that is an error.

mod arithmetic;
mod evaluate;
mod functions;
mod methods;
mod parse;
mod token;
pub(crate) mod value;

pub(crate) use evaluate::unique;
pub(crate) use functions::is_built_in;
pub(crate) use parse::KEYWORDS;
use value::Value;

use super::Interpreter;
use super::scope::Scope;

/// What is wrong in an expression; the place is added where the element is known.
#[derive(Debug)]
pub(crate) struct Trouble {
    pub(crate) message: String,
    pub(crate) help: String,
}

impl Trouble {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), help: String::new() }
    }

    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = help.into();
        self
    }

    /// Says what was looked at when it happened.
    pub(crate) fn within(mut self, what: impl AsRef<str>) -> Self {
        self.message = format!("{}: {}", what.as_ref(), self.message);
        self
    }
}

impl Interpreter<'_> {
    /// The value of the text of an expression.
    pub(crate) fn expression(&mut self, text: &str, scope: &Scope) -> Result<Value, Trouble> {
        self.charge(8 * text.len())?;
        let value = parse::parse(text).and_then(|tree| self.evaluate(&tree, scope));
        value.map_err(|trouble| trouble.within(format!("${{{}}}", shortened(text))))
    }
}

/// The beginning of a text, for messages.
pub(crate) fn shortened(text: &str) -> String {
    let text = text.trim();
    match text.char_indices().nth(80) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
