"""`sdrlinkctl replay`: sends recordings on configured radios, and its response to bad input."""

from pathlib import Path

import numpy as np
import pytest

from tests.backends.radios import record
from tests.iq.recordings import RATE_HZ, write_bursts

REGISTRY = Path(__file__).parents[2] / "etc/registry.csv"
DEVICE = ("--device", "driver=none", "--frequency", "433e6", "--transmit")


@pytest.fixture
def config(tmp_path):
    """Writes a configuration; by default with a radio that writes the recording `sent`."""

    def write(text='backend = "iqfile"\n[iqfile]\ntransmit = "sent"\npaced = false\n', rate_hz=2e6):
        path = tmp_path / "robot.toml"
        head, _, tables = text.partition("\n")
        path.write_text(f'registry = "{REGISTRY}"\n{head}\n[modem]\nrate_hz = {rate_hz}\n{tables}')
        return path

    return write


@pytest.mark.slow
def test_bursts_are_sent_and_decode_again(ctl, config, tmp_path):
    write_bursts(tmp_path / "rec")
    code, out, err = ctl("replay", tmp_path / "rec", "--config", config(), "--repeat", 2)
    assert (code, err) == (0, "")
    assert out.startswith("sent 6 of 6 stretches; silence between them is below -3")
    assert "late" not in out
    _, out, _ = ctl("phy", "decode", tmp_path / "sent")
    assert "pdus_good 12" in out


def test_raw_samples_are_sent_too(ctl, config, tmp_path):
    samples = np.zeros(30_000, np.complex64)
    samples[5000:9000] = 0.25
    samples.tofile(tmp_path / "raw.bin")
    given = ("replay", tmp_path / "raw.bin", "--config", config())
    code, out, _ = ctl(*given, "--type", "cf32_le")
    assert (code, out) == (0, "sent 1 of 1 stretches; silence between them is below -200.0 dBFS\n")
    code, _, err = ctl(*given)
    assert code == 2
    assert "raw.bin: unknown sample type; name one" in err


def test_what_is_not_sent_is_told_by_the_exit_code(ctl, config, tmp_path):
    """The stream ends first, because its recording is too short."""
    write_bursts(tmp_path / "rec")
    record(tmp_path / "short", np.zeros(240_000, np.complex64), rate_hz=RATE_HZ)
    radio = 'backend = "iqfile"\n[iqfile]\nreceive = "short"\ntransmit = "sent"\npaced = false\n'
    code, out, err = ctl("replay", tmp_path / "rec", "--config", config(radio))
    assert (code, err) == (1, "")
    first, second = out.splitlines()
    assert first.startswith("sent ")
    assert "of 3 stretches" in first
    assert second.startswith("late 0, underflow 0, lost ")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--transmit",), "no radio given; allowed: --config FILE, or --device ARGS"),
        (DEVICE[:4], "replay has no permission to transmit; allowed: --transmit, once"),
        (DEVICE, "--gain: not given, and replay needs it to transmit; allowed: a gain in dB, or"),
        ((*DEVICE[:2], "--transmit", "--gain", 0), "--frequency: not given; allowed with --device"),
        ((*DEVICE, "--gain", 0), 'soapy.device: got "driver=none", but SoapySDR'),
        ((*DEVICE, "--gain", 0, "--rate", 1e6), "sampled at 2000000 Hz, but the modem is set to"),
        ((*DEVICE, "--gain", 0, "--backoff-db", 2), "--backoff-db: got 2; its peaks would be"),
        ((*DEVICE, "--gains", "A=1", "--silence-db", 0), "nothing in it exceeds 0.0 dBFS"),
        ((*DEVICE, "--gains", "A="), '--gains: got "A="; allowed: ELEMENT=DB'),
    ],
)  # fmt: skip
def test_bad_input_is_refused_in_one_line(ctl, tmp_path, arguments, says):
    write_bursts(tmp_path / "rec")
    code, out, err = ctl("replay", tmp_path / "rec", *arguments)
    assert (code, out) == (2, ""), err
    assert says in err
    assert err.count("\n") == 1


SOAPY = 'backend = "soapy"\n[soapy]\ndevice = "driver=none"\n'


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "arguments", "says"),
    [
        ('backend = "direct"\n', (), 'backend: got "direct", which has no radio; allowed:'),
        (SOAPY, (), "to transmit; allowed: --transmit, or soapy.tx_enabled = true in"),
        (SOAPY, ("--transmit",), "soapy.tx_gain_db: not set; allowed with soapy.tx_enabled = true"),
        (f"{SOAPY}tx_gain_db = 0\n", ("--transmit",), "soapy.device: got"),
        ('backend = "loopback"\n', ("--gain", 0), "--gain: given with --config; allowed: [soa"),
        ('backend = "iqfile"\n[iqfile]\nreceive = "rec"\n', (), "this radio does not send (from"),
        ('backend = "iqfile"\n[iqfile]\ntransmit = "rec"\n', (), "being played and cannot be"),
    ],
)  # fmt: skip
def test_configurations_that_do_not_send_are_refused(ctl, config, tmp_path, text, arguments, says):
    write_bursts(tmp_path / "rec")
    size = (tmp_path / "rec.sigmf-data").stat().st_size
    path = config(text)
    path.write_text(path.read_text().replace("[modem]", "[modem]\nfrequency_hz = 433e6"))
    code, out, err = ctl("replay", tmp_path / "rec", "--config", path, *arguments)
    assert (code, out) == (2, ""), err
    assert says in err
    assert err.count("\n") == 1
    assert (tmp_path / "rec.sigmf-data").stat().st_size == size


def test_a_recording_of_another_rate_says_how_to_go_on(ctl, config, tmp_path):
    write_bursts(tmp_path / "rec")
    code, _, err = ctl("replay", tmp_path / "rec", "--config", config(rate_hz=5e6))
    assert code == 2
    for part in (
        "at 2000000 Hz, but the modem is set to 5000000 Hz",
        "modem.oversampling",
        "resample",
    ):
        assert part in err
    code, _, err = ctl("replay", tmp_path / "none", "--config", config())
    assert code == 2
    assert "none: no such recording" in err
