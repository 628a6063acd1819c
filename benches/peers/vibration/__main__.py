"""Modes of simulated vibration records: afmid beside scipy, pyOMA2, SDyPy and Octave's `moen4`, errors and time.

    python3 -m venv /tmp/venv-peers && /tmp/venv-peers/bin/pip install h5py scipy pyOMA-2 sdypy-EMA
    apt-get install octave octave-control
    cargo build --release && /tmp/venv-peers/bin/python benches/peers/vibration

Four cases (`truth.py`), twenty seeds each. afmid gets a table and nothing else: `new pipeline`, `run`, `show`. The peers
get the samples or a frequency response, where a decay begins, the band, and the true number of modes where they need
one; of several settings each the best is taken, with the truth in sight. Their time is the fit alone: no interpreter
start, no imports, no files, no estimate of a frequency response. One thread each; everyone is warm.

A mode is missed where no pole is within 1 % of its frequency and within a factor of two of its damping. Poles beyond
the modes are added ones, of methods that say themselves how many modes there are.
"""

import argparse
import logging
import os
import platform
import subprocess
import sys
import tempfile
import time
import warnings
from functools import partial
from importlib.metadata import version
from itertools import product
from pathlib import Path

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[name] = "1"
os.environ["TQDM_DISABLE"] = "1"  # progress bars cost time

import least_squares
import lscf
import ours
import subspace
from table import Fits, print_tables, print_whole
from truth import CASES

ROOT = Path(__file__).resolve().parents[3]


SCIPY, SSI, LSCF, MOEN4 = "scipy `least_squares`", "pyOMA2 SSI", "SDyPy LSCF", "Octave `moen4`"
STARTS = {
    "free decay": ("peaks", "prony"),
    "SIMO decay": ("prony",),  # one peak for two modes
    "hammer FRF": ("plain", "weighted"),
    "random input": ("peaks",),
}
CHANNELS = {"free decay": 1, "SIMO decay": 6, "hammer FRF": 5, "random input": 1}  # hits are channels to SSI
METHODS = {"hammer FRF": ("cov", "dat", "IOcov"), "random input": ("IOcov",)}


def settings(case):
    """(peer, setting as the table names it, its arguments, whether the peer says itself how many modes there are).

    Orders are the true one, and one with room for noise of whose poles the nearest to the truth count.
    """
    rows = (20, 50, 100) if case == "SIMO decay" else (20, 50, 100, 200)  # of six channels 200 take minutes
    named = lambda order: f", order {order}" if order else ""
    for start in STARTS[case]:
        yield SCIPY, start, (start,), True
    for method, count, order in product(METHODS.get(case, ("cov", "dat")), rows, (0, 20)):
        channels = 1 if method == "IOcov" else CHANNELS[case]
        if order <= channels * (count - 1):
            yield SSI, f"{method}, {count} rows{named(order)}", (method, count, order), order == 0
    for order, picked, segment in product((10, 20, 40, 60, 80), ("stable", "chart"), (2048, 4096, 8192)):
        if case == "random input":
            yield LSCF, f"order {order}, {picked}, segments of {segment}", (order, picked, segment), False
        elif segment == 2048:
            yield LSCF, f"order {order}, {picked}", (order, picked, 0), False
    for count, order in product(rows, (0, 12)):
        yield MOEN4, f"{count} rows{named(order)}", (count, order), order == 0


def timed(fit):
    """(seconds, poles or None where the fit fails)."""
    started = time.perf_counter()
    try:
        poles = fit()
    except Exception as error:  # whatever a peer raises
        print(f"    {error!r:.150}", file=sys.stderr)
        poles = None
    return time.perf_counter() - started, poles


def peer(case, name, arguments, records):
    """(seconds, poles) of each record."""
    modes = len(records[0].poles)
    if name == MOEN4:
        try:
            return subspace.moen4(records, *arguments, modes)
        except RuntimeError as error:
            print(f"    {str(error).splitlines()[0]:.150}", file=sys.stderr)
            return [(float("nan"), None)] * len(records)

    def fit(record):
        if name == SCIPY:
            return timed(lambda: least_squares.fit(case, record, *arguments, modes))
        if name == SSI:
            return timed(lambda: subspace.ssi(record, *arguments, modes))
        order, picked, segment = arguments
        given = lscf.response(case, record, segment)
        return timed(lambda: lscf.fit(case, given, order, picked, record.poles))

    fit(records[0])
    return [fit(record) for record in records]


def starts():
    """Seconds that each peer's program takes to start and to load what it needs: not part of its times."""
    python = {
        "scipy": "scipy.optimize, scipy.signal",
        "pyOMA2": "pyoma2.setup, pyoma2.algorithms",
        "SDyPy": "sdypy.EMA",
    }
    commands = {name: [sys.executable, "-c", f"import {modules}"] for name, modules in python.items()}
    commands["Octave"] = ["octave-cli", "--no-init-file", "--quiet", "--eval", "pkg load control"]
    out = {}
    for name, command in commands.items():
        for _ in range(2):  # the first one fills the file cache
            started = time.perf_counter()
            subprocess.run(command, capture_output=True, check=True)
            out[name] = time.perf_counter() - started
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=ROOT / "target/release/afmid", type=Path)
    parser.add_argument("--seeds", default=20, type=int)
    parser.add_argument("--case", choices=CASES, action="append", help="these cases alone")
    parser.add_argument("--ours", action="store_true", help="afmid alone")
    parser.add_argument("--all", action="store_true", help="every setting of every peer")
    options = parser.parse_args()
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")
    shown = {}
    with tempfile.TemporaryDirectory() as folder:
        for case in options.case or CASES:
            records = [CASES[case](seed) for seed in range(1, options.seeds + 1)]
            print(f"{case}: {len(records)} seeds", file=sys.stderr)
            run = partial(ours.afmid, options.program.resolve(), Path(folder), case)
            fits = [
                Fits.of_afmid(given, [run(seed, record, given) for seed, record in enumerate(records, 1)], records)
                for given in (False, True)
            ]
            for name, setting, arguments, counts in [] if options.ours else settings(case):
                fits.append(Fits.of_peer(name, setting, peer(case, name, arguments, records), records, counts))
            shown[case] = print_tables(case, fits, options.all)
    load = " to ".join(f"{value:.1f}" for value in sorted(os.getloadavg()))
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "pyOMA-2", "sdypy-EMA"))
    print(f"\nPython {platform.python_version()}, {packages}; load {load}")
    seconds = starts()
    print("Start and imports, s: " + ", ".join(f"{name} {own:.2f}" for name, own in seconds.items()))
    print_whole(shown, seconds)


if __name__ == "__main__":
    main()
