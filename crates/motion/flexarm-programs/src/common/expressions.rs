//! Expression parser for KRL, RAPID and URScript, which differ in their operators and aggregates.
//!
//! [`Parser`] also holds the tokens for the parsers of statements in the languages. Binary
//! operators are parsed by precedence: [`Parser::binary`] takes operators of a level and above, and
//! calls itself one level higher for the right side. Depth and length are limited, so that no text
//! exhausts the stack. Not here: statements (`parse.rs` of each language), values (`machine`).

use std::rc::Rc;

use super::lexer::{Lexeme, Token};
use super::tree::{Argument, Expr, Kind, Operator};
use super::value::Value;
use super::{Result, Span, fail};

/// Language of the expressions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Syntax {
    Krl,
    Rapid,
    UrScript,
}

/// Tokens of one file and the current position.
pub(crate) struct Parser {
    pub(crate) syntax: Syntax,
    pub(crate) lexemes: Vec<Lexeme>,
    pub(crate) at: usize,
    depth: usize,
}

/// Maximum nesting depth of expressions and blocks.
pub(crate) const DEEPEST: usize = 48;

/// Maximum number of consecutive operators.
const LONGEST: usize = 200;

impl Parser {
    pub(crate) fn new(syntax: Syntax, lexemes: Vec<Lexeme>) -> Self {
        Self { syntax, lexemes, at: 0, depth: 0 }
    }

    /// Next token; the last token of a file is a line end.
    pub(crate) fn peek(&self) -> &Token {
        &self.lexeme(0).token
    }

    /// Lexeme `ahead` tokens after the next one.
    pub(crate) fn lexeme(&self, ahead: usize) -> &Lexeme {
        &self.lexemes[(self.at + ahead).min(self.lexemes.len() - 1)]
    }

    pub(crate) fn span(&self) -> Span {
        self.lexeme(0).span
    }

    /// Span of the previous token.
    pub(crate) fn last_span(&self) -> Span {
        self.lexemes[self.at.saturating_sub(1).min(self.lexemes.len() - 1)].span
    }

    pub(crate) fn is_over(&self) -> bool {
        self.at + 1 >= self.lexemes.len()
    }

    pub(crate) fn advance(&mut self) -> Lexeme {
        let lexeme = self.lexeme(0).clone();
        self.at = (self.at + 1).min(self.lexemes.len() - 1);
        lexeme
    }

    pub(crate) fn is_symbol(&self, symbol: &str) -> bool {
        matches!(self.peek(), Token::Symbol(found) if *found == symbol)
    }

    pub(crate) fn is_symbol_ahead(&self, ahead: usize, symbol: &str) -> bool {
        matches!(&self.lexeme(ahead).token, Token::Symbol(found) if *found == symbol)
    }

    /// The next token if it is a name.
    pub(crate) fn word(&self) -> Option<Rc<str>> {
        self.word_ahead(0)
    }

    pub(crate) fn word_ahead(&self, ahead: usize) -> Option<Rc<str>> {
        match &self.lexeme(ahead).token {
            Token::Name(name) => Some(name.clone()),
            _ => None,
        }
    }

    pub(crate) fn is_word(&self, word: &str) -> bool {
        matches!(self.peek(), Token::Name(name) if &**name == word)
    }

    pub(crate) fn take_symbol(&mut self, symbol: &str) -> bool {
        let found = self.is_symbol(symbol);
        if found {
            self.advance();
        }
        found
    }

    pub(crate) fn take_word(&mut self, word: &str) -> bool {
        let found = self.is_word(word);
        if found {
            self.advance();
        }
        found
    }

    pub(crate) fn expect_symbol(&mut self, symbol: &str) -> Result<Span> {
        if self.is_symbol(symbol) {
            return Ok(self.advance().span);
        }
        fail(self.span(), format!("`{symbol}` is expected here, found {}", self.found()))
    }

    pub(crate) fn expect_word(&mut self, word: &str) -> Result<Span> {
        if self.is_word(word) {
            return Ok(self.advance().span);
        }
        fail(self.span(), format!("`{}` is expected here, found {}", word.to_uppercase(), self.found()))
    }

    pub(crate) fn expect_name(&mut self) -> Result<Rc<str>> {
        match self.word() {
            Some(name) => {
                self.advance();
                Ok(name)
            }
            None => fail(self.span(), format!("a name is expected here, found {}", self.found())),
        }
    }

    /// Description of the next token for messages.
    pub(crate) fn found(&self) -> String {
        match self.peek() {
            Token::Number(value, _) => format!("the number {value}"),
            Token::Name(name) => format!("`{name}`"),
            Token::Text(text) => format!("the text \"{text}\""),
            Token::Quoted(text) => format!("'{text}'"),
            Token::Symbol(symbol) => format!("`{symbol}`"),
            Token::Line if self.is_over() => "the end of the file".into(),
            Token::Line => "the end of the line".into(),
        }
    }

    /// Limits the nesting depth, so that no text can exhaust the stack.
    pub(crate) fn nested<T>(&mut self, inner: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if self.depth >= DEEPEST {
            return fail(
                self.span(),
                format!("more than {DEEPEST} brackets or blocks are inside of each other: write it flatter"),
            );
        }
        self.depth += 1;
        let result = inner(self);
        self.depth -= 1;
        result
    }

    /// Parses an expression.
    pub(crate) fn expression(&mut self) -> Result<Expr> {
        self.nested(|parser| parser.binary(0))
    }

    fn binary(&mut self, lowest: u8) -> Result<Expr> {
        let mut left = self.prefix()?;
        let mut length = 0;
        while let Some((operator, level)) = self.operator().filter(|(_, level)| *level >= lowest) {
            self.advance();
            length = self.longer(length)?;
            let right = self.nested(|parser| parser.binary(level + 1))?;
            let span = left.span.to(right.span);
            left = Expr { kind: Kind::Binary(operator, Box::new(left), Box::new(right)), span };
        }
        Ok(left)
    }

    /// Limits the length of a chain of operators, since its tree has the same depth.
    fn longer(&self, length: usize) -> Result<usize> {
        if length >= LONGEST {
            return fail(
                self.span(),
                format!("more than {LONGEST} operators follow each other: write the expression in parts"),
            );
        }
        Ok(length + 1)
    }

    /// Operator that comes next, with its precedence.
    fn operator(&self) -> Option<(Operator, u8)> {
        // Levels from 0 (binds least) to 9; 7 is the sign.
        use Operator::*;
        let (operator, level) = match self.peek() {
            Token::Symbol("+") => (Add, 5),
            Token::Symbol("-") => (Subtract, 5),
            Token::Symbol("*") => (Multiply, 6),
            Token::Symbol("/") => (Divide, 6),
            Token::Symbol("%") => (Remainder, 6),
            Token::Symbol("^") => (Power, 8),
            Token::Symbol(":") if self.syntax == Syntax::Krl => (Frame, 9),
            Token::Symbol("<") => (Less, 4),
            Token::Symbol("<=") => (LessEqual, 4),
            Token::Symbol(">") => (Greater, 4),
            Token::Symbol(">=") => (GreaterEqual, 4),
            Token::Symbol("==") => (Equal, 4),
            Token::Symbol("=") if self.syntax == Syntax::Rapid => (Equal, 4),
            Token::Symbol("<>" | "!=") => (Unequal, 4),
            Token::Name(name) => match &**name {
                "and" => (And, 2),
                "or" => (Or, 0),
                "xor" | "exor" => (Either, 1),
                "b_and" => (BitAnd, 5),
                "b_or" => (BitOr, 5),
                "b_exor" => (BitEither, 5),
                "div" if self.syntax == Syntax::Rapid => (WholeDivide, 6),
                "mod" if self.syntax == Syntax::Rapid => (Remainder, 6),
                _ => return None,
            },
            _ => return None,
        };
        Some((operator, level))
    }

    fn prefix(&mut self) -> Result<Expr> {
        let start = self.span();
        if self.take_symbol("-") {
            let inner = self.nested(|parser| parser.binary(7))?;
            let span = start.to(inner.span);
            let kind = match inner.kind {
                Kind::Literal(Value::Number(number)) => Kind::Literal(Value::Number(-number)),
                Kind::Literal(Value::Whole(whole)) => Kind::Literal(Value::Whole(whole.saturating_neg())),
                other => Kind::Negative(Box::new(Expr { kind: other, span: inner.span })),
            };
            return Ok(Expr { kind, span });
        }
        if self.take_symbol("+") {
            return self.nested(|parser| parser.binary(7));
        }
        if self.take_word("not") {
            let level = if self.syntax == Syntax::Krl { 7 } else { 3 };
            let inner = self.nested(|parser| parser.binary(level))?;
            return Ok(Expr { span: start.to(inner.span), kind: Kind::Not(Box::new(inner)) });
        }
        let primary = self.primary()?;
        self.postfix(primary)
    }

    fn primary(&mut self) -> Result<Expr> {
        let start = self.span();
        // A literal, something in brackets, or a name, which may be a call.
        let literal = |value, span| Ok(Expr { kind: Kind::Literal(value), span });
        match self.peek().clone() {
            Token::Number(value, whole) => {
                self.advance();
                let whole = whole && self.syntax == Syntax::Krl && value < 9e15;
                literal(if whole { Value::Whole(value as i64) } else { Value::Number(value) }, start)
            }
            Token::Text(text) => {
                self.advance();
                literal(Value::Text(text), start)
            }
            Token::Quoted(text) => {
                self.advance();
                literal(Value::Whole(quoted_number(&text, start)?), start)
            }
            Token::Symbol("(") => {
                self.advance();
                let inner = self.expression()?;
                let end = self.expect_symbol(")")?;
                Ok(Expr { kind: inner.kind, span: start.to(end) })
            }
            Token::Symbol("[") => {
                let list = self.list()?;
                Ok(Expr { kind: Kind::List(list), span: start.to(self.last_span()) })
            }
            Token::Symbol("{") if self.syntax == Syntax::Krl => self.record(),
            Token::Symbol("#") if self.syntax == Syntax::Krl => {
                self.advance();
                let name = self.expect_name()?;
                literal(Value::Word(name), start.to(self.last_span()))
            }
            Token::Name(name) => {
                self.advance();
                self.named(name, start)
            }
            _ => fail(start, format!("a value is expected here, found {}", self.found())),
        }
    }

    fn named(&mut self, name: Rc<str>, start: Span) -> Result<Expr> {
        let kind = match &*name {
            "true" | "True" => Kind::Literal(Value::Flag(true)),
            "false" | "False" => Kind::Literal(Value::Flag(false)),
            "p" if self.syntax == Syntax::UrScript && self.is_symbol("[") => Kind::Pose(self.list()?),
            _ if self.is_symbol("(") => Kind::Call(name, self.arguments()?),
            _ => Kind::Name(name),
        };
        Ok(Expr { kind, span: start.to(self.last_span()) })
    }

    fn postfix(&mut self, mut inner: Expr) -> Result<Expr> {
        let mut length = 0;
        loop {
            length = self.longer(length)?;
            let open = if self.syntax == Syntax::Rapid { "{" } else { "[" };
            if self.is_symbol(open) && !matches!(inner.kind, Kind::List(_) | Kind::Literal(_)) {
                self.advance();
                let close = if self.syntax == Syntax::Rapid { "}" } else { "]" };
                let indices = self.expressions(close)?;
                let span = inner.span.to(self.last_span());
                // In KRL empty brackets denote a whole array.
                inner = if indices.is_empty() {
                    Expr { span, ..inner }
                } else {
                    Expr { kind: Kind::Index(Box::new(inner), indices), span }
                };
            } else if self.is_symbol(".") && !matches!(inner.kind, Kind::Literal(_)) {
                self.advance();
                let name = self.expect_name()?;
                let span = inner.span.to(self.last_span());
                inner = Expr { kind: Kind::Field(Box::new(inner), name), span };
            } else {
                return Ok(inner);
            }
        }
    }

    /// Parses `[a, b, c]`.
    fn list(&mut self) -> Result<Vec<Expr>> {
        self.expect_symbol("[")?;
        self.expressions("]")
    }

    /// Parses `a, b, c]` to its closing symbol.
    pub(crate) fn expressions(&mut self, close: &str) -> Result<Vec<Expr>> {
        let mut elements = Vec::new();
        self.pass_lines();
        while !self.is_symbol(close) {
            elements.push(self.expression()?);
            self.pass_lines();
            if !self.take_symbol(",") {
                break;
            }
            self.pass_lines();
        }
        self.expect_symbol(close)?;
        Ok(elements)
    }

    /// Parses the labels `a, b` of a case.
    pub(crate) fn labels(&mut self) -> Result<Vec<Expr>> {
        let mut labels = vec![self.expression()?];
        while self.take_symbol(",") {
            labels.push(self.expression()?);
        }
        Ok(labels)
    }

    /// Skips to the next token of this kind.
    pub(crate) fn skip_to(&mut self, end: &Token) {
        while !self.is_over() && self.peek() != end {
            self.advance();
        }
    }

    /// Skips line ends within brackets, where URScript allows them.
    fn pass_lines(&mut self) {
        while self.syntax == Syntax::UrScript && !self.is_over() && *self.peek() == Token::Line {
            self.advance();
        }
    }

    /// Parses `{X 1, Y 2}` or `{E6POS: X 1, Y 2}`.
    fn record(&mut self) -> Result<Expr> {
        let start = self.expect_symbol("{")?;
        let mut kind: Rc<str> = "".into();
        if self.word().is_some() && self.is_symbol_ahead(1, ":") {
            kind = self.expect_name()?;
            self.advance();
        }
        let mut fields = Vec::new();
        while !self.is_symbol("}") {
            let name = self.expect_name()?;
            if self.take_symbol("[") {
                self.expect_symbol("]")?;
            }
            fields.push((name, self.expression()?));
            if !self.take_symbol(",") {
                break;
            }
        }
        let end = self.expect_symbol("}")?;
        Ok(Expr { kind: Kind::Record(kind, fields), span: start.to(end) })
    }

    /// Parses `(a, b)` with the variants of each language: omitted values in KRL, `\Name:=value` in
    /// RAPID, `name=value` in URScript.
    pub(crate) fn arguments(&mut self) -> Result<Vec<Argument>> {
        self.expect_symbol("(")?;
        let mut arguments = Vec::new();
        self.pass_lines();
        while !self.is_symbol(")") {
            if self.syntax == Syntax::Krl && self.is_symbol(",") {
                arguments.push(Argument { name: None, value: None, span: self.advance().span });
                continue;
            }
            arguments.push(self.argument()?);
            self.pass_lines();
            let more = self.take_symbol(",") || (self.syntax == Syntax::Rapid && self.is_symbol("\\"));
            if !more {
                break;
            }
            self.pass_lines();
        }
        self.expect_symbol(")")?;
        Ok(arguments)
    }

    pub(crate) fn argument(&mut self) -> Result<Argument> {
        let start = self.span();
        if self.syntax == Syntax::Rapid && self.take_symbol("\\") {
            let name = self.expect_name()?;
            let value = if self.take_symbol(":=") { Some(self.expression()?) } else { None };
            return Ok(Argument { name: Some(name), value, span: start.to(self.last_span()) });
        }
        if self.syntax == Syntax::UrScript && self.word().is_some() && self.is_symbol_ahead(1, "=") {
            let name = self.expect_name()?;
            self.advance();
            let value = Some(self.expression()?);
            return Ok(Argument { name: Some(name), value, span: start.to(self.last_span()) });
        }
        let value = self.expression()?;
        Ok(Argument { name: None, span: value.span, value: Some(value) })
    }
}

/// Parses KRL's `'HFF'` and `'B101'`.
fn quoted_number(text: &str, span: Span) -> Result<i64> {
    let digits = text.get(1..).unwrap_or_default();
    let number = match text.chars().next() {
        Some('h' | 'H') => i64::from_str_radix(digits, 16),
        Some('b' | 'B') => i64::from_str_radix(digits, 2),
        _ => text.parse(),
    };
    number.or_else(|_| fail(span, format!("'{text}' is not a number: 'H..' is hexadecimal, 'B..' is binary")))
}
