"""State-space models in innovations form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
import pandas as pd
import xarray as xr

from . import stored
from .errors import AfmidError
from .response import Array, frequency_response

if TYPE_CHECKING:
    import control
    import scipy.signal


@dataclass(frozen=True, eq=False)
class Model:
    """`x(t + Ts) = A x(t) + B u(t) + K e(t)`, `y(t) = C x(t) + D u(t) + e(t)`: n states, m inputs, p outputs.

    >>> import afmid
    >>> with afmid.open("a.h5") as r:
    ...     model = r.model("model")
    >>> model.A.shape, model.B.shape, model.C.shape, model.sample_time_s
    ((11, 11), (11, 1), (1, 11), 2e-07)
    """

    A: Array
    """State matrix, n x n."""
    B: Array
    """Input matrix, n x m."""
    C: Array
    """Output matrix, p x n."""
    D: Array
    """Feedthrough, p x m."""
    K: Array
    """Kalman gain, n x p; zero for a model of the simulation alone."""
    x0: Array
    """State at the first sample."""
    sample_time_s: float
    """Ts in seconds."""
    innovation_variance: float
    """Variance of e, in squared units of the output."""
    parameter_names: tuple[str, ...]
    """The free parameters, in the order of `covariance`: a1... (A's first columns of the sections, negative), b1... and
    d, of further inputs b1_2...
    """
    parameters: Array
    """Their values."""
    covariance: Array
    """Their covariance; 0 x 0 where it is not known."""
    attributes: dict[str, Any]
    """Scalars that describe the whole: convergence, offset, drift..."""

    @property
    def order(self) -> int:
        """Number of states.

        >>> import afmid
        >>> afmid.open("a.h5").model("model").order
        11
        """
        return int(self.A.shape[0])

    @property
    def poles(self) -> Array:
        """Eigenvalues of A, in the z plane.

        >>> import afmid
        >>> bool(max(abs(afmid.open("a.h5").model("model").poles)) < 1)
        True
        """
        return np.asarray(np.linalg.eigvals(self.A))

    @property
    def parameter_table(self) -> pd.DataFrame:
        """Parameters with their standard errors.

        >>> import afmid
        >>> list(afmid.open("a.h5").model("model").parameter_table.loc["a1"].index)
        ['value', 'std']
        """
        std = np.sqrt(np.diag(self.covariance)) if self.covariance.size else np.full(len(self.parameters), np.nan)
        return pd.DataFrame(
            {"value": self.parameters, "std": std}, index=pd.Index(self.parameter_names, name="parameter")
        )

    def frequency_response(
        self,
        frequency_hz: Any = None,
        *,
        input: int = 0,
        output: int = 0,
        level: float = 0.95,
        intersample: str = "held",
    ) -> xr.Dataset:
        """Response over frequency, with its confidence band; see `afmid.frequency_response`.

        >>> import afmid
        >>> response = afmid.open("a.h5").model("model").frequency_response([1e3, 1e5])
        >>> list(response.data_vars)
        ['transfer', 'magnitude', 'magnitude_std', 'magnitude_low', 'magnitude_high', 'phase', 'phase_std']
        """
        return frequency_response(
            self, frequency_hz, input=input, output=output, level=level, intersample=intersample
        )

    def simulate(self, u: Any, x0: Any = None) -> Array:
        """The response to the inputs alone (e = 0), from state `x0` (its own by default). Shapes: u N or m x N;
        y p x N, or N for one output.

        >>> import afmid
        >>> afmid.open("a.h5").model("model").simulate([0.0, 0.0], x0=[0.0] * 11)
        array([0., 0.])
        """
        return self._run(u, None, x0)

    def predict(self, u: Any, y: Any, x0: Any = None) -> Array:
        """The response one sample ahead, from inputs and measured outputs up to the sample before. Offset and drift
        (`attributes`) are not the model's: take them off first.

        >>> import afmid
        >>> afmid.open("a.h5").model("model").predict([0.0, 0.0], [0.0, 0.0], x0=[0.0] * 11)
        array([0., 0.])
        """
        return self._run(u, np.atleast_2d(np.asarray(y, float)), x0)

    def _run(self, u: Any, y: Array | None, x0: Any) -> Array:
        inputs = np.atleast_2d(np.asarray(u, float))
        if inputs.shape[0] != self.B.shape[1]:
            raise ValueError(f"u has {inputs.shape[0]} rows, the model {self.B.shape[1]} inputs")
        if y is not None and y.shape != (self.C.shape[0], inputs.shape[1]):
            raise ValueError(f"y has shape {y.shape}, wanted {(self.C.shape[0], inputs.shape[1])}")
        x = np.array(self.x0 if x0 is None else x0, float)
        if x.shape != (self.order,):
            raise ValueError(f"x0 has shape {x.shape}, wanted {(self.order,)}: a number for every state")
        out = np.empty((self.C.shape[0], inputs.shape[1]))
        for t, now in enumerate(inputs.T):
            out[:, t] = self.C @ x + self.D @ now
            x = self.A @ x + self.B @ now
            if y is not None:
                x += self.K @ (y[:, t] - out[:, t])
        return out[0] if out.shape[0] == 1 else out

    def to_scipy(self) -> scipy.signal.StateSpace:
        """The deterministic part for scipy: a discrete `scipy.signal.StateSpace` (a `dlti`). Errors: scipy is missing.

        >>> import afmid
        >>> afmid.open("a.h5").model("model").to_scipy().dt
        2e-07
        """
        try:
            from scipy.signal import StateSpace
        except ImportError as error:
            raise AfmidError("scipy is missing: pip install 'afmid[scipy]'") from error
        return StateSpace(self.A, self.B, self.C, self.D, dt=self.sample_time_s)

    def to_control(self) -> control.StateSpace:
        """The deterministic part for python-control. Errors: python-control is missing.

        >>> import afmid
        >>> afmid.open("a.h5").model("model").to_control().dt
        2e-07
        """
        try:
            import control
        except ImportError as error:
            raise AfmidError("python-control is missing: pip install 'afmid[control]'") from error
        return control.ss(self.A, self.B, self.C, self.D, self.sample_time_s)


def read_model(group: h5py.Group) -> Model:
    """A state-space model.

    >>> with h5py.File("a.h5") as file:
    ...     read_model(file["entry/model/model"]).parameter_names[-1]
    'd'
    """
    return Model(
        **{name: stored.numbers(group, name) for name in ("A", "B", "C", "D", "K", "x0", "parameters", "covariance")},
        sample_time_s=float(stored.value(group, "sample_time_s")),
        innovation_variance=float(stored.value(group, "innovation_variance")),
        parameter_names=tuple(stored.value(group, "parameter_names")),
        attributes=stored.attributes(group, stored.layout(group)["attributes"]),
    )
