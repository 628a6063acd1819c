"""Identifies dynamic systems from recorded transients, with an error for every number.

>>> import numpy as np, afmid
>>> time = np.arange(4000) / 1e4
>>> noise = 1e-3 * np.random.default_rng(1).standard_normal(4000)
>>> y = np.exp(-12 * time) * np.cos(2 * np.pi * 250 * time) + noise
>>> decay = afmid.ringdown(y, sample_rate_hz=1e4)
>>> decay.modes.frequency_hz.round(1).tolist()
[250.0]

Results of the program (`afmid run CONFIG -o a.h5`) are opened by `afmid.open`.
"""

from __future__ import annotations

# type checkers take it for true; the module `typing` takes longer to import than all else here
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .decays import Ringdown, ringdown
    from .densities import PowerDensity, welch
    from .diagnosed_model import DiagnosedModel
    from .diagnoses import Diagnosis, diagnose
    from .errors import (
        AfmidError,
        AfmidWarning,
        ConfigError,
        Damaged,
        DataError,
        NoCovariance,
        NotAResult,
        OtherFormat,
        UnknownName,
    )
    from .identification import IdentifiedModel, pem, subspace
    from .model import Model
    from .own_causes import Cause, Parameter, cause
    from .plugin import serve, stage
    from .rational import vector_fitting
    from .reading import inspect, read
    from .recording import Recording
    from .response import frequency_response
    from .response_modes import FrfModes, frf_modes
    from .responses import MeasuredFrf, frf
    from .result import Result, open
    from .running import run
    from .smoothed import SmoothedResponse, smoothing
    from .stage_of_run import Source, Stage
    from .thermal import ThermalFit, thermal_fit

__version__ = "0.2.0"

_PLACES = {
    "decays": ("Ringdown", "ringdown"),
    "densities": ("PowerDensity", "welch"),
    "diagnosed_model": ("DiagnosedModel",),
    "diagnoses": ("Diagnosis", "diagnose"),
    "errors": (
        "AfmidError",
        "AfmidWarning",
        "ConfigError",
        "Damaged",
        "DataError",
        "NoCovariance",
        "NotAResult",
        "OtherFormat",
        "UnknownName",
    ),
    "identification": ("IdentifiedModel", "pem", "subspace"),
    "model": ("Model",),
    "own_causes": ("Cause", "Parameter", "cause"),
    "plugin": ("serve", "stage"),
    "rational": ("vector_fitting",),
    "reading": ("inspect", "read"),
    "recording": ("Recording",),
    "response": ("frequency_response",),
    "response_modes": ("FrfModes", "frf_modes"),
    "responses": ("MeasuredFrf", "frf"),
    "result": ("Result", "open"),
    "running": ("run",),
    "smoothed": ("SmoothedResponse", "smoothing"),
    "stage_of_run": ("Source", "Stage"),
    "thermal": ("ThermalFit", "thermal_fit"),
}
# NumPy, pandas, xarray and h5py take half a second: each is imported with the first name that needs it
_MODULE_OF = {name: module for module, names in _PLACES.items() for name in names}
__all__ = [
    "AfmidError",
    "AfmidWarning",
    "Cause",
    "ConfigError",
    "Damaged",
    "DataError",
    "DiagnosedModel",
    "Diagnosis",
    "FrfModes",
    "IdentifiedModel",
    "MeasuredFrf",
    "Model",
    "NoCovariance",
    "NotAResult",
    "OtherFormat",
    "Parameter",
    "PowerDensity",
    "Recording",
    "Result",
    "Ringdown",
    "SmoothedResponse",
    "Source",
    "Stage",
    "ThermalFit",
    "UnknownName",
    "cause",
    "diagnose",
    "frequency_response",
    "frf",
    "frf_modes",
    "inspect",
    "open",
    "pem",
    "read",
    "ringdown",
    "run",
    "serve",
    "smoothing",
    "stage",
    "subspace",
    "thermal_fit",
    "vector_fitting",
    "welch",
]


if not TYPE_CHECKING:
    # type checkers read the imports above, and find misspelt names

    def __getattr__(name: str) -> Any:
        import importlib

        if name not in _MODULE_OF:
            raise AttributeError(f"module 'afmid' has no attribute {name!r}")
        value = getattr(importlib.import_module(f".{_MODULE_OF[name]}", __name__), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
