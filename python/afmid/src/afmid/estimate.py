"""What an estimator returns: a table of numbers with their standard errors, warnings and details."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from html import escape
from threading import RLock
from typing import TYPE_CHECKING, Any, ClassVar

import pandas as pd
import xarray as xr

from .numbers import MODE_HEADS, html_table, mode_rows, text_table

_MAKING = RLock()
"""Held while a field is made: threads that ask for it at once get one."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Estimate:
    """What all results have. A class of results gives its table in `HEADS` and `_rows`.

    >>> class Gain(Estimate):
    ...     HEADS = ("gain", "value")
    ...     def _rows(self):
    ...         return [["static", "2.00(3)"]]
    >>> Gain(warnings=("few samples",))
      gain    value
    static  2.00(3)
    warning: few samples
    """

    HEADS: ClassVar[tuple[str, ...]] = ()
    """Heads of the table's columns."""
    NO_ROWS: ClassVar[str] = ""
    """What is printed for a table without rows."""

    warnings: tuple[str, ...] = ()
    """What is not alright, in the program's words."""
    details: dict[str, Any] = field(default_factory=dict)
    """The stage's summary: what `afmid show RESULT STAGE --json` prints."""

    @classmethod
    def _made_when_asked(cls, later: Mapping[str, Callable[[], Any]], **known: Any) -> Any:
        """A result of which some fields are made when they are first asked for: a loop over many records wants few.

        >>> class Gain(Estimate):
        ...     value: float
        >>> gain = Gain._made_when_asked({"value": lambda: 2.0}, warnings=(), details={})
        >>> gain.value
        2.0
        """
        made = object.__new__(cls)
        made.__dict__.update(known, _later=dict(later))
        return made

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            with _MAKING:
                if name not in self.__dict__:
                    later = self.__dict__.get("_later", {})
                    if name not in later:
                        raise AttributeError(f"{type(self).__name__!r} has no attribute {name!r}", name=name, obj=self)
                    self.__dict__[name] = later[name]()
                    del later[name]
                return self.__dict__[name]

    def __getstate__(self) -> dict[str, Any]:
        """All that it has, made: what makes it cannot be pickled."""
        for name in list(self.__dict__.get("_later", ())):
            getattr(self, name)
        return {name: value for name, value in self.__dict__.items() if name != "_later"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    def _rows(self) -> list[list[str]]:
        """The table's rows, a cell under each head."""
        raise NotImplementedError

    def _title(self) -> str:
        """A line above the table; none where it is empty."""
        return ""

    def _more(self) -> list[str]:
        """Sentences below the table."""
        return []

    def summary(self) -> str:
        """The table, standard errors in brackets, and what is not alright, as text."""
        rows = self._rows()
        table = text_table(self.HEADS, rows) if rows else self.NO_ROWS
        said = [f"- {text}" for text in self._more()] + [f"warning: {text}" for text in self.warnings]
        return "\n".join([*(part for part in (self._title(), table) if part), *said])

    def __repr__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        title = f"<p>{escape(self._title())}</p>" if self._title() else ""
        return title + html_table(self.HEADS, self._rows(), [*self._more(), *self.warnings])


@dataclass(frozen=True, eq=False, repr=False)
class ModalEstimate(Estimate):
    """Modes with their shapes."""

    HEADS: ClassVar[tuple[str, ...]] = MODE_HEADS

    modes: pd.DataFrame
    """A row per mode, ascending: `frequency_hz`, `frequency_std_hz`, `quality_factor`, `quality_factor_std`,
    `damping_ratio`, `damping_ratio_std`, `lack_of_fit` (1: noise alone is left round the mode).
    """
    shapes: xr.Dataset
    """Complex mode shapes over mode and channel with their errors, and the modal assurance criterion."""

    def mac(self) -> pd.DataFrame:
        """Modal assurance criterion between the shapes, 1 on the diagonal."""
        found = self.shapes["mac"]
        numbers = range(1, found.shape[0] + 1)
        return pd.DataFrame(found.values, index=pd.Index(numbers, name="mode"), columns=list(numbers))

    def _rows(self) -> list[list[str]]:
        return mode_rows(self.modes)
