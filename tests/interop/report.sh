#!/bin/bash
# Reports in headless Chromium: the lean main job's, and a diagnosis's of each archive with something hidden.
#
#   tests/interop/report.sh AFMID [FOLDER]
#
# (installs chromium, nodejs and npm with apt where they are missing; FOLDER: keeps pages and screenshots)
#
# The archives are those of $AFMID_DATA or ../shared/data beside the clone; where they are missing simulated ones take
# their place, and the output says so.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
afmid=$(realpath "$1")
. "$root/tests/interop/tools.sh"
make_scratch report
keep=${2:-$scratch/pages}
mkdir -p "$keep"
keep=$(realpath "$keep")
need chromium chromium
need node nodejs
need npm npm
cp "$root"/tests/interop/h5web/{package.json,package-lock.json} "$root/tests/interop/report/check.mjs" "$scratch/"
cd "$scratch"
npm ci --no-audit --no-fund --ignore-scripts --loglevel error >npm.log 2>&1 || { tail npm.log >&2; fail "npm cannot install puppeteer-core"; }
data=${AFMID_DATA:-$root/../shared/data}/afm
# NAME CONFIG FILES LEAST_FIGURES
look() {
    "$afmid" run "$root/configs/$2" --set "records.files=['$3']" -o "$1.h5" --cache cache >"$1.log" 2>&1 || { tail "$1.log" >&2; fail "$2 on $1"; }
    "$afmid" report "$1.h5" -o "$keep/$1.html"
    node check.mjs "$keep/$1.html" "$(command -v chromium)" "$4" "$keep/$1.png"
    [ -s "$keep/$1.png" ] || fail "no screenshot of $1"
}
if [ -d "$data" ]; then
    look lever-a free-lever.toml "$data/lever-a/*.h5" 4
    for folder in "$data"/hidden-*/; do
        look "$(basename "$folder")" diagnose.toml "$folder*.h5" 3
    done
else
    echo "SIMULATED: $data is not there"
    for cause in "[]" "[{ cause = 'quadratic-detector', a2 = 0.012 }]"; do
        rm -rf archive
        "$afmid" run "$root/configs/simulate-demo.toml" -o sim.h5 --cache cache --set "archive.out='$scratch/archive'" --set "archive.hidden=$cause" >sim.log 2>&1
        look "simulated-$((count = ${count:-0} + 1))" diagnose.toml "$scratch/archive/*.h5" 3
    done
    look simulated-free free-lever.toml "$scratch/archive/*.h5" 4
fi
