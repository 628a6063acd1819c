#!/bin/bash
# The example plugins in Octave and with scikit-rf: each passes `afmid plugin check`, each runs in its config.
#
#   tests/interop/plugins.sh AFMID PYTHON
#
# (installs octave with apt where it is missing; PYTHON has numpy, h5py, and here gets scikit-rf in a folder of its own)
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
afmid=$(realpath "$1")
python=$(realpath -s "$2")
. "$root/tests/interop/tools.sh"
make_scratch plugins
need octave-cli octave
"$python" -m pip install --quiet --disable-pip-version-check --target "$scratch/skrf" --no-deps scikit-rf==2.2.0 typing_extensions ||
    fail "scikit-rf cannot be had"
export PYTHONPATH=$scratch/skrf PYTHONDONTWRITEBYTECODE=1
# the configs say python3
export PATH=$(dirname "$python"):$PATH
cd "$root/examples/plugins"
"$afmid" plugin check --timeout 120 -- octave-cli --no-init-file --no-history --quiet envelope.m
"$afmid" plugin check --timeout 120 -- python3 vector_fit.py
for name in envelope vector_fit; do
    "$afmid" run "$name.toml" --allow-plugins --set "archive.out='$scratch/archive-$name'" --cache "$scratch/cache" -o "$scratch/$name.h5"
    "$afmid" show "$scratch/$name.h5" "$name"
done
# the two estimators see the same smoothed response and the same record: they agree far within their own errors
"$afmid" show "$scratch/vector_fit.h5" vector_fit --json | "$python" -c '
import json, sys
def rows(value):
    if isinstance(value, dict):
        if "frequency_difference" in value: yield value
        for inner in value.values(): yield from rows(inner)
    elif isinstance(value, list):
        for inner in value: yield from rows(inner)
found = list(rows(json.load(sys.stdin)))
assert len(found) == 4, f"{len(found)} modes compared, wanted 4"
for row in found:
    assert abs(row["frequency_difference"]) < 1e-4 and abs(row["quality_factor_difference"]) < 0.1, row
print(f"{len(found)} modes agree")
'
