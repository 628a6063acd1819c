"""Held-out simulation fits on the daisy sets: afmid beside Octave's control package (SLICOT) and SIPPY.

    python3 -m venv /tmp/venv-daisy && /tmp/venv-daisy/bin/pip install numpy h5py sippy_unipi
    apt-get install octave octave-control
    cargo build --release && /tmp/venv-daisy/bin/python benches/peers/daisy.py

Everyone gets the same training half, less its mean, and the same order; everyone is judged alike: simulation of the
test half (the training half's means taken off) from the inputs alone, the initial state fitted by least squares,
FIT % = 100 (1 - |y - yhat| / |y - mean y|).
Errors: moving-block bootstrap of the test half. Nothing of afmid's is selected on it; of the peers, which run with
their own defaults and with 20 and 40 block rows, the best is taken on it. `within`: behind the first by no more than
the bootstrap error of the first. The last number but one is the difference with the error of the difference itself,
from the same draws, which is smaller.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("AFMID_DATA", ROOT.parent / "shared/data")) / "daisy"
ORDERS = {"flutter": (4, 6, 8, 10), "robot-arm": (4, 6, 8, 12), "cd-player": (8, 12, 16, 20)}
# config, file, inputs, output (columns from 0), how the table names them
ROWS = [
    ("flutter", "flutter.dat", [0], 1, "u to y"),
    ("robot-arm", "robot_arm.dat", [0], 1, "u to y"),
    ("cd-player", "CD_player_arm.dat", [0, 1], 2, "u1, u2 to y1"),
    ("cd-player", "CD_player_arm.dat", [0, 1], 3, "u1, u2 to y2"),
]
BLOCK = 32  # samples: longer than the residuals of any fit here stay correlated
DRAWS = 2000


def halves(file, inputs, output):
    """(u, y) of the training half and of the test half, less the training half's means."""
    table = np.loadtxt(DATA / file)
    half = len(table) // 2
    table = table - table[:half].mean(axis=0)
    return [(part[:, inputs], part[:, output]) for part in (table[:half], table[half:])]


def residual(model, u, y):
    """y less its simulation, the initial state fitted."""
    a, b, c, d = model
    n, samples = a.shape[0], len(y)
    forced, free = np.zeros(samples), np.zeros((samples, n))
    x, power = np.zeros(n), np.eye(n)
    for t in range(samples):
        forced[t] = c @ x + d @ u[t]
        free[t] = c @ power
        x, power = a @ x + b @ u[t], a @ power
    if not (np.isfinite(forced).all() and np.isfinite(free).all()):
        return None
    x0 = np.linalg.lstsq(free, y - forced, rcond=None)[0]
    return y - forced - free @ x0


def fit_percent(squares, variation):
    return 100.0 * (1.0 - np.sqrt(squares / variation))


def bootstrap(errors, y, seed=1):
    """FIT % of every model for the same draws of blocks: names x draws."""
    rng = np.random.default_rng(seed)
    samples = len(y)
    starts = rng.integers(0, samples - BLOCK + 1, size=(DRAWS, -(-samples // BLOCK)))
    rows = (starts[:, :, None] + np.arange(BLOCK)).reshape(DRAWS, -1)[:, :samples]
    drawn = y[rows]
    variation = ((drawn - drawn.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    return {name: fit_percent((e[rows] ** 2).sum(axis=1), variation) for name, e in errors.items()}


def afmid(program, work, config, output, order):
    """Runs the shipped config at another order and output; the model, and the fit that afmid itself states."""
    result = work / f"{config}-{output}-{order}.h5"
    settings = [f"model.order={order}", f"subspace.order={order}", f"data.output={output + 1}"]
    arguments = [program, "run", ROOT / f"configs/daisy-{config}.toml", "-o", result, "--cache", work / "cache"]
    arguments += [part for setting in settings for part in ("--set", setting)]
    subprocess.run([str(argument) for argument in arguments], check=True, stderr=subprocess.DEVNULL)
    with h5py.File(result) as file:
        part = lambda stage, letter: np.array(file[f"entry/{stage}/model/{letter}"])
        models = {
            stage: (part(stage, "A"), part(stage, "B"), part(stage, "C").ravel(), part(stage, "D").ravel())
            for stage in ("model", "subspace")
        }
    shown = subprocess.run(
        [str(program), "show", str(result), "modes", "--json"], check=True, capture_output=True, text=True
    )
    return models, json.loads(shown.stdout)["fit_percent"]["held_out"]


OCTAVE = """
pkg load control
function keep(name, sys)
  [a, b, c, d] = ssdata(sys);
  dlmwrite([name ".a"], a, "precision", 17); dlmwrite([name ".b"], b, "precision", 17);
  dlmwrite([name ".c"], c, "precision", 17); dlmwrite([name ".d"], d, "precision", 17);
end
"""


def octave(work, jobs):
    """moen4 and n4sid for all (name, u, y, order): by default and with given block rows."""
    script = [OCTAVE]
    for name, u, y, order in jobs:
        np.savetxt(work / f"{name}.train", np.column_stack([u, y]))
        script.append(f'd = load("{work}/{name}.train"); dat = iddata(d(:, end), d(:, 1:end-1), 1);')
        for method in ("moen4", "n4sid"):
            for rows in (None, 20, 40):
                if rows is not None and rows <= order:
                    continue
                option = "" if rows is None else f', "s", {rows}'
                mark = f"{work}/{name}.{method}-{rows or 'default'}"
                script.append(
                    f'try, keep("{mark}", {method}(dat, {order}{option})); catch e, disp(["{mark}: " e.message]); end'
                )
    subprocess.run(["octave", "-q", "--no-gui", "--eval", "\n".join(script)], check=True, stderr=subprocess.DEVNULL)
    models = {}
    for path in work.glob("*.a"):
        name, method, _ = path.name.split(".")
        part = lambda letter: np.loadtxt(path.with_suffix(f".{letter}"), delimiter=",", ndmin=2)
        a, b, c, d = (part(letter) for letter in "abcd")
        models[name, f"Octave {method}"] = (a, b, c.ravel(), d.ravel())
    return models


def sippy(u, y, order):
    """SIPPY's subspace methods, by default and with the same block rows."""
    from sippy_unipi import system_identification

    models = {}
    for method in ("N4SID", "MOESP", "CVA"):
        for rows in (20, 40):
            if rows <= order:
                continue
            try:
                found = system_identification(
                    y, u.T, method, SS_fixed_order=order, SS_f=rows, SS_p=rows, SS_D_required=True, SS_A_stability=True
                )
                models[f"SIPPY {method}-{rows}"] = (found.A, found.B, np.ravel(found.C), np.ravel(found.D))
            except Exception as error:
                print(f"SIPPY {method}, order {order}: {error}", file=sys.stderr)
    return models


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=ROOT / "target/release/afmid", type=Path)
    parser.add_argument("--all", action="store_true", help="every method of every row, not only the best peer")
    options = parser.parse_args()
    print(
        "| data | channels | order | afmid `model.pem` | afmid `model.subspace` "
        "| best peer | its fit | behind the best | |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        jobs = [
            (f"{config}-{output}-{order}", *halves(file, inputs, output)[0], order)
            for config, file, inputs, output, _ in ROWS
            for order in ORDERS[config]
        ]
        from_octave = octave(work, jobs)
        for config, file, inputs, output, channels in ROWS:
            for order in ORDERS[config]:
                (u, y), test = halves(file, inputs, output)
                ours, stated = afmid(options.program, work, config, output, order)
                name = f"{config}-{output}-{order}"
                models = {f"afmid {stage}": model for stage, model in ours.items()}
                models |= {method: model for (job, method), model in from_octave.items() if job == name}
                models |= sippy(u, y, order)
                report(config, channels, order, models, test, stated, options.all)


def report(config, channels, order, models, test, stated, everything):
    errors = {name: residual(model, *test) for name, model in models.items()}
    errors = {name: error for name, error in errors.items() if error is not None}
    y = test[1]
    fits = {name: fit_percent((e**2).sum(), ((y - y.mean()) ** 2).sum()) for name, e in errors.items()}
    if abs(fits["afmid model"] - stated) > 0.01:
        print(f"afmid states {stated}, scored {fits['afmid model']}", file=sys.stderr)
    draws = bootstrap(errors, y)
    peers = [name for name in fits if not name.startswith("afmid")]
    best = max(peers, key=fits.get)
    behind = max(0.0, fits[best] - fits["afmid model"])
    spread = (draws[best] - draws["afmid model"]).std()
    verdict = "first" if behind == 0.0 else "within" if behind <= draws[best].std() else "BEHIND"
    cell = lambda name: f"{fits[name]:.2f} ± {draws[name].std():.2f}"
    print(
        f"| {config} | {channels} | {order} | {cell('afmid model')} | {cell('afmid subspace')} | {best} | {cell(best)}"
        f" | {behind:.2f} ± {spread:.2f} | {verdict} |",
        flush=True,
    )
    if everything:
        for name in sorted(fits, key=fits.get, reverse=True):
            print(f"    {name:28} {fits[name]:9.2f} ± {draws[name].std():.2f}", flush=True)


if __name__ == "__main__":
    main()
