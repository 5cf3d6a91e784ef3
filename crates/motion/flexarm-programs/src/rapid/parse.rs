//! Parser of RAPID text. An unsupported statement is an error only where it is reached.
//!
//! Start at [`parse`], which gives the routines, data and records of one file as a [`Unit`]. Not
//! here: expressions ([`crate::common::expressions`]), meaning of data types (`types`) and
//! instructions (`mod.rs`).

use std::collections::HashSet;
use std::rc::Rc;

use super::types::{Fields, Records};
use crate::common::expressions::{Parser, Syntax};
use crate::common::lexer::{Spelling, Token, tokens};
use crate::common::tree::{Action, Argument, Expr, Kind, Parameter, Routine, Statement};
use crate::common::{Fail, Result, Span, Text, blank, fail};

pub(crate) const SPELLING: Spelling = Spelling {
    comment: '!',
    lines: false,
    folds_case: true,
    symbols: &[
        ":=", "<>", "<=", ">=", "<", ">", "=", "+", "-", "*", "/", "(", ")", "[", "]", "{", "}", ",", ":", ".", ";",
        "\\", "|", "%",
    ],
    apostrophes: false,
    doubled_quotes: true,
};

/// One file.
#[derive(Default)]
pub(super) struct Unit {
    pub(super) name: Option<Rc<str>>,
    pub(super) routines: Vec<Routine>,
    /// Declarations of modules.
    pub(super) data: Vec<Statement>,
    /// Statements outside of routines.
    pub(super) main: Vec<Statement>,
    /// All names used in the file.
    pub(super) used: HashSet<Rc<str>>,
    /// Fields of declared types, with their types.
    pub(super) records: Records,
}

impl Unit {
    /// Names declared in the file.
    pub(super) fn declared(&self) -> HashSet<Rc<str>> {
        let data = self.data.iter().filter_map(|statement| match &statement.action {
            Action::Declare { name, .. } => Some(name.clone()),
            _ => None,
        });
        let routines = self.routines.iter().map(|routine| routine.name.clone());
        data.chain(routines).chain(self.records.keys().cloned()).collect()
    }

    /// Adds another module; existing declarations take precedence.
    pub(super) fn take_in(&mut self, other: Self) {
        self.routines.extend(other.routines);
        self.data.splice(0..0, other.data);
        self.used.extend(other.used);
        for (name, fields) in other.records {
            self.records.entry(name).or_insert(fields);
        }
    }
}

pub(super) fn parse(text: &Text, file: usize) -> Result<Unit> {
    let mut parser = Parser::new(Syntax::Rapid, tokens(&without_header(&text.text), file, &SPELLING)?);
    let mut unit = Unit::default();
    unit.used.extend(parser.lexemes.iter().filter_map(|lexeme| match &lexeme.token {
        Token::Name(name) => Some(name.clone()),
        _ => None,
    }));
    while !parser.is_over() {
        while ["local", "task"].iter().any(|word| parser.take_word(word)) {}
        match parser.word().as_deref() {
            Some("module") => {
                parser.advance();
                let start = parser.span();
                if matches!(parser.peek(), Token::Number(..)) {
                    parser.advance(); // some generators begin a name with a digit
                }
                if parser.word().is_some_and(|word| !BEGINNINGS.contains(&&*word)) {
                    parser.advance();
                }
                unit.name.get_or_insert_with(|| text.excerpt(start.to(parser.last_span())).into());
                if parser.is_symbol("(") {
                    parser.arguments()?;
                }
            }
            Some("endmodule") => {
                parser.advance();
            }
            Some(word @ ("proc" | "func" | "trap")) => {
                let is_trap = word == "trap";
                let routine = routine(&mut parser)?;
                if !is_trap {
                    unit.routines.push(routine);
                }
            }
            Some("record") => {
                let (name, fields) = record(&mut parser)?;
                unit.records.insert(name, fields);
            }
            Some("alias") => pass_statement(&mut parser),
            Some("pers" | "var" | "const") => unit.data.push(statement(&mut parser)?),
            _ => unit.main.push(statement(&mut parser)?),
        }
    }
    Ok(unit)
}

/// Replaces the header of stored programs (`%%% VERSION:1 ... %%%`) by blanks, so that positions do
/// not change.
fn without_header(text: &str) -> String {
    let start = text.len() - text.trim_start().len();
    let header =
        text[start..].strip_prefix("%%%").and_then(|rest| rest.find("%%%")).map(|length| start + 3 + length + 3);
    let Some(end) = header else { return text.to_owned() };
    blank(&text[..end]) + &text[end..]
}

/// Skips the next semicolon.
fn pass_statement(parser: &mut Parser) {
    while !parser.is_over() && !parser.take_symbol(";") {
        if parser.word().is_some_and(|word| OUTER.contains(&&*word)) {
            return; // its semicolon is missing
        }
        parser.advance();
    }
}

fn record(parser: &mut Parser) -> Result<(Rc<str>, Fields)> {
    parser.advance();
    let name = parser.expect_name()?;
    let mut fields = Vec::new();
    while !parser.is_over() && !parser.take_word("endrecord") {
        let kind = parser.expect_name()?;
        fields.push((parser.expect_name()?, kind));
        parser.expect_symbol(";")?;
    }
    Ok((name, fields))
}

/// Parses `PROC name(num a, \num b) ... ENDPROC`, `FUNC`, `TRAP`.
fn routine(parser: &mut Parser) -> Result<Routine> {
    let start = parser.span();
    let word = parser.expect_name()?;
    if &*word == "func" {
        parser.expect_name()?;
    }
    let name = parser.expect_name()?;
    let parameters = if parser.take_symbol("(") { parameters(parser)? } else { Vec::new() };
    let span = start.to(parser.last_span());
    let end: &'static str = match &*word {
        "func" => "endfunc",
        "trap" => "endtrap",
        _ => "endproc",
    };
    let body = block(parser, &[end, "error", "undo", "backward"])?;
    // Handlers run only after an error.
    while !parser.is_over() && !parser.is_word(end) && !parser.is_word("endmodule") {
        parser.advance();
    }
    if !parser.take_word(end) {
        return fail(span, format!("this routine does not end: `{}` is missing", end.to_uppercase()));
    }
    Ok(Routine { name, parameters, body, span })
}

/// Parses the parameters of a routine up to the closing parenthesis.
fn parameters(parser: &mut Parser) -> Result<Vec<Parameter>> {
    let mut parameters = Vec::new();
    while !parser.take_symbol(")") {
        if parser.is_over() {
            return fail(parser.span(), "the parameters do not end: `)` is missing");
        }
        parser.take_symbol(",");
        parser.take_symbol("|");
        // A backslash marks an optional parameter; VAR, PERS and INOUT mark returned ones.
        let optional = parser.take_symbol("\\");
        let returned = ["var", "pers", "inout"].iter().any(|word| parser.take_word(word));
        let kind = parser.expect_name()?;
        let name =
            if kind.as_ref() == "switch" && parser.word().is_none() { kind.clone() } else { parser.expect_name()? };
        let mut kind = kind.to_string();
        if parser.take_symbol("{") {
            while !parser.take_symbol("}") {
                if parser.is_over() {
                    return fail(parser.span(), "`}` is missing");
                }
                if parser.is_symbol("*") {
                    kind.push_str("{}");
                }
                parser.advance();
            }
        }
        let kind: Rc<str> = if kind == "switch" { "".into() } else { kind.into() };
        parameters.push(Parameter { name, kind, returned, optional, default: None });
    }
    Ok(parameters)
}

/// Parses statements up to one of the words, which is not consumed.
fn block(parser: &mut Parser, ends: &[&str]) -> Result<Vec<Statement>> {
    let mut body = Vec::new();
    loop {
        let word = parser.word().filter(|_| !parser.is_symbol_ahead(1, ":="));
        if parser.is_over() || word.is_some_and(|word| ends.contains(&&*word) || OUTER.contains(&&*word)) {
            return Ok(body);
        }
        body.push(statement(parser)?);
    }
}

/// Words that begin a declaration in a module.
const BEGINNINGS: [&str; 10] = ["local", "task", "pers", "var", "const", "proc", "func", "trap", "record", "alias"];

/// Words that end every block.
const OUTER: [&str; 5] = ["endproc", "endfunc", "endtrap", "endmodule", "proc"];

fn statement(parser: &mut Parser) -> Result<Statement> {
    let (start, span) = (parser.at, parser.span());
    let word = parser.word().unwrap_or_default();
    if let Some(action) = parser.nested(|parser| structure(parser, &word))? {
        let head = parser.lexemes[start..].iter().take_while(|lexeme| lexeme.token != Token::Symbol(";")).take(12);
        let end = head.last().map_or(span, |lexeme| lexeme.span);
        return Ok(Statement { action, span: span.to(end) });
    }
    match simple(parser, &word) {
        Ok(action) if parser.is_symbol(";") => {
            let span = span.to(parser.last_span());
            parser.advance();
            Ok(Statement { action, span })
        }
        result => {
            let message = match result {
                Ok(_) => format!("`;` is expected before {}", parser.found()),
                Err(Fail { message, .. }) => message,
            };
            parser.at = start;
            let is_target = parser.lexemes[start..].iter().take_while(|l| l.token != Token::Symbol(";")).nth(1);
            let hidden = matches!(is_target, Some(lexeme) if lexeme.token == Token::Symbol("*"));
            let message = if hidden {
                "the target `*` is kept by the controller and not in the text: store the program with its targets written out".into()
            } else {
                message
            };
            pass_statement(parser);
            if parser.at == start {
                parser.advance(); // an end word without a block
            }
            let end = parser.lexemes[parser.at.saturating_sub(1).max(start)].span;
            Ok(Statement { action: Action::Refused(message), span: span.to(end) })
        }
    }
}

/// Consumes the end word of a block that began at `start`.
fn end(parser: &mut Parser, word: &str, start: Span) -> Result<()> {
    if parser.take_word(word) {
        parser.take_symbol(";");
        return Ok(());
    }
    fail(start, format!("this block does not end: `{}` is missing", word.to_uppercase()))
}

/// Parses a block and consumes its end word.
fn structure(parser: &mut Parser, word: &str) -> Result<Option<Action>> {
    let start = parser.span();
    if parser.is_symbol_ahead(1, ":=") {
        return Ok(None);
    }
    let action = match word {
        "if" => {
            parser.advance();
            let condition = parser.expression()?;
            if !parser.take_word("then") {
                let body = vec![statement(parser)?]; // the short form
                return Ok(Some(Action::If { branches: vec![(condition, body)], otherwise: Vec::new() }));
            }
            let ends = ["elseif", "else", "endif"];
            let mut branches = vec![(condition, block(parser, &ends)?)];
            while parser.take_word("elseif") {
                let condition = parser.expression()?;
                parser.expect_word("then")?;
                branches.push((condition, block(parser, &ends)?));
            }
            let otherwise = if parser.take_word("else") { block(parser, &ends)? } else { Vec::new() };
            end(parser, "endif", start)?;
            Action::If { branches, otherwise }
        }
        "while" => {
            parser.advance();
            let condition = parser.expression()?;
            parser.expect_word("do")?;
            let body = block(parser, &["endwhile"])?;
            end(parser, "endwhile", start)?;
            Action::While { condition, body }
        }
        "for" => {
            parser.advance();
            let name = parser.expect_name()?;
            parser.expect_word("from")?;
            let from = parser.expression()?;
            parser.expect_word("to")?;
            let to = parser.expression()?;
            let step = if parser.take_word("step") { Some(parser.expression()?) } else { None };
            parser.expect_word("do")?;
            let body = block(parser, &["endfor"])?;
            end(parser, "endfor", start)?;
            Action::For { name, from, to, step, body }
        }
        "test" => test(parser)?,
        _ => return Ok(None),
    };
    Ok(Some(action))
}

fn test(parser: &mut Parser) -> Result<Action> {
    let start = parser.advance().span;
    let subject = parser.expression()?;
    let ends = ["case", "default", "endtest"];
    let (mut cases, mut otherwise) = (Vec::new(), Vec::new());
    loop {
        if parser.take_word("case") {
            let labels = parser.labels()?;
            parser.expect_symbol(":")?;
            cases.push((labels, block(parser, &ends)?));
        } else if parser.take_word("default") {
            parser.expect_symbol(":")?;
            otherwise = block(parser, &ends)?;
        } else {
            end(parser, "endtest", start)?;
            return Ok(Action::Switch { subject, cases, otherwise });
        }
    }
}

/// Parses a statement up to its semicolon, which is not consumed.
fn simple(parser: &mut Parser, word: &str) -> Result<Action> {
    if parser.is_symbol(";") {
        return Ok(Action::If { branches: Vec::new(), otherwise: Vec::new() });
    }
    match word {
        "local" | "task" | "pers" | "var" | "const" => return declaration(parser),
        "return" => {
            parser.advance();
            let value = if parser.is_symbol(";") { None } else { Some(parser.expression()?) };
            return Ok(Action::Return(value));
        }
        "exit" => {
            parser.advance();
            return Ok(Action::Halt);
        }
        "goto" => return refuse(parser, "jumps (GOTO) are not read: write a loop or a branch"),
        "raise" | "retry" | "trynext" => {
            return refuse(parser, "errors and their handlers are not simulated: take the statement out");
        }
        "connect" => {
            parser.skip_to(&Token::Symbol(";"));
            return Ok(Action::Still("interrupts are not simulated: none comes"));
        }
        _ => {}
    }
    if parser.is_symbol("%") {
        return refuse(parser, "calls by a text (%...%) are not read: write the name of the routine");
    }
    if parser.word().is_some() && parser.is_symbol_ahead(1, ":") {
        // A label is skipped; the statement after it is parsed.
        parser.advance();
        parser.advance();
        let word = parser.word().unwrap_or_default();
        return simple(parser, &word);
    }
    let is_place = |symbol: &str| [":=", "{", "."].contains(&symbol);
    if matches!(&parser.lexeme(1).token, Token::Symbol(symbol) if is_place(symbol)) {
        let place = parser.expression()?;
        parser.expect_symbol(":=")?;
        return Ok(Action::Assign { place, value: parser.expression()? });
    }
    call(parser)
}

fn refuse(parser: &mut Parser, message: &str) -> Result<Action> {
    parser.skip_to(&Token::Symbol(";"));
    Ok(Action::Refused(message.into()))
}

/// Parses `Name a, b \C:=d;`.
fn call(parser: &mut Parser) -> Result<Action> {
    let name = parser.expect_name()?;
    let mut arguments: Vec<Argument> = Vec::new();
    while !parser.is_symbol(";") {
        parser.take_symbol(",");
        arguments.push(parser.argument()?);
        if !(parser.is_symbol(",") || parser.is_symbol("\\") || parser.is_symbol(";")) {
            return fail(parser.span(), format!("`,` or `;` is expected before {}", parser.found()));
        }
    }
    Ok(Action::Call { name, arguments })
}

/// Parses `[LOCAL] [TASK] PERS type name{2,3} := value`.
fn declaration(parser: &mut Parser) -> Result<Action> {
    while ["local", "task", "pers", "var", "const"].iter().any(|word| parser.take_word(word)) {}
    let mut kind = parser.expect_name()?.to_string();
    let name = parser.expect_name()?;
    let sizes = if parser.take_symbol("{") { parser.expressions("}")? } else { Vec::new() };
    kind += &"{}".repeat(sizes.len());
    let value = if parser.take_symbol(":=") { Some(parser.expression()?) } else { None };
    let is_hidden = matches!(&value, Some(Expr { kind: Kind::Name(name), .. }) if &**name == "*");
    if is_hidden {
        return fail(parser.last_span(), "the value is not in the text");
    }
    Ok(Action::Declare { kind: kind.into(), name, sizes, value })
}
