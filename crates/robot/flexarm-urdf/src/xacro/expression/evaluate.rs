//! Evaluation of an expression tree.
//!
//! Start at [`Interpreter::evaluate`]. Work and depth are charged before each step, so that an
//! expression from an untrusted file ends.
//! Not here: operators ([`super::arithmetic`]), functions ([`super::functions`]), methods and
//! indices ([`super::methods`]).

use std::rc::Rc;

use flexarm_settings::closest;

use super::super::scope::Table;
use super::arithmetic::{binary, compare, unary};
use super::functions::named_value;
use super::methods::{elements, index, slice, unique};
use super::parse::{Clause, Expr};
use super::value::{Value, lookup};
use super::{ExpressionError, Interpreter, Scope};
use crate::report::did_you_mean;

impl Interpreter<'_> {
    pub(super) fn evaluate(&mut self, tree: &Expr, scope: &Scope) -> Result<Value, ExpressionError> {
        self.charge(16)?;
        self.deeper()?;
        let value = self.evaluate_here(tree, scope)?;
        self.depth -= 1;
        Ok(value)
    }

    fn evaluate_here(&mut self, tree: &Expr, scope: &Scope) -> Result<Value, ExpressionError> {
        Ok(match tree {
            Expr::Const(constant) => constant.clone(),
            // Names and containers.
            Expr::Name(name) => return self.name(name, scope),
            Expr::List(items) => Value::list(self.all(items, scope)?),
            Expr::Tuple(items) => Value::Tuple(Rc::new(self.all(items, scope)?)),
            Expr::Dict(items) => {
                let mut pairs = Vec::new();
                for (key, value) in items {
                    pairs.push((self.evaluate(key, scope)?, self.evaluate(value, scope)?));
                }
                Value::Dict(Rc::new(unique(pairs)))
            }
            // Operators.
            Expr::Unary(sign, operand) => return unary(sign, &self.evaluate(operand, scope)?),
            Expr::Binary(sign, left, right) => return self.operation(sign, left, right, scope),
            Expr::Compare(first, rest) => Value::Bool(self.comparison(first, rest, scope)?),
            Expr::And(terms) => return self.until(terms, scope, false),
            Expr::Or(terms) => return self.until(terms, scope, true),
            Expr::If { condition, then, otherwise } => {
                let branch = if self.evaluate(condition, scope)?.is_true() { then } else { otherwise };
                return self.evaluate(branch, scope);
            }
            // Calls and parts of a value.
            Expr::Call { function, arguments, named } => return self.call_tree(function, arguments, named, scope),
            Expr::Attribute(owner, name) => {
                let owner = self.evaluate(owner, scope)?;
                return self.attribute(&owner, name);
            }
            Expr::Index(owner, key) => {
                let (owner, key) = (self.evaluate(owner, scope)?, self.evaluate(key, scope)?);
                self.charge(owner.size())?;
                self.charge_whole(&key)?;
                return index(&owner, &key);
            }
            Expr::Slice(owner, parts) => return self.slice(owner, parts, scope),
            Expr::Comprehension { item, clauses } => {
                let mut items = Vec::new();
                self.comprehend(item, clauses, scope, &mut items)?;
                Value::list(items)
            }
        })
    }

    fn operation(&mut self, sign: &str, left: &Expr, right: &Expr, scope: &Scope) -> Result<Value, ExpressionError> {
        let (left, right) = (self.evaluate(left, scope)?, self.evaluate(right, scope)?);
        self.charge_whole(&left)?;
        self.charge_whole(&right)?;
        let value = binary(sign, &left, &right, &mut |size| self.charge(size))?;
        self.charge(value.size())?;
        Ok(value)
    }

    /// Whether each of the comparisons `a < b <= c` holds; those after the first failure are not
    /// evaluated.
    fn comparison(
        &mut self,
        first: &Expr,
        rest: &[(&'static str, Expr)],
        scope: &Scope,
    ) -> Result<bool, ExpressionError> {
        let mut left = self.evaluate(first, scope)?;
        for (sign, right) in rest {
            let right = self.evaluate(right, scope)?;
            self.charge_whole(&left)?;
            self.charge_whole(&right)?;
            if !compare(sign, &left, &right)? {
                return Ok(false);
            }
            left = right;
        }
        Ok(true)
    }

    fn slice(&mut self, owner: &Expr, parts: &[Option<Box<Expr>>; 3], scope: &Scope) -> Result<Value, ExpressionError> {
        let owner = self.evaluate(owner, scope)?;
        let mut bounds = [None, None, None];
        for (bound, part) in bounds.iter_mut().zip(parts) {
            *bound = match part.as_ref().map(|part| self.evaluate(part, scope)).transpose()? {
                None | Some(Value::None) => None,
                Some(value) => Some(value.as_int().ok_or_else(|| ExpressionError::new("a slice needs whole numbers"))?),
            };
        }
        self.charge(owner.size())?;
        slice(&owner, bounds)
    }

    /// Charges a value with all its elements before it is printed or compared: lists may share
    /// their elements, and be much larger than their memory.
    pub(crate) fn charge_whole(&mut self, value: &Value) -> Result<(), ExpressionError> {
        self.charge(value.size())?;
        match value {
            Value::List(items) | Value::Tuple(items) => items.iter().try_for_each(|item| self.charge_whole(item)),
            Value::Dict(items) => items.iter().try_for_each(|(key, value)| {
                self.charge_whole(key)?;
                self.charge_whole(value)
            }),
            _ => Ok(()),
        }
    }

    /// Converts a value to text.
    pub(crate) fn shown(&mut self, value: &Value) -> Result<String, ExpressionError> {
        self.charge_whole(value)?;
        Ok(value.shown())
    }

    fn all(&mut self, trees: &[Expr], scope: &Scope) -> Result<Vec<Value>, ExpressionError> {
        trees.iter().map(|tree| self.evaluate(tree, scope)).collect()
    }

    /// First value with the truth value `wanted`, otherwise the last one: `and`, `or`.
    fn until(&mut self, terms: &[Expr], scope: &Scope, wanted: bool) -> Result<Value, ExpressionError> {
        let mut value = Value::Bool(!wanted);
        for term in terms {
            value = self.evaluate(term, scope)?;
            if value.is_true() == wanted {
                break;
            }
        }
        Ok(value)
    }

    /// Looks up a property, otherwise a built-in name.
    fn name(&mut self, name: &str, scope: &Scope) -> Result<Value, ExpressionError> {
        if let Some(value) = self.property(scope, name)? {
            return Ok(value);
        }
        named_value(name).ok_or_else(|| {
            let meant = closest(name, scope.names().iter().map(String::as_str));
            let otherwise = "define it with <xacro:property> before it is used, or put quotes around a text";
            ExpressionError::new(format!("the name {name:?} is not defined")).help(did_you_mean(meant, otherwise))
        })
    }

    fn attribute(&mut self, owner: &Value, name: &str) -> Result<Value, ExpressionError> {
        match owner {
            Value::Dict(items) => {
                self.charge(owner.size())?;
                lookup(items, &Value::text(name)).cloned().ok_or_else(|| missing_key(items, name))
            }
            Value::Namespace(table) => self
                .property(table, name)?
                .ok_or_else(|| ExpressionError::new(format!("the namespace has no property {name:?}"))),
            Value::Module(module) => named_value(name)
                .ok_or_else(|| ExpressionError::new(format!("there is no {module}.{name}")).help("is it misspelt?")),
            other => Err(ExpressionError::new(format!("a {} has no attribute {name:?}", other.kind()))),
        }
    }

    fn call_tree(
        &mut self,
        function: &Expr,
        arguments: &[Expr],
        named: &[(String, Expr)],
        scope: &Scope,
    ) -> Result<Value, ExpressionError> {
        // A method call, unless the owner is a module or a namespace.
        let method = match function {
            Expr::Attribute(owner, name) => match self.evaluate(owner, scope)? {
                Value::Module(_) | Value::Namespace(_) => None,
                owner => Some((owner, name)),
            },
            _ => None,
        };
        // Function and arguments, in the order of Python.
        let callee = if method.is_none() { Some(self.evaluate(function, scope)?) } else { None };
        let arguments = self.all(arguments, scope)?;
        let mut by_name = Vec::new();
        for (name, tree) in named {
            by_name.push((name.clone(), self.evaluate(tree, scope)?));
        }
        for argument in arguments.iter().chain(by_name.iter().map(|(_, value)| value)) {
            self.charge_whole(argument)?;
        }
        let value = match (callee, method) {
            (Some(Value::Function(name)), _) => self.call(name, &arguments, by_name)?,
            (Some(other), _) => return Err(ExpressionError::new(format!("a {} cannot be called", other.kind()))),
            (None, Some((owner, name))) => {
                self.charge_whole(&owner)?;
                super::methods::call(&owner, name, &arguments, &by_name, &mut |size| self.charge(size))?
            }
            (None, None) => Value::None,
        };
        self.charge(value.size())?;
        Ok(value)
    }

    /// Appends the items of a comprehension to `found`: loops over the first clause, and calls
    /// itself for the inner ones.
    fn comprehend(
        &mut self,
        item: &Expr,
        clauses: &[Clause],
        scope: &Scope,
        found: &mut Vec<Value>,
    ) -> Result<(), ExpressionError> {
        let Some((clause, inner)) = clauses.split_first() else {
            let value = self.evaluate(item, scope)?;
            self.charge(32 + value.size())?;
            found.push(value);
            return Ok(());
        };
        let items = self.evaluate(&clause.items, scope)?;
        for value in elements(&items)? {
            // Assigns an element to the targets, which only this iteration can use.
            let local = Table::child(scope);
            match &clause.targets[..] {
                [name] => local.define(name, value),
                names => {
                    let values = elements(&value)?;
                    if values.len() != names.len() {
                        let message = format!("{} names for {} values", names.len(), values.len());
                        return Err(ExpressionError::new(message));
                    }
                    names.iter().zip(values).for_each(|(name, value)| local.define(name, value));
                }
            }
            self.charge(200)?;
            // Conditions after a false one are not evaluated.
            let mut is_kept = true;
            for condition in &clause.conditions {
                is_kept = is_kept && self.evaluate(condition, &local)?.is_true();
            }
            if is_kept {
                self.comprehend(item, inner, &local, found)?;
            }
        }
        Ok(())
    }
}

fn missing_key(items: &[(Value, Value)], name: &str) -> ExpressionError {
    let keys: Vec<String> = items.iter().map(|(k, _)| k.shown()).collect();
    let meant = closest(name, keys.iter().map(String::as_str));
    let help = did_you_mean(meant, &format!("its keys are {}", super::shortened(&keys.join(", "))));
    ExpressionError::new(format!("the dictionary has no key {name:?}")).help(help)
}
