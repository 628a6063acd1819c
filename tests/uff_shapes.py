"""Reads mode shapes that afmid exported with pyuff and compares them with what `afmid show --json` states.

Usage: uff_shapes.py FILE.unv SUMMARY.json
"""

import json
import sys

import numpy as np
import pyuff

# six digits are written
DIGITS = 1e-5


def compared(found, mode, number):
    """One mode: its number, pole and shape."""
    assert (found["analysis_type"], found["data_type"], found["mode_n"]) == (3, 5, number)
    natural = 2 * np.pi * mode["frequency_hz"]
    assert abs(abs(found["eig"]) / natural - 1) < DIGITS
    assert abs(-found["eig"].real / natural / mode["damping_ratio"] - 1) < DIGITS
    # directions are not stated in these records: z
    assert not np.any(found["r1"]) and not np.any(found["r2"])
    shape = np.array([complex(value["re"], value["im"]) for value in mode["shape"]])
    assert np.all(np.abs(found["r3"] - shape) < DIGITS)
    normalised = mode.get("mass_normalised")
    if normalised is None:
        assert found["modal_a"] == 0 and found["modal_b"] == 0
    else:
        mass = found["modal_a"].imag / (2 * found["eig"].imag)
        largest = np.argmax(np.abs(shape))
        assert abs(mass * normalised[largest]["value"] ** 2 - 1) < DIGITS
        assert abs(found["modal_b"] / found["modal_a"] / -found["eig"] - 1) < DIGITS


def main():
    path, summary = sys.argv[1], json.load(open(sys.argv[2], encoding="utf-8"))
    sets = pyuff.UFF(path).read_sets()
    modes = [found for found in sets if found["type"] == 55]
    assert len(modes) == len(summary["modes"])
    for number, (found, mode) in enumerate(zip(modes, summary["modes"]), start=1):
        compared(found, mode, number)
    positions = [point["position_m"] for point in summary.get("points") or []]
    nodes = [found for found in sets if found["type"] == 15]
    if positions and None not in positions:
        assert np.allclose(nodes[0]["x"], positions, rtol=DIGITS)
        assert [int(number) for number in nodes[0]["node_nums"]] == list(modes[0]["node_nums"])
    else:
        assert not nodes
    assert sets[0]["type"] == 151 and sets[0]["program"].startswith("afmid")
    print(f"{len(modes)} modes over {len(modes[0]['node_nums'])} nodes, positions {'known' if nodes else 'not known'}")


if __name__ == "__main__":
    main()
