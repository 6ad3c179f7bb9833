"""New keys."""

import datetime
import secrets

from sdrlinkd.keyring.files import KeyFile, StoredKey
from sdrlinkd.sealing import KEY_SIZE


def new_key(kid: int) -> KeyFile:
    """A file with a new random key, made today."""
    today = datetime.datetime.now(datetime.UTC).date()
    today = datetime.datetime.now(datetime.UTC).date()
    secret = secrets.token_bytes(KEY_SIZE)
    return KeyFile(key=[StoredKey(kid=kid, secret=secret, created=today.isoformat())])
