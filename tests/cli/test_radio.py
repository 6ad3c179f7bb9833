"""`sdrlinkctl radio probe`: the attached radios, and how a daemon would drive them."""

import json
from pathlib import Path

import pytest

from sdrlinkd.cli import run
from sdrlinkd.config import load_config, make_setup, parse_config
from tests.soapy_loopback import missing, module_folder

ETC = Path(__file__).parents[2] / "etc"
needs_radio = pytest.mark.skipif(bool(missing()), reason=missing())


@pytest.fixture(autouse=True)
def _drivers(monkeypatch):
    """Only the test radio's driver; a wide terminal."""
    if not missing():
        monkeypatch.setenv("SOAPY_SDR_PLUGIN_PATH", str(module_folder()))
    monkeypatch.setenv("SOAPY_SDR_ROOT", "/nonexistent")
    monkeypatch.setenv("COLUMNS", "200")


@pytest.mark.slow
@needs_radio
def test_a_radio_that_keeps_time(capsys):
    assert run(["radio", "probe", "driver=loopback,model=usrp", "--rate", "5e6"]) == 0
    told = capsys.readouterr().out
    for part in (
        "driver: loopback", "0.2 to 61.44 Msps, 50 to 6000 MHz", "TX/RX, RX2",
        "full duplex; the device times the bursts", "lead 20 ms",
    ):  # fmt: skip
        assert part in told
    assert "warning" not in told


@pytest.mark.slow
@needs_radio
def test_a_half_duplex_radio_comes_with_what_to_expect(capsys):
    assert run(["radio", "probe", "driver=loopback,model=hackrf"]) == 0
    told = capsys.readouterr().out
    for part in (
        "half duplex", "modem.oversampling = 2", "turnaround", "tdma", "no time stamps",
        "LNA 0 to 40", "a faster radio",
    ):  # fmt: skip
        assert part in told


@pytest.mark.slow
@needs_radio
def test_for_programs(capsys):
    assert run(["radio", "probe", "driver=loopback,model=plain", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["devices"][0]["rx"]["formats"] == ["CF32", "CS16", "CS8"]


@pytest.mark.slow
@needs_radio
@pytest.mark.parametrize(
    ("args", "part"),
    [
        ("driver=hackrf", 'no driver "hackrf"'),
        ("driver=loopback,absent=1", "there is no such device"),
        ("driver=loopback,busy=1", "in use"),
        ("", "no device found"),
    ],
)
def test_what_is_not_there_is_told_apart(capsys, args, part):
    assert run(["radio", "probe", args]) == 2
    told = capsys.readouterr()
    assert part in told.out
    assert "Traceback" not in told.out + told.err


@pytest.mark.parametrize("name", ["hackrf", "usrp"])
def test_shipped_radio_configurations_want_only_a_frequency(name):
    path = ETC / "radios" / f"{name}.toml"
    text = path.read_text().replace("frequency_hz = 0.0 ", "frequency_hz = 433.92e6 ")
    # In its place, and copied next to a registry, as a page suggests.
    assert (ETC / "radios" / "registry.csv").read_text() == (ETC / "registry.csv").read_text()
    assert make_setup(parse_config(text, str(path)), ETC)
    setup = make_setup(parse_config(text, str(path)), path.parent)
    assert setup.config.backend == "soapy"
    assert not load_config(path).soapy.tx_enabled
    uncommented = text.replace("# [access]", "[access]").replace(
        "tx_enabled = false", "tx_enabled = true"
    )
    for key in ("policy", "nodes", "slot_s", "reuse"):
        uncommented = uncommented.replace(f"# {key} =", f"{key} =")
    assert make_setup(parse_config(uncommented, str(path)), path.parent).config.soapy.tx_enabled
