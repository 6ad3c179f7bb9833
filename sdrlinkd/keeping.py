"""Keeps the state of sealing on disk ahead of its use, and takes new keys while all runs."""

import asyncio
import contextlib
import logging
import os
import time
from collections.abc import Callable, Sequence
from math import inf
from pathlib import Path

from sdrlinkd.config import Setup
from sdrlinkd.errors import UserError
from sdrlinkd.kernelclock import is_synchronized
from sdrlinkd.keyring import KeyState, load_keys, machine_tag, state_dir
from sdrlinkd.sealing import Key, Remembered, Sealing

AGES_S = 5.0
"""Time in s between two looks at the host's clock."""
log = logging.getLogger("sdrlinkd")


class Keeping:
    """Writes what `sealing` must remember to `state`; `read` reads the key file again.

    Raises UserError if it cannot be written for the first time.
    """

    def __init__(
        self, sealing: Sealing, state: KeyState, keys: Sequence[Key], read: Callable[[], list[Key]]
    ) -> None:
        self.sealing = sealing
        self._state = state
        self._keys = list(keys)
        self._read = read
        self._writing: asyncio.Task[None] | None = None
        self._aged_at = -inf
        if sealing.is_lost:
            log.warning(
                "the numbers of the key are lost here, or it was never installed (then: sdrlinkctl "
                "key install --new): nothing is sealed before it is known which ones were used"
            )
        wanted = sealing.memory.wanted(0.0)
        if wanted is None:
            return
        try:
            state.save(wanted)
        except OSError as error:
            raise UserError(
                f"security.state_dir: {state.directory} cannot be written ({error.strerror})"
            ) from None
        sealing.memory.written(wanted)

    def look(self, now: float, *, at_once: bool) -> None:
        """Write what is due at `now`: in a thread, or `at_once`, where time waits for us."""
        # The link's clock may begin anew.
        if not at_once and not 0 <= now - self._aged_at < AGES_S:
            self._aged_at = now
            self._tell_ages(now)
        if self._writing is not None and not self._writing.done():
            return
        wanted = self.sealing.memory.wanted(now)
        if wanted is None:
            return
        if at_once:
            self._note(wanted, self._problem(wanted))
        else:
            self._writing = asyncio.ensure_future(self._write(wanted))

    def reload(self) -> str:
        """Take the keys of the file from now on; returns what changed. Raises UserError."""
        keys = self._read()
        known = self.sealing.memory.on_disk.floors
        if keys == self._keys and all(key.fingerprint in known for key in keys):
            return ""
        loaded = self._state.load(keys)
        self.sealing.install(usable(keys, loaded), loaded)
        self._keys = keys
        log.info("keys: %s", ", ".join(str(key.kid) for key in keys))
        return "keys"

    def close(self) -> None:
        """Write the newest numbers heard, and let other processes in."""
        with contextlib.suppress(OSError):
            self._state.save(self.sealing.memory.at_stop())
        self._state.close()

    def _tell_ages(self, now: float) -> None:
        """Tell how old the keys are, as long as this host's clock is synchronized."""
        host_s = 1e-9 * time.time_ns()
        ages_s = {
            key.fingerprint: host_s - key.made_s for key in self._keys if key.made_s is not None
        }
        self.sealing.tell_ages(ages_s if is_synchronized() else {}, now)

    async def _write(self, wanted: Remembered) -> None:
        self._note(wanted, await asyncio.to_thread(self._problem, wanted))

    def _problem(self, wanted: Remembered) -> str:
        """Write to disk; returns what went wrong, if anything."""
        try:
            self._state.save(wanted)
        except OSError as error:
            return error.strerror or str(error)
        return ""

    def _note(self, wanted: Remembered, problem: str) -> None:
        if not problem:
            self.sealing.memory.written(wanted)
            return
        if not self.sealing.memory.failed:
            log.error("%s cannot be written (%s)", self._state.directory, problem)
        self.sealing.memory.not_written(problem)


def open_keeping(setup: Setup) -> Keeping | None:
    """The keys of a robot, and their state on disk; None without keys. Raises UserError."""
    security = setup.config.security
    if security.mode == "off":
        return None
    path, state = Path(security.keys), key_state(setup)
    state.check()
    keys = load_keys(path)
    try:
        remembered = state.hold().load(keys)
        if state.moved:
            log.warning(
                "the numbers of the keys come from another machine, so an hour of them is "
                "skipped; if that machine still runs, give this robot an id of its own"
            )
        sealing = Sealing(
            setup.node_id, setup.config.link.pdu_size, security, usable(keys, remembered),
            remembered, os.urandom,
            hears_self=setup.config.hears_self, machine=machine_tag(),
        )  # fmt: skip
        return Keeping(sealing, state, keys, lambda: load_keys(path))
    except UserError:
        state.close()
        raise


def usable(keys: Sequence[Key], loaded: Remembered) -> list[Key]:
    """The keys that were not replaced by a next one. Raises UserError if there is none."""
    found = [key for key in keys if key.fingerprint not in loaded.retired]
    if not found:
        raise UserError(
            "the keys of this robot were replaced by a next one, and do not open any more; "
            "allowed: that one: sdrlinkctl key install"
        )
    return found


def key_state(setup: Setup) -> KeyState:
    """The state of a robot's keys on this machine."""
    source = Path(setup.source) if setup.source else None
    return KeyState(state_dir(setup.config.security.state_dir, source), setup.node_id)
