"""One style for all pictures: readable in grey, with the legend beside the data.

The module needs matplotlib, which is an extra and slow to load.
"""

import io
from collections.abc import Iterable, Iterator
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sdrlinkd.colors import COLORS

LINES = ("-", "--", "-.", ":")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*", "h", "d", "p")
OURS = COLORS[0]
"""The color of our own results beside those of others."""
QUIET = "0.45"
"""The color of captions, bounds and targets."""
DPI = 120


class Look(NamedTuple):
    """Color, line style and marker of one series."""

    color: str
    line: str
    marker: str


def looks(names: Iterable[str], ours: str = "") -> dict[str, Look]:
    """A look for each name, all different even without color.

    The plain black line is for `ours`, or for the first name where there is no `ours`.
    """
    different = list(dict.fromkeys(names))
    first = ours if ours in different else next(iter(different), "")
    others = _others()
    return {name: Look(OURS, "-", "o") if name == first else next(others) for name in different}


def make_figure(
    rows: int = 1,
    columns: int = 1,
    size: tuple[float, float] = (7.2, 4.0),
    **more: Any,  # noqa: ANN401
) -> tuple[Figure, Any]:
    """A figure of `size` inches, and its axes in an array of (rows, columns)."""
    figure, axes = plt.subplots(
        rows, columns, figsize=size, layout="constrained", squeeze=False, **more
    )
    for each in axes.flat:
        each.spines[["top", "right"]].set_visible(False)
        each.grid(visible=True, which="major", alpha=0.25, linewidth=0.6)
        each.set_axisbelow(True)
    return figure, axes


def legend_beside(axes: Axes, title: str = "") -> None:
    """A legend to the right of the axes: never on the data."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(
            loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False, fontsize=8, title=title,
            title_fontsize=8, handlelength=3.2,
        )  # fmt: skip


def legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """One legend for all panels of a figure, below them."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(
            handles, labels, loc="outside lower center", ncols=columns, frameon=False, fontsize=8,
            handlelength=3.2,
        )  # fmt: skip


def save(figure: Figure, path: Path, caption: str) -> None:
    """Write the picture with a caption below it, which names the command that draws it."""
    figure.text(0.01, -0.02, caption, fontsize=7, color=QUIET, va="top", parse_math=False)
    # Without the version of the library, one picture has one content.
    figure.savefig(path, dpi=DPI, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def png_of(figure: Figure) -> bytes:
    """The picture as PNG."""
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=DPI, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)
    return drawn.getvalue()


def _others() -> Iterator[Look]:
    colors, lines, markers = cycle(COLORS[1:]), cycle(LINES[1:] + LINES[:1]), cycle(MARKERS[1:])
    while True:
        yield Look(next(colors), next(lines), next(markers))
