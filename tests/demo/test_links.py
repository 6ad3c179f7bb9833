"""The configuration of a demonstration's daemons."""

import tomllib

import pytest

from sdrlinkd.demo import Options, open_source, write_config

RESTS = 1.25
"""Time for which an entry id is not reused, in reassembly timeouts."""


@pytest.mark.parametrize("speed", [0.1, 1.0, 7.0, 50.0])
def test_a_pause_of_the_machine_is_borne_and_entry_ids_suffice(tmp_path, speed):
    source = open_source(None, None, [], 15.0, 1)
    path = write_config(tmp_path / "x", source, Options(link="ofdm", speed=speed), "both", tmp_path)
    timeout_s = tomllib.loads(path.read_text())["reassembly"]["timeout_s"]
    assert timeout_s >= 3.0 / max(speed, 1.0)
    assert RESTS * timeout_s * source.fastest_hz * speed < 256
