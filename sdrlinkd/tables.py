"""Tables that fit the screen: columns drop out by rank, names wrap, figures are never cut."""

import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import NamedTuple

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table
from rich.text import Text

NOTHING = "–"
"""Placeholder for a missing figure."""
FILE_WIDTH = 100
"""Width in characters of a file or pipe; the COLUMNS variable overrides it."""
SCREEN = (80, 24)
"""Smallest supported screen: columns and lines."""
GAP = 2
LEAST_NAME = 12

Bar = Callable[[int], Text]
"""A cell that draws itself in a given number of characters."""
Cell = str | Text | Bar


class Column(NamedTuple):
    """A column of a table.

    Where columns do not fit, the one of the highest rank is left out first; rank 0 always stays.
    Figures keep their width. Words wrap at `/`, `_` and spaces, down to `least` characters. The
    cells of a bar column are functions of the width, from `least` to `most` characters.
    """

    name: str
    rank: int = 0
    kind: str = "figure"
    """figure | words | bar"""
    least: int = LEAST_NAME
    most: int = 30
    style: str = ""


def words(title: str, rank: int = 0, least: int = LEAST_NAME) -> Column:
    """A column of names or sentences, on the left."""
    return Column(title, rank, "words", least)


def figure(title: str, rank: int = 0) -> Column:
    """A column of figures, on the right."""
    return Column(title, rank)


def bar(title: str, rank: int, least: int = 10, most: int = 30) -> Column:
    """A column of bars, drawn into the remaining width."""
    return Column(title, rank, "bar", least, most)


class FittedTable:
    """A rich table that chooses its columns once the width is known.

    `rule` puts a line below the heads and an empty line around the table; without it the table
    takes the fewest lines.
    """

    def __init__(
        self, title: str, columns: Sequence[Column], *, rule: bool = True, heads: bool = True
    ) -> None:
        self.title = title
        self.columns = tuple(columns)
        self.rows: list[tuple[tuple[Cell, ...], str]] = []
        self._rule = rule
        self._heads = heads

    def add(self, *cells: Cell, style: str = "") -> None:
        """Add a row, with a cell for each column."""
        if len(cells) != len(self.columns):
            raise ValueError(f"{len(cells)} cells for {len(self.columns)} columns")
        self.rows.append((cells, style))

    def widths(self, width: int) -> dict[int, int]:
        """Width of each column shown on a screen of `width`, by the column's index."""
        natural = {place: self._natural(place) for place in range(len(self.columns))}
        least = {place: self._least(place, natural[place]) for place in natural}
        room = width - (2 if self._rule else 0) + GAP
        leaving = sorted(
            (place for place in natural if self.columns[place].rank),
            key=lambda place: (self.columns[place].rank, place),
        )
        while leaving and sum(least.values()) + GAP * len(least) > room:
            place = leaving.pop()
            del natural[place], least[place]
        while sum(natural.values()) + GAP * len(natural) > room:
            elastic = [place for place in natural if natural[place] > least[place]]
            if not elastic:
                # On a tiny screen, break words into pieces rather than cut a figure.
                elastic = [
                    place for place in natural
                    if self.columns[place].kind == "words" and natural[place] > 1
                ]  # fmt: skip
            if not elastic:
                break
            # A bar gives way before a name does.
            place = max(elastic, key=lambda each: (self._is_bar(each), natural[each]))
            natural[place] -= 1
        return natural

    def heights(self, width: int) -> list[int]:
        """Lines that each row takes on a screen of `width`."""
        widths = self.widths(width)
        return [
            max(1 + self._drawn(cells[place], widths[place]).plain.count("\n") for place in widths)
            for cells, _ in self.rows
        ]

    def fitted(self, width: int, n_rows: int | None = None) -> Table:
        """The table for a screen of `width`; with `n_rows`, its first rows only."""
        widths = self.widths(width)
        table = Table(
            box=box.SIMPLE_HEAD if self._rule else None,
            padding=(0, 1) if self._rule else (0, GAP, 0, 0),
            pad_edge=False,
            show_header=self._heads,
            collapse_padding=self._rule,
        )
        for place, n in widths.items():
            column = self.columns[place]
            table.add_column(
                column.name, justify="right" if column.kind == "figure" else "left",
                width=n, overflow="fold", style=column.style,
            )  # fmt: skip
        for cells, style in self.rows[:n_rows]:
            table.add_row(*(self._drawn(cells[place], n) for place, n in widths.items()),
                          style=style)  # fmt: skip
        return table

    def texts(self, widths: dict[int, int]) -> list[list[Text]]:
        """The cells of every row, fitted to `widths`, for a table of another library."""
        told = []
        for cells, style in self.rows:
            row = [self._drawn(cells[place], n) for place, n in widths.items()]
            for text, place in zip(row, widths, strict=True):
                text.justify = "right" if self.columns[place].kind == "figure" else "left"
                text.stylize(style)
            told.append(row)
        return told

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if self.title:
            yield Text(self.title, style="italic")
        yield self.fitted(options.max_width)

    def _is_bar(self, place: int) -> bool:
        return self.columns[place].kind == "bar"

    def _natural(self, place: int) -> int:
        column = self.columns[place]
        if column.kind == "bar":
            return column.most
        cells = (cells[place] for cells, _ in self.rows)
        return max((_length(column.name), *(_length(cell) for cell in cells)))

    def _least(self, place: int, natural: int) -> int:
        column = self.columns[place]
        if column.kind == "figure":
            return natural
        return min(natural, max(column.least, _length(column.name)))

    def _drawn(self, cell: Cell, width: int) -> Text:
        if callable(cell):
            return cell(width)
        if isinstance(cell, Text):
            return Text(wrapped(cell.plain, width), style=cell.style)
        return Text(wrapped(cell, width))


def _length(cell: Cell) -> int:
    if callable(cell):
        return 0
    text = cell.plain if isinstance(cell, Text) else cell
    return max((cell_len(line) for line in text.split("\n")), default=0)


def wrapped(text: str, width: int) -> str:
    """`text` in lines of at most `width` characters, broken at spaces.

    A longer word is broken before `/` and after `_`, and failing that, anywhere.
    """
    lines = []
    for paragraph in text.split("\n"):
        line = ""
        for word in re.findall(r" ?[^ ]*", paragraph):
            is_whole = cell_len(word.lstrip(" ")) <= width
            for part in [word] if is_whole else re.findall(r" ?/?[^/_, ]*[_,]?", word):
                piece = part
                if cell_len(line + piece) > width and line:
                    lines.append(line.rstrip())
                    line, piece = "", piece.lstrip(" ")
                while cell_len(piece) > width:
                    lines.append(piece[:width])
                    piece = piece[width:]
                line += piece
        lines.append(line.rstrip())
    return "\n".join(lines)


def screen_console(*, stderr: bool = False) -> Console:
    """The console of a command: as wide as the terminal, else COLUMNS, else 100 characters."""
    stream = sys.stderr if stderr else sys.stdout
    if stream.isatty() or os.environ.get("COLUMNS", "").isdigit():
        return Console(stderr=stderr)
    return Console(stderr=stderr, width=FILE_WIDTH)
