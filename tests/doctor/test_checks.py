"""Each check by itself, on invented machines."""

import os
from importlib import metadata
from pathlib import Path

import pytest

from backends import DeviceProbe, DirectionProbe, ProbeReport
from sdrlinkd.config import parse_config
from sdrlinkd.doctor import (
    Granted,
    Headroom,
    HostTerm,
    State,
    check_clock,
    check_directory,
    check_environment,
    check_headroom,
    check_host,
    check_limits,
    check_machine,
    check_machine_id,
    check_radio,
    check_usb,
    granted,
    measure_host,
)
from sdrlinkd.kernelclock import KernelClock, kernel_clock

GOOD, BAD, NONE = State.GOOD, State.BAD, State.NONE
STAT = "cpu  {} 0 10 70 0 0 0 {} 0 0\ncpu0 1 2 3\n"
ALL = Granted(
    can_hurry=True, nice=-20, shared_memory=True, files=1024, can_lock=True, short_slices=True
)


def by_name(findings):
    """Findings by what was examined; a bad one must say what to do."""
    assert all(each.to_do for each in findings if each.state is BAD)
    return {each.what: each for each in findings}


def states(findings):
    return {each.what: each.state for each in findings}


def machine(tmp_path, cores=4, load=0.5, stolen=0, governor="", is_timed=True):
    if governor:
        path = tmp_path / "cpu0" / "cpufreq" / "scaling_governor"
        path.parent.mkdir(parents=True)
        path.write_text(governor + "\n")
    stat = (STAT.format(100, 0), STAT.format(200 - stolen, stolen))
    return states(check_machine(cores, load, stat, tmp_path, is_timed=is_timed))


@pytest.mark.parametrize(
    ("given", "what", "state"),
    [
        ({}, "cores", GOOD),
        ({"cores": 1}, "cores", BAD),
        ({"cores": 1, "is_timed": False}, "cores", GOOD),
        ({"load": 4.0}, "load", GOOD),
        ({"load": 4.1}, "load", BAD),
        ({"stolen": 5}, "stolen time", GOOD),
        ({"stolen": 20}, "stolen time", BAD),
        ({}, "frequency governor", NONE),
        ({"governor": "performance"}, "frequency governor", GOOD),
        ({"governor": "powersave"}, "frequency governor", BAD),
        ({"governor": "powersave", "is_timed": False}, "frequency governor", GOOD),
    ],
)
def test_the_machine(tmp_path, given, what, state):
    assert machine(tmp_path, **given)[what] is state


def test_a_machine_that_tells_nothing(tmp_path):
    found = states(check_machine(2, 0.0, ("", ""), tmp_path, is_timed=True))
    assert (found["stolen time"], found["frequency governor"]) == (NONE, NONE)


def test_the_id_of_a_machine():
    for given, copies, state, told in (
        ("3d1219c7c4c5404a", None, GOOD, "3d1219c7…"),
        ("3d1219c7c4c5404a", [], GOOD, "3d1219c7…, not heard of any other robot"),
        ("3d1219c7c4c5404a", [2, 7], BAD, "that of robot 2 and robot 7, too"),
        ("", None, NONE, "none"), ("uninitialized", [], NONE, "none"),
    ):  # fmt: skip
        found = check_machine_id(given, copies)
        assert (found.state, found.told.startswith(told)) == (state, True)


def environment(tmp_path, requirements=(), versions=None, library=Path("modem.so"), phy_home=None):
    def version_of(name):
        if name not in (versions or {}):
            raise metadata.PackageNotFoundError(name)
        return versions[name]

    return by_name(
        check_environment(list(requirements), version_of, tmp_path, phy_home or tmp_path, library)
    )


def test_the_environment(tmp_path):
    wanted = ["zfec>=1.5", "numpy>=1.26", 'matplotlib>=3.8; extra == "plots"']
    found = environment(tmp_path, wanted, {"zfec": "1.10.0", "numpy": "2.0"})
    assert {each.state for each in found.values()} == {GOOD}
    assert found["packages"].told == "2, all installed"
    assert found["compiled modem"].told == "modem.so"


def test_what_the_environment_lacks(tmp_path):
    found = environment(
        tmp_path, ["zfec>=1.5", "numpy>=1.26"], {"numpy": "1.9"}, None, Path("/elsewhere")
    )
    assert found["packages"].told == "zfec is missing, numpy 1.9 is older than 1.26"
    assert found["packages"].to_do.endswith(" -m pip install 'zfec>=1.5' 'numpy>=1.26'")
    assert found["modem's package"].state is BAD
    assert "sdrlinkctl phy compile" in found["compiled modem"].to_do


def test_the_runtime_directory(tmp_path):
    def state(path):
        return by_name(check_directory(path, os.getuid()))["runtime directory"]

    assert state(tmp_path / "new" / "one").state is GOOD
    assert state(tmp_path).state is GOOD
    (tmp_path / "ctl.sock").touch()
    assert "holds a daemon's sockets" in state(tmp_path).told
    assert "a socket's path allows 95" in state(tmp_path / ("x" * 95)).told
    (tmp_path / "file").touch()
    assert "is not a directory" in state(tmp_path / "file").told
    open_to_all = tmp_path / "open"
    open_to_all.mkdir()
    open_to_all.chmod(0o777)
    assert "open to all" in state(open_to_all).told


def test_the_clock(tmp_path):
    kept, alone = KernelClock(True, 0.004), KernelClock(False, 16.0)
    assert states(check_clock(kept, 0.001, "")) == {"clock": GOOD, "clock's steps": GOOD}
    assert states(check_clock(alone, -0.3, "")) == {"clock": NONE, "clock's steps": BAD}
    assert states(check_clock(None, 0.0, ""))["clock"] is NONE
    (tmp_path / "sock").touch()
    assert states(check_clock(kept, 0.0, str(tmp_path / "sock")))["chrony.socket"] is GOOD
    missing = by_name(check_clock(kept, 0.0, str(tmp_path / "none")))["chrony.socket"]
    assert "refclock SOCK" in missing.to_do
    # This machine's own value may be present or absent, but never an error.
    assert kernel_clock() is None or kernel_clock().error_s >= 0


def test_what_the_system_grants(tmp_path):
    usb = tmp_path / "sys/module/usbcore/parameters/usbfs_memory_mb"
    usb.parent.mkdir(parents=True)
    usb.write_text("16\n")
    network = tmp_path / "proc/sys/net/core/rmem_max"
    network.parent.mkdir(parents=True)
    network.write_text("212992\n")
    without = Granted(
        can_hurry=False, nice=20, shared_memory=False, files=100, can_lock=False,
        short_slices=False,
    )  # fmt: skip
    assert set(states(check_limits(ALL, "driver=hackrf", tmp_path)).values()) == {GOOD}
    found = states(check_limits(without, "driver=uhd,addr=192.168.10.2", tmp_path))
    needed = ["real-time priority", "locked memory", "shared memory", "open files"]
    # Older kernels do without short slices.
    assert found == {**dict.fromkeys([*needed, "radio's buffers"], BAD), "time slices": NONE}
    found = states(check_limits(without, "", tmp_path))
    assert {found[each] for each in (*needed[:2], "radio's buffers")} == {NONE}
    assert states(check_limits(ALL, "driver=hackrf", tmp_path / "no"))["radio's buffers"] is NONE
    usb.write_text("8\n")
    assert states(check_limits(ALL, "driver=hackrf", tmp_path))["radio's buffers"] is BAD
    assert granted().files > 0


def plug(root, ids, number):
    folder = root / f"sys/bus/usb/devices/1-{number}"
    folder.mkdir(parents=True)
    vendor, product = ids.split(":")
    for key, text in (
        ("idVendor", vendor), ("idProduct", product), ("busnum", "1"), ("devnum", str(number)),
    ):  # fmt: skip
        (folder / key).write_text(f"{text}\n")
    node = root / f"dev/bus/usb/001/{number:03}"
    node.parent.mkdir(parents=True, exist_ok=True)
    node.touch()
    return node


def test_radios_on_usb(tmp_path, monkeypatch):
    assert check_usb("", tmp_path)[0].state is NONE
    missing = check_usb("hackrf", tmp_path)[0]
    assert (missing.state, "1d50:6089" in missing.told) == (BAD, True)
    node = plug(tmp_path, "1d50:6089", 7)
    plug(tmp_path, "046d:c077", 8)
    for driver in ("hackrf", ""):
        (found,) = check_usb(driver, tmp_path)
        assert found.state is GOOD
        assert f"HackRF One (1d50:6089) at {node}" in found.told
    assert check_usb("lime", tmp_path)[0].state is BAD
    assert check_usb("novel", tmp_path)[0].state is NONE
    monkeypatch.setattr(os, "access", lambda *_: False)
    closed = check_usb("hackrf", tmp_path)[0]
    assert (closed.state, bool(closed.to_do)) == (BAD, True)


WAY = DirectionProbe(
    rates_hz=[(2e6, 20e6)], frequencies_hz=[(1e6, 6e9)], gain_db=(0, 61),
    gains_db={"AMP": (0, 14), "VGA": (0, 47)}, antennas=["TX/RX"], formats=["CS8"], transfer=131072,
)  # fmt: skip
HACKRF = DeviceProbe(device="driver=hackrf", driver="HackRF", hardware="One", rx=WAY, tx=WAY)


def radio(text, found=HACKRF, binding="SoapySDR 0.8"):
    config = parse_config(text) if text is not None else None
    devices = [found] if found else []
    report = ProbeReport(
        binding=binding, modules=["/x/libHackRF.so"], devices=devices, notes=["none"]
    )
    return by_name(check_radio(config, report))


SOAPY = 'backend = "soapy"\n[soapy]\ndevice = "driver=hackrf"\n'


@pytest.mark.parametrize(
    ("text", "what", "state"),
    [
        ("[modem]\nrate_hz = 2e6\noversampling = 4", "receives at", GOOD),
        ("[modem]\nrate_hz = 1e6", "receives at", BAD),
        ('[modem]\nfrequency_hz = "433.92 MHz"', "receives on", GOOD),
        ('[modem]\nfrequency_hz = "7 GHz"', "receives on", BAD),
        ("[soapy.rx_gains]\nVGA = 40.0", "receives with VGA", GOOD),
        ("[soapy.rx_gains]\nVGA = 90.0", "receives with VGA", BAD),
        ("[soapy.rx_gains]\nLNB = 1.0", "receives with LNB", BAD),
        ("[modem]", "device sends", NONE),
        ('[access]\npolicy = "csma"', "access.policy", BAD),
        ('[access]\npolicy = "minislot"', "access.policy", BAD),
    ],
)
def test_the_radio_and_what_is_asked_of_it(text, what, state):
    assert radio(SOAPY + text)[what].state is state


def test_what_it_is_to_send():
    text = SOAPY + 'tx_enabled = true\ntx_gain_db = 70.0\ntx_antenna = "RX2"\n'
    found = radio(text)
    assert found["sends with all together"].state is BAD
    assert found["sends by"].state is BAD
    assert radio(text, HACKRF.__class__(device="x", rx=WAY))["device sends"].state is BAD


def test_radios_that_are_not_there():
    assert radio(SOAPY, None)["device"].state is BAD
    assert radio(None, None)["device"].state is NONE
    assert radio(SOAPY, None, "")["SoapySDR"].state is BAD
    assert radio(None, None, "")["SoapySDR"].state is NONE
    busy = DeviceProbe(device="driver=hackrf", problem="in use")
    assert "in use" in radio(SOAPY, busy)["device"].told
    assert radio(None)["device"].told == "HackRF One, half duplex"


def test_backends_without_a_device(tmp_path):
    def state(text):
        (found,) = check_radio(parse_config(text), None)
        return found.state

    assert state("") is NONE
    ether = f'backend = "ether"\n[ether]\ndir = "{tmp_path}"'
    assert state(ether) is BAD
    (tmp_path / "air.sock").touch()
    assert state(ether) is GOOD
    file = f'backend = "iqfile"\n[iqfile]\nreceive = "{tmp_path}/air"'
    assert state(file) is BAD
    (tmp_path / "air.sigmf-meta").touch()
    assert state(file) is GOOD


def test_what_the_modem_leaves_free():
    assert check_headroom(Headroom(5e6, 0.1, 0.7, 0)).state is GOOD
    slow = check_headroom(Headroom(5e6, 0.1, 0.9, 0))
    assert (slow.state, "2.5 Msps" in slow.to_do) == (BAD, True)
    assert check_headroom(Headroom(5e6, 0.1, 0.5, 1000)).state is BAD


async def test_how_late_this_machine_is():
    term = await measure_host(50)
    assert term.n == 50
    assert 0 < term.wakes_s + term.hands_over_s == term.host_s
    assert check_host(HostTerm(0.5, 0.5, 9), None).state is GOOD
    assert "--host 1000.0ms" in check_host(HostTerm(0.5, 0.5, 9), None).told
    assert check_host(HostTerm(0.001, 0.001, 9), 0.02).state is GOOD
    assert check_host(HostTerm(0.01, 0.011, 9), 0.02).state is BAD
