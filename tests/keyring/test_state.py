"""What sealing remembers: whole or not at all, for one process, on one machine."""

import json
import os
from pathlib import Path

import pytest

from sdrlinkd.errors import UserError
from sdrlinkd.keyring import KeyState, state_dir
from sdrlinkd.keyring.testing import CONSTANTS
from sdrlinkd.sealing import Key, Remembered

KEY, NEXT = Key(0, bytes(range(32))), Key(1, bytes(range(32, 64)))


@pytest.fixture(autouse=True)
def machine(tmp_path, monkeypatch):
    """This machine's id, which can be changed."""
    path = tmp_path / "machine-id"
    path.write_text("one\n")
    monkeypatch.setattr(*CONSTANTS["machine_id"], path)
    return path


@pytest.fixture
def kept(tmp_path):
    """The state of robot 1, with a key installed."""
    made = KeyState(tmp_path / "state", 1)
    made.check()
    assert made.install(KEY, None)
    return made


def test_what_is_saved_is_loaded(kept):
    told = Remembered(
        {KEY.fingerprint: 77}, {KEY.fingerprint: {2: 5, 3: 6}}, KEY.fingerprint,
        known=frozenset({2, 3}),
    )  # fmt: skip
    kept.save(told)
    assert KeyState(kept.directory, 1).load([KEY]) == told


def test_a_key_that_was_never_installed_is_refused(kept):
    with pytest.raises(UserError, match=r"no numbers of key 1\. If it was never installed"):
        kept.load([KEY, NEXT])
    with pytest.raises(UserError, match="never installed"):
        KeyState(kept.directory, 2).load([KEY])


def test_what_was_replaced_stays_so_and_who_sealed_once_is_known_under_any_key(kept):
    kept.install(NEXT, None)
    newest = {KEY.fingerprint: {9: 5}, NEXT.fingerprint: {}}
    retired = frozenset({KEY.fingerprint})
    floors = {KEY.fingerprint: 5, NEXT.fingerprint: 7}
    kept.save(Remembered(floors, newest, NEXT.fingerprint, retired))
    assert kept.load([KEY, NEXT]).retired == retired
    assert kept.load([NEXT]).known == {9}


def test_to_install_again_changes_nothing(kept):
    kept.save(Remembered({KEY.fingerprint: 77}))
    assert not kept.install(KEY, None)
    assert kept.load([KEY]).floors == {KEY.fingerprint: 77}


def test_a_copy_on_another_machine_skips_an_hour(kept, machine):
    kept.save(Remembered({KEY.fingerprint: 77}))
    machine.write_text("two\n")
    copy = KeyState(kept.directory, 1)
    assert copy.load([KEY]).floors == {KEY.fingerprint: 77 + 3600 * 32}
    assert copy.moved == [KEY.fingerprint]
    copy.save(copy.load([KEY]))
    again = KeyState(kept.directory, 1)
    assert again.load([KEY]).floors == {KEY.fingerprint: 77 + 3600 * 32}
    assert again.moved == []


def test_one_process_holds_it(kept):
    kept.hold()
    with pytest.raises(UserError, match="another daemon seals as robot 1"):
        KeyState(kept.directory, 1).hold()
    KeyState(kept.directory, 2).hold().close()
    kept.close()
    KeyState(kept.directory, 1).hold().close()


@pytest.mark.parametrize("text", [b"", b"{", b"null", b'{"floor": -1}', b"\xff" * 100])
def test_a_damaged_state_is_refused(kept, text):
    (path,) = kept.directory.glob("*.json")
    path.write_bytes(text)
    with pytest.raises(UserError, match=r"damaged|not the state"):
        kept.load([KEY])


def test_a_state_of_another_key_is_refused(kept):
    (path,) = kept.directory.glob("*.json")
    told = json.loads(path.read_text())
    path.write_text(json.dumps({**told, "fingerprint": NEXT.fingerprint.hex()}))
    with pytest.raises(UserError, match="not the state of this key"):
        kept.load([KEY])


def test_a_power_cut_leaves_the_old_or_the_new(kept, monkeypatch):
    """Whatever the last step that was done: a state is there, and it is whole."""
    kept.save(Remembered({KEY.fingerprint: 77}))
    steps = ["fsync", "replace"]
    for n in range(len(steps)):
        with monkeypatch.context() as patch:

            def cut(*_):
                raise OSError(5, "power cut")

            if steps[n] == "fsync":
                patch.setattr(os, "fsync", cut)
            else:
                patch.setattr(Path, "replace", cut)
            with pytest.raises(OSError, match="power cut"):
                KeyState(kept.directory, 1).save(Remembered({KEY.fingerprint: 99}))
        assert KeyState(kept.directory, 1).load([KEY]).floors == {KEY.fingerprint: 77}
        assert not list(kept.directory.glob(".state-*"))


def test_a_directory_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"security\.state_dir: .*file/state cannot be used"):
        KeyState(tmp_path / "file" / "state", 1).check()


def test_where_it_is(tmp_path, monkeypatch):
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    etc = Path("/etc/sdrlinkd")
    assert state_dir("", None) == tmp_path / "sdrlinkd"
    assert str(state_dir("", etc / "sdrlinkd.toml")) == "/var/lib/sdrlinkd"
    assert str(state_dir("", etc / "north.toml")) == "/var/lib/sdrlinkd-north"
    assert str(state_dir("/given", etc / "north.toml")) == "/given"
    monkeypatch.setenv("STATE_DIRECTORY", "/var/lib/sdrlinkd:/other")
    assert str(state_dir("", tmp_path / "my.toml")) == "/var/lib/sdrlinkd"
