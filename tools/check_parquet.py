#!/usr/bin/env python3
"""Compares a Parquet recording, read by another library, with the CSV of the same run.

    python3 tools/check_parquet.py FOLDER                   run.parquet and run.csv in it
    python3 tools/check_parquet.py FILE.parquet FILE.csv

    flexarm compare --parquet -o FOLDER                     makes both

Checks the names of the columns and their order, every number to the last bit, doubles without
missing values, row groups of bounded size, and the metadata. Needs pyarrow (Apache-2.0); without it
prints a message and succeeds. Status 1 and a line per difference if there are any.
"""
import csv
import json
import struct
import sys
from pathlib import Path

MOST_ROWS = 16384


def bits(x):
    return struct.pack("<d", x)


def read(path):
    """Returns the table of a file, the rows of its groups, and its metadata."""
    import pyarrow.parquet as pq

    file = pq.ParquetFile(path)
    groups = [file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups)]
    return file.read(), groups, file.metadata.metadata


def check(path, csv_path):
    import pyarrow as pa

    problems = []
    table, groups, texts = read(path)
    with open(csv_path, newline="", encoding="utf-8") as lines:
        rows = csv.reader(lines)
        names = next(rows)
        columns = list(zip(*[[float(x) for x in row] for row in rows]))
    if table.column_names != names:
        problems.append(f"columns: found {table.column_names}, expected {names}")
        return problems, ""
    for name, expected in zip(names, columns):
        column = table.column(name)
        if column.type != pa.float64() or column.null_count:
            problems.append(f"{name}: found {column.type} with {column.null_count} missing values, expected double without")
        found = column.to_pylist()
        if len(found) != len(expected):
            problems.append(f"{name}: found {len(found)} rows, expected {len(expected)}")
        different = [k for k, (a, b) in enumerate(zip(found, expected)) if bits(a) != bits(b)]
        if different:
            k = different[0]
            problems.append(f"{name}: {len(different)} numbers differ, first in row {k}: {found[k]!r}, expected {expected[k]!r}")

    if any(rows > MOST_ROWS for rows in groups):
        problems.append(f"row groups of {groups} rows, expected at most {MOST_ROWS}")
    texts = {key.decode(): value.decode() for key, value in (texts or {}).items()}
    for key in ("robot", "trajectory", "units", "version", "flexarm.run", "flexarm.result"):
        if not texts.get(key):
            problems.append(f"text {key}: not there")
    run, result = json.loads(texts.get("flexarm.run", "{}")), json.loads(texts.get("flexarm.result", "{}"))
    for key in ("robot", "trajectory"):
        if run.get(key) != texts.get(key):
            problems.append(f"text {key}: {texts.get(key)!r}, but flexarm.run says {run.get(key)!r}")
    for label, value in result.get("figures", []):
        if texts.get(f"figure.{label}") != value:
            problems.append(f"text figure.{label}: {texts.get(f'figure.{label}')!r}, but flexarm.result says {value!r}")
    seen = f"{len(names)} columns, {table.num_rows} rows in {len(groups)} groups, {len(texts)} texts"
    return problems, seen


def main(arguments):
    if len(arguments) == 1:
        path, csv_path = Path(arguments[0]) / "run.parquet", Path(arguments[0]) / "run.csv"
    elif len(arguments) == 2:
        path, csv_path = Path(arguments[0]), Path(arguments[1])
    else:
        sys.exit(__doc__)
    try:
        import pyarrow
    except ImportError:
        print("skipped: pyarrow is not installed (pip install pyarrow)")
        return 0
    missing = [str(file) for file in (path, csv_path) if not file.exists()]
    if missing:
        sys.exit(f"error: {', '.join(missing)}: no such file; flexarm compare --parquet -o FOLDER makes both")
    problems, seen = check(path, csv_path)
    for problem in problems:
        print(f"error: {path}: {problem}", file=sys.stderr)
    print(f"{path.suffix[1:]}: {seen}, {len(problems)} problems (pyarrow {pyarrow.__version__})")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
