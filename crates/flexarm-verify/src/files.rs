//! The page and its files.

use std::path::{Path, PathBuf};

use flexarm::Error;
use flexarm::result_files::{check_free, write_all};

use crate::Verification;
use crate::page::{Block, claims_table, markdown};

/// Name of the page.
pub const PAGE: &str = "verification.md";
/// Folder of the pictures beside it.
const PICTURES: &str = "verification";
/// Every number with all its digits.
const NUMBERS: &str = "verification.json";

const HEAD: &str = "\
# Verification

The case studies of this project: each method against each truth. Every number and picture on this page is written by one command from the files in \
`robots/`, `trajectories/` and `tests/verification/`:

```sh
flexarm verify -o docs --force
```

`flexarm verify CASE` runs one case, `--check docs/verification.md` says whether the page is still what the command prints. Units are SI unless a head says \
otherwise; errors are relative, in per cent from 0.1 % on; what is below 1e-9 is printed as that, because it is rounding and differs between machines.

Methods: *compliant constraints* are rigid parts in maximal coordinates with SPOOK, stiffness in the axes of the proximal part (local) or of the world (global); \
*spring-damper* is the same parts in reduced coordinates with generalised-alpha; *n parts* are chains of rigid parts; *modal* links bend in a floating frame. \
[theory.md](theory.md) has the equations.
";

/// Where everything goes.
#[derive(Clone, Debug)]
pub struct VerificationFiles {
    folder: PathBuf,
    overwrite: bool,
}

impl VerificationFiles {
    /// In a folder; refused if the page is there already and is not to be overwritten.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn new(folder: impl Into<PathBuf>, overwrite: bool) -> Result<Self, Error> {
        let folder = folder.into();
        check_free(&[folder.join(PAGE), folder.join(NUMBERS)], overwrite)?;
        Ok(Self { folder, overwrite })
    }

    /// The page.
    pub fn page(&self) -> PathBuf {
        self.folder.join(PAGE)
    }

    /// Writes page, pictures and numbers, all or nothing.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Write`].
    pub fn write(&self, verification: &Verification) -> Result<(), Error> {
        let mut files: Vec<(PathBuf, String)> = Vec::new();
        files.push((self.page(), verification.page()));
        files.push((self.folder.join(NUMBERS), verification.json() + "\n"));
        for (name, picture) in verification.pictures()? {
            files.push((self.folder.join(PICTURES).join(format!("{name}.svg")), picture));
        }
        let paths: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
        check_free(&paths, self.overwrite)?;
        write_all(&files)
    }
}

impl Verification {
    /// The page, Markdown.
    pub fn page(&self) -> String {
        let claims = claims_table(&self.cases);
        let holding = self.cases.iter().flat_map(|case| case.claims()).filter(|claim| claim.holds).count();
        let all = claims.rows.len();
        let mut text = HEAD.to_owned();
        text += &format!("\n## What is claimed\n\n{holding} of {all} claims hold.\n");
        text += &crate::page::table_text(&claims);
        for case in &self.cases {
            text += &format!("\n{}", markdown(case, PICTURES));
        }
        text
    }

    /// Everything with all digits.
    pub fn json(&self) -> String {
        serde_json::to_string(self).expect("plain numbers and strings")
    }

    /// Name and SVG of each picture.
    ///
    /// # Errors
    /// [`Error::File`] where a figure has nothing to draw.
    pub fn pictures(&self) -> Result<Vec<(String, String)>, Error> {
        let figures = self.cases.iter().flat_map(|case| &case.blocks).filter_map(|block| match block {
            Block::Figure(figure) => Some(figure),
            _ => None,
        });
        figures
            .map(|figure| {
                let fault = |e| Error::File { path: Path::new(&figure.name).to_owned(), what: format!("{e}") };
                Ok((figure.name.clone(), figure.svg().map_err(fault)?))
            })
            .collect()
    }
}
