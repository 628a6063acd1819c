"""Frequency responses from measured input and output."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr

from . import artifacts
from .estimate import Estimate
from .numbers import with_error
from .pairs import pair

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STORED = ("frf", "variance", "coherence", "input_noise")
"""The variables of the artifact; all others follow from them."""


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredFrf(Estimate):
    """Measured frequency responses, as `afmid.frf` returns them.

    Printed: band, largest value with its standard error and median coherence of each.

    `details`: number of blocks, width of a bin, the excited band of each input, median coherence, windows.
    """

    HEADS: ClassVar[tuple[str, ...]] = (
        *("response", "from (Hz)", "to (Hz)", "largest at (Hz)", "magnitude", "unit", "coherence"),
    )

    response: xr.Dataset
    """Over response and frequency: `frf`, the complex response, with `std`, the standard error of the complex value;
    `magnitude` and `phase` with `magnitude_std` and `phase_std`; `variance`, `coherence` and `input_noise` as the stage
    hands them on. A response's name is its output and input; both are coordinates of their own, too.
    """
    blocks: str = "segments"
    """What was averaged."""

    @property
    def coherence(self) -> xr.DataArray | None:
        """Share of the output's power that all inputs explain; None of a single block."""
        return self.response.get("coherence")

    def _rows(self) -> list[list[str]]:
        return [_row(self.response.isel(response=k)) for k in range(self.response.sizes["response"])]

    def plot(self, figure: Figure | None = None) -> Figure:
        """Magnitude with two standard errors on either side, phase and coherence of each response. Needs matplotlib."""
        from .figures import responses

        return responses(self.response, figure)


def _row(response: xr.Dataset) -> list[str]:
    frequency = response.frequency_hz.values
    magnitude = response["magnitude"].values
    known = np.isfinite(magnitude)
    at = int(np.argmax(np.where(known, magnitude, -1.0)))
    std = float(response["magnitude_std"].values[at]) if "magnitude_std" in response else np.nan
    coherence = f"{np.nanmedian(response['coherence'].values):.3f}" if "coherence" in response else "-"
    numbers = [f"{found:.6g}" for found in (frequency[0], frequency[-1], frequency[at])]
    unit = str(response["frf"].attrs.get("units", ""))
    return [str(response.response.item()), *numbers, with_error(float(magnitude[at]), std), unit, coherence]


def described(frf: xr.Dataset) -> xr.Dataset:
    """Responses under the names of their points, with magnitude and phase and the standard errors of all."""
    of = json.loads(frf.attrs["responses"])
    outputs, inputs = ([one[side]["name"] + one[side]["direction"] for one in of] for side in ("output", "input"))
    labels = [f"{output} / {input}" for output, input in zip(outputs, inputs, strict=True)]
    numbered = frf["response"].attrs
    named = {"response": ("response", labels, numbered), "output": ("response", outputs), "input": ("response", inputs)}
    return with_errors(frf.assign_coords(named), "frf")


def with_errors(found: xr.Dataset, name: str) -> xr.Dataset:
    """Magnitude and phase beside complex values, and the standard errors that follow from their `variance`: half of it
    is along the value, half across.

    >>> found = with_errors(xr.Dataset({"h": ("frequency_hz", [2j]), "variance": ("frequency_hz", [0.08])}), "h")
    >>> found.magnitude.item(), round(found.magnitude_std.item(), 3), round(found.phase_std.item(), 3)
    (2.0, 0.2, 0.1)
    """
    values = found[name]
    units = values.attrs.get("units", "")
    parts = {
        "magnitude": (abs(values), units, "its magnitude"),
        "phase": (xr.apply_ufunc(np.angle, values), "rad", "its phase, from -pi to pi"),
    }
    if "variance" in found:
        std = np.sqrt(found["variance"])
        with np.errstate(divide="ignore", invalid="ignore"):
            turned = std / np.sqrt(2) / abs(values)
        parts["std"] = (std, units, "standard error of the complex value: root of its expected squared error")
        parts["magnitude_std"] = (std / np.sqrt(2), units, "standard error of the magnitude")
        parts["phase_std"] = (turned, "rad", "standard error of the phase")
    dims = values.dims
    return found.assign(
        {of: (dims, part.values, {"units": unit, "long_name": text}) for of, (part, unit, text) in parts.items()}
    )


def frf(
    u: Any,
    y: Any,
    *,
    sample_rate_hz: float,
    blocks: str = "segments",
    block_samples: int | None = None,
    before_samples: int = 32,
    estimator: str = "h1",
    force_window_s: float | None = None,
    added_decay_per_s: float = 0.0,
    band_hz: Sequence[float] | None = None,
    excited_share: float = 0.01,
    quantity: str | None = None,
    driving_point: int | None = None,
    point: str | None = None,
    roving: str = "hammer",
    before: MeasuredFrf | None = None,
    remove: str = "mean",
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    input_unit: str = "",
    output_unit: str = "",
) -> MeasuredFrf:
    """Frequency responses from measured input and output, with coherence and standard errors.

    The same numbers as the stage `spectrum.measured_frf` of the program gives for the same samples.

    Parameters
    ----------
    u : array_like
        Input, (samples,), inputs, (inputs, samples), or several records of them, (records, inputs, samples); a list of
        records where they have unlike lengths.
    y : array_like
        Output, or outputs, likewise.
    sample_rate_hz : float
        Samples per second.
    blocks : {"segments", "hits", "periods"}
        What is averaged: half-overlapping segments of a steady excitation under a Hann window; hits of a hammer, each
        with what rings after it; periods of an input that repeats itself, without a window.
    block_samples : int, optional
        Samples of a block. By default an eighth of the record for segments, the period that the inputs show, as many as
        hits are apart at least.
    before_samples : int
        Samples of a hit before the force comes to a tenth of its largest value.
    estimator : {"h1", "h2", "hv"}
        Which noise the estimate is free of: that of the output, of the input, or of both in proportion.
    force_window_s : float, optional
        Time on either side of a hit's largest force beyond which the force is set to zero.
    added_decay_per_s : float
        Rate of an exponential window on force and response of hits, which fits of modes subtract.
    band_hz : (float, float), optional
        Lowest and highest frequency that is kept; by default the band in which each input has power.
    excited_share : float
        Power of an input, as a share of its largest, down to which it counts as excited.
    quantity : {"receptance", "mobility", "accelerance", "transfer"}, optional
        What output over input is; by default what the units say.
    driving_point : int, optional
        Number (from 1) of the response whose input acts where and as its output is measured.
    point : str, optional
        Name of the point that was struck, or where the sensor was, by `roving`.
    roving : {"hammer", "sensor"}
        What is at `point`.
    before : MeasuredFrf, optional
        Responses of other points, measured alike: these come first in the result.
    remove : {"mean", "line", "none"}
        What is taken off inputs and outputs before.
    inputs, outputs : sequence of str, optional
        Names of the channels.
    input_unit, output_unit : str
        Their units.

    Returns
    -------
    MeasuredFrf

    Raises
    ------
    DataError
        Data that cannot be used: unlike lengths, missing samples, an input that is zero, no hit.
    ConfigError
        A parameter that is wrong.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> rng = np.random.default_rng(1)
    >>> u = rng.standard_normal(20_000)
    >>> y = np.convolve(u, [0.0, 0.5, 0.25])[:20_000] + 0.01 * rng.standard_normal(20_000)
    >>> found = afmid.frf(u, y, sample_rate_hz=1e3, input_unit="V", output_unit="V", quantity="transfer")
    >>> at = found.response.sel(frequency_hz=100, method="nearest").isel(response=0)
    >>> turn = np.exp(-2j * np.pi * at.frequency_hz.item() / 1e3)
    >>> bool(abs(at.frf.item() - (0.5 * turn + 0.25 * turn**2)) < 4 * at["std"].item())
    True
    """
    made, said = pair(
        u,
        y,
        sample_rate_hz=sample_rate_hz,
        remove=remove,
        inputs=inputs,
        outputs=outputs,
        input_unit=input_unit,
        output_unit=output_unit,
    )
    ports = {"pair": made}
    if before is not None:
        ports["before"] = artifact(before.response)
    found, more = artifacts.run_stage(
        "spectrum.measured_frf",
        ports,
        blocks=blocks,
        block_samples=block_samples,
        before_samples=before_samples,
        estimator=estimator,
        force_window_s=force_window_s,
        added_decay_per_s=added_decay_per_s,
        band_hz=band_hz,
        excited_share=excited_share,
        quantity=quantity,
        driving_point=driving_point,
        point=point,
        roving=roving,
    )
    said = [*said, *more]
    artifacts.warn(said)
    return MeasuredFrf(
        response=described(artifacts.array(found["frf"])),
        warnings=tuple(said),
        details=artifacts.document(found["summary"]),
        blocks=blocks,
    )


def artifact(response: xr.Dataset) -> Any:
    """The artifact that responses are from."""
    return artifacts.of_array(response, STORED)
