#!/bin/bash
# A model that `afmid export` wrote, simulated under Octave: the prediction is the one that afmid itself stored.
#
#   tests/interop/octave.sh AFMID PYTHON [RESULT.h5]
#
# (installs octave with apt where it is missing; RESULT.h5: instead of a simulated one)
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
afmid=$(realpath "$1")
python=$(realpath -s "$2")
. "$root/tests/interop/tools.sh"
make_scratch octave
need octave-cli octave
if [ -n "${3:-}" ]; then cp "$3" "$scratch/a.h5"; else make_result "$afmid"; fi
cd "$scratch"
"$afmid" export a.h5 --model mat -o model.mat
"$afmid" export a.h5 --model json -o model.json
# force, response and afmid's own prediction, as Octave reads them
PYTHONPATH=$root/python/afmid/src "$python" - <<'END'
import afmid, scipy.io
with afmid.open("a.h5") as r:
    pair = r.force
    prediction = r["model.residuals"].prediction.values
    signals = {"force": pair.force.values, "response": pair.response.values, "prediction": prediction}
scipy.io.savemat("signals.mat", signals, oned_as="column")
END
octave-cli --no-init-file --no-history --quiet "$root/tests/interop/octave_model.m"
