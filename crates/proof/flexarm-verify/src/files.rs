//! The pages and the files that belong to them: written as a whole, or compared with stored ones.
//!
//! Not here: the Markdown of a case (`page.rs`), tolerances of a comparison (`check.rs`).

use std::path::{Path, PathBuf};

use flexarm_files::{check_free, write_all};

use crate::check::{Difference, differences, same_picture};
use crate::page::{Case, Claim, Table, markdown, table_text, word};
use crate::{Error, Verification};

/// File name of the first page.
const PAGE: &str = "verification.md";
/// Folder of the pages of the cases and of the pictures, next to the first page.
const CASES: &str = "verification";
/// File with every number at full precision.
const NUMBERS: &str = "verification.json";

const HEAD: &str = "\
# Verification

Each method against each truth. Tables, pictures and claims are written by one command from the files
in `robots/`, `trajectories/` and `tests/verification/`; a claim that does not hold fails it:

```sh
cargo run --release -p flexarm-verify -- -o docs --force       # CASE: that case alone
cargo run --release -p flexarm-verify -- --check docs/verification.md
```

";

const TAIL: &str = "
*Stored* claims compare figures that a script of `tools/crosscheck` wrote, because the data or the
other program are not part of the project: they do not change with the program. All others are
computed again by each run.

Bounds are 1e-6 for statics and 1 % of the peak for motion where these were required; the others are up
to twice the measured value, so that a change shows. They say what a model gives, not what is good
enough: two parts miss a sixth of the sag under own weight, and that is a claim too. Units are SI unless
a heading says otherwise. Errors are relative, in per cent from 0.1 % on; errors below 1e-9 are rounding
and are printed as `< 1e-9`.

*Compliant constraints*: rigid parts in maximal coordinates with SPOOK, stiffness in axes of the
proximal part (local) or of the world (global). *Spring-damper*: the same parts in reduced coordinates
with generalised-alpha. *n parts*: chains of rigid parts. *Modal*: links with modes in a floating frame.
[Formulation and validity](formulation.md) compares them, [theory](theory.md) has the equations.
";

/// Output files of a verification.
#[derive(Clone, Debug)]
pub struct VerificationFiles {
    folder: PathBuf,
    overwrite: bool,
}

/// Returns the lines and pictures in which the stored pages differ from a verification. The first
/// page is compared if no case is left out.
///
/// * `path`: the stored first page.
///
/// # Errors
/// [`flexarm::Error::File`] if a page cannot be read or a figure has nothing to draw.
pub fn differences_from(path: &Path, verification: &Verification) -> Result<Vec<Difference>, Error> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut found = Vec::new();
    for (name, page) in verification.pages() {
        let place = if name == PAGE { path.to_owned() } else { folder.join(&name) };
        let what = |e| format!("the stored page cannot be read: {e}");
        let failed = |e| flexarm::Error::File { path: place.clone(), what: what(e) };
        let stored = std::fs::read_to_string(&place).map_err(failed)?;
        if name != PAGE || verification.is_whole() {
            found.extend(differences(&place, &stored, &page));
        }
    }
    for (name, picture) in verification.pictures()? {
        let place = folder.join(CASES).join(format!("{name}.svg"));
        let old = std::fs::read_to_string(&place).unwrap_or_default();
        if old != picture && !same_picture(&old, &picture) {
            let stored = if old.is_empty() { "(nothing that can be read)" } else { "another picture" };
            found.push(Difference { page: place, line: 0, stored: stored.into(), found: "a picture".into() });
        }
    }
    Ok(found)
}

impl VerificationFiles {
    /// Output files in a folder. Refused if the pages or the pictures already exist and may not be
    /// overwritten, or if the folder is not writable.
    ///
    /// # Errors
    /// [`flexarm::Error::File`].
    pub fn new(folder: impl Into<PathBuf>, overwrite: bool) -> Result<Self, Error> {
        let folder = folder.into();
        check_free(&[folder.join(PAGE), folder.join(NUMBERS)], overwrite)?;
        let cases = folder.join(CASES);
        if !overwrite && cases.exists() {
            return Err(flexarm::Error::Taken { path: cases, place: "folder", movable: false }.into());
        }
        // Check write permission now rather than after a minute of computing.
        let there = folder.ancestors().find(|above| above.is_dir()).unwrap_or(Path::new("."));
        let probe = there.join(format!(".flexarm-{}", std::process::id()));
        std::fs::write(&probe, "").map_err(|source| flexarm::Error::Write { path: there.to_owned(), source })?;
        let _ = std::fs::remove_file(&probe);
        Ok(Self { folder, overwrite })
    }

    /// Path of the first page.
    pub fn page(&self) -> PathBuf {
        self.folder.join(PAGE)
    }

    /// Writes pages, pictures and numbers; either all of them or none.
    ///
    /// # Errors
    /// [`flexarm::Error::File`], [`flexarm::Error::Write`].
    pub fn write(&self, verification: &Verification) -> Result<(), Error> {
        let mut files: Vec<(PathBuf, String)> = Vec::new();
        files.extend(verification.pages().into_iter().map(|(name, page)| (self.folder.join(name), page)));
        files.push((self.folder.join(NUMBERS), verification.json() + "\n"));
        for (name, picture) in verification.pictures()? {
            files.push((self.folder.join(CASES).join(format!("{name}.svg")), picture));
        }
        let paths: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
        check_free(&paths, self.overwrite)?;
        Ok(write_all(&files)?)
    }
}

impl Verification {
    /// Whether no case and no slow part is left out.
    fn is_whole(&self) -> bool {
        !self.quick && self.cases.len() == crate::case_names().len()
    }

    /// Returns file name and Markdown of the first page and of the page of each case.
    pub fn pages(&self) -> Vec<(String, String)> {
        let of_case = |case: &Case| (format!("{CASES}/{}.md", case.name), markdown(case));
        std::iter::once((PAGE.to_owned(), self.first_page())).chain(self.cases.iter().map(of_case)).collect()
    }

    fn first_page(&self) -> String {
        let mut text = HEAD.to_owned();
        if !self.is_whole() {
            let names: Vec<&str> = self.cases.iter().map(|case| case.name.as_str()).collect();
            let quick = if self.quick { ", without slow parts" } else { "" };
            text += &format!("**A part of the cases: {}{quick}.**\n\n", names.join(", "));
        }
        let mut table = Table::new("", &["case", "what is compared", "claims", "hold", "stored"]);
        let (mut covers, mut line) = (String::from("| | |\n| --- | --- |\n"), Vec::new());
        for case in &self.cases {
            let link = format!("[{}]({CASES}/{}.md)", case.title, case.name);
            let count = |of: &dyn Fn(&Claim) -> bool| case.claims().filter(|claim| of(claim)).count().to_string();
            let counts = [count(&|_| true), count(&|claim| claim.holds), count(&|claim| claim.stored)];
            table.rows.push([link, case.summary.clone()].into_iter().chain(counts).map(word).collect());
            if let Some(figure) = case.figures().next() {
                line.push(format!("![{}]({CASES}/{}.svg) {}", figure.caption, figure.name, case.title));
            }
        }
        for pair in line.chunks(2) {
            covers += &format!("| {} | {} |\n", pair[0], pair.get(1).map_or("", String::as_str));
        }
        format!("{}\n{covers}{TAIL}", text + table_text(&table).trim_start())
    }

    /// Returns everything at full precision as JSON.
    pub fn json(&self) -> String {
        serde_json::to_string(self).expect("plain numbers and strings")
    }

    /// Returns name and SVG of each picture.
    ///
    /// # Errors
    /// [`flexarm::Error::File`] if a figure has nothing to draw.
    pub fn pictures(&self) -> Result<Vec<(String, String)>, Error> {
        let figures = self.cases.iter().flat_map(Case::figures);
        figures
            .map(|figure| {
                let fault = |e| flexarm::Error::File { path: Path::new(&figure.name).to_owned(), what: format!("{e}") };
                Ok((figure.name.clone(), figure.svg().map_err(fault)?))
            })
            .collect()
    }
}
