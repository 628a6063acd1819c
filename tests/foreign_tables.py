"""Writes HDF5 files in the layouts of pandas and PyTables, and others with times beside signals. Usage: foreign_tables.py FOLDER

Written with h5py as pandas 3.0 and PyTables 3.10 lay them out, which the readers' tests need not have installed. y and
z of every file are the same 500 samples at 1 kHz.
"""
import sys
from pathlib import Path

import h5py
import numpy as np

T = np.arange(500) * 1e-3
Y = np.exp(-8 * T) * np.cos(2 * np.pi * 50 * T)


def fixed(file, index, kind, columns):
    """DataFrame.to_hdf(format="fixed"): the index, and blocks of columns with their names."""
    group = file.create_group("df")
    group.attrs["pandas_type"] = np.bytes_("frame")
    group.create_dataset("axis0", data=np.array(list(columns), "S"))
    group.create_dataset("axis1", data=index).attrs["kind"] = np.bytes_(kind)
    group.create_dataset("block0_items", data=np.array(list(columns), "S"))
    group.create_dataset("block0_values", data=np.stack(list(columns.values()), axis=1))


def table(file, index, kind, fields, names=None, **options):
    """DataFrame.to_hdf(format="table"): records, and indexes over their columns."""
    group = file.create_group("df")
    group.attrs["pandas_type"] = np.bytes_("frame_table")
    shapes = [(name, "<f8", values.shape[1:]) for name, values in fields.items()]
    records = np.zeros(500, dtype=[("index", index.dtype), *shapes])
    records["index"] = index
    for name, values in fields.items():
        records[name] = values
    dataset = group.create_dataset("table", data=records, maxshape=(None,), chunks=(2730,), **options)
    dataset.attrs["index_kind"] = np.bytes_(kind)
    if names:
        pickled = "(lp0\n" + "".join(f"{'a' if i else ''}V{name}\np{i + 1}\n" for i, name in enumerate(names)) + "a."
        dataset.attrs["values_block_0_kind"] = np.bytes_(pickled)
    inner = group.create_group("_i_table").create_group("index")
    inner.create_dataset("sortedLR", data=np.sort(Y))


def main():
    folder = Path(sys.argv[1])
    both = {"y": Y, "z": -Y}
    block = {"values_block_0": np.stack([Y, -Y], axis=1)}
    moments = 1_704_067_200_000_000_000 + np.arange(500, dtype="i8") * 1_000_000
    with h5py.File(folder / "fixed.h5", "w") as file:
        fixed(file, T, "float", both)
    with h5py.File(folder / "fixed-moments.h5", "w") as file:
        fixed(file, moments, "datetime64[ns]", both)
    with h5py.File(folder / "fixed-column.h5", "w") as file:
        fixed(file, np.arange(500), "integer", {"time": T, **both})
    with h5py.File(folder / "series.h5", "w") as file:
        group = file.create_group("df")
        group.attrs["pandas_type"] = np.bytes_("series")
        group["index"], group["values"] = T, Y
    with h5py.File(folder / "table.h5", "w") as file:
        table(file, T, "float", block, "yz")
    with h5py.File(folder / "table-moments.h5", "w") as file:
        table(file, moments, "datetime64[ns]", block, "yz", compression="gzip", shuffle=True)
    with h5py.File(folder / "table-columns.h5", "w") as file:
        table(file, T, "float", both)
    with h5py.File(folder / "pytables.h5", "w") as file:
        records = np.zeros(500, dtype=[("time", "<f8"), ("y", "<f8"), ("code", "<i2"), ("note", "S3")])
        records["time"], records["y"], records["code"] = T, Y, np.round(1000 * Y)
        file.create_group("run").create_dataset("records", data=records)
    with h5py.File(folder / "arrays.h5", "w") as file:
        file["time"], file["signals/y"] = T, Y
        file["signals/both"] = np.stack([Y] * 40, axis=1)
        file["signals/longer"] = np.zeros(600)
        file["codes"] = np.round(1000 * Y).astype("i2")
        file["codes"].attrs["units"] = "V"
    with h5py.File(folder / "scale.h5", "w") as file:
        file["y"], file["ms"] = Y, 1000 * T
        file["ms"].attrs["units"] = "ms"
        file["ms"].make_scale("ms")
        file["y"].dims[0].attach_scale(file["ms"])
    with h5py.File(folder / "jpk.h5", "w") as file:
        group = file.create_group("Channel_000")
        group.attrs["encoder.scaling.multiplier"], group.attrs["encoder.scaling.offset"] = 1e-9, 0.5
        group.attrs["encoder.scaling.unit.unit"] = np.bytes_("V")
        group["y"] = np.round(1e9 * (Y - 0.5)).astype("i4")
    # half precision in both byte orders, and another number of two bytes
    with h5py.File(folder / "half.h5", "w") as file:
        file["little"], file["big"] = Y.astype("<f2"), Y.astype(">f2")
        file.create_dataset("big_deflated", data=Y.astype(">f2"), chunks=(64,), compression="gzip", shuffle=True)
        file.create_dataset("rows", data=np.stack([Y, -Y]).astype(">f2"), chunks=(1, 100), compression="gzip")
        file["columns"] = np.stack([Y] * 40, axis=1).astype(">f2")
        file["time"] = T
        records = np.zeros(500, dtype=[("y", ">f2"), ("z", ">f2")])
        records["y"] = Y
        file["records"] = records
        brain = h5py.h5t.IEEE_F16LE.copy()
        brain.set_fields(15, 7, 8, 0, 7)
        brain.set_ebias(127)
        space = h5py.h5s.create_simple((500,))
        made = h5py.h5d.create(file.id, b"brain", brain, space)
        made.write(h5py.h5s.ALL, h5py.h5s.ALL, Y)
    # MATLAB 7.3: a struct with an array, the names of its columns in a cell array, and their unit
    with h5py.File(folder / "struct.mat", "w", userblock_size=512) as file:
        matlab(file, "Test/acc", np.stack([Y, -Y]), "double")
        names = [matlab(file, f"#refs#/{name}", characters(name), "char").ref for name in ["left", "right"]]
        matlab(file, "Test/names", np.array(names, dtype=h5py.ref_dtype).reshape(-1, 1), "cell")
        matlab(file, "Test/units", characters("m/s^2"), "char")
        matlab(file, "Test/fs", np.full((1, 1), 1000.0), "double")
    with open(folder / "struct.mat", "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def characters(text):
    """A line of text as MATLAB stores it."""
    return np.array([[ord(letter)] for letter in text], dtype="u2")


def matlab(file, name, values, kind):
    """A variable of MATLAB's."""
    dataset = file.create_dataset(name, data=values)
    dataset.attrs["MATLAB_class"] = np.bytes_(kind)
    return dataset


if __name__ == "__main__":
    main()
