"""Reads recorded files without afmid and prints what is in them: for each channel of each file a line of

    file name, unit, samples per second (- if there is none), number of samples, sum, sum of magnitudes,
    sum of number (from 1) times value, first and last value

or the file's name and `refused`. The tests compare these lines with what afmid-formats gives (formats/scopes.rs). WAV
files are read by SciPy, tables by pandas with the number of header lines written here, MATLAB by SciPy; waveforms of
oscilloscopes and force curves of JPK by the few lines below, from the makers' descriptions. Run: python tests/independent.py FILE...
"""
import io
import re
import struct
import sys
import warnings
from pathlib import Path

import numpy as np


def tables(path):
    """Lines above the samples, how fields are set apart, columns of values, units and rate: looked up in each file by eye."""
    import pandas

    known = {
        "keysight_scope_0.csv": (2, ",", ".", [1, 2], ["V", "V"], 1e9),
        "rigol_DS1052E.csv": (16, ",", ".", [1, 2], ["V", "V"], 5e8),
        "rigol_DS1074Z-A.csv": (2, ",", ".", [1, 2, 3], ["V"] * 3, 5e4),
        "tek_TEK00000.csv": (15, ",", ".", [1], ["V"], 1250.0),
        "rs_rtp_01.Wfm.csv": (0, ",", ".", [0], [""], None),
        "cassy.txt": (5, "\t", ",", [0, 1, 2, 3, 4], ["s", "m", "rad", "V", "V"], None),
    }
    head, separator, decimal, columns, units, rate = known[path.name]
    # lines of CASSY end with two carriage returns; blank lines are not counted
    text = path.read_bytes().decode("utf-8-sig").replace("\r", "\n")
    lines = [line for line in re.split("\n+", text) if line]
    frame = pandas.read_csv(io.StringIO("\n".join(lines[head:])), sep=separator, decimal=decimal, header=None)
    return [(units[i], rate, frame[column].dropna().to_numpy(float)) for i, column in enumerate(columns)]


def wav(path):
    from scipy.io import wavfile

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rate, data = wavfile.read(path)
    data = data.reshape(len(data), -1)
    # SciPy shifts 24 bits to the upper end of 32
    full = 1.0 if data.dtype.kind == "f" else float(2 ** (8 * data.dtype.itemsize - 1))
    return [("", float(rate), column.astype(float) / full) for column in data.T]


def trc(path):
    data = path.read_bytes()
    data = data[data.index(b"WAVEDESC") :]
    word, order = struct.unpack_from("<hh", data, 32)
    order = "<" if order == 1 else ">"
    lengths = struct.unpack_from(order + "8i", data, 36)
    gain, offset = struct.unpack_from(order + "ff", data, 156)
    interval = struct.unpack_from(order + "f", data, 176)[0]
    kind = np.dtype(order + ("i2" if word % 256 or word // 256 else "i1"))
    samples = data[sum(lengths[:6]) :][: lengths[6]]
    if len(samples) < lengths[6]:
        raise ValueError("cut off")
    codes = np.frombuffer(samples, kind).astype(float)
    return [(data[196:244].split(b"\0")[0].decode(), float(f"{1 / interval:.6g}"), gain * codes - offset)]


def scope_bin(path):
    data = path.read_bytes()
    wide = data[2:4] == b"03"
    at = 16 if wide else 12
    found = []
    for _ in range(struct.unpack_from("<i", data, at - 4)[0]):
        size, _, buffers, points = struct.unpack_from("<4i", data, at)
        increment = struct.unpack_from("<d", data, at + 32)[0]
        units = struct.unpack_from("<2i", data, at + 48)
        assert units == (2, 1) and buffers == 1
        at += size
        size, kind, width = struct.unpack_from("<ihh", data, at)
        length = struct.unpack_from("<q" if wide else "<i", data, at + 8)[0]
        assert kind == 1 and width == 4 and length == 4 * points
        found.append(("V", float(f"{1 / increment:.6g}"), np.frombuffer(data, "<f4", points, at + size).astype(float)))
        at += size + length
    return found


def isf(path):
    head, _, rest = path.read_bytes().partition(b":CURV")
    number = lambda key: float(re.search(key + rb"\w* ([^;]+)", head)[1])
    block = rest[rest.index(b"#") :]
    digits = int(block[1:2])
    length = int(block[2 : 2 + digits])
    assert b"BN_F RI" in head and number(b"BYT_N") == 1
    codes = np.frombuffer(block, "i1", length, 2 + digits).astype(float)
    values = (codes - number(b"YOF")) * number(b"YMU") + number(b"YZE")
    return [("V", 1 / number(b"XIN"), values)]


def jpk(path):
    """Base channels, codes times multiplier plus offset. The file's name is followed by the channel's."""
    import zipfile

    archive = zipfile.ZipFile(path)

    def properties(name):
        lines = archive.read(name).decode("latin-1").splitlines()
        return dict(line.split("=", 1) for line in lines if "=" in line and not line.startswith("#"))

    shared = properties("shared-data/header.properties")
    found = {}
    for name in archive.namelist():
        folder, _, last = name.rpartition("/")
        if last != "segment-header.properties":
            continue
        own = properties(name)
        rate = int(own["force-segment-header.num-points"]) / float(own["force-segment-header.duration"])
        for channel in own["channels.list"].split():
            info = f"lcd-info.{own[f'channel.{channel}.lcd-info.*']}."
            member = f"{folder}/{own.get(f'channel.{channel}.data.file.name', f'channels/{channel}.dat')}"
            if member not in archive.namelist():
                continue  # a raster that is computed
            file = archive.read(member)
            unit = shared[info + "unit.unit"]
            if info + "encoder.type" in shared:
                kinds = {"signedshort": ">i2", "signedinteger": ">i4", "unsignedshort": ">u2", "unsignedinteger": ">u4"}
                kind = kinds[shared[info + "encoder.type"].removesuffix("-limited")]
                scale, zero = (float(shared[info + "encoder.scaling." + key]) for key in ("multiplier", "offset"))
                values = np.frombuffer(file, kind).astype(float) * scale + zero
            else:
                values = np.frombuffer(file, {"float-data": ">f4", "double-data": ">f8"}[shared[info + "type"]]).astype(float)
            found[f"/{folder}/{channel}"] = (unit, rate, values)
    return found


READERS = {".wav": wav, ".trc": trc, ".bin": scope_bin, ".isf": isf, ".csv": tables, ".txt": tables, ".jpk-force-map": jpk, ".jpk-qi-series": jpk}


def main():
    for name in sys.argv[1:]:
        path = Path(name)
        try:
            found = READERS[path.suffix](path)
        except ValueError:
            print(path.name, "refused", sep="\t")
            continue
        named = found.items() if isinstance(found, dict) else [("", channel) for channel in found]
        for channel, (unit, rate, values) in named:
            weighted = float(np.dot(np.arange(1, len(values) + 1), values))
            numbers = [values.sum(), abs(values).sum(), weighted, values[0], values[-1]]
            print(path.name + channel, unit, rate if rate else "-", len(values), *(repr(float(n)) for n in numbers), sep="\t")


if __name__ == "__main__":
    main()
