"""Writes native records as other programs might: every storage that h5py offers. Usage: foreign_records.py FOLDER

Sample i of every file is ((i * 7919) mod 4096 - 2048) / divisor as the storage allows, but for what its name says.
"""

import sys
from pathlib import Path

import h5py
import numpy as np

SAMPLES = 70_000
CODES = ((np.arange(SAMPLES) * 7919) % 4096 - 2048).astype("i2")


def write(folder, name, data=CODES, file_options=None, attributes=None, **options):
    with h5py.File(folder / f"{name}.h5", "w", **(file_options or {})) as file:
        file.attrs["sample_rate_hz"] = np.float32(5e6)
        file.attrs["started_at"] = np.bytes_("2005-03-01T10:00:00Z")
        if data is None:
            dataset = file.create_dataset("deflection", (SAMPLES,), "i2", chunks=(4096,), fillvalue=-7, **options)
            dataset[:5000] = CODES[:5000]
        else:
            dataset = file.create_dataset("deflection", data=data, **options)
        for key, value in {"units": "V", "scale_factor": 0.5, **(attributes or {})}.items():
            dataset.attrs[key] = value


def main():
    folder = Path(sys.argv[1])
    chunked = {"chunks": (4096,), "compression": "gzip"}
    write(folder, "contiguous")
    write(folder, "big-endian", CODES.astype(">i2"))
    write(folder, "big-endian-gzip", CODES.astype(">i2"), shuffle=True, **chunked)
    write(folder, "single-big-endian", CODES.astype(">f4"))
    write(folder, "double-shuffled", CODES.astype("f8"), shuffle=True, **chunked)
    write(folder, "int32", CODES.astype("i4"), **chunked)
    write(folder, "uint16", (CODES + 2048).astype("u2"), attributes={"add_offset": -1024.0}, **chunked)
    write(folder, "uint32-big-endian", (CODES + 2048).astype(">u4"), attributes={"add_offset": -1024.0})
    write(folder, "chunked-raw", chunks=(1000,))
    write(folder, "one-chunk", chunks=(SAMPLES,), compression="gzip")
    write(folder, "checksummed", fletcher32=True, **chunked)
    write(folder, "scale-offset", chunks=(4096,), scaleoffset=0)
    write(folder, "extensible", maxshape=(None,), **chunked)
    write(folder, "user-block", file_options={"userblock_size": 512})
    write(folder, "user-block-gzip", file_options={"userblock_size": 1024}, **chunked)
    write(folder, "latest", file_options={"libver": "latest"}, **chunked)
    write(folder, "latest-extensible", file_options={"libver": "latest"}, maxshape=(None,), **chunked)
    write(folder, "latest-one-chunk", file_options={"libver": "latest"}, chunks=(SAMPLES,), compression="gzip")
    write(folder, "paged", file_options={"fs_strategy": "page", "fs_page_size": 4096}, **chunked)
    write(folder, "byte-attributes", attributes={"units": np.bytes_("V"), "_FillValue": np.int16(-2048)})
    write(folder, "array-attributes", attributes={"scale_factor": np.array([0.5]), "units": np.array(["V"], object)})
    write(folder, "partly-written", None)
    write(folder, "unreadable-lzf", chunks=(4096,), compression="lzf")
    write(folder, "unreadable-complex", CODES.astype("c8"))
    write(folder, "unreadable-int64", CODES.astype("i8"))


if __name__ == "__main__":
    main()
