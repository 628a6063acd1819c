"""scipy `least_squares` on the modal model: residues solved for at every step (variable projection), analytic slopes."""

import numpy as np
from scipy.linalg import hankel
from scipy.optimize import least_squares

from responses import of_decay, of_hits, of_random, peaks
from truth import held


class Projection:
    """Residual and Kaufman's Jacobian of `data = basis(poles) c` over the real and imaginary parts of the poles.

    `columns(poles)` gives the basis (samples x 2 modes, for real and imaginary residues, mode by mode, then other
    columns) and its slopes with the real and with the imaginary parts (modes x samples x 2 each).
    """

    def __init__(self, data, columns):
        self.data, self.columns, self.key = data, columns, None

    def evaluate(self, x):
        if self.key is not None and np.array_equal(self.key, x):
            return
        modes = len(x) // 2
        basis, by_real, by_imaginary = self.columns(x[:modes] + 1j * x[modes:])
        q, r = np.linalg.qr(basis)
        projected = q.T @ self.data
        c = np.linalg.solve(r, projected)[: 2 * modes].reshape(modes, 2, -1)
        slopes = np.concatenate([by_real @ c, by_imaginary @ c])  # parameters x samples x channels
        slopes -= q @ (q.T @ slopes)
        self.key, self.residual = x.copy(), (self.data - q @ projected).ravel()
        self.jacobian = -slopes.reshape(2 * modes, -1).T

    def value(self, x):
        self.evaluate(x)
        return self.residual

    def slope(self, x):
        self.evaluate(x)
        return self.jacobian

    def fit(self, start):
        x = np.concatenate([start.real, start.imag])
        found = least_squares(self.value, x, self.slope, method="lm", x_scale="jac")
        modes = len(start)
        return found.x[:modes] + 1j * found.x[modes:]


def of_signals(signals, slopes):
    """Columns for a sum of Re(residue * signal): modes x samples, complex, and their derivatives with the poles."""
    pair = lambda z: np.stack([z.real, -z.imag], axis=-1)
    basis = pair(signals)
    offset = np.ones((basis.shape[1], 1))
    flat = basis.transpose(1, 0, 2).reshape(basis.shape[1], -1)
    return np.hstack([flat, offset]), pair(slopes), pair(1j * slopes)


# ---- free decays -----------------------------------------------------------------------------------------------------


def shift_invariance(y, modes, rows=200):
    """Poles per sample by shift invariance of the channels' dominant Hankel space: Prony's idea, in least squares."""
    blocks = np.hstack([hankel(channel[:rows], channel[rows - 1 :]) for channel in y])
    u = np.linalg.eigh(blocks @ blocks.T)[1][:, -2 * modes :]
    z = np.linalg.eigvals(np.linalg.lstsq(u[:-1], u[1:], rcond=None)[0])
    return np.log(z[z.imag > 0.0])


def decays(record, start, modes):
    """`start`: "peaks" of the spectrum, or "prony"."""
    y = record.response[:, record.starts[0] :]
    time = np.arange(y.shape[1]) / record.rate_hz
    if start == "peaks":
        first = peaks(*of_decay(record), modes)
    else:
        first = shift_invariance(y, modes) * record.rate_hz

    def columns(poles):
        signals = np.exp(np.outer(poles, time))
        return of_signals(signals, time * signals)

    return Projection(y.T, columns).fit(first)


# ---- hammer ----------------------------------------------------------------------------------------------------------


def response_of_hits(record, weighted, modes, band=(20.0, 700.0)):
    """On H1 between `band`, in Hz; `weighted`: over the deviation that the hits' scatter states."""
    frequency, h1, deviation = of_hits(record)
    kept = (frequency > band[0]) & (frequency < band[1])
    first = peaks(frequency[kept], h1[:, kept], modes)
    p, h = 2j * np.pi * frequency[kept], h1[0, kept]
    weight = 1.0 / deviation[kept] if weighted else np.ones(len(h))
    stacked = lambda z: np.concatenate([z.real, z.imag], axis=-1)

    def columns(poles):
        up, down = 1.0 / (p - poles[:, None]), 1.0 / (p - poles.conj()[:, None])
        scale = weight * p**2
        parts = [scale * (up + down), 1j * scale * (up - down)]
        by_real = [scale * (up**2 + down**2), 1j * scale * (up**2 - down**2)]
        by_imaginary = [1j * scale * (up**2 - down**2), -scale * (up**2 + down**2)]
        basis, real, imaginary = (
            np.stack([stacked(z) for z in two], axis=-1) for two in (parts, by_real, by_imaginary)
        )
        rest = np.stack([stacked(weight + 0j * p), stacked(weight * p**2)], axis=-1)
        return np.hstack([basis.transpose(1, 0, 2).reshape(rest.shape[0], -1), rest]), real, imaginary

    return Projection(stacked(weight * h)[:, None], columns).fit(first)


# ---- random input ----------------------------------------------------------------------------------------------------


def output_error(record, modes):
    """The response simulated from the force, from rest: the truth's own form."""
    first = peaks(*of_random(record, 2048), modes)

    def columns(poles):
        step = 1e-5 * np.abs(poles)
        ahead, behind = (held(poles + sign * step, record.rate_hz, record.force) for sign in (1.0, -1.0))
        slopes = (ahead - behind) / (2.0 * step[:, None])
        return of_signals(held(poles, record.rate_hz, record.force), slopes)

    return Projection(record.response.T, columns).fit(first)


def fit(case, record, setting, modes):
    if case == "hammer FRF":
        return response_of_hits(record, setting == "weighted", modes)
    return output_error(record, modes) if case == "random input" else decays(record, setting, modes)
