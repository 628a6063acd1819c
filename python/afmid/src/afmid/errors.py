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
