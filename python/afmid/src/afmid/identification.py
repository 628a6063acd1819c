"""Models from measured input and output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import pandas as pd
import xarray as xr

from . import artifacts
from .estimate import Estimate
from .model import Model
from .numbers import MODE_HEADS, mode_rows
from .pairs import pair_of_one_output

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class IdentifiedModel(Estimate, Model):
    """A model with its modes, as `afmid.pem`, `afmid.subspace` and `afmid.vector_fitting` return it.

    Printed: order, fit and modes.

    `details`: convergence, orders that were tried, fits of the data, tests of the residual.
    """

    HEADS: ClassVar[tuple[str, ...]] = MODE_HEADS
    NO_ROWS: ClassVar[str] = "no modes: nothing oscillates"

    modes: pd.DataFrame = field(default_factory=pd.DataFrame)
    """A row per resonance, ascending, with standard errors."""
    roots: pd.DataFrame = field(default_factory=pd.DataFrame)
    """All poles and zeros, and what each is."""
    residuals: xr.Dataset = field(default_factory=xr.Dataset)
    """Prediction errors and predictions over time; none of a model that `afmid.pem` has not fitted."""

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
    model = identified(fitted, [*said, *more])
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
    model = identified(fitted, [*said, *more])
    artifacts.warn(list(model.warnings))
    return model


def identified(fitted: dict[str, Any], said: list[str]) -> IdentifiedModel:
    """What a stage that fits a model has handed on, with the model's modes."""
    modes, of_modes = artifacts.run_stage("model.modes", {"model": fitted["model"]})
    content = fitted["model"].content()
    content["parameter_names"] = tuple(content["parameter_names"])
    return IdentifiedModel(
        **content,
        modes=artifacts.table(modes["modes"]),
        roots=artifacts.table(modes["roots"]),
        residuals=artifacts.array(fitted["residuals"]) if "residuals" in fitted else xr.Dataset(),
        warnings=(*said, *of_modes),
        details=artifacts.document(fitted["summary"]),
    )
