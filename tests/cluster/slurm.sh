#!/bin/bash
# A batch on a real Slurm of two emulated nodes, one of which is lost on the way; needs root, and apt where Slurm and
# munge are missing.
#
#   tests/cluster/slurm.sh [AFMID] [SNAKEMAKE]
#
# (target/debug/afmid; SNAKEMAKE: also workflow/Snakefile on the same Slurm)
#
# Shown, else it fails: shards on both nodes; one bad data set, reported with its reason; the lost node's shard finished
# by the other, both when the node is gone and when it was only out of reach and works on at the same time; the table,
# and every number of every result, those of one machine.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
afmid=$(realpath "${1:-$root/target/debug/afmid}")
snakemake=${2:+$(realpath -s "$2")}
sets=24 shards=6 bad=lever-13
. "$root/tests/cluster/nodes.sh"

fail() { echo "FAILED: $*" >&2; exit 1; }
[ "$(id -u)" = 0 ] || fail "starting Slurm's daemons needs root"
[ -x "$afmid" ] || fail "$afmid is not built"

scratch=$(mktemp -d "${TMPDIR:-/tmp}/afmid-cluster-XXXXXX")
chmod 755 "$scratch"
ended() {
    local code=$?
    set +e
    cluster_down
    if [ "$code" = 0 ]; then rm -rf "$scratch"; else echo "what was going on lies in $scratch" >&2; fi
    exit "$code"
}
trap ended EXIT
trap 'exit 130' INT TERM
cluster_install "$scratch/apt.log" || fail "no Slurm"
cluster_up "$scratch/cluster" || fail "no cluster"

# a folder whose name means something to shells and to Slurm
here="$scratch/it's 100% \"real\" \$here; #1 %j"
mkdir "$here"
cd "$here"
config=$root/configs/ringdown.toml
# an unknown number of modes is to be found: that takes a second per data set
changes=(--set 'modes.modes="auto"')

echo "making $sets data sets" >&2
for i in $(seq -w "$sets"); do
    echo "$i"
done | xargs -P "$(nproc)" -I{} "$afmid" run "$root/configs/simulate-demo.toml" -o "$scratch/sim-{}.h5" --cache "$scratch/sim" \
    --set "archive.out='$scratch/sets/lever-{}'" --set archive.records=2 --set archive.snap_offs=2 --set archive.snap_ins=2 \
    --set archive.samples=450000 --set "archive.seed=1{}" >"$scratch/sim.log" 2>&1 || { tail "$scratch/sim.log" >&2; fail "no data sets"; }
mv "$scratch/sets" sets
truncate -s 100K "sets/$bad/record_0001.h5"
for i in $(seq -w "$sets"); do
    echo "{\"name\": \"lever-$i\", \"files\": [\"sets/lever-$i/*.h5\"]}"
done >levers.jsonl

echo "one machine" >&2
code=0
"$afmid" batch "$config" --manifest levers.jsonl -o whole --cache "$scratch/cache-whole" "${changes[@]}" 2>"$scratch/whole.log" >&2 || code=$?
[ "$code" = 3 ] || fail "the batch on one machine ended with $code, wanted 3: one data set is bad"

# Everything that is found in folder $1 is what one machine found.
same_as_whole() {
    local table result
    for table in summary.csv summary.parquet summary.h5 trends.csv; do
        cmp "whole/$table" "$1/$table" || fail "$table is not that of one machine"
    done
    [ "$(ls "$1"/*.h5 | wc -l)" = "$sets" ] || fail "there are not $((sets - 1)) results and a table in $1"
    for result in whole/lever-*.h5; do
        "$afmid" diff "$result" "$1/${result#whole/}" --json | grep -q '"results_equal": true' || fail "$result differs"
    done
    python3 - "$1/ledger" "$bad" "$sets" <<'P' || fail "the ledger is not whole"
import json, pathlib, sys
folder, bad, sets = pathlib.Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
entries = {path.stem: json.loads(path.read_text()) for path in folder.glob("*.json")}
failed = [name for name, entry in entries.items() if entry["error"] is not None]
assert len(entries) == sets and failed == [bad], (len(entries), failed)
assert "record_0001.h5" in entries[bad]["error"], entries[bad]
print("reason in the ledger:", entries[bad]["error"].split(" (help")[0].replace(sys.argv[1], "")[-160:])
P
    ls -A "$1" "$1/ledger" | grep -q '\.tmp$' && fail "temporary files are left in $1"
    return 0
}

task_log() { echo "$1/slurm/log/${array}_$2.log"; }

# Shards of folder $1 that node $2 finished.
finished() { grep -l "attempt 1, node $2" "$1"/slurm/log/"$array"_*.log 2>/dev/null | tr '\n' '\0' | xargs -0r grep -l "data sets\? in" | wc -l; }

# Waits until node n2 has finished a shard of folder $1 and is in the middle of another one, prints its number.
midway() {
    local try task log
    for try in $(seq 1500); do
        task=$(squeue -h -t R -w n2 -o %K)
        log=$(task_log "$1" "$task")
        # at least one data set of it is finished, and two are not
        if [ "$(finished "$1" n2)" -ge 1 ] && [ -n "$task" ] && [ -f "$log" ] && grep -q ": done," "$log" && [ "$(grep -c ": done,\|: failed," "$log")" -le "$((members[task] - 2))" ]; then
            echo "$task"
            return 0
        fi
        sleep 0.1
    done
    return 1
}

# One submission to folder $1, in the course of which n2 is lost: `gone`, or `frozen`, out of reach until its shard runs
# elsewhere.
submitted() {
    local folder=$1 how=$2 sent clock=$SECONDS lost frozen on_n2 count log collect
    sinfo -h -n n2 -o %t | grep -q idle || { slurmd -N n2; until sinfo -h -n n2 -o %t | grep -q idle; do sleep 0.5; done; }
    sent=$("$afmid" submit slurm "$config" --manifest levers.jsonl --shards "$shards" -o "$folder" --cache "$scratch/cache-$how" --time 20 --partition main \
        --sbatch "--comment=it's a \ # 'comment'" --send --json "${changes[@]}")
    array=$(sed -n 's/.*"array": "\(.*\)".*/\1/p' <<<"$sent") collect=$(sed -n 's/.*"collect": "\(.*\)".*/\1/p' <<<"$sent")
    scontrol show job "$collect" | grep -qF "Comment=it's a \\ # 'comment'" || fail "an option did not arrive as it was"
    lost=$(midway "$folder") || fail "n2 never was in the middle of a second shard"
    on_n2=$(finished "$folder" n2)
    if [ "$how" = gone ]; then
        node_kill n2
    else
        frozen=$(node_tasks n2)
        kill -9 "$(cat "$CLUSTER/slurmd-n2.pid")"
        kill -STOP $frozen
    fi
    grep -q "data sets\? in" "$(task_log "$folder" "$lost")" && fail "shard $lost ended before its node was lost"
    echo "n2 lost ($how) in the middle of shard $lost, $((SECONDS - clock)) s after submission" >&2
    if [ "$how" = frozen ]; then
        until grep -q "attempt 2, node n1" "$(task_log "$folder" "$lost")"; do
            [ "$((SECONDS - clock))" -lt 300 ] || fail "shard $lost is not run again"
            sleep 0.1
        done
        kill -CONT $frozen
        echo "shard $lost runs twice at once" >&2
    fi
    while [ -n "$(squeue -h)" ]; do
        [ "$((SECONDS - clock))" -lt 600 ] || { squeue >&2; fail "the jobs do not end"; }
        sleep 0.5
    done
    echo "shards finished at the first attempt: $(finished "$folder" n1) by n1, $on_n2 by n2"
    grep -q "attempt 2, node n1" "$(task_log "$folder" "$lost")" || fail "shard $lost was not finished by n1"
    [ "$(grep -h "attempt 2" "$folder"/slurm/log/"$array"_*.log | wc -l)" = 1 ] || fail "shards of nodes that were not lost ran again"
    log=$(scontrol show job "$array")
    grep -q "JobState=" <<<"$log" && ! grep "JobState=" <<<"$log" | grep -qv "JobState=COMPLETED" || fail "not all tasks are completed"
    scontrol show job "$collect" | grep -q "ExitCode=3:0" || fail "the collecting job did not end with 3"
    grep -q "$bad failed:" "$folder/slurm/log/${collect}_collect.log" || fail "the bad data set is not reported"
    if [ "$how" = frozen ]; then
        # the first attempt ends by itself; what it still writes changes nothing
        while [ -n "$(node_tasks n2)" ]; do sleep 0.2; done
        count=$(grep -c "data sets\? in" "$(task_log "$folder" "$lost")")
        [ "$count" = 2 ] || fail "shard $lost ended $count times, wanted twice"
    fi
    same_as_whole "$folder"
    echo "n2 $how: shard $lost of $shards finished by n1; $sets data sets, $bad failed; tables and results are those of one machine; $((SECONDS - clock)) s"
}

# how many data sets are in each shard, by a dry run of the same split
declare -a members
for task in $(seq "$shards"); do
    members[$task]=$("$afmid" batch "$config" --manifest levers.jsonl --shard "$task/$shards" -o whole --cache "$scratch/cache-whole" "${changes[@]}" --json 2>/dev/null |
        sed -n 's/.*"data_sets": \([0-9]*\).*/\1/p') || true
done
echo "data sets in the shards: ${members[*]}"

submitted "results gone" gone
submitted "results frozen" frozen

if [ -n "$snakemake" ]; then
    sinfo -h -n n2 -o %t | grep -q idle || { slurmd -N n2; until sinfo -h -n n2 -o %t | grep -q idle; do sleep 0.5; done; }
    clock=$SECONDS
    # Snakemake's plugin cannot name its logs in a folder with `%j`, and takes SLURM_CONF from the jobs
    mkdir "$scratch/workflow" "$scratch/bin"
    printf '#!/bin/sh\nSLURM_CONF=%s exec %s "$@"\n' "$SLURM_CONF" "$(command -v srun)" >"$scratch/bin/srun"
    chmod +x "$scratch/bin/srun"
    cp "results gone/slurm/manifest.jsonl" "$scratch/workflow/levers.jsonl"
    cat >"$scratch/workflow/values.yaml" <<Y
config: $config
manifest: levers.jsonl
out: results
shards: $shards
afmid: $afmid
cache: $scratch/cache-workflow
set:
  - 'modes.modes="auto"'
Y
    (cd "$scratch/workflow" && PATH=$scratch/bin:$PATH "$snakemake" -s "$root/workflow/Snakefile" --configfile values.yaml --executor slurm --jobs 4 \
        --slurm-status-command squeue --slurm-no-account --slurm-init-seconds-before-status-checks 2 --latency-wait 10 \
        --default-resources slurm_partition=main mem_mb=100 runtime=20) >"$scratch/workflow.log" 2>&1 || { tail -30 "$scratch/workflow.log" >&2; fail "Snakemake"; }
    cp -r "$scratch/workflow/results" results-workflow
    rm -rf results-workflow/workflow
    same_as_whole results-workflow
    echo "workflow/Snakefile on Slurm: the same, $((SECONDS - clock)) s"
fi
echo "ok"
