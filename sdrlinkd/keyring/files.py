"""Key files: TOML, for their owner alone."""

import os
import stat
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import tomli_w
from msgspec import Meta

from sdrlinkd.errors import UserError
from sdrlinkd.sealing import KEY_SIZE, Key

CREDENTIAL = "sdrlinkd.keys"
"""Name of the systemd credential that comes before the file."""
MOST_BYTES = 1 << 16
MOST_KEYS = 2
HEAD = """\
# Keys of a team: who has this file can send as any robot of it. Keep it secret.
# `sdrlinkctl key install FILE` installs it on a robot; `sdrlinkctl key show` prints its words.
"""
Kid = Annotated[int, Meta(ge=0, le=3)]
RobotId = Annotated[int, Meta(ge=0, le=254)]


class StoredKey(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A key of the team, as in `[[key]]`."""

    kid: Kid
    """Number of the key, 0 to 3; the next key has another one."""
    secret: bytes
    """The key itself: 32 octets in base64."""
    created: str = ""
    """Day on which it was made."""

    @property
    def key(self) -> Key:
        """The key without what people know about it."""
        return Key(self.kid, self.secret)

    @property
    def fingerprint(self) -> bytes:
        """What people compare."""
        return self.key.fingerprint


class StoredPair(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A key of two robots alone, as in `[[pair]]`, for what one sends to the other."""

    kid: Kid
    robots: Annotated[list[RobotId], Meta(min_length=2, max_length=2)]
    secret: bytes


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    key: list[StoredKey] = []
    pair: list[StoredPair] = []


def load_keys(path: Path) -> list[Key]:
    """The keys of a robot, the next one last. Raises UserError.

    A systemd credential comes before the file at `path`.
    """
    folder = os.environ.get("CREDENTIALS_DIRECTORY", "")
    credential = Path(folder, CREDENTIAL)
    stored, pairs = _read(credential if folder and credential.exists() else path)
    if len(stored) > MOST_KEYS:
        raise UserError(
            f"{path}: {len(stored)} keys; allowed: the one in use and the next one: see "
            "sdrlinkctl key show"
        )
    return [
        Key(
            each.kid,
            each.secret,
            {frozenset(pair.robots): pair.secret for pair in pairs if pair.kid == each.kid},
        )
        for each in stored
    ]


def read_key_file(path: Path) -> list[StoredKey]:
    """The team's keys in a file, the next one last. Raises UserError."""
    return _read(path)[0]


def parse_key_file(text: bytes, source: str) -> list[StoredKey]:
    """The team's keys in a file's content. Raises UserError, which cites `source`."""
    return _parsed(text, source).key


def key_file_text(keys: Sequence[StoredKey]) -> str:
    """A key file with these keys."""
    return HEAD + tomli_w.dumps(msgspec.to_builtins({"key": list(keys)}))


def create_key_file(path: Path, keys: Sequence[StoredKey]) -> None:
    """Write a new key file for its owner alone. Raises UserError if there is one already."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        with os.fdopen(os.open(path, flags, 0o600), "w") as file:
            file.write(key_file_text(keys))
    except FileExistsError:
        raise UserError(
            f"{path}: there already; allowed: another file, as keys are precious"
        ) from None
    except OSError as error:
        raise UserError(f"{path} cannot be written ({error.strerror})") from None


def write_key_file(path: Path, keys: Sequence[StoredKey], owner: tuple[int, int] | None) -> None:
    """Write the keys to a file for its owner alone; pair keys in it stay. Raises UserError.

    `owner` is the (user, group) that it is given to, None: the one who writes.
    """
    pairs = _read(path)[1] if path.exists() else []
    kept = [each for each in pairs if each.kid in {key.kid for key in keys}]
    told = {"key": list(keys), **({"pair": kept} if kept else {})}
    text = HEAD + tomli_w.dumps(msgspec.to_builtins(told))
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".keys-")
        with os.fdopen(handle, "w") as file:
            file.write(text)
            if owner is not None:
                os.fchown(file.fileno(), *owner)
            file.flush()
            os.fsync(file.fileno())
        Path(name).replace(path)
    except OSError as error:
        raise UserError(f"{path} cannot be written ({error.strerror})") from None


def _read(path: Path) -> tuple[list[StoredKey], list[StoredPair]]:
    try:
        with path.open("rb") as file:
            about = os.fstat(file.fileno())
            if not stat.S_ISREG(about.st_mode):
                raise UserError(f"{path}: not a file; allowed: a file with keys")
            if about.st_mode & 0o077:
                raise UserError(
                    f"{path}: others can read it (mode {stat.S_IMODE(about.st_mode):04o}); "
                    f"allowed: 0600, its owner alone: chmod 600 {path}"
                )
            text = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise UserError(
            f"{path} cannot be read ({error.strerror}); sdrlinkctl key install puts a key there"
        ) from None
    read = _parsed(text, str(path))
    return read.key, read.pair


def _parsed(text: bytes, source: str) -> _File:
    if len(text) > MOST_BYTES:
        raise UserError(f"{source}: more than {MOST_BYTES} bytes; allowed: a file with keys")
    try:
        read = msgspec.toml.decode(text, type=_File)
    except (msgspec.MsgspecError, ValueError) as error:
        raise UserError(
            f"{source}: {error}; allowed: what sdrlinkctl key generate writes"
        ) from None
    _check(source, read)
    return read


def _check(path: str, read: _File) -> None:
    if not read.key:
        raise UserError(f"{path}: no key in it; allowed: what sdrlinkctl key generate writes")
    kids = [each.kid for each in read.key]
    for kid in kids:
        if kids.count(kid) > 1:
            raise UserError(f"{path}: two keys with kid {kid}; allowed: one of each kid")
    held: list[StoredKey | StoredPair] = [*read.key, *read.pair]
    for each in held:
        if len(each.secret) != KEY_SIZE:
            raise UserError(
                f"{path}: the key with kid {each.kid} has {len(each.secret)} bytes; allowed: "
                f"{KEY_SIZE}"
            )
    pairs = [(each.kid, frozenset(each.robots)) for each in read.pair]
    for kid, robots in pairs:
        if len(robots) < 2 or pairs.count((kid, robots)) > 1 or kid not in kids:
            raise UserError(
                f"{path}: pair {sorted(robots)} with kid {kid}; allowed: two robots, once for each "
                "kid of a key"
            )
