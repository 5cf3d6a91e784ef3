//! Substitutions `$(arg name)`, `$(find package)`, `$(env NAME)`, `$(optenv NAME default)`,
//! `$(eval expression)`, `$(dirname)` and `$(cwd)`. Their results are text.

use std::path::{Path, PathBuf};

use flexarm_settings::Setting;

use super::Interpreter;
use super::expression::value::{Value, float_of, int_of};
use super::expression::{ExpressionError, shortened};
use super::scope::Table;
use flexarm_settings::closest;

const COMMANDS: [&str; 7] = ["arg", "find", "env", "optenv", "eval", "dirname", "cwd"];

impl Interpreter<'_> {
    /// Evaluates the text between `$(` and `)`.
    pub(crate) fn substitution(&mut self, inner: &str) -> Result<String, ExpressionError> {
        if let Some(expression) = inner.strip_prefix("eval ") {
            return self.eval(expression);
        }
        let words: Vec<&str> = inner.split_whitespace().collect();
        let text = match &words[..] {
            ["arg", name] => self.argument(name)?,
            ["find", package] => self.package(package)?.display().to_string(),
            ["env", name] => self.variable(name).ok_or_else(|| {
                let message = format!("the environment variable {name} is not set");
                ExpressionError::new(message).help("set it, or write $(optenv NAME default) in the file")
            })?,
            ["optenv", name, default @ ..] => self.variable(name).unwrap_or_else(|| default.join(" ")),
            ["dirname"] => shown(self.here().parent()),
            ["cwd"] => shown(std::env::current_dir().ok().as_deref()),
            [command, ..] if !COMMANDS.contains(command) => {
                let trouble = ExpressionError::new(format!("$({}) is not known", shortened(inner)));
                return Err(match closest(command, COMMANDS) {
                    Some(meant) => trouble.help(format!("did you mean $({meant} ...)?")),
                    None => trouble.help(format!("known are {}", COMMANDS.join(", "))),
                });
            }
            _ => return Err(ExpressionError::new(format!("$({}) needs one name", shortened(inner)))),
        };
        self.charge(text.len())?;
        Ok(text)
    }

    /// Value of an environment variable.
    fn variable(&mut self, name: &str) -> Option<String> {
        let value = std::env::var(name).ok()?;
        self.note_source(format!("the environment variable {name}"));
        Some(value)
    }

    /// Value of an argument of the document.
    pub(crate) fn argument(&mut self, name: &str) -> Result<String, ExpressionError> {
        self.used_arguments.insert(name.to_owned());
        self.arguments.get(name).cloned().ok_or_else(|| {
            let setting = Setting::Argument;
            let help =
                format!("give it with {setting} {name}=VALUE, or by args = {{ {name} = ... }} in the robot file");
            ExpressionError::new(format!("the argument {name:?} has no value")).help(help)
        })
    }

    /// Folder of a package.
    fn package(&mut self, name: &str) -> Result<PathBuf, ExpressionError> {
        if let Some(folder) = self.packages.get(name) {
            return Ok(folder.clone());
        }
        let found = self.resolver.find_package(name, self.files.last().and_then(|f| f.parent()));
        let folder = found.map_err(|missing| ExpressionError::new(missing.reason).help(missing.help))?;
        self.packages.insert(name.to_owned(), folder.clone());
        Ok(folder)
    }

    /// Evaluates `$(eval ...)`: arguments are variables, converted to numbers if they look like
    /// numbers.
    fn eval(&mut self, expression: &str) -> Result<String, ExpressionError> {
        let scope = Table::root();
        for (name, value) in &self.arguments {
            scope.define(name, typed(value));
        }
        for (name, value) in [("true", true), ("false", false)] {
            scope.define(name, Value::Bool(value));
        }
        self.used_arguments.extend(self.arguments.keys().cloned());
        let value = self.expression(expression, &scope)?;
        self.shown(&value)
    }

    /// Absolute path of the file being read.
    fn here(&self) -> PathBuf {
        let file: &Path = self.files.last().map_or(Path::new("."), |file| file);
        std::path::absolute(file).unwrap_or_else(|_| file.to_owned())
    }

    /// Resolves a path relative to the file being read.
    pub(crate) fn beside(&self, path: &str) -> PathBuf {
        match self.files.last().and_then(|file| file.parent()) {
            Some(folder) => folder.join(path),
            None => PathBuf::from(path),
        }
    }
}

fn shown(path: Option<&Path>) -> String {
    path.map(|p| p.display().to_string()).unwrap_or_default()
}

fn typed(text: &str) -> Value {
    let number = if text.contains('.') { float_of(text).map(Value::Float) } else { int_of(text).map(Value::Int) };
    number.unwrap_or_else(|| match text.to_lowercase().as_str() {
        "true" => Value::Bool(true),
        "false" => Value::Bool(false),
        _ => Value::text(text),
    })
}
