"""Writes one free decay in every way of the programs that keep recordings in Python: three modes, 1 s at 5 kHz.

    python program_files.py FOLDER

Prints the true frequencies, and for each file what has to be said beside it, as JSON.
"""

import gzip
import json
import pathlib
import sys
import warnings

import h5py
import hdf5storage
import nptdms
import numpy as np
import pandas
import polars
import pyarrow
import pyarrow.feather
import pyarrow.parquet
import pyuff
import scipy.io
import soundfile
import xarray

from decay_files import CODE, MODES, RATE_HZ, decay

BEGAN = np.datetime64("2026-11-26T12:00:00", "ns")


def stamps(count):
    """One stamp a sample, in whole nanoseconds."""
    return BEGAN + (np.arange(count) * 200_000).astype("timedelta64[ns]")


def of_pandas(folder, y, t):
    frame = pandas.DataFrame({"acc": y}, index=pandas.Index(t, name="time"))
    words = frame.assign(note="quiet")
    at = {"datetime": pandas.DatetimeIndex(stamps(len(y))), "timedelta": pandas.to_timedelta(stamps(len(y)) - BEGAN)}
    for form in ("fixed", "table"):
        frame.to_hdf(folder / f"pandas_{form}.h5", key="df", format=form)
        for name, index in at.items():
            frame.set_axis(index).to_hdf(folder / f"pandas_{form}_{name}.h5", key="df", format=form)
    words.to_hdf(folder / "pandas_strings.h5", key="df", format="table")
    frame.to_csv(folder / "comma.csv")
    frame.to_csv(folder / "semicolon.csv", sep=";", decimal=",")
    frame.to_csv(folder / "packed.csv.gz")
    frame.set_axis(at["datetime"]).to_csv(folder / "datetime.csv", index_label="time")
    frame.reset_index().to_csv(folder / "index.csv")


def of_xarray(folder, y, t):
    coordinates = {
        "float": ("time", t, {"units": "s"}),
        "datetime64": ("time", stamps(len(y))),
        "timedelta64": ("time", stamps(len(y)) - BEGAN),
    }
    for name, time in coordinates.items():
        data = xarray.Dataset({"acc": ("time", y, {"units": "m/s^2"})}, {"time": time})
        data.to_netcdf(folder / f"xarray_{name}.nc", engine="h5netcdf")


def of_matlab(folder, y, t):
    scipy.io.savemat(folder / "scipy.mat", {"acc": y, "t": t})
    scipy.io.savemat(folder / "scipy_packed.mat", {"S": {"acc": y, "fs": RATE_HZ}}, do_compression=True)
    hdf5storage.savemat(str(folder / "hdf5storage.mat"), {"acc": y, "fs": RATE_HZ}, format="7.3")
    with h5py.File(folder / "h5py.h5", "w") as file:
        file["acc"], file["fs"] = y, RATE_HZ


def of_nptdms(folder, y, t):
    waveform = {"wf_increment": 1 / RATE_HZ, "wf_start_offset": 0.0, "unit_string": "V"}
    with nptdms.TdmsWriter(folder / "segments.tdms") as writer:
        for part in np.split(y, 5):
            writer.write_segment([nptdms.ChannelObject("G", "acc", part, waveform)])
    scale = {
        "NI_Number_Of_Scales": 1,
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": CODE,
        "NI_Scale[0]_Linear_Y_Intercept": 0.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }
    codes = np.round(y / CODE).astype("i2")
    with nptdms.TdmsWriter(folder / "scaled.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("G", "acc", codes, {**waveform, **scale})])
    with nptdms.TdmsWriter(folder / "times.tdms") as writer:
        times = nptdms.ChannelObject("G", "Time", t, {"unit_string": "s"})
        writer.write_segment([times, nptdms.ChannelObject("G", "acc", y, {"unit_string": "V"})])


def of_soundfile(folder, y):
    for name, form, subtype in [
        ("pcm16", "WAV", "PCM_16"),
        ("pcm24", "WAV", "PCM_24"),
        ("pcm32", "WAV", "PCM_32"),
        ("float", "WAV", "FLOAT"),
        ("double", "WAV", "DOUBLE"),
        ("extensible", "WAVEX", "PCM_24"),
        ("rf64", "RF64", "PCM_16"),
    ]:
        soundfile.write(folder / f"{name}.wav", y / 4, int(RATE_HZ), subtype=subtype, format=form)


def of_pyuff(folder, y, t):
    common = pyuff.prepare_58(
        func_type=1,
        rsp_node=1,
        rsp_dir=3,
        ref_node=0,
        ref_dir=0,
        data=y,
        x=t,
        id1="decay",
        rsp_ent_name="NONE",
        ref_ent_name="NONE",
        abscissa_spec_data_type=17,
        abscissa_axis_units_lab="s",
        ordinate_spec_data_type=12,
        ordinate_axis_units_lab="m/s^2",
        orddenom_spec_data_type=0,
        return_full_dict=True,
    )
    # what is left unsaid has to be there all the same
    common |= {key: "NONE" if "lab" in key or "name" in key or "id" in key else 0 for key, value in common.items() if value is None}
    common |= {"load_case_id": 0, "z_axis_value": 0, "abscissa_min": 0.0, "abscissa_inc": 1 / RATE_HZ}
    for name, spacing, binary in [("even", 1, 0), ("uneven", 0, 0), ("even_binary", 1, 1), ("uneven_binary", 0, 1)]:
        dataset = {**common, "abscissa_spacing": spacing, "binary": binary, "ord_data_type": 4}
        pyuff.UFF(str(folder / f"pyuff_{name}.uff")).write_sets(dataset, mode="add")


def of_arrow(folder, y, t):
    """Tables of Arrow by its own library, pandas and Polars, and of Parquet by the three."""
    frame = pandas.DataFrame({"time": t, "acc": y})
    frame.to_feather(folder / "pandas.feather")
    frame.assign(time=stamps(len(y))).to_feather(folder / "pandas_datetime.feather", compression="zstd")
    frame.set_index("time").to_parquet(folder / "pandas.parquet")
    duration = pyarrow.duration("us")
    acc = pyarrow.field("acc", pyarrow.float64(), metadata={"unit": "m/s^2"})
    columns = [pyarrow.array(stamps(len(y)) - BEGAN).cast(duration), y]
    made = pyarrow.table(columns, pyarrow.schema([("elapsed", duration), acc]))
    with pyarrow.ipc.new_file(folder / "pyarrow.arrow", made.schema) as writer:
        writer.write_table(made, max_chunksize=700)
    packed = pyarrow.ipc.IpcWriteOptions(compression="lz4")
    with pyarrow.ipc.new_stream(folder / "pyarrow.arrows", made.schema, options=packed) as writer:
        writer.write_table(made, max_chunksize=700)
    table = polars.DataFrame({"time": t, "acc": y})
    table.write_ipc(folder / "polars.ipc")
    table.write_ipc(folder / "polars_zstd.ipc", compression="zstd")
    # packed with Zstandard
    table.write_parquet(folder / "polars.parquet", row_group_size=700)
    pyarrow.parquet.write_table(made, folder / "pyarrow.parquet", compression="brotli")


def of_numpy(folder, y, t):
    np.savez(folder / "plain.npz", t=t, acc=y)
    np.savez_compressed(folder / "packed.npz", fs=RATE_HZ, acc=y)
    table = np.zeros(len(y), [("time", "f8"), ("acc", "f8")])
    table["time"], table["acc"] = t, y
    np.save(folder / "structured.npy", table)
    np.savez(folder / "big_endian.npz", t=t.astype(">f8"), acc=y.astype(">f8"))
    np.save(folder / "alone.npy", y)


def main():
    warnings.simplefilter("ignore")
    folder = pathlib.Path(sys.argv[1])
    y, _ = decay(1)
    t = np.arange(len(y)) / RATE_HZ
    of_pandas(folder, y, t)
    of_xarray(folder, y, t)
    of_matlab(folder, y, t)
    of_nptdms(folder, y, t)
    of_soundfile(folder, y)
    of_pyuff(folder, y, t)
    of_arrow(folder, y, t)
    of_numpy(folder, y, t)
    said = {"alone.npy": ["--rate", "5000"]}
    files = {path.name: said.get(path.name, []) for path in sorted(folder.iterdir())}
    print(json.dumps({"frequencies_hz": [frequency for frequency, _ in MODES], "files": files}))


if __name__ == "__main__":
    main()
