"""Modes from free decays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pandas as pd
import xarray as xr

from . import _native, artifacts
from .arrays_at_hand import labelled, names, rate, records
from .errors import DataError
from .estimate import ModalEstimate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Ringdown(ModalEstimate):
    """Modes of free decays, as `afmid.ringdown` returns them.

    `details`: numbers of modes that were tried, exponentials that are no modes and why, noise of each channel, ...
    """

    hits: pd.DataFrame
    """Amplitude and phase of each mode in each hit."""
    course: pd.DataFrame
    """Each mode in the first and in the last part of the decays, or at twelve amplitudes where it follows laws of them."""
    residuals: xr.Dataset
    """The largest hit as measured, as fitted, and what is left, over channel and time."""
    events: pd.DataFrame | None
    """Where decays were found, and what was refused; None where they were given."""

    def plot(self, figure: Figure | None = None) -> Figure:
        """Measured, fitted and what is left of the largest hit, a row of axes per channel. Needs matplotlib."""
        from .figures import decay

        return decay(self.residuals, figure)


def free_decays(
    y: Any,
    rate_hz: float,
    axes: str | None,
    begin: str | int,
    channels: Sequence[str] | None,
    units: str | Sequence[str] | None,
) -> tuple[Any, pd.DataFrame | None, list[str]]:
    """The decays in records, where they were found, and what is to be said of them; `begin`: see `ringdown`."""
    y, axes, labels = labelled(y, axes)
    found = records(y, axes)
    channels = channels or labels
    named = names(channels, units, len(found[0]), "channel")
    if begin == "auto":
        searched, said = artifacts.run_stage("events.decay", {"records": _native.recording(found, named, rate_hz)})
        return searched["decays"], artifacts.table(searched["events"]), said
    if begin == 0:
        return _native.decays(found, named, rate_hz), None, []
    raise DataError(f'begin is {begin!r}, wanted "auto" or 0')


def ringdown(
    y: Any,
    *,
    sample_rate_hz: float,
    axes: str | None = None,
    channels: Sequence[str] | None = None,
    units: str | Sequence[str] | None = None,
    begin: str | int = "auto",
    modes: str | int = "auto",
    max_modes: int = 12,
    noise: str = "estimated",
    part: str = "auto",
    drift: bool = True,
    false_alarm: float = 1e-3,
    least_quality_factor: float = 0.5005,
) -> Ringdown:
    """Modes of free decays: frequencies, quality factors, shapes, each with its standard error.

    The same numbers as the stages `events.decay` and `model.decay` of the program give for the same samples.

    Parameters
    ----------
    y : array_like
        (samples,), (hits, samples) or (channels, samples) with `axes`, or (hits, channels, samples); a list where hits
        have unlike lengths. A DataFrame has a channel in every column; of a DataArray the names `hit`, `channel` and
        any third say which axis is which. NaN, or the mask of a masked array, marks missing samples where `begin` is 0.
    sample_rate_hz : float
        Samples per second.
    axes : {"hits", "channels"}, optional
        What the first of two axes counts, where no name says it.
    channels : sequence of str, optional
        Names of the channels.
    units : str or sequence of str, optional
        Unit of all channels, or of each.
    begin : "auto" or 0
        "auto" finds the decays in each record: hits, releases, where they drown in the noise. 0 takes each record for
        a decay from its first sample on.
    modes : "auto" or int
        How many; "auto" takes as many up to `max_modes` as the data show.
    max_modes : int
        Largest number that "auto" tries.
    noise : {"estimated", "white"}
        Noise beside the ringing: white and wander of each channel, or white alone.
    part : {"auto", "whole"}
        What counts of a mode that moves while it dies away: "auto" its laws at the smallest amplitude, or its last part
        where it follows none; "whole" one linear mode for all.
    drift : bool
        Whether a linear drift of each record is estimated.
    false_alarm : float
        Probability that noise alone yields a further mode.
    least_quality_factor : float
        Least quality factor of an exponential.

    Returns
    -------
    Ringdown

    Raises
    ------
    DataError
        Data that cannot be used: no decay, no oscillation above the noise, too few samples.
    ConfigError
        A parameter that is wrong.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> time = np.arange(4000) / 1e4
    >>> noise = 1e-3 * np.random.default_rng(1).standard_normal(4000)
    >>> decay = afmid.ringdown(np.exp(-12 * time) * np.cos(1571 * time) + noise, sample_rate_hz=1e4)
    >>> mode = decay.modes.loc[0]
    >>> bool(abs(mode.frequency_hz - 250.04) < 0.01), bool(abs(mode.quality_factor - 65.5) < 0.2)
    (True, True)
    """
    decays, events, said = free_decays(y, rate(sample_rate_hz), axes, begin, channels, units)
    fitted, more = artifacts.run_stage(
        "model.decay",
        {"decays": decays},
        modes=modes,
        max_modes=max_modes,
        noise=noise,
        part=part,
        drift=drift,
        false_alarm=false_alarm,
        least_quality_factor=least_quality_factor,
    )
    said = [*said, *more]
    artifacts.warn(said)
    found: Ringdown = Ringdown._made_when_asked(
        {
            "modes": lambda: artifacts.table(fitted["modes"]),
            "shapes": lambda: _shapes(fitted),
            "hits": lambda: artifacts.table(fitted["hits"]),
            "course": lambda: artifacts.table(fitted["course"]),
            "residuals": lambda: artifacts.array(fitted["fit"]).assign_coords(channel=_shapes(fitted)["channel"]),
            "details": lambda: artifacts.document(fitted["summary"]),
        },
        events=events,
        warnings=tuple(said),
    )
    return found


def _shapes(fitted: dict[str, Any]) -> xr.Dataset:
    shapes = artifacts.array(fitted["shapes"])
    return shapes.assign_coords(channel=shapes.attrs.pop("channels").split("\n"))
