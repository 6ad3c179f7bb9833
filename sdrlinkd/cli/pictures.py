"""Draws the links of a team as a graph; needs matplotlib."""

from math import cos, pi, sin
from pathlib import Path

from sdrlinkd.colors import COLORS
from sdrlinkd.pictures import OURS, QUIET, make_figure, save
from sdrlinkd.reports import RoutesReport

SIZE = (5.0, 5.0)
ASIDE = 0.36
"""How far along a line its figure stands: in the middle, lines cross."""
WIDEST = 4.0
"""Width in points of a line that stands for a link without loss."""


def draw_routes(own: int, routes: RoutesReport, path: Path) -> None:
    """Draw each robot on a circle, each link by its worse direction, and who forwards for us."""
    figure, panels = make_figure(1, 1, SIZE)
    axes = panels[0, 0]
    ids = sorted(each.id for each in routes.robots)
    at = {
        robot: (cos(2 * pi * i / len(ids) + pi / 2), sin(2 * pi * i / len(ids) + pi / 2))
        for i, robot in enumerate(ids)
    }
    hears = {each.id: each.hears for each in routes.robots}
    named = {robot for flow in routes.flows if flow.src == own for robot in flow.forwarded_by}
    for one in ids:
        for other in ids:
            share = min(hears[one].get(other, 0.0), hears[other].get(one, 0.0))
            if one < other and share > 0:
                is_way = own in (one, other) and (one in named or other in named)
                (x, x2), (y, y2) = zip(at[one], at[other], strict=True)
                axes.plot(
                    (x, x2), (y, y2), color=COLORS[4] if is_way else QUIET,
                    linewidth=WIDEST * share**2 + 0.3, zorder=1,
                )  # fmt: skip
                aside = x + ASIDE * (x2 - x), y + ASIDE * (y2 - y)
                axes.annotate(
                    f"{100 * share:.0f} %", aside, fontsize=7,
                    ha="center", va="center", color=QUIET,
                    bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
                )  # fmt: skip
    for robot, (x, y) in at.items():
        color = OURS if robot == own else COLORS[2]
        axes.scatter([x], [y], s=500, color=color, marker="s" if robot in named else "o", zorder=2)
        axes.annotate(str(robot), (x, y), color="white", ha="center", va="center", zorder=3)
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.margins(0.15)
    axes.set_title(
        "share of PDUs over the worse way of each link; squares forward for us", fontsize=8
    )
    save(figure, path, f"sdrlinkctl routes --picture {path.name}")
