//! How the program is linked.

use std::env::var;

/// On Linux for its addresses: 57,000 pointers in tables of its libraries need not be put right at every start, which took 0.8 of
/// the 1.9 ms of `flexarm --version`, half of the page faults of a short run.
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let target = ["OS", "ENV", "ARCH"].map(|what| var(format!("CARGO_CFG_TARGET_{what}")).unwrap_or_default());
    if target == ["linux", "gnu", "x86_64"] {
        println!("cargo::rustc-link-arg-bins=-no-pie");
    }
}
