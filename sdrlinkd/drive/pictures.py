"""The pictures of a drive's report, as PNG."""

from collections.abc import Mapping

from matplotlib.axes import Axes

from sdrlinkd.colors import COLORS
from sdrlinkd.drive.reading import Drive, Station
from sdrlinkd.pictures import legend_beside, looks, make_figure, png_of

MOST_LINES = 12
LEVELS = {"OK": COLORS[2], "DEGRADED": COLORS[1], "DOWN": COLORS[4]}
TITLES = {
    "snr": ("SNR", "dB"),
    "loss": ("PDUs lost", "%"),
    "air": ("use of the air", "%"),
    "age": ("age of messages, p99", "ms"),
    "queue": ("messages queued", ""),
    "drops": ("messages dropped", "/s"),
    "clock": ("error of clocks at most", "µs"),
}
"""Title and unit of each picture over time."""


def map_picture(drive: Drive) -> bytes | None:
    """The paths of robots, as published (dotted) and as received; None if there are none."""
    if not drive.paths:
        return None
    figure, axes = make_figure(size=(7.2, 5.4))
    (panel,) = axes.flat
    for (robot, at), points in sorted(drive.paths.items(), key=lambda each: str(each[0])):
        color = COLORS[1 + robot % (len(COLORS) - 1)]
        x, y = zip(*points, strict=True)
        label = f"robot {robot}, published" if at is None else f"robot {robot}, at robot {at}"
        style = ":" if at is None else "-"
        width = 3.0 if at is None else 1.2
        panel.plot(x, y, style, color=color, linewidth=width, label=label)
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_xlabel("east, m")
    panel.set_ylabel("north, m")
    legend_beside(panel)
    return png_of(figure)


def verdict_picture(drive: Drive) -> bytes:
    """The verdict of each daemon over time."""
    stations = sorted(drive.stations.values(), key=lambda each: each.robot)
    figure, axes = make_figure(size=(7.2, 0.7 + 0.4 * len(stations)))
    (panel,) = axes.flat
    for row, station in enumerate(stations):
        for level, color in LEVELS.items():
            panel.broken_barh(_spans(station, level), (row - 0.35, 0.7), color=color)
    panel.set_yticks(range(len(stations)), [f"robot {each.robot}" for each in stations])
    panel.set_xlim(0, drive.lasted_s)
    panel.set_xlabel("s")
    return png_of(figure)


def over_time(drive: Drive, station: Station) -> bytes | None:
    """Figures of one daemon over time; None if it reported none."""
    shown = [each for each in TITLES if _has(station.lines.get(each, {}))]
    if not shown:
        return None
    figure, axes = make_figure(len(shown), 1, size=(7.2, 1.9 * len(shown)), sharex=True)
    for panel, name in zip(axes.flat, shown, strict=True):
        _draw(panel, station, name)
    axes.flat[-1].set_xlim(0, drive.lasted_s)
    axes.flat[-1].set_xlabel("s")
    return png_of(figure)


def _draw(panel: Axes, station: Station, name: str) -> None:
    title, unit = TITLES[name]
    lines = station.lines[name]
    known = [each for each in lines if any(value is not None for value in lines[each])]
    chosen = sorted(known, key=lambda each: -_largest(lines[each]))[:MOST_LINES]
    styles = looks(sorted(chosen))
    for line in sorted(chosen):
        look = styles[line]
        values = [float("nan") if each is None else each for each in lines[line]]
        panel.plot(station.times, values, look.line, color=look.color, linewidth=1.2, label=line)
    panel.set_title(f"{title}, {unit}" if unit else title, fontsize=9, loc="left")
    legend_beside(panel)


def _spans(station: Station, level: str) -> list[tuple[float, float]]:
    """(begin, length) in s of the times with a level."""
    spans: list[tuple[float, float]] = []
    ends = [*station.times[1:], station.times[-1] + 1.0]
    for begin, end, found in zip(station.times, ends, station.levels, strict=True):
        if found == level:
            spans.append((begin, end - begin))
    return spans


def _has(lines: Mapping[str, list[float | None]]) -> bool:
    return any(each for line in lines.values() for each in line)


def _largest(line: list[float | None]) -> float:
    return max((abs(each) for each in line if each is not None), default=0.0)
