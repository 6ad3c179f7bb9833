"""README and the pages beside the code: their commands work, in the order of the page."""

import re
import subprocess
import tempfile

import pytest

from docs.site.stage import documents
from tests.backends.hubs import free_hub_port
from tests.docs.pages import (
    ROOT,
    Command,
    File,
    commands_of,
    missing_words,
    steps_of,
)
from tests.docs.reader import Reader
from tests.soapy_loopback import Bus, missing

BY_OTHER_TESTS = ("docs/howto/", "docs/radios/hackrf.md", "docs/radios/usrp.md")
HERE = ("README.md", "backends/ether/README.md", "tests/soapy_loopback/README.md",
        "docs/tutorial/two-laptops.md")  # fmt: skip
NOT_ON_THIS_MACHINE = {"make setup": "done", "export PATH=": "the tests' own"}


def text_of(page):
    """The page as people read it."""
    return (ROOT / page).read_text()


@pytest.fixture
def reader(tmp_path):
    """In a checkout, as far as commands need one."""
    typists = []

    def sit_down(name="reader", **how):
        folder = tmp_path / name
        typist = Reader(folder, **how)
        (folder / "etc").symlink_to(ROOT / "etc")
        typists.append(typist)
        return typist

    yield sit_down
    for typist in reversed(typists):
        typist.close()


def test_every_page_with_commands_is_run():
    for page in documents():
        if commands_of(text_of(page)):
            assert page in HERE or page.startswith(BY_OTHER_TESTS), page


def test_the_readme_fits_and_says_what_does_not_work():
    text = text_of("README.md")
    assert len(text.splitlines()) <= 200
    for word in (
        "in the clear without a key",
        "No physical radio",
        "one ROS 2 tested",
    ):
        assert word.lower() in text.lower(), word


@pytest.mark.long
@pytest.mark.realtime
def test_the_readme():
    """In the checkout itself: these are its first two commands."""
    for command in commands_of(text_of("README.md")):
        done = subprocess.run(
            command.line, shell=True, cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        screen = done.stdout + done.stderr
        assert not missing_words(command.shown, screen), screen


@pytest.mark.long
def test_the_ether(reader):
    typist = reader()
    for command in commands_of(text_of("backends/ether/README.md")):
        typist.see(command)


@pytest.mark.long
@pytest.mark.realtime
@pytest.mark.skipif(bool(missing()), reason=missing())
def test_the_test_radio(reader, tmp_path):
    typist = reader(
        replaced={"/tmp/modules": str(tmp_path / "modules")},
        may_say_no=("sdrlinkctl replay",),
        environment={"SOAPY_SDR_ROOT": "/nonexistent"},
    )
    with Bus("readme"):
        for command in commands_of(text_of("tests/soapy_loopback/README.md")):
            typist.see(command)
        typist.close()


@pytest.mark.long
def test_the_tutorial_of_two_laptops(reader):
    """Both laptops are this one; what one prints for the other is copied."""
    free_hub = free_hub_port().name
    replaced = {"192.168.1.5:47900": free_hub, "0.0.0.0:47900": free_hub}
    # The hub's folder, which the page leaves at its default, is for all of a computer.
    scratch = {"TMPDIR": tempfile.mkdtemp(prefix="hub")}
    both = {who: reader(who, replaced=replaced, environment=scratch) for who in ("first", "second")}
    run = 0
    for step in steps_of(text_of("docs/tutorial/two-laptops.md")):
        if isinstance(step, File):
            for typist in both.values():
                (typist.folder / step.name).write_text(step.text)
            continue
        if step.line.startswith(tuple(NOT_ON_THIS_MACHINE)):
            continue
        assert step.who, f"who types this? {step.line}"
        for who in both if step.who == "both" else [step.who]:
            both[who].see(step)
            run += 1
        if step.line.startswith("sdrlinkctl init"):
            both["first"].copy("team", both["second"])
        if step.line.startswith("echo 'battery"):
            # "Restart both daemons."
            for number, (each, typist) in enumerate(both.items(), 1):
                typist.behind("sdrlinkd").stop(within_s=30)
                again = f"sdrlinkd --config team/robot_{number}.toml &"
                typist.type(Command(each, again, ("is heard at …",)))
    assert run >= 10
    heard = both["second"].wait_for("python", r"23\.9 V, \d+\.\d ms old")
    assert [float(each) for each in re.findall(r"([\d.]+) V", heard)] == [24.1, 24.0, 23.9]
