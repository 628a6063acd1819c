#!/usr/bin/env bash
# pyuff 2.5.8 loses a binary data set 58b that is written with mode "overwrite".
#
# Expected: UFF.write_sets(set, mode="overwrite") of a set 58 with binary = 1 leaves a file that pyuff reads back, as it
# does with mode="add" and as it does for binary = 0.
# Seen: the file has 7 bytes, the line "    -1" that ends the data set, and no error is raised. The writer opens the file
# again for its binary part with mode "wb", which cuts off the header that it has just written, and once more with "wt"
# behind it, which cuts off the data.
#
# Exit code 0: as stated here. 1: pyuff behaves otherwise now.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet --disable-pip-version-check pyuff==2.5.8 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PY'
import os
import sys

import numpy as np
import pyuff

t = np.arange(1000) / 1000.0
y = np.sin(2 * np.pi * 50 * t)
sizes = {}
for binary in (0, 1):
    for mode in ("add", "overwrite"):
        data = pyuff.prepare_58(
            binary=binary, func_type=1, rsp_node=1, rsp_dir=3, ref_node=0, ref_dir=0, id1="sine", rsp_ent_name="NONE",
            ref_ent_name="NONE", data=y, x=t, abscissa_spacing=1, abscissa_spec_data_type=17,
            ordinate_spec_data_type=12, orddenom_spec_data_type=0, return_full_dict=True,
        )
        # the writer wants every key: what is not given is "NONE" or 0
        for key, value in data.items():
            if value is None:
                data[key] = "NONE" if "lab" in key or "name" in key or key.startswith("id") else 0
        path = f"{mode}_{binary}.uff"
        pyuff.UFF(path).write_sets(data, mode=mode)
        sizes[binary, mode] = os.path.getsize(path)
print("pyuff", getattr(pyuff, "__version__", "2.5.8"), "bytes of (binary, mode):", sizes)
as_stated = sizes[1, "overwrite"] == 7 and sizes[1, "add"] > 8000 and sizes[0, "overwrite"] == sizes[0, "add"] > 20000
sys.exit(not as_stated)
PY
