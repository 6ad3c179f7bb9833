"""How-to pages: each command works as printed, each file is one that the daemon reads."""

import contextlib
import re
import subprocess

import pytest

from sdrlinkd.client import ControlClient, NoDaemonError, Subscriber
from sdrlinkd.manual import find_how_to, how_tos
from sdrlinkd.process import wait_until
from tests.docs.pages import ROOT, File, commands_of, steps_of
from tests.docs.reader import PATIENCE_S, Reader
from tests.laws import one_in

FOLDER = ROOT / "docs/howto"
NAMES = sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "index")
TYPED = [name for name in NAMES if commands_of((FOLDER / f"{name}.md").read_text())]
STARTS_ITS_OWN = re.compile(r"^\$ (sdrlinkd --config|sdrlink-ether)", re.MULTILINE)
ALONE = "sdrlinkctl pub cmd_vel"
"""Asks for a receipt, which nobody gives a robot that is alone."""
ONE_SCREEN = 66
"""Lines of the longest page."""


def is_up(directory):
    """Whether the daemon there is up."""
    with contextlib.suppress(NoDaemonError), ControlClient(directory, 0.5) as control:
        return control.ask("status")["carrier"]["state"] == "up"
    return False


@pytest.fixture
def reader(tmp_path):
    """In a checkout, as far as commands need one."""
    (tmp_path / "etc").symlink_to(ROOT / "etc")
    typist = Reader(tmp_path, may_say_no=("sdrlinkctl doctor", "sdrlinkctl status", ALONE))
    yield typist
    typist.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", one_in(7, TYPED))
def test_commands_work_and_show_what_is_printed(reader, name):
    text = (FOLDER / f"{name}.md").read_text()
    if not STARTS_ITS_OWN.search(text):
        reader.leave_running("sdrlinkd --config etc/robot.toml")
        wait_until(lambda: is_up(reader.folder / "run"), PATIENCE_S, reader.behind("sdrlinkd"))
    for command in commands_of(text):
        reader.see(command)


def test_most_pages_show_commands_that_run():
    assert len(TYPED) >= 10


@pytest.mark.parametrize("name", NAMES)
def test_a_page_is_one_screen_and_listed(name):
    text = (FOLDER / f"{name}.md").read_text()
    lines = text.splitlines()
    assert lines[0].startswith("# ")
    assert len(lines) <= ONE_SCREEN
    assert max(len(line) for line in lines if not line.startswith("|")) <= 120
    assert f"[{name}]({name}.md)" in (FOLDER / "index.md").read_text()


def test_all_pages_are_those_that_help_shows():
    assert [page.name for page in how_tos()] == NAMES
    assert find_how_to("late-joiners", []).title == "Let robots that come late get the map"


@pytest.mark.slow
def test_a_publisher_in_c_sends_as_printed(daemon, tmp_path):
    source = next(
        each.text
        for each in steps_of((FOLDER / "other-languages.md").read_text())
        if isinstance(each, File) and each.name == "send.c"
    )
    (tmp_path / "send.c").write_text(source)
    subprocess.run(
        ["cc", "-Wall", "-Werror", "send.c", "-lzmq", "-o", "send"], cwd=tmp_path, check=True
    )
    with Subscriber("/rx_robot_1/cmd_vel", directory=daemon.directory) as heard:
        subprocess.run(
            [tmp_path / "send"], check=True, timeout=60,
            env={"SDRLINKD_RUNTIME_DIR": str(daemon.directory)},
        )  # fmt: skip
        message = heard.receive(20)
    assert (message.topic, message.payload) == ("/rx_robot_1/cmd_vel", b"\0\1" + bytes(50))
