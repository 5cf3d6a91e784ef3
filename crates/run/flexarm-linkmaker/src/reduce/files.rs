//! Paths and names of the files of a reduction.
//!
//! All paths are checked before the work starts, and again before anything is written. Not here:
//! writing all files or none (`flexarm-files`), their contents.

use std::path::{Component, Path, PathBuf};

use flexarm_files::{FileError, check_apart, check_free, file_stem, write_all};

use super::job::ReduceJob;

/// Extension of the stress file beside a link file.
pub const STRESS_FILE: &str = "stress";

/// Paths of the results of a reduction or an import.
#[derive(Clone, Debug, Default)]
pub struct ReduceOutputs {
    /// Folder for link file, summary and report, and the job of a reduction; created if missing.
    pub folder: Option<PathBuf>,
    /// Separate path of the link file.
    pub flex: Option<PathBuf>,
    /// Whether to overwrite existing files.
    pub overwrite: bool,
}

/// Paths of one reduction.
#[derive(Debug)]
pub(super) struct Paths {
    pub(super) folder: Option<Folder>,
    pub(super) flex: Option<PathBuf>,
    /// Whether a stress file is written beside each link file.
    with_stress: bool,
    overwrite: bool,
}

/// Paths in the output folder.
#[derive(Debug)]
pub(super) struct Folder {
    pub(super) path: PathBuf,
    pub(super) flex: PathBuf,
    pub(super) job: PathBuf,
    pub(super) summary: PathBuf,
    pub(super) report: PathBuf,
}

impl Paths {
    /// Returns the link file: the separate path if given, else the one in the folder.
    pub(super) fn flex(&self) -> Option<&Path> {
        self.flex.as_deref().or(self.folder.as_ref().map(|folder| folder.flex.as_path()))
    }

    /// Returns the stress files, one beside each link file.
    pub(super) fn stress(&self) -> Vec<PathBuf> {
        let links = self.folder.iter().map(|folder| &folder.flex).chain(&self.flex);
        links.filter(|_| self.with_stress).map(|flex| flex.with_extension(STRESS_FILE)).collect()
    }

    /// Returns the paths of a reduction, after checking that they are free or may be overwritten.
    ///
    /// # Errors
    /// [`FileError::Taken`] for an existing file, [`FileError::Unusable`] for a folder in the place
    /// of a file and for an input.
    pub(super) fn new(outputs: &ReduceOutputs, job: &ReduceJob) -> Result<Self, FileError> {
        let file = file_stem(&job.link_name());
        let folder = outputs.folder.as_ref().map(|path| Folder {
            flex: path.join(format!("{file}.flex")),
            job: path.join("reduce.toml"),
            summary: path.join("summary.json"),
            report: path.join("report.md"),
            path: path.clone(),
        });
        // If both paths are the same file, keep the one in the folder.
        let whole = |path: &Path| std::path::absolute(path).map(|path| normal(&path)).ok();
        let in_folder = folder.as_ref().and_then(|folder| whole(&folder.flex));
        let flex = outputs.flex.clone().filter(|path| in_folder.is_none() || whole(path) != in_folder);
        let with_stress = job.stress == Some(true);
        let paths = Self { folder, flex, with_stress, overwrite: outputs.overwrite };
        let inputs = job.file.iter().chain([&job.mesh]).chain(job.urdf.as_ref().map(|urdf| &urdf.file));
        check_apart(&paths.all(), &inputs.map(|path| &**path).collect::<Vec<_>>())?;
        paths.check()?;
        Ok(paths)
    }

    fn all(&self) -> Vec<PathBuf> {
        let pictures = |f: &Folder| ["interfaces.png", "unit_loads.png", "modes.png"].map(|name| f.path.join(name));
        let texts = |f: &Folder| [&f.flex, &f.job, &f.summary, &f.report].map(Clone::clone);
        let in_folder = self.folder.iter().flat_map(|f| texts(f).into_iter().chain(pictures(f)));
        in_folder.chain(self.flex.clone()).chain(self.stress()).collect()
    }

    fn check(&self) -> Result<(), FileError> {
        check_free(&self.all(), self.overwrite)
    }

    /// Writes all files; see [`write_all`].
    pub(super) fn write(&self, files: &[(PathBuf, &[u8])]) -> Result<(), FileError> {
        self.check()?;
        write_all(files)
    }
}

/// Returns the text of the job file in `folder`.
pub(super) fn job_file(job: &ReduceJob, folder: &Path) -> String {
    let mut job = job.clone();
    job.mesh = from_folder(folder, &job.mesh);
    if let Some(urdf) = &mut job.urdf {
        urdf.file = from_folder(folder, &urdf.file);
    }
    let body = toml::to_string(&job).expect("strings, numbers and tables");
    format!("# The job as run, with all defaults. To repeat it: flexarm reduce reduce.toml\n{body}")
}

/// Returns `path` relative to `folder` if both have a common folder below the root, else absolute.
pub fn from_folder(folder: &Path, path: &Path) -> PathBuf {
    let whole = |p: &Path| std::path::absolute(p).map(|p| normal(&p));
    let (Ok(folder), Ok(path)) = (whole(folder), whole(path)) else { return path.to_owned() };
    let shared = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let below_root = folder.components().take(shared).filter(|c| matches!(c, Component::Normal(_))).count();
    if below_root == 0 {
        return path;
    }
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(path.components().skip(shared)).collect()
}

/// Returns the path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut sum, component| {
        match component {
            Component::ParentDir => {
                sum.pop();
            }
            Component::CurDir => {}
            other => sum.push(other),
        }
        sum
    })
}
