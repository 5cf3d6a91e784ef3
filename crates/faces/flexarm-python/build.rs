//! Copies the data of the wheel (robots, trajectories, licences; the web page and the library of FMUs
//! if they are built) to where maturin finds it, and sets the linker flags of extension modules.

use std::path::Path;
use std::{env, fs, io};

/// Variable with the path of the library of FMUs (`tools/build_wheel.py`).
const LIBRARY: &str = "FLEXARM_FMU_LIBRARY";

fn main() -> io::Result<()> {
    pyo3_build_config::add_extension_module_link_args();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the workspace");
    let share = Path::new(&env::var_os("OUT_DIR").expect("cargo sets it")).join("share");
    if share.exists() {
        fs::remove_dir_all(&share)?; // files deleted at the source must disappear here too
    }
    for folder in ["robots", "trajectories"] {
        println!("cargo::rerun-if-changed={}", root.join(folder).display());
        copy(&root.join(folder), &share.join(folder))?;
    }
    let page = root.join("web/dist");
    println!("cargo::rerun-if-changed={}", page.display());
    if page.join("flexarm.wasm").exists() {
        copy(&page, &share.join("web"))?;
    }
    println!("cargo::rerun-if-env-changed={LIBRARY}");
    if let Some(library) = env::var_os(LIBRARY).as_deref().map(Path::new) {
        fs::create_dir_all(share.join("lib"))?;
        fs::copy(library, share.join("lib").join(library.file_name().expect("a file")))?;
        println!("cargo::rerun-if-changed={}", library.display());
    }
    for licence in ["LICENSE-APACHE", "LICENSE-MIT"] {
        fs::copy(root.join(licence), share.join(licence))?;
    }
    Ok(())
}

fn is_rerun_viewer(name: &str) -> bool {
    name == "rerun.html" || name.starts_with("re_viewer") || name.starts_with("rerun-")
}

fn copy(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        // Meshes of links that are already reduced are available only with the sources, and the viewer
        // of Rerun, which is as large as all else, with rerun-sdk.
        if from.ends_with("fe") && name.ends_with(".msh.gz") || is_rerun_viewer(&name) {
            continue;
        }
        let to = to.join(entry.file_name());
        if entry.file_type()?.is_dir() { copy(&entry.path(), &to)? } else { fs::copy(entry.path(), &to).map(drop)? }
    }
    Ok(())
}
