"""The tab with a station's last minutes."""

from nicegui import ui

from sdrlinkd.web.charts import PICTURES, empty_chart, empty_waterfall, series, waterfall
from sdrlinkd.web.viewer import Viewer

ONLY_SERIES = {"replaceMerge": ["series"]}


class LinkTab:
    """Pictures of the last ten minutes, and of where messages lose time."""

    is_fast = False

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._charts: dict[str, ui.echart] = {}
        with ui.element("div").classes("sdr-charts"):
            for name, picture in PICTURES.items():
                self._charts[name] = ui.echart(empty_chart(picture)).classes("sdr-chart")
            self._ages = ui.echart(empty_waterfall()).classes("sdr-chart")

    def update(self) -> None:
        """Draw all pictures anew, at the place to which they are scrolled."""
        station = self._viewer.station
        if station is None:
            return
        for name, chart in self._charts.items():
            told = {"series": series(name, station.history)}
            chart.run_chart_method("setOption", told, ONLY_SERIES)
        if station.snapshot is not None:
            told = waterfall(station.snapshot)
            self._ages.run_chart_method("setOption", told, ONLY_SERIES)
