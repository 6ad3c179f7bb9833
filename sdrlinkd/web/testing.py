"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.web.air_log import MOST_BURSTS, AirLog
from sdrlinkd.web.charts import PICTURES, empty_chart, empty_waterfall, newest, series, waterfall
from sdrlinkd.web.history import KEPT_S, MOST_LINES, History
from sdrlinkd.web.map_data import map_paths, map_view
from sdrlinkd.web.positions import position_in
from sdrlinkd.web.track import MOST_POINTS
from sdrlinkd.web.what_if import Choice, foresee, loads_of, policy_of, traffic_of

__all__ = [
    "KEPT_S",
    "MOST_BURSTS",
    "MOST_LINES",
    "MOST_POINTS",
    "PICTURES",
    "AirLog",
    "Choice",
    "History",
    "empty_chart",
    "empty_waterfall",
    "foresee",
    "loads_of",
    "map_paths",
    "map_view",
    "newest",
    "policy_of",
    "position_in",
    "series",
    "traffic_of",
    "waterfall",
]
