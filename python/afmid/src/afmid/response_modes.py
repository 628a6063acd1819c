"""Modes of measured frequency responses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr

from . import _native, artifacts
from .arrays_at_hand import complex_values, names, real
from .errors import ConfigError, DataError
from .estimate import ModalEstimate
from .response import Array
from .responses import MeasuredFrf, artifact

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class FrfModes(ModalEstimate):
    """Modes of frequency responses, as `afmid.frf_modes` returns them.

    A channel of the shapes is a response's point that goes from response to response.
    `details`: modes with shapes at unit modal mass where there is a driving point, numbers of modes that were tried...
    """

    diagram: pd.DataFrame
    """Poles of every order, and whether they are stable: the stabilisation diagram."""
    fit: xr.Dataset
    """Responses as `measured` and as `fitted` over channel and frequency; all at once, the mode `indicator`."""

    def plot(self, figure: Figure | None = None) -> Figure:
        """Magnitudes of all responses as measured and as fitted, and the mode indicator. Needs matplotlib."""
        from .figures import fitted_responses

        return fitted_responses(self.fit, self.modes, figure)


def frf_modes(
    responses: Any,
    *,
    frequency_hz: Any = None,
    std: Any = None,
    coherence: Any = None,
    points: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    inputs: Sequence[str] | None = None,
    unit: str | None = None,
    quantity: str | None = None,
    roving: str = "hammer",
    positions_m: Sequence[float] | None = None,
    directions: Sequence[int] | None = None,
    driving_point: int | None = None,
    phase: str = "auto",
    added_decay_per_s: float = 0.0,
    modes: str | int = "auto",
    max_modes: int = 12,
    from_hz: float | None = None,
    to_hz: float | None = None,
    lower_residual: bool = True,
    upper_residual: bool = True,
    real_poles: int = 0,
    max_order: int = 60,
    stable_frequency: float = 0.01,
    stable_damping: float = 0.2,
    least_quality_factor: float = 2.0,
    false_alarm: float = 1e-3,
) -> FrfModes:
    """Modes of one or many measured frequency responses: one set of poles for all, shapes, all with standard errors.

    The same numbers as the stages `io.frf`, or `spectrum.measured_frf`, and `model.frf_modes` of the program give for
    the same responses.

    Parameters
    ----------
    responses : MeasuredFrf or array_like
        What `afmid.frf` returned, or complex values of `exp(+i w t)`: (frequencies,), (responses, frequencies) or
        (outputs, inputs, frequencies). NaN marks missing values.
    frequency_hz : array_like, optional
        Frequencies of the values, ascending. This and all up to `added_decay_per_s` are of values; what `afmid.frf`
        returned states them itself.
    std : array_like, optional
        Standard errors of the complex values (roots of the expected squared errors) in the shape of `responses`. By
        default they are estimated by what the fit leaves.
    coherence : array_like, optional
        Coherences in the same shape.
    points : sequence of str, optional
        Names of the points that go from response to response.
    outputs, inputs : sequence of str, optional
        Names of the outputs and inputs of (outputs, inputs, frequencies).
    unit : str, optional
        Unit of the values: "m/N", "(m/s)/N", "g/N", ...
    quantity : {"receptance", "mobility", "accelerance", "transfer"}, optional
        What output over input is; by default what the unit says.
    roving : {"hammer", "sensor"}
        What goes from point to point.
    positions_m : sequence of float, optional
        Where the points lie, one for each response.
    directions : sequence of {1, -1}, optional
        -1 where output and input point in opposite directions, one for each response or one for all.
    driving_point : int, optional
        Number (from 1) of the response whose output and input are one point.
    phase : {"auto", "as-stored", "turned"}
        Sign of the imaginary parts; "auto" turns those of `exp(-i w t)`, with which no resonance decays.
    added_decay_per_s : float
        Rate of an exponential window that the responses were measured with; it is taken off.
    modes : "auto" or int
        How many; "auto" takes as many up to `max_modes` as the responses show.
    max_modes : int
        Largest number that "auto" finds.
    from_hz, to_hz : float, optional
        Lowest and highest frequency of the fit.
    lower_residual, upper_residual : bool
        Whether what modes below and above the band leave in it is fitted.
    real_poles : int
        Real poles beside the modes.
    max_order : int
        Largest order of the polynomials that the search starts from.
    stable_frequency, stable_damping : float
        Largest relative change of a stable pole's frequency and damping from one order to the next.
    least_quality_factor : float
        Least quality factor of a mode.
    false_alarm : float
        Probability that noise alone yields a further mode.

    Returns
    -------
    FrfModes

    Raises
    ------
    DataError
        Data that cannot be used: frequencies that do not ascend, too few values, no mode.
    ConfigError
        A parameter that is wrong.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> f = np.arange(50.0, 150.0, 0.25)
    >>> pole = 2 * np.pi * 100 * (-0.01 + 1j * np.sqrt(1 - 0.01**2))
    >>> s = 2j * np.pi * f
    >>> h = 1e3 * np.array([[1.0], [0.5]]) * (1 / (s - pole) - 1 / (s - np.conj(pole))) / 2j
    >>> h = h + np.random.default_rng(1).normal(0, 1e-3, (2, len(f), 2)) @ [1, 1j]
    >>> found = afmid.frf_modes(h, frequency_hz=f, unit="m/N", driving_point=1)
    >>> mode = found.modes.loc[0]
    >>> bool(abs(mode.frequency_hz - 100) < 4 * mode.frequency_std_hz), bool(mode.frequency_std_hz < 0.01)
    (True, True)
    """
    of_values = {
        "frequency_hz": frequency_hz,
        "std": std,
        "coherence": coherence,
        "points": points,
        "outputs": outputs,
        "inputs": inputs,
        "unit": unit,
        "quantity": quantity,
        "positions_m": positions_m,
        "directions": directions,
        "driving_point": driving_point,
    }
    said: list[str] = []
    if isinstance(responses, (MeasuredFrf, xr.Dataset)):
        of_values |= {"added_decay_per_s": added_decay_per_s or None}
        stated = [name for name, value in of_values.items() if value is not None]
        if stated:
            raise ConfigError(f"`{stated[0]}` is of values: these responses state it themselves")
        measured = artifact(responses.response if isinstance(responses, MeasuredFrf) else responses)
    else:
        reader: dict[str, Any] = {
            "phase": phase,
            "roving": roving,
            "positions_m": positions_m,
            "directions": directions,
        }
        reader |= {"unit": unit, "quantity": quantity, "driving_point": driving_point}
        rows = _rows(responses, frequency_hz, std, coherence, points, outputs, inputs)
        measured, said = _native.frf(*rows, float(added_decay_per_s), artifacts.as_json(reader))
    found, more = artifacts.run_stage(
        "model.frf_modes",
        {"frf": measured},
        modes=modes,
        max_modes=max_modes,
        from_hz=from_hz,
        to_hz=to_hz,
        lower_residual=lower_residual,
        upper_residual=upper_residual,
        real_poles=real_poles,
        max_order=max_order,
        stable_frequency=stable_frequency,
        stable_damping=stable_damping,
        least_quality_factor=least_quality_factor,
        false_alarm=false_alarm,
    )
    said = [*said, *more]
    artifacts.warn(said)
    shapes, fit = artifacts.array(found["shapes"]), artifacts.array(found["fit"])
    channels = shapes.attrs.pop("channels").split("\n")
    fit.attrs.pop("channels")
    return FrfModes(
        modes=artifacts.table(found["modes"]),
        shapes=shapes.assign_coords(channel=channels),
        diagram=artifacts.table(found["diagram"]),
        fit=fit.rename(response="channel").assign_coords(channel=channels),
        warnings=tuple(said),
        details=artifacts.document(found["summary"]),
    )


Row = tuple[str, Array, "Array | None", "Array | None", "tuple[str, str] | None"]


def _rows(
    responses: Any,
    frequency_hz: Any,
    std: Any,
    coherence: Any,
    points: Sequence[str] | None,
    outputs: Sequence[str] | None,
    inputs: Sequence[str] | None,
) -> tuple[Array, list[Row]]:
    """Frequencies, and each response with its name, variances, coherences and points. Errors: `DataError`, shapes that
    do not fit.
    """
    if frequency_hz is None:
        raise DataError("frequency_hz is missing: values do not state their frequencies")
    values, at = complex_values(responses, "responses"), real(frequency_hz, "frequency_hz")
    if not 1 <= values.ndim <= 3 or at.ndim != 1 or values.shape[-1] != len(at):
        raise DataError(
            f"responses has the shape {values.shape} and frequency_hz {at.shape}, wanted (frequencies,), "
            "(responses, frequencies) or (outputs, inputs, frequencies), and (frequencies,)"
        )
    grid = values.ndim == 3
    if grid and points is not None:
        raise DataError(
            "points are of (responses, frequencies); name the outputs and inputs of (outputs, inputs, frequencies)"
        )
    if not grid and (outputs is not None or inputs is not None):
        raise DataError(
            "outputs and inputs are of (outputs, inputs, frequencies); name the points of (responses, frequencies)"
        )

    def alike(given: Any, what: str) -> list[Array | None]:
        count = values.size // len(at) if len(at) else 0
        if given is None:
            return [None] * count
        found = real(given, what)
        if found.shape != values.shape:
            raise DataError(f"{what} has the shape {found.shape}, wanted that of responses, {values.shape}")
        return list(found.reshape(-1, len(at)))

    variances = [None if row is None else np.square(row) for row in alike(std, "std")]
    coherences = alike(coherence, "coherence")
    both: list[tuple[str, str] | None]
    if grid:
        of_outputs = [name for name, _ in names(outputs, None, values.shape[0], "output")]
        of_inputs = [name for name, _ in names(inputs, None, values.shape[1], "input")]
        both = [(output, input) for output in of_outputs for input in of_inputs]
        labels = [f"{output} / {input}" for output in of_outputs for input in of_inputs]
    else:
        labels = [name for name, _ in names(points, None, len(variances), "point")]
        both = [None] * len(labels)
    rows = list(values.reshape(-1, len(at)))
    return at, list(zip(labels, rows, variances, coherences, both, strict=True))
