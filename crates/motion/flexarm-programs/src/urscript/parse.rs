//! Parser of URScript text. An unsupported statement is an error only where it is reached.
//!
//! Start at [`parse`], which gives the routines and the main statements of one file as a [`Unit`].
//! Blocks begin with a colon and end with `end`. Not here: expressions
//! ([`crate::common::expressions`]).

use std::rc::Rc;

use crate::common::expressions::{Parser, Syntax};
use crate::common::lexer::{Spelling, Token, tokens};
use crate::common::tree::{Action, Expr, Kind, Parameter, Routine, Statement};
use crate::common::value::Value;
use crate::common::{Fail, Result, Span, Text, fail, without_lines};

const SPELLING: Spelling = Spelling {
    comment: '#',
    lines: true,
    folds_case: false,
    symbols: &[
        "==", "!=", "<=", ">=", "<", ">", "=", "+", "-", "*", "/", "%", "^", "(", ")", "[", "]", "{", "}", ",", ":",
        ".", ";",
    ],
    apostrophes: false,
    doubled_quotes: false,
};

/// One file.
#[derive(Default)]
pub(super) struct Unit {
    /// Definitions with their nesting depth.
    pub(super) routines: Vec<(Routine, usize)>,
    /// Statements outside of definitions.
    pub(super) main: Vec<Statement>,
}

struct Reader {
    parser: Parser,
    unit: Unit,
    depth: usize,
}

pub(super) fn parse(text: &Text, file: usize) -> Result<Unit> {
    let text = without_lines(&text.text, '$');
    let parser = Parser::new(Syntax::UrScript, tokens(&text, file, &SPELLING)?);
    let mut reader = Reader { parser, unit: Unit::default(), depth: 0 };
    let main = reader.block(&[])?;
    if !reader.parser.is_over() {
        return fail(
            reader.parser.span(),
            format!("{} is not expected here: what does it end?", reader.parser.found()),
        );
    }
    reader.unit.main = main;
    Ok(reader.unit)
}

impl Reader {
    /// Parses statements up to one of the words, which is not consumed.
    fn block(&mut self, ends: &[&str]) -> Result<Vec<Statement>> {
        let mut body = Vec::new();
        loop {
            while !self.parser.is_over() && (*self.parser.peek() == Token::Line || self.parser.is_symbol(";")) {
                self.parser.advance();
            }
            if self.parser.is_over() || self.parser.word().is_some_and(|word| ends.contains(&&*word)) {
                return Ok(body);
            }
            if ends.is_empty() && self.parser.is_word("end") {
                return Ok(body);
            }
            if let Some(statement) = self.statement()? {
                body.push(statement);
            }
        }
    }

    fn statement(&mut self) -> Result<Option<Statement>> {
        let (start, span) = (self.parser.at, self.parser.span());
        let word = self.parser.word().unwrap_or_default();
        match &*word {
            "def" | "thread" => return self.definition().map(|()| None),
            "sec" if self.parser.word_ahead(1).is_some() => return self.definition().map(|()| None),
            "if" | "while" => {
                let action = self.structure(&word)?;
                let line = self.parser.lexemes[start..].iter().take_while(|lexeme| lexeme.token != Token::Line);
                let end = line.last().map_or(span, |lexeme| lexeme.span);
                return Ok(Some(Statement { action, span: span.to(end) }));
            }
            _ => {}
        }
        match simple(&mut self.parser, &word) {
            Ok(action) if *self.parser.peek() == Token::Line || self.parser.is_symbol(";") => {
                Ok(Some(Statement { action, span: span.to(self.parser.last_span()) }))
            }
            result => {
                let message = match result {
                    Ok(_) => format!("{} is not expected here", self.parser.found()),
                    Err(Fail { message, .. }) => message,
                };
                self.parser.at = start;
                self.parser.skip_to(&Token::Line);
                Ok(Some(Statement { action: Action::Refused(message), span: span.to(self.parser.last_span()) }))
            }
        }
    }

    /// Parses a block from its first word on and consumes `end`.
    fn structure(&mut self, word: &str) -> Result<Action> {
        if self.depth >= crate::common::expressions::DEEPEST {
            return fail(self.parser.span(), "too many blocks are inside of each other: write it flatter");
        }
        self.depth += 1;
        let start = self.parser.advance().span;
        let condition = self.parser.expression()?;
        self.parser.take_symbol(":");
        // `while` has one body; `if` has branches, and what else is done.
        let action = if word == "while" {
            let body = self.block(&["end"])?;
            Action::While { condition: as_flag(condition), body }
        } else {
            let ends = ["elif", "elseif", "else", "end"];
            let mut branches = vec![(condition, self.block(&ends)?)];
            while self.parser.take_word("elif") || self.parser.take_word("elseif") {
                let condition = self.parser.expression()?;
                self.parser.take_symbol(":");
                branches.push((condition, self.block(&ends)?));
            }
            let mut otherwise = Vec::new();
            if self.parser.take_word("else") {
                self.parser.take_symbol(":");
                otherwise = self.block(&["end"])?;
            }
            Action::If { branches, otherwise }
        };
        self.depth -= 1;
        self.end(start)?;
        Ok(action)
    }

    fn end(&mut self, start: Span) -> Result<()> {
        if self.parser.take_word("end") {
            return Ok(());
        }
        fail(start, "this block does not end: `end` is missing")
    }

    /// Parses `def name(a, b=1):` to its end; nested definitions are global.
    fn definition(&mut self) -> Result<()> {
        if self.depth >= crate::common::expressions::DEEPEST {
            return fail(self.parser.span(), "too many definitions are inside of each other: write it flatter");
        }
        let start = self.parser.span();
        let is_thread = self.parser.is_word("thread");
        self.parser.advance();
        let name = self.parser.expect_name()?;
        let mut parameters = Vec::new();
        if self.parser.take_symbol("(") {
            while !self.parser.is_symbol(")") {
                let name = self.parser.expect_name()?;
                let default = if self.parser.take_symbol("=") { Some(self.parser.expression()?) } else { None };
                let optional = default.is_some();
                parameters.push(Parameter { name, kind: "".into(), returned: false, optional, default });
                if !self.parser.take_symbol(",") {
                    break;
                }
            }
            self.parser.expect_symbol(")")?;
        }
        self.parser.take_symbol(":");
        let span = start.to(self.parser.last_span());
        // The body may define routines of its own; they follow this one in the list.
        let depth = self.depth;
        self.depth += 1;
        let place = self.unit.routines.len();
        let body = self.block(&["end"])?;
        self.depth -= 1;
        self.end(span)?;
        if !is_thread {
            self.unit.routines.insert(place, (Routine { name, parameters, body, span }, depth));
        }
        Ok(())
    }
}

/// Converts `while 1:` to `while True:`.
fn as_flag(condition: Expr) -> Expr {
    match condition.kind {
        Kind::Literal(Value::Number(number)) => Expr { kind: Kind::Literal(Value::Flag(number != 0.0)), ..condition },
        _ => condition,
    }
}

fn simple(parser: &mut Parser, word: &str) -> Result<Action> {
    match word {
        "return" => {
            parser.advance();
            let over = *parser.peek() == Token::Line || parser.is_symbol(";");
            let value = if over { None } else { Some(parser.expression()?) };
            return Ok(Action::Return(value));
        }
        "break" => return Ok(word_action(parser, Action::Leave)),
        "continue" => return Ok(word_action(parser, Action::Again)),
        "halt" => return Ok(word_action(parser, Action::Halt)),
        "pass" => return Ok(word_action(parser, Action::If { branches: Vec::new(), otherwise: Vec::new() })),
        "global" => {
            parser.advance();
        }
        "local" => {
            parser.advance();
            let name = parser.expect_name()?;
            let value = if parser.take_symbol("=") { Some(parser.expression()?) } else { None };
            return Ok(Action::Declare { kind: "".into(), name, sizes: Vec::new(), value });
        }
        "run" | "join" | "kill" => {
            parser.skip_to(&Token::Line);
            return Ok(match word {
                "run" => Action::Refused(
                    "threads are not simulated; they may move the robot or change what the program does: take the line out if it does not".into(),
                ),
                _ => Action::Still("threads are not simulated"),
            });
        }
        _ => {}
    }
    // An assignment or a call.
    let place = parser.expression()?;
    if parser.take_symbol("=") {
        return Ok(Action::Assign { place, value: parser.expression()? });
    }
    match place.kind {
        Kind::Call(name, arguments) => Ok(Action::Call { name, arguments }),
        Kind::Name(name) => {
            let name: Rc<str> = name;
            fail(place.span, format!("`{name}` alone does nothing: are its brackets missing?"))
        }
        _ => fail(place.span, "a call or an assignment is expected"),
    }
}

fn word_action(parser: &mut Parser, action: Action) -> Action {
    parser.advance();
    if parser.take_symbol("(") {
        parser.take_symbol(")");
    }
    action
}
