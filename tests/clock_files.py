"""Writes free decays whose files state time in different ways: each rule of docs/archives.md by each program's format.

    python clock_files.py FOLDER

Two modes at 95 and 240 Hz, seen by two sensors; prints, as JSON, for each file its rule, its format and the arguments
that a user would give.
"""

import json
import pathlib
import sys

import h5py
import nptdms
import numpy as np
import pandas
import pyarrow
import pyarrow.feather
import pyarrow.parquet
import scipy.io

RATE_HZ = 10000.0
SAMPLES = 8000
# Hz, damping ratio, amplitudes of both sensors
MODES = [(95.0, 0.01, (1.0, 0.8)), (240.0, 0.008, (0.6, -0.7))]
START_S = 0.25
LATE_S = 3e-3



def seen(sensor, t, random):
    """What a sensor sees at times `t`."""
    since = np.clip(t - START_S, 0, None)
    y = 1e-3 * random.standard_normal(len(t))
    for frequency, damping, amplitudes in MODES:
        w = 2 * np.pi * frequency
        y += amplitudes[sensor] * np.exp(-damping * w * since) * np.sin(w * np.sqrt(1 - damping**2) * since)
    return y


def uniform(count, rate=RATE_HZ):
    return np.arange(count) / rate


def channels(rule, random):
    """Times and values of both sensors, the times as they are stored, their unit, and whether both share them."""
    t = uniform(SAMPLES)
    stored, unit, other = t, "s", t
    if rule == "milliseconds":
        stored, unit = 1e3 * t, "ms"
    elif rule in ("start", "stated start"):
        other = t + LATE_S
    elif rule == "whole numbers":
        stored, unit = 10 * np.arange(SAMPLES) + 53120, ""
    elif rule == "jump":
        stored = t = t + np.where(np.arange(SAMPLES) >= 6000, 0.3705, 0.0)
    elif rule == "jitter":
        stored = t = t + 5e-3 / RATE_HZ * random.uniform(-1, 1, SAMPLES)
    elif rule == "two rates":
        other = uniform(SAMPLES // 2, RATE_HZ / 2)
    shared = rule not in ("start", "stated start", "two rates")
    other = t if shared else other
    return (stored, seen(0, t, random)), (stored if shared else other, seen(1, other, random)), unit, shared


def stated(rule):
    """The rate that is stated, in Hz: a wrong one where the user gives another."""
    return 8000.0 if rule == "wrong rate" else RATE_HZ


def text(path, rule, a, b, unit, shared):
    if rule == "stated start":
        return False
    if rule == "wrong rate":
        rows = "\n".join(f"{x:.6f},{y:.6f}" for x, y in zip(a[1], b[1]))
        path.write_text(f"# Sampling Rate: 8000 Hz\nA (g),B (g)\n{rows}\n")
        return
    name = f"Time ({unit})" if unit else "Time"
    columns = {name: a[0], "A (g)": a[1], "B (g)": b[1]}
    if rule == "contradiction":
        columns = {name: a[0], "Time (ms)": 2e3 * a[0], "A (g)": a[1], "B (g)": b[1]}
    if not shared:
        columns = {"Time A (s)": a[0], "A (g)": a[1], "Time B (s)": b[0], "B (g)": b[1]}
    table = pandas.DataFrame({key: pandas.Series(values) for key, values in columns.items()})
    table.to_csv(path, index=False, float_format="%.9f")


def arrays(rule, a, b, unit, shared):
    """Names and values as a notebook saves them."""
    if rule == "wrong rate":
        return {"fs": 8000.0, "A": a[1], "B": b[1]}
    if rule == "stated start":
        each = zip("AB", (a, b), (0.0, LATE_S))
        return {name: {"dt": 1 / RATE_HZ, "t0": late, "y": values} for name, (_, values), late in each}
    if rule == "contradiction":
        return {"t_s": a[0], "t_ms": 2e3 * a[0], "A": a[1], "B": b[1]}
    if shared:
        return {"t_ms" if unit == "ms" else "t": a[0], "A": a[1], "B": b[1]}
    return {"A": {"t": a[0], "y": a[1]}, "B": {"t": b[0], "y": b[1]}}


def npz(path, rule, a, b, unit, shared):
    if not shared:
        return False
    np.savez(path, **arrays(rule, a, b, unit, shared))


def npy(path, rule, a, b, unit, shared):
    if not shared or rule in ("wrong rate", "contradiction"):
        return False
    name = "t_ms" if unit == "ms" else "t"
    table = np.empty(SAMPLES, [(name, a[0].dtype), ("A", float), ("B", float)])
    table[name], table["A"], table["B"] = a[0], a[1], b[1]
    np.save(path, table)


def mat(path, rule, a, b, unit, shared):
    scipy.io.savemat(path, arrays(rule, a, b, unit, shared))


def table(rule, a, b, unit, shared):
    """A table of Arrow; none where the sensors have different numbers of samples."""
    if rule in ("two rates", "stated start"):
        return None
    if rule == "wrong rate":
        return pyarrow.table({"A": a[1], "B": b[1]}, metadata={"sample_rate_hz": "8000"})
    if not shared:
        columns = arrays(rule, a, b, unit, shared)
        struct = lambda each: pyarrow.StructArray.from_arrays(list(each.values()), list(each))
        return pyarrow.table({name: struct(each) for name, each in columns.items()})
    columns = arrays(rule, a, b, "", shared)
    units = {"t": {"unit": unit}} if unit else {}
    fields = [pyarrow.field(name, pyarrow.from_numpy_dtype(values.dtype), metadata=units.get(name)) for name, values in columns.items()]
    return pyarrow.table(list(columns.values()), pyarrow.schema(fields))


def arrow(path, *rule):
    made = table(*rule)
    if made is None:
        return False
    pyarrow.feather.write_feather(made, path, chunksize=3000)


def parquet(path, *rule):
    made = table(*rule)
    if made is None:
        return False
    pyarrow.parquet.write_table(made, path, row_group_size=3000)


def hdf5(path, rule, a, b, unit, shared):
    with h5py.File(path, "w") as file:
        for name, (t, y) in (("A", a), ("B", b)):
            group = file if shared else file.create_group(name)
            if rule not in ("wrong rate", "start", "stated start") and "time" not in group:
                group["time"] = t
                if rule == "contradiction":
                    group["t_ms"] = 2e3 * t
                if unit:
                    group["time"].attrs["units"] = unit
            place = name if shared else "y"
            group[place] = y
            group[place].attrs["units"] = "g"
            if rule in ("wrong rate", "start"):
                group[place].attrs["sampling_rate"] = stated(rule)
            if rule == "stated start":
                group.attrs["fs"], group.attrs["start"] = "10 kHz", t[0]
            if rule == "start":
                group[place].attrs["t0"], group[place].attrs["t0_units"] = 1e3 * t[0], "ms"


def netcdf(path, rule, a, b, unit, shared):
    if rule == "contradiction":
        return False
    with scipy.io.netcdf_file(path, "w") as file:
        for name, (t, y) in (("A", a), ("B", b)):
            axis = "time" if shared else f"time_{name}"
            if axis not in file.dimensions:
                file.createDimension(axis, len(t))
                if rule not in ("wrong rate", "stated start"):
                    whole = np.issubdtype(t.dtype, np.integer)
                    times = file.createVariable(axis, "i4" if whole else "f8", (axis,))
                    times[:] = t
                    if unit:
                        times.units = unit
            values = file.createVariable(name, "f8", (axis,))
            values[:] = y
            values.units = "g"
            if rule == "stated start":
                values.sampling_rate, values.t_start = RATE_HZ, t[0]
        if rule == "wrong rate":
            file.sampling_rate = 8000.0


def tdms(path, rule, a, b, unit, shared):
    start = np.datetime64("2026-11-26T12:00:00")
    objects = []
    if rule == "contradiction":
        return False
    as_waveform = rule in ("milliseconds", "start", "two rates", "wrong rate")
    if not as_waveform and rule != "stated start":
        properties = {"unit_string": unit} if unit else {}
        objects.append(nptdms.ChannelObject("G", "Time", a[0], properties))
    for name, (t, y) in (("A", a), ("B", b)):
        properties = {"unit_string": "g"}
        if rule == "stated start":
            properties |= {"sampling_rate": "10 kHz", "t0_ms": 1e3 * float(t[0])}
        if as_waveform:
            step = 1 / 8000.0 if rule == "wrong rate" else float(t[1] - t[0])
            late = np.timedelta64(3000, "us") if rule == "start" and name == "B" else np.timedelta64(0, "us")
            properties |= {"wf_increment": step, "wf_start_offset": 0.0, "wf_start_time": start + late}
            if unit == "ms":
                properties["wf_xunit_string"] = "ms"
        objects.append(nptdms.ChannelObject("G", name, y, properties))
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(objects)


def lvm(path, rule, a, b, unit, shared):
    if rule in ("milliseconds", "whole numbers", "stated start", "contradiction"):
        return False
    header = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\t{}\n***End_of_Header***\t\n\t\n"
    with_times = rule in ("jump", "jitter")
    steps = [1 / stated(rule), (b[0][1] - b[0][0]) if rule == "two rates" else 1 / stated(rule)]
    late = LATE_S if rule == "start" else 0.0
    lines = [header.format("One" if with_times else "No")]
    lines.append(f"Channels\t2\nSamples\t{len(a[1])}\t{len(b[1])}\nDate\t2020/01/01\t2020/01/01\nTime\t09:00:00\t09:00:00\n")
    lines.append(f"Y_Unit_Label\tg\tg\nX_Dimension\tTime\tTime\nX0\t0\t{late}\nDelta_X\t{steps[0]:.6E}\t{steps[1]:.6E}\n")
    lines.append("***End_of_Header***\nX_Value\tA\tB\tComment\n")
    for k in range(max(len(a[1]), len(b[1]))):
        cell = lambda values: f"{values[k]:.9f}" if k < len(values) else ""
        lines.append(f"{cell(a[0]) if with_times else ''}\t{cell(a[1])}\t{cell(b[1])}\n")
    path.write_text("".join(lines))


def universal(path, rule, a, b, unit, shared):
    """Universal files 58: stored times where they are uneven."""
    if rule in ("milliseconds", "whole numbers", "stated start", "contradiction"):
        return False
    lines = []
    for node, (t, y) in ((1, a), (2, b)):
        even = rule not in ("jump", "jitter")
        step = 1 / stated(rule) if rule == "wrong rate" else t[1] - t[0]
        lines += ["    -1", "    58", "decay", "NONE", "26-Nov-26", "NONE", "NONE"]
        lines.append(f"    1         0    1         0       NONE    {node:6d}   3       NONE         0   0")
        lines.append(f"{4:10d}{len(y):10d}{int(even):10d}{t[0]:13.5E}{step if even else 0.0:13.5E}{0.0:13.5E}")
        lines.append(f"{17:10d}    0    0    0 Time                 s                   ")
        lines.append(f"{0:10d}    0    0    0 Signal               g                   ")
        lines += [f"{0:10d}    0    0    0 NONE                 NONE                "] * 2
        values = [f"{value:20.12E}" for value in y]
        if even:
            lines += ["".join(values[k : k + 4]) for k in range(0, len(y), 4)]
        else:
            lines += [f"{t[k]:13.6E}{values[k]}{t[k + 1]:13.6E}{values[k + 1]}" for k in range(0, len(y), 2)]
        lines.append("    -1")
    path.write_text("\n".join(lines) + "\n")


def wav(path, rule, a, b, unit, shared):
    if rule != "wrong rate":
        return False
    both = np.stack([a[1], b[1]], axis=1).astype("f4") / 4
    scipy.io.wavfile.write(path, 8000, both)


WRITERS = {
    "text": (text, "csv"),
    "npz": (npz, "npz"),
    "npy": (npy, "npy"),
    "parquet": (parquet, "parquet"),
    "arrow": (arrow, "arrow"),
    "mat": (mat, "mat"),
    "hdf5": (hdf5, "h5"),
    "netcdf": (netcdf, "nc"),
    "tdms": (tdms, "tdms"),
    "uff": (universal, "uff"),
    "lvm": (lvm, "lvm"),
    "wav": (wav, "wav"),
}
RULES = ["milliseconds", "start", "whole numbers", "jump", "jitter", "two rates", "wrong rate", "stated start", "contradiction"]


def main():
    folder = pathlib.Path(sys.argv[1])
    files = []
    for rule in RULES:
        for name, (write, ending) in WRITERS.items():
            path = folder / f"{rule.replace(' ', '_')}_{name}.{ending}"
            a, b, unit, shared = channels(rule, np.random.default_rng(7))
            if write(path, rule, a, b, unit, shared) is False:
                continue
            arguments = ["--rate", str(int(RATE_HZ))] if rule == "wrong rate" else []
            files.append({"rule": rule, "format": name, "file": path.name, "arguments": arguments})
    print(json.dumps(files))


if __name__ == "__main__":
    main()
