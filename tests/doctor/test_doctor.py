"""`sdrlinkctl doctor` as a user runs it."""

import json
import socket

import pytest

from backends import BackendError
from sdrlinkd import doctor
from sdrlinkd.cli import run
from sdrlinkd.config import ModemParams
from sdrlinkd.doctor import Headroom, headroom_found, measure_headroom
from sdrlinkd.errors import UserError
from sdrlinkd.process import Process
from tests.soapy_loopback import missing, module_folder

SOAPY = (
    'backend = "soapy"\n[modem]\nrate_hz = "2 Msps"\nfrequency_hz = "433.92 MHz"\n'
    '[soapy]\ndevice = "driver=hackrf"\n'
)
needs_radio = pytest.mark.skipif(bool(missing()), reason=missing())


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    """A machine with spare capacity; the measurement has a separate test."""
    quick = doctor.check_headroom(Headroom(2e6, 0.1, 0.3, 0))
    monkeypatch.setattr(doctor, "headroom_found", lambda *_: quick)
    monkeypatch.setattr("os.getloadavg", lambda: (0.0, 0.0, 0.0))
    monkeypatch.setenv("COLUMNS", "100")


@pytest.fixture
def examine(write_config, tmp_path, capsys):
    """With a configuration: (exit code, findings by what was examined)."""

    def of(text):
        path = write_config(tmp_path, text)
        code = run(["doctor", "--config", str(path), "--json"])
        told = json.loads(capsys.readouterr().out)
        found = {each["what"]: each for each in told["findings"]}
        is_bad = any(each["state"] == "bad" for each in told["findings"])
        assert (code, told["ok"]) == (int(is_bad), not is_bad)
        assert told["host_s"] > 0
        return code, found

    return of


def test_line_by_line_for_people(write_config, tmp_path, capsys):
    path = write_config(tmp_path, 'backend = "ether"\n[ether]\ndir = "air"\n')
    assert run(["doctor", "--config", str(path)]) == 1
    out, err = capsys.readouterr()
    lines = out.splitlines()
    marks = [line[0] for line in lines if line[:1] in "✓✗–" and line]
    assert set(marks) == {"✓", "✗", "–"}
    n = marks.count("✗")
    assert marks[:n] == ["✗"] * n
    assert f"→ no hub runs there; start one: sdrlink-ether --dir {tmp_path}/air" in " ".join(
        out.split()
    )
    assert "[chrony] from another robot" in out or "synchronized by NTP" in out
    assert lines[0] == f"{n} to do"
    assert "Traceback" not in out + err


@pytest.mark.slow
def test_a_hub_on_another_computer_is_checked_at_its_port(examine):
    with socket.socket() as port:
        port.bind(("127.0.0.1", 0))
        hub = f"127.0.0.1:{port.getsockname()[1]}"
        text = f'backend = "ether"\n[ether]\nhub = "{hub}"\n'
        absent = examine(text)[1]["hub of the air"]
        port.listen()
        present = examine(text)[1]["hub of the air"]
    assert (absent["state"], present["state"]) == ("bad", "good")
    assert "sdrlink-ether --listen" in absent["to_do"]


def test_a_wrong_configuration_is_a_wrong_use(write_config, tmp_path, capsys):
    path = write_config(tmp_path, 'namespace = "robot"\n')
    assert run(["doctor", "--config", str(path)]) == 2
    assert "robot_id: got -1" in capsys.readouterr().err


def test_without_a_radio_there_is_none_to_look_at(examine):
    _, found = examine("")
    assert found["radio"]["state"] == "not applicable"
    assert "USB device" not in found
    assert "CPU headroom" not in found, "no modem runs"


@pytest.mark.slow
@needs_radio
@pytest.mark.parametrize(
    ("more", "what", "state"),
    [
        ("", "device", "good"),
        ("", "receives at", "good"),
        ("rx_gains = { VGA = 90 }\n", "receives with VGA", "bad"),
        ('[access]\npolicy = "csma"\n', "access.policy", "bad"),
    ],
)
def test_a_radio_is_looked_at_and_not_sent_with(examine, monkeypatch, more, what, state):
    monkeypatch.setenv("SOAPY_SDR_PLUGIN_PATH", str(module_folder()))
    monkeypatch.setenv("SOAPY_SDR_ROOT", "/nonexistent")
    text = (
        'backend = "soapy"\n[modem]\nrate_hz = "2 Msps"\nfrequency_hz = "433.92 MHz"\n'
        f'[soapy]\ndevice = "driver=loopback,model=hackrf"\n{more}'
    )
    _, found = examine(text)
    assert found[what]["state"] == state, found[what]
    assert found["device sends"]["state"] == "not applicable"


@pytest.mark.slow
@needs_radio
def test_a_radio_that_is_not_there(examine, monkeypatch):
    monkeypatch.setenv("SOAPY_SDR_PLUGIN_PATH", str(module_folder()))
    monkeypatch.setenv("SOAPY_SDR_ROOT", "/nonexistent")
    code, found = examine(SOAPY)
    assert code == 1
    assert 'no driver "hackrf"' in found["device"]["told"]
    assert "1d50:6089" in found["USB device"]["told"]


@pytest.mark.slow
def test_a_daemon_really_runs_to_be_measured():
    found = measure_headroom(ModemParams(rate_hz=1e6), 256, 2.0)
    assert (found.rate_hz, found.samples_lost >= 0) == (1e6, True)
    assert 0 <= found.silent < found.full


def test_a_daemon_that_does_not_start_is_a_finding(monkeypatch):
    def fail(*_):
        raise UserError("the daemon did not start:\nno room")

    monkeypatch.setattr(Process, "start", fail)
    found = headroom_found(ModemParams(), 1024, 1.0)
    assert (found.state, "no room" in found.told) == ("bad", True)


@pytest.mark.slow
def test_a_driver_that_crashes_is_a_finding(examine, monkeypatch):
    def crash(_):
        raise BackendError("a driver crashed (signal 11)")

    monkeypatch.setattr("backends.probe_devices", crash)
    code, found = examine(SOAPY)
    assert code == 1
    assert "signal 11" in found["device"]["told"]
