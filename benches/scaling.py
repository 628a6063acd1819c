#!/usr/bin/env python3
"""Times commands of afmid at several numbers of items, and prints how the time grows.

    benches/scaling.py [target/release/afmid] [MOST] [WORD...]

Makes small raw records, stages and ledgers in a temporary folder with Python's standard library alone, for the commands
whose line holds one of the words. Of each command the shortest of several runs counts, once the files are 2.5 s old:
until they took 2 s together, three at least. The exponent is the slope of log(time) over log(items); the second one
that of what the items add (log(time without that of a job of one item), from the second smallest size on).
`find -size +1M` on the same folders tells what the system itself takes to look at each file: more files than the
processor's caches hold cost more each.
"""

import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time

PROGRAM = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else "target/release/afmid")
MOST = int(sys.argv[2]) if len(sys.argv) > 2 else 32000
WORDS = sys.argv[3:]
SIZES = [size for size in (1000, 2000, 4000, 8000, 16000, 32000, 64000, 128000) if size <= MOST]
HEAD = '[pipeline]\nname = "a"\nseed = 1\n'
RAW = 'format = "raw", raw = { sample = "int16" }, channel = "/channel[0]", sample_rate_hz = 1e6, unit = "V"'
CENSUS = '[[stage]]\nid = "census"\nuses = "io.census"\ninputs = { records = "records.records" }\n'
CACHE = ["--cache", "cache"]


def write(folder, name, text):
    path = os.path.join(folder, name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def raw_records(folder, count):
    os.makedirs(os.path.join(folder, "raw"))
    for number in range(count):
        with open(os.path.join(folder, f"raw/r{number}.bin"), "wb") as file:
            file.write(number.to_bytes(4, "little") * 4)


def records(folder, count):
    raw_records(folder, count)
    stage = f'[[stage]]\nid = "records"\nuses = "io.records"\nparams = {{ files = ["raw/*.bin"], {RAW} }}\n'
    write(folder, "a.toml", HEAD + stage + CENSUS)


def stages(folder, count):
    source = '[[stage]]\nid = "r"\nuses = "io.records"\nparams = { files = ["x"] }\n'
    wired = '[[stage]]\nid = "c{}"\nuses = "io.census"\ninputs = {{ records = "r.records" }}\n'
    write(folder, "a.toml", HEAD + source + "".join(wired.format(n) for n in range(count)))


def faulty(folder, count):
    wired = '[[stage]]\nid = "c{}"\nuses = "io.census"\ninputs = {{ records = "no{}" }}\n'
    write(folder, "a.toml", HEAD + "".join(wired.format(n, n) for n in range(count)))


def stock(folder, count):
    stages(folder, 1)
    for number in range(count):
        key = f"{number:064x}"
        write(folder, f"cache/{key}.h5", "x")
        write(folder, f"cache/{key}.json", "{}")


def data_sets(folder, count):
    raw_records(folder, count)
    stage = f'[[stage]]\nid = "records"\nuses = "io.records"\nparams = {{ files = ["raw/r0.bin"], {RAW} }}\n'
    write(folder, "a.toml", HEAD + stage + CENSUS)
    lines = (
        json.dumps({"name": f"s{n}", "files": [os.path.join(folder, f"raw/r{n}.bin")]}) + "\n" for n in range(count)
    )
    write(folder, "sets.jsonl", "".join(lines))


BATCH = ["batch", "a.toml", "--manifest", "sets.jsonl", "-o", "out", *CACHE]
FIND = ["find", ".", "-type", "f", "-size", "+1M"]
# what makes the items, the most of them, and in this order in one folder: a name, the command, its least number of runs
CASES = [
    (records, MOST, [
        ("explain, files of one pattern", ["explain", "a.toml", *CACHE], 3),
        ("find, the same files", FIND, 3),
        ("run, files of one pattern, two stages", ["run", "a.toml", "-o", "a.h5", *CACHE], 3),
    ]),
    # beyond, a config is larger than those that are read
    (stages, min(MOST, 64000), [("check, right stages", ["check", "a.toml"], 3)]),
    (faulty, min(MOST, 64000), [("check, faulty stages", ["check", "a.toml"], 3)]),
    (stock, MOST, [
        ("gc, results", ["gc", "--dry-run", "--older-than", "1d", *CACHE], 3),
        ("find, the same files", FIND, 3),
    ]),
    # writes and syncs a result for each
    (data_sets, min(MOST, 32000), [
        ("batch, first, data sets", BATCH, 1),
        ("batch again, every data set in its ledger", BATCH, 3),
        ("batch --collect", [*BATCH, "--collect"], 3),
    ]),
]


def run(folder, arguments):
    clock = time.monotonic()
    command = arguments if arguments[0] == "find" else [PROGRAM, *arguments]
    ended = subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seconds = time.monotonic() - clock
    if ended.returncode not in (0, 2, 3):
        sys.exit(f"{command}: exit code {ended.returncode}")
    return seconds


def measured(make, commands, count):
    """The shortest time of each command on this many items, in s."""
    folder = tempfile.mkdtemp(prefix="afmid-scaling-")
    try:
        make(folder, count)
        # hashes of files that were changed less than 2 s ago are not remembered
        time.sleep(2.5)
        return [shortest(folder, arguments, runs) for _, arguments, runs in commands]
    finally:
        shutil.rmtree(folder)


def shortest(folder, arguments, runs):
    times = [run(folder, arguments) for _ in range(runs)]
    while runs > 1 and sum(times) < 2 and len(times) < 50:
        times.append(run(folder, arguments))
    return min(times)


def slope(points):
    if len(points) < 2:
        return math.nan
    xs, ys = [math.log(x) for x, _ in points], [math.log(y) for _, y in points]
    mean_x, mean_y = sum(xs) / len(xs), sum(ys) / len(ys)
    spread = sum((x - mean_x) ** 2 for x in xs)
    return sum((x - mean_x) * (y - mean_y) for x, y in zip(xs, ys)) / spread


def main():
    print("| command, items | " + " | ".join(map(str, SIZES)) + " | exponent | of what the items add |")
    print("|---|" + "---|" * (len(SIZES) + 2))
    for make, most, commands in CASES:
        if WORDS and not any(word in name for word in WORDS for name, _, _ in commands):
            continue
        sizes = [size for size in SIZES if size <= most]
        one = measured(make, commands, 1)
        by_size = [measured(make, commands, size) for size in sizes]
        for (name, _, _), empty, times in zip(commands, one, zip(*by_size)):
            whole = slope(list(zip(sizes, times)))
            added = slope([(size, max(seconds - empty, 1e-4)) for size, seconds in zip(sizes, times)][1:])
            cells = [f"{seconds:.3f}" for seconds in times] + ["-"] * (len(SIZES) - len(sizes))
            print(f"| {name} | " + " | ".join(cells) + f" | {whole:.2f} | {added:.2f} |", flush=True)


main()
