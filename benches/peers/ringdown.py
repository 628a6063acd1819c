"""Fits of one free decay: time and errors of afmid beside scipy, SLICOT through Octave, scikit-rf, nfoursid and SIPPY.

    python3 -m venv /tmp/venv-peers && /tmp/venv-peers/bin/pip install scipy scikit-rf nfoursid sippy_unipi
    apt-get install octave octave-control
    cargo build --release -p afmid-stages --example accuracy && /tmp/venv-peers/bin/python benches/peers/ringdown.py

Data: the mean of 84 releases of the paper's lever in white noise, 8192 samples at 5 MS/s, from the first sample after
the release (`accuracy export SEED 84`); order 11: four modes and three real poles. Everyone gets the same samples, less
the mean of their last quarter, and the order; nobody gets a start value from the truth. Every time is a fit alone,
start values included: no interpreter start, no reading of files, one thread. Everyone is warm: one fit before the clock
runs.
Errors: rms over the seeds in units of the Cramer-Rao bound; the pole nearest in frequency counts, and a mode with no
decaying pole within 1 % of its frequency or with a Q off by more than a factor of two is missing.
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


# ---- scipy: variable projection in modal form ------------------------------------------------------------------------


HEAD = 128  # samples in which real poles may show
# bounds of a real pole's decay per sample: nothing left of it after the head; gone within one sample
SLOWEST, FASTEST = 0.2, 8.0
REAL_START = np.array([-2.0, -1.0, 0.0])  # 1.1, 2.3 and 4.1 per sample: spread over what the bounds leave
SCALE = 1e-3  # of the sample number, for columns of similar size
ROWS = 64  # of the start's Hankel matrix


def powers(z, samples):
    """z^k for k < samples, one column per z: an outer product of short tables instead of `samples` exponentials."""
    fine = z ** np.arange(HEAD)[:, None]
    coarse = (z**HEAD) ** np.arange(-(-samples // HEAD))[:, None]
    return (coarse[:, None, :] * fine[None, :, :]).reshape(-1, len(z))[:samples]


def hankel_poles(y, order, rows):
    """Poles by shift invariance of the dominant eigenvectors of the Hankel matrix's Gram matrix (ERA without its
    inputs).
    """
    from scipy.linalg import eigh

    columns = len(y) - rows + 1
    gram = np.empty((rows, rows))
    gram[0] = np.correlate(y, y[:columns], "valid")
    gram[:, 0] = gram[0]
    for i in range(rows - 1):  # each window differs from the last by one sample at both ends
        gram[i + 1, 1:] = gram[i, :-1] - y[i] * y[: rows - 1] + y[columns + i] * y[columns : columns + rows - 1]
    u = eigh(gram, subset_by_index=(rows - order, rows - 1), check_finite=False)[1]
    return np.linalg.eigvals(np.linalg.lstsq(u[:-1], u[1:], rcond=None)[0])


def modal_start(y):
    """ln z of the upper poles."""
    skip = 16  # most real poles are gone by then
    z = hankel_poles(y[skip:], 2 * MODES, ROWS)
    s = np.log(z[z.imag > 0.0])
    if len(s) != MODES:
        raise RuntimeError(f"the start has {len(s)} modes, wanted {MODES}")
    return np.minimum(s.real, -1e-6) + 1j * s.imag


# of the triangle's columns (modes, real poles, offset, their derivatives, y) those that last
MODAL = np.r_[: 2 * MODES, ORDER, ORDER + 1 : ORDER + 1 + 2 * MODES, 2 * ORDER + 1]


class Projection:
    """Residual and Kaufman's Jacobian of y = sum c_p z_p^k + offset with the linear part solved for.

    Both are handed on as the triangle of [J r]: same norms and gradients, 12 rows instead of 8192, which is all that
    Levenberg-Marquardt looks at. The triangle comes from a QR of the head's rows on top of the Cholesky factor of all
    later ones, where only modes are left; their Gram matrix is sums of exponentials, taken over blocks: no pass over
    the samples but one product with y.
    """

    def __init__(self, y):
        if len(y) % HEAD:
            raise ValueError(f"{len(y)} samples, wanted a multiple of {HEAD}")
        self.y, self.key = y, None
        self.fine = np.arange(HEAD)[:, None]
        self.coarse = np.arange(len(y) // HEAD)[:, None] * HEAD
        # sums over a block of y and of ones come in one product
        self.data = np.vstack([y.reshape(-1, HEAD), np.ones((1, HEAD))])
        self.total, self.square = y.sum(), y @ y

    def tail(self, a, b, head):
        """Cholesky factor of [Re z^k, Im z^k, 1, k Re z^k, k Im z^k, y] after the head, from z^k inside blocks and from
        block to block.
        """
        m, n = MODES, 2 * MODES + 1
        gram = np.empty((2 * n, 2 * n))
        # sums of k^i p q, k = fine + coarse, for p of the modes and q of the modes and of their conjugates
        right, far = np.hstack([a, a.conj()]), np.hstack([b, b.conj()])
        f = [a.T @ (w * right) for w in (1.0, self.fine, self.fine**2)]
        c = [b.T @ (w * far) for w in (1.0, self.coarse, self.coarse**2)]
        sums = (
            f[0] * c[0],
            SCALE * (f[1] * c[0] + f[0] * c[1]),
            SCALE**2 * (f[2] * c[0] + 2.0 * f[1] * c[1] + f[0] * c[2]),
        )
        for total, (i, j) in zip(sums, ((0, 0), (0, n), (n, n))):
            plus, minus = 0.5 * (total[:, :m] + total[:, m:]), 0.5 * (total[:, m:] - total[:, :m])
            gram[i : i + m, j : j + m], gram[i + m : i + 2 * m, j + m : j + 2 * m] = plus.real, minus.real
            gram[i : i + m, j + m : j + 2 * m], gram[i + m : i + 2 * m, j : j + m] = -minus.imag, plus.imag
        # of y p and of p, and of k times them
        inner = self.data @ np.hstack([a, self.fine * a])
        by_y, by_one = inner[:-1], inner[-1]
        drift = self.coarse * b
        for column, first, second in ((2 * n - 1, by_y[:, :m], by_y[:, m:]), (n - 1, by_one[:m], by_one[m:])):
            plain, sloped = (first * b).sum(0), SCALE * (second * b + first * drift).sum(0)
            gram[:m, column], gram[m : 2 * m, column] = plain.real, plain.imag
            gram[n : n + m, column], gram[n + m : 2 * n - 1, column] = sloped.real, sloped.imag
        gram[n - 1, n - 1], gram[n - 1, -1], gram[-1, -1] = len(self.y), self.total, self.square
        gram[n - 1, n:-1] = gram[n:-1, n - 1]
        return cholesky(gram - head.T @ head)

    def evaluate(self, x):
        key = x.tobytes()
        if key == self.key:
            return
        self.key = key
        n, m = ORDER, MODES
        s = -np.exp(x[:m]) + 1j * x[m : 2 * m]
        share = 1.0 / (1.0 + np.exp(-np.clip(x[2 * m :], -40.0, 40.0)))
        decay = SLOWEST + (FASTEST - SLOWEST) * share
        c, slopes, self.residual = self.project(s, decay)
        # d/d(Re s) of c_r Re z^k + c_i Im z^k is k times it; d/d(Im s) is k (c_i Re z^k - c_r Im z^k)
        re, im = c[:m], c[m : 2 * m]
        j = np.empty((len(self.residual), n))
        by_re, by_im = slopes[:, :m], slopes[:, m : 2 * m]
        j[:, :m] = (by_re * re + by_im * im) * s.real
        j[:, m : 2 * m] = by_re * im - by_im * re
        j[:, 2 * m :] = -slopes[:, 2 * m :] * c[2 * m : n] * (FASTEST - SLOWEST) * share * (1.0 - share)
        self.jacobian = -j

    def project(self, s, decay):
        """Linear parameters; k times the basis and y, both projected off the basis."""
        n, m = ORDER, MODES
        e, early = np.exp(self.fine * s), np.exp(-self.fine * decay)
        # columns: modes, real poles, offset, derivatives of both, y
        basis = np.hstack([e.real, e.imag, early])
        a = np.zeros((HEAD + 4 * m + 2, 2 * n + 2), order="F")
        a[:HEAD, :n], a[:HEAD, n] = basis, 1.0
        a[:HEAD, n + 1 : -1], a[:HEAD, -1] = SCALE * self.fine * basis, self.y[:HEAD]
        a[HEAD:, MODAL] = self.tail(e, np.exp(self.coarse * s), a[:HEAD, MODAL])
        t = triangle(a)
        c = np.linalg.solve(t[: n + 1, : n + 1], t[: n + 1, -1])
        # the projection off the basis is the rows below it
        return c, t[n + 1 :, n + 1 : -1] / SCALE, t[n + 1 :, -1].copy()

    def value(self, x):
        self.evaluate(x)
        return self.residual

    def slope(self, x):
        self.evaluate(x)
        return self.jacobian


def cholesky(gram):
    from scipy.linalg import lapack

    upper, info = lapack.dpotrf(gram, lower=0, clean=1)
    if info != 0:
        raise RuntimeError(f"dpotrf: {info}")
    return upper


def triangle(a):
    from scipy.linalg import lapack

    qr, _, _, info = lapack.dgeqrf(a, lwork=a.shape[1] * 64, overwrite_a=True)
    if info != 0:
        raise RuntimeError(f"dgeqrf: {info}")
    return np.triu(qr[: a.shape[1]])


class Samples(Projection):
    """The same with one residual per sample, as a textbook would."""

    def __init__(self, y):
        self.y, self.key, self.fine = y, None, np.arange(len(y))[:, None]

    def project(self, s, decay):
        e = powers(np.exp(s), len(self.y))
        basis = np.empty((len(self.y), ORDER + 1), order="F")
        basis[:, :MODES], basis[:, MODES : 2 * MODES] = e.real, e.imag
        basis[:, 2 * MODES : ORDER], basis[:, ORDER] = powers(np.exp(-decay), len(self.y)), 1.0
        q, r = np.linalg.qr(basis)
        data = q.T @ self.y
        slopes = self.fine * basis[:, :-1]
        return np.linalg.solve(r, data), slopes - q @ (q.T @ slopes), self.y - q @ data


def with_scipy(y, kind):
    from scipy.optimize import least_squares

    s = modal_start(y)
    problem = kind(y)
    start = np.concatenate([np.log(-s.real), s.imag, REAL_START])
    # ends when the sum of squares falls by less than 0.08 of the noise variance: errors stay as with 1e-12
    found = least_squares(problem.value, start, problem.slope, method="lm", x_scale="jac", ftol=1e-5)
    if not found.success:
        raise RuntimeError(found.message)
    return np.exp(-np.exp(found.x[:MODES]) + 1j * found.x[MODES : 2 * MODES])


# ---- vector fitting --------------------------------------------------------------------------------------------------


def vector_fit(y, spacing, bilinear):
    """scikit-rf on the spectrum, up to the Nyquist frequency exclusively; `bilinear`: its axis bent so that sampled
    decays are exactly rational.
    """
    import skrf

    spectrum = np.fft.rfft(y)[:-1]
    w = 2.0 * np.pi * np.arange(len(spectrum)) / len(y)
    axis = 2.0 * np.tan(w / 2.0) if bilinear else w
    network = skrf.Network(f=axis * RATE / (2.0 * np.pi), f_unit="Hz", s=spectrum.reshape(-1, 1, 1), z0=50.0)
    fit = skrf.vectorFitting.VectorFitting(network)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit.vector_fit(
            n_poles_real=REAL, n_poles_cmplx=MODES, init_pole_spacing=spacing, fit_constant=True, enforce_dc=False
        )
    s = fit.poles / RATE
    return (1.0 + s / 2.0) / (1.0 - s / 2.0) if bilinear else np.exp(s)


# ---- subspace methods ------------------------------------------------------------------------------------------------


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
                ["octave", "-q", "--no-gui", "--eval", script],
                capture_output=True,
                text=True,
                timeout=LIMIT * (len(data) + 1),
            )
        except subprocess.TimeoutExpired:
            return "timeout"
    lines = [line.split() for line in done.stdout.splitlines() if line.startswith("fit ")]
    if len(lines) != len(data) + 1:
        return "error: " + (done.stderr.strip().splitlines() or ["?"])[0]
    numbers = [np.array(line[1:], dtype=float) for line in lines[1:]]
    return [(n[0], n[1::2] + 1j * n[2::2]) for n in numbers]


# ---- the comparison --------------------------------------------------------------------------------------------------


# name, fit, its arguments, most seeds. Subspace methods take s block rows; `rest`: twice as many zeros before the pulse
# that starts the decay
PEERS = [
    ("scipy `least_squares`, variable projection, a residual per sample", with_scipy, (Samples,), 1000),
    ("scipy `least_squares`, variable projection, compressed", with_scipy, (Projection,), 1000),
    ("scikit-rf vector fitting, as it comes", vector_fit, ("lin", False), 1000),
    ("scikit-rf vector fitting, logarithmic start", vector_fit, ("log", False), 1000),
    ("scikit-rf vector fitting, bilinear axis", vector_fit, ("lin", True), 1000),
    ("scikit-rf vector fitting, bilinear axis, logarithmic start", vector_fit, ("log", True), 1000),
    ("SLICOT `moen4`, s = 60", "octave", (60, 0, "C"), 1000),
    ("SLICOT `moen4`, s = 100", "octave", (100, 0, "C"), 1000),
    ("SLICOT `moen4`, s = 60, rest before the pulse", "octave", (60, 120, "C"), 1000),
    ("SLICOT `moen4`, s = 100, rest before the pulse", "octave", (100, 200, "C"), 1000),
    ("SIPPY N4SID, s = 60", with_sippy, ("N4SID", 60, 0), 1000),
    ("SIPPY MOESP, s = 60", with_sippy, ("MOESP", 60, 0), 1000),
    ("SIPPY CVA, s = 60", with_sippy, ("CVA", 60, 0), 1000),
    ("SIPPY N4SID, s = 100", with_sippy, ("N4SID", 100, 0), 1000),
    ("SIPPY N4SID, s = 100, rest before the pulse", with_sippy, ("N4SID", 100, 200), 1000),
    ("nfoursid, s = 60, rest before the pulse", with_nfoursid, (60, 120), 3),
    ("nfoursid, s = 100, rest before the pulse", with_nfoursid, (100, 200), 3),
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


def in_process(data, fit, arguments):
    """(seconds, poles) per seed, after one fit to import and warm up, from one process that ends with a fit that takes
    too long.
    """
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    child = context.Process(target=serve, args=(theirs, fit, arguments), daemon=True)
    child.start()
    results = []
    try:
        for i, y in enumerate([data[0], *data]):
            ours.send(y)
            if not ours.poll(LIMIT + (30.0 if i == 0 else 0.0)):  # the first one imports
                return [*results[1:], "timeout"]
            results.append(ours.recv())
    finally:
        child.kill()
        child.join()
    return results[1:]


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
    """One line of the table; `relative`: seeds x 8, `ours`: our median while this was measured."""
    missing = int(np.isnan(relative[:, ::2]).sum())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        squares = (relative / bound) ** 2
        rms = np.sqrt(np.append(np.nanmean(squares, axis=0), np.nanmean(squares)))
    cells = " | ".join("-" if np.isnan(r) else f"{r:.2f}" if r < 99.995 else f"{r:.0f}" for r in rms)
    median = float(np.median(times))
    ratio = f"{median / ours:.{1 if median < 10.0 * ours else 0}f}"
    span = f"{1e3 * median:.4g} | {1e3 * min(times):.4g} | {1e3 * ours:.4g} | {ratio}"
    return f"| {name} | {len(relative)} | {cells} | {missing} | {span} |"


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
    rows, notes, times, joint, loads = [], [], [], [], []
    for name, fit, arguments, most in PEERS:
        if options.only.lower() not in name.lower():
            continue
        print(f"{name} ..", file=sys.stderr, flush=True)
        loads.append(os.getloadavg()[0])
        some = data[:most]
        # ours before and after each peer, so that both meet the same load
        fits = [json.loads(run("fit", seed, 84)) for seed in seeds]
        results = with_octave(some, *arguments) if fit == "octave" else in_process(some, fit, arguments)
        after = [json.loads(run("fit", seed, 84)) for seed in seeds]
        beside = [f["decay"]["seconds"] for f in fits + after]
        times += beside
        joint += [f["joint"]["seconds"] for f in fits + after]
        bound = np.array(fits[0]["bound"])
        if isinstance(results, str):
            results = [results]
        done = [r for r in results if not isinstance(r, str)]
        notes += [f"{name}: {r}" for r in results if isinstance(r, str)]
        if done:
            relative = np.array([errors(poles) for _, poles in done])
            rows.append(row(name, [t for t, _ in done], relative, bound, float(np.median(beside))))
        else:
            rows.append(f"| {name} | 0 |" + " - |" * 10 + f" {results[0].split(':')[0]} | - | - | - |")
    print(
        "| fit | seeds | f1 | Q1 | f2 | Q2 | f3 | Q3 | f4 | Q4 | all | modes missing "
        "| median, ms | least, ms | ours beside it, ms | over ours |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    median = float(np.median(times))
    own = [("fit_decay", "decay", times), ("fit_ringdowns", "joint", joint)]
    own = [
        row(f"afmid `{name}`", t, np.array([f[key]["relative_error"] for f in fits]), bound, median)
        for name, key, t in own
    ]
    print(*own, *rows, "", *notes, sep="\n")
    packages = ("numpy", "scipy", "scikit-rf", "nfoursid", "sippy_unipi")
    print(f"Python {platform.python_version()}", *(f"{p} {version(p)}" for p in packages), sep=", ")
    control = 'p = pkg("list", "control"); disp(["Octave " version ", control " p{1}.version])'
    print(
        subprocess.run(["octave", "-q", "--no-gui", "--eval", control], capture_output=True, text=True).stdout.strip()
    )
    print(f"load over a minute, at each peer's start: {min(loads):.1f} to {max(loads):.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    sys.exit(main())
