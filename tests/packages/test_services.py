"""The package's services under systemd: at boot, in a crash, in an upgrade."""

import re
import shutil
from urllib.error import HTTPError
from urllib.parse import quote
from urllib.request import HTTPCookieProcessor, build_opener

import pytest
import zenoh

from benchmarks.fleet.field import free_endpoint
from benchmarks.peers.zenoh_node import configured
from tests.machine import lacks
from tests.packages.booted import SYSTEMD, Booted, as_user, lacking
from tests.waiting import wait_for

CONFIG = "/etc/sdrlinkd/sdrlinkd.toml"
PACKAGE = "/root/sdrlinkd.deb"
ALL = ("sdrlinkd", "sdrlinkd@two", "sdrlink-gateway")
BESIDE = ("sdrlink-web", "sdrlink-foxglove", "sdrlink-exporter")
TOKEN = "as agreed"


@pytest.fixture(scope="module")
def endpoint():
    return free_endpoint()


@pytest.fixture(scope="module")
def robot(installed, deb, endpoint, tmp_path_factory):
    """A robot's computer on which everything runs as a service."""
    if package := lacking():
        pytest.skip(lacks(package))
    debian = installed.copy(tmp_path_factory.mktemp("services") / "robot")
    debian.install(*SYSTEMD)
    # Where it runs, /tmp is empty at first.
    shutil.copy(deb, debian.path / PACKAGE.lstrip("/"))
    debian.run(
        f"sed -i 's|^listen = .*|listen = [\"{endpoint}\"]|' {CONFIG};"
        f"cp {CONFIG} /etc/sdrlinkd/two.toml; usermod -aG sdrlink robot"
    )
    booted = Booted(debian)
    try:
        booted.wait()
        booted.run(f"systemctl enable --now {' '.join(ALL)}")
        yield booted
    finally:
        booted.stop()
        shutil.rmtree(debian.path)


def pid_of(robot, unit):
    """The main process of a unit, which is active; 0 while it is not."""
    told = robot.run(f"systemctl show --property=ActiveState,MainPID {unit}")
    pid = int(re.search("MainPID=(.*)", told)[1])
    return pid if "ActiveState=active\n" in told else 0


def wait_until_active(robot, units=ALL):
    wait_for(lambda: all(pid_of(robot, unit) for unit in units), 60)


def test_the_daemon_is_up_and_people_of_its_group_can_use_it(robot):
    wait_for(lambda: "\nradio  direct up" in robot.answer("sdrlinkctl status"), 60)
    robot.run(as_user("robot", "sdrlinkctl status"))
    robot.run(as_user("robot", "SDRLINKD_RUNTIME_DIR=/run/sdrlinkd-two sdrlinkctl status"))


def test_the_gateway_answers_from_behind_its_hardening(robot, endpoint):
    def answers():
        with zenoh.open(configured(mode="client", connect=[endpoint])) as session:
            return [each.ok.payload.to_string() for each in session.get("sdrlink/*/@gw/*/gateway")]

    wait_until_active(robot, ["sdrlink-gateway"])
    wait_for(lambda: any('"has_daemon":true' in each for each in answers()), 30)


def test_page_foxglove_and_exporter_answer_from_behind_their_hardening(robot):
    """Each with a user of its own; the first two to whoever has the token."""
    ports = {unit: int(free_endpoint().rpartition(":")[2]) for unit in BESIDE}
    for unit, port in ports.items():
        name = unit.removeprefix("sdrlink-")
        variable = f"SDRLINK_{name.upper()}"
        robot.run(
            f"printf '{variable}_OPTIONS=--listen 127.0.0.1:{port}\n{variable}_TOKEN={TOKEN}\n'"
            f" > /etc/sdrlinkd/{name}.env; chmod 600 /etc/sdrlinkd/{name}.env"
        )
    robot.run(f"systemctl enable --now {' '.join(BESIDE)}")
    wait_until_active(robot, BESIDE)

    def got(unit, query=""):
        try:
            # The token comes back as a cookie.
            browser = build_opener(HTTPCookieProcessor())
            with browser.open(f"http://127.0.0.1:{ports[unit]}/{query}", timeout=5) as answer:
                return answer.status, answer.read().decode()
        except HTTPError as error:
            return error.code, ""
        except OSError:
            return 0, ""

    try:
        wait_for(lambda: "sdrlink_up{" in got("sdrlink-exporter", "metrics")[1], 60)
        wait_for(lambda: got("sdrlink-web", "?token=" + quote(TOKEN))[0] == 200, 60)
        assert got("sdrlink-web")[0] in (401, 403)
        wait_for(lambda: got("sdrlink-foxglove")[0] in (401, 403), 60)
    except AssertionError:
        pytest.fail(robot.answer(f"journalctl -q -n 40 -u {' -u '.join(BESIDE)}"))
    finally:
        robot.run(f"systemctl disable --now {' '.join(BESIDE)}")


def test_a_reload_changes_nothing_but_what_it_reads(robot):
    before = pid_of(robot, "sdrlinkd")
    robot.run("systemctl reload sdrlinkd")
    assert pid_of(robot, "sdrlinkd") == before


def test_a_daemon_that_dies_comes_again(robot):
    before = pid_of(robot, "sdrlinkd")
    robot.run("systemctl kill --signal=KILL --kill-who=main sdrlinkd")
    wait_for(lambda: pid_of(robot, "sdrlinkd") not in (0, before), 30)


def test_an_upgrade_starts_again_what_runs_and_only_that(robot):
    wait_until_active(robot)
    robot.run("systemctl stop sdrlinkd@two")
    before = {unit: pid_of(robot, unit) for unit in ALL}
    robot.run(f"apt-get install --reinstall -y -q {PACKAGE}")
    wait_until_active(robot, ["sdrlinkd", "sdrlink-gateway"])
    after = {unit: pid_of(robot, unit) for unit in ALL}
    assert after.pop("sdrlinkd@two") == before.pop("sdrlinkd@two") == 0
    assert not set(after.values()) & set(before.values())


def test_a_purge_stops_what_runs(robot):
    robot.run("systemctl start sdrlinkd@two")
    robot.run("apt-get purge -y -q sdrlinkd")
    assert robot.answer("systemctl list-units --all --no-legend 'sdrlink*'") == ""
    assert "sdrlink" not in robot.answer("ls /run; ps -eo user,args")
    assert "sdrlink" not in robot.answer("systemctl --failed")
