#!/usr/bin/env bash
# Times of Pinocchio's C++ recursions on the reference arm, and of C code that is generated from them, beside our own.
#
#     tools/pinocchio_bench.sh VENV        VENV: a Python environment with `pip install pin casadi`
#
# Needs g++, Eigen (Debian: libeigen3-dev) and cargo. The models come from the example reference_arm_text. Builds with
# -O3, with and without -march=native, header-only (some minutes); prints CSV in ns per call, ours and theirs in turn, twice.
# Without casadi the generated code is left out. Compare minima, on a quiet machine.
set -euo pipefail
cd "$(dirname "$0")/.."

venv=${1:?usage: tools/pinocchio_bench.sh VENV (a Python environment with \`pip install pin casadi\`)}
prefix=$("$venv/bin/python" -c 'import pathlib, pinocchio
print(next((p for p in pathlib.Path(pinocchio.__file__).parents if (p / "include" / "pinocchio").is_dir()), "headers of Pinocchio"))')
casadi=$("$venv/bin/python" -c 'import os, casadi; print(os.path.dirname(casadi.__file__))' 2>/dev/null || true)
eigen=${EIGEN:-/usr/include/eigen3}
for folder in "$prefix/include/pinocchio" "$eigen/Eigen"; do
    [ -d "$folder" ] || { echo "error: no folder $folder (pip install pin; apt-get install libeigen3-dev, or set EIGEN)" >&2; exit 1; }
done

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cargo build --release --quiet --workspace --example reference_arm_text --example recursion_times
examples=${CARGO_TARGET_DIR:-target}/release/examples
"$examples/reference_arm_text" > "$work/arm.txt"

compile() { # source, name, further flags
    local source=$1 name=$2
    shift 2
    # Boost must allow for the 25 types of the joint variant and the long argument lists of the visitors.
    "${CXX:-g++}" -std=c++17 -DNDEBUG -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS -DBOOST_MPL_LIMIT_LIST_SIZE=30 \
        -DBOOST_MPL_LIMIT_VECTOR_SIZE=30 -DBOOST_FUSION_INVOKE_MAX_ARITY=12 -w -isystem "$prefix/include" -isystem "$eigen" \
        "tools/$source" -o "$work/$name" "$@"
}
compile pinocchio_bench.cpp plain -O3 &
first=$!
compile pinocchio_bench.cpp native -O3 -march=native
wait "$first"
builds=(plain native)

if [ -n "$casadi" ]; then
    compile pinocchio_codegen.cpp codegen -O0 -isystem "$casadi/include" -L"$casadi" -lcasadi -Wl,-rpath,"$casadi"
    "$work/codegen" "$work" < "$work/arm.txt"
    for flags in "" -march=native; do
        name=generated${flags:+_native}
        "${CC:-cc}" -O3 $flags -w -I"$work" -c "$work/recursions.c" -o "$work/$name.o"
        "${CC:-cc}" -O2 -w -I"$work" tools/pinocchio_codegen_bench.c "$work/$name.o" -lm -o "$work/$name"
        builds+=("$name")
    done
else
    echo "skipped: generated code (pip install casadi)" >&2
fi

"${CXX:-g++}" --version | head -n 1
"$venv/bin/python" -c 'import pinocchio; print("Pinocchio", pinocchio.__version__)'
echo "build,model,function,minimum_ns,median_ns"
for _ in 1 2; do
    "$examples/recursion_times"
    for build in "${builds[@]}"; do
        "$work/$build" "$build" < "$work/arm.txt"
    done
done
