"""The four simulated cases: records with known poles, and the Cramer-Rao bound of their frequencies and dampings.

Noise is white, its standard deviation a share of the largest sample. Everything that is drawn comes from the seed.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.signal import lfilter


@dataclass
class Record:
    """What one seed of a case gives to every method."""

    rate_hz: float
    force: np.ndarray | None  # samples
    response: np.ndarray  # channels x samples
    starts: list[int]  # first free sample of a decay; sample of each hit's largest force
    poles: np.ndarray  # upper half plane, ascending
    bound: np.ndarray  # modes x (relative frequency, relative damping): standard deviations
    units: tuple[str, str]


def poles_of(frequency_hz, damping):
    w = 2.0 * np.pi * np.asarray(frequency_hz)
    zeta = np.asarray(damping)
    return w * (-zeta + 1j * np.sqrt(1.0 - zeta**2))


def modal(poles):
    """Frequencies in Hz and damping ratios."""
    return np.abs(poles) / (2.0 * np.pi), -poles.real / np.abs(poles)


def match(found, poles):
    """Indices of true poles and of found ones that belong together: least sum of relative distances of frequency."""
    upper = np.flatnonzero(found.imag > 0.0)
    distance = np.abs(np.abs(found[upper]) / np.abs(poles)[:, None] - 1.0)
    true, near = linear_sum_assignment(distance)
    return true, upper[near]


def bound_of(simulate, poles, residues, noise):
    """Cramer-Rao bound of (f, damping) relative to their values, by central differences of `simulate(poles, residues)`.

    The residues (channels x modes, complex) are unknown too. `noise`: standard deviation, one of all channels.
    """
    modes = len(poles)

    def unpack(x):
        linear = x[2 * modes :].reshape(2, *residues.shape)
        return x[:modes] + 1j * x[modes : 2 * modes], linear[0] + 1j * linear[1]

    x = np.concatenate([poles.real, poles.imag, residues.real.ravel(), residues.imag.ravel()])
    # 1e-6 of a pole's modulus and of the largest residue: truncation and rounding stay below 1e-6 of the derivative
    steps = 1e-6 * np.concatenate([np.tile(np.abs(poles), 2), np.full(2 * residues.size, np.abs(residues).max())])
    jacobian = np.empty((len(x), np.size(simulate(poles, residues))))
    for i, step in enumerate(steps):
        ahead, behind = x.copy(), x.copy()
        ahead[i] += step
        behind[i] -= step
        jacobian[i] = (simulate(*unpack(ahead)) - simulate(*unpack(behind))).ravel() / (2.0 * step)
    scale = np.linalg.norm(jacobian, axis=1)
    scaled = jacobian / scale[:, None]
    covariance = noise**2 * np.linalg.inv(scaled @ scaled.T) / np.outer(scale, scale)
    out = np.empty((modes, 2))
    for j, s in enumerate(poles):
        part = covariance[np.ix_([j, modes + j], [j, modes + j])]
        a, w, size = s.real, s.imag, np.abs(s)
        # f = |s| / 2 pi and damping = -a / |s|, their gradients in (a, w) over their values
        gradients = np.array([[a, w], [w**2 / a, -w]]) / size**2
        out[j] = np.sqrt(np.diag(gradients @ part @ gradients.T))
    return out


# ---- free decays -----------------------------------------------------------------------------------------------------


def decay(seed, frequency_hz, damping, shapes, rate_hz=2000.0, quiet=200, samples=4000, noise=0.01):
    """Quiet, then the answer of a resting structure to a blow that lasts no time: damped sines from zero."""
    rng = np.random.default_rng(seed)
    poles = poles_of(frequency_hz, damping)
    residues = -1j * shapes * rng.uniform(0.5, 1.0, len(poles))
    time = np.arange(samples) / rate_hz

    def simulate(poles, residues):
        return np.real(residues @ np.exp(np.outer(poles, time)))

    clean = simulate(poles, residues)
    deviation = noise * np.abs(clean).max()
    response = np.hstack([np.zeros((len(shapes), quiet)), clean])
    response += deviation * rng.standard_normal(response.shape)
    bound = bound_of(simulate, poles, residues, deviation)
    return Record(rate_hz, None, response, [quiet], poles, bound, ("", "m/s^2"))


def free_decay(seed):
    """One channel, three modes."""
    return decay(seed, [62.3, 148.7, 331.0], [0.008, 0.005, 0.003], np.ones((1, 3)))


def simo_decay(seed):
    """Six channels along a beam on two supports, four modes, two of them 1.5 Hz apart."""
    place = np.arange(1, 7) / 7.0
    shapes = np.sin(np.pi * np.outer(place, np.arange(1, 5)))
    return decay(seed, [46.0, 120.0, 121.5, 260.0], [0.010, 0.005, 0.005, 0.004], shapes)


# ---- hammer ----------------------------------------------------------------------------------------------------------


def hammer(seed, rate_hz=4096.0, hits=5, apart=8192, before=400, width_s=5e-4, noise=0.005, force_noise=2e-4):
    """Hits with a Gaussian pulse and one accelerometer.

    Exact: the pulse's spectrum is 1e-9 at half the sample rate, so that its samples are all of it, and the response is
    the product of its transform with the accelerance, over a period that is one distance of hits longer than the record.
    """
    rng = np.random.default_rng(seed)
    poles = poles_of([87.3, 213.9, 402.0], [0.012, 0.008, 0.006])
    residues = -1j * np.array([[1.0, 0.8, 0.6]]) / np.abs(poles)
    samples = hits * apart
    time = np.arange(samples + apart) / rate_hz
    at = (before + apart * np.arange(hits) + rng.uniform(-20.0, 20.0, hits)) / rate_hz
    force = sum(rng.uniform(70.0, 130.0) * np.exp(-0.5 * ((time - t) / width_s) ** 2) for t in at)
    spectrum = np.fft.rfft(force)
    p = 2j * np.pi * np.fft.rfftfreq(len(time), 1.0 / rate_hz)

    def simulate(poles, residues):
        response = sum(r / (p - s) + r.conj() / (p - s.conj()) for r, s in zip(residues[0], poles))
        return np.fft.irfft(p**2 * response * spectrum, len(time))[None, :samples]

    clean = simulate(poles, residues)
    deviation = noise * np.abs(clean).max()
    response = clean + deviation * rng.standard_normal(clean.shape)
    measured = force[:samples] + force_noise * force.max() * rng.standard_normal(samples)
    starts = [round(t * rate_hz) for t in at]
    bound = bound_of(simulate, poles, residues, deviation)
    return Record(rate_hz, measured, response, starts, poles, bound, ("N", "m/s^2"))


# ---- random input ----------------------------------------------------------------------------------------------------


def held(poles, rate_hz, force):
    """What each pole makes of a force that is held from sample to sample, from rest: modes x samples."""
    z = np.exp(poles / rate_hz)
    return np.array([lfilter([0.0, (a - 1.0) / s], [1.0, -a], force.astype(complex)) for a, s in zip(z, poles)])


def random_input(seed, rate_hz=500.0, samples=8192, noise=0.05):
    """A white force through a zero-order hold, from rest, and one velocity.

    Exact: each pole is a filter of first order whose step response is the pole's. Here `noise` is a share of the
    response's root mean square.
    """
    rng = np.random.default_rng(seed)
    poles = poles_of([23.7, 61.2, 118.4], [0.010, 0.008, 0.006])
    residues = np.array([[1.0, 0.8, 0.6]]) + 0.0j
    force = rng.standard_normal(samples)

    def simulate(poles, residues):
        return np.real(residues @ held(poles, rate_hz, force))

    clean = simulate(poles, residues)
    deviation = noise * np.sqrt(np.mean(clean**2))
    response = clean + deviation * rng.standard_normal(clean.shape)
    bound = bound_of(simulate, poles, residues, deviation)
    return Record(rate_hz, force, response, [0], poles, bound, ("N", "m/s"))


CASES = {
    "free decay": free_decay,
    "SIMO decay": simo_decay,
    "hammer FRF": hammer,
    "random input": random_input,
}
