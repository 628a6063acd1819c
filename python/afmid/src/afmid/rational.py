"""Models from frequency responses."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from . import _native, artifacts, smoothed
from .arrays_at_hand import complex_values, rate, real
from .errors import ConfigError, DataError
from .identification import IdentifiedModel, identified
from .responses import MeasuredFrf
from .smoothed import SmoothedResponse


def vector_fitting(
    response: Any,
    *,
    order: int,
    frequency_hz: Any = None,
    sample_rate_hz: float | None = None,
    std: Any = None,
    modes: int | None = None,
    iterations: int = 30,
    refine: bool = True,
    stable: bool = False,
    min_frequency_hz: float = 0.0,
    max_frequency_hz: float | None = None,
    weight: str | None = None,
    intersample: str | None = None,
    transient: str = "auto",
) -> IdentifiedModel:
    """A state-space model of a frequency response: poles and residues in the z plane, by relaxed vector fitting.

    The same numbers as the stages `model.vector_fitting` and `model.modes` of the program give for the same response.

    Parameters
    ----------
    response : SmoothedResponse, MeasuredFrf, xarray.Dataset or array_like
        What `afmid.smoothing` or `afmid.frf` (of one input and output) returned; `etfe` or `smoothed` of a result; or
        complex values, (frequencies,), NaN where they are not known.
    order : int
        Number of poles.
    frequency_hz : array_like, optional
        Frequencies of values, ascending.
    sample_rate_hz : float, optional
        Samples per second of the model, for values.
    std : array_like, optional
        Standard errors of the complex values (roots of the expected squared errors). Without them all count alike.
    modes : int, optional
        Oscillating pairs among the starting poles; by default as many as fit.
    iterations : int
        Most relocations of the poles.
    refine : bool
        Whether Gauss-Newton on the weighted error ends the fit.
    stable : bool
        Whether poles outside the unit circle are reflected into it.
    min_frequency_hz, max_frequency_hz : float, optional
        Lowest and highest frequency that is used.
    weight : {"variance", "uniform"}, optional
        How bins count: each by its own variance, the default where that is known, or all alike.
    intersample : {"held", "sampled"}, optional
        What the input does between samples: "held" for the response of the continuous system that a held input drives,
        as `afmid.smoothing` has it by default, "sampled" for the ratio of sampled series, as `afmid.frf` has it. By
        default "sampled" for what `afmid.frf` returned, "held" for all other.
    transient : {"auto", "on", "off"}
        What the ends of the record add; "auto" fits it for a response from differences that is not smoothed.

    Returns
    -------
    IdentifiedModel

    Raises
    ------
    DataError
        Data that cannot be used: frequencies that do not ascend, fewer values than coefficients.
    ConfigError
        A parameter that is wrong.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> f = np.arange(1.0, 500.0)
    >>> z = np.exp(2j * np.pi * f / 1e3)
    >>> model = afmid.vector_fitting(
    ...     0.3 * z / (z**2 - 1.6 * z + 0.9), order=2, frequency_hz=f, sample_rate_hz=1e3, intersample="sampled"
    ... )
    >>> model.modes.frequency_hz.round(1).tolist()
    [90.7]
    """
    of_values = {"frequency_hz": frequency_hz, "sample_rate_hz": sample_rate_hz, "std": std}
    if isinstance(response, (SmoothedResponse, MeasuredFrf, xr.Dataset)):
        stated = [name for name, value in of_values.items() if value is not None]
        if stated:
            raise ConfigError(f"`{stated[0]}` is of values: this response states it itself")
        if isinstance(response, MeasuredFrf):
            transfer, intersample = _of_measured(response), intersample or "sampled"
        else:
            transfer = smoothed.artifact(response if isinstance(response, xr.Dataset) else response.response)
    else:
        transfer = _of_values(response, frequency_hz, sample_rate_hz, std)
        weight = weight or ("uniform" if std is None else "variance")
    fitted, said = artifacts.run_stage(
        "model.vector_fitting",
        {"transfer": transfer},
        order=order,
        modes=modes,
        iterations=iterations,
        refine=refine,
        stable=stable,
        min_frequency_hz=min_frequency_hz,
        max_frequency_hz=max_frequency_hz,
        weight=weight,
        intersample=intersample,
        transient=transient,
    )
    model = identified(fitted, said)
    artifacts.warn(list(model.warnings))
    return model


HANN_BINS = 1
"""Bins on either side that a value comes from under a Hann window."""


def _of_measured(measured: MeasuredFrf) -> Any:
    """The one response of one output and input. Errors: `DataError`, several, or of a single block."""
    found = measured.response
    if found.sizes["response"] != 1:
        raise DataError(
            f"{found.sizes['response']} responses, wanted one",
            help="vector fitting is of one input and output; afmid.frf_modes takes all",
        )
    if "variance" not in found:
        raise DataError("the errors of the response are not known: it is of a single block", help="give values and std")
    one = found.isel(response=0, drop=True)[["frf", "variance"]].rename(frf="transfer")
    if measured.blocks == "segments":
        one["half_width_bins"] = xr.full_like(one["variance"], HANN_BINS)
    return smoothed.artifact(xr.Dataset(one.variables, attrs={"sample_rate_hz": found.attrs["sample_rate_hz"]}))


def _of_values(response: Any, frequency_hz: Any, sample_rate_hz: Any, std: Any) -> Any:
    if frequency_hz is None or sample_rate_hz is None:
        raise DataError("frequency_hz and sample_rate_hz are wanted: values state neither")
    values, at = complex_values(response, "response"), real(frequency_hz, "frequency_hz")
    errors = np.full(values.shape, np.nan) if std is None else real(std, "std")
    if values.ndim != 1 or at.shape != values.shape or errors.shape != values.shape:
        raise DataError(
            f"response has the shape {values.shape}, frequency_hz {at.shape} and std {errors.shape}, wanted "
            "(frequencies,) of each"
        )
    return _native.transfer(at, values, np.square(errors), rate(sample_rate_hz))
