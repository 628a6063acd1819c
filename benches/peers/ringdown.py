"""Fits of one free decay: time and errors of afmid beside scipy, SLICOT through Octave, scikit-rf, nfoursid and SIPPY.

    python3 -m venv /tmp/venv-peers && /tmp/venv-peers/bin/pip install scipy scikit-rf nfoursid sippy_unipi
    apt-get install octave octave-control
    cargo build --release -p afmid-stages --example accuracy && /tmp/venv-peers/bin/python benches/peers/ringdown.py

Data: the mean of 84 releases of the paper's lever in white noise, 8192 samples at 5 MS/s, from the first sample after the release
(`accuracy export SEED 84`); order 11: four modes and three real poles. Everyone gets the same samples, less the mean of their last quarter, and the
order; nobody gets a start value from the truth. Every time is a fit alone, start values included: no interpreter start, no reading of files, one thread.
The peers are warm (one fit of the first seed before the clock runs, except for those that take seconds); ours is the first fit of a new process.
Errors: rms over the seeds in units of the Cramer-Rao bound; the pole nearest in frequency counts, and a mode with no decaying pole within 1 % of its
frequency or with a Q off by more than a factor of two is missing.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
import warnings
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
RATE = 5e6
FREQUENCY = np.array([46.3e3, 247.4e3, 580.8e3, 1051.2e3])
QUALITY = np.array([40.8, 193.2, 358.0, 503.8])
MODES, REAL = 4, 3
ORDER = 2 * MODES + REAL
LIMIT = 120.0  # seconds per fit


# ---- scipy: variable projection in modal form ------------------------------------------------------------------------------------------


def powers(z, samples):
    """z^k for k < samples, one column per z: an outer product of short tables instead of `samples` exponentials."""
    short = 128
    fine = z ** np.arange(short)[:, None]
    coarse = (z**short) ** np.arange(-(-samples // short))[:, None]
    return (coarse[:, None, :] * fine[None, :, :]).reshape(-1, len(z))[:samples]


def hankel_poles(y, order, rows):
    """Poles by shift invariance of the dominant eigenvectors of the Hankel matrix's Gram matrix (ERA without its inputs)."""
    h = np.lib.stride_tricks.sliding_window_view(y, rows)
    h = np.ascontiguousarray(h)
    gram = h.T @ h
    u = np.linalg.eigh(gram)[1][:, -order:]
    return np.linalg.eigvals(np.linalg.lstsq(u[:-1], u[1:], rcond=None)[0])


def modal_start(y):
    """ln z of the upper poles and ln of the real poles' decay per sample."""
    skip = 16  # samples after which real poles in this band are gone
    z = hankel_poles(y[skip:], 2 * MODES, 96)
    s = np.log(z[z.imag > 0.0])
    if len(s) != MODES:
        raise RuntimeError(f"the start has {len(s)} modes, wanted {MODES}")
    s = np.minimum(s.real, -1e-6) + 1j * s.imag
    e = powers(np.exp(s), len(y))
    basis = np.hstack([e.real, e.imag, np.ones((len(y), 1))])
    amplitudes = np.linalg.lstsq(basis[skip:], y[skip:], rcond=None)[0]
    rest = (y - basis @ amplitudes)[:skip]
    h = np.lib.stride_tricks.sliding_window_view(rest, 5)
    u = np.linalg.svd(h.T)[0][:, :REAL]
    z = np.linalg.eigvals(np.linalg.lstsq(u[:-1], u[1:], rcond=None)[0])
    usable = np.all(np.abs(z.imag) < 1e-12) and np.all((z.real > 1e-3) & (z.real < 0.9))
    decay = -np.log(z.real) if usable else np.array([0.5, 1.5, 2.5])
    return s, np.log(decay)


class Projection:
    """Residual and Kaufman's Jacobian of y = sum c_p z_p^k + offset with the linear part solved for.

    Both are handed on as the triangle of [J r]: same norms and gradients, 12 rows instead of 8192, which is all that Levenberg-Marquardt looks at.
    """

    def __init__(self, y):
        self.y, self.k, self.key = y, np.arange(len(y), dtype=float), None

    def evaluate(self, x):
        key = x.tobytes()
        if key == self.key:
            return
        self.key = key
        s = -np.exp(x[:MODES]) + 1j * x[MODES : 2 * MODES]
        decay = np.exp(x[2 * MODES :])
        samples, n = len(self.y), ORDER
        e = powers(np.exp(s), samples)
        early = powers(np.exp(-decay), samples)
        a = np.empty((samples, 2 * n + 2), order="F")  # basis, offset, derivatives, y
        a[:, :MODES], a[:, MODES : 2 * MODES], a[:, 2 * MODES : n], a[:, n] = e.real, e.imag, early, 1.0
        np.multiply(a[:, :n], self.k[:, None], out=a[:, n + 1 : 2 * n + 1])
        a[:, -1] = self.y
        # one triangle of [basis, k basis, y]: everything else is small
        t = triangle(a)
        basis, slopes, data = t[:, : n + 1], t[:, n + 1 : 2 * n + 1], t[:, -1]
        c = np.linalg.solve(basis[: n + 1], data[: n + 1])
        # d/d(Re s) of c_r Re z^k + c_i Im z^k is k times it; d/d(Im s) is k (c_i Re z^k - c_r Im z^k)
        re, im = c[:MODES], c[MODES : 2 * MODES]
        j = np.empty((2 * n + 2, n))
        by_re, by_im = slopes[:, :MODES], slopes[:, MODES : 2 * MODES]
        j[:, :MODES] = (by_re * re + by_im * im) * s.real
        j[:, MODES : 2 * MODES] = by_re * im - by_im * re
        j[:, 2 * MODES :] = -slopes[:, 2 * MODES :] * c[2 * MODES : n] * decay
        # the projection off the basis is the rows below it
        self.residual, self.jacobian = data[n + 1 :].copy(), -j[n + 1 :]

    def value(self, x):
        self.evaluate(x)
        return self.residual

    def slope(self, x):
        self.evaluate(x)
        return self.jacobian


def triangle(a):
    from scipy.linalg import lapack

    qr, _, _, info = lapack.dgeqrf(a, lwork=a.shape[1] * 64, overwrite_a=True)
    if info != 0:
        raise RuntimeError(f"dgeqrf: {info}")
    return np.triu(qr[: a.shape[1]])


def with_scipy(y):
    from scipy.optimize import least_squares

    s, real = modal_start(y)
    problem = Projection(y)
    start = np.concatenate([np.log(-s.real), s.imag, real])
    found = least_squares(lambda x: problem.value(x), start, lambda x: problem.slope(x), method="lm", x_scale="jac")
    if not found.success:
        raise RuntimeError(found.message)
    return np.exp(-np.exp(found.x[:MODES]) + 1j * found.x[MODES : 2 * MODES])


# ---- vector fitting --------------------------------------------------------------------------------------------------------------------


def vector_fit(y, spacing, bilinear):
    """scikit-rf on the spectrum, up to the Nyquist frequency exclusively; `bilinear`: its axis bent so that sampled decays are exactly rational."""
    import skrf

    spectrum = np.fft.rfft(y)[:-1]
    w = 2.0 * np.pi * np.arange(len(spectrum)) / len(y)
    axis = 2.0 * np.tan(w / 2.0) if bilinear else w
    network = skrf.Network(f=axis * RATE / (2.0 * np.pi), f_unit="Hz", s=spectrum.reshape(-1, 1, 1), z0=50.0)
    fit = skrf.vectorFitting.VectorFitting(network)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit.vector_fit(n_poles_real=REAL, n_poles_cmplx=MODES, init_pole_spacing=spacing, fit_constant=True, enforce_dc=False)
    s = fit.poles / RATE
    return (1.0 + s / 2.0) / (1.0 - s / 2.0) if bilinear else np.exp(s)


# ---- subspace methods ------------------------------------------------------------------------------------------------------------------


def pulse(y, before):
    """The decay as the answer of a system at rest to a pulse at its first sample."""
    u, padded = np.zeros(len(y) + before), np.concatenate([np.zeros(before), y])
    u[before] = 1.0
    return u, padded


def with_nfoursid(y, rows, before):
    import pandas
    from nfoursid.nfoursid import NFourSID

    u, y = pulse(y, before)
    fit = NFourSID(pandas.DataFrame({"u": u, "y": y}), ["y"], ["u"], num_block_rows=rows)
    fit.subspace_identification()
    return np.linalg.eigvals(fit.system_identification(rank=ORDER)[0].a)


def with_sippy(y, method, rows, before):
    from sippy_unipi import system_identification

    u, y = pulse(y, before)
    found = system_identification(
        y[None], u[None], method, SS_fixed_order=ORDER, SS_f=rows, SS_p=rows, SS_D_required=True, SS_A_stability=False
    )
    return np.linalg.eigvals(found.A)


OCTAVE = """
pkg load control
files = {%s};
for i = [1, 1:numel(files)]
  y = load(files{i}); u = zeros(size(y)); u(%d) = 1;
  dat = iddata(y, u, 1 / 5e6);
  tic; sys = moen4(dat, %d, "s", %d, "alg", "%s"); t = toc;
  z = eig(sys.a);
  printf("fit %%.9g", t); printf(" %%.17g", [real(z).'; imag(z).']); printf("\\n"); fflush(stdout);
end
"""


def with_octave(data, rows, before, algorithm):
    """(seconds, poles) per seed, after one fit to warm up."""
    with tempfile.TemporaryDirectory() as folder:
        names = []
        for i, y in enumerate(data):
            names.append(f'"{folder}/{i}"')
            np.savetxt(f"{folder}/{i}", pulse(y, before)[1], fmt="%.17e")
        script = OCTAVE % (", ".join(names), before + 1, ORDER, rows, algorithm)
        try:
            done = subprocess.run(
                ["octave", "-q", "--no-gui", "--eval", script], capture_output=True, text=True, timeout=LIMIT * (len(data) + 1)
            )
        except subprocess.TimeoutExpired:
            return "timeout"
    lines = [line.split() for line in done.stdout.splitlines() if line.startswith("fit ")]
    if len(lines) != len(data) + 1:
        return "error: " + (done.stderr.strip().splitlines() or ["?"])[0]
    numbers = [np.array(line[1:], dtype=float) for line in lines[1:]]
    return [(n[0], n[1::2] + 1j * n[2::2]) for n in numbers]


# ---- the comparison --------------------------------------------------------------------------------------------------------------------


# name, fit, its arguments, most seeds, whether it warms up
PEERS = [
    ("scipy `least_squares`, variable projection", with_scipy, (), 1000, True),
    ("scikit-rf vector fitting, as it comes", vector_fit, ("lin", False), 1000, True),
    ("scikit-rf vector fitting, logarithmic start", vector_fit, ("log", False), 1000, True),
    ("scikit-rf vector fitting, bilinear axis", vector_fit, ("lin", True), 1000, True),
    ("scikit-rf vector fitting, bilinear axis, logarithmic start", vector_fit, ("log", True), 1000, True),
    ("SLICOT `moen4`, s = 60", "octave", (60, 0, "C"), 1000, True),
    ("SLICOT `moen4`, s = 100", "octave", (100, 0, "C"), 1000, True),
    ("nfoursid, 60 block rows", with_nfoursid, (60, 0), 3, False),
    ("SIPPY N4SID, 60 block rows", with_sippy, ("N4SID", 60, 0), 3, False),
    ("SIPPY MOESP, 60 block rows", with_sippy, ("MOESP", 60, 0), 3, False),
    ("SIPPY CVA, 60 block rows", with_sippy, ("CVA", 60, 0), 3, False),
]


def serve(pipe, fit, arguments):
    while True:
        y = pipe.recv()
        try:
            started = time.perf_counter()
            poles = fit(y, *arguments)
            pipe.send((time.perf_counter() - started, np.asarray(poles, dtype=complex)))
        except Exception as error:
            pipe.send(f"error: {error!r}")


def in_process(data, fit, arguments, warm):
    """(seconds, poles) per seed, from one process that ends with a fit that takes too long."""
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    child = context.Process(target=serve, args=(theirs, fit, arguments), daemon=True)
    child.start()
    results = []
    try:
        for i, y in enumerate([data[0], *data] if warm else data):
            ours.send(y)
            if not ours.poll(LIMIT + (30.0 if i == 0 else 0.0)):  # the first one imports
                return results[warm:] + ["timeout"] if len(results) > warm else "timeout"
            results.append(ours.recv())
    finally:
        child.kill()
        child.join()
    return results[warm:]


def errors(poles):
    """Relative errors f1, Q1, f2, ..; not-a-number for a missing mode."""
    poles = poles[(poles.imag > 0.0) & (np.abs(poles) < 1.0)]
    s = np.log(poles) * RATE
    f, q = np.abs(s) / (2.0 * np.pi), np.abs(s) / (-2.0 * s.real)
    out = []
    for f0, q0 in zip(FREQUENCY, QUALITY):
        near = np.argmin(np.abs(f - f0)) if len(f) else None
        found = near is not None and abs(f[near] / f0 - 1.0) < 0.01 and 0.5 < q[near] / q0 < 2.0
        out += [f[near] / f0 - 1.0, q[near] / q0 - 1.0] if found else [np.nan, np.nan]
    return np.array(out)


def row(name, times, relative, bound, ours):
    """One line of the table; `relative`: seeds x 8."""
    missing = int(np.isnan(relative[:, ::2]).sum())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rms = np.sqrt(np.nanmean((relative / bound) ** 2, axis=0))
    cells = " | ".join("-" if np.isnan(r) else f"{r:.2f}" if r < 100 else f"{r:.0f}" for r in rms)
    median = float(np.median(times))
    ratio = f"{median / ours:.1f}"
    print(
        f"| {name} | {len(times)} | {cells} | {missing} | {1e3 * median:.2f} | {1e3 * min(times):.2f} | {ratio} |", flush=True
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=ROOT / "target/release/examples/accuracy", type=Path)
    parser.add_argument("--seeds", default=10, type=int)
    parser.add_argument("--only", default="", help="peers whose name contains this")
    options = parser.parse_args()
    run = lambda *a: subprocess.run([options.program, *map(str, a)], check=True, capture_output=True, text=True).stdout
    seeds = range(1, options.seeds + 1)
    data = [np.array(run("export", seed, 84).split(), dtype=float) for seed in seeds]
    data = [y - y[-len(y) // 4 :].mean() for y in data]
    fits = [[json.loads(run("fit", seed, 84)) for seed in seeds] for _ in range(5)]
    bound = np.array(fits[0][0]["bound"])
    times = [fit["seconds"] for repeat in fits for fit in repeat]
    ours = float(np.median(times))
    print("| fit | runs | f1 | Q1 | f2 | Q2 | f3 | Q3 | f4 | Q4 | modes missing | median, ms | least, ms | times ours |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    row("afmid `fit_ringdowns`", times, np.array([fit["relative_error"] for fit in fits[0]]), bound, ours)
    notes = []
    for name, fit, arguments, most, warm in PEERS:
        if options.only.lower() not in name.lower():
            continue
        some = data[:most]
        results = with_octave(some, *arguments) if fit == "octave" else in_process(some, fit, arguments, warm)
        if isinstance(results, str):
            results = [results]
        done = [r for r in results if not isinstance(r, str)]
        notes += [f"{name}: {r}" for r in results if isinstance(r, str)]
        if done:
            row(name, [t for t, _ in done], np.array([errors(poles) for _, poles in done]), bound, ours)
        else:
            print(f"| {name} | 0 |" + " - |" * 9 + f" {results[0].split(':')[0]} | | |", flush=True)
    print()
    for note in notes:
        print(note)
    packages = ("numpy", "scipy", "scikit-rf", "nfoursid", "sippy_unipi")
    print("Python", platform.python_version(), *(f"{p} {version(p)}" for p in packages), sep=", ")
    control = 'p = pkg("list", "control"); disp(["Octave " version ", control " p{1}.version])'
    print(subprocess.run(["octave", "-q", "--no-gui", "--eval", control], capture_output=True, text=True).stdout.strip())
    print("load over 1, 5 and 15 minutes:", *(f"{load:.1f}" for load in os.getloadavg()), f"on {os.cpu_count()} cores")


if __name__ == "__main__":
    sys.exit(main())
