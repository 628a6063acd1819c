"""Figures of results. Needs matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .errors import AfmidError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
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


def diagnosis(simulation: xr.Dataset, figure: Figure | None) -> Figure:
    """Measured, simulated without and with the causes, and what either leaves."""
    figure = _figure(figure, figsize=(8, 6))
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.plot(simulation.time, simulation["measured"], color=MEASURED, linewidth=0.8, label="measured")
    for name, colour, label in (("before", LEFT, "linear model"), ("after", FITTED, "with the causes")):
        upper.plot(simulation.time, simulation[name], color=colour, linewidth=0.8, label=label)
        lower.plot(simulation.time, simulation["measured"] - simulation[name], color=colour, linewidth=0.8)
    unit = simulation["measured"].attrs.get("units", "")
    upper.set_ylabel(f"output ({unit})")
    upper.legend(loc="upper right")
    lower.set_ylabel(f"residual ({unit})")
    lower.set_xlabel("time (s)")
    return figure


MOST_ROWS = 6
"""Responses that are drawn each by itself."""


def responses(found: xr.Dataset, figure: Figure | None) -> Figure:
    """Magnitude, phase and coherence, a column of axes for each of the first responses."""
    count = min(found.sizes["response"], MOST_ROWS)
    known = "coherence" in found
    figure = _figure(figure, figsize=(2 + 5 * count, 7 if known else 5))
    rows = [3, 2, 1] if known else [3, 2]
    grid = figure.subplots(len(rows), count, sharex=True, squeeze=False, height_ratios=rows)
    for number in range(count):
        one, axes = found.isel(response=number), grid[:, number]
        band(axes[0], one.frequency_hz, one["magnitude"], one.get("magnitude_std"), MEASURED)
        axes[0].set_yscale("log")
        axes[0].set_title(str(one.response.item()))
        axes[1].plot(one.frequency_hz, one["phase"], color=MEASURED, linewidth=0.8)
        if known:
            axes[2].plot(one.frequency_hz, one["coherence"], color=MEASURED, linewidth=0.8)
            axes[2].set_ylim(0, 1.05)
        axes[-1].set_xlabel("frequency (Hz)")
    units = found["frf"].attrs.get("units", "")
    for axes, label in zip(grid[:, 0], [f"magnitude ({units})", "phase (rad)", "coherence"], strict=False):
        axes.set_ylabel(label)
    return figure


def fitted_responses(fit: xr.Dataset, modes: Any, figure: Figure | None) -> Figure:
    """Magnitudes of all responses as measured and as fitted, the mode indicator, and where the modes are."""
    figure = _figure(figure, figsize=(8, 6))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    for number in range(fit.sizes["channel"]):
        one = fit.isel(channel=number)
        upper.semilogy(fit.frequency_hz, abs(one["measured"]), color=MEASURED, linewidth=0.6)
        upper.semilogy(fit.frequency_hz, abs(one["fitted"]), color=FITTED, linewidth=0.8)
    lower.semilogy(fit.frequency_hz, fit["indicator"], color=MEASURED, linewidth=0.8)
    for frequency_hz in modes.frequency_hz:
        lower.axvline(frequency_hz, color=LEFT, linewidth=0.8)
    upper.set_ylabel(f"magnitude ({fit['measured'].attrs.get('units') or '1'})")
    upper.legend(upper.lines[:2], ["measured", "fitted"], loc="upper right")
    lower.set_ylabel("mode indicator")
    lower.set_xlabel("frequency (Hz)")
    return figure


def densities(channels: list[tuple[str, xr.Dataset]], figure: Figure | None) -> Figure:
    """Densities over frequency, a row of axes per channel; zero hertz is left out."""
    figure = _figure(figure, figsize=(8, 1 + 3 * len(channels)))
    grid = figure.subplots(len(channels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (name, one) in zip(grid, channels, strict=True):
        one = one.isel(frequency_hz=slice(1, None))
        band(axes, one.frequency_hz, one["density"], one["standard_error"], FITTED)
        axes.set_yscale("log")
        axes.set_ylabel(f"density ({one['density'].attrs.get('units', '')})")
        axes.set_title(name)
    grid[-1].set_xlabel("frequency (Hz)")
    return figure


def thermal(fit: xr.Dataset, figure: Figure | None) -> Figure:
    """Density and fit, and their ratio."""
    figure = _figure(figure, figsize=(8, 6))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    upper.semilogy(fit.frequency_hz, fit["density"], color=MEASURED, linewidth=0.6, label="measured")
    upper.semilogy(fit.frequency_hz, fit["model"], color=FITTED, linewidth=1.2, label="fitted")
    upper.set_ylabel(f"density ({fit['density'].attrs.get('units', '')})")
    upper.legend(loc="upper right")
    lower.plot(fit.frequency_hz, fit["ratio"], color=LEFT, linewidth=0.6)
    lower.set_ylabel("ratio")
    lower.set_xlabel("frequency (Hz)")
    return figure


def smoothed(etfe: xr.Dataset, found: xr.Dataset, figure: Figure | None) -> Figure:
    """Magnitude and phase of an estimate and of the smoothed one."""
    figure = _figure(figure, figsize=(8, 6))
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.plot(etfe.frequency_hz, etfe["magnitude"], color=MEASURED, linewidth=0.5, label="estimate")
    band(upper, found.frequency_hz, found["magnitude"], found["magnitude_std"], FITTED, "smoothed")
    upper.set_yscale("log")
    upper.set_ylabel("magnitude")
    upper.legend(loc="upper right")
    lower.plot(etfe.frequency_hz, etfe["phase"], color=MEASURED, linewidth=0.5)
    lower.plot(found.frequency_hz, found["phase"], color=FITTED, linewidth=0.8)
    lower.set_ylabel("phase (rad)")
    lower.set_xlabel("frequency (Hz)")
    return figure


def band(
    axes: Axes, at: Any, values: xr.DataArray, std: xr.DataArray | None, colour: str, label: str | None = None
) -> None:
    """A curve with two standard errors on either side."""
    axes.plot(at, values, color=colour, linewidth=0.8, label=label)
    if std is not None:
        # on a logarithmic axis what reaches below zero is cut off above it
        low = (values - 2 * std).where(values > 2 * std, values / 100)
        axes.fill_between(at, low, values + 2 * std, color=colour, alpha=0.25, linewidth=0)


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
