"""Power spectral densities of samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr

from . import _native, artifacts
from .arrays_at_hand import names, rate, real
from .errors import DataError
from .estimate import Estimate
from .response import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STORED = ("density", "standard_error", "record_error")
"""The variables of the artifact."""


@dataclass(frozen=True, eq=False, repr=False)
class PowerDensity(Estimate):
    """One-sided power spectral density, as `afmid.welch` returns it.

    Printed: bins, averages, root mean square and highest bin of each channel.

    `details`: segments, degrees of freedom, bandwidth, mean square; of several channels by the channel's name.
    """

    HEADS: ClassVar[tuple[str, ...]] = (
        *("channel", "bins", "width (Hz)", "averages", "root mean square", "unit", "largest at (Hz)"),
    )

    density: xr.Dataset
    """Over frequency, and over channel where there are several: `density` with its `standard_error` if the noise is
    stationary, and `record_error`, the same from the scatter of the records. `attrs["averages"]`: as many independent
    spectra were averaged.
    """

    def _channels(self) -> list[tuple[str, xr.Dataset]]:
        if "channel" not in self.density.dims:
            return [("", self.density)]
        return [(str(name), self.density.sel(channel=name)) for name in self.density.channel.values]

    def _rows(self) -> list[list[str]]:
        rows = []
        for name, one in self._channels():
            frequency, density = one.frequency_hz.values, one["density"].values
            width_hz = frequency[1] - frequency[0]
            # the first bins hold what is left of the mean
            at = frequency[3:][np.argmax(density[3:])] if len(density) > 3 else np.nan
            numbers = [f"{width_hz:.6g}", f"{one.attrs['averages']:.1f}", f"{np.sqrt(np.sum(density) * width_hz):.4g}"]
            rows.append([name, str(len(frequency)), *numbers, str(one.attrs["signal_unit"]), f"{at:.6g}"])
        return rows

    def plot(self, figure: Figure | None = None) -> Figure:
        """The density with two standard errors on either side. Needs matplotlib."""
        from .figures import densities

        return densities(self._channels(), figure)


def welch(
    y: Any,
    *,
    sample_rate_hz: float,
    axes: str | None = None,
    channels: Sequence[str] | None = None,
    units: str | Sequence[str] | None = None,
    segment_samples: int | None = None,
) -> PowerDensity:
    """One-sided power spectral density of noise, with its standard errors, by Welch's method: half-overlapping segments
    under a Hann window, their means removed.

    The same numbers as the stage `spectrum.welch` with `stretches = "all"` gives for the same samples.

    Parameters
    ----------
    y : array_like
        (samples,), (records, samples) or (channels, samples); a list where records have unlike lengths.
    sample_rate_hz : float
        Samples per second.
    axes : {"records", "channels"}, optional
        What the first of two axes counts: records that are averaged, or channels with a density each.
    channels : sequence of str, optional
        Names of the channels.
    units : str or sequence of str, optional
        Unit of all channels, or of each.
    segment_samples : int, optional
        Samples of a segment, even. By default a power of two: that of `afmid new pipeline`, in which a resonance of the
        shortest record is eight bins wide, at least four in it; where it has none at least 30.

    Returns
    -------
    PowerDensity

    Raises
    ------
    DataError
        Data that cannot be used: no record as long as a segment, missing samples.
    ConfigError
        A parameter that is wrong.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> y = np.random.default_rng(1).standard_normal(100_000)
    >>> found = afmid.welch(y, sample_rate_hz=1e4, units="V")
    >>> one = found.density.sel(frequency_hz=1000, method="nearest")
    >>> bool(abs(one["density"] - 2e-4) < 4 * one["standard_error"]), found.density["density"].units
    (True, 'V^2/Hz')
    """
    found = averaged(y, rate(sample_rate_hz), axes, channels, units, segment_samples)
    artifacts.warn(list(found.warnings))
    return found


def averaged(
    y: Any,
    rate_hz: float,
    axes: str | None,
    channels: Sequence[str] | None,
    units: str | Sequence[str] | None,
    segment_samples: int | None,
) -> PowerDensity:
    """What `welch` returns, without saying what there is to say.

    >>> y = np.random.default_rng(1).standard_normal(1000)
    >>> averaged(y, 1e3, None, None, None, 64).density.sizes["frequency_hz"]
    33
    """
    rows = _records(y, axes)
    of_each = [[row] for row in rows] if axes == "channels" else [rows]
    named = names(channels, units, len(of_each), "channel")
    length = segment_samples if segment_samples is not None else _native.segment_samples(min(rows, key=len))
    found, said = [], []
    for records, (name, unit) in zip(of_each, named, strict=True):
        recording = _native.recording([[record] for record in records], [(name, unit or "1")], rate_hz)
        made, more = artifacts.run_stage(
            "spectrum.welch", {"records": recording}, segment_samples=length, stretches="all"
        )
        found.append((artifacts.array(made["density"]), artifacts.document(made["summary"])))
        said += [f"{name}: {text}" for text in more] if axes == "channels" else more
    labels = [name for name, _ in named]
    if axes != "channels":
        (density, details), *_ = found
    else:
        details = dict(zip(labels, (of for _, of in found), strict=True))
        density = xr.concat([one for one, _ in found], xr.Variable("channel", labels), combine_attrs="override")
    return PowerDensity(density=density, warnings=tuple(said), details=details)


def _records(y: Any, axes: str | None) -> list[Array]:
    """Rows of samples. Errors: `DataError`, other shapes, missing samples."""
    unlike = isinstance(y, (list, tuple)) and len(y) > 0 and len({np.shape(part) for part in y}) > 1
    rows = [real(part, f"y[{k}]") for k, part in enumerate(y)] if unlike else None
    if rows is not None and (any(row.ndim != 1 for row in rows) or axes == "channels"):
        raise DataError("the parts of y have unlike shapes, wanted records of samples")
    if rows is None:
        found = real(y, "y")
        if axes not in (None, "records", "channels"):
            raise DataError(f'axes is {axes!r}, wanted "records" or "channels": what the first axis of y counts')
        if found.ndim == 2 and axes is None:
            raise DataError(
                f"y has the shape {found.shape}: whether its {found.shape[0]} rows are records or channels is not said",
                help='give axes="records" or axes="channels"',
            )
        if found.ndim not in (1, 2) or found.size == 0:
            raise DataError(
                f"y has the shape {found.shape}, wanted (samples,), (records, samples) or (channels, samples)"
            )
        if found.ndim == 2 and found.shape[0] > found.shape[1]:
            raise DataError(
                f"y has the shape {found.shape}: {found.shape[0]} rows of {found.shape[1]} samples",
                help="is y.T meant?",
            )
        rows = list(np.atleast_2d(found))
    for row in rows:
        missing = np.flatnonzero(~np.isfinite(row))
        if len(missing):
            raise DataError(f"y misses sample {missing[0]}: a spectrum of what is not known is not known")
    return rows


def artifact(density: xr.Dataset) -> Any:
    """The artifact that a density of one channel is from."""
    return artifacts.of_array(density.drop_vars("channel", errors="ignore"), STORED)
