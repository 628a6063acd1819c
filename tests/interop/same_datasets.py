"""Compares the datasets of afmid result files bit for bit, whatever versions of afmid wrote them.

Usage: same_datasets.py A.h5 B.h5 [A.h5 B.h5 ...], or same_datasets.py FOLDER FOLDER (files of the same name). Prints a
line per pair and per difference; exits with 1 if any dataset differs. Left out: /entry/run (times and host), and what
names versions, places and keys rather than results (program, key, path, arithmetic). Needs h5py.
"""

import sys
from pathlib import Path

import h5py
import numpy as np

# words about a run, not what it computed
LEFT_OUT = {"run", "program", "key", "path", "arithmetic", "version"}


def datasets(file):
    """Every dataset that holds a result or parameter, by its path."""
    found = {}

    def visit(name, item):
        if isinstance(item, h5py.Dataset) and not LEFT_OUT.intersection(name.split("/")):
            found[name] = item

    file.visititems(visit)
    return found


def same(a, b):
    """Type, shape and bytes; all NaN are one."""
    if a.dtype.kind == "O" or b.dtype.kind == "O":
        return a.shape == b.shape and np.array_equal(np.asarray(a[()]), np.asarray(b[()]))
    return a.dtype == b.dtype and a.shape == b.shape and np.asarray(a[()]).tobytes() == np.asarray(b[()]).tobytes()


def compare(first, second):
    """Prints what differs; the number of differences."""
    with h5py.File(first) as a, h5py.File(second) as b:
        left, right = datasets(a), datasets(b)
        wrong = [f"only in {first}: {name}" for name in sorted(left.keys() - right.keys())]
        wrong += [f"only in {second}: {name}" for name in sorted(right.keys() - left.keys())]
        wrong += [
            f"differs: {name}" for name in sorted(left.keys() & right.keys()) if not same(left[name], right[name])
        ]
        print(f"{first} and {second}: {len(left.keys() & right.keys())} datasets, {len(wrong)} differences")
        for line in wrong:
            print(f"  {line}")
        return len(wrong)


def pairs(arguments):
    """Files side by side, from the command line."""
    if len(arguments) == 2 and all(Path(argument).is_dir() for argument in arguments):
        names = sorted(path.name for path in Path(arguments[0]).glob("*.h5"))
        return [(Path(arguments[0]) / name, Path(arguments[1]) / name) for name in names]
    return list(zip(arguments[::2], arguments[1::2], strict=True))


if __name__ == "__main__":
    if len(sys.argv) < 3 or len(sys.argv) % 2 == 0:
        sys.exit(__doc__)
    sys.exit(1 if sum([compare(first, second) for first, second in pairs(sys.argv[1:])]) else 0)
