"""Writes the small WAV files in tests/data with SciPy. Run: python tests/make_wav.py"""
import pathlib
import numpy as np
from scipy.io import wavfile

data = pathlib.Path(__file__).parent / "data"
# two channels at 8 kHz; the second is the first one's negative
decay = np.exp(-np.arange(64) / 20) * np.cos(np.arange(64) / 3)
both = np.stack([decay, -decay], axis=1)
for name, values in {
    "u1": np.round(127 * both + 128).astype("u1"),
    "i2": np.round(32767 * both).astype("<i2"),
    "i4": np.round(2147483647 * both).astype("<i4"),
    "f4": both.astype("<f4"),
    "f8": both.astype("<f8"),
    "mono_i2": np.round(32767 * decay).astype("<i2"),
}.items():
    wavfile.write(data / f"{name}.wav", 8000, values)
