//! `flexarm sweep plan`: files with which an existing engine runs the shards of a study and merges
//! them.
//!
//! An engine is a function from a [`Plan`] to files. All engines run the same command with the
//! number of a shard. Results go into one folder, in which no two shards write the same file, and a
//! killed shard continues when it is started again.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use flexarm::sweep::{Sweep, SweepError, write_files};
use serde::Serialize;

use super::{FINDERS, clean};
use crate::failure::Failure;
use crate::terminal::{Terminal, answer, to_json};

#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// The study (.toml)
    pub(crate) study: PathBuf,
    /// Number of shards
    #[arg(short = 'n', long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) shards: u32,
    /// Engine that runs the shards
    #[arg(long, value_enum, default_value_t = Engine::None)]
    pub(crate) engine: Engine,
    /// Path of the program on the machines of the shards [default: this one]
    #[arg(long, value_name = "PATH")]
    pub(crate) program: Option<PathBuf>,
    /// Cores per shard
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) cores: u16,
    /// Folder of the results [default: out/ and the name of the study]
    #[arg(long, value_name = "FOLDER")]
    pub(crate) results: Option<PathBuf>,
    /// Folder of the plan [default: the name of the study and _plan]
    #[arg(short, long, help_heading = "Files", value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite files in the folder of the plan
    #[arg(long, help_heading = "Files")]
    pub(crate) force: bool,
}

/// Engine that runs shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Engine {
    /// A shell script: one after the other, or with GNU parallel
    None,
    /// A Slurm job array, and a job that merges
    Slurm,
    /// HyperQueue tasks
    Hyperqueue,
}

/// Input of all engines.
struct Plan<'a> {
    args: &'a PlanArgs,
    name: String,
    program: String,
    study: String,
    results: String,
    folder: &'a Path,
}

/// Answer of `flexarm sweep plan`.
#[derive(Debug, Serialize)]
struct PlanSummary {
    study: String,
    runs: usize,
    shards: u32,
    engine: Engine,
    /// Command to type.
    start: String,
    files: Vec<String>,
}

pub(crate) fn run(terminal: &Terminal, args: &PlanArgs) -> Result<ExitCode, Failure> {
    let sweep = Sweep::load(&args.study, &FINDERS)?;
    let runs = sweep.runs();
    if args.shards as usize > runs {
        let error = SweepError::Shard { number: 1, of: args.shards as usize, runs };
        return Err(flexarm::Error::from(error).into());
    }
    let name = clean(sweep.name());
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from(format!("{name}_plan")));
    // An engine may start shards in any folder: all paths are absolute.
    let whole =
        |path: &Path| quoted(&std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string());
    let program = args.program.clone().or_else(|| std::env::current_exe().ok());
    let program = program.unwrap_or_else(|| PathBuf::from("flexarm"));
    let results = args.results.clone().unwrap_or_else(|| Path::new("out").join(&name));
    let plan = Plan {
        args,
        name,
        program: quoted(&program.display().to_string()),
        study: whole(&args.study),
        results: whole(&results),
        folder: &folder,
    };
    let (files, start) = match args.engine {
        Engine::None => plan.none(),
        Engine::Slurm => plan.slurm(),
        Engine::Hyperqueue => plan.hyperqueue(),
    };
    write_files(&files, args.force)?;
    let summary = PlanSummary {
        study: plan.name.clone(),
        runs,
        shards: args.shards,
        engine: args.engine,
        start,
        files: files.iter().map(|(path, _)| path.display().to_string()).collect(),
    };
    answer(terminal, || to_json(&summary), || text(&summary));
    Ok(ExitCode::SUCCESS)
}

/// Files, and the command to type.
type Planned = (Vec<(PathBuf, String)>, String);

impl Plan<'_> {
    /// Returns the command of a shard whose number is in a shell variable.
    fn shard(&self, number: &str) -> String {
        let Self { program, study, results, args, .. } = self;
        format!(
            "{program} sweep {study} --shard {number}/{} --threads {} -o {results} --quiet --json",
            args.shards, args.cores
        )
    }

    fn merge(&self) -> String {
        let Self { program, study, results, .. } = self;
        format!("{program} sweep merge {study} {results} --force")
    }

    fn none(&self) -> Planned {
        let n = self.args.shards;
        let list: String = (1..=n).map(|k| self.shard(&k.to_string()) + "\n").collect();
        let script = format!(
            "#!/bin/sh\n# All shards of {}, one after the other, and their merge. In parallel: parallel < shards.txt\nset -e\n\
             for i in $(seq 1 {n}); do\n    {}\ndone\n{}\n",
            self.name,
            self.shard("\"$i\""),
            self.merge()
        );
        let (run, shards) = (self.folder.join("run.sh"), self.folder.join("shards.txt"));
        let start = format!("sh {}", run.display());
        (vec![(run, script), (shards, list)], start)
    }

    /// Scripts for Slurm: an array of shards, and the merge after it.
    fn slurm(&self) -> Planned {
        let Self { name, args, folder, .. } = self;
        let (n, cores) = (args.shards, args.cores);
        let job = format!(
            "#!/bin/bash\n#SBATCH --job-name={name}\n#SBATCH --array=1-{n}\n#SBATCH --cpus-per-task={cores}\n#SBATCH --requeue\n\
             #SBATCH --open-mode=append\n#SBATCH --output={name}-%a.log\n# A task that is requeued continues where it stopped. Set time, memory \
             and partition as your cluster asks for.\nexec {}\n",
            self.shard("\"$SLURM_ARRAY_TASK_ID\"")
        );
        let merge = format!(
            "#!/bin/bash\n#SBATCH --job-name={name}-merge\n#SBATCH --cpus-per-task=1\n#SBATCH --output={name}-merge.log\nexec {}\n",
            self.merge()
        );
        let submit = "#!/bin/sh\n# Submits the shards, and their merge for when all of them are over.\nset -e\ncd \"$(dirname \"$0\")\"\n\
                      job=$(sbatch --parsable shards.sbatch)\nsbatch --dependency=afterok:\"$job\" merge.sbatch\n";
        let files = vec![
            (folder.join("shards.sbatch"), job),
            (folder.join("merge.sbatch"), merge),
            (folder.join("submit.sh"), submit.to_owned()),
        ];
        (files, format!("sh {}", folder.join("submit.sh").display()))
    }

    fn hyperqueue(&self) -> Planned {
        let Self { args, folder, program, study, results, .. } = self;
        let python = include_str!("hyperqueue.py.in")
            .replace("@PROGRAM@", &literal(program))
            .replace("@STUDY@", &literal(study))
            .replace("@RESULTS@", &literal(results))
            .replace("@SHARDS@", &args.shards.to_string())
            .replace("@CORES@", &args.cores.to_string());
        let script = folder.join("submit.py");
        let start = format!("python {}", script.display());
        (vec![(script, python)], start)
    }
}

/// Converts a quoted shell word to a Python string literal, which JSON has too.
fn literal(word: &str) -> String {
    let plain = word.strip_prefix('\'').and_then(|word| word.strip_suffix('\'')).map(|word| word.replace("'\\''", "'"));
    serde_json::Value::from(plain.unwrap_or_else(|| word.to_owned())).to_string()
}

/// Quotes a word for a shell.
pub fn quoted(word: &str) -> String {
    match word.chars().all(|c| c.is_alphanumeric() || "/._-+=:,@".contains(c)) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

fn text(found: &PlanSummary) -> String {
    let mut out = format!("{}: {} runs in {} shards\n", found.study, found.runs, found.shards);
    for file in &found.files {
        out += &format!("file     {file}\n");
    }
    out += &format!("start    {}\n", found.start);
    out
}
