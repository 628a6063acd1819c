"""afmid, by its command line as a user runs it."""

import json
import subprocess
import time

import h5py
import numpy as np


def write(path, record):
    """A table as a recorder exports it, the numbers as they are."""
    names, columns = ["Time (s)"], [np.arange(record.response.shape[1]) / record.rate_hz]
    if record.force is not None:
        names.append(f"Force ({record.units[0]})")
        columns.append(record.force)
    for number, channel in enumerate(record.response, 1):
        names.append(f"Sensor {number} ({record.units[1]})")
        columns.append(channel)
    np.savetxt(path, np.column_stack(columns), fmt="%.9g", delimiter=",", header=",".join(names), comments="")


def stage_seconds(file):
    """Seconds of each stage by its id, as the result states them."""
    names = file["entry/run/stage"].asstr()[:]
    return dict(zip(names, file["entry/run/stage_seconds"][:]))


def true_number(case, modes):
    """Parameters that tell the program how many modes there are."""
    names = ["model.order", "half.order"] if case == "random input" else ["modes.modes"]
    value = 2 * modes if case == "random input" else modes
    return [part for name in names for part in ("--set", f"{name}={value}")]


def afmid(program, work, case, seed, record, given):
    """(frequencies and dampings, seconds of each command, seconds of each stage).

    Nothing is said of the file but its name: what it holds, where decays begin and how many modes there are is found;
    `given`: how many modes there are is said, as to the peers.
    """
    name = f"{case.replace(' ', '-')}-{seed}-{'given' if given else 'found'}"
    more = true_number(case, len(record.poles)) if given else []
    table, config, result = (work / f"{name}.{end}" for end in ("csv", "toml", "h5"))
    write(table, record)
    commands = {
        "new": ["new", "pipeline", table, "-o", config],
        "run": ["run", config, "-o", result, "--cache", work / "cache", "-j", "1", *more],
        "show": ["show", result, "modes", "--json"],
    }
    seconds = {}
    for step, arguments in commands.items():
        started = time.perf_counter()
        done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
        seconds[step] = time.perf_counter() - started
        if done.returncode:
            raise RuntimeError(f"afmid {step}, {name}: {done.stderr}")
    modes = json.loads(done.stdout)["modes"]
    found = np.array([[mode["frequency_hz"], mode["damping_ratio"]] for mode in modes]).reshape(-1, 2)
    with h5py.File(result) as file:
        stages = stage_seconds(file)
    return found, seconds, stages
