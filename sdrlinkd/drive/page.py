"""A drive's report as one HTML page, with everything in it."""

import base64
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

from jinja2 import Environment

from sdrlinkd import __version__
from sdrlinkd.drive.advice import advice, reasons
from sdrlinkd.drive.pictures import map_picture, over_time, verdict_picture
from sdrlinkd.drive.reading import Drive

MOST_EVENTS = 200

PAGE = Path(__file__).with_name("page.html")


def report_page(drive: Drive, title: str) -> str:
    """The page; every name in it is text, whatever it contains."""
    stations = sorted(drive.stations.values(), key=lambda each: each.robot)
    return (
        Environment(autoescape=True)
        .from_string(PAGE.read_text())
        .render(
            title=title,
            begin=time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(drive.begin_ns / 1e9)),
            lasted=f"{drive.lasted_s:.0f} s",
            robots=", ".join(str(each.robot) for each in stations),
            advice=list(advice(drive)),
            deliveries=_deliveries(drive),
            map=_inline(map_picture(drive)),
            verdicts=_inline(verdict_picture(drive)),
            reasons=[
                (each.robot, reason, f"{100 * share:.0f} %")
                for each in stations
                for reason, share in reasons(each)
            ],
            stations=[
                {
                    "robot": each.robot,
                    "picture": _inline(over_time(drive, each)),
                    "dropped": sorted(each.dropped.items(), key=lambda pair: -pair[1]),
                }
                for each in stations
            ],
            events=_rows((f"{at:.1f}", event.robot, event.text) for at, event in drive.events),
            more_events=max(0, len(drive.events) - MOST_EVENTS),
            path=drive.path,
            version=__version__,
        )
    )


def _deliveries(drive: Drive) -> list[Sequence[object]]:
    return [
        (
            source, robot, topic, found.delivered, f"{drive.pdr(robot, source, topic):.4f}",
            _ms(found.age_ms_p50), _ms(found.age_ms_p99),
        )
        for robot, station in sorted(drive.stations.items())
        for (source, topic), found in sorted(station.deliveries.items())
    ]  # fmt: skip


def _rows(rows: Iterable[Sequence[object]]) -> list[Sequence[object]]:
    return [row for _, row in zip(range(MOST_EVENTS), rows, strict=False)]


def _ms(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


def _inline(png: bytes | None) -> str:
    return "" if png is None else base64.b64encode(png).decode()
