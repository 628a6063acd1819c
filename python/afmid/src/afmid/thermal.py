"""Resonances of noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd
import xarray as xr

from . import _native, artifacts
from .arrays_at_hand import rate, real
from .densities import PowerDensity, artifact, averaged
from .errors import ConfigError, DataError
from .estimate import Estimate
from .numbers import with_error

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FITTED = ("frequency", "quality_factor", "variance", "white", "flicker_at_1_hz")


@dataclass(frozen=True, eq=False, repr=False)
class ThermalFit(Estimate):
    """A resonance that noise drives, white and 1/f noise beside it, as `afmid.thermal_fit` returns them.

    `details`: the same numbers with peak density, dispersion, window, gain of 1/f noise: what `afmid show` prints.
    """

    HEADS: ClassVar[tuple[str, ...]] = ("quantity", "value", "unit")

    modes: pd.DataFrame
    """One row: `frequency_hz`, `frequency_std_hz`, `quality_factor`, `quality_factor_std`, `damping_ratio`,
    `damping_ratio_std`.
    """
    parameters: pd.DataFrame
    """A row per quantity: `value`, `std` of the likelihood, `robust_std` from the misfits, `unit`. `variance` is the
    mean square of the resonance, `white` the density of white noise, `flicker_at_1_hz` that of 1/f noise at 1 Hz.
    """
    fit: xr.Dataset
    """`density`, the fitted `model` as the window sees it, and their `ratio` over the frequencies of the fit."""
    lines: pd.DataFrame
    """Lines that were set aside."""

    def _rows(self) -> list[list[str]]:
        numbers = [(str(name), of) for name, of in self.parameters.iterrows()]
        return [[name, with_error(float(of.value), float(of["std"])), str(of.unit)] for name, of in numbers]

    def plot(self, figure: Figure | None = None) -> Figure:
        """Density and fit, and their ratio. Needs matplotlib."""
        from .figures import thermal

        return thermal(self.fit, figure)


def thermal_fit(
    y: Any,
    *,
    sample_rate_hz: float | None = None,
    frequency_hz: Any = None,
    averages: float | None = None,
    unit: str | None = None,
    segment_samples: int | None = None,
    lowest_hz: float = 0.0,
    highest_hz: float | None = None,
    line_false_alarm: float = 0.01,
    flicker: str = "auto",
    fitted_hz: Sequence[float] | None = None,
    window: str = "auto",
) -> ThermalFit:
    """Frequency, quality factor and variance of a resonance in noise, with white and 1/f noise beside it, each with its
    standard error: Whittle's likelihood of a power spectral density.

    The same numbers as the stages `spectrum.welch`, or `io.spectrum`, and `spectrum.thermal` of the program give.

    Parameters
    ----------
    y : array_like or PowerDensity
        Samples, (samples,) or (records, samples), with `sample_rate_hz`; a one-sided density, (frequencies,), with
        `frequency_hz`; or what `afmid.welch` returned, of one channel.
    sample_rate_hz : float, optional
        Samples per second, of samples.
    frequency_hz : array_like, optional
        Frequencies of a density, equally spaced.
    averages : float, optional
        Independent spectra that were averaged in a density; by default what its scatter shows, with a warning.
    unit : str, optional
        Unit of the signal.
    segment_samples : int, optional
        Samples of a segment, as for `afmid.welch`.
    lowest_hz, highest_hz : float, optional
        The resonance lies between these.
    line_false_alarm : float
        Probability that a spectrum without lines loses any bin to the search for lines; 0: no search.
    flicker : {"auto", "on", "off"}
        1/f noise; "auto" keeps it where the likelihood gains more than chance does.
    fitted_hz : (float, float), optional
        Only bins between these frequencies are fitted.
    window : {"auto", "hann", "rectangular", "none"}
        The window that a density was made with; "auto" finds it from the correlation of neighbouring bins.

    Returns
    -------
    ThermalFit

    Raises
    ------
    DataError
        Data that cannot be used: too few bins, no resonance that noise alone does not show.
    ConfigError
        A parameter that is wrong.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> rng = np.random.default_rng(1)
    >>> x = np.zeros(100_000)
    >>> a1, a2 = 2 * np.exp(-np.pi / 200) * np.cos(np.pi / 5), -np.exp(-np.pi / 100)
    >>> for k in range(2, 100_000):
    ...     x[k] = a1 * x[k - 1] + a2 * x[k - 2] + rng.standard_normal()
    >>> found = afmid.thermal_fit(x, sample_rate_hz=1e4, unit="V", fitted_hz=(500, 1500))
    >>> mode = found.modes.loc[0]
    >>> bool(abs(mode.frequency_hz - 1000) < 4 * mode.frequency_std_hz)
    True
    """
    samples = not isinstance(y, PowerDensity) and frequency_hz is None
    if not samples and (sample_rate_hz is not None or segment_samples is not None):
        raise ConfigError("`sample_rate_hz` and `segment_samples` are of samples: y is a density")
    if (samples or isinstance(y, PowerDensity)) and averages is not None:
        raise ConfigError("`averages` is of a density with `frequency_hz`")
    said: list[str] = []
    if isinstance(y, PowerDensity):
        if frequency_hz is not None or unit is not None:
            raise ConfigError("`frequency_hz` and `unit` are of values: what `afmid.welch` returned states them itself")
        if y.density["density"].ndim != 1:
            raise DataError(f"y has {y.density.sizes['channel']} channels, wanted one")
        density, said = artifact(y.density), list(y.warnings)
    elif samples:
        if sample_rate_hz is None:
            raise DataError("neither sample_rate_hz nor frequency_hz is given: y is of samples or a density")
        two = isinstance(y, (list, tuple)) and len(y) > 0 and np.ndim(y[0]) > 0 or np.ndim(y) == 2
        of_samples = averaged(y, rate(sample_rate_hz), "records" if two else None, None, unit, segment_samples)
        density, said = artifact(of_samples.density), list(of_samples.warnings)
    else:
        reader = {"unit": unit or "1", "averages": averages}
        density, said = _native.density(real(frequency_hz, "frequency_hz"), real(y, "y"), artifacts.as_json(reader))
    found, more = artifacts.run_stage(
        "spectrum.thermal",
        {"density": density},
        lowest_hz=lowest_hz,
        highest_hz=highest_hz,
        line_false_alarm=line_false_alarm,
        flicker=flicker,
        fitted_hz=fitted_hz,
        window=window,
    )
    artifacts.warn([*said, *more] if not isinstance(y, PowerDensity) else more)
    answer = artifacts.document(found["summary"])
    rows = [answer[name] for name in FITTED]
    columns = ["value", "std", "robust_std", "unit"]
    return ThermalFit(
        modes=_mode(answer["frequency"], answer["quality_factor"]),
        parameters=pd.DataFrame(rows, index=pd.Index(FITTED, name="quantity"), columns=columns),
        fit=artifacts.array(found["fit"]),
        lines=artifacts.table(found["lines"]),
        warnings=(*said, *more),
        details=answer,
    )


def _mode(frequency: dict[str, Any], quality: dict[str, Any]) -> pd.DataFrame:
    """The resonance as a table of modes; the damping ratio is 1 / (2 Q)."""
    q, q_std = quality["value"], quality["std"]
    return pd.DataFrame(
        {
            "frequency_hz": [frequency["value"]],
            "frequency_std_hz": [frequency["std"]],
            "quality_factor": [q],
            "quality_factor_std": [q_std],
            "damping_ratio": [0.5 / q],
            "damping_ratio_std": [0.5 * q_std / q**2],
        }
    )
