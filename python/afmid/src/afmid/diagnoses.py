"""What a linear model gets wrong, and the cause."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import pandas as pd
import xarray as xr

from . import _native, artifacts
from .arrays_at_hand import rate
from .decays import free_decays
from .diagnosed_model import DiagnosedModel
from .errors import DataError
from .estimate import Estimate
from .numbers import with_error
from .pairs import pair_of_one_output

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .own_causes import Cause

STAGE = "diagnosis.causes"


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Estimate):
    """What a linear model gets wrong, as `afmid.diagnose` returns it.

    Printed: verdict, causes with their parameters and gains; where nothing is named, why not, and how far the models went.

    `details`: baseline, evidence, what else was tried: the document that `afmid show` prints.
    """

    HEADS: ClassVar[tuple[str, ...]] = ("cause", "parameter", "value", "unit", "held-out rms before", "after")

    verdict: str
    """`clean`, `named` or `unexplained`."""
    causes: pd.DataFrame
    """A row per cause that was named: `id`, `class`, `p_value`, `next_measurement`."""
    parameters: pd.DataFrame
    """A row per parameter of each cause: `cause`, `parameter`, `value`, `std`, `unit`."""
    gains: pd.DataFrame
    """A row per cause: rms of the errors on data that did not choose it, `rms_before` and `rms_after`, and which."""
    ladder: pd.DataFrame
    """Models, each with one more cause."""
    simulation: xr.Dataset
    """Measured, and simulated before and after the extension."""
    errors: xr.Dataset
    """Errors by frequency and by the output's size."""
    made: dict[str, Any] = field(default_factory=dict)
    """What the stage was given and has handed on, for the page."""

    @property
    def model(self) -> DiagnosedModel:
        """The extended model, to simulate other inputs with; the linear baseline where nothing was named.

        Errors: `DataError`, a diagnosis without one.

        >>> import numpy as np, afmid
        >>> time = np.arange(6000) / 1e4
        >>> noise = 1e-3 * np.random.default_rng(1).standard_normal(6000)
        >>> found = afmid.diagnose(np.exp(-12 * time) * np.cos(1571 * time) + noise, sample_rate_hz=1e4, begin=0)
        >>> found.model.sections.frequency_hz.round().tolist(), found.model.simulate(samples=3).round(1)[:2].tolist()
        ([250.0], [1.0, 1.0])
        """
        content = json.loads(self.made["ports"]["model"][1]["json"])
        if content is None:
            help = "diagnose one input and output, or decays"
            raise DataError("this diagnosis has no model to simulate with", help=help)
        interval_s = content["interval_s"] if content["structure"] == "chain" else content["dynamics"]["interval_s"]
        return DiagnosedModel(self.causes, self.parameters, 1 / interval_s, content, self.made["causes"])

    def plot(self, figure: Figure | None = None) -> Figure:
        """The output as measured and as simulated without and with the causes, and what either leaves. Needs
        matplotlib.
        """
        from .figures import diagnosis

        return diagnosis(self.simulation, figure)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the page that `afmid report` writes: verdict, overlays, errors by frequency and by the output's size,
        the ladder of models; one file that loads nothing else.
        """
        ports = [(port, _native.artifact(*of)) for port, of in self.made["ports"].items()]
        params = artifacts.as_json(self.made["params"])
        causes = [cause.native for cause in self.made["causes"]]
        text = _native.page("diagnosis", STAGE, params, ports, list(self.warnings), causes)
        Path(path).write_text(text, encoding="utf-8")

    def _title(self) -> str:
        return self.verdict

    def _more(self) -> list[str]:
        if self.verdict == "named":
            return []
        said = [str(sentence) for sentence in self.details.get("evidence", [])]
        if len(self.ladder) > 1:
            first, last = self.ladder.iloc[0], self.ladder.iloc[-1]
            unit = str(self.details["ladder"][0].get("unit", "")).strip()
            added = ", ".join(self.ladder["added"].iloc[1:])
            said.append(f"tried: {added}: rms error {first.rms:.4g} -> {last.rms:.4g} {unit}".rstrip())
        return said

    def _rows(self) -> list[list[str]]:
        rows = []
        for parameter in self.parameters.to_dict("records"):
            gain = self.gains[self.gains.cause == parameter["cause"]]
            before, after = (f"{gain[name].iloc[0]:.4g}" if len(gain) else "-" for name in ("rms_before", "rms_after"))
            value = with_error(float(parameter["value"]), float(parameter["std"]))
            texts = [str(parameter[name]) for name in ("cause", "parameter", "unit")]
            rows.append([*texts[:2], value, texts[2], before, after])
        return rows


def diagnose(
    y: Any,
    u: Any = None,
    *,
    sample_rate_hz: float,
    axes: str | None = None,
    begin: str | int = "auto",
    remove: str = "mean",
    input_unit: str = "",
    output_unit: str = "",
    candidates: Sequence[str] = (),
    without: Sequence[str] = (),
    most_causes: int = 8,
    false_alarm_rate: float = 0.01,
    least_gain: float | None = None,
    tolerated_misfit: float | None = None,
    senses: str | None = None,
    causes: Sequence[Cause] = (),
) -> Diagnosis:
    """Says what a linear model gets wrong in free decays, or in a measured input and output; names the causes, extends
    the model, measures the gain.

    The same answer as the stage `diagnosis.causes` of the program gives for the same samples.

    Parameters
    ----------
    y : array_like
        Output, (samples,); without `u` free decays, in the shapes of `afmid.ringdown`.
    u : array_like, optional
        Input, (samples,).
    sample_rate_hz : float
        Samples per second.
    axes, begin
        As for `afmid.ringdown`, of free decays.
    remove : {"mean", "line", "none"}
        What is taken off input and output before.
    input_unit, output_unit : str
        Units of input and output; that of the output says what it senses of the motion.
    candidates : sequence of str
        Ids of the causes that are tried (`afmid causes` lists them); empty: all that the data can show.
    without : sequence of str
        Causes that are left out.
    most_causes : int
        Most causes.
    false_alarm_rate : float
        Rate of false alarms over all candidates together.
    least_gain : float, optional
        Least share of the error that a cause has to take away; by default the stage's. Some per cent on long measured
        records, in which everything is significant.
    tolerated_misfit : float, optional
        Share of systematic misfit in what is left, as ratio of root mean squares, up to which causes are named; by
        default the stage's. More on measured records whose noise is far below any model.
    senses : {"deflection", "rate", "acceleration"}, optional
        What the output senses of the motion, where its unit does not say it.
    causes : sequence of Cause
        Causes of one's own, made by `afmid.cause`, that are tried beside those of the catalogue.

    Returns
    -------
    Diagnosis

    Raises
    ------
    DataError
        Data that cannot be used.
    ConfigError
        A parameter that is wrong.
    Exception
        What the function of one of the `causes` raises.

    Examples
    --------
    >>> import numpy as np, afmid
    >>> time = np.arange(6000) / 1e4
    >>> noise = 1e-3 * np.random.default_rng(1).standard_normal(6000)
    >>> afmid.diagnose(np.exp(-12 * time) * np.cos(1571 * time) + noise, sample_rate_hz=1e4, begin=0).verdict
    'clean'
    """
    rate_hz = rate(sample_rate_hz)
    inputs: dict[str, Any] = {}
    if u is None:
        inputs["decays"], _, said = free_decays(y, rate_hz, axes, begin, None, output_unit)
    else:
        inputs["pair"], said = pair_of_one_output(
            u, y, sample_rate_hz=rate_hz, remove=remove, input_unit=input_unit, output_unit=output_unit
        )
    chosen = [candidates] if isinstance(candidates, str) else list(candidates)
    params: dict[str, Any] = {
        # causes of one's own are tried whatever is chosen from the catalogue
        "candidates": [*chosen, *(one.id for one in causes if chosen)],
        "without": [without] if isinstance(without, str) else list(without),
        "most_causes": most_causes,
        "false_alarm_rate": false_alarm_rate,
        "least_gain": least_gain,
        "tolerated_misfit": tolerated_misfit,
        "senses": senses,
    }
    made, more = artifacts.run_stage(STAGE, inputs, causes=[one.native for one in causes], **params)
    said = [*said, *more]
    artifacts.warn(said)
    answer = artifacts.document(made["summary"])
    named = answer["causes"]
    parameters = [
        {"cause": cause["id"], "parameter": name, "value": of["value"], "std": of.get("std"), "unit": of.get("unit", "")}
        for cause in named
        for name, of in cause["parameters"].items()
    ]
    gains = [{"cause": cause["id"], **cause["gain"]} for cause in named]
    columns = ["id", "class", "p_value", "next_measurement"]
    return Diagnosis(
        verdict=answer["verdict"],
        causes=pd.DataFrame([{name: cause.get(name) for name in columns} for cause in named], columns=columns),
        parameters=pd.DataFrame(parameters, columns=["cause", "parameter", "value", "std", "unit"]),
        gains=pd.DataFrame(gains, columns=["cause", "rms_before", "rms_after", "unit", "held_out"]),
        ladder=artifacts.table(made["ladder"]),
        simulation=artifacts.array(made["simulation"]),
        errors=artifacts.array(made["errors"]),
        warnings=tuple(said),
        details=answer,
        made={
            "params": params,
            "ports": {port: (one.shape, one.content()) for port, one in made.items()},
            "causes": tuple(causes),
        },
    )
