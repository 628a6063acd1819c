#!/bin/bash
# workflow/Snakefile with Snakemake's local executor: the table of one machine, a second run that does nothing, errors
# in one line.
#
#   tests/cluster/workflow.sh AFMID SNAKEMAKE
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
afmid=$(realpath "$1")
snakemake=$(realpath -s "$2")
fail() { echo "FAILED: $*" >&2; exit 1; }

scratch=$(mktemp -d "${TMPDIR:-/tmp}/afmid-workflow-XXXXXX")
trap 'code=$?; if [ $code = 0 ]; then rm -rf "$scratch"; else echo "what was going on lies in $scratch" >&2; fi; exit $code' EXIT
here="$scratch/it's \"here\" & \$there"
mkdir "$here"
cd "$here"
config=$root/configs/ringdown.toml
for i in 1 2 3 4; do
    "$afmid" run "$root/configs/simulate-demo.toml" -o "$scratch/sim.h5" --cache "$scratch/sim" --set "archive.out='$scratch/lever-$i'" --set archive.records=2 \
        --set archive.snap_offs=2 --set archive.snap_ins=2 --set archive.samples=450000 --set "archive.seed=$i" >"$scratch/sim.log" 2>&1 || fail "no data sets"
    echo "{\"name\": \"lever $i\", \"files\": [\"$scratch/lever-$i\"]}"
done >levers.jsonl
echo '{"name": "missing", "files": ["nowhere/*.h5"]}' >>levers.jsonl
set='events.window_samples=4096'
code=0
"$afmid" batch "$config" --manifest levers.jsonl -o whole --cache "$scratch/cache" --set "$set" >/dev/null 2>&1 || code=$?
[ "$code" = 3 ] || fail "the batch ended with $code, wanted 3: one data set is missing"

workflow() {
    "$snakemake" -s "$root/workflow/Snakefile" --cores 2 --config "$@" >"$scratch/log" 2>&1
}
values=("config=$config" manifest=levers.jsonl "out=out of it" shards=3 "afmid=$afmid" "cache=$scratch/other" "set=[\"$set\"]")
workflow "${values[@]}" || { tail -30 "$scratch/log" >&2; fail "Snakemake"; }
grep -q "5 data sets, 1 failed" "$scratch/log" && grep -q "missing failed: " "$scratch/log" || fail "the missing data set is not reported"
for table in summary.csv summary.parquet summary.h5 trends.csv; do
    cmp "whole/$table" "out of it/$table" || fail "$table is not that of one machine"
done
workflow "${values[@]}" && grep -q "Nothing to be done" "$scratch/log" || fail "a second run does something"
workflow "${values[@]}" shard=4 && fail "a misspelt value is taken"
grep -q '`shard` is not known' "$scratch/log" || fail "a misspelt value is not reported"
echo "workflow/Snakefile: 5 data sets in 3 shards, 1 failed; tables are those of one machine"
