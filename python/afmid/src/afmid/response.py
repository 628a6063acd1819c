"""Frequency responses of models, with their confidence bands."""

from __future__ import annotations

from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from .errors import NoCovariance, UnknownName

if TYPE_CHECKING:
    from .model import Model

Array = npt.NDArray[Any]
INTERSAMPLE = ("held", "sampled")
POINTS = 2000


def frequency_response(
    model: Model,
    frequency_hz: Any = None,
    *,
    input: int = 0,
    output: int = 0,
    level: float = 0.95,
    intersample: str = "held",
) -> xr.Dataset:
    """`G = C (z I - A)^-1 B + D` at `z = exp(i 2 pi f Ts)`, from one input to one output, with its band.

    Standard errors are those of the delta method with the model's covariance; the magnitude's interval is log-normal,
    as in `model.modes`. Without a covariance, errors and intervals are NaN.

    Parameters
    ----------
    model : Model
        The model: of a result, or what `afmid.pem` returned.
    frequency_hz : array_like, optional
        Where; by default 2000 points, logarithmic from 1/5000 of the sample rate to half of it.
    input, output : int
        Which input and which output, from 0.
    level : float
        Probability of the magnitude's interval.
    intersample : {"held", "sampled"}
        What the input does between samples: "held" takes the hold's half sample of lag and its droop out, as
        `model.modes` and `spectrum.etfe` do by default, "sampled" is G itself.

    Returns
    -------
    xarray.Dataset
        Over frequency: `transfer`, `magnitude` with `magnitude_std`, `magnitude_low` and `magnitude_high`, in units of
        output over input; `phase`, unwrapped, and `phase_std`, in radians.

    Raises
    ------
    UnknownName
        Another `intersample`.
    ValueError
        A level that is no probability; a frequency below 0 or above half the sample rate.

    Examples
    --------
    >>> import afmid
    >>> model = afmid.open("a.h5").model("model")
    >>> band = afmid.frequency_response(model, [1e4], level=0.99)
    >>> bool(band.magnitude_low[0] < band.magnitude[0] < band.magnitude_high[0])
    True
    """
    if intersample not in INTERSAMPLE:
        raise UnknownName("intersample behaviour", intersample, INTERSAMPLE)
    if not 0 < level < 1:
        raise ValueError(f"level is {level}, wanted a probability between 0 and 1")
    rate = 1 / model.sample_time_s
    given = np.geomspace(rate / 5000, rate / 2, POINTS) if frequency_hz is None else frequency_hz
    frequency = np.atleast_1d(np.asarray(given, float))
    if frequency.ndim != 1 or not np.all((frequency >= 0) & (frequency <= rate / 2 * (1 + 1e-9))):
        raise ValueError(f"frequency_hz wants numbers from 0 to half the sample rate, {rate / 2:g} Hz")
    z = np.exp(2j * np.pi * frequency * model.sample_time_s)
    left, right = _resolvents(model, z, input, output)
    transfer = left @ model.B[:, input] + model.D[output, input]
    magnitude_std, phase_std = _errors(model, transfer, left, right, input, output)
    hold = _hold(frequency * model.sample_time_s) if intersample == "held" else np.ones(len(z))
    transfer, magnitude_std = transfer * hold, magnitude_std * abs(hold)
    magnitude = abs(transfer)
    reach = NormalDist().inv_cdf(0.5 + 0.5 * level)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        ratio = np.exp(reach * magnitude_std / magnitude)
    return _dataset(frequency, transfer, magnitude_std, magnitude / ratio, magnitude * ratio, phase_std, level)


def _resolvents(model: Model, z: Array, input: int, output: int) -> tuple[Array, Array]:
    """`C (zI - A)^-1` and `(zI - A)^-1 B` at every z, frequencies x n."""
    matrix = z[:, None, None] * np.eye(model.order) - model.A
    left = np.linalg.solve(
        matrix.swapaxes(1, 2), np.broadcast_to(model.C[output, :, None], (len(z), model.order, 1)).astype(complex)
    )
    right = np.linalg.solve(matrix, np.broadcast_to(model.B[:, input, None], (len(z), model.order, 1)).astype(complex))
    return left[..., 0], right[..., 0]


def _errors(model: Model, transfer: Array, left: Array, right: Array, input: int, output: int) -> tuple[Array, Array]:
    """Standard errors of magnitude and phase, to first order."""
    try:
        slopes = sensitivities(model, left, right, input, output)
    except NoCovariance:
        unknown = np.full(len(transfer), np.nan)
        return unknown, unknown
    with np.errstate(divide="ignore", invalid="ignore"):
        # dG over G's direction: its real part moves the magnitude, its imaginary part turns the phase
        turned = slopes * (transfer.conj() / abs(transfer))[:, None]

    def deviation(part: Array) -> Array:
        return np.asarray(np.sqrt(np.maximum(np.einsum("fi,ij,fj->f", part, model.covariance, part), 0)))

    with np.errstate(divide="ignore", invalid="ignore"):
        return deviation(turned.real), deviation(turned.imag) / abs(transfer)


def sensitivities(model: Model, left: Array, right: Array, input: int, output: int) -> Array:
    """`dG/dtheta`, frequencies x parameters: the place of every parameter in A, B and D follows from its name.

    Model: A in observer form by sections, `A[i, j] = -a_i` with j the first column of i's section.
    Errors: `NoCovariance`, no covariance, or a parameter that is not where its name says.

    >>> import afmid
    >>> model = afmid.open("a.h5").model("model")
    >>> resolvents = np.ones((1, 11)), np.ones((1, 11))
    >>> sensitivities(model, *resolvents, 0, 0).shape
    (1, 23)
    """
    if model.covariance.size == 0:
        raise NoCovariance("the model holds no covariance")
    columns = []
    for name, value in zip(model.parameter_names, model.parameters):
        kind, row, of = _place(name)
        if kind == "a" and row < model.order:
            column = row - 1 if row > 0 and model.A[row - 1, row] == 1 else row
            found, slope = -model.A[row, column], -left[:, row] * right[:, column]
        elif kind == "b" and row < model.order and of < model.B.shape[1]:
            found, slope = model.B[row, of], left[:, row] * float(of == input)
        elif kind == "d" and of < model.D.shape[1]:
            found, slope = model.D[output, of], np.full(len(left), float(of == input), complex)
        else:
            raise NoCovariance(f"the model's parameter `{name}` is none of its matrices")
        if found != value:
            raise NoCovariance(f"the model's parameter `{name}` is {value}, its matrices have {found}")
        columns.append(slope)
    return np.stack(columns, axis=1)


def _place(name: str) -> tuple[str, int, int]:
    """Matrix, row and input of a parameter: `b3_2` is the third row of B's second column."""
    letter, _, further = name.partition("_")
    row = letter[1:]
    if (row and not row.isdecimal()) or (further and not further.isdecimal()):
        return "", 0, 0
    return letter[:1], int(row or 1) - 1, int(further or 1) - 1


def _hold(turns: Array) -> Array:
    """`i w Ts / (1 - exp(-i w Ts))`: from the response to a held input to that of the continuous system."""
    angle = 2 * np.pi * turns
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(angle > 0, 1j * angle / (1 - np.exp(-1j * angle)), 1)


def _dataset(
    frequency: Array, transfer: Array, std: Array, low: Array, high: Array, phase_std: Array, level: float
) -> xr.Dataset:
    per_cent = f"{100 * level:g} %"
    variables = {
        "transfer": (transfer, "1", "transfer function of the model"),
        "magnitude": (abs(transfer), "1", "its magnitude"),
        "magnitude_std": (std, "1", "standard error of the magnitude"),
        "magnitude_low": (low, "1", f"lower end of the magnitude's {per_cent} interval"),
        "magnitude_high": (high, "1", "upper end"),
        "phase": (np.unwrap(np.angle(transfer)), "rad", "its phase, unwrapped"),
        "phase_std": (phase_std, "rad", "standard error of the phase"),
    }
    over = "frequency_hz"
    return xr.Dataset(
        {name: (over, values, {"units": unit, "long_name": text}) for name, (values, unit, text) in variables.items()},
        {over: (over, frequency, {"units": "Hz", "long_name": "frequency"})},
        {"level": level},
    )
