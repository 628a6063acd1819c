"""The model that a diagnosis ends with."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from . import _native
from .errors import DataError
from .response import Array

if TYPE_CHECKING:
    from .own_causes import Cause


@dataclass(frozen=True, eq=False, repr=False)
class DiagnosedModel:
    """Modes and real poles with the causes that were named, as `afmid.diagnose(...).model`; the linear baseline where
    nothing was.

    `y = sum_s w_s . x_s`, `q'' + (w/Q) q' + w^2 q = w^2 (g u + f)` of each mode, x = (q, q' / w), f the forces of the
    causes; or linear parts around a static curve.
    """

    causes: pd.DataFrame
    """A row per cause that the model has: as `Diagnosis.causes`."""
    parameters: pd.DataFrame
    """A row per parameter of each cause: `cause`, `parameter`, `value`, `std`, `unit`."""
    sample_rate_hz: float
    """Samples per second: those of the record."""
    content: dict[str, Any] = field(default_factory=dict)
    """The model as the program stores it; in units of the largest output and input (`output_scale`, `input_scale`)."""
    own: tuple[Cause, ...] = ()
    """The causes of one's own that the diagnosis was given."""

    @property
    def sections(self) -> pd.DataFrame:
        """Modes and real poles: `kind`, `frequency_hz`, `quality_factor` (NaN of a pole), `gain` (output per input).
        Empty of linear parts around a curve.
        """
        dynamics = self.content.get("dynamics", {"sections": []})
        columns = ["kind", "frequency_hz", "quality_factor", "gain"]
        rows = []
        for number, section in enumerate(dynamics["sections"]):
            moves = section["kind"] != "relaxation"
            quality = 1 / section["loss"] if moves and section["loss"] > 0 else np.nan
            scale = self.content["output_scale"][dynamics["own"][number]] / self.content["input_scale"]
            gain = section["gain"] * scale if dynamics["driven"] else np.nan
            rows.append((section["kind"], section["frequency_hz"], quality, gain))
        return pd.DataFrame(rows, columns=columns)

    def simulate(self, u: Any = None, *, samples: int | None = None, x0: Any = None) -> Array:
        """The response to an input at the record's rate, or the free motion of decays.

        Parameters
        ----------
        u : array_like, optional
            Input, (samples,), in the record's unit; not of a model of free decays.
        samples : int, optional
            Length of a free motion.
        x0 : array_like, optional
            State at the first sample, (sections, 2): deflection and rate / w of each, in the output's unit. At rest by
            default; of a free motion that of the first decay which was learnt from.

        Returns
        -------
        ndarray
            Output in the record's unit, (samples,), or (samples, channels) of several.

        Raises
        ------
        DataError
            No input where one is wanted, or one where none is; a missing sample; a state of another size.

        Notes
        -----
        What sets in at a time (a step of the gain, a line of the mains) counts it from the first sample of `u`. Of
        samples without their line (`remove="line"`) the model is one of such samples.

        Examples
        --------
        >>> import numpy as np, afmid
        >>> rng = np.random.default_rng(1)
        >>> u = rng.standard_normal(2000)
        >>> y = np.zeros(2000)
        >>> for k in range(2, 2000):
        ...     y[k] = 1.6 * y[k - 1] - 0.9 * y[k - 2] + 0.3 * u[k - 1]
        >>> found = afmid.diagnose(y + 0.01 * rng.standard_normal(2000), u, sample_rate_hz=1e3)
        >>> bool(np.std(y - found.model.simulate(u)) < 0.01)
        True
        """
        if u is not None and samples is not None:
            raise DataError("an input and a number of samples are given", help="leave one of them out")
        given = None if u is None else np.ascontiguousarray(u, dtype=np.float64)
        if given is not None and given.ndim != 1:
            raise DataError(f"the input has shape {given.shape}, wanted (samples,)")
        if samples is not None and samples < 0:
            raise DataError(f"`samples` is {samples}, wanted 0 or more")
        driven = self.content["structure"] == "chain" or self.content["dynamics"]["driven"]
        if not driven and given is None and samples is None:
            help = "give the number of samples: samples=1000"
            raise DataError("the model is of free decays and has no input", help=help)
        state = None if x0 is None else np.ascontiguousarray(np.ravel(x0), dtype=np.float64)
        channels = _native.simulate(json.dumps(self.content), given, samples or 0, state, [cause.native for cause in self.own])
        return channels[0] if len(channels) == 1 else np.stack(channels, axis=1)

    def __repr__(self) -> str:
        names = ", ".join(self.causes.id) or "nothing"
        return f"<afmid.DiagnosedModel: {len(self.sections)} sections, causes: {names}>"
