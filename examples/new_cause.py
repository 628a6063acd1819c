"""A cause of one's own in Python: what `afmid new cause NAME --python` begins with.

    python new_cause.py      # hides it in a simulated recording, and finds it (wanted: pip install afmid)
"""
import afmid
import numpy as np


@afmid.cause(
    parameters={
        # the first is the strength; trials and limits are in units of the largest output
        "stiffness": afmid.Parameter(unit="1", low=0, high=100, trials=(0.05,), meaning="of the stop, over the spring's"),
        "gap": afmid.Parameter(unit="V", low=0, high=1, trials=(0.3, 0.6), meaning="deflection at which it is reached"),
    },
    next_measurement="drive it with less: what stays away from the stop is linear",
)
def new_cause(x, v, stiffness, gap):
    """The motion meets an elastic stop on one side."""
    # x and v = q'/w are whole trajectories of a mode; q'' + (w/Q) q' + w^2 q = w^2 (g u + what is returned)
    return -stiffness * np.maximum(x - gap, 0.0)


def recording(stiffness, gap, samples=4000, rate_hz=1000.0):
    """Input and output of an oscillator of 80 Hz and Q = 10 with the cause in it, in a little noise."""
    rng = np.random.default_rng(1)
    time = np.arange(samples) / rate_hz
    lines = np.arange(10.0, 200.0, 3.7)[:, None]
    u = 0.03 * np.cos(2 * np.pi * (lines * time + rng.uniform(size=lines.shape))).sum(axis=0)
    omega, steps = 2 * np.pi * 80, 64
    step = 1 / rate_hz / steps
    y, x, rate = np.empty(samples), 0.0, 0.0
    for k in range(samples):
        y[k] = x
        for _ in range(steps):
            x += 0.5 * step * rate
            rate += step * omega**2 * (u[k] - x - 0.1 * rate / omega - stiffness * max(x - gap, 0.0))
            x += 0.5 * step * rate
    return u, y + 1e-3 * rng.standard_normal(samples)


def test_it_is_found():
    u, y = recording(stiffness=0.5, gap=0.2)
    found = afmid.diagnose(y, u, sample_rate_hz=1000.0, remove="none", output_unit="V", causes=[new_cause])
    assert found.causes.id[0] == new_cause.id, found.summary()
    value, std = (dict(zip(found.parameters.parameter, found.parameters[of])) for of in ("value", "std"))
    assert abs(value["stiffness"] - 0.5) < 5 * std["stiffness"] + 0.01, found.summary()
    return found


if __name__ == "__main__":
    print(test_it_is_found())
