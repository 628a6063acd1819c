"""Runs the shipped configs with two builds of afmid and says what moved between their results.

Usage: configs_against.py OLD NEW FOLDER [CONFIG ...]. OLD and NEW are programs; results, caches and logs go to
FOLDER/old and FOLDER/new; without CONFIG all of configs/ are run, sweeps left out. Prints a line per config: how many datasets are the same bit for bit,
the largest relative difference of the others, and the largest difference over its standard error where one is stored
beside it (`x` and `x_std`, or `value` and `std` in a document); documents are compared number by number. Paths, stage
versions and texts are left out. Exits with 1 if a difference exceeds 1e-3 standard errors, or 1e-9 relative where no
standard error is stored. Needs h5py.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from same_datasets import datasets, same  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
# these make what others read: they come first
FIRST = ["simulate-demo", "simulate-paper"]
# what an optimiser may move, and what rounding may
STANDARD_ERRORS = 1e-3
RELATIVE = 1e-9
# what names places and builds
WORDS = {"source_path", "stage_version", "warnings"}


def configs(names):
    """The configs in the order in which they can run."""
    found = names or [path.stem for path in sorted((ROOT / "configs").glob("*.toml"))]
    found = [name for name in found if "[sweep]" not in (ROOT / "configs" / f"{name}.toml").read_text()]
    return [name for name in FIRST if name in found] + [name for name in found if name not in FIRST]


def run(program, config, folder):
    """The result file, or none if the run failed."""
    result = folder / f"{config}.h5"
    log = folder / f"{config}.log"
    # paths in a config begin at its folder: a copy keeps what it writes apart
    copy = folder / "configs" / f"{config}.toml"
    shutil.copy(ROOT / "configs" / f"{config}.toml", copy)
    command = [program, "run", str(copy), "-o", str(result)]
    with log.open("w") as out:
        code = subprocess.run(
            command,
            cwd=folder,
            stdout=out,
            stderr=subprocess.STDOUT,
            env={**os.environ, "AFMID_CACHE": str(folder / "cache")},
            check=False,
        ).returncode
    return result if code == 0 else None


def error_of(name, file):
    """The standard errors stored beside a dataset, if there are any."""
    folder, _, last = name.rpartition("/")
    parts = last.split("_")
    for place in range(1, len(parts) + 1):
        other = "_".join(parts[:place] + ["std"] + parts[place:])
        path = f"{folder}/{other}" if folder else other
        if path in file and file[path].shape == file[name].shape:
            return np.asarray(file[path][()], dtype=float)
    return None


def moved(name, old, new):
    """Largest relative difference, and the largest over the standard error (none without one)."""
    a, b = np.asarray(old[name][()]), np.asarray(new[name][()])
    if a.shape != b.shape or a.dtype.kind not in "fci" or b.dtype.kind not in "fci":
        return np.inf, None
    a, b = a.astype(complex), b.astype(complex)
    known = np.isfinite(a) & np.isfinite(b)
    if (np.isnan(a) != np.isnan(b)).any() or not known.any():
        return np.inf, None
    difference = np.where(known, np.abs(a - b), 0.0)
    scale = np.abs(a[known]).max()
    relative = float(difference.max() / scale) if scale > 0.0 else float(difference.max() > 0.0)
    error = error_of(name, old)
    if error is None:
        return relative, None
    usable = np.isfinite(error) & (error > 0.0)
    return relative, float((difference[usable] / error[usable]).max()) if usable.any() else None


def numbers(value, path=""):
    """Every number of a document by its path, with the standard error beside it (none without one)."""
    if isinstance(value, dict):
        for key, inner in value.items():
            std = value.get("std") if key == "value" else value.get(f"{key}_std")
            if isinstance(inner, (int, float)) and not isinstance(inner, bool):
                yield f"{path}/{key}", float(inner), std if isinstance(std, (int, float)) and std > 0.0 else None
            else:
                yield from numbers(inner, f"{path}/{key}")
    elif isinstance(value, list):
        scale = max((abs(one) for one in value if isinstance(one, (int, float))), default=0.0)
        for place, inner in enumerate(value):
            if isinstance(inner, (int, float)) and not isinstance(inner, bool):
                # of a list the largest counts
                yield f"{path}[{place}]", float(inner), None if scale == 0.0 else ("scale", scale)
            else:
                yield from numbers(inner, f"{path}[{place}]")


def document(old, new):
    """Largest relative difference of two documents, and the largest over a standard error."""
    a, b = (dict((path, (value, std)) for path, value, std in numbers(json.loads(text))) for text in (old, new))
    if a.keys() != b.keys():
        return np.inf, None
    relative, errors = 0.0, None
    for path, (value, std) in a.items():
        difference = abs(value - b[path][0])
        if isinstance(std, tuple):
            relative = max(relative, difference / std[1])
        elif std is not None:
            errors = max(errors or 0.0, difference / std)
        elif difference > 0.0:
            relative = max(relative, difference / max(abs(value), abs(b[path][0])))
    return relative, errors


def text(dataset):
    """The JSON of a document, none of anything else."""
    value = dataset[()] if dataset.shape == () and dataset.dtype.kind == "O" else None
    value = value.decode() if isinstance(value, bytes) else value
    return value if isinstance(value, str) and value.startswith("{") else None


def compare(old, new):
    """Counts and largest differences of two results; names of what is beyond its limit."""
    with h5py.File(old) as a, h5py.File(new) as b:
        left, right = datasets(a), datasets(b)
        common = sorted(set(left) & set(right))
        beyond = [f"only in one: {name}" for name in sorted(set(left) ^ set(right))]
        relative, errors, equal = 0.0, 0.0, 0
        for name in common:
            if same(left[name], right[name]):
                equal += 1
                continue
            if name.split("/")[-1] in WORDS:
                equal += 1
                continue
            one, other = text(left[name]), text(right[name])
            whole = one is not None and other is not None
            by, over = document(one, other) if whole else moved(name, a, b)
            relative, errors = max(relative, by), max(errors, over or 0.0)
            # in a document numbers with and without a standard error stand side by side
            if (by > RELATIVE and (over is None or whole)) or (over or 0.0) > STANDARD_ERRORS:
                beyond.append(f"{name}: {by:.1e} relative" + ("" if over is None else f", {over:.1e} standard errors"))
        return equal, len(common), relative, errors, beyond


def main():
    old, new, folder, *names = sys.argv[1:]
    old, new = (Path(program).resolve() for program in (old, new))
    folders = [Path(folder).resolve() / side for side in ("old", "new")]
    for one in folders:
        (one / "configs").mkdir(parents=True, exist_ok=True)
    data = Path(folder).resolve() / "shared"
    if not data.exists():
        data.symlink_to(ROOT.parent / "shared")
    wrong = 0
    print(f"{'config':<20} {'same bits':>11} {'relative':>9} {'std. errors':>11}")
    for config in configs(names):
        results = [run(program, config, one) for program, one in zip((old, new), folders)]
        if None in results:
            failed = ["old", "new"][results.index(None)]
            print(f"{config:<20} the {failed} program failed: {folders[results.index(None)] / config}.log")
            wrong += 1
            continue
        equal, count, relative, errors, beyond = compare(*results)
        print(f"{config:<20} {f'{equal}/{count}':>11} {relative:>9.1e} {errors:>11.1e}")
        for line in beyond:
            print(f"    {line}")
        wrong += bool(beyond)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
