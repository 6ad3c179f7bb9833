"""Reads the configuration again while the daemon runs."""

import logging
from collections.abc import Callable

from backends import BUILT_IN
from sdrlinkd.config import Config, Setup, backend_of
from sdrlinkd.errors import UserError
from sdrlinkd.keeping import Keeping
from sdrlinkd.opening import Opening
from sdrlinkd.policies import Policies

log = logging.getLogger("sdrlinkd")

OF_THE_RADIO = ("modem", "gnuradio", "channel", "access", "rate")
"""Sections that are unused while there is no radio, besides the sections of radios that may be
absent."""
ANYTIME = ("topic",)


class Reloading:
    """Applies changes of topic policies and, while there is no radio, of its settings.

    `read` reads the configuration again. `check` raises UserError for errors that the file alone
    shows. `setup` is the one with which the daemon started.
    """

    def __init__(
        self,
        setup: Setup,
        read: Callable[[], Setup],
        check: Callable[[Setup], object],
        policies: Policies,
        opening: Opening,
        keeping: Keeping | None = None,
    ) -> None:
        self._keeping = keeping
        self._setup = setup
        self._read = read
        self._check = check
        self._policies = policies
        self._opening = opening

    def reload(self) -> str:
        """Apply changes, and return a text that names them.

        Raises UserError and then changes nothing.
        """
        changed = self._read()
        told = self._reload(changed)
        keys = self._keeping.reload() if self._keeping is not None else ""
        return f"{keys}, {told}" if keys else told

    def _reload(self, changed: Setup) -> str:
        if changed.registry.digest() != self._setup.registry.digest():
            raise UserError(
                "the topic registry has changed, and topic ids with it; restart the daemon"
            )
        is_same = all(
            getattr(changed.config, key) == getattr(self._opening.config, key, None)
            for key in _of_the_radio(changed.config)
        )
        if self._opening.is_working or (self._opening.is_up and is_same):
            self._policies.reload(changed.table)
            return "topic policies"
        self._check(changed)
        fixed = self._fixed(changed.config)
        if fixed:
            raise UserError(f"{', '.join(fixed)}: changed; restart the daemon to apply it")
        self._policies.reload(changed.table)
        self._opening.try_again(changed)
        return "topic policies and the radio's settings"

    def on_signal(self) -> None:
        """Apply changes on SIGHUP, and log the result."""
        try:
            told = self.reload()
        except UserError as error:
            log.error("not reloaded, nothing changed: %s", error)  # noqa: TRY400
        else:
            log.info("re-read: %s; all other keys need a restart", told)

    def _fixed(self, config: Config) -> list[str]:
        """Changed keys that need a restart."""
        free = {*_of_the_radio(config), *ANYTIME}
        return [
            key
            for key in config.__struct_fields__
            if key not in free and getattr(config, key) != getattr(self._setup.config, key, None)
        ]


def _of_the_radio(config: Config) -> list[str]:
    """The sections that are unused while there is no radio."""
    own = backend_of(config)
    radios = [*BUILT_IN.values(), *([own] if own is not None and own.name not in BUILT_IN else [])]
    return [*OF_THE_RADIO, *(each.name for each in radios if each.may_be_away)]
