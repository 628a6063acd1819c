#!/usr/bin/env python3
"""Times from file to answer of a long table: a lag of 1 s under steps and noise, sampled at 10 kHz.

    benches/lag.py ROWS PROGRAM [PROGRAM...]

Makes the table with Python's standard library alone, then runs `new pipeline` and `run` of each program in turn, each
with a cache of its own, and prints wall time in seconds and peak memory in MB.
"""

import os
import random
import resource
import subprocess
import sys
import tempfile
import time

RATE_HZ = 1e4
LAG_S = 1.0
ROUNDS = 3


def table(path: str, rows: int) -> None:
    """Input: steps of half a second to four, and noise; output: the lag's, with noise."""
    draw = random.Random(1)
    keep = 1.0 - 1.0 / (LAG_S * RATE_HZ)
    level, state, left = 0.0, 0.0, 0
    with open(path, "w", encoding="ascii") as out:
        out.write("u (V),y (V)\n")
        for _ in range(rows):
            if left == 0:
                level, left = draw.choice((-1.0, 1.0)), draw.randrange(int(0.5 * RATE_HZ), int(4 * RATE_HZ))
            left -= 1
            u = level + draw.gauss(0.0, 0.1)
            out.write(f"{u:.6g},{state + draw.gauss(0.0, 0.01):.6g}\n")
            state = keep * state + (1.0 - keep) * u


def timed(command: list[str]) -> tuple[float, float]:
    """Wall time in seconds and peak memory in MB of a command that has to succeed."""
    begun = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = child.stderr.read() if child.stderr else b""
    _, status, used = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"{' '.join(command)}\n{said.decode(errors='replace')}")
    return time.perf_counter() - begun, used.ru_maxrss / 1024.0


def main() -> None:
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    programs = [os.path.abspath(program) for program in sys.argv[2:]]
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        table("lag.csv", int(sys.argv[1]))
        for number in range(ROUNDS):
            for program in programs:
                config = f"{number}-{programs.index(program)}.toml"
                new = timed(
                    [program, "new", "pipeline", "lag.csv", "--rate", str(RATE_HZ), "--input", "u", "-o", config]
                )
                run = timed([program, "run", config, "-o", config + ".h5", "--cache", config + ".cache"])
                print(f"{program}: new pipeline {new[0]:.2f} s, run {run[0]:.2f} s and {run[1]:.0f} MB", flush=True)


if __name__ == "__main__":
    main()
