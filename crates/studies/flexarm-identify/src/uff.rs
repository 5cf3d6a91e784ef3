//! Universal files with dataset 58: functions of a modal test, as text (58) and binary (58b).
//! Dataset 164 gives their units.
//!
//! Start at [`read_functions`]. It reads frequency responses (function type 4) and skips other
//! functions and other datasets.
//!
//! Not here: units of the values and nodes of the arm ([`crate::response_file`]).

use std::path::Path;

use flexarm_files::TextFileError;
use nalgebra::Complex;

/// Maximum number of values of a function.
const MAX: usize = 10_000_000;
/// Number of header lines before the values of a function.
const HEAD: usize = 11;
/// Function type of a frequency response.
const RESPONSE: i64 = 4;

/// Frequency response in a file.
#[derive(Clone, Debug, PartialEq)]
#[doc(hidden)]
pub struct UffFunction {
    /// First line of its dataset, from 1.
    pub line: usize,
    /// Node and direction (±1 to ±3 for x, y, z) of the response.
    pub response: (i64, i64),
    /// Node and direction of the force.
    pub reference: (i64, i64),
    /// Measured quantity: 8 displacement, 11 velocity, 12 acceleration; others are unknown.
    pub ordinate: i64,
    /// Unit label in the file; may be empty.
    pub unit: String,
    /// Length and force units of the file per m and N, if dataset 164 precedes the function.
    pub per_si: Option<[f64; 2]>,
    /// Frequencies (Hz) and values.
    pub values: Vec<(f64, Complex<f64>)>,
}

/// Reads all frequency responses of a file.
///
/// * `path`: of the file, for messages.
///
/// # Errors
/// [`TextFileError`] with the line: no dataset, no frequency response, a header or a value that is not
/// of the format, a file that ends early.
pub fn read_functions(path: &Path, bytes: &[u8]) -> Result<Vec<UffFunction>, TextFileError> {
    let mut reader = Lines { path, bytes, at: 0, line: 0 };
    let (mut found, mut per_si, mut sets) = (Vec::new(), None, 0);
    while let Some(line) = reader.next() {
        if line.trim() != "-1" {
            continue;
        }
        let Some(kind) = reader.next() else { break };
        let start = reader.line;
        sets += 1;
        let mut words = kind.split_whitespace();
        match words.next() {
            Some("58") => found.extend(function(&mut reader, start, None, per_si)?),
            Some("58b") => {
                let numbers: Vec<&str> = words.collect();
                let binary = Binary::of(&numbers).ok_or_else(|| {
                    let expected = "`58b`, byte order (1 or 2), number format (2), lines and bytes";
                    reader.unexpected(expected, kind.clone())
                })?;
                found.extend(function(&mut reader, start, Some(binary), per_si)?);
            }
            Some("164") => per_si = Some(units(&mut reader)?),
            _ => {}
        }
        // Skips to the end of the dataset.
        while let Some(line) = reader.next() {
            if line.trim() == "-1" {
                break;
            }
        }
    }
    match (sets, found.is_empty()) {
        (0, _) => Err(reader.error(1, "this is not a universal file: it has no dataset between lines of -1")),
        (_, true) => Err(reader.error(1, "the file has no frequency response (dataset 58 with function type 4)")),
        _ => Ok(found),
    }
}

/// Lines of text, with binary data possibly in between.
struct Lines<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    /// Bytes read.
    at: usize,
    /// Lines read.
    line: usize,
}

impl Lines<'_> {
    fn next(&mut self) -> Option<String> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|b| *b == b'\n').map_or(rest.len(), |k| k + 1);
        self.at += length;
        self.line += 1;
        Some(
            rest[..length].iter().map(|b| char::from(*b)).collect::<String>().trim_end_matches(['\n', '\r']).to_owned(),
        )
    }

    fn expect(&mut self, expected: &'static str) -> Result<String, TextFileError> {
        let line = self.line + 1;
        self.next().ok_or_else(|| self.error(line, format!("the file ends, expected {expected}")))
    }

    fn error(&self, line: usize, message: impl Into<String>) -> TextFileError {
        TextFileError { path: self.path.to_owned(), line, column: 1, message: message.into(), page: "measurements" }
    }

    /// Returns the error for the line read last, or for a word of it.
    fn unexpected(&self, expected: &'static str, found: String) -> TextFileError {
        self.error(self.line, format!("expected {expected}, found {found:?}"))
    }
}

/// Binary format of a dataset 58b.
struct Binary {
    little: bool,
    bytes: usize,
}

impl Binary {
    /// Reads byte order, number format, number of header lines, and number of bytes.
    fn of(words: &[&str]) -> Option<Self> {
        let number = |k: usize| words.get(k)?.parse::<usize>().ok();
        let (order, format, lines, bytes) = (number(0)?, number(1)?, number(2)?, number(3)?);
        ((order == 1 || order == 2) && format == 2 && lines == HEAD).then_some(Self { little: order == 1, bytes })
    }
}

/// Reads the factors from SI to the units of the file: length, force.
fn units(reader: &mut Lines<'_>) -> Result<[f64; 2], TextFileError> {
    reader.expect("the code of the units")?;
    let line = reader.expect("factors of the units")?;
    let factors: Option<Vec<f64>> = line.split_whitespace().map(number).collect();
    match factors.as_deref() {
        Some([length, force, ..]) if *length > 0.0 && *force > 0.0 => Ok([*length, *force]),
        _ => Err(reader.unexpected("factors of length and force above 0", line)),
    }
}

/// Parses a number in Fortran notation.
fn number(word: &str) -> Option<f64> {
    word.replace(['D', 'd'], "E").parse().ok().filter(|x: &f64| x.is_finite())
}

/// Returns the trimmed characters of a line in a range of columns.
fn part(line: &str, from: usize, to: usize) -> String {
    line.chars().skip(from).take(to - from).collect::<String>().trim().to_owned()
}

/// Form of the values of a function.
struct ValueForm {
    /// Line of the form.
    line: usize,
    /// 2 real, 4 real in double precision, 5 complex, 6 complex in double precision.
    code: i64,
    count: usize,
    /// First abscissa and spacing; `None` if each value has an abscissa of its own.
    even: Option<(f64, f64)>,
}

impl ValueForm {
    fn read(reader: &mut Lines<'_>) -> Result<Self, TextFileError> {
        let text = reader.expect("form of the values")?;
        let line = reader.line;
        let words: Vec<Option<f64>> = text.split_whitespace().map(number).collect();
        let word = |k: usize| words.get(k).copied().flatten();
        let (Some(form), Some(count), Some(spacing), Some(first), Some(step)) =
            (word(0), word(1), word(2), word(3), word(4))
        else {
            return Err(reader.unexpected("form, number and spacing of the values", text));
        };
        if !(0.0..=MAX as f64).contains(&count) || count.fract() != 0.0 {
            let text = format!("the number of values is {count}, expected a whole number up to {MAX}");
            return Err(reader.error(line, text));
        }
        let even = (spacing == 1.0).then_some((first, step));
        Ok(Self { line, code: form as i64, count: count as usize, even })
    }

    fn is_complex(&self) -> bool {
        matches!(self.code, 5 | 6)
    }

    fn is_double(&self) -> bool {
        matches!(self.code, 4 | 6)
    }

    /// Returns how many numbers the file has for each value.
    fn per_value(&self) -> usize {
        usize::from(self.even.is_none()) + 1 + usize::from(self.is_complex())
    }
}

/// Reads the dataset of a function after its first line; `None` if it is no frequency response.
///
/// * `start`: line of the dataset; `binary`: format of its values if they are binary.
fn function(
    reader: &mut Lines<'_>,
    start: usize,
    binary: Option<Binary>,
    per_si: Option<[f64; 2]>,
) -> Result<Option<UffFunction>, TextFileError> {
    // Records 1 to 5 are names; record 6 has the type of the function and the two nodes in columns.
    for _ in 0..5 {
        reader.expect("the name of a function")?;
    }
    let line = reader.expect("kind and places of a function")?;
    let whole = |from: usize, to: usize| part(&line, from, to).parse::<i64>().ok();
    let fields = (whole(0, 5), whole(41, 51), whole(51, 55), whole(66, 76), whole(76, 80));
    let (Some(kind), Some(node), Some(direction), Some(other), Some(other_direction)) = fields else {
        return Err(reader.unexpected("kind, nodes and directions in their columns", line));
    };
    // Record 7 is the form of the values; records 8 to 11 describe the axes.
    let form = ValueForm::read(reader)?;
    reader.expect("the abscissa")?;
    let line = reader.expect("the ordinate")?;
    let ordinate = part(&line, 0, 10).parse::<i64>().unwrap_or(0);
    let unit = part(&line, 47, 67);
    reader.expect("the denominator")?;
    reader.expect("the third axis")?;
    if !matches!(form.code, 2 | 4 | 5 | 6) {
        let ValueForm { line, code, .. } = form;
        return Err(reader.error(line, format!("form {code} of values is not known; use 2, 4, 5 or 6")));
    }
    let numbers = match binary {
        Some(binary) => bytes_to_numbers(reader, &binary, &form)?,
        None => text_to_numbers(reader, &form)?,
    };
    // The values of other functions are read too: the next dataset starts behind them.
    if kind != RESPONSE || !form.is_complex() {
        return Ok(None);
    }
    let value = |(k, row): (usize, &[f64])| match form.even {
        Some((first, step)) => (first + step * k as f64, Complex::new(row[0], row[1])),
        None => (row[0], Complex::new(row[1], row[2])),
    };
    let values: Vec<(f64, Complex<f64>)> = numbers.chunks_exact(form.per_value()).enumerate().map(value).collect();
    if values.iter().any(|(hz, H)| !(hz.is_finite() && H.re.is_finite() && H.im.is_finite())) {
        return Err(reader.error(start, "a value of this function is not finite"));
    }
    let (response, reference) = ((node, direction), (other, other_direction));
    Ok(Some(UffFunction { line: start, response, reference, ordinate, unit, per_si, values }))
}

/// Reads the numbers of a function as text.
fn text_to_numbers(reader: &mut Lines<'_>, form: &ValueForm) -> Result<Vec<f64>, TextFileError> {
    let wanted = form.count * form.per_value();
    let mut numbers = Vec::new();
    while numbers.len() < wanted {
        let line = reader.expect("a value")?;
        if line.trim() == "-1" {
            let (found, head) = (numbers.len(), form.line);
            let text = format!("found {found} of the {wanted} values announced in line {head}");
            return Err(reader.error(reader.line, text));
        }
        for word in fields(&line) {
            numbers.push(number(&word).ok_or_else(|| reader.unexpected("a number", word))?);
        }
    }
    numbers.truncate(wanted);
    Ok(numbers)
}

/// Splits a line into numbers; without blanks between them, a sign starts a new number.
fn fields(line: &str) -> Vec<String> {
    let mut words: Vec<String> = vec![String::new()];
    let mut before = ' ';
    for c in line.chars() {
        let exponent = matches!(before, 'e' | 'E' | 'd' | 'D');
        if c == ' ' || ((c == '-' || c == '+') && !exponent && before != ' ') {
            words.push(String::new());
        }
        if c != ' '
            && let Some(word) = words.last_mut()
        {
            word.push(c);
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Reads the numbers of a function as IEEE 754 bytes.
fn bytes_to_numbers(reader: &mut Lines<'_>, binary: &Binary, form: &ValueForm) -> Result<Vec<f64>, TextFileError> {
    let wanted = form.count * form.per_value();
    let size = if form.is_double() { 8 } else { 4 };
    let bytes = reader.bytes.get(reader.at..).unwrap_or_default();
    if binary.bytes != wanted * size || bytes.len() < binary.bytes {
        let (line, dataset, file) = (form.line, binary.bytes, bytes.len());
        let text =
            format!("{wanted} numbers of {size} bytes are announced; the dataset has {dataset} bytes, the file {file}");
        return Err(reader.error(line, text));
    }
    let value = |chunk: &[u8]| {
        let mut own = [0u8; 8];
        own[..size].copy_from_slice(chunk);
        if !binary.little {
            own[..size].reverse();
        }
        match form.is_double() {
            true => f64::from_le_bytes(own),
            false => f64::from(f32::from_le_bytes([own[0], own[1], own[2], own[3]])),
        }
    };
    let numbers = bytes[..binary.bytes].chunks_exact(size).map(value).collect();
    reader.at += binary.bytes;
    Ok(numbers)
}
