"""Reads the result files of afmid.

>>> import afmid
>>> with afmid.open("a.h5") as r:
...     modes = r.modes                         # pandas, with standard errors
...     transfer = r.etfe.transfer              # xarray, complex, over frequency_hz
...     model = r.model("model")                # A, B, C, D, K, covariance
>>> band = model.frequency_response()           # with its 95 % interval
>>> system = model.to_control()                 # or to_scipy()
"""

from .errors import AfmidError, Damaged, NoCovariance, NotAResult, OtherFormat, UnknownName
from .model import Model
from .recording import Recording
from .response import frequency_response
from .result import Result, open
from .stage import Source, Stage

__version__ = "0.2.0"
__all__ = [
    "AfmidError",
    "Damaged",
    "Model",
    "NoCovariance",
    "NotAResult",
    "OtherFormat",
    "Recording",
    "Result",
    "Source",
    "Stage",
    "UnknownName",
    "frequency_response",
    "open",
]
