"""The tab with a station's last minutes."""

import json
from pathlib import Path

from nicegui import ui

from sdrlinkd.web.charts import (
    PICTURES,
    empty_chart,
    empty_waterfall,
    newest,
    series,
    waterfall,
)
from sdrlinkd.web.history import KEPT_S
from sdrlinkd.web.viewer import Viewer, now_s

ONLY_SERIES = {"replaceMerge": ["series"]}
APPEND = (Path(__file__).parent / "append.js").read_text()
MISSED_S = 3.0
"""Time in s without an update after which the browser gets whole pictures again."""


class LinkTab:
    """Pictures of the last ten minutes, and of where messages lose time."""

    is_fast = False

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._charts: dict[str, ui.echart] = {}
        self._shown: list[list[str]] = []
        """The lines that the browser has."""
        self._shown_ms = 0
        self._updated_at = float("-inf")
        ui.add_head_html(f"<script>{APPEND}</script>")
        with ui.element("div").classes("sdr-charts"):
            for name, picture in PICTURES.items():
                self._charts[name] = ui.echart(empty_chart(picture)).classes("sdr-chart")
            self._ages = ui.echart(empty_waterfall()).classes("sdr-chart")
        viewer.on_choose.append(self._forget)

    def update(self) -> None:
        """Draw what is new, at the place to which the pictures are scrolled."""
        station, now = self._viewer.station, now_s()
        if station is None or not station.history.times:
            return
        lines = [list(each) for each in station.history.lines.values()]
        if lines == self._shown and now < self._updated_at + MISSED_S:
            self._append(newest(station.history, self._shown_ms))
        else:
            self._shown = lines
            for name, chart in self._charts.items():
                told = {"series": series(name, station.history)}
                chart.run_chart_method("setOption", told, ONLY_SERIES)
        self._shown_ms = round(1000 * station.history.times[-1])
        self._updated_at = now
        if station.snapshot is not None:
            told = waterfall(station.snapshot)
            self._ages.run_chart_method("setOption", told, ONLY_SERIES)

    def _append(self, seconds: list[list[object]]) -> None:
        if seconds:
            charts = {name: chart.id for name, chart in self._charts.items()}
            told = f"{json.dumps(charts)}, {json.dumps(seconds)}, {KEPT_S}"
            ui.run_javascript(f"sdrAppend({told})")

    def _forget(self) -> None:
        self._updated_at = float("-inf")
