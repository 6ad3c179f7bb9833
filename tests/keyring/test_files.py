"""Key files: for their owner alone, and what is wrong with one is said in a line."""

import pytest

from sdrlinkd.errors import UserError
from sdrlinkd.keyring import (
    CREDENTIAL,
    KeyFile,
    StoredKey,
    create_key_file,
    load_keys,
    new_key,
    parse_key_file,
    read_key_file,
    write_key_file,
)
from sdrlinkd.keyring.testing import CONSTANTS
from sdrlinkd.sealing import words_of

SECRET = "AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8="
PAIR = "ICEiIyQlJicoKSorLC0uLzAxMjM0NTY3ODk6Ozw9Pj8="
GOOD = f'[[key]]\nkid = 0\nsecret = "{SECRET}"\n'


@pytest.fixture
def written(tmp_path):
    """Writes a key file with a mode."""

    def write(text, mode=0o600):
        path = tmp_path / "keys.toml"
        path.write_text(text)
        path.chmod(mode)
        return path

    return write


def test_what_is_written_is_read(tmp_path):
    keys = KeyFile(key=[*new_key(0).key, *new_key(3).key])
    create_key_file(tmp_path / "new", keys)
    assert read_key_file(tmp_path / "new") == keys
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o600
    assert len(keys.key[0].secret) == 32
    assert keys.key[0].secret != keys.key[1].secret


def test_a_key_is_never_overwritten(tmp_path):
    create_key_file(tmp_path / "new", new_key(0))
    before = (tmp_path / "new").read_bytes()
    with pytest.raises(UserError, match="there already"):
        create_key_file(tmp_path / "new", new_key(0))
    assert (tmp_path / "new").read_bytes() == before


def test_no_symlink_is_followed(tmp_path):
    (tmp_path / "target").write_text("precious")
    (tmp_path / "link").symlink_to(tmp_path / "target")
    with pytest.raises(UserError):
        create_key_file(tmp_path / "link", new_key(0))
    assert (tmp_path / "target").read_text() == "precious"


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660, 0o644])
def test_a_file_that_others_can_read_is_refused(written, mode):
    with pytest.raises(UserError, match=rf"others can read it \(mode {mode:04o}\); allowed: 0600"):
        load_keys(written(GOOD, mode))


@pytest.mark.parametrize(("text", "says"), [
    ("", "no key in it"),
    ("key = 1", "Expected `array`"),
    ("[[key]]\nkid = 0", "missing required field `secret`"),
    (f'[[key]]\nkid = 4\nsecret = "{SECRET}"', "<= 3"),
    ('[[key]]\nkid = 0\nsecret = "AAEC"', "the key with kid 0 has 3 bytes; allowed: 32"),
    ('[[key]]\nkid = 0\nsecret = "?"', "base64"),
    (GOOD + GOOD, "two keys with kid 0; allowed: one of each kid"),
    (GOOD + "more = 1", "unknown field `more`"),
    (GOOD + f'[[pair]]\nkid = 0\nrobots = [1]\nsecret = "{PAIR}"', "length >= 2"),
    (GOOD + f'[[pair]]\nkid = 0\nrobots = [1, 1]\nsecret = "{PAIR}"', "allowed: two robots"),
    (GOOD + f'[[pair]]\nkid = 1\nrobots = [1, 2]\nsecret = "{PAIR}"', "allowed: two robots"),
    ("\0", "Invalid"),
])  # fmt: skip
def test_what_is_wrong_is_named(written, text, says):
    with pytest.raises(UserError) as error:
        load_keys(written(text))
    assert says in str(error.value)
    assert str(error.value).startswith(str(written(text)))
    assert "\n" not in str(error.value)


def test_at_most_two_keys_are_held(written):
    three = GOOD + "".join(GOOD.replace("kid = 0", f"kid = {kid}") for kid in (1, 2))
    with pytest.raises(UserError, match="3 keys; allowed: the one in use and the next one"):
        load_keys(written(three))


def test_a_file_without_end_is_not_read_to_its_end(tmp_path):
    for path in ("/dev/zero", tmp_path):
        with pytest.raises(UserError):
            load_keys(type(tmp_path)(path))
    with pytest.raises(UserError, match="more than"):
        parse_key_file(b"#" * (1 << 17), "stdin")


def test_pair_keys(written):
    text = GOOD + f'[[pair]]\nkid = 0\nrobots = [1, 2]\nsecret = "{PAIR}"\n'
    (key,) = load_keys(written(text))
    assert key.pairs == {frozenset((1, 2)): bytes(range(32, 64))}


def test_pair_keys_are_written(written):
    path = written(GOOD + f'[[pair]]\nkid = 0\nrobots = [1, 2]\nsecret = "{PAIR}"\n')
    read = read_key_file(path)
    write_key_file(path, read, None)
    assert read_key_file(path) == read
    assert [len(key.pairs) for key in load_keys(path)] == [1]


def test_a_systemd_credential_comes_first(written, tmp_path, monkeypatch):
    path = written(GOOD)
    folder = tmp_path / "credentials"
    folder.mkdir()
    monkeypatch.setenv("CREDENTIALS_DIRECTORY", str(folder))
    assert load_keys(path)[0].kid == 0
    create_key_file(folder / CREDENTIAL, new_key(2))
    assert load_keys(path)[0].kid == 2


def test_a_fingerprint_is_eight_words():
    key = StoredKey(kid=0, secret=bytes(range(32)))
    assert key.fingerprint.hex() == "3b83b6a3b1bad4a4e7e348"
    assert words_of(key.fingerprint) == "describe buffalo pottery gloom pull fame panel harbor"


def test_when_a_key_was_made(written):
    for created, made_s in (
        ("2026-11-25T14:02:11Z", 1795615331.0), ("2026-11-25T16:02:11+02:00", 1795615331.0),
        ("2026-11-25", None), ("", None), ("last year", None),
    ):  # fmt: skip
        (key,) = load_keys(written(GOOD + f'created = "{created}"\n'))
        assert key.made_s == made_s, created
    for created in ("2026-11-25T14:02:11", "T", "2026-13-25T14:02:11Z"):
        with pytest.raises(UserError, match=r"keys\.toml: created = .*; allowed: a time such as"):
            load_keys(written(GOOD + f'created = "{created}"\n'))


@pytest.mark.parametrize("is_synchronized", [True, False])
def test_a_key_says_when_it_was_made_if_that_is_known(monkeypatch, is_synchronized):
    monkeypatch.setattr(*CONSTANTS["is_synchronized"], lambda: is_synchronized)
    (key,) = new_key(0).key
    assert (key.made_s is not None) is is_synchronized
    assert len(key.made_on) == 10
