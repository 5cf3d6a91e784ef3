//! Parser of KRL lines. An unsupported line becomes a statement that is an error only where it is
//! reached.
//!
//! Start at [`parse`], which gives the routines, data and statements of one file as a [`Unit`]. Not
//! here: expressions ([`crate::common::expressions`]), meaning of instructions (`dialect`).

use std::rc::Rc;

use crate::common::expressions::{Parser, Syntax};
use crate::common::lexer::{Spelling, Token, tokens};
use crate::common::tree::{Action, Argument, Expr, Kind, Operator, Parameter, Routine, Statement};
use crate::common::value::Value;
use crate::common::{Fail, Result, Span, Text, fail, is_among, without_lines};

pub(crate) const SPELLING: Spelling = Spelling {
    comment: ';',
    lines: true,
    folds_case: true,
    symbols: &[
        "==", "<>", "<=", ">=", "<", ">", "=", "+", "-", "*", "/", "(", ")", "[", "]", "{", "}", ",", ":", ".", "#",
    ],
    apostrophes: true,
    doubled_quotes: false,
};

/// One file.
#[derive(Default)]
pub(super) struct Unit {
    pub(super) routines: Vec<Routine>,
    /// Declarations of data lists.
    pub(super) data: Vec<Statement>,
    /// Statements outside of routines.
    pub(super) main: Vec<Statement>,
}

/// Types that need no DECL before them.
const TYPES: [&str; 9] = ["int", "real", "bool", "char", "frame", "pos", "e6pos", "axis", "e6axis"];

/// Motion words.
pub(super) const MOTIONS: &str =
    "ptp lin circ ptp_rel lin_rel circ_rel sptp slin scirc spl sptp_rel slin_rel scirc_rel spl_rel asyptp";

pub(super) fn parse(text: &Text, file: usize) -> Result<Unit> {
    let mut parser = Parser::new(Syntax::Krl, tokens(&without_lines(&text.text, '&'), file, &SPELLING)?);
    let mut unit = Unit::default();
    while !parser.is_over() {
        pass_empty_lines(&mut parser);
        if parser.is_over() {
            break;
        }
        let ahead = usize::from(parser.is_word("global"));
        match parser.word_ahead(ahead).as_deref() {
            Some("def" | "deffct") => {
                let routine = routine(&mut parser)?;
                unit.routines.push(routine);
            }
            Some("defdat") => {
                pass_line(&mut parser);
                unit.data.append(&mut block(&mut parser, &["enddat"])?);
                parser.take_word("enddat");
                pass_line(&mut parser);
            }
            _ => unit.main.append(&mut statement(&mut parser)?),
        }
    }
    Ok(unit)
}

fn pass_empty_lines(parser: &mut Parser) {
    while !parser.is_over() && *parser.peek() == Token::Line {
        parser.advance();
    }
}

/// Skips to the beginning of the next line.
fn pass_line(parser: &mut Parser) {
    parser.skip_to(&Token::Line);
    parser.advance();
}

/// Parses `DEF name(a :IN, b :OUT)` or `DEFFCT REAL name(a :IN)` to its end.
fn routine(parser: &mut Parser) -> Result<Routine> {
    let span = parser.span();
    parser.take_word("global");
    // A function has a type before its name, of which an array has brackets.
    let is_function = &*parser.expect_name()? == "deffct";
    if is_function {
        parser.expect_name()?;
        if parser.take_symbol("[") {
            parser.expect_symbol("]")?;
        }
    }
    let name = parser.expect_name()?;
    // Parameters return their values unless they are marked `:IN`.
    let mut parameters = Vec::new();
    if parser.take_symbol("(") {
        while !parser.is_symbol(")") {
            let name = parser.expect_name()?;
            while parser.take_symbol("[") {
                while parser.take_symbol(",") {}
                parser.expect_symbol("]")?;
            }
            let returned = if parser.take_symbol(":") { &*parser.expect_name()? == "out" } else { true };
            parameters.push(Parameter { name, kind: "".into(), returned, optional: false, default: None });
            if !parser.take_symbol(",") {
                break;
            }
        }
        parser.expect_symbol(")")?;
    }
    let span = span.to(parser.last_span());
    pass_line(parser);
    let end = if is_function { "endfct" } else { "end" };
    let body = block(parser, &[end])?;
    if !parser.take_word(end) {
        return fail(span, format!("this routine does not end: `{}` is missing", end.to_uppercase()));
    }
    pass_line(parser);
    Ok(Routine { name, parameters, body, span })
}

/// Parses statements up to one of the words, which is not consumed.
fn block(parser: &mut Parser, ends: &[&str]) -> Result<Vec<Statement>> {
    let mut body = Vec::new();
    loop {
        pass_empty_lines(parser);
        if parser.is_over() || parser.word().is_some_and(|word| ends.contains(&&*word) && !is_assigned(parser)) {
            return Ok(body);
        }
        if parser.word().is_some_and(|word| ["def", "deffct", "end", "endfct", "enddat"].contains(&&*word))
            && !is_assigned(parser)
        {
            return Ok(body); // the enclosing block reports its missing end
        }
        body.append(&mut statement(parser)?);
    }
}

fn is_assigned(parser: &Parser) -> bool {
    parser.is_symbol_ahead(1, "=")
}

/// Parses the statement of a line, or a whole block.
fn statement(parser: &mut Parser) -> Result<Vec<Statement>> {
    let (start, span) = (parser.at, parser.span());
    let word = parser.word().unwrap_or_default();
    if let Some(action) = parser.nested(|parser| structure(parser, &word))? {
        let span = line_span(parser, start);
        pass_line(parser);
        return Ok(vec![Statement { action, span }]);
    }
    match simple(parser, &word) {
        Ok(actions) if *parser.peek() == Token::Line => {
            let span = span.to(parser.last_span());
            parser.advance();
            Ok(actions.into_iter().map(|action| Statement { action, span }).collect())
        }
        result => {
            let message = match result {
                Ok(_) => format!("{} is not expected here", parser.found()),
                Err(Fail { message, .. }) => message,
            };
            parser.at = start;
            pass_line(parser);
            Ok(vec![Statement { action: Action::Refused(message), span: line_span(parser, start) }])
        }
    }
}

/// Span of the line that begins at a token.
fn line_span(parser: &Parser, start: usize) -> Span {
    let tokens = &parser.lexemes[start..];
    let length = tokens.iter().take_while(|lexeme| lexeme.token != Token::Line).count();
    tokens[0].span.to(tokens[length.saturating_sub(1)].span)
}

/// Parses a block and consumes its end word.
fn structure(parser: &mut Parser, word: &str) -> Result<Option<Action>> {
    if is_assigned(parser) {
        return Ok(None);
    }
    // Blocks contain others up to their own end word.
    let start = parser.span();
    let end = |parser: &mut Parser, word: &str| end_of_block(parser, start, word);
    let action = match word {
        "if" => {
            parser.advance();
            let condition = parser.expression()?;
            parser.expect_word("then")?;
            pass_line(parser);
            let body = block(parser, &["else", "endif"])?;
            let mut otherwise = Vec::new();
            if parser.take_word("else") {
                otherwise = block(parser, &["endif"])?;
            }
            end(parser, "endif")?;
            Action::If { branches: vec![(condition, body)], otherwise }
        }
        "while" => {
            parser.advance();
            let condition = parser.expression()?;
            let body = block(parser, &["endwhile"])?;
            end(parser, "endwhile")?;
            Action::While { condition, body }
        }
        "loop" => {
            let condition = Expr { kind: Kind::Literal(Value::Flag(true)), span: parser.advance().span };
            let body = block(parser, &["endloop"])?;
            end(parser, "endloop")?;
            Action::While { condition, body }
        }
        "repeat" => {
            parser.advance();
            let body = block(parser, &["until"])?;
            end(parser, "until")?;
            Action::Repeat { body, until: parser.expression()? }
        }
        "for" => for_loop(parser)?,
        "switch" => switch(parser)?,
        "spline" | "ptp_spline" => {
            let name = parser.expect_name()?;
            let mut arguments = tail(parser)?;
            let body = block(parser, &["endspline"])?;
            end(parser, "endspline")?;
            arguments.append(&mut tail(parser)?);
            Action::Block { name, arguments, body }
        }
        _ => return Ok(None),
    };
    Ok(Some(action))
}

fn end_of_block(parser: &mut Parser, start: Span, word: &str) -> Result<()> {
    if parser.take_word(word) {
        return Ok(());
    }
    fail(start, format!("this block does not end: `{}` is missing", word.to_uppercase()))
}

fn for_loop(parser: &mut Parser) -> Result<Action> {
    let start = parser.advance().span;
    let name = parser.expect_name()?;
    parser.expect_symbol("=")?;
    let from = parser.expression()?;
    parser.expect_word("to")?;
    let to = parser.expression()?;
    let step = if parser.take_word("step") { Some(parser.expression()?) } else { None };
    let body = block(parser, &["endfor"])?;
    end_of_block(parser, start, "endfor")?;
    Ok(Action::For { name, from, to, step, body })
}

fn switch(parser: &mut Parser) -> Result<Action> {
    let start = parser.advance().span;
    let subject = parser.expression()?;
    pass_empty_lines(parser);
    let (mut cases, mut otherwise) = (Vec::new(), Vec::new());
    let ends = ["case", "default", "endswitch"];
    loop {
        if parser.take_word("case") {
            cases.push((parser.labels()?, block(parser, &ends)?));
        } else if parser.take_word("default") {
            otherwise = block(parser, &ends)?;
        } else if parser.take_word("endswitch") {
            return Ok(Action::Switch { subject, cases, otherwise });
        } else {
            return fail(start, "this block does not end: `CASE`, `DEFAULT` or `ENDSWITCH` is missing");
        }
    }
}

/// Parses a statement of one line; a declaration may give several.
fn simple(parser: &mut Parser, word: &str) -> Result<Vec<Action>> {
    let still = |parser: &mut Parser, what: &'static str| {
        parser.skip_to(&Token::Line);
        Ok(vec![Action::Still(what)])
    };
    let none = |parser: &mut Parser| {
        parser.skip_to(&Token::Line);
        Ok(Vec::new())
    };
    if is_assigned(parser) || parser.is_symbol_ahead(1, "[") || parser.is_symbol_ahead(1, ".") {
        return assignment(parser);
    }
    match word {
        "ext" | "extfct" | "extfctp" | "extp" | "import" | "struc" | "enum" | "signal" => none(parser),
        "interrupt" | "global" if word == "interrupt" || parser.word_ahead(1).as_deref() == Some("interrupt") => {
            still(parser, "interrupts are not simulated: none comes")
        }
        "decl" | "global" | "const" => declaration(parser),
        _ if TYPES.contains(&word) && parser.word_ahead(1).is_some() => declaration(parser),
        "exit" => {
            parser.advance();
            Ok(vec![Action::Leave])
        }
        "return" => {
            parser.advance();
            let value = if *parser.peek() == Token::Line { None } else { Some(parser.expression()?) };
            Ok(vec![Action::Return(value)])
        }
        "halt" => still(parser, "HALT waits for the operator: the program continues at once"),
        "continue" => still(parser, "the advance run is not simulated"),
        "trigger" => still(parser, "switching on the path (TRIGGER) is not simulated"),
        "anout" | "anin" | "digin" | "pulse" => still(parser, "inputs and outputs are not simulated"),
        "confirm" | "cwrite" | "cread" | "copen" | "cclose" | "swrite" | "sread" | "on_error_proceed" => {
            still(parser, "messages and channels are not simulated")
        }
        "wait" => wait(parser),
        "goto" => refuse(parser, "jumps (GOTO) are not read: write a loop or a branch"),
        "brake" | "resume" => {
            refuse(parser, "motion that is broken off by an interrupt is not simulated: take the statement out")
        }
        _ if is_among(word, MOTIONS) => motion(parser),
        _ if parser.is_symbol_ahead(1, "(") => {
            let name = parser.expect_name()?;
            let arguments = parser.arguments()?;
            Ok(vec![Action::Call { name, arguments }])
        }
        _ if parser.word().is_some() && parser.is_symbol_ahead(1, ":") => none(parser), // a label
        _ => refuse(parser, "this statement of KRL is not known here: take it out if it does not move the robot"),
    }
}

fn refuse(parser: &mut Parser, message: &str) -> Result<Vec<Action>> {
    parser.skip_to(&Token::Line);
    Ok(vec![Action::Refused(message.into())])
}

fn assignment(parser: &mut Parser) -> Result<Vec<Action>> {
    let place = parser.expression()?;
    parser.expect_symbol("=")?;
    let is_output =
        matches!(&place.kind, Kind::Index(base, _) if matches!(&base.kind, Kind::Name(name) if &**name == "$out"));
    let mut actions = vec![Action::Assign { place, value: parser.expression()? }];
    if is_output {
        actions.push(Action::Still("inputs and outputs are not simulated"));
    }
    Ok(actions)
}

/// Parses `[GLOBAL] DECL [GLOBAL] [CONST] TYPE name[n]=value, name`.
fn declaration(parser: &mut Parser) -> Result<Vec<Action>> {
    while ["decl", "global", "const", "public"].iter().any(|word| parser.take_word(word)) {}
    if parser.word().is_some_and(|word| ["struc", "enum", "signal"].contains(&&*word)) {
        parser.skip_to(&Token::Line);
        return Ok(Vec::new());
    }
    let kind = parser.expect_name()?;
    let mut declared = Vec::new();
    loop {
        let name = parser.expect_name()?;
        let sizes = if parser.take_symbol("[") { parser.expressions("]")? } else { Vec::new() };
        let value = if parser.take_symbol("=") { Some(parser.expression()?) } else { None };
        declared.push(Action::Declare { kind: kind.clone(), name, sizes, value });
        if !parser.take_symbol(",") {
            return Ok(declared);
        }
    }
}

fn wait(parser: &mut Parser) -> Result<Vec<Action>> {
    parser.advance();
    let name: Rc<str> = if parser.take_word("sec") {
        "wait sec".into()
    } else {
        parser.expect_word("for")?;
        "wait for".into()
    };
    let value = parser.expression()?;
    let arguments = vec![Argument { name: None, span: value.span, value: Some(value) }];
    Ok(vec![Action::Call { name, arguments }])
}

/// Parses `PTP target words`, `CIRC via, target, CA 180 words`; words become named arguments.
fn motion(parser: &mut Parser) -> Result<Vec<Action>> {
    let name = parser.expect_name()?;
    let mut arguments = Vec::new();
    loop {
        if parser.is_word("ca") {
            let start = parser.advance().span;
            parser.take_symbol("=");
            let value = parser.expression()?;
            arguments.push(Argument { name: Some("ca".into()), span: start.to(value.span), value: Some(value) });
        } else {
            let value = parser.expression()?;
            arguments.push(Argument { name: None, span: value.span, value: Some(value) });
        }
        if !parser.take_symbol(",") {
            break;
        }
    }
    arguments.append(&mut tail(parser)?);
    Ok(vec![Action::Call { name, arguments }])
}

/// Parses the words after a target: `C_DIS`, `#TOOL`, `WITH $VEL.CP=0.5, $APO.CDIS=5`.
fn tail(parser: &mut Parser) -> Result<Vec<Argument>> {
    let mut words = Vec::new();
    while *parser.peek() != Token::Line {
        let start = parser.span();
        if parser.take_word("with") {
            loop {
                let place = parser.expression()?;
                parser.expect_symbol("=")?;
                let value = parser.expression()?;
                let span = place.span.to(value.span);
                let assignment = Expr { kind: Kind::Binary(Operator::Equal, Box::new(place), Box::new(value)), span };
                words.push(Argument { name: Some("with".into()), value: Some(assignment), span });
                if !parser.take_symbol(",") {
                    break;
                }
            }
            continue;
        }
        let is_word = parser.take_symbol("#");
        let name = parser.expect_name()?;
        let name: Rc<str> = if is_word { format!("#{name}").into() } else { name };
        words.push(Argument { name: Some(name), value: None, span: start.to(parser.last_span()) });
    }
    Ok(words)
}
