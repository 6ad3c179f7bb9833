"""New keys."""

import datetime
import secrets

from sdrlinkd.keyring.files import StoredKey
from sdrlinkd.sealing import KEY_SIZE


def new_key(kid: int) -> StoredKey:
    """A new random key, made today."""
    today = datetime.datetime.now(datetime.UTC).date()
    return StoredKey(kid=kid, secret=secrets.token_bytes(KEY_SIZE), created=today.isoformat())
