"""What can go wrong, each with what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class AfmidError(Exception):
    """Anything that this package refuses.

    >>> issubclass(NotAResult, AfmidError) and issubclass(UnknownName, KeyError)
    True
    """


class NotAResult(AfmidError, ValueError):
    """The file is no result of `afmid run`.

    >>> raise NotAResult("notes.txt is no HDF5 file")
    Traceback (most recent call last):
    afmid.errors.NotAResult: notes.txt is no HDF5 file
    """


class OtherFormat(AfmidError, ValueError):
    """A result, but of a format that this reader does not know.

    >>> raise OtherFormat("a.h5 has format 9")
    Traceback (most recent call last):
    afmid.errors.OtherFormat: a.h5 has format 9
    """


class Damaged(AfmidError, ValueError):
    """A result that lacks a part, or whose parts do not fit together.

    >>> raise Damaged("a.h5: /entry/pipeline is missing")
    Traceback (most recent call last):
    afmid.errors.Damaged: a.h5: /entry/pipeline is missing
    """


class NoCovariance(AfmidError, ValueError):
    """A model whose errors are not known.

    >>> raise NoCovariance("the model holds no covariance")
    Traceback (most recent call last):
    afmid.errors.NoCovariance: the model holds no covariance
    """


class UnknownName(AfmidError, KeyError, AttributeError):
    """There is nothing of this name; says what is near, or what there is.

    >>> raise UnknownName("stage", "modse", ["model", "modes"])
    Traceback (most recent call last):
    afmid.errors.UnknownName: there is no stage `modse`; did you mean `modes`?
    """

    def __init__(self, what: str, name: str, have: Iterable[str]) -> None:
        known = list(have)
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean `{near[0]}`?" if near else f"there is: {', '.join(known) or 'nothing'}"
        super().__init__(f"there is no {what} `{name}`; {hint}")

    def __str__(self) -> str:
        # KeyError shows its argument in quotes
        return str(self.args[0])


class AfmidWarning(UserWarning):
    """What a fit found that is not alright; the same words as the program's.

    >>> issubclass(AfmidWarning, UserWarning)
    True
    """


class DataError(AfmidError, ValueError):
    """Data that cannot be used: what was found, where, what to do.

    >>> raise DataError("sample 3 is missing", "a.csv", "cut the file")
    Traceback (most recent call last):
    afmid.errors.DataError: a.csv: sample 3 is missing; cut the file
    """

    def __init__(self, problem: str, file: str | None = None, help: str | None = None) -> None:
        super().__init__(problem, file, help)
        self.problem, self.file, self.help = problem, file, help

    def __str__(self) -> str:
        place = f"{self.file}: " if self.file else ""
        return f"{place}{self.problem}" + (f"; {self.help}" if self.help else "")


class ConfigError(DataError):
    """A parameter that is wrong.

    >>> raise ConfigError("`max_modes`: invalid type")
    Traceback (most recent call last):
    afmid.errors.ConfigError: `max_modes`: invalid type
    """
