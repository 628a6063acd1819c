"""A force that is written with NumPy as the formula that the native module computes."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from . import _native
from .errors import ConfigError

Operation = tuple[str, list[int], float]
"""Name, places of the operands, value of a number."""

_NAMES = {
    "negative": "negative", "absolute": "absolute", "fabs": "absolute", "sign": "sign", "sqrt": "sqrt",
    "cbrt": "cbrt", "square": "square", "reciprocal": "reciprocal", "exp": "exp", "expm1": "expm1", "log": "log",
    "log1p": "log1p", "sin": "sin", "cos": "cos", "tan": "tan", "arcsin": "arcsin", "arccos": "arccos",
    "arctan": "arctan", "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "floor": "floor", "ceil": "ceil",
    "logical_not": "not", "invert": "not", "add": "add", "subtract": "subtract", "multiply": "multiply",
    "divide": "divide", "true_divide": "divide", "power": "power", "float_power": "power",
    "remainder": "remainder", "maximum": "maximum", "minimum": "minimum", "fmax": "maximum", "fmin": "minimum",
    "hypot": "hypot", "arctan2": "arctan2", "copysign": "copysign", "heaviside": "heaviside", "greater": "greater",
    "greater_equal": "greater_equal", "less": "less", "less_equal": "less_equal", "equal": "equal",
    "not_equal": "not_equal", "logical_and": "and", "logical_or": "or", "bitwise_and": "and", "bitwise_or": "or",
}  # fmt: skip


class Traced(NDArrayOperatorsMixin):
    """A trajectory whose samples are not known: what is done with it is written down.

    >>> tape = []
    >>> x = Traced(tape, "deflection")
    >>> (x**2).place, tape[1:]
    (2, [('number', [], 2.0), ('power', [0, 1], 0.0)])
    """

    def __init__(self, tape: list[Operation], name: str, operands: Sequence[int] = (), value: float = 0.0) -> None:
        self.tape, self.place = tape, len(tape)
        tape.append((name, list(operands), value))

    def _of(self, value: Any) -> int:
        if isinstance(value, Traced):
            return value.place
        number = np.asarray(value)
        if number.ndim or not np.issubdtype(number.dtype, np.number) and number.dtype != bool:
            raise self._refused(f"an array of shape {number.shape} in a force, which has one value an instant")
        return Traced(self.tape, "number", value=float(number)).place

    def _made(self, name: str, *operands: Any) -> Traced:
        return Traced(self.tape, name, [self._of(one) for one in operands])

    @staticmethod
    def _refused(what: str) -> ConfigError:
        return ConfigError(
            what,
            help="a force is a formula of its instant: arithmetic, comparisons, numpy.where, clip, select, polyval, "
            f"interp and {', '.join(sorted(set(_NAMES) - {'fabs', 'true_divide', 'float_power'}))}",
        )

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Traced:
        known = ufunc.__name__ if ufunc is getattr(np, ufunc.__name__, None) else None
        # `x *= 2` makes another trajectory under the same name
        if set(options) == {"out"} and all(isinstance(one, Traced) for one in options["out"]):
            options = {}
        if ufunc is np.positive:
            return self
        if method != "__call__" or options or known not in _NAMES:
            raise self._refused(f"`{ufunc.__name__}` in a force")
        return self._made(_NAMES[known], *inputs)

    def __array_function__(self, function: Callable[..., Any], types: Any, args: Any, kwargs: Any) -> Traced:
        own = _FUNCTIONS.get(function.__name__)
        if own is None:
            raise self._refused(f"`{function.__name__}` in a force")
        return own(self, *args, **kwargs)

    def where(self, condition: Any, this: Any, other: Any) -> Traced:
        return self._made("choose", condition, this, other)

    def clip(self, low: Any = None, high: Any = None) -> Traced:
        """Within limits."""
        kept = self if low is None else self._made("maximum", self, low)
        return kept if high is None else self._made("minimum", kept, high)

    def __getattr__(self, name: str) -> Any:
        # NumPy looks for names of its own
        if name.startswith("__"):
            raise AttributeError(name)
        raise self._refused(f"`{name}` of a motion")

    def __bool__(self) -> bool:
        raise self._refused("an `if`, `and` or `or` on a motion")

    def __float__(self) -> float:
        raise self._refused("a motion as one number")

    def __iter__(self) -> Any:
        raise self._refused("a loop over the samples")

    def __getitem__(self, place: Any) -> Any:
        raise self._refused("a part of a motion")

    __len__ = __iter__


def _clip(any_: Traced, value: Any, low: Any = None, high: Any = None, **limits: Any) -> Traced:
    low = limits.get("min", limits.get("a_min", low))
    high = limits.get("max", limits.get("a_max", high))
    return Traced.clip(value if isinstance(value, Traced) else any_._made("add", value, 0.0), low, high)


def _select(any_: Traced, conditions: Sequence[Any], choices: Sequence[Any], default: Any = 0.0) -> Traced:
    kept = default
    for condition, choice in zip(reversed(conditions), reversed(choices), strict=True):
        kept = any_.where(condition, choice, kept)
    return kept if isinstance(kept, Traced) else any_._made("add", kept, 0.0)


def _polyval(any_: Traced, coefficients: Any, x: Any) -> Traced:
    value: Any = 0.0
    for coefficient in coefficients:
        value = value * x + coefficient
    return value if isinstance(value, Traced) else any_._made("add", value, 0.0)


def _interp(any_: Traced, x: Any, places: Any, values: Any, left: Any = None, right: Any = None) -> Traced:
    places, values = np.asarray(places, float), np.asarray(values, float)
    kept: Any = float(values[-1] if right is None else right)
    for k in range(len(places) - 2, -1, -1):
        slope = (values[k + 1] - values[k]) / (places[k + 1] - places[k])
        kept = any_.where(x <= places[k + 1], values[k] + slope * (x - places[k]), kept)
    return any_.where(x < places[0], float(values[0] if left is None else left), kept)


_FUNCTIONS: dict[str, Callable[..., Traced]] = {
    "where": Traced.where,
    "clip": _clip,
    "select": _select,
    "polyval": _polyval,
    "interp": _interp,
    "zeros_like": lambda any_, *_, **__: any_._made("multiply", any_, 0.0),
    "ones_like": lambda any_, *_, **__: any_._made("add", any_._made("multiply", any_, 0.0), 1.0),
}


def traced(function: Callable[..., Any], values: Sequence[float]) -> list[Operation]:
    """The formula of a force `function(x, v, *values)`: its operations, the last of which is its value.

    Errors: what the function raises; `ConfigError`, what is no formula of an instant.

    >>> traced(lambda x, v, k: -k * x, [2.0])
    [('deflection', [], 0.0), ('rate', [], 0.0), ('number', [], -2.0), ('multiply', [2, 0], 0.0)]
    """
    tape: list[Operation] = []
    x, v = Traced(tape, "deflection"), Traced(tape, "rate")
    made = function(x, v, *values)
    if not (isinstance(made, Traced) and made.tape is tape):
        with contextlib.suppress(TypeError, ValueError):
            made = x._made("add", float(made), 0.0)
    if not isinstance(made, Traced):
        raise ConfigError(f"a force is {made!r}, wanted a number for each instant")
    # the last operation is the value
    if made.place != len(tape) - 1:
        made._made("add", made, 0.0)
    return tape


def computed(formula: list[Operation], x: Any, v: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    """A formula over a motion, as the native module computes it.

    >>> computed(traced(lambda x, v, k: -k * x**3, [2.0]), [1.0, 2.0], [0.0, 0.0])
    array([ -2., -16.])
    """
    x, v = (np.ascontiguousarray(one, dtype=np.float64) for one in (x, v))
    return _native.computed(formula, x, v)
