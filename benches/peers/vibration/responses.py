"""Frequency responses and spectra that the peers are given, and peaks in them."""

import numpy as np
from scipy.signal import csd, find_peaks, peak_widths, welch


def after_hits(record, before=32):
    """Force and response of each hit: hits x samples, an even number from `before` samples ahead of
    the largest force."""
    length = min(*np.diff(record.starts), len(record.force) - record.starts[-1]) // 2 * 2
    cut = lambda signal: np.array([signal[at - before : at - before + length] for at in record.starts])
    return cut(record.force), cut(record.response[0])


def of_hits(record):
    """Frequencies, H1 over the hits and the standard deviation of its mean from their scatter."""
    force, response = (np.fft.rfft(part, axis=1) for part in after_hits(record))
    power = np.sum(np.abs(force) ** 2, axis=0)
    h1 = np.sum(response * force.conj(), axis=0) / power
    left = np.sum(np.abs(response - h1 * force) ** 2, axis=0) / (len(force) - 1)
    frequency = np.fft.rfftfreq(2 * (force.shape[1] - 1), 1.0 / record.rate_hz)
    return frequency, h1[None], np.sqrt(left / power)


def of_random(record, samples):
    """Frequencies and H1 of half-overlapping Hann segments."""
    settings = {"fs": record.rate_hz, "nperseg": samples}
    frequency, cross = csd(record.force, record.response[0], **settings)
    return frequency, (cross / welch(record.force, **settings)[1])[None]


def of_decay(record):
    """Frequencies and the transform of the decays: what a blow that lasts no time would give."""
    decays = record.response[:, record.starts[0] :]
    return np.fft.rfftfreq(decays.shape[1], 1.0 / record.rate_hz), np.fft.rfft(decays) / record.rate_hz


def peaks(frequency, response, modes):
    """Poles of the highest peaks: their frequencies, and half their width at half power as decay rate."""
    power = np.sum(np.abs(response) ** 2, axis=0)
    found, about = find_peaks(power, prominence=0.0)
    found = np.sort(found[np.argsort(about["prominences"])[-modes:]])
    width = peak_widths(power, found)[0] * (frequency[1] - frequency[0])
    return np.pi * (-width + 2j * frequency[found])
