//! Parser from tokens to a tree by precedence, with Python's rules.
//!
//! Start at [`parse`]. Each method of [`Parser`] parses one rule of the grammar and calls the rule
//! that binds more strongly: condition, `or`, `and`, `not`, comparison, binary operators by
//! [`power`], sign, power, call or index, atom.
//! Not here: splitting the text ([`super::token`]), values of names ([`super::evaluate`]).

use super::ExpressionError;
use super::token::{Token, tokens};
use super::value::Value;

/// Maximum nesting depth of brackets, signs and conditions, which bounds the stack.
const MAX_NESTED: usize = 60;
/// Maximum number of tokens in an expression.
const MAX_TOKENS: usize = 4000;

pub(super) enum Expr {
    Const(Value),
    Name(String),
    List(Vec<Expr>),
    Tuple(Vec<Expr>),
    Dict(Vec<(Expr, Expr)>),
    Unary(&'static str, Box<Expr>),
    Binary(&'static str, Box<Expr>, Box<Expr>),
    /// `a < b <= c`
    Compare(Box<Expr>, Vec<(&'static str, Expr)>),
    And(Vec<Expr>),
    Or(Vec<Expr>),
    If {
        condition: Box<Expr>,
        then: Box<Expr>,
        otherwise: Box<Expr>,
    },
    Call {
        function: Box<Expr>,
        arguments: Vec<Expr>,
        named: Vec<(String, Expr)>,
    },
    Attribute(Box<Expr>, String),
    Index(Box<Expr>, Box<Expr>),
    Slice(Box<Expr>, [Option<Box<Expr>>; 3]),
    Comprehension {
        item: Box<Expr>,
        clauses: Vec<Clause>,
    },
}

/// `for a, b in items if condition`
pub(super) struct Clause {
    pub(super) targets: Vec<String>,
    pub(super) items: Expr,
    pub(super) conditions: Vec<Expr>,
}

/// Reserved words.
pub(crate) const KEYWORDS: [&str; 35] = [
    "False", "None", "True", "and", "as", "assert", "async", "await", "break", "class", "continue", "def", "del",
    "elif", "else", "except", "finally", "for", "from", "global", "if", "import", "in", "is", "lambda", "nonlocal",
    "not", "or", "pass", "raise", "return", "try", "while", "with", "yield",
];

pub(super) fn parse(text: &str) -> Result<Expr, ExpressionError> {
    let tokens = tokens(text)?;
    if tokens.is_empty() {
        return Err(ExpressionError::new("the expression is empty"));
    }
    if tokens.len() > MAX_TOKENS {
        return Err(ExpressionError::new(format!(
            "the expression has {} words, at most {MAX_TOKENS} are read",
            tokens.len()
        )));
    }
    let mut parser = Parser { tokens, at: 0, nested: 0 };
    let tree = parser.list_or_one()?;
    match parser.peek() {
        None => Ok(tree),
        Some(token) => Err(unexpected(Some(&token.clone()))),
    }
}

/// Arguments of a call: positional, then named.
type Arguments = (Vec<Expr>, Vec<(String, Expr)>);

struct Parser {
    tokens: Vec<Token>,
    at: usize,
    nested: usize,
}

fn unexpected(token: Option<&Token>) -> ExpressionError {
    match token {
        None => ExpressionError::new("the expression ends too early"),
        Some(Token::Name(name)) if name == "lambda" => ExpressionError::new("lambda is not read in expressions"),
        Some(token) => {
            let shown = match token {
                Token::Name(name) => name.clone(),
                Token::Int(i) => i.to_string(),
                Token::Float(x) => x.to_string(),
                Token::Text(text) => format!("{text:?}"),
                Token::Sign(sign) => (*sign).to_owned(),
            };
            ExpressionError::new(format!("{shown} is not expected here"))
        }
    }
}

const COMPARISONS: [&str; 6] = ["<", ">", "<=", ">=", "==", "!="];

/// Binding power of the binary operators, weakest first.
fn power(sign: &str) -> Option<u8> {
    Some(match sign {
        "|" => 1,
        "^" => 2,
        "&" => 3,
        "<<" | ">>" => 4,
        "+" | "-" => 5,
        "*" | "/" | "//" | "%" => 6,
        _ => return None,
    })
}

impl Parser {
    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.at)
    }

    fn is_sign(&self, sign: &str) -> bool {
        matches!(self.peek(), Some(Token::Sign(s)) if *s == sign)
    }

    fn is_word(&self, word: &str) -> bool {
        matches!(self.peek(), Some(Token::Name(n)) if n == word)
    }

    fn take_sign(&mut self, sign: &str) -> bool {
        let found = self.is_sign(sign);
        self.at += usize::from(found);
        found
    }

    fn take_word(&mut self, word: &str) -> bool {
        let found = self.is_word(word);
        self.at += usize::from(found);
        found
    }

    fn need_sign(&mut self, sign: &str) -> Result<(), ExpressionError> {
        if self.take_sign(sign) {
            return Ok(());
        }
        let found = unexpected(self.peek());
        Err(ExpressionError::new(format!("{}; expected {sign:?}", found.message)))
    }

    fn name(&mut self) -> Result<String, ExpressionError> {
        match self.peek() {
            Some(Token::Name(name)) if !KEYWORDS.contains(&name.as_str()) => {
                let name = name.clone();
                self.at += 1;
                Ok(name)
            }
            other => Err(unexpected(other)),
        }
    }

    /// Enters one nesting level; the caller leaves it.
    fn nest(&mut self) -> Result<(), ExpressionError> {
        self.nested += 1;
        if self.nested > MAX_NESTED {
            return Err(ExpressionError::new(format!("the expression is nested more than {MAX_NESTED} deep")));
        }
        Ok(())
    }

    /// Parses `a` or `a, b`: a tuple needs no brackets.
    fn list_or_one(&mut self) -> Result<Expr, ExpressionError> {
        let first = self.expression()?;
        if !self.is_sign(",") {
            return Ok(first);
        }
        let mut items = vec![first];
        while self.take_sign(",") {
            if self.peek().is_none() || self.is_sign(")") || self.is_sign("]") {
                break;
            }
            items.push(self.expression()?);
        }
        Ok(Expr::Tuple(items))
    }

    /// Parses `a if b else c`.
    fn expression(&mut self) -> Result<Expr, ExpressionError> {
        self.nest()?;
        let mut tree = self.disjunction()?;
        if self.take_word("if") {
            let condition = Box::new(self.disjunction()?);
            if !self.take_word("else") {
                let found = unexpected(self.peek());
                return Err(ExpressionError::new(format!("{}; expected else", found.message)));
            }
            let otherwise = Box::new(self.expression()?);
            tree = Expr::If { condition, then: Box::new(tree), otherwise };
        }
        self.nested -= 1;
        Ok(tree)
    }

    fn disjunction(&mut self) -> Result<Expr, ExpressionError> {
        self.terms("or", Self::conjunction, Expr::Or)
    }

    fn conjunction(&mut self) -> Result<Expr, ExpressionError> {
        self.terms("and", Self::negation, Expr::And)
    }

    /// Parses terms with a word between them; several are joined.
    fn terms(
        &mut self,
        word: &str,
        term: fn(&mut Self) -> Result<Expr, ExpressionError>,
        join: fn(Vec<Expr>) -> Expr,
    ) -> Result<Expr, ExpressionError> {
        let mut terms = vec![term(self)?];
        while self.take_word(word) {
            terms.push(term(self)?);
        }
        Ok(if terms.len() == 1 { terms.remove(0) } else { join(terms) })
    }

    fn negation(&mut self) -> Result<Expr, ExpressionError> {
        let mut negations = 0;
        while self.take_word("not") {
            negations += 1;
        }
        let tree = self.comparison()?;
        Ok(match negations {
            0 => tree,
            n if n % 2 == 1 => Expr::Unary("not", Box::new(tree)),
            _ => Expr::Unary("not", Box::new(Expr::Unary("not", Box::new(tree)))),
        })
    }

    fn comparison(&mut self) -> Result<Expr, ExpressionError> {
        let first = self.binary(1)?;
        let mut rest = Vec::new();
        loop {
            let sign = match self.peek() {
                Some(Token::Sign(sign)) => COMPARISONS.iter().find(|c| *c == sign).copied(),
                Some(Token::Name(word)) if word == "in" => Some("in"),
                Some(Token::Name(word)) if word == "is" => Some("is"),
                Some(Token::Name(word)) if word == "not" => Some("not in"),
                _ => None,
            };
            let Some(mut sign) = sign else { break };
            self.at += 1;
            if sign == "is" && self.take_word("not") {
                sign = "is not";
            }
            if sign == "not in" && !self.take_word("in") {
                return Err(unexpected(self.peek()));
            }
            rest.push((sign, self.binary(1)?));
        }
        Ok(if rest.is_empty() { first } else { Expr::Compare(Box::new(first), rest) })
    }

    /// Parses operators of at least this power, left-associative.
    fn binary(&mut self, least: u8) -> Result<Expr, ExpressionError> {
        let mut left = self.unary()?;
        while let Some(Token::Sign(sign)) = self.peek() {
            let (sign, Some(power)) = (*sign, power(sign)) else { break };
            if power < least {
                break;
            }
            self.at += 1;
            let right = self.binary(power + 1)?;
            left = Expr::Binary(sign, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<Expr, ExpressionError> {
        for sign in ["-", "+", "~"] {
            if self.take_sign(sign) {
                self.nest()?;
                let tree = Expr::Unary(sign, Box::new(self.unary()?));
                self.nested -= 1;
                return Ok(tree);
            }
        }
        let base = self.primary()?;
        if self.take_sign("**") {
            // Right-associative; binds more strongly than a sign on its left, but not on its right.
            self.nest()?;
            let exponent = self.unary()?;
            self.nested -= 1;
            return Ok(Expr::Binary("**", Box::new(base), Box::new(exponent)));
        }
        Ok(base)
    }

    /// Parses an atom followed by calls, attributes and indices.
    fn primary(&mut self) -> Result<Expr, ExpressionError> {
        let mut tree = self.atom()?;
        loop {
            if self.take_sign(".") {
                tree = Expr::Attribute(Box::new(tree), self.name()?);
            } else if self.take_sign("(") {
                let (arguments, named) = self.arguments()?;
                tree = Expr::Call { function: Box::new(tree), arguments, named };
            } else if self.take_sign("[") {
                tree = self.subscript(tree)?;
            } else {
                return Ok(tree);
            }
        }
    }

    fn arguments(&mut self) -> Result<Arguments, ExpressionError> {
        let (mut arguments, mut named) = (Vec::new(), Vec::new());
        while !self.take_sign(")") {
            let is_named = matches!(self.tokens.get(self.at + 1), Some(Token::Sign("=")));
            if is_named {
                let name = self.name()?;
                self.need_sign("=")?;
                named.push((name, self.expression()?));
            } else {
                let item = self.expression()?;
                arguments.push(self.comprehension(item)?);
            }
            if !self.is_sign(")") {
                self.need_sign(",")?;
            }
        }
        Ok((arguments, named))
    }

    fn subscript(&mut self, tree: Expr) -> Result<Expr, ExpressionError> {
        let mut parts: [Option<Box<Expr>>; 3] = [None, None, None];
        let mut colons = 0;
        while !self.take_sign("]") {
            if self.take_sign(":") {
                colons += 1;
                if colons > 2 {
                    return Err(ExpressionError::new("a slice has at most two colons"));
                }
                continue;
            }
            if parts[colons].is_some() {
                return Err(unexpected(self.peek()));
            }
            parts[colons] = Some(Box::new(self.list_or_one()?));
        }
        match (colons, parts) {
            (0, [Some(index), None, None]) => Ok(Expr::Index(Box::new(tree), index)),
            (0, _) => Err(ExpressionError::new("an index is missing between [ and ]")),
            (_, parts) => Ok(Expr::Slice(Box::new(tree), parts)),
        }
    }

    /// Parses the `for` clauses after an item, if there are any.
    fn comprehension(&mut self, item: Expr) -> Result<Expr, ExpressionError> {
        let mut clauses = Vec::new();
        while self.take_word("for") {
            let bracket = self.take_sign("(");
            let mut targets = vec![self.name()?];
            while self.take_sign(",") {
                targets.push(self.name()?);
            }
            if bracket {
                self.need_sign(")")?;
            }
            if !self.take_word("in") {
                return Err(unexpected(self.peek()));
            }
            let items = self.disjunction()?;
            let mut conditions = Vec::new();
            while self.take_word("if") {
                conditions.push(self.disjunction()?);
            }
            clauses.push(Clause { targets, items, conditions });
        }
        Ok(if clauses.is_empty() { item } else { Expr::Comprehension { item: Box::new(item), clauses } })
    }

    fn atom(&mut self) -> Result<Expr, ExpressionError> {
        let Some(token) = self.peek().cloned() else { return Err(unexpected(None)) };
        match token {
            Token::Int(i) => self.constant(Value::Int(i)),
            Token::Float(x) => self.constant(Value::Float(x)),
            Token::Text(mut text) => {
                self.at += 1;
                // Adjacent strings are concatenated.
                while let Some(Token::Text(more)) = self.peek() {
                    text.push_str(more);
                    self.at += 1;
                }
                Ok(Expr::Const(Value::text(text)))
            }
            Token::Name(word) => match word.as_str() {
                "None" => self.constant(Value::None),
                "True" => self.constant(Value::Bool(true)),
                "False" => self.constant(Value::Bool(false)),
                _ => self.name().map(Expr::Name),
            },
            Token::Sign("(") => {
                self.at += 1;
                if self.take_sign(")") {
                    return Ok(Expr::Tuple(Vec::new()));
                }
                let tree = self.list_or_one()?;
                let tree = self.comprehension(tree)?;
                self.need_sign(")")?;
                Ok(tree)
            }
            Token::Sign("[") => {
                self.at += 1;
                self.list()
            }
            Token::Sign("{") => {
                self.at += 1;
                self.dict()
            }
            other => Err(unexpected(Some(&other))),
        }
    }

    fn constant(&mut self, constant: Value) -> Result<Expr, ExpressionError> {
        self.at += 1;
        Ok(Expr::Const(constant))
    }

    fn list(&mut self) -> Result<Expr, ExpressionError> {
        let mut items = Vec::new();
        while !self.take_sign("]") {
            let item = self.expression()?;
            if items.is_empty() && self.is_word("for") {
                let tree = self.comprehension(item)?;
                self.need_sign("]")?;
                return Ok(tree);
            }
            items.push(item);
            if !self.is_sign("]") {
                self.need_sign(",")?;
            }
        }
        Ok(Expr::List(items))
    }

    fn dict(&mut self) -> Result<Expr, ExpressionError> {
        let mut items = Vec::new();
        while !self.take_sign("}") {
            let key = self.expression()?;
            self.need_sign(":")?;
            items.push((key, self.expression()?));
            if !self.is_sign("}") {
                self.need_sign(",")?;
            }
        }
        Ok(Expr::Dict(items))
    }
}
