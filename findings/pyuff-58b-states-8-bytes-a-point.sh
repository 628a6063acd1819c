#!/usr/bin/env bash
# pyuff 2.5.8 states half or a third of the bytes of a binary data set 58b whose values are complex or whose abscissa is
# stored.
#
# Expected: the number of bytes behind the header in the first line of a data set 58b (field 6 of its first record) is
# that of the binary data which follow: points x 8 for real double precision with an even abscissa, x 16 for complex
# values or a stored abscissa, x 24 for both.
# Seen: points x 8 in every case. A reader that trusts the count looks for the line "    -1" within the data; pyuff
# itself reads its files back, since it looks for that line instead of counting.
#
# Exit code 0: as stated here. 1: pyuff behaves otherwise now.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check pyuff==2.5.8 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PY'
import sys

import numpy as np
import pyuff

POINTS = 1000
t = np.arange(POINTS) / 1000.0
found = {}
for name, y, even in [
    ("real, even", np.sin(t), 1),
    ("complex, even", np.exp(1j * t), 1),
    ("real, stored abscissa", np.sin(t), 0),
    ("complex, stored abscissa", np.exp(1j * t), 0),
]:
    data = pyuff.prepare_58(
        binary=1, func_type=1, rsp_node=1, rsp_dir=3, ref_node=0, ref_dir=0, id1="set", rsp_ent_name="NONE",
        ref_ent_name="NONE", data=y, x=t, abscissa_spacing=even, abscissa_spec_data_type=17,
        ordinate_spec_data_type=12, orddenom_spec_data_type=0, return_full_dict=True,
    )
    for key, value in data.items():
        if value is None:
            data[key] = "NONE" if "lab" in key or "name" in key or key.startswith("id") else 0
    path = name.replace(" ", "_") + ".uff"
    pyuff.UFF(path).write_sets(data, mode="add")
    whole = open(path, "rb").read()
    lines = whole.split(b"\n", 13)
    stated = int(lines[1].split()[4])
    there = len(lines[13]) - len(b"    -1\n")
    found[name] = (stated, there)
    print(f"{name}: {stated} bytes stated, {there} there")
wanted = {"real, even": 8, "complex, even": 16, "real, stored abscissa": 16, "complex, stored abscissa": 24}
as_stated = all(found[name] == (8 * POINTS, bytes_a_point * POINTS) for name, bytes_a_point in wanted.items())
sys.exit(not as_stated)
PY
