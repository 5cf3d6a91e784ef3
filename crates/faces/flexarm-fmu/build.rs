//! Linker options of the library in an FMU, on Linux: it stays loaded, because an importer may free
//! it while destructors of thread-local values are still to run; and it has no local symbols, which
//! are a third of its size.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-z,nodelete,--strip-all");
    }
}
