"""Daemons on SoapySDR radios, real drivers in real time: each republishes what the other sends."""

import os
import signal
import struct
import sysconfig
import time
from pathlib import Path

import pytest

from backends.testing import AWAY_S
from sdrlinkd.client import Publisher, Subscriber
from tests.daemon.soapy import air, on_soapy
from tests.laws import one_in
from tests.machine import lacks
from tests.programs import sdrlinkd
from tests.soapy_loopback import missing, module_folder
from tests.waiting import wait_for

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing())
DEBIAN = Path("/usr/lib/python3/dist-packages")
BINDING = DEBIAN / f"_SoapySDR{sysconfig.get_config_var('EXT_SUFFIX')}"


@pytest.fixture(autouse=True)
def _drivers(monkeypatch):
    """Only the test radio's driver."""
    monkeypatch.setenv("SOAPY_SDR_PLUGIN_PATH", str(module_folder()))
    monkeypatch.setenv("SOAPY_SDR_ROOT", "/nonexistent")


@pytest.fixture
def bus(request):
    """An air for this test alone."""
    name = f"{os.getpid()}-{abs(hash(request.node.name)) % 10**6}"
    with air(name) as found:
        yield name, found


def up(robots):
    """Wait until all radios stream."""
    for robot in robots:
        wait_for(lambda robot=robot: robot.snapshot().carrier.counters.get("samples", 0) > 0, 60)


def body(number):
    """Bytes of an odometry message, identified by its number."""
    return struct.pack("<IQ", 0x100, number) + bytes(120)


def received(listener, n):
    """The next `n` payloads. What is sent again after a collision comes after later ones."""
    return [listener.receive(20).payload for _ in range(n)]


@pytest.mark.realtime
def test_what_one_sends_the_other_republishes_both_ways(start_daemon, bus):
    name, air_ = bus
    robots = [start_daemon(on_soapy(robot, name)) for robot in (1, 2)]
    up(robots)
    n = 40
    with (
        Subscriber("/rx_robot_2/odom", directory=robots[0].directory, depth=0) as first,
        Subscriber("/rx_robot_1/odom", directory=robots[1].directory, depth=0) as second,
        Publisher(robots[0].directory) as one,
        Publisher(robots[1].directory) as two,
    ):
        for number in range(n):
            one.send("/robot_1/odom", body(number))
            two.send("/robot_2/odom", body(number))
        for listener in (first, second):
            assert sorted(received(listener, n)) == list(map(body, range(n)))
    for robot in robots:
        snapshot = robot.snapshot()
        assert snapshot.carrier.state == "up"
        assert "loopback usrp, 915 MHz, rx 20 dB, tx 40 dB" in snapshot.carrier.detail
        assert_whole(robot)
    wait_for(lambda: not air_.stats(1).is_transmitting)


@pytest.mark.realtime
@pytest.mark.parametrize("fault", one_in(2, ["unplug", "crash"]))
def test_traffic_flows_again_when_a_device_is_back(start_daemon, bus, fault):
    """Within 2 s; no message arrives twice, and the ledger adds up."""
    name, air_ = bus
    robots = [start_daemon(on_soapy(robot, name)) for robot in (1, 2)]
    up(robots)
    number = iter(range(10**6))
    with (
        Subscriber("/rx_robot_1/odom", directory=robots[1].directory, depth=0) as listener,
        Publisher(robots[0].directory) as sender,
    ):

        def send():
            sender.send("/robot_1/odom", body(next(number)))
            message = listener.receive(0.05)
            got.extend([message.payload] if message else [])
            return message

        got = []
        wait_for(send)
        for unit in (1, 2):
            air_.inject(unit, fault)
            wait_for(lambda unit=unit: robots[unit - 1].snapshot().carrier.counters["outages"] == 1)
            if fault == "unplug":
                wait_for(lambda unit=unit: "gone" in robots[unit - 1].snapshot().carrier.detail)
                wait_for(lambda unit=unit: robots[unit - 1].snapshot().carrier.state == "down")
                while listener.receive(0) is not None:
                    continue
                air_.inject(unit, "replug")
                wait_for(send, BACK_S)
            else:
                wait_for(lambda unit=unit: robots[unit - 1].snapshot().carrier.state == "up")
                wait_for(send)
    assert len(got) == len(set(got))
    for robot in robots:
        assert_whole(robot)


BACK_S = 2.0
"""Time after its device is back in which a daemon must send and receive again."""


@pytest.mark.realtime
@pytest.mark.long
def test_a_driver_that_hangs_is_given_up(start_daemon, bus):
    name, air_ = bus
    robot = start_daemon(on_soapy(1, name, soapy="longest_tx_s = 0.1\n"))
    up([robot])
    air_.inject(1, "hang")
    wait_for(lambda: robot.snapshot().carrier.counters["outages"] == 1)
    wait_for(lambda: robot.snapshot().carrier.state == "up")


@pytest.mark.realtime
@pytest.mark.long
def test_faults_of_streams_are_counted_and_survived(start_daemon, bus):
    name, air_ = bus
    robots = [start_daemon(on_soapy(robot, name)) for robot in (1, 2)]
    up(robots)

    def counted(robot, counter):
        return robots[robot - 1].snapshot().carrier.counters.get(counter, 0)

    air_.inject(2, "overflow=5000")
    wait_for(lambda: counted(2, "samples_lost") >= 5000)
    assert counted(2, "gaps") >= 1
    air_.inject(2, "stall")
    wait_for(lambda: counted(2, "stalls") == 1)
    with Publisher(robots[0].directory) as sender:
        for fault, counter in (("time_error", "late"), ("underflow", "underflows")):
            air_.inject(1, fault)

            def provoke(counter=counter):
                sender.send("/robot_1/odom", body(0))
                return counted(1, counter) >= 1

            wait_for(provoke)
    for robot in robots:
        assert robot.snapshot().carrier.state == "up"
        assert_whole(robot)


@pytest.mark.realtime
def test_a_half_duplex_radio_sends_in_tx_windows(start_daemon, bus):
    name, air_ = bus
    half = {
        "model": "hackrf",
        "modem": "rate_hz = 2e6\noversampling = 4\n",
        "soapy": "turnaround_s = 0.02\n",
    }
    quiet = "[link]\nbeacon_s = 0\n[clock]\nperiod_s = 0\n"
    robots = [start_daemon(on_soapy(robot, name, **half) + quiet) for robot in (1, 2)]
    up(robots)
    with (
        Subscriber("/rx_robot_1/odom", directory=robots[1].directory, depth=0) as listener,
        Publisher(robots[0].directory) as sender,
    ):
        for number in range(10):
            sender.send("/robot_1/odom", body(number))
        assert sorted(received(listener, 10)) == list(map(body, range(10)))
    # The radio process reports its counts when it listens again.
    wait_for(lambda: robots[0].snapshot().carrier.counters["tx_spells"])
    wait_for(lambda: not air_.stats(1).is_transmitting)
    tx_windows = [robot.snapshot().carrier.counters["tx_spells"] for robot in robots]
    assert tx_windows[0] <= 4, "many bursts share a TX window"
    assert tx_windows[1] == 0
    for robot in robots:
        assert_whole(robot)


@pytest.mark.realtime
@pytest.mark.long
def test_nothing_is_sent_unless_that_is_wanted(start_daemon, bus):
    name, air_ = bus
    config = on_soapy(1, name).replace("tx_enabled = true", "tx_enabled = false")
    robot = start_daemon(config)
    up([robot])
    with Publisher(robot.directory) as sender:
        sender.send("/robot_1/odom", body(0))
        sender.flush()
    snapshot = robot.snapshot()
    assert snapshot.link.tx.queued == 1
    assert any("only receives" in notice for notice in snapshot.notices)
    stats = air_.stats(1)
    assert (stats.sent, stats.is_transmitting) == (0, False)


@pytest.mark.realtime
@pytest.mark.long
@pytest.mark.skipif(not BINDING.exists(), reason=lacks("python3-soapysdr"))
def test_the_official_binding_serves_as_well(start_daemon, bus, tmp_path, monkeypatch):
    for source in (BINDING, DEBIAN / "SoapySDR.py"):
        (tmp_path / source.name).symlink_to(source)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    name, _ = bus
    robots = [start_daemon(on_soapy(robot, name)) for robot in (1, 2)]
    up(robots)
    for robot in robots:
        assert "Python binding" in robot.snapshot().carrier.detail
    with (
        Subscriber("/rx_robot_1/odom", directory=robots[1].directory) as listener,
        Publisher(robots[0].directory) as sender,
    ):
        sender.send("/robot_1/odom", body(7))
        assert listener.receive(20).payload == body(7)


@pytest.mark.slow
def test_a_driver_that_is_not_installed_is_for_a_person_to_mend(write_config, tmp_path, bus):
    """Plugging in a device would not help."""
    config = on_soapy(1, bus[0]).replace("driver=loopback", "driver=hackrff")
    with sdrlinkd("--config", write_config(tmp_path, config)) as daemon:
        assert daemon.wait() == 2, daemon.err()
    last = daemon.err().splitlines()[-1]
    assert 'no driver "hackrff"' in last
    assert "its drivers: loopback" in last
    assert "Traceback" not in daemon.err()


@pytest.mark.realtime
@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "state", "parts"),
    [
        (
            ("noise_db=-50", "noise_db=-50,absent=1"),
            "waiting", ["there is no such device", "radio probe"],
        ),
        (("noise_db=-50", "noise_db=-50,busy=1"), "waiting", ["in use", "stop the other program"]),
        (
            ("rate_hz = 1e6", "rate_hz = 7e7"),
            "refused", ["modem.rate_hz: got 70 Msps", "0.2 to 61.44 Msps"],
        ),
        (
            ("tx_gain_db = 40.0", "tx_gain_db = 99.0"),
            "refused", ["soapy.tx_gain_db: got 99", "0 to 89 dB"],
        ),
        (
            ("frequency_hz = 915e6", "frequency_hz = 7e9"),
            "refused", ["got 7000 MHz", "50 to 6000 MHz"],
        ),
        (
            ("rx_gain_db = 20.0", 'rx_gains = { LNA = 3.0 }\nrx_antenna = "TX/RX"'),
            "refused", ['soapy.rx_gains: got "LNA"', '"PGA"'],
        ),
        (
            ("tx_gain_db = 40.0", 'tx_gain_db = 1\ntx_antenna = "X"'),
            "refused", ['tx_antenna: got "X"'],
        ),
        (
            ("tx_gain_db = 40.0", 'tx_gain_db = 1\nsettings = { colour = "red" }'),
            "refused", ['soapy.settings.colour: got "red"', "the device refuses it"],
        ),
        (
            ("noise_db=-50", "noise_db=-50,rate_error=0.01,lie=no"),
            "refused", ["the device chose", "a rate that it accepts"],
        ),
    ],
)  # fmt: skip
def test_what_a_device_does_not_take_is_a_state_and_no_end(start_daemon, bus, change, state, parts):
    config = on_soapy(1, bus[0])
    assert change[0] in config
    robot = start_daemon(config.replace(*change))
    wait_for(lambda: robot.snapshot().carrier.state == state, 60)
    snapshot = robot.snapshot()
    assert snapshot.verdict.level == "DOWN"
    for part in parts:
        assert part in snapshot.carrier.reason
        assert part in snapshot.verdict.reasons[0]
    assert_whole(robot)


@pytest.mark.realtime
def test_a_radio_that_comes_late_is_waited_for(start_daemon, bus):
    """Messages queued meanwhile are sent with their true age; those too old are dropped."""
    name, air_ = bus
    air_.inject(1, "unplug")
    robots = [start_daemon(on_soapy(robot, name)) for robot in (1, 2)]
    late, other = robots
    wait_for(lambda: "no radio, still trying: soapy.device" in late.log(), 60)
    assert late.snapshot().carrier.state == "waiting"
    up([other])
    with (
        Subscriber("/rx_robot_1/odom", directory=other.directory) as listener,
        Publisher(late.directory) as sender,
    ):
        sender.send("/robot_1/scan", body(0), lifespan_ms=1)
        wait_for(lambda: late.snapshot().link.tx.dropped.get("tx_expired") == 1)
        sender.send("/robot_1/odom", body(1))
        sender.flush()
        asked_at = late.snapshot().uptime_s
        air_.inject(1, "replug")
        message = listener.receive(LINK_S)
        assert message is not None, "no link in time"
        assert message.payload == body(1)
        waited_s = late.snapshot().uptime_s - asked_at
        assert message.age_us * 1e-6 <= waited_s + 1.0
    assert_whole(late)
    wait_for(lambda: "the radio is up after" in late.log())


LINK_S = 5.0
"""Time after its device appears in which a daemon must send and receive."""


@pytest.mark.realtime
@pytest.mark.long
def test_a_reload_that_makes_it_worse_ends_nothing(start_daemon, bus):
    name, air_ = bus
    air_.inject(1, "unplug")
    robot = start_daemon(on_soapy(1, name))
    wait_for(lambda: robot.snapshot().carrier.state == "waiting", 60)
    good = robot.config.read_text()
    for bad, said in (
        (
            good.replace("rate_hz = 1e6", "rate_hz = 1e4\nmcs = 0"),
            "raise modem.rate_hz or modem.mcs",
        ),
        (good.replace("driver=loopback", "driver=hackrff"), 'no driver "hackrff"'),
    ):
        robot.config.write_text(bad)
        robot.send_signal(signal.SIGHUP)
        wait_for(lambda said=said: said in robot.log() + robot.snapshot().carrier.reason)
    robot.config.write_text(good)
    robot.send_signal(signal.SIGHUP)
    air_.inject(1, "replug")
    wait_for(lambda: robot.snapshot().carrier.state == "up", 20)
    # While the device is away after it was up, its settings may change, too.
    air_.inject(1, "unplug")
    wait_for(lambda: robot.snapshot().carrier.state == "down", 20)
    robot.config.write_text(good.replace("tx_gain_db = 40.0", "tx_gain_db = 30.0"))
    robot.send_signal(signal.SIGHUP)
    wait_for(lambda: robot.snapshot().carrier.state in ("opening", "waiting"), 20)
    air_.inject(1, "replug")
    wait_for(lambda: "tx 30 dB" in robot.snapshot().carrier.detail, 20)


@pytest.mark.realtime
@pytest.mark.long
@pytest.mark.parametrize("mended_by", ["a reload", "replugging"])
def test_settings_that_were_refused_are_tried_again(start_daemon, bus, mended_by):
    name, air_ = bus
    good = on_soapy(1, name)
    robot = start_daemon(good.replace("tx_gain_db = 40.0", "tx_gain_db = 99.0"))
    wait_for(lambda: robot.snapshot().carrier.state == "refused", 60)
    wait_for(lambda: "the radio refuses the settings" in robot.log())
    if mended_by == "a reload":
        text = robot.config.read_text()
        robot.config.write_text(text.replace("tx_gain_db = 99.0", "tx_gain_db = 40.0"))
        robot.send_signal(signal.SIGHUP)
        wait_for(lambda: robot.snapshot().carrier.state == "up", 20)
        assert "tx 40 dB" in robot.snapshot().carrier.detail
        assert "re-read: topic policies and the radio's settings" in robot.log()
        return
    opened = air_.stats(1).opened

    def replugged():
        """Absent for longer than the check interval; nothing shows outside that it was noticed."""
        air_.inject(1, "unplug")
        time.sleep(2 * AWAY_S)
        air_.inject(1, "replug")
        time.sleep(AWAY_S)
        return air_.stats(1).opened > opened

    wait_for(replugged, 60)
    wait_for(lambda: robot.snapshot().carrier.state == "refused", 20)


@pytest.mark.realtime
@pytest.mark.long
def test_who_obeys_is_stopped_while_the_radio_is_refused(start_daemon, bus):
    """No command can arrive then, and that is when a stop is needed most."""
    name, air_ = bus
    robots = [
        start_daemon(
            on_soapy(robot, name) + '[topic.cmd_vel]\ndeadman_s = 6\n'
            "stop = { linear = { z = -0.5 } }\n"
        )
        for robot in (1, 2)
    ]  # fmt: skip
    up(robots)
    commander, obeying = robots
    with (
        Subscriber("/rx_robot_1/cmd_vel", directory=obeying.directory) as heard,
        Publisher(commander.directory) as out,
    ):
        out.send("/robot_1/cmd_vel", body(0)[:52])
        assert not heard.receive(20).is_stop
        air_.inject(2, "unplug")
        wait_for(lambda: obeying.snapshot().carrier.state == "down", 20)
        text = obeying.config.read_text()
        obeying.config.write_text(text.replace("tx_gain_db = 40.0", "tx_gain_db = 99.0"))
        obeying.send_signal(signal.SIGHUP)
        air_.inject(2, "replug")
        wait_for(lambda: obeying.snapshot().carrier.state == "refused", 20)
        assert heard.receive(20).is_stop
        assert heard.receive(0.5) is None
    assert obeying.snapshot().carrier.state == "refused"
    assert obeying.snapshot().link.received[0].stops == 1
    assert_whole(obeying)


def assert_whole(robot):
    """Assert that the ledger adds up."""
    with robot.control() as control:
        assert control.ask("check")["problems"] == []
