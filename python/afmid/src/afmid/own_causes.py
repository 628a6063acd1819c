"""Causes of one's own for `afmid.diagnose`."""

from __future__ import annotations

import inspect
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _native
from .errors import ConfigError
from .formula import Operation, traced
from .response import Array


@dataclass(frozen=True)
class Parameter:
    """A number of a cause, for `afmid.cause`.

    >>> Parameter(unit="1/V^2", low=-10, high=10, trials=(0.003,)).unit
    '1/V^2'
    """

    unit: str = "1"
    """`V` stands for the output's unit, `input` for that of the input: `1/V^2`, `s/V`, `Hz`, ..."""
    low: float = -math.inf
    """Smallest value, finite."""
    high: float = math.inf
    """Largest value, finite."""
    trials: Sequence[float] = (0.003,)
    """Values at which the cause is compared with what the linear model leaves, the largest output being 1. Of the first
    parameter strengths that change the response by about a hundredth.
    """
    meaning: str = ""
    """What it is."""


class Cause:
    """A cause that is written in Python, as `afmid.cause` makes it; calls are those of its function."""

    def __init__(self, function: Callable[..., Any], about: dict[str, Any], trials: list[list[float]]) -> None:
        self.function, self.about, self.trials = function, about, trials
        self.__doc__, self.__module__ = function.__doc__, function.__module__
        self.__name__, self.__qualname__ = function.__name__, function.__qualname__
        self._timed = "time" in inspect.signature(function).parameters
        call = self._formula if about["on"] == "force" else self._passed
        self.native = _native.Cause(about, trials, call)

    @property
    def id(self) -> str:
        """Its name in verdicts."""
        return str(self.about["id"])

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self.function(*arguments, **named)

    def _formula(self, values: list[float]) -> list[Operation]:
        return traced(self.function, values)

    def _passed(self, time: Array, signal: Array, values: list[float]) -> Array:
        named = {"time": time} if self._timed else {}
        made = np.asarray(self.function(signal, *values, **named), dtype=np.float64)
        if made.shape != signal.shape:
            raise ValueError(f"the cause `{self.id}` returned shape {made.shape}, wanted {signal.shape}")
        return np.ascontiguousarray(made)

    def __reduce__(self) -> str:
        # as functions are pickled: by the name under which it is found again
        return self.__qualname__

    def __repr__(self) -> str:
        return f"<afmid.Cause {self.id}: {self.about['physics']}>"


def cause(
    *,
    parameters: dict[str, Parameter],
    next_measurement: str,
    on: str = "force",
    id: str | None = None,
    physics: str | None = None,
    alike: Sequence[str] = (),
    resembles: str = "what it was not yet compared with",
    source: str = "a function in Python",
) -> Callable[[Callable[..., Any]], Cause]:
    """Makes a cause of a function, for `afmid.diagnose(..., causes=[...])`: it is tried, fitted, tested and named like
    those of the catalogue.

    The function gets whole trajectories and the parameters as numbers, in their order, and returns a trajectory. The
    largest output is 1: numbers with a unit are parameters, none stands in the function.

    Parameters
    ----------
    parameters : dict of str to Parameter
        Its numbers; the first is its strength, 0 for nothing.
    next_measurement : str
        The measurement that would settle it.
    on : {"force", "output", "input"}
        Where it acts. "force": `f(x, v, ...)` of a mode's deflection x and rate v = q'/w, in `q'' + (w/Q) q' + w^2 q =
        w^2 (g u + f)`; it is read as a formula and computed without Python: arithmetic, comparisons and the
        functions of NumPy that act on one instant (`where`, `sign`, `tanh`, ...). "output": what the sensor shows of the
        whole output; "input": what acts of the whole input, between samples too. Both run any code; one that has an
        argument `time` gets the times, s.
    id : str, optional
        Its name: lower-case letters and hyphens. The function's by default.
    physics : str, optional
        What it is, in a sentence. The first line of the function's docstring by default.
    alike : sequence of str
        Causes that the data cannot tell from it.
    resembles, source : str
        What looks like it, and what separates the two; where the law comes from.

    Returns
    -------
    decorator
        Of a function; makes a `Cause`.

    Raises
    ------
    ConfigError
        No parameter, limits that are not finite, an argument without a parameter; from `afmid.diagnose`, what of it the
        catalogue does not take, or a force that is no formula of an instant.

    Notes
    -----
    A result that holds such a cause is pickled with its name, as functions are: it is found again where its module can
    be imported. The limits and trials are in units of the largest output, and of the largest input.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> @afmid.cause(
    ...     parameters={"k3": afmid.Parameter(unit="1/V^2", low=-10, high=10, trials=(0.003,))},
    ...     next_measurement="drive it at two amplitudes",
    ... )
    ... def stiffening(x, v, k3):
    ...     "the spring stiffens with the square of its deflection"
    ...     return -k3 * x**3
    >>> stiffening(np.array([1.0, 2.0]), 0.0, 0.5)
    array([-0.5, -4. ])
    """

    def made(function: Callable[..., Any]) -> Cause:
        name = function.__name__.replace("_", "-").lower() if id is None else id
        first = (inspect.getdoc(function) or "").strip().split("\n")[0].rstrip(".")
        _check(function, name, parameters, 2 if on == "force" else 1)
        about = {
            "id": name,
            "physics": physics or first or name,
            "on": on,
            "parameters": [
                (key, one.unit, one.meaning or key, float(one.low), float(one.high)) for key, one in parameters.items()
            ],
            "class": [name, *(other for other in alike if other != name)],
            "resembles": resembles,
            "next_measurement": next_measurement,
            "source": source,
        }
        trials = [list(map(float, one)) for one in itertools.product(*(of.trials for of in parameters.values()))]
        return Cause(function, about, trials)

    return made


def _check(function: Callable[..., Any], name: str, parameters: dict[str, Parameter], signals: int) -> None:
    if not parameters:
        raise ConfigError(f"the cause `{name}` has no parameters", help="give its strength: parameters={...}")
    for key, one in parameters.items():
        if not (math.isfinite(one.low) and math.isfinite(one.high) and one.low < one.high):
            found = f"the cause `{name}`: `{key}` lies between {one.low} and {one.high}"
            raise ConfigError(found, help="give finite limits")
        if not one.trials or not all(one.low <= trial <= one.high for trial in one.trials):
            found = f"the cause `{name}`: trials of `{key}` are {list(one.trials)}"
            raise ConfigError(found, help="give some within its limits")
    arguments = [key for key in inspect.signature(function).parameters if key != "time"]
    if arguments[signals:] != list(parameters):
        found = ", ".join(arguments[signals:]) or "none"
        raise ConfigError(
            f"the cause `{name}` has the arguments {found} behind its {signals} signals, wanted {', '.join(parameters)}"
        )
