"""The native module: stages on arrays at hand, readers, the program."""

from collections.abc import Callable
from typing import Any, TypeAlias, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "Artifact",
    "Cause",
    "artifact",
    "computed",
    "decays",
    "density",
    "frf",
    "inspect",
    "main",
    "page",
    "pair",
    "read",
    "recording",
    "run_config",
    "run_stage",
    "segment_samples",
    "simulate",
    "stage_parameters",
    "stages_of",
    "transfer",
]

_Real: TypeAlias = npt.NDArray[np.float64]
_Complex: TypeAlias = npt.NDArray[np.complex128]

@final
class Artifact:
    """What a stage takes and hands on."""

    @property
    def shape(self) -> str: ...
    def content(self) -> dict[str, Any]: ...

@final
class Cause:
    """A cause that is written in Python, as the catalogue has it."""

    def __new__(cls, about: dict[str, Any], trials: list[list[float]], call: Callable[..., Any]) -> Cause: ...

def computed(formula: list[tuple[str, list[int], float]], deflection: _Real, rate: _Real) -> _Real: ...
def recording(
    records: list[list[_Real]], channels: list[tuple[str, str]], sample_rate_hz: float
) -> Artifact: ...
def decays(hits: list[list[_Real]], channels: list[tuple[str, str]], sample_rate_hz: float) -> Artifact: ...
def pair(
    records: list[tuple[list[_Real], list[_Real]]],
    input_names: list[tuple[str, str]],
    output_names: list[tuple[str, str]],
    sample_rate_hz: float,
    params: str,
) -> tuple[Artifact, list[str]]: ...
def frf(
    frequency_hz: _Real,
    responses: list[tuple[str, _Complex, _Real | None, _Real | None, tuple[str, str] | None]],
    added_decay_per_s: float,
    params: str,
) -> tuple[Artifact, list[str]]: ...
def density(frequency_hz: _Real, density: _Real, params: str) -> tuple[Artifact, list[str]]: ...
def transfer(frequency_hz: _Real, transfer: _Complex, variance: _Real, sample_rate_hz: float) -> Artifact: ...
def segment_samples(values: _Real) -> int: ...
def artifact(shape: str, content: dict[str, Any]) -> Artifact: ...
def page(
    name: str,
    uses: str,
    params: str,
    ports: list[tuple[str, Artifact]],
    warnings: list[str],
    causes: list[Cause] = ...,
) -> str: ...
def run_stage(
    name: str,
    inputs: dict[str, Artifact],
    params: str,
    seed: int = 1,
    base: str = ".",
    causes: list[Cause] = ...,
) -> tuple[list[tuple[str, Artifact]], list[str]]: ...
def run_config(
    config: str,
    set: list[str],
    output: str,
    cache: str | None,
    stages: list[tuple[str, list[str], Callable[[str, str], str]]],
) -> None: ...
def stage_parameters(name: str) -> str: ...
def stages_of(config: str) -> list[tuple[str, str]]: ...
def simulate(
    model: str, input: _Real | None, samples: int, state: _Real | None, causes: list[Cause] = ...
) -> list[_Real]: ...
def read(path: str, format: str) -> dict[str, Any]: ...
def inspect(path: str) -> str: ...
def main(count: int) -> int: ...
