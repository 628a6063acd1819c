"""Subspace identification: pyOMA2's SSI in this process, `moen4` (SLICOT) in Octave."""

import subprocess
import tempfile

import numpy as np

ENOUGH = 120  # samples after a hit's largest force from which the response is taken as free: 29 ms


def free_part(record):
    """Free decays, samples x channels: of hits each is a channel of its own, as they share their poles."""
    if record.force is None:
        return record.response[:, record.starts[0] :].T
    length = min(*np.diff(record.starts), len(record.force) - record.starts[-1]) - ENOUGH - 60
    return np.array([record.response[0, at + ENOUGH : at + ENOUGH + length] for at in record.starts]).T


def ssi(record, method, rows, order, modes):
    """`method`: "cov" and "dat" see outputs alone, "IOcov" the force as well. `order`: 0 for the true one."""
    from pyoma2.algorithms import SSI
    from pyoma2.setup import SingleSetup

    order = order or 2 * modes
    with_force = method == "IOcov"
    data = record.response.T if with_force else free_part(record)
    force = {"U": record.force[:, None]} if with_force else {}
    # none of the criteria that refuse poles: with them more modes are missed
    limits = {"xi_max": 0.2, "mpc_lim": None, "mpd_lim": None, "CoV_max": None}
    setup = SingleSetup(data, fs=record.rate_hz)
    setup.add_algorithms(SSI(name="ssi", method=method, br=rows, ordmax=order, step=2, hc=limits, **force))
    setup.run_by_name("ssi")
    poles = np.ravel(setup["ssi"].result.Lambds[:, -1])
    return poles[np.isfinite(poles) & (poles.imag > 0.0)]


OCTAVE = """
pkg load control
files = {%s};
for i = [1, 1:numel(files)]
  d = load(files{i}); dat = iddata(d(:, 2:end), d(:, 1), 1 / %.17g);
  tic; sys = moen4(dat, %d, "s", %d, "noiseinput", "none"); t = toc;
  z = eig(sys.a);
  printf("fit %%.9g", t); printf(" %%.17g", [real(z).'; imag(z).']); printf("\\n"); fflush(stdout);
end
"""


def with_force(record, rows):
    """Force and response over the record; the force of a decay is a pulse at its first sample, after rest."""
    if record.force is not None:
        return np.column_stack([record.force, record.response.T])
    rest = np.zeros((2 * rows, len(record.response)))
    y = np.vstack([rest, record.response[:, record.starts[0] :].T])
    return np.column_stack([np.arange(len(y)) == 2 * rows, y])


def moen4(records, rows, order, modes):
    """(seconds, poles) of each record, after one fit to warm up."""
    with tempfile.TemporaryDirectory() as folder:
        names = []
        for i, record in enumerate(records):
            names.append(f'"{folder}/{i}"')
            np.savetxt(f"{folder}/{i}", with_force(record, rows), fmt="%.17e")
        script = OCTAVE % (", ".join(names), records[0].rate_hz, order or 2 * modes, rows)
        command = ["octave-cli", "--no-init-file", "--no-history", "--quiet", "--eval", script]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("fit ")]
    if len(lines) != len(records) + 1:
        raise RuntimeError(done.stderr)
    out = []
    for seconds, *parts in lines[1:]:
        z = np.array(parts[::2], dtype=float) + 1j * np.array(parts[1::2], dtype=float)
        out.append((float(seconds), np.log(z[z.imag > 0.0]) * records[0].rate_hz))
    return out
