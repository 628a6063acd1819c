"""Errors, counts and times of a method over the seeds of a case, and the tables of them."""

from dataclasses import dataclass

import numpy as np

from truth import match, modal

NEAR = 0.01  # of a mode's frequency
FACTOR = 2.0  # of its damping
DRAWS = 1000


def errors(found, record):
    """(modes x (frequency, damping): relative errors, not-a-number where a mode is missed; number of poles beyond)."""
    out = np.full((len(record.poles), 2), np.nan)
    found = np.array([], dtype=complex) if found is None else found[found.imag > 0.0]
    true, near = match(found, record.poles)
    relative = np.array(modal(found[near])) / np.array(modal(record.poles[true])) - 1.0
    right = (np.abs(relative[0]) < NEAR) & (relative[1] < FACTOR - 1.0) & (relative[1] > 1.0 / FACTOR - 1.0)
    out[true[right]] = relative.T[right]
    return out, len(found) - right.sum()


@dataclass
class Fits:
    name: str
    setting: str
    relative: np.ndarray  # seeds x modes x (frequency, damping)
    bound: np.ndarray  # likewise
    added: int | None  # poles beyond the modes; None where the truth picks them
    seconds: float  # median
    more: dict  # further times in s

    @classmethod
    def of(cls, name, setting, poles, records, counted, seconds, more):
        pairs = [errors(found, record) for found, record in zip(poles, records)]
        added = int(sum(extra for _, extra in pairs)) if counted else None
        bound = np.array([record.bound for record in records])
        return cls(name, setting, np.array([error for error, _ in pairs]), bound, added, seconds, more)

    @classmethod
    def of_peer(cls, name, setting, found, records, counted):
        seconds = np.median([seconds for seconds, _ in found])
        return cls.of(name, setting, [poles for _, poles in found], records, counted, seconds, {})

    @classmethod
    def of_afmid(cls, given, runs, records):
        poles = []
        for modes, _, _ in runs:
            size = 2.0 * np.pi * modes[:, 0]
            poles.append(size * (-modes[:, 1] + 1j * np.sqrt(1.0 - modes[:, 1] ** 2)))
        more = {step: np.median([seconds[step] for _, seconds, _ in runs]) for step in runs[0][1]}
        more["stages"] = np.median([sum(stages.values()) for _, _, stages in runs])
        fit = lambda stages: stages["model"] if "model" in stages else stages["modes"]
        more["fit"] = np.median([fit(stages) for _, _, stages in runs])
        setting = "number of modes given" if given else "as it comes"
        return cls.of("afmid", setting, poles, records, not given, more["run"], more)

    @property
    def missed(self):
        return int(np.isnan(self.relative[..., 0]).sum())

    def rms(self, over_bound, seeds=slice(None)):
        """(frequency, damping): root mean squares over modes and seeds that are not missed."""
        scores = self.relative / self.bound if over_bound else self.relative
        return np.sqrt(np.nanmean(scores[seeds] ** 2, axis=(0, 1)))

    def worth(self):
        """Order of merit: modes missed, then both errors over the bound."""
        product = np.prod(self.rms(True)) if self.missed < self.bound[..., 0].size else np.inf
        return self.missed, product


def over(ours, theirs):
    """Ratio of the rms errors over the bound, and its standard deviation by a bootstrap over seeds: (2, 2)."""
    rng = np.random.default_rng(1)
    seeds = len(ours.bound)
    draws = [rng.integers(0, seeds, seeds) for _ in range(DRAWS)]
    ratios = np.array([ours.rms(True, draw) / theirs.rms(True, draw) for draw in draws])
    return ours.rms(True) / theirs.rms(True), ratios.std(axis=0)


def row(case, fits, modes):
    ppm, percent = fits.rms(False) * [1e6, 100.0]
    f, damping = fits.rms(True)
    added = "-" if fits.added is None else fits.added
    return (
        f"| {case} | {fits.name} | {fits.setting} | {ppm:.1f} | {percent:.3f} | {f:.2f} | {damping:.2f}"
        f" | {fits.missed}, {added} of {modes} | {1e3 * fits.seconds:.1f} |"
    )


def print_tables(case, fits, everything):
    """One row a method, its best setting; then how afmid stands to each: its run as it comes, and the best settings."""
    own, peers = fits[:2], fits[2:]
    modes = own[0].bound[..., 0].size
    print(
        f"\n| {case} | method | setting | f, ppm | damping, % | f / bound | damping / bound"
        " | missed, added | time, ms |\n|---|---|---|---|---|---|---|---|---|"
    )
    best = [min((f for f in peers if f.name == name), key=Fits.worth) for name in dict.fromkeys(f.name for f in peers)]
    for shown in [*own, *(sorted(peers, key=Fits.worth) if everything else best)]:
        print(row(case, shown, modes), flush=True)
    print("\n| | new, ms | run, ms | show, ms | its stages, ms | the fit's stage, ms |\n|---|---|---|---|---|---|")
    for one in own:
        times = (one.more[step] for step in ("new", "run", "show", "stages", "fit"))
        print(f"| {one.name}, {one.setting} | " + " | ".join(f"{1e3 * seconds:.1f}" for seconds in times) + " |")
    print("\n| afmid, as it comes, over | f | damping | time of the run | time of its fit | of its fit, number given |")
    print("|---|---|---|---|---|---|")
    for theirs in best:
        (f, damping), (f_std, damping_std) = over(own[0], theirs)
        times = (own[0].more["run"], own[0].more["fit"], own[1].more["fit"])
        ratios = " | ".join(f"{seconds / theirs.seconds:.2f}" for seconds in times)
        print(f"| {theirs.name} | {f:.3f} ± {f_std:.3f} | {damping:.3f} ± {damping_std:.3f} | {ratios} |", flush=True)
    return own[0], best


def print_whole(cases, starts):
    """From the start of a program to the modes: afmid's three commands, the others' start, imports and fit."""
    print("\n| case | afmid: new, run and show, ms | " + " | ".join(f"{name}, ms" for name in starts) + " |")
    print("|---" * (2 + len(starts)) + "|")
    for case, (own, best) in cases.items():
        ours = sum(own.more[step] for step in ("new", "run", "show"))
        theirs = (next((f.seconds for f in best if name in f.name), np.nan) + start for name, start in starts.items())
        print(f"| {case} | {1e3 * ours:.0f} | " + " | ".join(f"{1e3 * seconds:.0f}" for seconds in theirs) + " |")
