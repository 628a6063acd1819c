#!/usr/bin/env bash
# Runs fuzz targets, one after the other, and prints a table: fuzz/run.sh SECONDS [TARGET...] (`make fuzz` installs cargo-fuzz before).
# New inputs go to fuzz/found, findings to fuzz/artifacts; neither is kept in the project. Exit code 1: something was found.
# A finding is made small with `AFMID_ENTRANCE=TARGET RUSTC_BOOTSTRAP=1 cargo fuzz tmin --fuzz-dir fuzz entrance FILE`, and goes to fuzz/corpus/TARGET under a name that says what
# it is, with the mending: `cargo test --test integrity corpus` replays it ever after.
set -euo pipefail
cd "$(dirname "$0")/.."

# the promise: 5 s and 512 MB for any file
limit_s=5
limit_mb=512

seconds=${1:?how many seconds a target runs}
shift
if ! command -v c++ >/dev/null; then
    echo "make fuzz needs a C++ compiler, which builds libFuzzer: install g++ (apt-get install g++)" >&2
    exit 2
fi
if [ $# -eq 0 ]; then
    for target in fuzz/corpus/*; do set -- "$@" "$(basename "$target")"; done
fi
host=$(rustc -vV | sed -n 's/^host: //p')
# cargo-fuzz asks for flags of the nightly toolchain, which this one has under lock
RUSTC_BOOTSTRAP=1 PATH="$PWD/.tools/cargo-fuzz/bin:$PATH" cargo fuzz build --fuzz-dir fuzz --target "$host"

scratch=$(TMPDIR=$([ -w /dev/shm ] && echo /dev/shm || echo "${TMPDIR:-/tmp}") mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export TMPDIR=$scratch
# freed memory would otherwise be kept back for long and count against the limit
# (a request for more than there can be is answered as by any allocator: with nothing)
export ASAN_OPTIONS=allocator_may_return_null=1:quarantine_size_mb=16:allocator_release_to_os_interval_ms=500

# what the HDF5 library leaks on damaged files, each with its reason
export LSAN_OPTIONS=suppressions=$PWD/fuzz/leaks.txt:print_suppressions=0

status=0
printf '%-14s %12s %10s %8s %8s %8s %8s\n' target executions coverage crashes leaks "time-outs" memory
for target in "$@"; do
    mkdir -p "fuzz/found/$target" "fuzz/artifacts/$target"
    # the HDF5 library asks for what a file states and gives it back untouched where the file is too short: there the memory that is used counts alone
    asked_mb=$limit_mb
    case $target in native_record | foreign_hdf5 | inspect | stage_file | result_file) asked_mb=2000000000 ;; esac
    log=$scratch/$target.log
    code=0
    AFMID_ENTRANCE=$target "fuzz/target/$host/release/entrance" -max_total_time="$seconds" -timeout=$limit_s -rss_limit_mb=$limit_mb -malloc_limit_mb=$asked_mb \
        -max_len=65536 -print_final_stats=1 -print_funcs=0 -artifact_prefix="fuzz/artifacts/$target/" "fuzz/found/$target" "fuzz/corpus/$target" >"$log" 2>&1 || code=$?
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -1)
    coverage=$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$log" | tail -1)
    found() { grep -c "$1" "$log" || true; }
    leaks=$(found 'ERROR: LeakSanitizer')
    late=$(found 'ERROR: libFuzzer: timeout')
    memory=$(found 'ERROR: libFuzzer: out-of-memory')
    crashes=0
    if [ $code -ne 0 ]; then
        status=1
        if [ $((leaks + late + memory)) -eq 0 ]; then crashes=1; fi
        cp "$log" "fuzz/artifacts/$target/log"
    fi
    printf '%-14s %12s %10s %8s %8s %8s %8s\n' "$target" "${executions:--}" "${coverage:--}" "$crashes" "$leaks" "$late" "$memory"
    if [ $code -ne 0 ]; then
        sed -n -e "s/^thread .* panicked at /    /p" -e 's/^\(==.*ERROR: .*\)/    \1/p' -e 's/.*Test unit written to /    /p' "$log" | head -5
    fi
done
exit $status
