//! How the program is linked.

use std::env::var;

/// On Linux its addresses are those it was linked for: a hundred thousand pointers in tables of its libraries need not be put
/// right at every start, which took 0.3 ms and a copy of each page that holds one.
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let target = ["OS", "ENV", "ARCH"].map(|what| var(format!("CARGO_CFG_TARGET_{what}")).unwrap_or_default());
    if target == ["linux", "gnu", "x86_64"] {
        println!("cargo::rustc-link-arg-bins=-no-pie");
    }
}
