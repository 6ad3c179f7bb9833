"""The page: a line with the verdict, and the tabs."""

from pathlib import Path
from typing import Protocol

from nicegui import ui
from nicegui.events import KeyEventArguments

from sdrlinkd.health import first_line
from sdrlinkd.web.air_tab import AirTab
from sdrlinkd.web.link_tab import LinkTab
from sdrlinkd.web.map_tab import MapTab
from sdrlinkd.web.topics_tab import TopicsTab
from sdrlinkd.web.viewer import Viewer, now_s
from sdrlinkd.web.what_if_tab import WhatIfTab
from sdrlinkd.web.world import Station

PERIOD_S = 0.2
SLOW = 5
"""Updates of the map for one of everything else."""


class Tab(Protocol):
    """What a tab offers."""

    is_fast: bool
    """Whether it is to be updated every PERIOD_S; otherwise once a second."""

    def __init__(self, viewer: Viewer) -> None: ...

    def update(self) -> None:
        """Show what is new."""


STYLE = (Path(__file__).parent / "style.css").read_text()
TABS: dict[str, type[Tab]] = {
    "Map": MapTab,
    "Link": LinkTab,
    "Air": AirTab,
    "Topics": TopicsTab,
    "What if": WhatIfTab,
}
LEVELS = ("OK", "DEGRADED", "DOWN")
WAITING = "no daemon answers yet"


def build_page(viewer: Viewer) -> None:
    """Build the page for one browser, and keep it fresh."""
    ui.add_css(STYLE)
    ui.colors(primary="#0072b2", accent="#d55e00")
    head = _Head(viewer)
    with ui.tabs().props("align=left") as tabs:
        for name in TABS:
            ui.tab(name)
    with ui.tab_panels(tabs, value="Map", keep_alive=True).classes("sdr-panels"):
        shown: dict[str, Tab] = {}
        for name, make in TABS.items():
            with ui.tab_panel(name).classes("sdr-panel"):
                shown[name] = make(viewer)
    ui.keyboard(lambda event: _key(event, tabs, head))
    count = 0

    def update() -> None:
        nonlocal count
        is_slow = count % SLOW == 0
        count += 1
        if is_slow:
            head.update()
        tab = shown[tabs.value]
        if not viewer.is_paused and (is_slow or tab.is_fast):
            tab.update()

    ui.timer(PERIOD_S, update)


class _Head:
    """The line at the top: which daemon, how it is, and what can be done."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        dark = ui.dark_mode()
        with ui.header().classes("sdr-header"):
            ui.label("sdrlinkd").classes("sdr-name")
            self._stations = ui.select({}, on_change=lambda event: self._choose(event.value))
            self._stations.props('dense outlined aria-label="Daemon"').classes("sdr-stations")
            self._verdict = ui.label(WAITING).classes("sdr-verdict")
            self._pause = ui.button("pause", on_click=self.pause).props("flat")
            ui.button("dark", on_click=dark.toggle).props("flat")

    def update(self) -> None:
        """Show the present verdict, and which daemons there are."""
        viewer, now = self._viewer, now_s()
        station, names = viewer.station, viewer.names
        if names != self._stations.options or self._stations.value != viewer.chosen:
            self._stations.set_options(names, value=viewer.chosen or None)
        level, words = _verdict(station, now)
        self._verdict.text = words
        self._verdict.classes(level, remove=" ".join(LEVELS))

    def pause(self) -> None:
        """Stop or go on."""
        self._viewer.is_paused = not self._viewer.is_paused
        self._pause.text = "go on" if self._viewer.is_paused else "pause"

    def _choose(self, key: str | None) -> None:
        if key and key != self._viewer.chosen:
            self._viewer.choose(key)


def _verdict(station: Station | None, now: float) -> tuple[str, str]:
    """The level of a station's verdict, and the line that says it."""
    if station is None or station.snapshot is None:
        return "DOWN", WAITING
    if station.is_away(now):
        return "DOWN", f"no answer for {now - station.at:.0f} s"
    verdict = station.snapshot.verdict
    return verdict.level, first_line(verdict)


def _key(event: KeyEventArguments, tabs: ui.tabs, head: _Head) -> None:
    """Keys 1 and on choose a tab; P pauses."""
    if not event.action.keydown or event.action.repeat:
        return
    names = list(TABS)
    if event.key.number is not None and 1 <= event.key.number <= len(names):
        tabs.value = names[event.key.number - 1]
    elif event.key == "p":
        head.pause()
