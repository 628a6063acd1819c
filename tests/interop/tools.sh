# What the scripts beside it share: tools from Debian's packages, and a result file to try them on. Wants $root and
# $scratch.
# shellcheck shell=bash

fail() { echo "FAILED: $*" >&2; exit 1; }

# Installs PACKAGE... with apt unless COMMAND is there. A tool that cannot be had is a failure.
need() {
    local command=$1
    shift
    command -v "$command" >/dev/null && return
    echo "installing $*" >&2
    { apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$@"; } >"$scratch/apt.log" 2>&1 ||
        { tail -n 5 "$scratch/apt.log" >&2; fail "$command is missing, and apt cannot install $*"; }
    command -v "$command" >/dev/null || fail "$command is missing though apt installed $*"
}

# Simulates an archive and runs the main job on it: $scratch/a.h5.
make_result() {
    local afmid=$1
    "$afmid" run "$root/configs/simulate-demo.toml" -o "$scratch/sim.h5" --cache "$scratch/cache" --set "archive.out='$scratch/archive'" \
        --set archive.records=6 --set archive.snap_offs=6 --set archive.snap_ins=6 >"$scratch/run.log" 2>&1 &&
        "$afmid" run "$root/configs/free-lever.toml" -o "$scratch/a.h5" --cache "$scratch/cache" --set "records.files=['$scratch/archive/*.h5']" >>"$scratch/run.log" 2>&1 ||
        { tail "$scratch/run.log" >&2; fail "no result to try on"; }
}

# Makes the folder $scratch, which is removed at the end if all went well.
make_scratch() {
    scratch=$(mktemp -d "${TMPDIR:-/tmp}/afmid-$1-XXXXXX")
    trap 'code=$?; if [ $code = 0 ]; then rm -rf "$scratch"; else echo "what was going on lies in $scratch" >&2; fi; exit $code' EXIT
}
