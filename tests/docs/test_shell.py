"""Blocks in `sh`: they run as printed, or the page says beside them what they need."""

import contextlib
import re
import shlex
import signal
import tomllib

import pytest

from docs.site.stage import documents
from sdrlinkd.cli.benchmarks import BENCHMARKS
from sdrlinkd.client import ControlClient, NoDaemonError
from sdrlinkd.process import Process, ProcessError, wait_until
from tests.adapters.recordings import robot_bag
from tests.docs.pages import ROOT, Command, blocks
from tests.docs.reader import PATIENCE_S, Reader

BLOCK = re.compile(r"^(?:<!-- needs: (.+) -->\n)?```sh\b.*?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BENCHMARK = re.compile(r"^python -m benchmarks\.(\w+)(?: --quick)?$")
ROS = ("README.md", "docs/ros.md")
"""Their first block brings the bridge up: tests/ros runs it, with nodes on both sides."""
UNTIL_STOPPED = re.compile(
    r"sdrlinkctl (web|exporter|bridge|log|topic hz|bag record|lab .*--web|demo .*--web)"
)
LAB_S = 3
STOPPED = (0, 130)
RUNS_S = 3.0


def found():
    """(page, number, what it needs, text) of each block."""
    for page in documents():
        for number, (needs, text) in enumerate(BLOCK.findall((ROOT / page).read_text())):
            yield page, number, needs, text


RUN = [
    pytest.param(page, text, id=f"{page}-{number}")
    for page, number, needs, text in found()
    if not needs and not BENCHMARK.match(text.strip()) and not (page in ROS and number == 0)
]


def lines_of(text):
    """The commands of a block, without what is said beside them."""
    joined = text.replace("\\\n", " ")
    return [
        shlex.join(words) if "*" not in line and "$" not in line else line.split(" #")[0].strip()
        for line in joined.splitlines()
        if (words := shlex.split(line, comments=True))
    ]


def is_up(directory):
    try:
        with ControlClient(directory, 0.5) as control:
            return control.ask("status")["carrier"]["state"] == "up"
    except NoDaemonError:
        return False


@pytest.fixture
def desk(tmp_path):
    """A checkout with a daemon, a recording, and what the page has its reader save."""
    for path in ROOT.iterdir():
        if path.name in ("etc", "docs", "ros", "systemd"):
            (tmp_path / path.name).symlink_to(path)
    robot_bag(tmp_path / "my_bag")
    typist = Reader(tmp_path, environment={"PYTHONPATH": str(ROOT)})
    typist.leave_running("sdrlinkd --config etc/robot.toml")
    wait_until(lambda: is_up(typist.folder / "run"), PATIENCE_S, typist.behind("sdrlinkd"))
    yield typist
    typist.close()


def test_every_block_runs_or_says_what_it_needs():
    for page, number, needs, text in found():
        benchmark = BENCHMARK.match(text.strip())
        if benchmark:
            assert benchmark[1] in BENCHMARKS, "tests/test_benchmarks.py runs it with --quick"
        elif number or page not in ROS:
            assert needs or (page, text) in [each.values for each in RUN], page
    assert len(RUN) >= 15


def test_extras_that_are_named_are_there():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    for page in documents():
        for _, text in blocks(page, "sh"):
            for named in re.findall(r"\[([\w,]+)\]'", text):
                assert set(named.split(",")) <= set(extras), page


@pytest.mark.long
@pytest.mark.realtime
@pytest.mark.parametrize(("page", "text"), RUN)
def test_a_block_runs_as_printed(desk, page, text):
    for _, saved in blocks(page, "toml"):
        if "[[robot]]" in saved:
            (desk.folder / "my-hall.toml").write_text(saved)
    for line in lines_of(text):
        typed = line
        if " lab " in line and "--duration" not in line:
            typed = f"{line} --duration {LAB_S}"
        if UNTIL_STOPPED.match(typed) or "--loop" in typed:
            stop_after_a_while(desk, typed)
            continue
        screen, code = desk.type(Command("", typed, ()))
        assert code == 0, f"{page}: {typed}: exit code {code}\n{screen}"
        assert "Traceback" not in screen


def stop_after_a_while(desk, line):
    """Start a command that runs until Ctrl-C, and type that, unless it ends by itself."""
    process = Process(
        ["/bin/sh", "-c", f"exec {line}"], name=line, environment=desk.environment,
        folder=desk.folder,
    )  # fmt: skip
    process.start()
    with contextlib.suppress(ProcessError):
        process.wait(RUNS_S)
    code = process.stop(signal.SIGINT, PATIENCE_S)
    assert code in STOPPED, f"{line}: exit code {code}\n{process.log()}"
    assert "Traceback" not in process.log()
