//! Xacro, the macro language of robot descriptions, with the semantics of ROS's xacro (version 2,
//! in the order of the file).
//!
//! Start at [`expand`], which converts a file to one element tree as text, with the origin of each
//! line. Modules: [`document`] has XML as a tree, [`process`] implements the elements of xacro,
//! [`macros`] and [`scope`] what they define, [`text`] splits attributes into pieces,
//! [`expression`] and [`substitution`] evaluate the pieces, [`yaml`] reads `xacro.load_yaml`.
//!
//! Files may be untrusted, so resources are limited: calls, depth and work are counted and bounded,
//! without a clock. The result is the same on every machine, except for what the file requests from
//! the environment.
//!
//! Not here: comments and processing instructions, which are omitted; interpretation of the URDF.
//!
//! # Source
//! <https://github.com/ros/xacro>, version 2.1.1, whose behaviour is followed in unspecified cases.

mod document;
mod expression;
pub(crate) mod macros;
pub(crate) mod process;
mod scope;
mod substitution;
mod text;
mod yaml;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use flexarm_files::read_file;
use flexarm_settings::{Finding, Place, Severity, closest};

use document::Node;
use expression::ExpressionError;
use expression::value::{Value, int_of};

use crate::resolve::Resolver;
use crate::{UrdfError, xml};

/// Maximum work for one document, approximately the number of bytes read and written.
const MAX_WORK: usize = 100_000_000;
/// Work charged for an element, approximately its memory (bytes).
const ELEMENT: usize = 200;
/// Maximum nesting depth of elements, macros, files and expressions.
const MAX_DEPTH: usize = 5_000;
/// Maximum nesting depth of included files.
const MAX_FILES: usize = 50;
/// Maximum size of a file (bytes).
const MAX_BYTES: u64 = 32 << 20;
/// Stack size of the expansion thread (bytes); the maximum depth needs about 40 MB in a debug
/// build.
const STACK: usize = 256 << 20;

/// A document after expansion.
pub(crate) struct Expanded {
    pub(crate) text: String,
    /// Origin of each line of the text.
    pub(crate) origins: Vec<Place>,
    /// Messages of `xacro.warning` etc., and warnings about the arguments.
    pub(crate) remarks: Vec<Finding>,
    /// Macros that are defined but not called, if the document has nothing else.
    pub(crate) idle_macros: Vec<String>,
}

/// Whether the path has the extension of xacro files.
pub(crate) fn is_xacro(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xacro"))
}

/// Whether the text contains xacro syntax.
pub(crate) fn has_xacro(text: &str) -> bool {
    text.contains("<xacro:") || text.contains("${") || text.contains("$(")
}

/// Expands a xacro file.
///
/// * `text`: content of the file at `path`.
/// * `arguments`: values of `$(arg name)`.
///
/// # Errors
/// [`UrdfError::Invalid`] with the place in the file and the enclosing calls.
pub(crate) fn expand(
    text: &str,
    path: &Path,
    resolver: &Resolver<'_>,
    arguments: &[(String, String)],
) -> Result<Expanded, UrdfError> {
    // The depth is bounded, but may need more stack than the caller has left.
    std::thread::scope(|threads| {
        let work = || Interpreter::new(path, resolver, arguments).document(text, path);
        let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(threads, work);
        // Without threads, in a browser, the stack is the one that the program has.
        let Ok(thread) = thread else { return work() };
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

type Outcome<T> = Result<T, Box<Finding>>;

/// Result of an element: nodes in its place, and attributes for the enclosing element.
#[derive(Default)]
struct Content {
    nodes: Vec<Node>,
    attributes: Vec<(String, String)>,
}

/// State of the expansion of a document.
pub(crate) struct Interpreter<'a> {
    resolver: &'a Resolver<'a>,
    /// Files being read, the innermost last.
    files: Vec<Rc<Path>>,
    /// Macros being called, with the places of the calls.
    calls: Vec<(String, Place)>,
    arguments: BTreeMap<String, String>,
    used_arguments: BTreeSet<String>,
    declared_arguments: BTreeSet<String>,
    defined_macros: BTreeSet<String>,
    called_macros: BTreeSet<String>,
    /// Packages found so far.
    packages: HashMap<String, PathBuf>,
    /// Prefixes declared anywhere.
    namespaces: Vec<(String, String)>,
    remarks: Vec<Finding>,
    /// Variables and YAML files whose values are used.
    sources: BTreeSet<String>,
    at: Place,
    work: usize,
    depth: usize,
}

impl<'a> Interpreter<'a> {
    fn new(path: &Path, resolver: &'a Resolver<'a>, arguments: &[(String, String)]) -> Self {
        let file: Rc<Path> = path.into();
        Self {
            resolver,
            at: Place::of_file(path.display()).at(1, 1),
            files: vec![file],
            calls: Vec::new(),
            arguments: arguments.iter().cloned().collect(),
            used_arguments: BTreeSet::new(),
            declared_arguments: BTreeSet::new(),
            defined_macros: BTreeSet::new(),
            called_macros: BTreeSet::new(),
            packages: HashMap::new(),
            namespaces: Vec::new(),
            remarks: Vec::new(),
            sources: BTreeSet::new(),
            work: 0,
            depth: 0,
        }
    }

    fn document(mut self, text: &str, path: &Path) -> Result<Expanded, UrdfError> {
        let given: Vec<String> = self.arguments.keys().cloned().collect();
        let file = self.files[0].clone();
        let root = document::parse(text, &file)?;
        let scope = scope::Table::root();
        let root = self.element(&root, &macros::Macros::new(), &scope)?;
        self.check_arguments(&given, path);
        let has_links = root.elements().any(|e| e.name == "link");
        let idle = self.defined_macros.difference(&self.called_macros).cloned();
        let idle_macros = if has_links { Vec::new() } else { idle.collect() };
        let document::ExpandedText { text, origins } = document::write(&root, &self.namespaces);
        Ok(Expanded { text, origins, remarks: self.remarks, idle_macros })
    }

    /// Warns about unused arguments, which are probably misspelt.
    fn check_arguments(&mut self, given: &[String], path: &Path) {
        for name in given {
            if self.used_arguments.contains(name) || self.declared_arguments.contains(name) {
                continue;
            }
            let known: Vec<&str> = self.declared_arguments.iter().map(String::as_str).collect();
            let help = match (closest(name, known.iter().copied()), known.is_empty()) {
                (Some(meant), _) => format!("did you mean {meant:?}?"),
                (None, true) => "the file has no arguments".to_owned(),
                (None, false) => format!("its arguments are {}", known.join(", ")),
            };
            let message = format!("the argument {name:?} is given, but nothing in the file uses it");
            self.remarks.push(Finding::warning("unused-argument", format!("{}:1:1", path.display()), message, help));
        }
    }

    /// Charges work, and fails if the limit is exceeded.
    fn charge(&mut self, work: usize) -> Result<(), ExpressionError> {
        self.work = self.work.saturating_add(work);
        if self.work <= MAX_WORK {
            return Ok(());
        }
        Err(ExpressionError::new("the file makes too much: more than 100 million letters were looked at or written")
            .help("does a macro call itself without an end, or a list grow with every call?"))
    }

    /// Enters one nesting level; the caller leaves it.
    fn deeper(&mut self) -> Result<(), ExpressionError> {
        self.depth += 1;
        if self.depth <= MAX_DEPTH {
            return Ok(());
        }
        Err(ExpressionError::new("macros, files and properties use each other too deeply")
            .help("does one of them use itself without an end?"))
    }

    /// Reads a file that the document refers to.
    fn read(&mut self, path: &Path) -> Result<String, ExpressionError> {
        let bytes = read_file(path, MAX_BYTES).map_err(|error| {
            ExpressionError::new(format!("{} cannot be read: {error}", path.display()))
                .help("correct the path, or the package")
        })?;
        self.charge(bytes.len())?;
        xml::decode(bytes, path).map_err(|issue| ExpressionError::new(issue.to_string()))
    }

    /// Notes once that the robot, and so each recording of it, has values from outside the
    /// document.
    fn note_source(&mut self, source: String) {
        if self.sources.insert(source.clone()) {
            let message = format!("the robot has values of {source}");
            self.remark(Severity::Note, "xacro-source", message, "recordings carry them");
        }
    }

    /// Creates an error at a place, with the enclosing calls and files on a line each.
    fn fault(&self, at: &Place, trouble: ExpressionError) -> Box<Finding> {
        let calls = self.calls.iter().rev().map(|(name, at)| format!("in the macro {name:?}, called at {at}"));
        let outer = self.files[..self.files.len().saturating_sub(1)].iter().rev();
        let files = outer.map(|file| format!("included from {}", file.display()));
        let trail = shortened_trail(calls.chain(files).collect());
        let lines: String = trail.iter().map(|step| format!("\n  {step}")).collect();
        Box::new(Finding::error("xacro", at.to_string(), trouble.message + &lines, trouble.help))
    }

    fn remark(&mut self, severity: Severity, code: &'static str, message: String, help: &str) {
        if self.remarks.len() < 100 {
            self.remarks.push(Finding { severity, ..Finding::warning(code, self.at.to_string(), message, help) });
        }
    }
}

/// Keeps the ends of a long trail and omits the middle.
fn shortened_trail(mut trail: Vec<String>) -> Vec<String> {
    if trail.len() > 12 {
        let left_out = format!("... {} more ...", trail.len() - 10);
        trail.splice(6..trail.len() - 4, [left_out]);
    }
    trail
}

/// Truth value of a condition; `None` if it has none.
fn boolean(value: &Value) -> Option<bool> {
    match value {
        Value::Str(text) => match &**text {
            "true" | "True" => Some(true),
            "false" | "False" => Some(false),
            text => int_of(text).map(|i| i != 0),
        },
        value => Some(value.is_true()),
    }
}
