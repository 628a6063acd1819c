"""Numbers with their standard errors, as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


def with_error(value: float, std: float) -> str:
    """Value and standard error in brackets, two digits of it: `250.013(12)`; the value alone where none is known.

    >>> with_error(250.0126, 0.0123), with_error(20.83, math.nan), with_error(1234567.0, 4300.0)
    ('250.013(12)', '20.83', '1234600(4300)')
    """
    if not math.isfinite(value):
        return "-"
    if not (math.isfinite(std) and std > 0):
        return f"{value:.6g}"
    digits = 1 - math.floor(math.log10(std))
    if digits <= 0:
        unit = 10**-digits
        return f"{round(value / unit) * unit:.0f}({round(std / unit) * unit:.0f})"
    if digits > 12:
        return f"{value:.9g} +- {std:.1e}"
    error = round(std * 10**digits)
    return f"{value:.{digits}f}({error})"


MODE_HEADS = ("mode", "frequency (Hz)", "Q", "damping (%)")


def mode_rows(modes: pd.DataFrame) -> list[list[str]]:
    """A table of modes as text, under `MODE_HEADS`."""

    def column(value: str, std: str, scale: float = 1.0) -> list[str]:
        pairs = zip(modes[value].tolist(), modes[std].tolist(), strict=True)
        return [with_error(scale * of, scale * error) for of, error in pairs]

    columns = (
        map(str, range(1, len(modes) + 1)),
        column("frequency_hz", "frequency_std_hz"),
        column("quality_factor", "quality_factor_std"),
        column("damping_ratio", "damping_ratio_std", 100),
    )
    return [list(row) for row in zip(*columns, strict=True)]


def text_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Columns side by side, right-aligned.

    >>> print(text_table(["a", "b"], [["1", "22"]]))
    a   b
    1  22
    """
    lines = [list(heads), *map(list, rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(heads))]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)) for line in lines)


def html_table(heads: Sequence[str], rows: Iterable[Sequence[str]], said: Iterable[str] = ()) -> str:
    """The same for notebooks, with what there is to say under it.

    >>> html_table(["a"], [["1"]], ["b < c"])
    '<table><tr><th>a</th></tr><tr><td>1</td></tr></table><ul><li>b &lt; c</li></ul>'
    """

    def line(cells: Sequence[str], kind: str) -> str:
        return "<tr>" + "".join(f"<{kind}>{escape(cell)}</{kind}>" for cell in cells) + "</tr>"

    below = "".join(f"<li>{escape(text)}</li>" for text in said)
    table = "<table>" + line(heads, "th") + "".join(line(row, "td") for row in rows) + "</table>"
    return table + (f"<ul>{below}</ul>" if below else "")
