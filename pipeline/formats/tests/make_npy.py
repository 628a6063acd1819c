"""Writes the small files in tests/data that the tests of NumPy's formats read. Run: python tests/make_npy.py"""
import pathlib
import numpy as np

data = pathlib.Path(__file__).parent / "data"
data.mkdir(exist_ok=True)
ramp = np.arange(-20, 20)

for code in ["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f4", "f8"]:
    for order in "<>":
        top = {"u": 3, "i": -3, "f": 0.37}[code[0]]
        np.save(data / f"{'little' if order == '<' else 'big'}_{code}.npy", (np.arange(40) * top).astype(order + code))

table = np.arange(120.0).reshape(40, 3) ** 2
np.save(data / "c_order.npy", table)
np.save(data / "fortran_order.npy", np.asfortranarray(table))
np.save(data / "wide.npy", np.arange(80, dtype="<i2").reshape(2, 40))
np.save(data / "cube.npy", np.arange(24, dtype="<u2").reshape(4, 3, 2))
np.save(data / "bool.npy", ramp > 3)
np.save(data / "empty.npy", np.zeros((0, 3)))
np.save(data / "scalar.npy", np.float64(2.5))

fields = np.zeros(40, dtype=np.dtype([("time", "<f8"), ("code", "u1"), ("xy", ">i2", (2,)), ("name", "S3"), ("in", [("z", "<f4")])], align=True))
fields["time"] = np.arange(40) * 1e-3
fields["code"] = np.arange(40)
fields["xy"] = np.arange(80).reshape(40, 2) - 40
fields["in"]["z"] = np.arange(40) / 8
np.save(data / "fields.npy", fields)

for name, array in {
    "half": ramp.astype("f2"), "big_half": (np.arange(40) * 0.37).astype(">f2"), "quadruple": ramp.astype("f16"), "complex": ramp.astype("c16"), "text": np.array(["a", "bc"]),
    "objects": np.array([1, None], dtype=object), "dates": np.array(["2024-01-01"], dtype="M8[D]"),
}.items():
    np.save(data / f"{name}.npy", array, allow_pickle=True)

for major, minor in [(1, 0), (2, 0), (3, 0)]:
    with open(data / f"version{major}.npy", "wb") as file:
        np.lib.format.write_array(file, ramp.astype("<i4"), version=(major, minor))

members = dict(deflection=np.sin(np.arange(500) / 9), codes=(np.arange(1000, dtype=">i2") * 7).reshape(500, 2),
               fs=np.float64(2.5e6), label=np.array("nm"), spectrum=np.zeros(3, complex))
np.savez(data / "stored.npz", **members)
np.savez_compressed(data / "deflated.npz", **members)

# objects beside numbers; times of an array and of a longer one
np.savez_compressed(data / "objects.npz", notes=np.array([{"a": 1}, None], dtype=object), y=ramp / 8.0, times=np.arange(40) * 1e-4,
                    long=np.zeros(41))
np.savez(data / "object_stored.npz", y=ramp / 8.0, notes=np.array(["x" * 500, None], dtype=object))
