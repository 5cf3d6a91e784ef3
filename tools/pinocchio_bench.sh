#!/usr/bin/env bash
# Times of Pinocchio's C++ recursions on the reference arm, to set beside our own.
#
#     tools/pinocchio_bench.sh VENV        VENV: a Python environment with `pip install pin`
#
# Needs g++, Eigen (Debian: libeigen3-dev) and cargo. The model comes from the example reference_arm_text. Builds with
# -O3, with and without -march=native, header-only (some minutes); prints CSV in ns per call. Compare minima, on a quiet
# machine.
set -euo pipefail
cd "$(dirname "$0")/.."

venv=${1:?usage: tools/pinocchio_bench.sh VENV (a Python environment with \`pip install pin\`)}
prefix=$("$venv/bin/python" -c 'import pathlib, pinocchio
print(next((p for p in pathlib.Path(pinocchio.__file__).parents if (p / "include" / "pinocchio").is_dir()), "headers of Pinocchio"))')
eigen=${EIGEN:-/usr/include/eigen3}
for folder in "$prefix/include/pinocchio" "$eigen/Eigen"; do
    [ -d "$folder" ] || { echo "error: no folder $folder (pip install pin; apt-get install libeigen3-dev, or set EIGEN)" >&2; exit 1; }
done

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cargo run --release --quiet -p flexarm-testkit --example reference_arm_text > "$work/arm.txt"

compile() { # name, further flags
    local name=$1
    shift
    # Boost must allow for the 25 types of the joint variant and the long argument lists of the visitors.
    "${CXX:-g++}" -std=c++17 -O3 -DNDEBUG -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS -DBOOST_MPL_LIMIT_LIST_SIZE=30 \
        -DBOOST_MPL_LIMIT_VECTOR_SIZE=30 -DBOOST_FUSION_INVOKE_MAX_ARITY=12 -w "$@" -isystem "$prefix/include" -isystem "$eigen" \
        -o "$work/$name" tools/pinocchio_bench.cpp
}
compile plain &
first=$!
compile native -march=native
wait "$first"

"${CXX:-g++}" --version | head -n 1
"$venv/bin/python" -c 'import pinocchio; print("Pinocchio", pinocchio.__version__)'
echo "build,model,function,minimum_ns,median_ns"
for build in plain native; do
    "$work/$build" "$build" < "$work/arm.txt"
done
echo "ours: cargo bench -p flexarm-kinematics --bench recursions"
