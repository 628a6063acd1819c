"""The lean main job as one writes it with numpy and scipy in an afternoon, carefully: vectors throughout, an analytic
Jacobian, one thread.

    /tmp/venv-peers/bin/python benches/peers/free_lever_plain.py [--afmid target/release/afmid] [--runs 5]

Beside `free_lever.py`, which was made to be as fast as it could be: this one takes records as volts in double
precision, looks for events at every sample, and fits by filters (`scipy.signal.lfilter`) and a QR of all samples at
every step. The rest of the job is that script's. It does less than afmid as that one does: no keys or hashes, a local
parabola, output error from one start with numbers of modes and real poles given, no zeros, no held-out fit.
"""

import sys

import free_lever
import h5py
import numpy as np
from free_lever import BEFORE, LENGTH, MARGIN, MODES, ORDER, REAL, REAL_LEAST, REAL_MOST
from free_lever import Path, lap, least_squares, start
from scipy.ndimage import uniform_filter1d
from scipy.signal import lfilter

lap("import scipy")
BLOCK, LEVEL = 64, 1024
SOME = 16  # every so manieth step tells their scatter to two percent: some 7,000 of a record are independent


def onsets(y):
    """Samples where the level jumps up: running means, their differences against the scatter, then the first sample
    above half of the jump.
    """
    means = uniform_filter1d(y, BLOCK)
    step = means[2 * BLOCK :] - means[: -2 * BLOCK]
    some = step[::SOME]
    sigma = 1.4826 * np.median(np.abs(some - np.median(some)))
    found, end = [], LEVEL
    for i in np.flatnonzero(step > 8.0 * sigma) + BLOCK:
        if end <= i < len(y) - LENGTH:
            low, high = y[i - LEVEL : i].mean(), y[i + 2 * BLOCK : i + LEVEL].mean()
            if high - low > 8.0 * sigma:
                found.append(i - BLOCK + int(np.argmax(y[i - BLOCK :] > 0.5 * (low + high))))
                end = i + LENGTH
    return found


def cut(folder):
    """Windows of `LENGTH` samples and a margin on either side, in volts."""
    windows = []
    for path in sorted(Path(folder).glob("*.h5")):
        with h5py.File(path) as file:
            data, rate = file["deflection"], float(file.attrs["sample_rate_hz"])
            y = data[()] * data.attrs["scale_factor"]
        lap("load")
        for first in (onset - BEFORE - MARGIN for onset in onsets(y)):
            if 0 <= first <= len(y) - LENGTH - 2 * MARGIN:
                windows.append(y[first : first + LENGTH + 2 * MARGIN])
        lap("events")
    return np.array(windows), rate


def fit(y, t0, line, u):
    """Output error by variable projection: sections of second and first order, their initial states, D, offset and
    drift solved for at each step.
    """
    m, d, k = MODES, 2 * ORDER + 3, np.arange(LENGTH)
    impulse = (k == 0).astype(float)

    def poles(x):
        s = -np.exp(x[:m]) + 1j * x[m : 2 * m]
        return s, np.log(x[2 * m :])

    def denominators(x):
        s, real = poles(x)
        second = [np.array([1.0, -2.0 * z.real, abs(z) ** 2]) for z in np.exp(s)]
        return second + [np.array([1.0, -np.exp(r)]) for r in real]

    def regressors(x):
        columns = []
        for a in denominators(x):
            for signal, first in ((u, 1), (impulse, 0)):
                response = lfilter([1.0], a, signal)
                for delay in range(first, first + len(a) - 1):
                    columns.append(np.concatenate([np.zeros(delay), response[: LENGTH - delay]]))
        return np.column_stack(columns + [u, np.ones(LENGTH), k / LENGTH])

    def solve(x):
        q, r = np.linalg.qr(phi := regressors(x))
        theta = np.linalg.lstsq(r, q.T @ y, rcond=1e-12)[0]
        return q, phi, theta, y - phi @ theta

    memory = {}

    def remembered(x):
        if memory.get("at") != x.tobytes():
            memory.update(at=x.tobytes(), found=solve(x))
        return memory["found"]

    def jacobian(x):
        """Kaufman's: derivatives of the prediction to the denominators' coefficients, then to x, less what the linear
        parameters reach.
        """
        q, phi, theta, _ = remembered(x)
        s, real = poles(x)
        j, at = np.zeros((LENGTH, len(x))), 0
        for i, a in enumerate(denominators(x)):
            size = 2 * (len(a) - 1)
            part = lfilter([1.0], a, phi[:, at : at + size] @ theta[at : at + size])
            at += size
            one, two = np.concatenate([[0.0], part[:-1]]), np.concatenate([[0.0, 0.0], part[:-2]])
            if i < m:
                z = np.exp(s[i])
                to_s = lambda ds: 2.0 * (z * ds).real * one - 2.0 * (np.conj(z) * z * ds).real * two
                j[:, i], j[:, m + i] = to_s(s[i].real), to_s(1j)
            else:
                j[:, m + i] = one
        return -(j - q @ (q.T @ j))

    bounds = [-np.inf] * 2 * m + [REAL_LEAST] * REAL, [np.inf] * 2 * m + [REAL_MOST] * REAL
    found = least_squares(lambda x: remembered(x)[3], start(y[t0 + 16 :]), jacobian, bounds, x_scale="jac", ftol=1e-5)
    assert found.success, found.message
    (s, real_s), (_, phi, theta, residual), j = poles(found.x), remembered(found.x), jacobian(found.x)
    covariance = np.linalg.pinv(j.T @ j) * np.sum(residual**2) / (LENGTH - d - len(found.x))
    return dict(
        s=s,
        real_s=real_s,
        theta=theta,
        covariance=covariance,
        prediction=y - residual,
        residual=residual,
        evaluations=found.nfev,
    )


free_lever.cut, free_lever.fit, free_lever.SCRIPT = cut, fit, __file__

if __name__ == "__main__":
    sys.exit(free_lever.main())
