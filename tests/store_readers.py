"""Opens an afmid result file with other people's readers: h5py, silx, xarray (h5netcdf) and nxcheck.

Prints one line per check; exits with 1 if any fails. Usage: store_readers.py RESULT.h5
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
import xarray as xr
from silx.io.nxdata import get_default

# attributes of dimension scales: the only references that readers can live with
SCALE_ATTRIBUTES = {"DIMENSION_LIST", "REFERENCE_LIST"}
failures = []


def check(holds, text):
    """Notes a failure; silent otherwise."""
    if not holds:
        failures.append(text)


def decoded(value):
    return value.decode() if isinstance(value, bytes) else value


def check_types(name, dtype):
    """What breaks xarray or viewers on the whole file: variable-length arrays, float16, references."""
    text = h5py.check_string_dtype(dtype) is not None
    check(text or h5py.check_vlen_dtype(dtype) is None, f"{name}: a variable-length array")
    check(h5py.check_ref_dtype(dtype) is None, f"{name}: a reference")
    check(dtype != np.float16, f"{name}: float16")


def check_h5py(path):
    """Reads every object and attribute; every link is a hard one."""
    count = {"groups": 0, "datasets": 0, "attributes": 0}
    with h5py.File(path) as file:

        def walk(group):
            for name in group:
                link = group.get(name, getlink=True)
                check(isinstance(link, h5py.HardLink), f"{group.name}/{name}: not a hard link")
                visit(group[name])
                if isinstance(group[name], h5py.Group):
                    walk(group[name])

        def visit(thing):
            if isinstance(thing, h5py.Dataset):
                count["datasets"] += 1
                check_types(thing.name, thing.dtype)
                thing[()]
            else:
                count["groups"] += 1
                check("NX_class" in thing.attrs, f"{thing.name}: no NX_class")
            for name in thing.attrs:
                count["attributes"] += 1
                if name not in SCALE_ATTRIBUTES:
                    check_types(f"{thing.name}@{name}", thing.attrs.get_id(name).dtype)
                    thing.attrs[name]

        walk(file)
    print(f"h5py: {count['groups']} groups, {count['datasets']} datasets, {count['attributes']} attributes")


def check_default_plot(path):
    """Follows `default` from the root to a signal with axes of its shape, as viewers do."""
    with h5py.File(path) as file:
        group, steps = file, []
        while "default" in group.attrs and len(steps) < 9:
            steps.append(decoded(group.attrs["default"]))
            check(steps[-1] in group, f"{group.name}: default = {steps[-1]} does not exist")
            group = group[steps[-1]]
        check(decoded(group.attrs.get("NX_class")) == "NXdata", f"{group.name}: default does not lead to NXdata")
        plots = 0

        def signal(_, data):
            nonlocal plots
            if not isinstance(data, h5py.Group) or decoded(data.attrs.get("NX_class")) != "NXdata":
                return
            plots += 1
            shown = data[decoded(data.attrs["signal"])]
            axes = [decoded(axis) for axis in np.atleast_1d(data.attrs.get("axes", np.array([], object)))]
            check(tuple(len(data[axis]) for axis in axes) == shown.shape, f"{data.name}: axes do not fit the signal")
            for other in np.atleast_1d(data.attrs.get("auxiliary_signals", np.array([], object))):
                check(data[decoded(other)].shape == shown.shape, f"{data.name}: {other} differs in shape")

        file.visititems(signal)
        print(f"default plot: {group.name}, {plots} groups with signal and axes")


def check_silx(path):
    """What `silx view` plots of the file, and of every stage that has a default plot."""
    with h5py.File(path) as file:
        shown = get_default(file)
        check(shown is not None and shown.is_valid, "silx: no default plot")
        if shown is None:
            return
        signal = decoded(shown.group.attrs["signal"])
        check(shown.signal_dataset_name == signal, f"silx: {shown.signal_dataset_name} is not {signal}")
        check(all(axis is not None for axis in shown.axes), f"silx: {shown.group.name}: an axis is missing")
        check(shown.is_curve or shown.is_image, f"silx: {shown.group.name} is neither a curve nor an image")
        print(
            f"silx: default plot {shown.group.name}, {shown.signal_dataset_name} "
            f"over {', '.join(shown.axes_dataset_names)}"
        )
        plots = 0
        for name, stage in file["entry"].items():
            if "default" in stage.attrs:
                data = get_default(stage)
                check(data is not None and data.is_valid, f"silx: {name}: no default plot")
                plots += 1
        print(f"silx: default plots of {plots} stages")


def check_xarray(path):
    """Opens every artifact; coordinates are the stored ones; complex variables are joined again."""
    with h5py.File(path) as file:
        groups = []
        file.visititems(lambda name, thing: groups.append(name) if "afmid_layout" in thing.attrs else None)
    count = {"variables": 0, "coordinates": 0, "complex": 0}
    for group in groups:
        with h5py.File(path) as file:
            scales = {
                name: data[()] for name, data in file[group].items() if data.attrs.get("CLASS") == b"DIMENSION_SCALE"
            }
            kinds = {name: data.dtype.kind for name, data in file[group].items()}
        with xr.open_dataset(path, group=group, engine="h5netcdf") as data:
            data.load()
            for name, values in scales.items():
                check(name in data.coords, f"xarray: {group}/{name} is not a coordinate")
                same = name in data.coords and np.array_equal(data[name].values, values)
                check(same, f"xarray: {group}/{name} has other values")
                count["coordinates"] += 1
            for name, variable in data.data_vars.items():
                count["variables"] += 1
                missing = [dim for dim in variable.dims if dim not in data.coords]
                check(not missing, f"xarray: {group}/{name} has no coordinates along {missing}")
                check(kinds[name] != "O" or variable.dtype.kind in "OUT", f"xarray: {group}/{name} is not text")
            for name in {variable.attrs["complex_of"] for variable in data.values() if "complex_of" in variable.attrs}:
                joined = data[f"{name}_real"] + 1j * data[f"{name}_imag"]
                count["complex"] += 1
                close = np.allclose(abs(joined), data[f"{name}_magnitude"], rtol=1e-15 * 8, atol=0, equal_nan=True)
                check(close, f"xarray: {group}/{name}: real and imaginary part do not fit the magnitude")
    totals = f"{count['variables']} variables, {count['coordinates']} coordinates, {count['complex']} complex"
    print(f"xarray: {len(groups)} groups, {totals}")
    with xr.open_datatree(path, engine="h5netcdf", phony_dims="sort") as tree:
        print(f"xarray: the whole file as a tree of {len(list(tree.subtree))} nodes")


def check_nexus(path):
    """Runs nxcheck. Its exit code is always 0, so the totals are read from its last lines.

    On a copy: it opens files for writing, and HDF5 then cuts off the seal that lies behind its end.
    """
    with tempfile.TemporaryDirectory() as folder:
        copy = shutil.copy(path, folder)
        command = [sys.executable, str(Path(sys.executable).with_name("nxcheck")), copy]
        output = subprocess.run(command, capture_output=True, text=True, check=False)
    text = re.sub(r"\x1b\[[0-9;]*m", "", output.stdout)
    totals = {kind: re.search(rf"Total number of {kind}: (\d+)", text) for kind in ("warnings", "errors")}
    if totals["errors"] is None:
        failures.append(f"nxcheck: no total in its output:\n{text[-2000:]}{output.stderr[-2000:]}")
        return
    errors, warnings = int(totals["errors"][1]), int(totals["warnings"][1])
    print(f"nxcheck: {errors} errors, {warnings} warnings")
    check(errors == 0, f"nxcheck: {errors} errors\n{text}")


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: store_readers.py RESULT.h5")
    for run in (check_h5py, check_default_plot, check_silx, check_xarray, check_nexus):
        try:
            run(sys.argv[1])
        except Exception as error:  # a reader that gives up is what this script looks for
            failures.append(f"{run.__name__}: {type(error).__name__}: {error}")
    for failure in failures:
        print(f"FAILED {failure}")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
