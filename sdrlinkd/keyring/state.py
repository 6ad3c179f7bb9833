"""What sealing must remember, on disk: a file for each key, written whole or not at all.

A file holds the floor of the key's numbers and the newest numbers heard from others. It also names
the machine: a copy of a disk may go on from numbers that the original has used since.
"""

import contextlib
import fcntl
import hashlib
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Self

import msgspec

from sdrlinkd.errors import UserError
from sdrlinkd.sealing import Key, Remembered
from sdrlinkd.wire import N_TICKS, TICKS_PER_S

MACHINE_ID = Path("/etc/machine-id")
SYSTEM_CONFIG, SYSTEM_STATE = Path("/etc/sdrlinkd"), Path("/var/lib")
OTHER_MACHINE_S = 3600
"""Key time in s that is skipped when a state comes from another machine."""


class _OfKey(msgspec.Struct, frozen=True, kw_only=True):
    """The file of one key: its floor in 1/32 s, and the newest T of each robot."""

    fingerprint: str
    machine: str
    floor: int
    in_use: bool = False
    retired: bool = False
    newest: dict[int, int] = {}


class KeyState:
    """The state of one robot's keys in a directory; only one process may hold it."""

    def __init__(self, directory: Path, robot_id: int) -> None:
        self.directory = directory
        self._robot_id = robot_id
        self._lock: int | None = None
        self._written: dict[bytes, _OfKey] = {}
        self.moved: list[bytes] = []
        """Fingerprints of keys whose state came from another machine."""

    def hold(self) -> Self:
        """Keep other processes out until `close`. Raises UserError."""
        path = self.directory / f"robot-{self._robot_id}.lock"
        try:
            self._lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        except OSError as error:
            raise UserError(self._unusable(error)) from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self.close()
            raise UserError(
                f"{self.directory}: another daemon seals as robot {self._robot_id} with this "
                "directory; allowed: one"
            ) from None
        return self

    def close(self) -> None:
        """Let other processes in."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def load(self, keys: Sequence[Key]) -> Remembered:
        """What is on disk about `keys`, all of which must be installed here. Raises UserError."""
        floors, newest, in_use, retired = {}, {}, b"", set()
        machine = machine_hash()
        for key in keys:
            state = self._read(key.fingerprint)
            if state is None:
                raise UserError(
                    f"{self.directory}: no numbers of key {key.kid}. If it was never installed on "
                    "this robot: sdrlinkctl key install. If they are lost: sdrlinkctl key rotate, "
                    "as a number must never be used twice"
                )
            floor = state.floor
            if state.machine != machine:
                self.moved.append(key.fingerprint)
                floor = min(floor + OTHER_MACHINE_S * TICKS_PER_S, N_TICKS)
            floors[key.fingerprint] = floor
            newest[key.fingerprint] = state.newest
            if state.in_use:
                in_use = key.fingerprint
            if state.retired:
                retired.add(key.fingerprint)
        return Remembered(floors, newest, in_use, frozenset(retired), self._known())

    def save(self, remembered: Remembered) -> None:
        """Write what must be remembered; it is on disk on return. Raises OSError."""
        machine = machine_hash()
        for fingerprint, floor in remembered.floors.items():
            state = _OfKey(
                fingerprint=fingerprint.hex(),
                machine=machine,
                floor=floor,
                in_use=fingerprint == remembered.in_use,
                retired=fingerprint in remembered.retired,
                newest=dict(remembered.newest.get(fingerprint, {})),
            )
            if self._written.get(fingerprint) != state:
                self._write(state)
                self._written[fingerprint] = state

    def install(self, key: Key, owner: tuple[int, int] | None) -> bool:
        """Begin the state of a new key; False if it was there already. Raises UserError."""
        if self._read(key.fingerprint) is not None:
            return False
        state = _OfKey(fingerprint=key.fingerprint.hex(), machine=machine_hash(), floor=0)
        try:
            self._write(state, owner)
        except OSError as error:
            raise UserError(self._unusable(error)) from None
        return True

    def forget(self, key: Key) -> None:
        """Remove the state of a key that was just begun."""
        self._path(key.fingerprint.hex()).unlink(missing_ok=True)

    def check(self) -> None:
        """Check that the directory can be written. Raises UserError."""
        try:
            self.directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(dir=self.directory, prefix=".try-"):
                pass
        except OSError as error:
            raise UserError(self._unusable(error)) from None

    def _known(self) -> frozenset[int]:
        """All robots of which a sealed PDU was opened, with whatever key."""
        found: set[int] = set()
        for path in self.directory.glob(f"robot-{self._robot_id}-key-*.json"):
            with contextlib.suppress(OSError, msgspec.MsgspecError, ValueError):
                found |= msgspec.json.decode(path.read_bytes(), type=_OfKey).newest.keys()
        return frozenset(found)

    def _unusable(self, error: OSError) -> str:
        return (
            f"security.state_dir: {self.directory} cannot be used ({error.strerror}); allowed: a "
            "directory that this user may write to, as numbers must survive a restart"
        )

    def _path(self, fingerprint: str) -> Path:
        return self.directory / f"robot-{self._robot_id}-key-{fingerprint[:16]}.json"

    def _read(self, fingerprint: bytes) -> _OfKey | None:
        path = self._path(fingerprint.hex())
        try:
            state = msgspec.json.decode(path.read_bytes(), type=_OfKey)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise UserError(f"{path} cannot be read ({error.strerror})") from None
        except (msgspec.MsgspecError, ValueError) as error:
            raise UserError(
                f"{path} is damaged ({error}); without its numbers the key must not be used: make "
                "the next one with sdrlinkctl key rotate"
            ) from None
        if state.fingerprint != fingerprint.hex() or not 0 <= state.floor <= N_TICKS:
            raise UserError(f"{path} is not the state of this key; make the next one instead")
        return state

    def _write(self, state: _OfKey, owner: tuple[int, int] | None = None) -> None:
        path = self._path(state.fingerprint)
        handle, name = tempfile.mkstemp(dir=self.directory, prefix=".state-")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(msgspec.json.encode(state) + b"\n")
                if owner is not None:
                    os.fchown(file.fileno(), *owner)
                file.flush()
                os.fsync(file.fileno())
            Path(name).replace(path)
        except OSError:
            with contextlib.suppress(OSError):
                Path(name).unlink()
            raise
        folder = os.open(self.directory, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def state_dir(given: str, config_path: Path | None) -> Path:
    """The directory of the key state: `given`, systemd's, or the user's.

    The service with the configuration /etc/sdrlinkd/NAME.toml has /var/lib/sdrlinkd-NAME.
    """
    if given:
        return Path(given)
    systemd = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    if systemd:
        return Path(systemd)
    if config_path is not None and config_path.absolute().parent == SYSTEM_CONFIG:
        name = config_path.stem
        return SYSTEM_STATE / ("sdrlinkd" if name == "sdrlinkd" else f"sdrlinkd-{name}")
    base = os.environ.get("XDG_STATE_HOME")
    return (Path(base) if base else Path.home() / ".local/state") / "sdrlinkd"


def machine_hash() -> str:
    """What tells this machine from others; empty if it has no id."""
    try:
        own = MACHINE_ID.read_bytes().strip()
    except OSError:
        return ""
    return hashlib.sha256(b"sdrlinkd" + own).hexdigest()[:16] if own else ""
