"""Writes the small files in tests/data that the tests of MAT-files read. Run: python tests/make_mat.py (with scipy)"""
import pathlib
import numpy as np
from scipy.io import savemat

data = pathlib.Path(__file__).parent / "data"
wave = np.sin(np.arange(400) / 7)
pico = dict(Tstart=-1e-3, Tinterval=4e-7, Length=400.0, A=wave.astype("f4")[:, None], B=(3 * wave).astype("f4")[:, None],
            Version="2.3.1")
savemat(data / "pico_v7.mat", pico, do_compression=True)
savemat(data / "pico_v6.mat", pico, do_compression=False)
savemat(data / "pico_v4.mat", {key: value for key, value in pico.items() if key != "Version"}, format="4")

structs = np.zeros((1, 2), dtype=[("x", object), ("unit", object)])
structs[0, 0] = (np.arange(40, dtype="i2"), "nm")
structs[0, 1] = (np.arange(40, dtype="u4") * 3, "V")
cell = np.empty((1, 2), dtype=object)
cell[0, 0] = np.arange(20.0)
cell[0, 1] = {"fs": 1e6, "deep": {"y": np.arange(30, dtype="i8")}}
for compressed in [False, True]:
    savemat(data / f"nested_{'v7' if compressed else 'v6'}.mat", {
        "s": structs, "c": cell, "rec": {"dt": 1e-5, "z": np.arange(50, dtype="f4"), "note": "x" * 100},
        "two": {"fs": 100.0, "dt": 1.0, "w": np.arange(25.0)}, "wide": np.arange(120, dtype="u1").reshape(2, 60),
        "on": np.arange(20) > 4, "cube": np.arange(24.0).reshape(2, 3, 4), "none": np.zeros((0, 0)), "lines": np.array(["ab", "cd"]),
    }, do_compression=compressed)
