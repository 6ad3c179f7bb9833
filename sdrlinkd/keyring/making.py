"""New keys."""

import datetime
import secrets

from sdrlinkd.kernelclock import is_synchronized
from sdrlinkd.keyring.files import KeyFile, StoredKey
from sdrlinkd.sealing import KEY_SIZE


def new_key(kid: int, *, follows: bool = False) -> KeyFile:
    """A file with a new random key, made now; `follows`: as the next one of another key.

    It says when, if this computer's clock is synchronized. By that, a robot that has lost its state
    knows which numbers of the key it cannot have used.
    """
    now = datetime.datetime.now(datetime.UTC)
    made = f"{now:%Y-%m-%dT%H:%M:%SZ}" if is_synchronized() else f"{now:%Y-%m-%d}"
    secret = secrets.token_bytes(KEY_SIZE)
    return KeyFile(key=[StoredKey(kid=kid, secret=secret, created=made, follows=follows)])
