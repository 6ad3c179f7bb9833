"""Relaying by routes that somebody wrote down, and by flooding."""

import re

from sdrlinkd.errors import ConfigError
from sdrlinkd.link.routes.params import RelayParams
from sdrlinkd.wire import BROADCAST

_ROUTE = re.compile(r"(any|\d{1,3})>(all|any|\d{1,3})")
_ANY = -1


class FixedRoutes:
    """What is relayed whatever the team hears. Raises ConfigError for invalid routes."""

    def __init__(self, params: RelayParams) -> None:
        self._floods = params.policy == "flood"
        routes = {_route(each) for each in params.routes}
        self._routes = routes if params.policy == "routes" else set()

    @property
    def is_on(self) -> bool:
        """Whether anything is relayed."""
        return self._floods or bool(self._routes)

    def wants(self, src: int, dst: int) -> bool:
        """Whether PDUs of `src` to `dst` are relayed."""
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
