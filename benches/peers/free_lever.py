"""The lean main job as a careful numpy/scipy script, timed beside afmid.

    python3 -m venv /tmp/venv-peers && /tmp/venv-peers/bin/pip install numpy scipy h5py
    cargo build --release
    /tmp/venv-peers/bin/python benches/peers/free_lever.py [--afmid target/release/afmid] [--runs 5]

Decompresses lever-a into a temporary folder, which warms the page cache; then both do the job in turn: whole processes,
from start to synced result, afmid with an empty cache each time, the script on one thread. The script does what
configs/free-lever.toml does, intermediates stored. It does less: no keys or hashes; a local parabola (seven bins) where
afmid smooths by a local rational; output error (no noise model) from one start, with four modes and three real poles
given; no zeros, no held-out fit. scipy.signal is left out: its import would nearly double the time.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from functools import lru_cache
from pathlib import Path

CLOCK, LAST = {}, [time.perf_counter()]


def lap(name):
    now = time.perf_counter()
    CLOCK[name], LAST[0] = CLOCK.get(name, 0.0) + now - LAST[0], now


import h5py  # after the clock's start
import numpy as np

lap("import numpy, h5py")
from scipy.optimize import least_squares

lap("import scipy")

ROOT, SCRIPT = Path(__file__).resolve().parents[2], __file__
LENGTH, BEFORE, MARGIN, GUARD = 8192, 1024, 8, 50
MODES, REAL, ORDER = 4, 3, 11
HEAD = 128  # samples after t0 in which real poles may show
REAL_START, REAL_LEAST, REAL_MOST = [0.33, 0.1, 0.017], 1e-4, 0.82  # z of real poles: start and bounds
SCALE = 1e-3  # of the sample number, for columns of similar size


def onsets(codes, block=64, level=16):
    """Samples where the level jumps up: block means first, then the first one above half of the jump."""
    samples = codes.astype(np.float32)
    means = samples[: len(codes) // block * block].reshape(-1, block) @ np.full(block, 1.0 / block, np.float32)
    step = means[2:] - means[:-2]
    sigma = 1.4826 * np.median(np.abs(step - np.median(step)))
    found, end = [], level
    for i in np.flatnonzero(step > 8.0 * sigma):
        low, high = means[i - level : i].mean(), means[i + 2 : i + 2 + level].mean()
        if end <= i <= len(means) - 2 - level and high - low > 8.0 * sigma:
            found.append(i * block + int(np.argmax(samples[i * block :] > 0.5 * (low + high))))
            end = i + LENGTH // block
    return found


def cut(folder):
    """Windows of `LENGTH` samples and a margin on either side, in volts."""
    windows, buffer = [], None
    for path in sorted(Path(folder).glob("*.h5")):
        with h5py.File(path) as file:
            data = file["deflection"]
            buffer = buffer if buffer is not None and len(buffer) == len(data) else np.empty(data.shape, data.dtype)
            data.read_direct(buffer)  # one buffer for all records stays in the processor's cache
            scale, rate = data.attrs["scale_factor"], float(file.attrs["sample_rate_hz"])
        lap("load")
        for first in (onset - BEFORE - MARGIN for onset in onsets(buffer)):
            if 0 <= first <= len(buffer) - LENGTH - 2 * MARGIN:
                windows.append(buffer[first : first + LENGTH + 2 * MARGIN] * scale)
        lap("events")
    return np.array(windows), rate


def shifted(windows, shift):
    """Each window `shift` samples later in its record, by band-limited interpolation of what a line through its ends
    leaves.
    """
    n, slope = windows.shape[1], (windows[:, -1:] - windows[:, :1]) / (windows.shape[1] - 1)
    line = windows[:, :1] + slope * np.arange(n)
    turn = np.exp(2j * np.pi / n * np.arange(n // 2 + 1) * shift[:, None])
    return np.fft.irfft(np.fft.rfft(windows - line) * turn, n) + line + slope * shift[:, None]


def regress(windows, mean):
    """Each window on the mean, its slope, a constant and a ramp on either side: coefficients and remainders."""
    t, before = np.linspace(-1.0, 1.0, LENGTH), np.arange(LENGTH) < BEFORE
    q, r = np.linalg.qr(np.column_stack([mean, np.gradient(mean), np.ones(LENGTH), t * before, t * ~before]))
    return np.linalg.solve(r, q.T @ windows.T).T, windows - windows @ q @ q.T


def align(windows):
    """Aligned windows without their margins; events unlike the others are left out."""
    part, shift = windows[:, BEFORE - 64 : BEFORE + 256 + 2 * MARGIN], np.zeros(len(windows))
    for _ in range(20):  # Gauss-Newton on the mean; four are usual
        moved = shifted(part, shift)[:, MARGIN:-MARGIN]
        mean = moved.mean(axis=0)
        c = np.linalg.lstsq(np.column_stack([mean, np.gradient(mean), np.ones(len(mean))]), moved.T, rcond=None)[0]
        step = np.clip(c[1] / c[0], -2.0, 2.0)
        shift -= (step := step - step.mean())
        if np.abs(step).max() < 1e-3:
            break
    keep = np.array([np.corrcoef(event, mean * len(moved) - event)[0, 1] > 0.8 for event in moved])  # with the others
    return shifted(windows[keep], shift[keep])[:, MARGIN:-MARGIN], shift[keep]


def drift(remainders, rng, permutations=999):
    """p-value of no slow change: trends over the event index against those of random orders."""
    n, gram = len(remainders), remainders @ remainders.T
    trends = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, n), 4, increasing=True))[0][:, 1:]
    power = lambda p: np.einsum("...ik,...ij,...jk->...", p, gram, p, optimize=True)
    permuted = np.array([trends[rng.permutation(n)] for _ in range(permutations)])
    return (1 + np.sum(power(permuted) >= power(trends))) / (1 + permutations)


def release(mean, error):
    """The last sample that still lies on the line before."""
    t = np.arange(BEFORE + GUARD)
    off = np.abs(mean[: len(t)] - np.polyval(np.polyfit(t[: BEFORE - GUARD], mean[: BEFORE - GUARD], 1), t))
    sure = np.argmax(off > 0.1 * abs(mean[: BEFORE - GUARD].mean() - mean[BEFORE:].mean()))
    return int(np.flatnonzero(off[:sure] <= 4.0 * error)[-1])


def force(y, t0):
    """Line before t0 less the line without force, as (slope, value at t0), and the force: that difference before t0,
    zero from t0 on.
    """
    t, before = np.arange(LENGTH) - t0, slice(BEFORE - GUARD)
    line = np.polyfit(t[before], y[before], 1) - np.polyfit(t[t0:], y[t0:], 1, w=np.sqrt(np.hanning(LENGTH - t0)))
    return line, np.where(t < 0, np.polyval(line, t), 0.0)


def transfer(windowed, rate, half_width=3):
    """ETFE of first differences, half a sample's hold taken out, up to 1.2 MHz; smoothed by a parabola through seven
    bins.
    """
    f, (u, y) = np.fft.rfftfreq(LENGTH, 1.0 / rate), np.fft.rfft(windowed, LENGTH)
    etfe = np.where(f > 1.2e6, np.nan, y / u * np.exp(1j * np.pi * f / rate) / np.sinc(f / rate))
    parabola = np.vander(np.arange(-half_width, half_width + 1), 3, increasing=True)
    return f, etfe, np.convolve(etfe, np.linalg.pinv(parabola)[0], "same")


def powers(z, samples):
    """z^k for k < samples, one column per z, from short tables."""
    coarse = (z**HEAD) ** np.arange(-(-samples // HEAD))[:, None]
    return (coarse[:, None] * (z ** np.arange(HEAD)[:, None])[None]).reshape(-1, len(z))[:samples]


def pairs(e):
    """Columns of Re(g e) for g = a + i b: those of a, then those of b."""
    return np.hstack([e.real, -e.imag])


def start(y, rows=64):
    """ln z of the modes, by shift invariance of the Hankel matrix's dominant left singular vectors."""
    y = y - y[-LENGTH // 8 :].mean()
    hankel = np.lib.stride_tricks.sliding_window_view(y, len(y) - rows + 1)
    left = np.linalg.eigh(hankel @ hankel.T)[1][:, -2 * MODES :]
    s = np.log(np.linalg.eigvals(np.linalg.lstsq(left[:-1], left[1:], rcond=None)[0]))
    s = s[s.imag > 0.0]
    return np.concatenate([np.log(np.maximum(-s.real, 1e-6)), s.imag, REAL_START])


def fit(y, t0, line, u):
    """Output error by variable projection: y = D u + sum of first-order sections, free initial state, offset and drift;
    all that is linear solved for.

    The force is a line before t0 and zero after. A section with pole z then answers with c P(k) + x z^k before, P a
    line itself, and with g z^(k - t0) after, g = c P(t0) + x z^t0: nothing is to be filtered. Linear parameters: g and
    x of every pole, D, offset, drift. Least squares gets the triangle of [J r] (Kaufman's J): from a QR of the samples
    before t0 + `HEAD` on top of the Cholesky factor of the rest, where only modes are left.
    """
    m, g, d, k = MODES, 2 * MODES + REAL, 2 * ORDER + 3, np.arange(LENGTH) - t0
    logarithms = lambda x: (-np.exp(x[:m]) + 1j * x[m : 2 * m], np.log(x[2 * m :]))  # ln z of modes and of real poles
    late = np.column_stack([np.ones(LENGTH), SCALE * k, y])[t0 + HEAD :]

    def basis(s, real_s, samples):
        """Columns of all linear parameters, then derivatives by ln z of what rings after t0, then y, for the first
        `samples`.
        """
        a, z = np.zeros((samples, d + g + 1), order="F"), np.exp(s)
        # P(k) / P(t0); before t0 next to nothing depends on z
        ratio = 1.0 + k[:t0, None] * (line[0] / (line[1] - line[0] / (1.0 - np.exp(np.append(s, real_s)))))
        tail, real = powers(z, samples - t0), np.exp(real_s * np.arange(HEAD)[:, None])
        a[:t0, : 2 * m], a[t0:, : 2 * m] = pairs(ratio[:, :m]), pairs(tail)
        a[:t0, 2 * m : g], a[t0 : t0 + HEAD, 2 * m : g] = ratio[:, m:].real, real
        a[:t0, g : g + 2 * m], a[:HEAD, g + 2 * m : 2 * g] = pairs(powers(z, t0) - z**t0 * ratio[:, :m]), real
        a[:, d - 3], a[:, d - 2], a[:, d - 1], a[:, -1] = u[:samples], 1.0, SCALE * k[:samples], y[:samples]
        a[t0:, d : d + 2 * m] = pairs(SCALE * k[t0:samples, None] * tail)
        a[t0 : t0 + HEAD, d + 2 * m : d + g] = SCALE * np.arange(HEAD)[:, None] * real
        return a

    @lru_cache(1)
    def evaluate(x):
        """Residual, Jacobian, linear parameters."""
        s, real_s = logarithms(np.frombuffer(x))
        near, e = basis(s, real_s, t0 + HEAD), np.exp(HEAD * s) * powers(np.exp(s), len(late))
        far = np.hstack([pairs(e), pairs(late[:, 1:2] * e), late])
        rest = np.zeros((far.shape[1], near.shape[1]))
        rest[:, np.r_[: 2 * m, d : d + 2 * m, d - 2, d - 1, -1]] = np.linalg.cholesky(far.T @ far).T
        t = np.linalg.qr(np.vstack([near, rest]), mode="r")
        theta = np.linalg.lstsq(t[:d, :d], t[:d, -1], rcond=1e-12)[0]
        (re, im, real), (a, b, c) = np.split(t[d:, d:-1] / SCALE, [m, 2 * m], axis=1), np.split(theta[:g], [m, 2 * m])
        # d Re(g e) = Re(g k e ds)
        j = -np.hstack([(re * a + im * b) * s.real, im * a - re * b, real * c / np.exp(real_s)])
        return t[d:, -1], j, theta

    bounds = [-np.inf] * 2 * m + [REAL_LEAST] * REAL, [np.inf] * 2 * m + [REAL_MOST] * REAL
    # ends when the sum of squares falls by less than 0.08 of the noise variance
    found = least_squares(
        lambda x: evaluate(x.tobytes())[0],
        start(y[t0 + 16 :]),
        lambda x: evaluate(x.tobytes())[1],
        bounds,
        x_scale="jac",
        ftol=1e-5,
    )
    assert found.success, found.message
    (s, real_s), (_, j, theta) = logarithms(found.x), evaluate(found.x.tobytes())
    prediction = basis(s, real_s, LENGTH)[:, :d] @ theta
    covariance = np.linalg.pinv(j.T @ j) * np.sum((y - prediction) ** 2) / (LENGTH - d - g)
    return dict(
        s=s,
        real_s=real_s,
        theta=theta,
        covariance=covariance,
        prediction=prediction,
        residual=y - prediction,
        evaluations=found.nfev,
    )


def modes(model, rate):
    """Rows of f, its standard error, Q, its standard error, ascending in frequency."""
    s, re, im = model["s"], model["s"].real, model["s"].imag
    size, own = np.abs(s), np.arange(MODES)[:, None] + [0, MODES]
    # of |s| and Q, by ln(-re) and im
    slope = np.array([[re**2 / size, im / size], [0.5 * im**2 / (re * size), -0.5 * im / (re * size)]])
    error = np.sqrt(np.einsum("aik,kij,ajk->ak", slope, model["covariance"][own[:, :, None], own[:, None, :]], slope))
    table = [size * rate / (2.0 * np.pi), error[0] * rate / (2.0 * np.pi), -0.5 * size / re, error[1]]
    return np.column_stack(table)[np.argsort(size)]


def job(folder, out):
    windows, rate = cut(folder)
    aligned, shift = align(windows)
    lap("events")
    order = (rng := np.random.default_rng(1)).permutation(len(aligned))
    sets = {"identification": order[::2], "verification": order[1::2], "all": np.arange(len(aligned))}
    store = {"window": windows, "ensemble": aligned, "shift": shift}
    for name, rows in sets.items():
        mean = aligned[rows].mean(axis=0)
        coefficients, noise = regress(aligned[rows], mean)
        error = np.sqrt((noise**2).sum(axis=0) / (len(rows) - 1) / len(rows))
        store |= {
            f"mean_{name}": mean,
            f"variance_{name}": aligned[rows].var(axis=0, ddof=1),
            f"standard_error_{name}": error,
        }
        store |= {f"regression_{name}": coefficients, f"rows_{name}": rows}
    p = drift(noise, rng)
    lap("average, drift")
    t0, lines, models = release(mean, error.mean()), {}, {}
    for name in sets:
        lines[name], store[f"force_{name}"] = force(store[f"mean_{name}"], t0)
        store[f"windowed_{name}"] = np.diff([store[f"force_{name}"], store[f"mean_{name}"]])
        f, store[f"etfe_{name}"], store[f"smoothed_{name}"] = transfer(store[f"windowed_{name}"], rate)
    lap("force, spectra")
    for name in ("identification", "all"):
        models[name] = fit(store[f"mean_{name}"], t0, lines[name], store[f"force_{name}"])
        store |= {f"{key}_{name}": value for key, value in models[name].items()}
    lap("two fits")
    store |= {"frequency": f, "modes": (table := modes(models["all"], rate))}
    with h5py.File(out, "w") as file:
        for name, value in store.items():
            file[name] = value
        file.attrs.update(
            sample_rate_hz=rate, t0_sample=t0, drift_p_value=p, mode_columns=["f_hz", "f_std_hz", "Q", "Q_std"]
        )
    with open(out, "rb") as file:
        os.fsync(file.fileno())
    lap("write, sync")
    print(*("{:12.2f} +- {:5.2f} Hz   Q {:7.3f} +- {:.3f}".format(*row) for row in table), sep="\n")
    print(
        f"{len(aligned)} events, t0 at {t0}, drift p = {p:.2f}, "
        f"evaluations {[m['evaluations'] for m in models.values()]}"
    )
    print(
        "seconds:",
        ", ".join(f"{name} {seconds:.3f}" for name, seconds in CLOCK.items()),
        f"(CPU in all {time.process_time():.3f})",
    )


def timed(command, threads):
    """Wall and CPU seconds of a process, and what it printed."""
    usage = lambda: np.array([time.perf_counter(), sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])])
    before = usage()
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | threads)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return *(usage() - before), done.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--job", nargs=2, metavar=("DIR", "OUT.h5"), help="the script itself, once")
    parser.add_argument("--afmid", default=ROOT / "target/release/afmid", type=Path)
    parser.add_argument("--runs", default=5, type=int)
    options = parser.parse_args()
    if options.job:
        return job(*options.job)
    with tempfile.TemporaryDirectory() as folder:
        (raw := Path(folder, "raw")).mkdir()
        for path in sorted((ROOT.parent / "shared/data/afm/lever-a").glob("*.h5")):
            with h5py.File(path) as source, h5py.File(raw / path.name, "w") as target:
                target.attrs.update(source.attrs)
                for name in source:
                    target.create_dataset(name, data=source[name][()]).attrs.update(source[name].attrs)
        os.sync()  # nothing left to write back while the clock runs
        script = [sys.executable, SCRIPT, "--job", raw, Path(folder, "script.h5")]
        ours = [options.afmid, "run", ROOT / "configs/free-lever.toml", "--set", f'records.files=["{raw}/*.h5"]']
        times = {"script": [], "afmid": []}
        for i in range(options.runs):
            times["script"].append(timed(script, {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}))
            times["afmid"].append(
                timed([*ours, "--cache", Path(folder, f"cache-{i}"), "-o", Path(folder, "afmid.h5")], {})
            )
    print(min(times["script"])[2])  # of the fastest run
    print("| seconds | least | median | CPU, least | CPU, median |\n|---|---|---|---|---|")
    figures = {
        name: [pick([run[i] for run in runs]) for i in (0, 1) for pick in (min, np.median)]
        for name, runs in times.items()
    }
    for name in figures:
        print(f"| {name} |", " | ".join(f"{seconds:.3f}" for seconds in figures[name]), "|")
    print("| ratio |", " | ".join(f"{a / b:.1f}" for a, b in zip(*figures.values())), "|")
    print(f"load over a minute: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    sys.exit(main())
