"""The lean main job as a careful numpy/scipy script, timed beside afmid.

    python3 benches/peers/free_lever.py [--afmid target/release/afmid] [--runs 5]      # needs numpy, scipy, h5py

Decompresses lever-a into a temporary folder, warms the page cache, then lets both do the job in turn: whole processes, from start to synced result.
The script does what configs/free-lever.toml does: load, find and align the snap-offs, average (all, and one half), force by extrapolation, ETFE, smoothing (a
Gaussian window, cheaper than the local rational), two fits of order 11, modes, all of it written and synced. Its fit is an output error by variable projection with an analytic Jacobian: one start, no noise model,
no error estimates, so less work than `model.pem` does.
"""

import argparse
import glob
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
ARCHIVE = os.path.join(ROOT, "..", "shared", "data", "afm", "lever-a")
LENGTH, BEFORE, ORDER = 8192, 1024, 11


def job(folder, out):
    """The script itself."""
    start = time.perf_counter()
    import h5py
    import numpy as np
    from scipy import linalg, optimize, signal

    clock, last = {}, [start]

    def lap(name):
        now = time.perf_counter()
        clock[name], last[0] = now - last[0], now

    lap("imports")
    records = []
    for path in sorted(glob.glob(os.path.join(folder, "*.h5"))):
        with h5py.File(path) as file:
            data = file["deflection"]
            records.append(data[:])
            scale, rate = float(data.attrs["scale_factor"]), float(file.attrs["sample_rate_hz"])
    lap("load")

    # events: the largest rise of block means over four blocks, then the steepest sample
    windows = []
    for codes in records:
        means = codes[: len(codes) // 64 * 64].reshape(-1, 64).mean(axis=1, dtype=np.float32)
        block = int(np.argmax(means[4:] - means[:-4]))
        near = codes[block * 64 : (block + 6) * 64].astype(np.float32)
        edge = block * 64 + int(np.argmax(near[4:] - near[:-4])) + 2
        if BEFORE + 8 <= edge <= len(codes) - LENGTH:
            windows.append(codes[edge - BEFORE - 8 : edge - BEFORE + LENGTH + 8] * scale)
    windows = np.array(windows)
    # alignment on the mean: whole samples by correlation, then the phase of the cross-spectrum
    spectra = np.fft.rfft(np.diff(windows[:, BEFORE - 64 : BEFORE + 959], axis=1))
    w = 2 * np.pi * np.arange(spectra.shape[1]) / (2 * (spectra.shape[1] - 1))
    shift = np.zeros(len(windows))
    for whole in (True, True, False, False):
        turned = spectra * np.exp(1j * w * shift[:, None])
        cross = turned * turned.mean(axis=0).conj()
        if whole:
            lag = np.argmax(np.fft.irfft(cross), axis=1)
            shift += np.where(lag > 500, lag - 1022, lag)
            continue
        weight = np.abs(cross) * w
        shift -= (weight * np.angle(cross)).sum(axis=1) / (weight * w).sum(axis=1)
    full = np.fft.rfft(windows - windows[:, :1] - (windows[:, -1:] - windows[:, :1]) * np.linspace(0, 1, windows.shape[1]))
    turn = np.exp(2j * np.pi * np.arange(full.shape[1]) / windows.shape[1] * (shift - shift.mean())[:, None])
    line = windows[:, :1] + (windows[:, -1:] - windows[:, :1]) * np.linspace(0, 1, windows.shape[1])
    aligned = (np.fft.irfft(full * turn, windows.shape[1]) + line)[:, 8:-8]
    lap("events")

    mean, half = aligned.mean(axis=0), aligned[::2].mean(axis=0)
    spread = aligned.std(axis=0, ddof=1) / np.sqrt(len(aligned))

    # the release: where the mean leaves the ramp for good, some samples before it is steepest
    quiet, t = BEFORE - 200, np.arange(LENGTH)
    away = np.abs(mean - np.polyval(np.polyfit(t[:quiet], mean[:quiet], 1), t)) > 6 * spread[:quiet].mean()
    onset = int(np.flatnonzero(~away[:BEFORE])[-1]) - 2

    def force_of(y):
        ramp = np.polyval(np.polyfit(t[:quiet], y[:quiet] - y[-1024:].mean(), 1), t)
        return np.where(t < onset, ramp, 0.0)

    pairs = [(force_of(y), y) for y in (half, mean)]
    u, y = pairs[1]
    etfe = np.fft.rfft(np.diff(y)) / np.fft.rfft(np.diff(u))
    kernel = np.exp(-0.5 * np.linspace(-3, 3, 25) ** 2)
    smoothed = signal.fftconvolve(etfe, kernel / kernel.sum(), mode="same")
    lap("spectra")

    models = [fit(u, y, np, linalg, optimize, signal) for u, y in pairs]
    lap("fits")
    poles = models[1][0]
    s = np.log(poles[poles.imag > 0]) * rate
    frequency, quality = np.abs(s) / 2 / np.pi, -np.abs(s) / 2 / s.real
    order = np.argsort(frequency)
    with h5py.File(out, "w") as file:
        store = {"windows": windows, "aligned": aligned, "mean": mean, "half": half, "spread": spread, "force": u, "force_half": pairs[0][0], "etfe": etfe,
                 "smoothed": smoothed, "frequency_hz": frequency[order], "quality_factor": quality[order]}
        for i, (poles, theta, residual) in enumerate(models):
            store |= {f"poles_{i}": poles, f"theta_{i}": theta, f"residual_{i}": residual}
        for name, value in store.items():
            file[name] = value
    descriptor = os.open(out, os.O_RDONLY)
    os.fsync(descriptor)
    os.close(descriptor)
    lap("write")
    for f, q in zip(frequency[order], quality[order]):
        print(f"{f:12.1f} Hz  Q {q:8.2f}")
    print(len(windows), "events;", "  ".join(f"{name} {seconds:.3f}" for name, seconds in clock.items()))


def fit(u, y, np, linalg, optimize, signal):
    """Output error of order 11: five sections of second order and one of first; everything linear eliminated by QR."""
    n = len(y)
    free = y[BEFORE + 16 :] - y[-1024:].mean()
    rows = 60
    hankel = np.lib.stride_tricks.sliding_window_view(free, len(free) - rows + 1)
    left = linalg.eigh(hankel @ hankel.T, subset_by_index=[rows - 8, rows - 1])[1]
    modes = np.linalg.eigvals(np.linalg.lstsq(left[:-1], left[1:], rcond=None)[0])
    modes = modes[modes.imag > 0]
    modes = modes[np.argsort(np.abs(modes))[::-1]][:4]
    modes = np.where(np.abs(modes) < 1, modes, 0.999 * modes / np.abs(modes))
    start = np.array([[-2 * z.real, abs(z) ** 2] for z in modes]).ravel()
    start = np.concatenate([start, [-0.65, 0.075], [-0.7]])
    one, ramp, impulse = np.ones(n), np.linspace(-1, 1, n), np.zeros(n)
    impulse[0] = 1.0
    sections = [(2 * i, 2) for i in range(5)] + [(10, 1)]
    memory = {}

    def solve(p):
        key = p.tobytes()
        if key not in memory:
            memory.clear()
            stable = all(abs(b) < 1 and abs(a) < 1 + b for a, b in p[:10].reshape(-1, 2)) and abs(p[10]) < 1
            if not stable:
                memory[key] = (None, None, None, np.full(n, 1e3), None)
                return memory[key]
            columns, owners = [], []
            for first, size in sections:
                a = np.concatenate([[1.0], p[first : first + size]])
                forced, own = signal.lfilter([1.0], a, u), signal.lfilter([1.0], a, impulse)
                for j in range(size):
                    columns += [np.concatenate([np.zeros(j + 1), forced[: n - j - 1]]), np.concatenate([np.zeros(j), own[: n - j]])]
                    owners += [first, first]
            columns += [u, one, ramp]
            phi = np.array(columns).T
            q, r = linalg.qr(phi, mode="economic", check_finite=False, overwrite_a=False)
            theta = np.linalg.lstsq(r, q.T @ y, rcond=1e-13)[0]
            memory[key] = (phi, q, theta, y - phi @ theta, np.array(owners))
        return memory[key]

    def jacobian(p):
        phi, q, theta, _, owners = solve(p)
        j = np.zeros((n, len(p)))
        for first, size in sections:
            own = np.flatnonzero(owners == first)
            sensitivity = signal.lfilter([1.0], np.concatenate([[1.0], p[first : first + size]]), phi[:, own] @ theta[own])
            for k in range(size):
                j[k + 1 :, first + k] = sensitivity[: n - k - 1]
        return j - q @ (q.T @ j)

    found = optimize.least_squares(lambda p: solve(p)[3], start, jacobian, method="lm", x_scale="jac", xtol=1e-15, ftol=1e-8, max_nfev=40)
    _, _, theta, residual, _ = solve(found.x)
    poles = np.concatenate([np.roots(np.concatenate([[1.0], found.x[a : a + size]])) for a, size in sections])
    modal = poles[(poles.imag == 0) | (np.abs(poles.imag) > 0)]
    return modal, theta, residual


def timed(command):
    """Wall and user + system seconds of a process, and what it printed."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--job", nargs=2)
    arguments.add_argument("--afmid", default=os.path.join(ROOT, "target", "release", "afmid"))
    arguments.add_argument("--runs", type=int, default=5)
    given = arguments.parse_args()
    if given.job:
        return job(*given.job)
    import h5py

    with tempfile.TemporaryDirectory() as folder:
        raw = os.path.join(folder, "raw")
        os.mkdir(raw)
        for path in sorted(glob.glob(os.path.join(ARCHIVE, "*.h5"))):
            with h5py.File(path) as source, h5py.File(os.path.join(raw, os.path.basename(path)), "w") as target:
                target.attrs.update(source.attrs)
                for name in source:
                    target.create_dataset(name, data=source[name][()]).attrs.update(source[name].attrs)
        config = os.path.join(ROOT, "configs", "free-lever.toml")
        files = f'records.files=["{raw}/*.h5"]'
        times = {"script": [], "afmid": []}
        for _ in range(given.runs):
            times["script"].append(timed([sys.executable, os.path.abspath(__file__), "--job", raw, os.path.join(folder, "script.h5")]))
            cache = os.path.join(folder, "cache")
            shutil.rmtree(cache, ignore_errors=True)
            times["afmid"].append(timed([given.afmid, "run", config, "--set", files, "--cache", cache, "-o", os.path.join(folder, "afmid.h5")]))
        print(times["script"][-1][2])
        for name, runs in times.items():
            walls, cpus = [run[0] for run in runs], [run[1] for run in runs]
            print(f"{name:8} wall: least {min(walls):.3f} s, median {statistics.median(walls):.3f} s; CPU: median {statistics.median(cpus):.3f} s")
        least, median = (times_of(times, pick) for pick in (min, statistics.median))
        print(f"script over afmid: {least:.1f} (least), {median:.1f} (median)")


def times_of(times, pick):
    return pick([run[0] for run in times["script"]]) / pick([run[0] for run in times["afmid"]])


if __name__ == "__main__":
    main()
