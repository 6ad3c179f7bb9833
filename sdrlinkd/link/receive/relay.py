"""Decides which PDUs of others are relayed."""

import re
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from sdrlinkd.errors import ConfigError
from sdrlinkd.wire import BROADCAST, Pdu

_ROUTE = re.compile(r"(any|\d{1,3})>(all|any|\d{1,3})")
_ANY = -1


class RelayParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of relays, which forward PDUs between robots that do not hear each other."""

    policy: Literal["none", "routes", "flood"] = "none"
    """What is relayed; routes: what `routes` names; flood: every PDU until its hops are used up."""
    routes: list[str] = []
    """Routes as "FROM>TO", by robot id: "1>3", "any>3", "1>all" (broadcasts), "any>any"."""
    lifespan_s: Annotated[float, Meta(gt=0, le=10)] = 1.0
    """Longest wait in s of a PDU to be relayed. Keep it below the time after which a topic reuses
    an entry id."""


class Relay:
    """Decides by source and destination what is relayed. Raises ConfigError for invalid routes."""

    def __init__(self, params: RelayParams, own_id: int) -> None:
        self._own_id = own_id
        self._floods = params.policy == "flood"
        self._routes = {_route(each) for each in params.routes}
        if params.policy == "none":
            self._routes = set()
        self.lifespan_s = params.lifespan_s

    @property
    def is_on(self) -> bool:
        """Whether this node relays any PDUs."""
        return self._floods or bool(self._routes)

    def wants(self, pdu: Pdu) -> bool:
        """Whether a PDU is relayed; it never goes back to its source."""
        src, dst = pdu.src, pdu.dst
        if pdu.hop < 2 or self._own_id in (src, dst) or src == dst:
            return False
        routes = self._routes
        return self._floods or any(
            each in routes for each in ((src, dst), (_ANY, dst), (src, _ANY), (_ANY, _ANY))
        )


def _route(text: str) -> tuple[int, int]:
    found = _ROUTE.fullmatch(text.replace(" ", ""))
    ends = [_end(each) for each in found.groups()] if found else []
    if not ends or max(ends) > BROADCAST or ends[0] == BROADCAST:
        raise ConfigError(
            f'relay.routes: got "{text}"; allowed: FROM>TO, robots by their ids, such as "1>3"; '
            '"any" for all of them, and ">all" for what is sent to everyone'
        )
    return ends[0], ends[1]


def _end(text: str) -> int:
    return {"any": _ANY, "all": BROADCAST}.get(text, -2) if text.isalpha() else int(text)
