//! The page and the files that belong to it.

use std::path::{Path, PathBuf};

use flexarm_files::{check_free, write_all};

use crate::Error;
use crate::Verification;
use crate::check::{Difference, differences, same_picture};
use crate::page::{Block, Table, claims_table, markdown, table_text, word};

/// File name of the page.
pub const PAGE: &str = "verification.md";
/// Folder of the pictures, next to the page.
const PICTURES: &str = "verification";
/// File with every number at full precision.
const NUMBERS: &str = "verification.json";

const HEAD: &str = "\
# Verification

The case studies of this project: each method against each truth. Every number and picture on this page is written by one command from the files in \
`robots/`, `trajectories/` and `tests/verification/`:

```sh
cargo run --release -p flexarm-verify -- -o docs --force
```

`CASE` after `--` runs one case, `--check docs/verification.md` says whether the page is still what the command writes. Units are SI unless a head says \
otherwise; errors are relative: `4.6e-7` is a fraction, from 0.1 % on they are in per cent; what is below 1e-9 is printed as that, because it is rounding and differs between machines.

Every claim has a bound, and the command fails if one does not hold; all of them stand at the end of the page. Bounds that were asked for are 1e-6 for statics and 1 % of the peak for motion; the others are up to twice what was measured when the case was \
written, so that a change shows. They say what a model gives, not what is good enough: two parts miss a sixth of the sag under own weight, and that is a claim too.

Methods: *compliant constraints* are rigid parts in maximal coordinates with SPOOK, stiffness in the axes of the proximal part (local) or of the world (global); \
*spring-damper* is the same parts in reduced coordinates with generalised-alpha; *n parts* are chains of rigid parts; *modal* links bend in a floating frame. \
[theory.md](theory.md) has the equations.
";

/// Output files of a verification.
#[derive(Clone, Debug)]
pub struct VerificationFiles {
    folder: PathBuf,
    overwrite: bool,
}

/// Returns the lines and pictures in which a stored page differs from a verification.
///
/// # Errors
/// [`flexarm::Error::File`] if a figure has nothing to draw.
pub fn differences_from(stored: &str, path: &Path, verification: &Verification) -> Result<Vec<Difference>, Error> {
    let mut found = differences(stored, &verification.page());
    let folder = path.parent().unwrap_or(Path::new(".")).join(PICTURES);
    for (name, picture) in verification.pictures()? {
        let place = folder.join(format!("{name}.svg"));
        let old = std::fs::read_to_string(&place).unwrap_or_default();
        if old != picture && !same_picture(&old, &picture) {
            let stored = if old.is_empty() { "(nothing that can be read)" } else { "another picture" };
            found.push(Difference { line: 0, stored: stored.into(), found: place.display().to_string() });
        }
    }
    Ok(found)
}

impl VerificationFiles {
    /// Output files in a folder. Refused if the page or its pictures already exist and may not be
    /// overwritten, or if the folder is not writable.
    ///
    /// # Errors
    /// [`flexarm::Error::File`].
    pub fn new(folder: impl Into<PathBuf>, overwrite: bool) -> Result<Self, Error> {
        let folder = folder.into();
        check_free(&[folder.join(PAGE), folder.join(NUMBERS)], overwrite)?;
        let pictures = folder.join(PICTURES);
        if !overwrite && pictures.exists() {
            return Err(flexarm::Error::Taken { path: pictures, place: "folder", movable: false }.into());
        }
        // Check write permission now rather than after a minute of computing.
        let there = folder.ancestors().find(|above| above.is_dir()).unwrap_or(Path::new("."));
        let probe = there.join(format!(".flexarm-{}", std::process::id()));
        std::fs::write(&probe, "").map_err(|source| flexarm::Error::Write { path: there.to_owned(), source })?;
        let _ = std::fs::remove_file(&probe);
        Ok(Self { folder, overwrite })
    }

    /// Path of the page.
    pub fn page(&self) -> PathBuf {
        self.folder.join(PAGE)
    }

    /// Writes page, pictures and numbers; either all of them or none.
    ///
    /// # Errors
    /// [`flexarm::Error::File`], [`flexarm::Error::Write`].
    pub fn write(&self, verification: &Verification) -> Result<(), Error> {
        let mut files: Vec<(PathBuf, String)> = Vec::new();
        files.push((self.page(), verification.page()));
        files.push((self.folder.join(NUMBERS), verification.json() + "\n"));
        for (name, picture) in verification.pictures()? {
            files.push((self.folder.join(PICTURES).join(format!("{name}.svg")), picture));
        }
        let paths: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
        check_free(&paths, self.overwrite)?;
        Ok(write_all(&files)?)
    }
}

impl Verification {
    /// Returns the page as Markdown.
    pub fn page(&self) -> String {
        let mut text = HEAD.to_owned();
        if self.quick || self.cases.len() < crate::case_names().len() {
            let names: Vec<&str> = self.cases.iter().map(|case| case.name.as_str()).collect();
            let quick = if self.quick { ", quick: what takes long is left out" } else { "" };
            text += &format!("\n**This is a part of the page: {}{quick}.**\n", names.join(", "));
        }
        let mut table = Table::new("", &["case", "claims", "hold"]);
        for case in &self.cases {
            let holding = case.claims().filter(|claim| claim.holds).count();
            let cells = [case.title.clone(), case.claims().count().to_string(), holding.to_string()];
            table.rows.push(cells.into_iter().map(word).collect());
        }
        text += &table_text(&table);
        for case in &self.cases {
            text += &format!("\n{}", markdown(case, PICTURES));
        }
        text + "\n## All claims\n" + &table_text(&claims_table(&self.cases))
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
        let figures = self.cases.iter().flat_map(|case| &case.blocks).filter_map(|block| match block {
            Block::Figure(figure) => Some(figure),
            _ => None,
        });
        figures
            .map(|figure| {
                let fault = |e| flexarm::Error::File { path: Path::new(&figure.name).to_owned(), what: format!("{e}") };
                Ok((figure.name.clone(), figure.svg().map_err(fault)?))
            })
            .collect()
    }
}
