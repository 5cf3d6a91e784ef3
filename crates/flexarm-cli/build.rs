//! How the program is linked.
#![allow(clippy::print_stdout, reason = "this is how a build script speaks to cargo")]

/// A program that may be loaded anywhere has 46,000 addresses put right in it whenever it starts, in 170 pages that are copied
/// for that: half of what `flexarm --version` takes. Linked for a fixed place it has none. Libraries, heap and stack are
/// where chance puts them, as ever.
fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let target = |what: &str| std::env::var(format!("CARGO_CFG_TARGET_{what}")).unwrap_or_default();
    if target("OS") == "linux" && target("ENV") == "gnu" {
        println!("cargo:rustc-link-arg-bins=-no-pie");
    }
}
