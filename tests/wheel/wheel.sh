#!/usr/bin/env bash
# Usage: wheel.sh WHEEL PYTHON. Installs the wheel into an empty environment whose PATH holds Python alone, no compiler and no cargo; runs
# what python/afmid/README.md shows there, the package's tests and its examples.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
wheel=$(realpath "$1")
python=$2
work=$(mktemp -d)
rm=$(command -v rm)
trap '"$rm" -rf "$work"' EXIT
cd "$work"
"$python" -m venv empty
export PATH="$work/empty/bin"
export PYTHONDONTWRITEBYTECODE=1
for tool in cc gcc cargo rustc; do
    if command -v "$tool"; then echo "$tool is still there"; exit 1; fi
done
# versions of the other readers: the same every day, and loaded once
pins=(-c "$root/tests/requirements.txt")
python -m pip install --quiet --disable-pip-version-check "${pins[@]}" "$wheel[plot,scipy,control]"
echo "== the first lines of the README"
python "$root/tests/wheel/readme_lines.py" "$root/python/afmid/README.md" ringdown pem frf thermal_fit diagnose read >lines.py
python lines.py
afmid --version
echo "== tests and examples"
python -m pip install --quiet --disable-pip-version-check "${pins[@]}" pytest -r "$root/tests/wheel/checks.txt"
python -m pytest -q -p no:cacheprovider "$root/tests/wheel"
examples=(arrays_at_hand artifacts decays densities diagnosed_model diagnoses estimate formula identification numbers own_causes
    own_stages pairs rational reading response_modes responses running smoothed thermal)
examples=("${examples[@]/#/afmid.}")
python -m pytest -q -p no:cacheprovider --doctest-modules --pyargs "${examples[@]}"
