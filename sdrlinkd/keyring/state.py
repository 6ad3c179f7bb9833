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
from typing import Annotated, Self

import msgspec
from msgspec import Meta, structs

from sdrlinkd.errors import UserError
from sdrlinkd.files import unwritable
from sdrlinkd.keyring.files import RobotId
from sdrlinkd.sealing import Key, Remembered
from sdrlinkd.wire import N_TICKS, TICKS_PER_S

MACHINE_ID = Path("/etc/machine-id")
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")
SYSTEM_CONFIG, SYSTEM_STATE = Path("/etc/sdrlinkd"), Path("/var/lib")
OTHER_MACHINE_S = 3600
"""Key time in s that is skipped when a state comes from another machine."""
Ticks = Annotated[int, Meta(ge=0, le=N_TICKS)]


class _OfKey(msgspec.Struct, frozen=True, kw_only=True):
    """The file of one key: its floor in 1/32 s, and the newest T of each robot.

    `check` is the checksum of the rest; empty: written by a version without it. `is_whole`: all
    numbers ever used are accounted for, as the key was new when the file began.
    """

    check: str = ""
    fingerprint: str
    machine: str
    floor: Ticks
    in_use: bool = False
    retired: bool = False
    is_whole: bool = True
    newest: dict[RobotId, Ticks] = {}

    def checksum(self) -> str:
        """The checksum of all but itself."""
        told = msgspec.json.encode(structs.replace(self, check=""))
        return hashlib.sha256(told).hexdigest()[:16]


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
            raise UserError(self._unusable(error.strerror)) from None
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
        """What is on disk about `keys`; the numbers of a key without a file are lost.

        A file that is damaged counts as none. Raises UserError if one cannot be read.
        """
        floors, newest, in_use, retired, resumed = {}, {}, b"", set(), set()
        machine = machine_hash()
        for key in keys:
            state = self._read(key.fingerprint)
            if state is None:
                continue
            floor = state.floor
            if state.machine != machine:
                self.moved.append(key.fingerprint)
                floor = min(floor + OTHER_MACHINE_S * TICKS_PER_S, N_TICKS)
            floors[key.fingerprint] = floor
            if not state.is_whole:
                resumed.add(key.fingerprint)
            newest[key.fingerprint] = state.newest
            if state.in_use:
                in_use = key.fingerprint
            if state.retired:
                retired.add(key.fingerprint)
        return Remembered(
            floors, newest, in_use, frozenset(retired), self._known(), frozenset(resumed)
        )

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
                is_whole=fingerprint not in remembered.resumed,
                newest=dict(remembered.newest.get(fingerprint, {})),
            )
            if self._written.get(fingerprint) != state:
                self._write(state)
                self._written[fingerprint] = state

    def knows(self, key: Key) -> bool:
        """Whether the numbers of a key are here. Raises UserError."""
        return self._read(key.fingerprint) is not None

    def has_file(self, key: Key) -> bool:
        """Whether there is a file of a key, damaged or not."""
        return self._path(key.fingerprint.hex()).exists()

    def begin(self, key: Key, owner: tuple[int, int] | None) -> None:
        """Begin the numbers of a key that was never used on this robot. Raises UserError."""
        state = _OfKey(fingerprint=key.fingerprint.hex(), machine=machine_hash(), floor=0)
        try:
            self._write(state, owner)
        except OSError as error:
            raise UserError(self._unusable(error.strerror)) from None

    @property
    def is_whole(self) -> bool:
        """Whether this directory has been kept, on this machine, since a key was new.

        Raises UserError.
        """
        paths, machine = self.directory.glob(f"robot-{self._robot_id}-key-*.json"), machine_hash()
        return any(
            state is not None and state.is_whole and state.machine == machine
            for state in map(self._read_at, paths)
        )

    def check(self) -> None:
        """Check that the directory can be written. Raises UserError."""
        try:
            self.directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(dir=self.directory, prefix=".try-"):
                pass
        except OSError as error:
            raise UserError(self._unusable(error.strerror)) from None

    def refuse_unwritable(self) -> None:
        """As `check`, but nothing is made or written. Raises UserError."""
        if problem := unwritable(self.directory):
            raise UserError(self._unusable(problem))

    def _known(self) -> frozenset[int]:
        """All robots of which a sealed PDU was opened, with whatever key."""
        found: set[int] = set()
        for path in self.directory.glob(f"robot-{self._robot_id}-key-*.json"):
            with contextlib.suppress(UserError):
                state = self._read_at(path)
                found |= state.newest.keys() if state is not None else set()
        return frozenset(found)

    def _unusable(self, problem: str | None) -> str:
        return (
            f"security.state_dir: {self.directory} cannot be used ({problem}); allowed: a "
            "directory that this user may write to, as numbers must survive a restart"
        )

    def _path(self, fingerprint: str) -> Path:
        return self.directory / f"robot-{self._robot_id}-key-{fingerprint[:16]}.json"

    def _read(self, fingerprint: bytes) -> _OfKey | None:
        state = self._read_at(self._path(fingerprint.hex()))
        return None if state is None or state.fingerprint != fingerprint.hex() else state

    def _read_at(self, path: Path) -> _OfKey | None:
        """A key's file; None if it is not there, or damaged. Raises UserError."""
        try:
            state = msgspec.json.decode(path.read_bytes(), type=_OfKey)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise UserError(f"{path} cannot be read ({error.strerror})") from None
        except (msgspec.MsgspecError, ValueError):
            return None
        return state if state.check in ("", state.checksum()) else None

    def _write(self, state: _OfKey, owner: tuple[int, int] | None = None) -> None:
        path = self._path(state.fingerprint)
        handle, name = tempfile.mkstemp(dir=self.directory, prefix=".state-")
        try:
            with os.fdopen(handle, "wb") as file:
                told = structs.replace(state, check=state.checksum())
                file.write(msgspec.json.encode(told) + b"\n")
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
    if config_path is not None and (service := service_name(config_path)):
        return SYSTEM_STATE / service
    base = os.environ.get("XDG_STATE_HOME")
    return (Path(base) if base else Path.home() / ".local/state") / "sdrlinkd"


def service_name(config_path: Path) -> str:
    """What systemd calls the folders of the service with this configuration; empty if none has it.

    They are `sdrlinkd`, or `sdrlinkd-NAME` of the service sdrlinkd@NAME.
    """
    if config_path.absolute().parent != SYSTEM_CONFIG:
        return ""
    name = config_path.stem
    return "sdrlinkd" if name == "sdrlinkd" else f"sdrlinkd-{name}"


def machine_hash() -> str:
    """What tells this machine from others; empty if it has no id."""
    own = _octets(MACHINE_ID)
    return hashlib.sha256(b"sdrlinkd" + own).hexdigest()[:16] if own else ""


def machine_tag() -> bytes:
    """What others may know of this machine: three octets of its id, and one of its last start.

    Empty if it has no id. Two machines with the same id differ in the last octet, mostly.
    """
    own, boot = _octets(MACHINE_ID), _octets(BOOT_ID)
    if not (own and boot):
        return b""
    by_id = hashlib.sha256(b"sdrlinkd machine" + own).digest()
    return by_id[:3] + hashlib.sha256(b"sdrlinkd start" + boot).digest()[:1]


def _octets(path: Path) -> bytes:
    try:
        return path.read_bytes().strip()
    except OSError:
        return b""
