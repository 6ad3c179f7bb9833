"""What a plan takes from the configuration, and what it presumes about the radio."""

from pathlib import Path

import pytest

from sdrlinkd.__main__ import main
from sdrlinkd.cli import run
from sdrlinkd.config import parse_config
from sdrlinkd.errors import UserError
from sdrlinkd.plan import HOST_S, Load, make_plan, setting_of

ETC = Path(__file__).parents[2] / "etc"
ODOM = Load(0, "odom", 10.0, 720.0, 720.0)
MEASURED_MS = {"oneway": (293, 434), "twoway": (458, 709)}
"""p50 and p99 on the HackRF-like test radio: docs/radios/hackrf.md."""
TWO_WAY = '[access]\npolicy = "tdma"\nnodes = [1, 2]\nslot_s = 0.3\nreuse = false\n'


def preset(name, access=""):
    """A configuration of etc/radios, as `sdrlinkd` reads it."""
    return parse_config((ETC / "radios" / f"{name}.toml").read_text() + access)


def odom(config, **how):
    """The plan of odometry at 10 Hz."""
    return make_plan([ODOM], {}, setting_of(config, 1, **how))


@pytest.mark.parametrize(("way", "access"), [("oneway", ""), ("twoway", TWO_WAY)])
def test_a_hackrf_is_as_late_as_it_was_measured(way, access):
    """The measurement allowed 20 ms for a change of direction."""
    plan = odom(preset("hackrf", access), turnaround_s=0.02)
    p50_ms, p99_ms = MEASURED_MS[way]
    assert p99_ms <= 1e3 * plan.topics[0].worst_s < 2 * p50_ms
    assert plan.is_feasible


def test_robots_turnaround_and_oversampling_come_from_the_configuration():
    alone, two = odom(preset("hackrf")), odom(preset("hackrf", TWO_WAY))
    assert (alone.robots, two.robots, two.policy) == (1, 2, "tdma")
    text = (ETC / "radios" / "hackrf.toml").read_text()
    for changed in (
        text.replace("[soapy]\n", "[soapy]\nturnaround_s = 0.2\n"),
        text.replace("oversampling = 4", "oversampling = 1"),
    ):
        assert changed != text
        assert odom(parse_config(changed)).topics[0].worst_s > alone.topics[0].worst_s + 0.1


def test_without_a_list_csma_is_planned_for_two():
    setting = setting_of(preset("usrp", '[access]\npolicy = "csma"\n'), 1)
    assert setting.robots == 2
    assert "planned for two robots" in setting.notes[0]


@pytest.mark.parametrize(("speed_m_s", "bound_ms"), [(5.0, 4.9), (0.5, None), (500.0, None)])
def test_on_the_move_bursts_are_as_short_as_the_link_makes_them(speed_m_s, bound_ms):
    """Neither longer than the modem allows, nor shorter than one PDU."""
    config = parse_config('backend = "loopback"\n[modem]\nrate_hz = "5 Msps"\nmax_burst_s = 0.01\n')
    at_rest, moving = setting_of(config, 1), setting_of(config, 1, speed_m_s=speed_m_s)
    assert len(moving.notes) == len(at_rest.notes) + 1
    if bound_ms is None:
        limits = pytest.approx(at_rest.longest_s), pytest.approx(at_rest.one_s)
        assert moving.longest_s == limits[speed_m_s > 100]
    else:
        assert moving.longest_s == pytest.approx(1e-3 * bound_ms, rel=0.01)


def test_options_go_before_the_configuration():
    config = preset("hackrf", TWO_WAY)
    assert odom(config, robots=3).robots == 3
    assert odom(config, robots=1).policy == "none"
    tx_windows = preset("hackrf")
    assert (
        odom(tx_windows, turnaround_s=0.3).topics[0].worst_s
        > odom(tx_windows).topics[0].worst_s + 0.2
    )


def test_the_machines_are_a_term_of_their_own():
    config = preset("usrp")
    none, default, slow = (odom(config, host_s=each) for each in (0.0, HOST_S, 0.05))
    worst_s = [each.topics[0].worst_s for each in (none, default, slow)]
    assert worst_s[1] - worst_s[0] == pytest.approx(HOST_S)
    assert worst_s[2] - worst_s[0] == pytest.approx(0.05)
    assert any("hosts 50 ms" in note for note in slow.notes)


def test_auto_comes_to_what_the_daemon_comes_to():
    two = odom(preset("usrp", "[access]\nnodes = [1, 2]\n"))
    assert two.policy == "tdma"
    assert any("access tdma, because this radio takes" in note for note in two.notes)


def test_what_the_daemon_refuses_is_planned_and_told():
    minislot = odom(preset("usrp", '[access]\npolicy = "minislot"\nnodes = [1, 2]\n'))
    assert minislot.carries < 0.1
    (refused,) = [note for note in minislot.notes if "the daemon refuses this" in note]
    assert "which leaves 9.3 % of the airtime usable with 2 robots on this radio" in refused


def test_what_is_presumed_is_told():
    for device, part in (
        ("driver=hackrf", "driver=hackrf: half duplex, as known for drivers of the kind hackrf"),
        ("driver=loopback,model=hackrf", "half duplex, as known for drivers of the kind hackrf"),
        ("driver=uhd,serial=1", "full duplex, as known for drivers of the kind uhd"),
        ("driver=something", "because its driver is unknown"),
    ):
        text = (ETC / "radios" / "usrp.toml").read_text()
        config = parse_config(text.replace("driver=uhd", device))
        assert any(part in note for note in odom(config).notes), device


def test_without_an_air_the_key_and_an_example_are_named(capsys):
    code = run(["plan", "--config", str(ETC / "sdrlinkd.toml"), "--topic", "odom:10:720"])
    said = capsys.readouterr().err
    assert code == 2
    for part in (
        'backend: got "direct", which has no channel to plan',
        'allowed: backend = "soapy"',
        'device = "driver=hackrf"',
        "etc/radios/hackrf.toml",
    ):
        assert part in said
    with pytest.raises(UserError, match="has no channel"):
        setting_of(parse_config('backend = "gnuradio"'), 1)


def checked(tmp_path, capsys, text):
    """Exit code and output of `sdrlinkd --check`."""
    (tmp_path / "registry.csv").write_text("odom,nav_msgs/Odometry\n")
    text = text.replace("../registry.csv", "registry.csv")
    text = text.replace("frequency_hz = 0.0", "frequency_hz = 433.5e6")
    (tmp_path / "c.toml").write_text(text)
    code = main(["--check", "--config", str(tmp_path / "c.toml")])
    told = capsys.readouterr()
    return code, told.out + told.err


@pytest.mark.parametrize(
    ("name", "access", "expected"),
    [
        ("usrp", "", (0, "access none, because access.nodes lists no other robot; 100 %")),
        ("usrp", "[access]\nnodes = [1, 2]\n", (0, "access tdma, because this radio")),
        ("usrp", '[access]\npolicy = "minislot"\nnodes = [1, 2]\n',
         (2, 'access.policy: got "minislot", which leaves 9.3 % of the airtime')),
        ("usrp", '[access]\npolicy = "minislot"\nnodes = [1, 2]\nforce = true\n',
         (0, "access minislot, as configured; 9.3 % of the airtime")),
        ("hackrf", '[access]\npolicy = "csma"\n', (2, 'access.policy: got "csma"; this radio')),
    ],
)  # fmt: skip
def test_check_tells_what_access_comes_to(tmp_path, capsys, name, access, expected):
    text = (ETC / "radios" / f"{name}.toml").read_text() + access
    code, said = checked(tmp_path, capsys, text)
    assert (code, expected[1] in said) == (expected[0], True), said


def test_check_refuses_nothing_of_a_radio_that_it_does_not_know(tmp_path, capsys):
    new = '[soapy]\ndevice = "driver=new"\n[modem]\nfrequency_hz = 1e9\n'
    for head in ('backend = "ether"\n[ether]\ndir = "air"\n', f'backend = "soapy"\n{new}'):
        code, said = checked(tmp_path, capsys, head + '[access]\npolicy = "csma"\nnodes = [1, 2]\n')
        assert code == 0
        assert 'warning: the daemon may refuse this: access.policy: got "csma"' in said
