"""Writes the small classic netCDF files in tests/data: CDF-1 and CDF-2 with SciPy, CDF-5 with netCDF4 (Unidata's own library).
Run: python tests/make_netcdf.py"""
import pathlib
import netCDF4
import numpy as np
from scipy.io import netcdf_file

data = pathlib.Path(__file__).parent / "data"
number = np.arange(40)

# records: slabs of five variables, one of them of two lanes and two that need padding
with netcdf_file(data / "records.netcdf", "w", version=2) as file:
    file.title = "a seed"
    file.createDimension("time", None)
    file.createDimension("side", 2)
    time = file.createVariable("time", "d", ("time",))
    time.units = "ms"
    volts = file.createVariable("volts", "h", ("time",))
    volts.units, volts.long_name, volts.scale_factor, volts.add_offset = "V", "the voltage", np.float64(0.5), np.float64(1.0)
    volts._FillValue = np.int16(-99)
    small = file.createVariable("small", "b", ("time",))
    both = file.createVariable("both", "f", ("time", "side"))
    both.units = "m"
    time[:], volts[:], small[:] = number * 0.25, number * 3 - 60, number - 20
    both[:] = np.stack([number / 8, -number], axis=1)

# no records; an array whose rows run along time, a number and attributes
with netcdf_file(data / "fixed.netcdf", "w", version=1) as file:
    file.createDimension("channel", 3)
    file.createDimension("sample", 60)
    rows = file.createVariable("rows", "i", ("channel", "sample"))
    rows[:] = np.stack([np.arange(60), np.arange(60) * 100, np.arange(60) * 10000])
    dt = file.createVariable("dt", "d", ())
    dt.units = "s"
    dt.data[...] = 1e-3
    name = file.createVariable("name", "c", ("channel",))
    name[:] = np.array([b"a", b"b", b"c"], "S1")

# one variable of records is not padded
with netcdf_file(data / "single.netcdf", "w", version=1) as file:
    file.sampling_rate = 2000.0
    file.createDimension("n", None)
    file.createVariable("y", "h", ("n",))[:] = number * 5

# types of CDF-5
with netCDF4.Dataset(data / "wide.netcdf", "w", format="NETCDF3_64BIT_DATA") as file:
    file.createDimension("time", None)
    file.createDimension("other", 40)
    time = file.createVariable("time", "f8", ("time",))
    time.units = "s"
    time[:] = number * 1e-3
    for code in ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"]:
        top = {"u": 3, "i": -3, "f": 0.5}[code[0]]
        file.createVariable(code, code, ("time",))[:] = (number * top).astype(code)
    file.createVariable("beside", "f8", ("other",))[:] = number / 4
