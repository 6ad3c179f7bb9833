"""Reads the configuration again while the daemon runs."""

import logging
from collections.abc import Callable

from sdrlinkd.config import Config, Setup
from sdrlinkd.errors import UserError
from sdrlinkd.opening import Opening
from sdrlinkd.policies import Policies

log = logging.getLogger("sdrlinkd")

OF_THE_RADIO = ("modem", "soapy", "ether", "zmq", "gnuradio", "channel", "access", "rate")
"""Sections that may change while there is no radio: nobody has used them yet."""
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
            getattr(changed.config, key) == getattr(self._opening.config, key)
            for key in OF_THE_RADIO
        )
        if self._opening.is_working or (self._opening.is_up and is_same):
            self._policies.reload(changed.policies)
            return "topic policies"
        self._check(changed)
        fixed = self._fixed(changed.config)
        if fixed:
            raise UserError(f"{', '.join(fixed)}: changed; restart the daemon for that")
        self._policies.reload(changed.policies)
        self._opening.try_again(changed)
        return "topic policies and the radio's settings"

    def on_signal(self) -> None:
        """Apply what has changed, on SIGHUP, and tell the log."""
        try:
            told = self.reload()
        except UserError as error:
            log.error("not reloaded, all stays as it was: %s", error)  # noqa: TRY400
        else:
            log.info("re-read: %s; all other keys need a restart", told)

    def _fixed(self, config: Config) -> list[str]:
        """Keys that have changed and may not without a restart."""
        return [
            key
            for key in Config.__struct_fields__
            if key not in (*OF_THE_RADIO, *ANYTIME)
            and getattr(config, key) != getattr(self._setup.config, key)
        ]
