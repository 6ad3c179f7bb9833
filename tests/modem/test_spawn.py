"""Modem processes that are started before their daemon has loaded."""

import pytest

from sdrlinkd.config import WITHOUT_AIR
from sdrlinkd.spawn import WITHOUT_MODEM, spawn_early


def test_the_same_backends_have_no_modem():
    assert WITHOUT_MODEM == WITHOUT_AIR


@pytest.mark.parametrize(
    ("text", "is_early"),
    [
        ('backend = "loopback"', True),
        ('backend = "soapy"\n[soapy]\ndevice = "driver=x"', True),
        ('backend = "loopback"\n[loopback]\npaced = false', False),
        ('backend = "ether"\n[ether]\ndir = "air"', False),
        ('backend = "direct"', False),
        ("", False),
        ('backend = ["loopback"]', False),
        ('loopback = 1\nbackend = "loopback"', False),
        ("backend = ", False),
        ("\xff", False),
    ],
)
def test_a_look_at_the_file_tells(tmp_path, text, is_early):
    path = tmp_path / "robot.toml"
    path.write_text(text, encoding="latin-1")
    early = spawn_early(path)
    spawned = early.take()
    assert (spawned is not None) == is_early
    assert early.take() is None
    if spawned is not None:
        spawned.close()
        assert spawned.process.returncode is not None


def test_a_file_that_is_not_there_is_told_later(tmp_path):
    assert spawn_early(tmp_path / "missing.toml").take() is None
