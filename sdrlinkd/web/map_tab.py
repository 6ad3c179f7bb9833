"""The tab with the map."""

from nicegui.element import Element

from sdrlinkd.colors import COLORS
from sdrlinkd.web.map_data import map_paths, map_view
from sdrlinkd.web.viewer import Viewer, now_s

PATHS_EVERY = 5
"""Updates of the robots' places for one of their paths."""


class _Map(Element, component="map.js"):
    """The drawing; its methods bring what is new."""


class MapTab:
    """Robots, paths and links; `update` is called five times a second."""

    is_fast = True

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._map = _Map()
        self._map.props["colors"] = [each for each in COLORS if each != "#000000"]
        if viewer.plan is not None:
            self._map.props["plan"] = viewer.plan._asdict()
        self._map.on("ready", self._draw_all)
        self._n = 0
        viewer.on_choose.append(self._draw_all)

    def update(self) -> None:
        """Draw what is new."""
        if self._n % PATHS_EVERY == 0:
            self._draw_all()
            return
        self._n += 1
        self._draw()

    def _draw_all(self) -> None:
        self._n = 1
        self._map.run_method("trails", map_paths(self._viewer.world, self._viewer.station))
        self._draw()

    def _draw(self) -> None:
        view = map_view(self._viewer.world, self._viewer.station, now_s())
        self._map.run_method("show", view)
