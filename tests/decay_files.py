"""Writes one free decay as several programs would: three modes, 1 s at 5 kHz, 0.1 s of quiet before the hit.

    python decay_files.py FOLDER SEED

Prints the true frequencies and damping ratios, and for each file what has to be said beside it, as JSON.
"""

import json
import pathlib
import struct
import sys

import h5py
import nptdms
import numpy as np
import pandas
import scipy.io
import scipy.io.wavfile

RATE_HZ = 5000.0
# a code of 16 bits, in volts; a number of single precision holds it
CODE = 2.0**-13
MODES = [(211.0, 0.004), (463.0, 0.006), (921.0, 0.003)]


def decay(seed):
    """The record in volts, and its times."""
    random = np.random.default_rng(seed)
    t = np.arange(5000) / RATE_HZ
    since = t - 0.1
    y = np.zeros(len(t))
    for (frequency, damping), amplitude in zip(MODES, [1.0, 0.6, 0.4]):
        w = 2 * np.pi * frequency
        y += amplitude * np.exp(-damping * w * since) * np.sin(w * np.sqrt(1 - damping**2) * since + random.uniform(0, 6))
    y = np.where(since < 0, 0.0, y) + 0.01 * random.standard_normal(len(t))
    return np.round(y / CODE) * CODE, t


def universal(path, y):
    """Universal file 58, double precision, evenly spaced."""
    lines = ["    -1", "    58", "decay", "NONE", "26-Nov-26", "NONE", "NONE"]
    lines.append("    1         0    1         0       NONE         1   3       NONE         0   0")
    lines.append(f"{4:10d}{len(y):10d}{1:10d}{0.0:13.5E}{1 / RATE_HZ:13.5E}{0.0:13.5E}")
    lines.append(f"{17:10d}    0    0    0 Time                 s                   ")
    lines.append(f"{0:10d}    0    0    0 Signal               V                   ")
    lines += [f"{0:10d}    0    0    0 NONE                 NONE                "] * 2
    lines += ["".join(f"{value:20.12E}" for value in y[k : k + 4]) for k in range(0, len(y), 4)]
    path.write_text("\n".join(lines + ["    -1", ""]))


def lecroy(path, y):
    """LeCroy's binary waveform, template LECROY_2_3: a descriptor of 346 bytes, then codes of 16 bits."""
    descriptor = bytearray(346)
    codes = np.round(y / CODE).astype("<i2").tobytes()
    for place, form, value in [
        (0, "16s", b"WAVEDESC"),
        (16, "16s", b"LECROY_2_3"),
        (32, "<H", 1),  # words
        (34, "<H", 1),  # low byte first
        (36, "<i", 346),
        (60, "<i", len(codes)),
        (76, "16s", b"LECROYWS"),
        (116, "<i", len(y)),
        (128, "<i", len(y) - 1),
        (144, "<i", 1),
        (156, "<f", CODE),
        (164, "<f", 32767.0),
        (168, "<f", -32768.0),
        (172, "<h", 16),
        (176, "<f", 1 / RATE_HZ),
        (196, "48s", b"V"),
        (244, "48s", b"S"),
    ]:
        struct.pack_into(form, descriptor, place, value)
    # 26 November 2026, 12:00
    struct.pack_into("<dbbbbhh", descriptor, 296, 0.0, 0, 12, 26, 11, 2026, 0)
    path.write_bytes(bytes(descriptor) + codes)


def main():
    folder, seed = pathlib.Path(sys.argv[1]), int(sys.argv[2])
    y, t = decay(seed)
    volts, rate = ["--unit", "V"], ["--rate", "5000"]
    rows = "".join(f"{time!r},{value!r}\n" for time, value in zip(t.tolist(), y.tolist()))
    (folder / "a.csv").write_text("Time (s),Signal (V)\n" + rows)
    scipy.io.wavfile.write(folder / "a.wav", 5000, y)
    scipy.io.savemat(folder / "a.mat", {"t": t, "y": y})
    np.save(folder / "a.npy", y)
    universal(folder / "a.uff", y)
    with h5py.File(folder / "a.h5", "w") as file:
        file["time"], file["signal"] = t, y
        file["signal"].attrs["units"] = "V"
    # MATLAB 7.3: HDF5 behind a block of 512 bytes with MATLAB's header
    with h5py.File(folder / "b.mat", "w", userblock_size=512) as file:
        for name, values in {"t": t, "y": y}.items():
            file[name] = values.reshape(-1, 1)
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    with open(folder / "b.mat", "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    with nptdms.TdmsWriter(folder / "a.tdms") as file:
        properties = {"wf_increment": 1 / RATE_HZ, "wf_start_offset": 0.0, "wf_samples": len(y), "unit_string": "V"}
        file.write_segment([nptdms.ChannelObject("decay", "signal", y, properties)])
    pandas.DataFrame({"signal": y}, index=pandas.Index(t, name="time")).to_hdf(folder / "p.h5", key="decay")
    lecroy(folder / "a.trc", y)
    asked = {name: [] for name in ["a.csv", "a.tdms", "a.uff", "a.h5", "a.trc"]}
    asked |= {name: volts for name in ["a.wav", "a.mat", "b.mat", "p.h5"]}
    asked["a.npy"] = volts + rate
    print(json.dumps({"modes": MODES, "files": asked}))


if __name__ == "__main__":
    main()
