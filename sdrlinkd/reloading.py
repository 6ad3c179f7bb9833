"""Reads the configuration again while the daemon runs."""

import logging
from collections.abc import Callable

from backends import BUILT_IN
from sdrlinkd.config import Config, Setup, backend_of
from sdrlinkd.errors import UserError
from sdrlinkd.opening import Opening
from sdrlinkd.policies import Policies

log = logging.getLogger("sdrlinkd")

OF_THE_RADIO = ("modem", "gnuradio", "channel", "access", "rate")
"""Sections that nobody has used while there is no radio, besides those of radios that may be away.
"""
ANYTIME = ("topic",)


class Reloading:
    """Applies what may change: the topic policies and, while there is no radio, its settings.

    `read` reads the configuration anew; `check` raises UserError for what the file alone tells to
    be wrong; `setup` is what was begun with.
    """

    def __init__(
        self,
        setup: Setup,
        read: Callable[[], Setup],
        check: Callable[[Setup], object],
        policies: Policies,
        opening: Opening,
    ) -> None:
        self._setup = setup
        self._read = read
        self._check = check
        self._policies = policies
        self._opening = opening

    def reload(self) -> str:
        """Apply what has changed; returns which parts were. Raises UserError, changing nothing."""
        changed = self._read()
        if changed.registry.digest() != self._setup.registry.digest():
            raise UserError(
                "the topic registry has changed, and topic ids with it; restart the daemon"
            )
        is_same = all(
            getattr(changed.config, key) == getattr(self._opening.config, key, None)
            for key in _of_the_radio(changed.config)
        )
        if self._opening.is_working or (self._opening.is_up and is_same):
            self._policies.reload(changed.policies)
            return "topic policies"
        self._check(changed)
        fixed = self._fixed(changed.config)
        if fixed:
            raise UserError(f"{', '.join(fixed)}: changed; restart the daemon to apply it")
        self._policies.reload(changed.policies)
        self._opening.try_again(changed)
        return "topic policies and the radio's settings"

    def on_signal(self) -> None:
        """Apply what has changed, on SIGHUP, and tell the log."""
        try:
            told = self.reload()
        except UserError as error:
            log.error("not reloaded, nothing changed: %s", error)  # noqa: TRY400
        else:
            log.info("re-read: %s; all other keys need a restart", told)

    def _fixed(self, config: Config) -> list[str]:
        """Keys that have changed and may not without a restart."""
        free = {*_of_the_radio(config), *ANYTIME}
        return [
            key
            for key in config.__struct_fields__
            if key not in free and getattr(config, key) != getattr(self._setup.config, key, None)
        ]


def _of_the_radio(config: Config) -> list[str]:
    """The sections that nobody has used while there is no radio."""
    own = backend_of(config)
    radios = [*BUILT_IN.values(), *([own] if own is not None and own.name not in BUILT_IN else [])]
    return [*OF_THE_RADIO, *(each.name for each in radios if each.may_be_away)]
