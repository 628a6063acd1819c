"""Modes of measured records: what is known, afmid, and scipy, pyOMA2 and SDyPy on what afmid takes for decays.

    /tmp/venv-peers/bin/python benches/peers/vibration/measured.py FOLDER [PROGRAM]

FOLDER holds the recordings (`SETS`). afmid gets the files and what they do not state: `new pipeline`, `run`, `show`. The
peers get the samples that afmid has cut out, or the frequency responses that it has read, and the known frequencies: of
their poles that count which are nearest to these. Orders with room for noise, as their manuals advise.
"""

import json
import logging
import os
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

os.environ["TQDM_DISABLE"] = "1"

import h5py
import numpy as np

import least_squares
import subspace
from truth import Record, modal, poles_of

ROOT = Path(__file__).resolve().parents[3]
# files, what they do not state, kind of response, known frequencies (Hz) and damping ratios (none: not known)
SETS = {
    "rlc-pulse, Pulse_3.14": (
        "decays/rlc-pulse/Pulse_3.14-oscilloscope.csv", "--channel V_C --unit V", None, [(9081.2, 0.1185)],
    ),
    "flexible-link": (
        "decays/flexible-link/resultID.mat", "--rate 333.3333333333 --unit m/s^2", None, [(15.985, 0.0026)],
    ),
    "pcb-strip": ("decays/pcb-strip/*.lvm", "--rate 200000 --unit g", None, [(762.0, None)]),
    "brake-reuss": (
        "decays/brake-reuss/HammerImpact.mat", "--unit m/s^2", None, [(80.5, 0.00149), (221.7, None), (297.7, None)],
    ),
    "beam": ("beam/data.mat", "--unit m/s^2", None, [(122.4, None), (243.5, None)]),
    "free-beam": (
        "hammer/free-beam", "", "accelerance", [(f, None) for f in (111.99, 306.86, 596.37, 974.12)],
    ),
    "tool-frf": (
        "hammer/tool-frf", "--goal frf --unit m/N", "receptance", [(1074.0, 0.034), (1961.0, 0.045), (2617.0, 0.045)],
    ),
}  # fmt: skip


def afmid(program, folder, files, stated, work):
    """Modes of the table, and the result file."""
    found = sorted(folder.glob(files)) if "*" in files else [folder / files]
    config, result = work / "c.toml", work / "r.h5"
    for old in (config, result):
        old.unlink(missing_ok=True)
    commands = [
        ["new", "pipeline", *found, *stated.split(), "-o", config],
        ["run", config, "-o", result, "--cache", work / "cache"],
        ["show", result, "modes", "--json"],
    ]
    for arguments in commands:
        done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"afmid {arguments[0]}: {done.stderr}")
    return json.loads(done.stdout)["modes"], result


def decays(result):
    """The decays that were cut out, each channel of each hit a row, as far as the shortest reaches."""
    with h5py.File(result) as file:
        group = file["entry/events/decays"]
        rows = np.split(group["signal"][:], np.cumsum(group["samples"][:])[:-1])
        rate_hz = float(group.attrs["sample_rate_hz"])
    length = min(len(row) for row in rows)
    rows = np.array([row[:length] for row in rows])
    return Record(rate_hz, None, rows[np.all(np.isfinite(rows), axis=1)], [0], np.empty(0), np.empty(0), ("", ""))


def lscf(record, result, kind, known, order=60):
    from sdypy import EMA

    if kind:
        with h5py.File(result) as file:
            group = file["entry/frf/frf"]
            frequency, response = group["frequency_hz"][:], group["frf_real"][:] + 1j * group["frf_imag"][:]
    else:
        kind, samples = "receptance", record.response.shape[1]
        frequency = np.fft.rfftfreq(samples, 1.0 / record.rate_hz)
        response = np.fft.rfft(record.response) / record.rate_hz
    upper = min(1.3 * known[-1][0], frequency[-1])
    order = min(order, int(np.count_nonzero(frequency < upper)) // 3)
    model = EMA.Model(response, frequency, lower=frequency[1], upper=upper, pol_order_high=order, frf_form=kind)
    model.get_poles(show_progress=False)
    return model.all_poles[-1]


def nearest(poles, frequency_hz):
    """Frequency and damping ratio of the pole within 5 % of a frequency that is nearest to it."""
    f, damping = modal(poles[(poles.imag > 0.0) & (poles.real < 0.0)])
    close = np.flatnonzero(np.abs(f / frequency_hz - 1.0) < 0.05)
    if len(close) == 0:
        return "-"
    best = close[np.argmin(np.abs(f[close] - frequency_hz))]
    return f"{f[best]:.6g}, {100.0 * damping[best]:.3g}"


def peers(result, kind, known, modes):
    """Poles of each peer; none where it fails or does not take such data."""
    record = None if kind else decays(result)
    start = poles_of([mode["frequency_hz"] for mode in modes], [mode["damping_ratio"] for mode in modes])
    fits = {
        "scipy": None if kind else lambda: least_squares.decays(record, "prony", len(start)),
        "pyOMA2": None if kind else lambda: subspace.ssi(record, "cov", 60, 40, len(start)),
        "SDyPy": lambda: lscf(record, result, kind, known),
    }
    out = {}
    for name, fit in fits.items():
        try:
            out[name] = fit() if fit else None
        except Exception as error:  # whatever a peer raises
            print(f"    {name}: {error!r:.150}", file=sys.stderr)
            out[name] = None
    return out


def written(value, std, factor=1.0):
    """A value with its standard error in the last two digits."""
    value, std = factor * value, factor * std
    decimals = max(0, 1 - int(np.floor(np.log10(std)))) if std > 0.0 and np.isfinite(std) else 3
    return f"{value:.{decimals}f}({round(std * 10**decimals)})"


def main():
    folder, program = Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "target/release/afmid"
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")
    print("| set | known: Hz, % | afmid | scipy `least_squares` | pyOMA2 SSI | SDyPy LSCF |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as work:
        for name, (files, stated, kind, known) in SETS.items():
            modes, result = afmid(program, folder, files, stated, Path(work))
            found = peers(result, kind, known, modes)
            for frequency_hz, damping in known:
                own = min(modes, key=lambda mode: abs(mode["frequency_hz"] - frequency_hz))
                is_near = abs(own["frequency_hz"] / frequency_hz - 1.0) < 0.05
                ours = (
                    written(own["frequency_hz"], own["frequency_std_hz"])
                    + ", "
                    + written(own["damping_ratio"], own["damping_ratio_std"], 100.0)
                )
                row = [name, f"{frequency_hz:g}" + (f", {100 * damping:.3g}" if damping else ""), ours if is_near else "-"]
                row += ["-" if poles is None else nearest(poles, frequency_hz) for poles in found.values()]
                print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
