//! ABB's RAPID: modules with `main`, data types and moves.
//!
//! [`parse`] converts text to statements, [`types`] defines the data types and predefined data,
//! [`functions`] the functions, [`motion`] the moves.
//!
//! Frames: B is the object frame of the work object (user frame, then object frame, then program
//! displacement) in W; T the tool frame on the flange F. Quaternions have the real part first.

mod functions;
mod motion;
mod parse;
mod types;

use std::rc::Rc;

use crate::common::machine::{Dialect, Flow, Machine};
use crate::common::recorder::{Recorded, Recorder};
use crate::common::tree::{Argument, Operator};
use crate::common::value::Value;
use crate::common::{Result, Span, Text, fail, is_among};
use crate::{ReadOptions, decode, given_text};

use motion::Settings;
pub(crate) use parse::SPELLING;

/// RAPID state in addition to variables.
pub(crate) struct Rapid {
    settings: Settings,
    /// Fields of types declared in the files.
    records: types::Records,
    /// Name of the tool whose data are not in the files.
    unknown_tool: Option<Rc<str>>,
    is_given: bool,
}

/// Maximum number of modules searched next to the program.
const MAX_SIBLINGS: usize = 64;

type Rapids<'a> = Machine<'a, Rapid>;

pub(crate) fn read(texts: &mut Vec<Text>, options: &ReadOptions<'_>) -> Result<Recorded> {
    let mut unit = parse::parse(&texts[0], 0)?;
    for (path, bytes) in &options.companions {
        texts.push(Text::new(path, &decode(bytes)));
        unit.take_in(parse::parse(&texts[texts.len() - 1], texts.len() - 1)?);
    }
    let entries = unit.routines.clone();
    if options.find_companions {
        add_siblings(texts, &mut unit)?;
    }
    texts.push(given_text(options, ":=", ";"));
    let given = parse::parse(&texts[texts.len() - 1], texts.len() - 1)?;

    let rapid =
        Rapid { settings: Settings::default(), records: types::Records::new(), unknown_tool: None, is_given: true };
    let mut machine = Machine::new(Recorder::new(options, texts.clone()), rapid);
    machine.dialect.records = unit.records;
    machine.recorder.note_files();
    machine.run(&given.main)?;
    machine.declare_all(&unit.data);
    machine.run(&given.main)?; // takes precedence over the files
    machine.dialect.is_given = false;
    let file_entry = match entries.as_slice() {
        [only] => only.name.clone(),
        _ => "main".into(),
    };
    let entry = options.entry.as_ref().map_or(file_entry, |entry| entry.to_lowercase().into());
    machine.add(unit.routines);
    let name = match machine.routines.get(&entry).cloned() {
        Some(routine) => {
            if let Flow::Leave | Flow::Again = machine.invoke(&routine, &[], routine.span)? {
                return fail(routine.span, "a loop is left outside of a loop");
            }
            unit.name.unwrap_or(entry)
        }
        None if !unit.main.is_empty() => {
            machine.run(&unit.main)?;
            unit.name.unwrap_or_else(|| "main".into())
        }
        None => {
            let mut names: Vec<String> = machine.routines.keys().map(|name| format!("`{name}`")).collect();
            names.sort();
            let hint =
                if names.is_empty() { "it has no routines".into() } else { format!("it has {}", names.join(", ")) };
            return fail(
                Span::default(),
                format!("there is no routine `{entry}` with which the program starts; {hint}: name one (`entry`)"),
            );
        }
    };
    Ok(machine.recorder.finish(&name))
}

/// Adds modules in the folder of the program that are the only ones to declare a name which the
/// program uses but does not declare.
fn add_siblings(texts: &mut Vec<Text>, unit: &mut parse::Unit) -> Result<()> {
    let path = texts[0].path.clone();
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(std::path::Path::new("."));
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    let is_module = |file: &std::path::PathBuf| {
        let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        matches!(ending.as_str(), "mod" | "modx" | "sys" | "sysx") && file.file_name() != path.file_name()
    };
    let mut files: Vec<_> = entries.flatten().map(|entry| entry.path()).filter(is_module).collect();
    files.sort();
    files.truncate(MAX_SIBLINGS);
    let mut siblings: Vec<(Text, parse::Unit)> = Vec::new();
    for file in files {
        let Ok(bytes) = std::fs::read(&file) else { continue };
        let text = Text::new(&file, &decode(&bytes));
        // An unreadable module matters only if it is needed.
        if let Ok(sibling) = parse::parse(&text, 0) {
            siblings.push((text, sibling));
        }
    }
    loop {
        let declared = unit.declared();
        let names: Vec<_> = siblings.iter().map(|(_, sibling)| sibling.declared()).collect();
        let missing = unit.used.iter().filter(|name| !declared.contains(*name));
        let owner = |name: &Rc<str>| {
            let mut owners = names.iter().enumerate().filter(|(_, names)| names.contains(name));
            owners.next().filter(|_| owners.next().is_none()).map(|(at, _)| at)
        };
        let Some(at) = missing.filter_map(owner).min() else { return Ok(()) };
        let (text, _) = siblings.remove(at);
        texts.push(text);
        unit.take_in(parse::parse(&texts[texts.len() - 1], texts.len() - 1)?);
    }
}

impl Dialect for Rapid {
    const FIRST_INDEX: i64 = 1;

    fn name(machine: &mut Rapids<'_>, name: &str, span: Span) -> Result<Value> {
        match types::predefined(name) {
            Some((kind, value)) => Self::coerce(machine, kind, value, span),
            None => Ok(Value::Outside(format!("`{name}`").into())),
        }
    }

    fn function(machine: &mut Rapids<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Value> {
        functions::function(machine, name, arguments, span)
    }

    fn instruction(machine: &mut Rapids<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Flow> {
        if motion::motion(machine, name, arguments, span)? || motion::setting(machine, name, arguments, span)? {
            return Ok(Flow::On);
        }
        match name {
            // Waiting: for a time, or for a signal, whose value is outside the program.
            "waittime" => {
                let seconds = machine.number(arguments, 0, span)?;
                machine.recorder.dwell(seconds, span)?;
            }
            "waituntil" | "waitdi" | "waitdo" | "waitgi" | "waitgo" | "waitai" | "waitao" | "waitsynctask"
            | "waittestandset" => {
                let unknown = || Ok((Value::Outside(format!("`{name}`").into()), span));
                let (condition, at) =
                    if name == "waituntil" { machine.argument(arguments, 0, span) } else { unknown() }?;
                machine.wait_for(condition, at, span)?;
            }
            "waitrob" => machine.recorder.stop(),
            // Stops and the end of a cycle.
            "stop" | "break" => {
                machine.recorder.stop();
                machine.recorder.note("the program stops for the operator: it continues at once", span);
            }
            "exitcycle" => return Ok(Flow::Halt),
            "incr" | "decr" | "add" | "clear" => count(machine, name, arguments, span)?,
            // Dialogues: the answer is outside the program.
            "tpreadnum" | "tpreadfk" | "tpreaddnum" | "uimsgbox" | "clkread" => {
                if let Some(place) = crate::common::machine::positional(arguments, 0).filter(|_| name.starts_with("tp"))
                {
                    machine.assign(place, Value::Outside(format!("what the operator answers to `{name}`").into()))?;
                }
                machine.recorder.note("messages are not shown", span);
            }
            // Instructions that do not move the robot.
            _ if Self::is_still(name) => machine.recorder.note(still_words(name), span),
            _ => {
                return fail(
                    span,
                    format!(
                        "the instruction or routine `{name}` is not known here: give the module that has it (`companions`), or take the \
                         line out if it does not move the robot"
                    ),
                );
            }
        }
        Ok(Flow::On)
    }

    fn coerce(machine: &mut Rapids<'_>, kind: &str, value: Value, span: Span) -> Result<Value> {
        types::coerce(&machine.dialect.records, kind, value, span, 0)
    }

    fn binary(operator: Operator, left: &Value, right: &Value, span: Span) -> Option<Result<Value>> {
        functions::binary(operator, left, right, span)
    }

    fn is_still(name: &str) -> bool {
        const WORDS: &str = "\
            set reset setdo setgo setao pulsedo invertdo tpwrite tperase tpshow errwrite errlog \
            clkstart clkstop clkreset connect idelete ienable idisable iwatch isleep isignaldi \
            isignaldo itimer gripload mechunitload actunit deactunit open close write writebin \
            rewind print softdeact socketcreate socketconnect socketsend socketclose wzenable \
            wzdisable triggio triggequip triggint motionsup eoffsoff load0 bookerrno";
        is_among(name, WORDS)
    }
}

fn still_words(name: &str) -> &'static str {
    match name {
        "set" | "reset" | "setdo" | "setgo" | "setao" | "pulsedo" | "invertdo" => "outputs are not simulated",
        "gripload" | "mechunitload" => "loads of the program are not taken: the robot has its own",
        "connect" | "idelete" | "ienable" | "idisable" | "iwatch" | "isleep" | "isignaldi" | "isignaldo" | "itimer" => {
            "interrupts are not simulated: none comes"
        }
        "triggio" | "triggequip" | "triggint" => "switching on the path is not simulated",
        "actunit" | "deactunit" => "mechanical units beside the robot are not simulated",
        _ => "messages, files, clocks and monitoring are not simulated",
    }
}

/// Runs `Incr`, `Decr`, `Add`, `Clear`.
fn count(machine: &mut Rapids<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<()> {
    let Some(place) = crate::common::machine::positional(arguments, 0).cloned() else {
        return fail(span, "the variable is missing");
    };
    let change = match name {
        "incr" => 1.0,
        "decr" => -1.0,
        "add" => machine.number(arguments, 1, span)?,
        _ => return machine.assign(&place, Value::Number(0.0)),
    };
    match machine.value(&place)? {
        Value::Outside(_) => Ok(()),
        old => {
            let number = old.number(place.span)? + change;
            machine.assign(&place, Value::Number(number))
        }
    }
}
