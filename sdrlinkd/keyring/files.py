"""Key files: TOML, for their owner alone."""

import contextlib
import datetime
import os
import stat
import tempfile
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
    """When it was made: a time in UTC, or a day alone if the clock was not synchronized."""
    robots: list[RobotId] = []
    """Robots whose numbers were begun with this file."""
    follows: bool = False
    """Whether it was made as the next key of another one."""

    @property
    def key(self) -> Key:
        """The key without what people know about it."""
        return Key(self.kid, self.secret, made_s=self.made_s, follows=self.follows)

    @property
    def made_s(self) -> float | None:
        """When it was made, in s since 1970; None if it is not known well enough."""
        if "T" not in self.created:
            return None
        return datetime.datetime.fromisoformat(self.created).timestamp()

    @property
    def made_on(self) -> str:
        """The day on which it was made, for people."""
        return self.created[:10]

    @property
    def fingerprint(self) -> bytes:
        """What people compare."""
        return self.key.fingerprint


class StoredPair(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A key of two robots alone, as in `[[pair]]`, for what one sends to the other."""

    kid: Kid
    robots: Annotated[list[RobotId], Meta(min_length=2, max_length=2)]
    secret: bytes


class KeyFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The keys and the pair keys in a file, the next key last."""

    key: list[StoredKey] = []
    pair: list[StoredPair] = []


def load_keys(path: Path) -> list[Key]:
    """The keys of a robot, the next one last. Raises UserError.

    A systemd credential comes before the file at `path`.
    """
    folder = os.environ.get("CREDENTIALS_DIRECTORY", "")
    credential = Path(folder, CREDENTIAL)
    read = read_key_file(credential if folder and credential.exists() else path)
    check_number(read, str(path))
    return [
        Key(
            each.kid,
            each.secret,
            {frozenset(pair.robots): pair.secret for pair in read.pair if pair.kid == each.kid},
            each.made_s,
            each.follows,
        )
        for each in read.key
    ]


def check_number(keys: KeyFile, source: str) -> None:
    """Check that a robot can hold these keys. Raises UserError."""
    if len(keys.key) > MOST_KEYS:
        raise UserError(
            f"{source}: {len(keys.key)} keys; allowed: the one in use and the next one: see "
            "sdrlinkctl key show"
        )


def parse_key_file(text: bytes, source: str) -> KeyFile:
    """The keys in a file's content. Raises UserError, which cites `source`."""
    if len(text) > MOST_BYTES:
        raise UserError(f"{source}: more than {MOST_BYTES} bytes; allowed: a file with keys")
    try:
        read = msgspec.toml.decode(text, type=KeyFile)
    except (msgspec.MsgspecError, ValueError) as error:
        raise UserError(
            f"{source}: {error}; allowed: what sdrlinkctl key generate writes"
        ) from None
    _check(source, read)
    return read


def key_file_text(keys: KeyFile) -> str:
    """A file with these keys."""
    told = msgspec.to_builtins(keys)
    return HEAD + tomli_w.dumps({name: each for name, each in told.items() if each})


def create_key_file(path: Path, keys: KeyFile) -> None:
    """Write a new key file for its owner alone. Raises UserError if there is one already."""
    create_secret(path, key_file_text(keys).encode())


def create_secret(path: Path, text: bytes) -> None:
    """Write a new file for its owner alone. Raises UserError if there is one already."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        with os.fdopen(os.open(path, flags, 0o600), "wb") as file:
            file.write(text)
    except FileExistsError:
        raise UserError(f"{path}: there already; allowed: the name of a new file") from None
    except OSError as error:
        raise UserError(f"{path} cannot be written ({error.strerror})") from None


def write_key_file(path: Path, keys: KeyFile, owner: tuple[int, int] | None) -> None:
    """Write keys to a file for its owner alone. Raises UserError.

    `owner` is the (user, group) that it is given to, None: the one who writes.
    """
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".keys-")
        with os.fdopen(handle, "w") as file:
            file.write(key_file_text(keys))
            if owner is not None:
                os.fchown(file.fileno(), *owner)
            file.flush()
            os.fsync(file.fileno())
        Path(name).replace(path)
    except OSError as error:
        raise UserError(f"{path} cannot be written ({error.strerror})") from None


def read_key_file(path: Path) -> KeyFile:
    """The keys in a file. Raises UserError."""
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
    return parse_key_file(text, str(path))


def _check(path: str, read: KeyFile) -> None:
    if not read.key:
        raise UserError(f"{path}: no key in it; allowed: what sdrlinkctl key generate writes")
    for key in read.key:
        if not _is_time(key.created):
            raise UserError(
                f"{path}: created = {key.created!r}; allowed: a time such as 2026-11-25T14:02:11Z"
            )
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


def _is_time(text: str) -> bool:
    """Whether a text is empty, a day, or a time in a known zone."""
    if not text:
        return True
    with contextlib.suppress(ValueError):
        return "T" not in text or datetime.datetime.fromisoformat(text).tzinfo is not None
    return False
