"""Models from measured input and output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from . import artifacts
from .arrays_at_hand import recorded
from .errors import DataError
from .estimate import Estimate
from .model import Model
from .numbers import MODE_HEADS, mode_rows
from .pairs import pair_of_one_output
from .response import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Comparison(NamedTuple):
    """A model beside a measured output, as `IdentifiedModel.compare` returns it."""

    simulated: Array
    """Its simulation, (samples,)."""
    fit_percent: float
    """`100 (1 - |y - simulated| / |y - mean of y|)`."""
    x0: Array
    """The state at the first sample that it was begun with."""


@dataclass(frozen=True, eq=False, repr=False)
class IdentifiedModel(Estimate, Model):
    """A model with its modes, as `afmid.pem`, `afmid.subspace` and `afmid.vector_fitting` return it.

    Printed: order, fit (of the simulation from the best state at the first sample, as `compare` has it) and modes.

    `details`: convergence, orders that were tried, fits of the data, tests of the residual.
    """

    HEADS: ClassVar[tuple[str, ...]] = MODE_HEADS
    NO_ROWS: ClassVar[str] = "no modes"

    modes: pd.DataFrame = field(default_factory=pd.DataFrame)
    """A row per resonance, ascending, with standard errors."""
    roots: pd.DataFrame = field(default_factory=pd.DataFrame)
    """All poles and zeros, and what each is."""
    residuals: xr.Dataset = field(default_factory=xr.Dataset)
    """Prediction errors and predictions over time; none of a model that `afmid.pem` has not fitted."""

    input_level: Array = field(default_factory=lambda: np.zeros(0))
    """What was taken off each input before the fit; `simulate`, `predict` and `compare` take it off, too."""
    output_level: float = 0.0
    """The same of the output, with the offset that was estimated; they add it."""

    def simulate(self, u: Any, x0: Any = None) -> Array:
        """The response to the inputs alone (e = 0), inputs and output as they were measured: at their levels.

        Parameters
        ----------
        u : array_like
            Input, (samples,), or inputs, (inputs, samples).
        x0 : array_like, optional
            State at the first sample, (order,); by default that of the record which was fitted. Of another record
            `compare` finds it; at rest it is zero.

        Returns
        -------
        ndarray
            Output, (samples,).

        Examples
        --------
        >>> import numpy as np, afmid
        >>> rng = np.random.default_rng(1)
        >>> u, y = rng.standard_normal(2000), np.zeros(2000)
        >>> for k in range(2, 2000):
        ...     y[k] = 1.6 * y[k - 1] - 0.9 * y[k - 2] + 0.3 * u[k - 1]
        >>> model = afmid.pem(u + 3, y + 2 + 0.01 * rng.standard_normal(2000), sample_rate_hz=1e3)
        >>> bool(np.std(y + 2 - model.simulate(u + 3)) < 0.01)
        True
        """
        return np.asarray(super().simulate(self._about_level(u), x0) + self.output_level)

    def predict(self, u: Any, y: Any, x0: Any = None) -> Array:
        """The response one sample ahead, from inputs and measured output up to the sample before, at their levels. What
        the noise model (`K`) has to say of the next sample is in it; K is zero of `noise="coloured"` and `"white"`, whose
        errors an autoregressive filter or nothing whitens: there it is the simulation.
        """
        about = np.asarray(y, float) - self.output_level
        return np.asarray(super().predict(self._about_level(u), about, x0) + self.output_level)

    def compare(self, u: Any, y: Any) -> Comparison:
        """The simulation beside a measured output, from the state at the first sample that suits it best.

        Examples
        --------
        >>> import numpy as np, afmid
        >>> rng = np.random.default_rng(1)
        >>> u, y = rng.standard_normal(2000), np.zeros(2000)
        >>> for k in range(2, 2000):
        ...     y[k] = 1.6 * y[k - 1] - 0.9 * y[k - 2] + 0.3 * u[k - 1]
        >>> model = afmid.pem(u[:1000], y[:1000], sample_rate_hz=1e3)
        >>> model.compare(u[1000:], y[1000:]).fit_percent > 99.9
        True
        """
        measured = np.asarray(y, float)
        rest = self.simulate(u, np.zeros(self.order))
        if measured.shape != rest.shape:
            raise DataError(f"y has the shape {measured.shape}, wanted {rest.shape}: a sample for each of the input")
        free = np.empty((len(rest), self.order))
        row = self.C[0].copy()
        for k in range(len(rest)):
            free[k], row = row, row @ self.A
        there = np.isfinite(measured)
        x0 = np.linalg.lstsq(free[there], (measured - rest)[there], rcond=None)[0]
        simulated = rest + free @ x0
        left = np.linalg.norm((measured - simulated)[there])
        about = np.linalg.norm(measured[there] - measured[there].mean())
        return Comparison(simulated, float(100 * (1 - left / about)), x0)

    def _about_level(self, u: Any) -> Array:
        found = np.atleast_2d(np.asarray(u, float))
        return found - self.input_level[:, None] if len(self.input_level) == len(found) else found

    def _title(self) -> str:
        fit = self.details.get("simulation_fit_percent")
        return f"order {self.order}" + (f", simulation fits {fit:.2f} % of the data" if fit is not None else "")

    def _rows(self) -> list[list[str]]:
        return mode_rows(self.modes)

    def bode(self, frequency_hz: Any = None, figure: Figure | None = None) -> Figure:
        """Magnitude and phase with their 95 % bands, from the first input. Needs matplotlib."""
        from .figures import bode

        return bode(self.frequency_response(frequency_hz), figure)

    def plot(self, figure: Figure | None = None) -> Figure:
        """As `bode`, at the frequencies of `frequency_response`. Needs matplotlib."""
        return self.bode(figure=figure)


def pem(
    u: Any,
    y: Any,
    *,
    sample_rate_hz: float,
    order: str | int = "auto",
    max_order: int = 12,
    noise: str = "coloured",
    focus: str = "prediction",
    starts: int = 8,
    block_rows: int = 20,
    prior: float = 0.0,
    offset: bool = True,
    drift: bool = False,
    max_iterations: int = 60,
    min_significance: float | None = None,
    min_quality_factor: float | None = None,
    remove: str = "mean",
    inputs: Sequence[str] | None = None,
    output: str | None = None,
    input_unit: str = "",
    output_unit: str = "",
) -> IdentifiedModel:
    """A state-space model in innovations form from measured input and output, by the prediction error method.

    `x(t + Ts) = A x + B u + K e`, `y = C x + D u + e + offset`. The same numbers as the stages `model.pem` and
    `model.modes` of the program give for the same samples.

    Parameters
    ----------
    u : array_like
        Input, (samples,), or inputs, (inputs, samples).
    y : array_like
        Output, (samples,); NaN marks missing samples, which want `noise="white"`.
    sample_rate_hz : float
        Samples per second.
    order : "auto" or int
        Number of states; "auto" takes the smallest up to `max_order` whose simulation of the last third, fitted on the
        rest, is within a standard error of the best.
    max_order : int
        Largest order that "auto" tries.
    noise : {"coloured", "thermal", "free", "white"}
        How errors are whitened: by an autoregressive filter of their own; through the model's poles, one intensity
        each; through a free Kalman gain; not at all (output error).
    focus : {"prediction", "simulation"}
        Which errors are made small.
    starts : int
        Starts that are refined.
    block_rows : int
        Rows of the Hankel matrix that the starts come from, more than the order.
    prior : float
        Prior variance of the response outside the excited band.
    offset, drift : bool
        Whether an offset and a linear drift of the output are estimated.
    max_iterations : int
        Most iterations in each stretch of the search.
    min_significance, min_quality_factor : float, optional
        What an oscillating pole needs to be a mode: amplitude over its standard error, quality factor; by default those
        of the stage `model.modes`.
    remove : {"mean", "line", "none"}
        What is taken off input and output before, by the constants of the first half.
    inputs, output : str, optional
        Names of the channels.
    input_unit, output_unit : str
        Their units.

    Returns
    -------
    IdentifiedModel

    Raises
    ------
    DataError
        Data that cannot be used: unlike lengths, too few samples, a constant output.
    ConfigError
        A parameter that is wrong.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> rng = np.random.default_rng(1)
    >>> u = rng.standard_normal(2000)
    >>> y = np.zeros(2000)
    >>> for k in range(2, 2000):
    ...     y[k] = 1.6 * y[k - 1] - 0.9 * y[k - 2] + 0.3 * u[k - 1]
    >>> model = afmid.pem(u, y + 0.01 * rng.standard_normal(2000), sample_rate_hz=1e3)
    >>> model.order, model.modes.frequency_hz.round(1).tolist()
    (2, [90.7])
    """
    pair, said = pair_of_one_output(
        u,
        y,
        sample_rate_hz=sample_rate_hz,
        remove=remove,
        inputs=inputs,
        output=output,
        input_unit=input_unit,
        output_unit=output_unit,
    )
    fitted, more = artifacts.run_stage(
        "model.pem",
        {"pair": pair},
        order=order,
        max_order=max_order,
        noise=noise,
        focus=focus,
        starts=starts,
        block_rows=block_rows,
        prior=prior,
        offset=offset,
        drift=drift,
        max_iterations=max_iterations,
    )
    levels = _levels(pair, u, y, remove)
    criteria = {"min_significance": min_significance, "min_quality_factor": min_quality_factor}
    model = identified(fitted, [*said, *more], levels, criteria)
    artifacts.warn(list(model.warnings))
    return model


def subspace(
    u: Any,
    y: Any,
    *,
    sample_rate_hz: float,
    order: str | int = "auto",
    max_order: int = 16,
    weight: str = "cva",
    block_rows: int = 60,
    offset: bool = True,
    drift: bool = False,
    min_significance: float | None = None,
    min_quality_factor: float | None = None,
    remove: str = "mean",
    inputs: Sequence[str] | None = None,
    output: str | None = None,
    input_unit: str = "",
    output_unit: str = "",
) -> IdentifiedModel:
    """A state-space model from measured input and output by a subspace method, without iteration.

    `x(t + Ts) = A x + B u`, `y = C x + D u + e + offset`; K is not estimated. Consistent, but with larger errors than
    those of `afmid.pem`. The same numbers as the stages `model.subspace` and `model.modes` of the program give for the
    same samples.

    Parameters
    ----------
    u : array_like
        Input, (samples,), or inputs, (inputs, samples).
    y : array_like
        Output, (samples,).
    sample_rate_hz : float
        Samples per second.
    order : "auto" or int
        Number of states; "auto" as in `afmid.pem`, by output error.
    max_order : int
        Largest order that "auto" tries.
    weight : {"cva", "n4sid", "moesp", "release"}
        What is weighted: canonical variates, the oblique or the orthogonal projection; "release" takes the future
        itself, without instruments, for inputs that do not excite.
    block_rows : int
        Rows of each Hankel matrix, more than the order; a period of the slowest mode or more.
    offset, drift : bool
        Whether an offset and a linear drift of the output are estimated.
    min_significance, min_quality_factor : float, optional
        What an oscillating pole needs to be a mode: amplitude over its standard error, quality factor; by default those
        of the stage `model.modes`.
    remove : {"mean", "line", "none"}
        What is taken off input and output before, by the constants of the first half.
    inputs, output : str, optional
        Names of the channels.
    input_unit, output_unit : str
        Their units.

    Returns
    -------
    IdentifiedModel

    Raises
    ------
    DataError
        Data that cannot be used: too few samples for the block rows, missing samples, a constant output.
    ConfigError
        A parameter that is wrong.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> rng = np.random.default_rng(1)
    >>> u = rng.standard_normal(2000)
    >>> y = np.zeros(2000)
    >>> for k in range(2, 2000):
    ...     y[k] = 1.6 * y[k - 1] - 0.9 * y[k - 2] + 0.3 * u[k - 1]
    >>> model = afmid.subspace(u, y + 0.01 * rng.standard_normal(2000), sample_rate_hz=1e3, order=2)
    >>> model.modes.frequency_hz.round(1).tolist()
    [90.7]
    """
    pair, said = pair_of_one_output(
        u,
        y,
        sample_rate_hz=sample_rate_hz,
        remove=remove,
        inputs=inputs,
        output=output,
        input_unit=input_unit,
        output_unit=output_unit,
    )
    fitted, more = artifacts.run_stage(
        "model.subspace",
        {"pair": pair},
        order=order,
        max_order=max_order,
        weight=weight,
        block_rows=block_rows,
        offset=offset,
        drift=drift,
    )
    levels = _levels(pair, u, y, remove)
    criteria = {"min_significance": min_significance, "min_quality_factor": min_quality_factor}
    model = identified(fitted, [*said, *more], levels, criteria)
    artifacts.warn(list(model.warnings))
    return model


def _levels(pair: Any, u: Any, y: Any, remove: str) -> tuple[Array, float]:
    """What `remove="mean"` took off the inputs and the output; of several inputs by the means of the first half."""
    stated = pair.content()["attributes"]
    if "input_level" in stated:
        return np.array([stated["input_level"]]), float(stated["output_level"])
    inputs = recorded(u, "u")[0]
    if remove != "mean":
        return np.zeros(len(inputs)), 0.0
    output = recorded(y, "y")[0][0]
    half = len(output) // 2
    return np.array([np.nanmean(row[:half]) for row in inputs]), float(np.nanmean(output[:half]))


def identified(
    fitted: dict[str, Any],
    said: list[str],
    levels: tuple[Array, float] | None = None,
    criteria: dict[str, Any] | None = None,
) -> IdentifiedModel:
    """What a stage that fits a model has handed on, with the model's modes."""
    modes, of_modes = artifacts.run_stage("model.modes", {"model": fitted["model"]}, **(criteria or {}))
    content = fitted["model"].content()
    content["parameter_names"] = tuple(content["parameter_names"])
    of_input, of_output = levels if levels is not None else (np.zeros(0), 0.0)
    return IdentifiedModel(
        **content,
        modes=artifacts.table(modes["modes"]),
        roots=artifacts.table(modes["roots"]),
        residuals=artifacts.array(fitted["residuals"]) if "residuals" in fitted else xr.Dataset(),
        warnings=(*said, *of_modes),
        details=artifacts.document(fitted["summary"]),
        input_level=of_input,
        output_level=of_output + float(content["attributes"].get("offset_v", 0.0)),
    )
