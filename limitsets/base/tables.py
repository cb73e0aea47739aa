"""Answers as tables: what a terminal, a notebook and a spreadsheet show of them, from one place.

A table holds values, not text.  People see them rounded, as each column says; CSV has every number in full.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence, Sized
from dataclasses import dataclass, fields, is_dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from html import escape
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from limitsets.base.files import replaced

if TYPE_CHECKING:
    import pandas as pd


# Characters of the line that names an answer.
SHORT = 110

# Rows that a notebook shows at both ends of a long table.
SHOWN = 20

Show: TypeAlias = str | Callable[[Any], str]


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    head : str
        What stands in it.
    unit : str
        Of its numbers, empty without one.
    show : str or callable
        How people see a value: a format like ".4f", or a function of it.
    ends : bool
        Whether a value is a pair, the two ends of an interval; they are two columns of CSV.  A format rounds them
        outward: the interval that people see holds the other.
    inward : bool
        Whether they are rounded inward: of places for each of which something is proved.  Where this would leave none,
        every digit is shown.
    """

    head: str
    unit: str = ""
    show: Show = ""
    ends: bool = False
    inward: bool = False

    @property
    def title(self) -> str:
        """The head with its unit."""
        return f"{self.head} [{self.unit}]" if self.unit else self.head

    @property
    def titles(self) -> list[str]:
        """The heads in CSV."""
        if not self.ends:
            return [self.title]
        unit = f" [{self.unit}]" if self.unit else ""
        return [f"{self.head} low{unit}", f"{self.head} high{unit}"]

    def cells(self, value: Any) -> Iterable[Any]:
        """Give a value as a spreadsheet has it: the ends of an interval in two cells."""
        return ((None, None) if value is None else value) if self.ends else (value,)

    def text(self, value: Any) -> str:
        """Write a value for people."""
        if not self.ends or value is None:
            return self._text(value)
        low, high = value
        if low == high:
            return self._text(low)
        texts = self._end(low, up=self.inward), self._end(high, up=not self.inward)
        if self.inward and low < high and float(texts[0]) > float(texts[1]):
            texts = str(_plain(low)), str(_plain(high))
        return texts[0] if texts[0] == texts[1] else " to ".join(texts)

    def _end(self, value: Any, *, up: bool) -> str:
        if self.show and isinstance(self.show, str) and value is not None and math.isfinite(value):
            return rounded(value, self.show, up=up)
        return self._text(value)

    def _text(self, value: Any) -> str:
        if value is None or (isinstance(value, float) and math.isnan(value)):
            return "-"
        if callable(self.show):
            return self.show(value)
        value = _plain(value)
        if isinstance(value, bool):
            return "yes" if value else "no"
        return format(value, self.show) if self.show and not isinstance(value, str) else str(value)


BETWEEN = Column("between", show=".6f", ends=True)
"""Of a number that is proved to lie between two others."""


def rounded(value: float, show: str, *, up: bool) -> str:
    """Write a finite number by a format like ".4f" or ".6g", rounded up or down, so that a bound stays a bound.

    A float counts as the shortest decimal that reads as it: 1.2 in is 1.2, although the float is a little less.

    Examples
    --------
    >>> rounded(2 / 3, ".4f", up=False), rounded(2 / 3, ".3g", up=True), rounded(1.2, ".6f", up=True)
    ('0.6666', '0.667', '1.200000')
    """
    exact, digits = Decimal(repr(float(value))), int(show[1:-1])
    last = -digits if show[-1] == "f" else exact.adjusted() + (show[-1] == "g") - digits
    whole = Context(prec=400, rounding=ROUND_CEILING if up else ROUND_FLOOR)  # of any float
    return format(float(exact.quantize(Decimal(1).scaleb(last), context=whole)) + 0.0, show)  # no -0


def _plain(value: Any) -> Any:
    """Give a number of numpy as Python's."""
    return value.item() if hasattr(value, "item") else value


def _cell(value: Any) -> str:
    """Write a value in CSV: numbers in full, nothing where there is none."""
    value = _plain(value)
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class Table:
    r"""A table: values under heads with units.

    Parameters
    ----------
    columns : sequence of Column or str
        Its columns; of a word alone, a column of values without unit and rounding.
    rows : iterable of sequence
        Its values, not rounded: None where there is none, a pair in a column of ends.
    caption : str
        What it shows.
    how : str
        How it was found: "proved", "sampled, not proved", ...

    Examples
    --------
    >>> found = Table([Column("x", "in", ".2f", ends=True), "side"], [((1.0, 4 / 3), 0)], "Bands", "proved")
    >>> found.csv()
    'x low [in],x high [in],side\n1.0,1.3333333333333333,0\n'
    >>> found.shown()
    [['1.00 to 1.34', '0']]
    """

    columns: Sequence[Column | str]
    rows: Iterable[Sequence[Any]]
    caption: str = ""
    how: str = ""

    def __post_init__(self) -> None:
        columns = tuple(Column(each) if isinstance(each, str) else each for each in self.columns)
        object.__setattr__(self, "columns", columns)
        object.__setattr__(self, "rows", tuple(tuple(row) for row in self.rows))

    @property
    def _columns(self) -> tuple[Column, ...]:
        return tuple(each for each in self.columns if isinstance(each, Column))

    @property
    def heads(self) -> list[str]:
        """The heads with units, for people."""
        return [column.title for column in self._columns]

    def shown(self) -> list[list[str]]:
        """Give the rows as people see them."""
        return [
            [column.text(value) for column, value in zip(self._columns, row, strict=True)]
            for row in self.rows
        ]

    def flat(self) -> tuple[list[str], list[list[Any]]]:
        """Give heads and rows of single values, as spreadsheets have them."""
        heads = [title for column in self._columns for title in column.titles]
        rows = [
            [cell for column, value in zip(self._columns, row, strict=True) for cell in column.cells(value)]
            for row in self.rows
        ]
        return heads, rows

    @property
    def title(self) -> str:
        """What it shows, and how that was found."""
        return f"{self.caption} ({self.how})" if self.caption and self.how else self.caption or self.how

    def _few(self) -> list[list[str]]:
        """Give the rows as people see them; of many the first and the last."""
        rows = tuple(self.rows)
        if len(rows) <= 2 * SHOWN:
            return self.shown()
        few = Table(self.columns, rows[:SHOWN] + rows[-SHOWN:]).shown()
        return [*few[:SHOWN], ["..."] * len(self.heads), *few[SHOWN:]]

    def text(self) -> str:
        """Write it as text; of a long one its first and last rows."""
        return "\n".join([*([self.title] if self.title else []), *aligned(self.heads, self._few())])

    def csv(self) -> str:
        """Write it as CSV: units in the heads, numbers in full."""
        heads, rows = self.flat()
        stream = io.StringIO()
        csv.writer(stream, lineterminator="\n").writerows([heads, *(map(_cell, row) for row in rows)])
        return stream.getvalue()

    def html(self) -> str:
        """Write it as a table of HTML, in the style of the page; of a long one its first and last rows."""
        heads = "".join(f'<th scope="col">{escape(head)}</th>' for head in self.heads)
        body = "".join(
            "<tr>" + "".join(f"<td>{escape(text)}</td>" for text in line) + "</tr>" for line in self._few()
        )
        return (
            f"<table><caption>{escape(self.title)}</caption>"
            f"<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"
        )

    def to_dataframe(self) -> pd.DataFrame:
        """Give it as a table of pandas, with the heads of CSV.

        Raises
        ------
        AnswerError
            pandas is not installed.
        """
        heads, rows = self.flat()
        return pandas().DataFrame([[_plain(value) for value in row] for row in rows], columns=heads)


def pandas() -> Any:
    """Import pandas, or name the extra that brings it."""
    try:
        import pandas as pd
    except ModuleNotFoundError:
        from limitsets.base.errors import AnswerError

        raise AnswerError(
            "the package pandas", "missing", "an installed one", "pip install 'limitsets[atlas]'"
        ) from None
    return pd


class Tabled:
    """An answer that is shown as tables: in a notebook, as a data frame, as CSV.

    A class of answers gives in `tables` those that show it; `table` is the one that it is saved as, the first.
    """

    __slots__ = ()

    def __init_subclass__(cls, **words: Any) -> None:
        super().__init_subclass__(**words)
        # IPython takes what stands in the class itself, and a dataclass makes no __repr__ where one stands
        cls._repr_pretty_ = Tabled._repr_pretty_  # type: ignore[method-assign]  # set in the class on purpose
        if "__repr__" not in vars(cls):
            cls.__repr__ = Tabled.__repr__  # type: ignore[method-assign]  # likewise on purpose

    def __repr__(self) -> str:
        """Name it in a line, with as much of its fields as fits; its tables show all."""
        if not is_dataclass(self):
            return _in_short(self)
        names = [each.name for each in fields(self) if each.repr]
        words = [f"{name}={_in_short(getattr(self, name))}" for name in names]
        ends = accumulate(len(word) + 2 for word in words)
        kept = [word for word, end in zip(words, ends, strict=True) if end <= SHORT]
        return f"{type(self).__name__}({', '.join([*kept, *(['...'] if len(kept) < len(words) else [])])})"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        raise NotImplementedError  # each answer has its own

    def table(self) -> Table:
        """Give the table that it is saved as."""
        return self.tables()[0]

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        return "".join(table.html() for table in self.tables())

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        """Show it where a notebook or IPython has text alone."""
        printer.text("\n\n".join(table.text() for table in self.tables()))

    def to_dataframe(self) -> pd.DataFrame:
        """Give `table` as a data frame of pandas, numbers in full, units in the heads."""
        return self.table().to_dataframe()

    def to_csv(self, file: str | Path) -> Path:
        """Write `table` as CSV: UTF-8, numbers in full, units in the heads; a file that is there is replaced whole."""
        place = Path(file)
        with replaced(place.parent) as draft:
            (draft / place.name).write_text(self.table().csv(), encoding="utf-8", newline="")
        return place


def _in_short(value: Any) -> str:
    """Write a value as it is where it is short, else its kind and size."""
    text = "" if isinstance(value, Tabled) else repr(value)
    if not text or len(text) > SHORT // 4 or "\n" in text:
        return f"<{type(value).__name__}{(f' of {len(value)}' if isinstance(value, Sized) else '')}>"
    return text


def aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Write heads and rows as lines of text, columns under each other.

    Examples
    --------
    >>> aligned(["side", "x"], [["0", "1.25"], ["1", "10"]])
    ['side  x', '0     1.25', '1     10']
    """
    widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in (heads, *rows)
    ]


def joined(answers: Iterable[Tabled]) -> Table:
    """Put the tables of answers of one kind under each other."""
    tables = [answer.table() for answer in answers]
    first = tables[0]
    return Table(first.columns, [row for table in tables for row in table.rows], first.caption, first.how)


def facts(caption: str, values: Mapping[str, Any], how: str = "") -> Table:
    """Make a table of a few values by their names, a row each."""
    return Table(("", Column("value", show=_few)), values.items(), caption, how)


def _few(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(_plain(value), float) else str(value)


def bands_of(extents: Any) -> list[tuple[int, tuple[float, float]]]:
    """List intervals with their sides, ascending."""
    return [(side, (lo, hi)) for side, parts in sorted(extents.items()) for lo, hi in parts]


def how_found(how: str) -> str:
    """Say how an answer was found; what is not proved says so.

    Examples
    --------
    >>> how_found("proved"), how_found("sampled")
    ('proved', 'sampled, not proved')
    """
    return {"cells": "from sampled images of cells, not proved"}.get(
        how, how if "proved" in how else f"{how}, not proved"
    )
