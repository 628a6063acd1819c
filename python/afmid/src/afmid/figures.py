"""Figures of results. Needs matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .errors import AfmidError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# colour-blind safe, as the pages of the program have them
MEASURED, FITTED, LEFT = "#555555", "#0072b2", "#d55e00"


def _figure(figure: Figure | None, **size: Any) -> Figure:
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise AfmidError("matplotlib is missing: pip install 'afmid[plot]'") from error
    return figure if figure is not None else plt.figure(layout="constrained", **size)


def decay(fit: xr.Dataset, figure: Figure | None) -> Figure:
    """Measured, fitted and what is left, a row of axes per channel."""
    count = fit.sizes["channel"]
    figure = _figure(figure, figsize=(8, 1 + 2 * count))
    for number, axes in enumerate(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]):
        channel = fit.isel(channel=number)
        for name, colour in (("measured", MEASURED), ("fitted", FITTED), ("residual", LEFT)):
            axes.plot(fit.time, channel[name], color=colour, linewidth=0.8, label=name)
        axes.set_ylabel(fit["measured"].attrs.get("units") or "signal")
    axes.set_xlabel("time (s)")
    axes.legend(loc="upper right")
    return figure


def bode(response: xr.Dataset, figure: Figure | None) -> Figure:
    """Magnitude and phase over frequency, with the magnitude's interval."""
    figure = _figure(figure, figsize=(8, 6))
    upper, lower = figure.subplots(2, 1, sharex=True)
    frequency = response.frequency_hz
    upper.loglog(frequency, response.magnitude, color=FITTED)
    upper.fill_between(frequency, response.magnitude_low, response.magnitude_high, color=FITTED, alpha=0.25)
    upper.set_ylabel("magnitude")
    lower.semilogx(frequency, response.phase, color=FITTED)
    error = response.phase_std
    lower.fill_between(frequency, response.phase - 2 * error, response.phase + 2 * error, color=FITTED, alpha=0.25)
    lower.set_ylabel("phase (rad)")
    lower.set_xlabel("frequency (Hz)")
    return figure
