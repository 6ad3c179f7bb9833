"""Routes: who relays what, by hand, by flooding, or by what the team knows of its links.

This package measures how well other robots are heard, floods that as LSA records, finds the best
paths, names those who forward next in ROUTE records, and goes around a robot that does not answer.
It owns the links of the team and what this robot was named for. It sends nothing itself, and does
not touch a PDU: `receive` asks it what to relay, `queue` holds what waits, and `transmit` sends the
records.
"""

from sdrlinkd.link.paths import cost_of, path, tree
from sdrlinkd.link.routes.fixed import FixedRoutes
from sdrlinkd.link.routes.forwarding import Again
from sdrlinkd.link.routes.params import RelayParams
from sdrlinkd.link.routes.routes import Routes
from sdrlinkd.link.routes.to_relay import PduToRelay

__all__ = [
    "Again",
    "FixedRoutes",
    "PduToRelay",
    "RelayParams",
    "Routes",
    "cost_of",
    "path",
    "tree",
]
