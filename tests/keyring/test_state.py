"""What sealing remembers: whole or not at all, for one process, on one machine."""

import json
import os
from pathlib import Path

import pytest

from sdrlinkd.errors import UserError
from sdrlinkd.keyring import KeyState, machine_tag, state_dir
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
    made.begin(KEY, None)
    return made


def test_what_is_saved_is_loaded(kept):
    told = Remembered(
        {KEY.fingerprint: 77}, {KEY.fingerprint: {2: 5, 3: 6}}, KEY.fingerprint,
        known=frozenset({2, 3}),
    )  # fmt: skip
    kept.save(told)
    assert KeyState(kept.directory, 1).load([KEY]) == told


def test_the_numbers_of_a_key_without_a_file_are_lost(kept):
    assert kept.load([KEY, NEXT]).floors == {KEY.fingerprint: 0}
    assert KeyState(kept.directory, 2).load([KEY]) == Remembered()


def test_what_was_replaced_stays_so_and_who_sealed_once_is_known_under_any_key(kept):
    kept.begin(NEXT, None)
    newest = {KEY.fingerprint: {9: 5}, NEXT.fingerprint: {}}
    retired = frozenset({KEY.fingerprint})
    floors = {KEY.fingerprint: 5, NEXT.fingerprint: 7}
    kept.save(Remembered(floors, newest, NEXT.fingerprint, retired))
    assert kept.load([KEY, NEXT]).retired == retired
    assert kept.load([NEXT]).known == {9}


def test_a_directory_is_whole_once_a_key_was_new_and_not_if_its_numbers_were_lost(kept):
    assert (kept.knows(KEY), kept.knows(NEXT), kept.is_whole) == (True, False, True)
    other = KeyState(kept.directory, 2)
    other.save(Remembered({KEY.fingerprint: 77}, resumed=frozenset({KEY.fingerprint})))
    assert (other.knows(KEY), other.is_whole) == (True, False)
    # It stays so, whatever is written.
    for state in (kept, other):
        again = KeyState(kept.directory, (state is other and 2) or 1)
        again.save(again.load([KEY])._replace(floors={KEY.fingerprint: 99}))
        assert again.is_whole is (state is kept)


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
def test_a_damaged_state_counts_as_lost(kept, text):
    (path,) = kept.directory.glob("*.json")
    path.write_bytes(text)
    assert kept.load([KEY]) == Remembered()
    assert not kept.is_whole


def test_each_flipped_bit_is_found(kept):
    kept.save(Remembered({KEY.fingerprint: 77}, {KEY.fingerprint: {2: 5}}, KEY.fingerprint))
    (path,) = kept.directory.glob("*.json")
    whole = path.read_bytes()
    told = kept.load([KEY])
    for at in range(8 * len(whole)):
        octets = bytearray(whole)
        octets[at // 8] ^= 1 << at % 8
        path.write_bytes(octets)
        # White space at the end tells nothing.
        assert KeyState(kept.directory, 1).load([KEY]) in (Remembered(), told), at


@pytest.mark.parametrize(
    "wrong",
    [
        {"fingerprint": NEXT.fingerprint.hex()}, {"floor": -1}, {"floor": 2**80},
        {"newest": {"99999": 1}}, {"newest": {"3": 2**31}}, {"check": "0" * 16},
    ],
)  # fmt: skip
def test_what_cannot_be_counts_as_lost(kept, wrong):
    (path,) = kept.directory.glob("*.json")
    told = json.loads(path.read_text())
    path.write_text(json.dumps({**told, "check": "", **wrong}))
    assert kept.load([KEY]) == Remembered()


def test_a_state_of_before_there_were_checksums_is_taken(kept):
    (path,) = kept.directory.glob("*.json")
    told = json.loads(path.read_text())
    del told["check"], told["is_whole"]
    path.write_text(json.dumps({**told, "floor": 77}))
    assert kept.load([KEY]).floors == {KEY.fingerprint: 77}
    assert kept.is_whole


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


def test_the_tag_of_a_machine(machine, tmp_path, monkeypatch):
    boot = tmp_path / "boot"
    monkeypatch.setattr(*CONSTANTS["boot_id"], boot)
    assert machine_tag() == b"", "not known when it started"
    boot.write_text("a\n")
    first = machine_tag()
    boot.write_text("b\n")
    copy = machine_tag()
    assert (len(first), first[:3], first[3] != copy[3]) == (4, copy[:3], True)
    machine.write_text("two\n")
    assert machine_tag()[:3] != first[:3]
    machine.unlink()
    assert machine_tag() == b""
