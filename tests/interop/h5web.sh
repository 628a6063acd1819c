#!/bin/bash
# H5Web in headless Chromium shows the default plot of a result file.
#
#   tests/interop/h5web.sh AFMID [RESULT.h5]
#
# (installs chromium, nodejs and npm with apt where they are missing, H5Web from registry.npmjs.org)
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
afmid=$(realpath "$1")
. "$root/tests/interop/tools.sh"
make_scratch h5web
need chromium chromium
need node nodejs
need npm npm
if [ -n "${2:-}" ]; then cp "$2" "$scratch/a.h5"; else make_result "$afmid"; fi
cp "$root"/tests/interop/h5web/{package.json,package-lock.json,page.jsx,check.mjs} "$scratch/"
cd "$scratch"
# as the lock file says, outside the tree; scripts of packages are not run
npm ci --no-audit --no-fund --ignore-scripts --loglevel error >npm.log 2>&1 || { tail npm.log >&2; fail "npm cannot install H5Web"; }
node check.mjs a.h5 "$(command -v chromium)" "NX Line" "transfer function of the model (magnitude)" "frequency" --screenshot plot.png
[ -s plot.png ] || fail "no screenshot"
