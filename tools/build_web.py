#!/usr/bin/env python3
"""Builds the page of web/ into web/dist: static files for any server. Needs Node.js 20.19 or newer.

    rustup target add wasm32-wasip1
    python3 tools/build_web.py            the program as WebAssembly, the shipped robots, the page
    python3 tools/build_web.py --test     and the tests in Node.js and in Chromium
    python3 tools/build_web.py --page     the page alone; the program is built already

Where rustup cannot fetch the target, Debian's compiler does as well (12 and later: rustc-web,
rust-web-src, wasi-libc, lld-19; the standard library is then built with the program).
"""
import argparse
import gzip
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WEB = ROOT / "web"
PUBLIC = WEB / "public"
TARGET = "wasm32-wasip1"
PROGRAM = ["--profile", "web", "-p", "flexarm-cli", "--bin", "flexarm", "--no-default-features", "--features", "mcap"]
STACK = "-Clink-arg=-zstack-size=8388608"  # as a native main thread: parsers recurse
DEBIAN = Path("/usr/lib/rustlib/src/rust/library")
WASI_LIBC = Path("/usr/lib/wasm32-wasi")
# Functions that an older wasi-libc lacks; those of a newer one fail likewise.
MISSING = """#![no_std]
#[unsafe(no_mangle)] extern "C" fn pthread_create(_: *mut u8, _: *const u8, _: *const u8, _: *mut u8) -> i32 { 58 }
#[unsafe(no_mangle)] extern "C" fn pthread_attr_init(_: *mut u8) -> i32 { 0 }
#[unsafe(no_mangle)] extern "C" fn pthread_attr_destroy(_: *mut u8) -> i32 { 0 }
#[unsafe(no_mangle)] extern "C" fn pthread_attr_setstacksize(_: *mut u8, _: usize) -> i32 { 0 }
#[unsafe(no_mangle)] extern "C" fn pthread_join(_: *mut u8, _: *mut u8) -> i32 { 58 }
#[unsafe(no_mangle)] extern "C" fn pthread_detach(_: *mut u8) -> i32 { 0 }
#[unsafe(no_mangle)] extern "C" fn realpath(_: *const u8, _: *mut u8) -> *mut u8 { core::ptr::null_mut() }
"""


def run(*command, cwd=ROOT, **environment):
    print("$", *command, flush=True)
    subprocess.run(list(map(str, command)), cwd=cwd, check=True, env={**os.environ, **environment})


def has_target():
    """Whether the compiler of cargo has a standard library for the target."""
    libdir = subprocess.run(
        ["rustc", "--print", "target-libdir", "--target", TARGET], cwd=ROOT, capture_output=True, text=True
    )
    return libdir.returncode == 0 and any(Path(libdir.stdout.strip()).glob("libstd-*.rlib"))


def build_program():
    """Builds the command line for the target; returns its path."""
    target_dir = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    if has_target():
        run("cargo", "rustc", *PROGRAM, "--target", TARGET, "--", STACK)
    elif DEBIAN.is_dir() and WASI_LIBC.is_dir():
        target_dir = target_dir / "web"  # two compilers cannot share a folder
        target_dir.mkdir(parents=True, exist_ok=True)
        missing = target_dir / "missing.rs"
        missing.write_text(MISSING)
        flags = ["-Clink-self-contained=no", "-Clinker=wasm-ld-19", f"-Lnative={WASI_LIBC}"]
        flags += [f"-Clink-arg={missing.with_suffix('.o')}"]
        tools = {"RUSTC": "/usr/bin/rustc", "RUSTC_BOOTSTRAP": "1", "CARGO_TARGET_DIR": str(target_dir)}
        tools["CARGO_TARGET_WASM32_WASIP1_RUSTFLAGS"] = " ".join(flags)
        std = ["-Zbuild-std=std,panic_abort", "--target", TARGET]
        # The object needs the standard library, which a small crate of the workspace brings.
        run("cargo", "build", "--profile", "web", "-p", "flexarm-settings", *std, **tools)
        deps = target_dir / TARGET / "web" / "deps"
        newest = lambda name: max(deps.glob(f"lib{name}-*.rlib"), key=lambda path: path.stat().st_mtime)
        externs = [arg for name in ["core", "compiler_builtins"] for arg in ("--extern", f"{name}={newest(name)}")]
        run("/usr/bin/rustc", "-O", "--edition=2024", "--crate-type=lib", "--emit=obj", "-Cpanic=abort",
            "-Ccodegen-units=1", "--target", TARGET, *externs, "-L", deps, missing,
            "-o", missing.with_suffix(".o"), RUSTC_BOOTSTRAP="1")
        start = f"-Clink-arg={WASI_LIBC / 'crt1-command.o'}"
        run("cargo", "rustc", *PROGRAM, *std, "--", STACK, start, **tools)
    else:
        sys.exit(f"error: the compiler has no standard library for {TARGET}: rustup target add {TARGET}")
    return target_dir / TARGET / "web" / "flexarm.wasm"


def copy_shipped():
    """Copies the shipped robots and motions, with a list of them."""
    shipped = PUBLIC / "shipped"
    shutil.rmtree(shipped, ignore_errors=True)
    tracked = subprocess.run(
        ["git", "ls-files", "robots", "trajectories"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.split()
    robots = []
    for robot in sorted(path.parent for path in (ROOT / "robots").rglob("robot.toml")):
        name = robot.relative_to(ROOT / "robots").as_posix()
        title = (robot / "README.md").read_text().splitlines()[0].lstrip("# ")
        # Meshes of finite elements are the source of the reduced links, which a run does not read.
        files = [path for path in tracked if path.startswith(f"robots/{name}/") and not path.endswith((".msh", ".msh.gz"))]
        robots.append({"name": name, "title": title, "files": files})
    motions = [path for path in tracked if path.startswith("trajectories/") and path.endswith((".toml", ".csv"))]
    named = [{"name": Path(path).stem, "files": [path]} for path in motions if ".loads." not in path]
    for path in [path for entry in robots + named for path in entry["files"]]:
        (shipped / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / path, shipped / path)
    (PUBLIC / "shipped.json").write_text(json.dumps({"robots": robots, "motions": named}))


def pack():
    """Puts a compressed copy beside each large file, which `flexarm serve` sends instead."""
    for path in (WEB / "dist").rglob("*"):
        if path.suffix in (".wasm", ".js", ".css", ".json") and path.stat().st_size > 50_000:
            Path(f"{path}.gz").write_bytes(gzip.compress(path.read_bytes(), 9, mtime=0))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", action="store_true", help="the page alone")
    parser.add_argument("--test", action="store_true", help="run the tests as well")
    args = parser.parse_args()
    PUBLIC.mkdir(parents=True, exist_ok=True)
    if not args.page:
        shutil.copyfile(build_program(), PUBLIC / "flexarm.wasm")
    copy_shipped()
    run("npm", "ci", "--no-fund", "--no-audit", cwd=WEB)
    run("npm", "run", "build", cwd=WEB)
    pack()
    if args.test:
        run("npm", "test", cwd=WEB)
    size = sum(path.stat().st_size for path in (WEB / "dist").rglob("*") if path.is_file())
    print(f"{WEB / 'dist'}: {size / 1e6:.1f} MB; look: cargo run --release -- serve")


if __name__ == "__main__":
    main()
