//! Syntax trees: expressions, statements, routines.
//!
//! One tree serves KRL, RAPID and URScript; each node knows its [`Span`]. Not here: parsers
//! (`expressions`, and `parse` of each language), the interpreter (`machine`).

use std::rc::Rc;

use super::Span;
use super::value::Value;

/// An expression and its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expr {
    pub(crate) kind: Kind,
    pub(crate) span: Span,
}

/// Kind of expression.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Kind {
    Literal(Value),
    Name(Rc<str>),
    Field(Box<Expr>, Rc<str>),
    Index(Box<Expr>, Vec<Expr>),
    Not(Box<Expr>),
    Negative(Box<Expr>),
    Binary(Operator, Box<Expr>, Box<Expr>),
    Call(Rc<str>, Vec<Argument>),
    List(Vec<Expr>),
    /// `{X 1, Y 2}` or `{E6POS: X 1}`.
    Record(Rc<str>, Vec<(Rc<str>, Expr)>),
    /// `p[...]`.
    Pose(Vec<Expr>),
}

/// Binary operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    WholeDivide,
    Remainder,
    Power,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    Unequal,
    And,
    Or,
    Either,
    BitAnd,
    BitOr,
    BitEither,
    /// KRL's `:`, the frame on the right relative to the frame on the left.
    Frame,
}

/// An argument of a call: `value`, `\Name`, `\Name:=value`, `name=value`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Argument {
    pub(crate) name: Option<Rc<str>>,
    pub(crate) value: Option<Expr>,
    pub(crate) span: Span,
}

/// A statement and its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Statement {
    pub(crate) action: Action,
    pub(crate) span: Span,
}

/// Action of a statement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Action {
    Declare {
        kind: Rc<str>,
        name: Rc<str>,
        sizes: Vec<Expr>,
        value: Option<Expr>,
    },
    Assign {
        place: Expr,
        value: Expr,
    },
    If {
        branches: Vec<(Expr, Vec<Statement>)>,
        otherwise: Vec<Statement>,
    },
    While {
        condition: Expr,
        body: Vec<Statement>,
    },
    Repeat {
        body: Vec<Statement>,
        until: Expr,
    },
    For {
        name: Rc<str>,
        from: Expr,
        to: Expr,
        step: Option<Expr>,
        body: Vec<Statement>,
    },
    Switch {
        subject: Expr,
        cases: Vec<(Vec<Expr>, Vec<Statement>)>,
        otherwise: Vec<Statement>,
    },
    /// A routine of the file or an instruction of the language.
    Call {
        name: Rc<str>,
        arguments: Vec<Argument>,
    },
    /// Block of statements with a keyword (KRL's SPLINE).
    Block {
        name: Rc<str>,
        arguments: Vec<Argument>,
        body: Vec<Statement>,
    },
    Return(Option<Expr>),
    /// Leaves the innermost loop.
    Leave,
    /// Continues with the next pass of the innermost loop.
    Again,
    /// Ends the program.
    Halt,
    /// No effect on the motion; the text describes it ("outputs are set").
    Still(&'static str),
    /// Unsupported; an error only if it is reached.
    Refused(String),
}

/// A parameter of a routine.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parameter {
    pub(crate) name: Rc<str>,
    pub(crate) kind: Rc<str>,
    /// Whether changes are visible to the caller.
    pub(crate) returned: bool,
    /// Whether it may be omitted; then given by name if the language does so (`\name`).
    pub(crate) optional: bool,
    pub(crate) default: Option<Expr>,
}

/// A routine of the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Routine {
    pub(crate) name: Rc<str>,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) body: Vec<Statement>,
    pub(crate) span: Span,
}
