"""Smoothed frequency responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr

from . import artifacts
from .arrays_at_hand import rate
from .errors import DataError
from .estimate import Estimate
from .numbers import with_error
from .pairs import pair_of_one_output
from .responses import with_errors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STORED = ("transfer", "variance", "half_width_bins", "misfit")
"""The variables of the artifact; all others follow from them."""


@dataclass(frozen=True, eq=False, repr=False)
class SmoothedResponse(Estimate):
    """A frequency response smoothed by local models, as `afmid.smoothing` returns it.

    Printed: bins and largest value of estimate and smoothed response.

    `details`: of the estimate, what is defined, and the quasi-static gain.
    """

    HEADS: ClassVar[tuple[str, ...]] = ("response", "bins", "to (Hz)", "largest at (Hz)", "magnitude", "misfit")

    response: xr.Dataset
    """Over frequency: `transfer`, the complex response, with `std`, the standard error of the complex value,
    `magnitude` and `phase` with theirs; `variance`, `half_width_bins` (bins on either side that a value comes from) and
    `misfit` (residual over the variance given; 1 if that is right) as the stage hands them on.
    """
    etfe: xr.Dataset
    """The estimate that was smoothed, the ratio of the transforms, likewise."""

    def _rows(self) -> list[list[str]]:
        return [_row(name, found) for name, found in (("etfe", self.etfe), ("smoothed", self.response))]

    def plot(self, figure: Figure | None = None) -> Figure:
        """Magnitude and phase of both, the smoothed magnitude with two standard errors. Needs matplotlib."""
        from .figures import smoothed

        return smoothed(self.etfe, self.response, figure)


def _row(name: str, found: xr.Dataset) -> list[str]:
    known = np.isfinite(found["magnitude"].values)
    if not known.any():
        return [name, "0", "-", "-", "-", "-"]
    one = found.isel(frequency_hz=known)
    at = one.isel(frequency_hz=int(np.argmax(one["magnitude"].values)))
    misfit = f"{np.nanmedian(one['misfit'].values):.2f}" if "misfit" in one else "-"
    places = [f"{one.frequency_hz.values[-1]:.6g}", f"{at.frequency_hz.item():.6g}"]
    return [
        name,
        str(int(known.sum())),
        *places,
        with_error(at["magnitude"].item(), at["magnitude_std"].item()),
        misfit,
    ]


def smoothing(
    u: Any,
    y: Any,
    *,
    sample_rate_hz: float,
    method: str = "local-rational",
    half_width_bins: int = 10,
    numerator_order: int = 2,
    denominator_order: int = 2,
    transient: str = "auto",
    transient_order: int = 1,
    degree: int = 2,
    adapt_sigma: float = 2.0,
    lines: Sequence[Mapping[str, float]] = (),
    bandwidth_hz: float | None = None,
    vanishing_ratio: float = 0.05,
    intersample: str = "held",
    remove: str = "mean",
    input_unit: str = "",
    output_unit: str = "",
) -> SmoothedResponse:
    """The frequency response of one input and output, by local models of the ratio of their transforms: a rational
    keeps a resonance two bins wide, which no average over bins does.

    The same numbers as the stages `spectrum.etfe` with `normalise = false` and `spectrum.smoothing` of the program give
    for the same samples.

    Parameters
    ----------
    u : array_like
        Input, (samples,).
    y : array_like
        Output, (samples,).
    sample_rate_hz : float
        Samples per second.
    method : {"local-rational", "local-polynomial"}
        Model around each bin: quotient of polynomials, or polynomial.
    half_width_bins : int
        Bins on either side of each bin that are used (the most, for an adaptive polynomial).
    numerator_order, denominator_order : int
        Orders of the rational.
    transient : {"auto", "on", "off"}
        What the ends of the record add, as a polynomial in each rational; "auto" takes it of differences alone.
    transient_order : int
        Its order.
    degree : int
        Degree of the polynomial.
    adapt_sigma : float
        Standard errors by which neighbourhoods of the polynomial may disagree; 0 for a fixed neighbourhood.
    lines : sequence of mapping
        Lines that do not belong to the response: `{"frequency_hz": 50.0, "half_width_hz": 0.5}`.
    bandwidth_hz : float, optional
        Bins above are undefined; by default none is.
    vanishing_ratio : float
        Bins are undefined where the input is smaller than this share of its median nearby.
    intersample : {"held", "sampled"}
        What the input does between samples: it is held until the next one, and the lag and droop of that are taken out;
        or nothing is corrected.
    remove : {"mean", "line", "none"}
        What is taken off input and output before.
    input_unit, output_unit : str
        Their units.

    Returns
    -------
    SmoothedResponse

    Raises
    ------
    DataError
        Data that cannot be used: unlike lengths, missing samples, an input that is zero.
    ConfigError
        A parameter that is wrong.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> rng = np.random.default_rng(1)
    >>> u = rng.standard_normal(4000)
    >>> y = np.convolve(u, [0.0, 0.5, 0.25])[:4000] + 0.01 * rng.standard_normal(4000)
    >>> found = afmid.smoothing(u, y, sample_rate_hz=1e3, intersample="sampled")
    >>> at = found.response.sel(frequency_hz=100)
    >>> turn = np.exp(-2j * np.pi * 0.1)
    >>> bool(abs(at.transfer.item() - (0.5 * turn + 0.25 * turn**2)) < 4 * at["std"].item())
    True
    """
    if np.ndim(u) != 1:
        raise DataError(f"u has the shape {np.shape(u)}, wanted one input: (samples,)")
    made, said = pair_of_one_output(
        u, y, sample_rate_hz=sample_rate_hz, remove=remove, input_unit=input_unit, output_unit=output_unit
    )
    estimated, of_estimate = artifacts.run_stage(
        "spectrum.etfe",
        {"pair": made},
        bandwidth_hz=0.5 * rate(sample_rate_hz) if bandwidth_hz is None else bandwidth_hz,
        vanishing_ratio=vanishing_ratio,
        intersample=intersample,
        normalise=False,
    )
    found, more = artifacts.run_stage(
        "spectrum.smoothing",
        {"etfe": estimated["etfe"]},
        method=method,
        half_width_bins=half_width_bins,
        numerator_order=numerator_order,
        denominator_order=denominator_order,
        transient=transient,
        transient_order=transient_order,
        degree=degree,
        adapt_sigma=adapt_sigma,
        lines=[dict(line) for line in lines],
    )
    said = [*said, *of_estimate, *more]
    artifacts.warn(said)
    return SmoothedResponse(
        response=with_errors(artifacts.array(found["smoothed"]), "transfer"),
        etfe=with_errors(artifacts.array(estimated["etfe"]), "transfer"),
        warnings=tuple(said),
        details=artifacts.document(estimated["summary"]),
    )


def artifact(response: xr.Dataset) -> Any:
    """The artifact that a response is from."""
    return artifacts.of_array(response, STORED)
