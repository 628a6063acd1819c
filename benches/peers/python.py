"""The Python package as its users call it, beside what they would call otherwise: times, errors, memory, start-up.

    make wheel && python3 -m venv /tmp/venv-python
    /tmp/venv-python/bin/pip install dist/afmid-*.whl scipy nfoursid sippy_unipi sdypy-EMA
    /tmp/venv-python/bin/python benches/peers/python.py dist/afmid-*.whl

Both get the same arrays; a time is the call alone, on one thread, after one call to warm up. They are run in turn, seed
by seed, and `times ours` is the median of the ratios within such pairs: a load on the machine meets both. Peers get the
number of modes or the order, and of SIPPY's, nfoursid's and SDyPy's settings each has a row. Errors are those against
the truth of the simulation.
"""

import argparse
import importlib.metadata
import os
import platform
import subprocess
import sys
import time
import warnings
from pathlib import Path

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[name] = "1"

import afmid
import numpy as np
from afmid import _native
from scipy.linalg import cholesky, eigh, qr, solve_triangular
from scipy.optimize import curve_fit, least_squares, linear_sum_assignment
from scipy.signal import cont2discrete, dlsim, find_peaks

# the lever of docs/paper.md
RATE_HZ = 5e6
LEVER_HZ = np.array([46.3e3, 247.4e3, 580.8e3, 1051.2e3])
LEVER_DAMPING = 0.5 / np.array([40.8, 193.2, 358.0, 503.8])
SAMPLES = 8192
HITS = 24


def poles_of(frequency_hz, damping):
    return 2 * np.pi * frequency_hz * (-damping + 1j * np.sqrt(1 - damping**2))


def modal(s):
    """Frequencies in Hz and damping ratios, ascending, a row each."""
    s = s[s.imag > 0]
    found = np.array([np.abs(s) / (2 * np.pi), -s.real / np.abs(s)])
    return found[:, np.argsort(found[0])]


def relative_errors(found, truth):
    """Of frequency and damping of each true mode (2 x modes); NaN where no mode within 1 % has a damping within a
    factor of two.
    """
    out = np.full(truth.shape, np.nan)
    if found.shape[1]:
        near = np.abs(found[0] / truth[0][:, None] - 1)
        for i, j in zip(*linear_sum_assignment(near), strict=True):
            if near[i, j] < 0.01 and 0.5 < found[1, j] / truth[1, i] < 2:
                out[:, i] = found[:, j] / truth[:, i] - 1
    return out


def of_table(modes):
    return np.array([modes.frequency_hz, modes.damping_ratio])


# ---- free decays: scipy by hand --------------------------------------------------------------------------------------


BLOCK = 128
SCALE = 1e-3  # of the sample number, so that columns are of similar size
ROWS = 64  # of the start's Hankel matrix


def powers(z, samples):
    """z^k for k < samples, a column per z: outer products of short tables."""
    fine = z ** np.arange(BLOCK)[:, None]
    coarse = (z**BLOCK) ** np.arange(-(-samples // BLOCK))[:, None]
    return (coarse[:, None, :] * fine[None, :, :]).reshape(-1, len(z))[:samples]


def hankel_start(y, modes):
    """Logarithms of the poles by shift invariance of the dominant eigenvectors of all hits' Hankel matrices."""
    y = y - y[:, -y.shape[1] // 4 :].mean(axis=1)[:, None]
    columns = y.shape[1] - ROWS + 1
    gram = np.empty((ROWS, ROWS))
    gram[0] = sum(np.correlate(row, row[:columns], "valid") for row in y)
    gram[:, 0] = gram[0]
    for i in range(ROWS - 1):  # each window differs from the last by one sample at both ends
        out, come = y[:, i] @ y[:, : ROWS - 1], y[:, columns + i] @ y[:, columns : columns + ROWS - 1]
        gram[i + 1, 1:] = gram[i, :-1] - out + come
    u = eigh(gram, subset_by_index=(ROWS - 2 * modes, ROWS - 1), check_finite=False)[1]
    s = np.log(np.linalg.eigvals(np.linalg.lstsq(u[:-1], u[1:], rcond=None)[0]))
    s = s[s.imag > 0]
    return np.minimum(s.real, -1e-6) + 1j * s.imag


class Projection:
    """Residual and Kaufman's Jacobian of decays of common poles, `y_h = sum_m Re(c_hm z_m^k) + offset_h`, amplitudes
    and offsets solved for. Both are handed on as the triangle of [J r], of the same norms and gradients: no step passes
    over the samples but for products of the basis with itself and with the data. Shapes: y hits x samples.
    """

    def __init__(self, y, modes):
        self.modes, self.y, self.key = modes, np.ascontiguousarray(y.T), None
        self.square = self.y.T @ self.y
        self.k = SCALE * np.arange(len(self.y))[:, None]

    def basis(self, x):
        """[Re z^k, Im z^k, 1, k Re z^k, k Im z^k]."""
        z = powers(np.exp(x[: self.modes] + 1j * x[self.modes :]), len(self.y))
        return np.hstack([z.real, z.imag, np.ones((len(z), 1)), self.k * z.real, self.k * z.imag])

    def reduced(self, x):
        """Triangle of basis and data together."""
        basis = self.basis(x)
        of_data = basis.T @ self.y
        return cholesky(np.block([[basis.T @ basis, of_data], [of_data.T, self.square]]), check_finite=False)

    def both(self, x):
        if self.key is None or not np.array_equal(x, self.key):
            m, n = self.modes, 2 * self.modes + 1
            r = self.reduced(x)
            c = solve_triangular(r[:n, :n], r[:n, n + 2 * m :], check_finite=False)
            slopes, left = r[n:, n : n + 2 * m] / SCALE, r[n:, n + 2 * m :]
            re, im = slopes[:, :m, None], slopes[:, m:, None]
            a, b = c[None, :m], c[None, m : 2 * m]
            jacobian = -np.concatenate([re * a + im * b, re * b - im * a], axis=1)
            stacked = np.concatenate([jacobian, left[:, None, :]], axis=1).transpose(2, 0, 1).reshape(-1, 2 * m + 1)
            triangle = qr(stacked, mode="r", check_finite=False)[0][: 2 * m + 1]
            self.key, self.found = x.copy(), (triangle[:, -1], triangle[:, :-1])
        return self.found


class Samples(Projection):
    """The same with a residual for every sample."""

    def reduced(self, x):
        return qr(np.hstack([self.basis(x), self.y]), mode="r", check_finite=False)[0]

    def both(self, x):
        if self.key is None or not np.array_equal(x, self.key):
            m, n = self.modes, 2 * self.modes + 1
            basis = self.basis(x)
            q, r = qr(basis[:, :n], mode="economic", check_finite=False)
            along = q.T @ self.y
            c = solve_triangular(r, along, check_finite=False)
            slopes = basis[:, n:] / SCALE
            slopes = slopes - q @ (q.T @ slopes)
            re, im = slopes[:, :m, None], slopes[:, m:, None]
            a, b = c[None, :m], c[None, m : 2 * m]
            jacobian = -np.concatenate([re * a + im * b, re * b - im * a], axis=1)
            jacobian = jacobian.transpose(2, 0, 1).reshape(-1, 2 * m)
            self.key, self.found = x.copy(), ((self.y - q @ along).T.ravel(), jacobian)
        return self.found


def by_scipy(kind, y, modes, rate_hz):
    """Frequencies and damping ratios of decays (hits x samples)."""
    problem, start = kind(y, modes), hankel_start(y, modes)
    x0 = np.concatenate([start.real, start.imag])
    size = np.concatenate([np.maximum(-start.real, 1e-6), np.maximum(-start.real, 1e-6)])
    fit = least_squares(
        lambda x: problem.both(x)[0], x0, jac=lambda x: problem.both(x)[1], method="lm", x_scale=size, xtol=1e-10
    )
    return modal(rate_hz * (fit.x[:modes] + 1j * fit.x[modes:]))


def by_curve_fit(y, modes, rate_hz):
    """Frequencies and damping ratios of one decay as SciPy's manual fits a curve: a sum of decaying cosines and an
    offset, from the highest peaks of the spectrum and a damping of 1 %, derivatives by differences.
    """
    t = np.arange(len(y)) / rate_hz

    def model(t, offset, *of_modes):
        return offset + sum(
            a * np.exp(-rate * t) * np.cos(2 * np.pi * f * t + phase)
            for a, rate, f, phase in np.reshape(of_modes, (-1, 4))
        )

    spectrum = np.fft.rfft(y - y.mean())
    size = np.abs(spectrum)
    peaks = find_peaks(size)[0]
    peaks = peaks[np.argsort(size[peaks])[-modes:]]
    f = peaks * rate_hz / len(y)
    rates = 2 * np.pi * f * 0.01
    start = np.stack([2 * rates * size[peaks] / rate_hz, rates, f, np.angle(spectrum[peaks])], axis=1)
    found = np.reshape(curve_fit(model, t, y, np.concatenate([[0.0], start.ravel()]))[0][1:], (-1, 4))
    found = found[np.argsort(found[:, 2])]
    size = np.hypot(found[:, 1], 2 * np.pi * found[:, 2])
    return np.array([size / (2 * np.pi), found[:, 1] / size])


def decays(seed, frequency_hz, damping, rate_hz, samples, hits, noise):
    """Hits of random amplitudes and phases, and the Cramer-Rao bound of relative frequency and damping (2 x modes)."""
    rng = np.random.default_rng(seed)
    s = poles_of(frequency_hz, damping) / rate_hz
    clean = powers(np.exp(s), samples)
    shares = 1 / np.arange(1, len(s) + 1)
    c = shares * rng.uniform(0.5, 1.0, (hits, len(s))) * np.exp(2j * np.pi * rng.random((hits, len(s))))
    exact = (c @ clean.T).real
    problem = Samples(exact, len(s))
    jacobian = problem.both(np.concatenate([s.real, s.imag]))[1]
    covariance = noise**2 * np.linalg.inv(jacobian.T @ jacobian)
    bound = np.empty((2, len(s)))
    for m, pole in enumerate(s):
        part = covariance[np.ix_([m, len(s) + m], [m, len(s) + m])]
        size = np.abs(pole)
        slopes = np.array([[pole.real, pole.imag], [pole.imag**2 / pole.real, -pole.imag]]) / size**2
        bound[:, m] = np.sqrt(np.diag(slopes @ part @ slopes.T))
    return exact + noise * rng.standard_normal(exact.shape), bound


# ---- input and output ------------------------------------------------------------------------------------------------


def lever_driven(seed):
    """The lever's modes and three real poles of a detector under a white, held input; noise of 1 % of the output."""
    rng = np.random.default_rng(seed)
    s = poles_of(LEVER_HZ, LEVER_DAMPING)
    blocks, outs, ins = [], [], []
    for pole, share in zip(s, [1.0, 0.5, 0.3, 0.2], strict=True):
        blocks.append(np.array([[0, 1.0], [-(np.abs(pole) ** 2), 2 * pole.real]]))
        ins.append([0, np.abs(pole) ** 1.5 * np.sqrt(-2 * pole.real)])
        outs.append([share, 0.0])
    for pole_hz in (1.3e6, 1.9e6, 2.4e6):
        a = 2 * np.pi * pole_hz
        blocks.append(np.array([[-a]]))
        ins.append([a])
        outs.append([0.05])
    order = sum(len(block) for block in blocks)
    a, at = np.zeros((order, order)), 0
    for block in blocks:
        a[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    b, c = np.concatenate(ins)[:, None], np.concatenate(outs)[None]
    system = cont2discrete((a, b, c, np.zeros((1, 1))), 1 / RATE_HZ)
    u = rng.standard_normal(SAMPLES)
    y = dlsim(system, u)[1][:, 0]
    return u, y + 0.01 * np.std(y) * rng.standard_normal(SAMPLES)


def of_matrix(a):
    z = np.linalg.eigvals(np.asarray(a))
    return modal(RATE_HZ * np.log(z[np.abs(z) > 0]))


def with_sippy(u, y, method, rows):
    from sippy_unipi import system_identification

    found = system_identification(
        y[None], u[None], method, SS_fixed_order=11, SS_f=rows, SS_p=rows, SS_D_required=True, SS_A_stability=False
    )
    return of_matrix(found.A)


def with_nfoursid(u, y, rows):
    import pandas as pd
    from nfoursid.nfoursid import NFourSID

    fit = NFourSID(pd.DataFrame({"u": u, "y": y}), ["y"], ["u"], num_block_rows=rows)
    fit.subspace_identification()
    return of_matrix(fit.system_identification(rank=11)[0].a)


# ---- frequency responses ---------------------------------------------------------------------------------------------


PLATE_HZ = np.array([62.0, 118.0, 131.0, 240.0, 377.0])
PLATE_DAMPING = np.array([0.01, 0.006, 0.008, 0.005, 0.004])
LINES_HZ = np.arange(20.0, 500.0, 0.25)


def plate(seed):
    """Receptances of 30 points, noise of 1 % of the median magnitude."""
    rng = np.random.default_rng(seed)
    s, at = poles_of(PLATE_HZ, PLATE_DAMPING), 2j * np.pi * LINES_HZ
    shapes = rng.standard_normal((30, len(s)))
    residues = shapes * shapes[:1] / (2j * s.imag)
    h = residues @ (1 / (at - s[:, None])) + residues.conj() @ (1 / (at - s.conj()[:, None]))
    return h + 0.01 * np.median(np.abs(h)) * rng.standard_normal((*h.shape, 2)) @ [1, 1j]


def with_sdypy(h, order, picked):
    """`picked`: "stable", stable poles near the true frequencies; "chart", the poles of the highest order nearest to
    the true ones, as one who knows the truth would click them.
    """
    from sdypy import EMA

    model = EMA.Model(h, LINES_HZ, lower=20, upper=500, pol_order_high=order, frf_form="receptance")
    model.get_poles(show_progress=False)
    if picked == "stable":
        model.select_closest_poles(list(PLATE_HZ))
        model.get_constants()
        return np.array([model.nat_freq, model.nat_xi])
    last = np.asarray(model.all_poles[-1])
    near = np.abs(np.abs(last) / np.abs(poles_of(PLATE_HZ, PLATE_DAMPING))[:, None] - 1) + (last.imag <= 0)
    chosen = linear_sum_assignment(near)[1]
    model.pole_ind = [[len(model.all_poles) - 1, i] for i in chosen]
    model.get_constants()
    return modal(last[chosen])


# ---- tables ----------------------------------------------------------------------------------------------------------


def timed(call, *arguments):
    started = time.perf_counter()
    found = call(*arguments)
    return time.perf_counter() - started, found


class Stages:
    """Seconds within the native module while it is open."""

    def __enter__(self):
        self.seconds, self.run = 0.0, _native.run_stage

        def run(*arguments, **given):
            seconds, found = timed(lambda: self.run(*arguments, **given))
            self.seconds += seconds
            return found

        _native.run_stage = run
        return self

    def __exit__(self, *_):
        _native.run_stage = self.run


def compare(title, head, seeds, data, truth, ours, peers, bound=None):
    """Prints rows of errors and times; `ours` and `peers`: (name, call, most seeds); every row is paired with the first
    of `ours`.
    """
    print(f"\n| {title} | {head} | missing | median, ms | times ours |")
    print("|---|---|---|---|---|---|")
    sets = [data(seed) for seed in seeds]
    for name, call, most in [*ours, *peers]:
        times, ratios, errors = [], [], []
        warm(call, sets[0]), warm(ours[0][1], sets[0])
        for given in sets[:most]:
            beside, _ = timed(ours[0][1], given)
            try:
                seconds, found = timed(call, given)
            except Exception as error:  # a peer that fails has a row that says so
                print(f"| {name} | - | - | {type(error).__name__} | - | - |", flush=True)
                break
            times.append(seconds)
            ratios.append(seconds / beside)
            errors.append(relative_errors(found, truth))
        else:
            errors = np.array(errors)
            missing = int(np.isnan(errors[:, 0]).sum())
            scale = np.ones_like(truth) if bound is None else bound
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                f, damping = np.sqrt(np.nanmean((errors / scale) ** 2, axis=(0, 2)))
            cells = f"{f:.2f} | {damping:.2f}" if bound is not None else f"{1e6 * f:.3g} | {100 * damping:.3g}"
            of = f"{missing} of {errors[:, 0].size}"
            print(f"| {name} | {cells} | {of} | {1e3 * np.median(times):.4g} | {np.median(ratios):.3g} |", flush=True)


def warm(call, given):
    try:
        call(given)
    except Exception:  # its row says so
        pass


def stages_share(call, sets):
    """Share of a call that is spent in the stages, the rest being Python's."""
    shares = []
    for given in sets:
        with Stages() as stages:
            seconds, _ = timed(call, given)
        shares.append(stages.seconds / seconds)
    return np.median(shares)


def resident_mb():
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return float("nan")


def free_decays(seeds):
    truth = np.array([LEVER_HZ, LEVER_DAMPING])

    def data(seed):
        return decays(seed, LEVER_HZ, LEVER_DAMPING, RATE_HZ, SAMPLES, HITS, 0.01)[0]

    def ours(**given):
        return lambda y: of_table(afmid.ringdown(y, sample_rate_hz=RATE_HZ, axes="hits", begin=0, **given).modes)

    bound = np.sqrt(
        np.mean([decays(k, LEVER_HZ, LEVER_DAMPING, RATE_HZ, SAMPLES, HITS, 0.01)[1] ** 2 for k in seeds], axis=0)
    )
    compare(
        f"free decays, {HITS} hits of {SAMPLES} samples", "f / bound | damping / bound", seeds, data, truth,
        [
            ("`afmid.ringdown`, four modes given", ours(modes=4), 99),
            ("`afmid.ringdown`, four modes given, white noise", ours(modes=4, noise="white"), 99),
            ("`afmid.ringdown` as it comes", ours(), 99),
        ],
        [
            ("scipy `least_squares`, variable projection", lambda y: by_scipy(Samples, y, 4, RATE_HZ), 99),
            ("scipy `least_squares`, compressed", lambda y: by_scipy(Projection, y, 4, RATE_HZ), 99),
        ],
        bound,
    )  # fmt: skip
    # what no estimator of these samples does without: the modes' basis and its product with the data, at two sets of poles
    z = np.exp(poles_of(LEVER_HZ, LEVER_DAMPING) / RATE_HZ)
    passes = []
    for k in seeds:
        y = data(k)
        passes.append(timed(lambda y=y: [powers(z * (1 + step), SAMPLES).conj().T @ y.T for step in (0, 1e-9)])[0])
    print(f"\nTwo passes over the samples (basis and products, numpy): {1e3 * np.median(passes):.2f} ms.")
    share = stages_share(ours(modes=4), [data(k) for k in seeds])
    print(f"\nOf `afmid.ringdown`, {100 * share:.1f} % of the time is the stage's, in Rust; the rest is Python's.")


def models(seeds):
    truth = np.array([LEVER_HZ, LEVER_DAMPING])
    rate = {"sample_rate_hz": RATE_HZ, "order": 11}
    peers = [(f"SIPPY {of}, {rows} rows", of, rows) for of in ("N4SID", "MOESP", "CVA") for rows in (30, 60)]
    compare(
        f"input and output, {SAMPLES} samples, order 11", "f, ppm | damping, %", seeds, lever_driven, truth,
        [
            ("`afmid.pem`", lambda d: of_table(afmid.pem(*d, **rate).modes), 99),
            ("`afmid.subspace`", lambda d: of_table(afmid.subspace(*d, **rate).modes), 99),
        ],
        [
            *((name, lambda d, of=of, rows=rows: with_sippy(*d, of, rows), 99) for name, of, rows in peers),
            *((f"nfoursid, {rows} rows", lambda d, rows=rows: with_nfoursid(*d, rows), 1) for rows in (30, 60)),
        ],
    )  # fmt: skip


def responses(seeds):
    def ours(h):
        return of_table(afmid.frf_modes(h, frequency_hz=LINES_HZ, unit="m/N").modes)

    truth = np.array([PLATE_HZ, PLATE_DAMPING])
    compare(
        f"30 responses of {len(LINES_HZ)} lines", "f, ppm | damping, %", seeds, plate, truth,
        [("`afmid.frf_modes`", ours, 99)],
        [
            (f"SDyPy LSCF, order {order}, {picked}", lambda h, o=order, p=picked: with_sdypy(h, o, p), 99)
            for order in (30, 60) for picked in ("stable", "chart")
        ],
    )  # fmt: skip


def many(count):
    """A loop over one decay after the other, each with noise of its own."""
    f, damping = np.array([250.0, 611.0]), np.array([0.01, 0.004])
    records = [decays(seed, f, damping, 1e4, 4096, 1, 0.01)[0] for seed in range(count)]
    calls = {
        "`afmid.ringdown`, two modes given": lambda y: of_table(
            afmid.ringdown(y[0], sample_rate_hz=1e4, begin=0, modes=2).modes
        ),
        "`afmid.ringdown` as it comes": lambda y: of_table(afmid.ringdown(y[0], sample_rate_hz=1e4, begin=0).modes),
        "scipy `curve_fit`": lambda y: by_curve_fit(y[0], 2, 1e4),
        "scipy `least_squares`, a residual per sample": lambda y: by_scipy(Samples, y, 2, 1e4),
        "scipy `least_squares`, compressed": lambda y: by_scipy(Projection, y, 2, 1e4),
    }
    head = "f, ppm | damping, % | missing | s | times ours | MB after 100 | MB after all"
    print(f"\n| {count} decays of 4096 samples | {head} |")
    print("|---|---|---|---|---|---|---|---|")
    first = next(iter(calls.values()))
    for name, call in calls.items():
        seconds = beside = 0.0
        errors = []
        for number, y in enumerate(records):
            beside += timed(first, y)[0] if call is not first else 0.0
            took, found = timed(call, y)
            seconds += took
            errors.append(relative_errors(found, np.array([f, damping])))
            if number == min(99, count - 1):
                early = resident_mb()
        errors = np.array(errors)
        rms = np.sqrt(np.nanmean(errors**2, axis=(0, 2)))
        ratio = seconds / beside if beside else 1.0
        missing = f"{int(np.isnan(errors[:, 0]).sum())} of {errors[:, 0].size}"
        numbers = f"{1e6 * rms[0]:.3g} | {100 * rms[1]:.3g} | {missing} | {seconds:.3g} | {ratio:.3g}"
        print(f"| {name} | {numbers} | {early:.1f} | {resident_mb():.1f} |", flush=True)


def start_up(wheel, rounds=15):
    """Wall times of whole processes, in turn; the least and the median."""
    commands = {
        "`python -c pass`": [sys.executable, "-c", "pass"],
        "`python -c 'import afmid'`": [sys.executable, "-c", "import afmid"],
        "`python -c 'import numpy'`": [sys.executable, "-c", "import numpy"],
        "`python -c 'import afmid; afmid.ringdown'`": [sys.executable, "-c", "import afmid; afmid.ringdown"],
        "`python -c 'import numpy, pandas, xarray'`": [sys.executable, "-c", "import numpy, pandas, xarray"],
        "`afmid --version`": [str(Path(sys.executable).with_name("afmid")), "--version"],
    }
    times = {name: [] for name in commands}
    for _ in range(rounds):
        for name, command in commands.items():
            times[name].append(timed(lambda c=command: subprocess.run(c, check=True, capture_output=True))[0])
    print("\n| process | least, ms | median, ms |\n|---|---|---|")
    for name, of in times.items():
        print(f"| {name} | {1e3 * min(of):.0f} | {1e3 * np.median(of):.0f} |")
    own = np.median(np.array(times["`python -c 'import afmid'`"]) - np.array(times["`python -c pass`"]))
    print(f"\n`import afmid` by itself, median of the differences: {1e3 * own:.1f} ms.")
    if wheel:
        print(f"The wheel: {Path(wheel).stat().st_size / 1e6:.1f} MB, `{Path(wheel).name}`.")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", nargs="?", help="the wheel that is installed, for its size")
    parser.add_argument("--seeds", default=10, type=int)
    parser.add_argument("--loop", default=1000, type=int)
    parser.add_argument("--only", default="decays,models,responses,loop,start", help="parts, with commas between")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    seeds = range(1, options.seeds + 1)
    parts = {
        "decays": lambda: free_decays(seeds),
        "models": lambda: models(seeds),
        "responses": lambda: responses(seeds),
        "loop": lambda: many(options.loop),
        "start": lambda: start_up(options.wheel),
    }
    loads = []
    for name in options.only.split(","):
        loads.append(os.getloadavg()[0])
        parts[name]()
    packages = ("numpy", "scipy", "sippy_unipi", "nfoursid", "sdypy-EMA")
    there = {package.metadata["Name"].replace("-", "_"): package.version for package in importlib.metadata.distributions()}
    versions = ", ".join(f"{name} {there.get(name.replace('-', '_'), '(not installed)')}" for name in packages)
    print(f"\nPython {platform.python_version()}, {versions}; afmid {importlib.metadata.version('afmid')}.")
    print(f"Load over a minute at the start of each part: {min(loads):.1f} to {max(loads):.1f}, {os.cpu_count()} cores.")


if __name__ == "__main__":
    sys.exit(main())
