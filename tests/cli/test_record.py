"""`sdrlinkctl record`: records radios of a configuration, and its response to bad input."""

import re
import signal
from pathlib import Path

import pytest
import sigmf

from backends.testing import CONSTANTS
from sdrlinkd.process import wait_until
from tests.iq.recordings import write_bursts
from tests.programs import sdrlinkctl

REGISTRY = Path(__file__).parents[2] / "etc/registry.csv"
DEVICE = ("--device", "driver=none", "--frequency", "433e6", "--rate", "2e6")


@pytest.fixture
def config(tmp_path):
    """Writes a configuration with this backend and optional further TOML."""

    def write(backend, more=""):
        path = tmp_path / "robot.toml"
        modem = "" if "[modem]" in more else "[modem]\nrate_hz = 2e6\n"
        path.write_text(f'registry = "{REGISTRY}"\nbackend = "{backend}"\n{modem}{more}')
        return path

    return write


PLAYED = '[iqfile]\nreceive = "played"\ntransmit = "never"\npaced = false\n'


def test_a_recording_with_its_bursts_for_people_and_others(ctl, config, tmp_path):
    write_bursts(tmp_path / "played")
    out_path = tmp_path / "rec"
    code, out, err = ctl("record", out_path, "--config", config("iqfile", PLAYED))
    assert (code, err) == (0, "")
    assert out.startswith(f"recorded {out_path}.sigmf-data, {out_path}.sigmf-meta\n")
    told = {line.split()[0]: line.split(None, 1)[1].strip() for line in out.splitlines()[1:]}
    assert told["length"] == "0.040 s, 80000 samples of ci16_le at 2 Msps, 0.3 MB"
    assert told["bursts"] == "3, 6 PDUs good, 0 bad"
    assert told["gaps"] == told["clipping"] == "none"
    assert re.fullmatch(r"mean -2\d.\d dBFS, peak -[345].\d dBFS", told["level"])
    theirs = sigmf.fromfile(f"{out_path}.sigmf-meta")
    theirs.validate()
    assert len(theirs.get_annotations()) == 3
    # Nothing is ever sent.
    assert not (tmp_path / "never.sigmf-data").exists()
    code, out, _ = ctl("phy", "decode", out_path)
    assert code == 0
    assert "pdus_good 6" in out


def test_types_networks_seconds_and_a_recording_that_is_replaced(ctl, config, tmp_path):
    write_bursts(tmp_path / "played")
    given = ("record", tmp_path / "rec.sigmf-meta", "--config", config("iqfile", PLAYED))
    code, out, _ = ctl(*given, "--seconds", 0.012, "--type", "ci8")
    assert code == 0
    assert "0.012 s, 24000 samples of ci8 at 2 Msps" in out
    assert "bursts    1, 2 PDUs good, 0 bad" in out
    code, out, err = ctl(*given)
    assert (code, out) == (2, "")
    assert err == (
        f"sdrlinkctl: {tmp_path}/rec.sigmf-data: already there; allowed: another name, or --force\n"
    )
    code, out, _ = ctl(*given, "--force", "--network", 1, "--grid", "64/16")
    assert code == 0
    assert "3, 0 PDUs good, 0 bad" in out
    labels = {each["core:label"] for each in sigmf.fromfile(given[1]).get_annotations()}
    assert labels == {"foreign burst"}


def test_clipping_is_told_with_what_to_do(ctl, config, tmp_path):
    write_bursts(tmp_path / "played")
    loud = "[channel]\nsnr_db = -8\nadc_bits = 8\n"
    _, out, _ = ctl("record", tmp_path / "rec", "--config", config("iqfile", PLAYED + loud))
    assert re.search(r"clipping  \d+ values at full scale \(\S+ %\): lower soapy.rx_gain_db", out)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((), "no radio given; allowed: --config FILE, or --device ARGS with --frequency and"),
        (("--device", "driver=none"), "--rate: not given; allowed with --device: samples a second"),
        (("--device", "driver=none", "--rate", "2e6"), "--frequency: not given; allowed with"),
        ((*DEVICE, "--gains", "LNA"), '--gains: got "LNA"; allowed: ELEMENT=DB, such as "LNA=16'),
        ((*DEVICE, "--gains", "LNA=1,=3"), '--gains: got "=3"; allowed'),
        ((*DEVICE, "--gains", "LNA=nan"), '--gains: got "LNA=nan"; allowed'),
        ((*DEVICE, "--grid", "64/4"), "--grid: got 64/4; allowed: one of 64/16, 64/8"),
        (DEVICE, 'soapy.device: got "driver=none", but SoapySDR'),
        (("--config", "none.toml"), "none.toml: cannot be read (No such file"),
    ],
)  # fmt: skip
def test_bad_input_is_refused_in_one_line(ctl, tmp_path, arguments, says):
    code, out, err = ctl("record", tmp_path / "rec", *arguments)
    assert (code, out) == (2, "")
    assert says in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_frequency_and_rate_take_their_units(ctl, tmp_path):
    given = ("--device", "driver=none", "--frequency", "433 MHz", "--rate", "2 Msps")
    _, _, with_units = ctl("record", tmp_path / "rec", *given)
    _, _, plain = ctl("record", tmp_path / "rec", *DEVICE)
    assert with_units == plain
    code, _, err = ctl("record", tmp_path / "rec", *given, "--rate", "5 GB")
    assert (code, "--rate: got 5 GB; allowed: 10000 to 200000000" in err) == (2, True)


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("--rate", "1", "10000"),
        ("--rate", "nan", "200000000"),
        ("--gain", "nan", "200"),
        ("--type", "cu8", "ci16_le"),
        ("--oversampling", "3", "not one of"),
        ("--seconds", "0", "0.001"),
        ("--network", "8", "7"),
    ],
)
def test_values_out_of_range_are_refused_with_what_is_allowed(ctl, tmp_path, option, value, says):
    code, out, err = ctl("record", tmp_path / "rec", option, value)
    assert (code, out) == (2, "")
    assert option in err
    assert says in err


@pytest.mark.parametrize(
    ("backend", "more", "arguments", "says"),
    [
        ("direct", "", (), 'backend: got "direct", which has no radio; allowed: "loopback"'),
        ("gnuradio", '[gnuradio]\nsend = "tcp://127.0.0.1:1"\nreceive = "tcp://127.0.0.1:2"\n', (),
         'backend: got "gnuradio", which has no radio; allowed:'),
        ("loopback", "", ("--gain", "0"), "--gain: given with --config; allowed: [soapy] in"),
        ("loopback", "", ("--rate", "2e6"), "--rate: given with --config; allowed: modem.rate_h"),
        ("loopback", "", ("--oversampling", "2"), "--oversampling: given with --config"),
        ("iqfile", '[iqfile]\ntransmit = "sent"\n', (), "this radio does not receive ("),
        ("iqfile", '[iqfile]\nreceive = "none"\n', (), "none: no such recording"),
        ("iqfile", '[iqfile]\nreceive = "rec"\n', ("--force",), "being played and cannot be"),
        ("ether", '[ether]\ndir = "nowhere"\n', (), "nowhere"),
        ("soapy", '[soapy]\ndevice = "driver=x"\n', (), "modem.frequency_hz: got 0 (not set)"),
    ],
)  # fmt: skip
def test_configurations_without_a_radio_to_record_from_are_refused(
    ctl, config, tmp_path, monkeypatch, backend, more, arguments, says
):
    monkeypatch.setattr(*CONSTANTS["hub_answer_ms"], 50)
    given = ("--config", config(backend, more), *arguments)
    code, out, err = ctl("record", tmp_path / "rec", *given)
    assert (code, out) == (2, ""), err
    assert says in err
    assert err.count("\n") == 1
    assert not (tmp_path / "rec.sigmf-data").exists()


def test_files_that_cannot_be_written_are_named(ctl, config, tmp_path):
    write_bursts(tmp_path / "played")
    given = ("--config", config("iqfile", PLAYED))
    code, _, err = ctl("record", tmp_path / "no" / "rec", *given)
    assert code == 2
    assert "no/rec.sigmf-meta: cannot be written (No such file or directory)" in err
    (tmp_path / "rec.sigmf-data").symlink_to("/dev/full")
    code, out, err = ctl("record", tmp_path / "rec", *given, "--force")
    assert code == 2
    assert "bursts    0" in out
    assert err.startswith(f"sdrlinkctl: ended early: {tmp_path}/rec.sigmf-data: cannot be written")
    assert "(No space left on device)" in err


@pytest.mark.slow
def test_ctrl_c_ends_a_recording_well(config, tmp_path):
    path = config("loopback")
    data = tmp_path / "rec.sigmf-data"
    with sdrlinkctl("record", tmp_path / "rec", "--config", path) as record:
        wait_until(lambda: data.exists() and data.stat().st_size > 100_000, 60, record)
        code = record.stop(signal.SIGINT, 60)
    out = record.out()
    assert (code, record.err()) == (0, "")
    assert "bursts    0, 0 PDUs good, 0 bad" in out
    theirs = sigmf.fromfile(f"{tmp_path}/rec.sigmf-meta")
    theirs.validate()
    assert f", {theirs.sample_count} samples of ci16_le" in out
