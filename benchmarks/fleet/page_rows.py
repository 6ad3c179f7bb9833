"""What the page costs, at the operator's desk and at a robot."""

import asyncio
import math
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec

from benchmarks import processes
from benchmarks.daemons import is_up, running
from benchmarks.fleet.field import FLEET, free_endpoint, routed
from benchmarks.peers.browser import Browser
from benchmarks.report import Row
from sdrlinkd.adapters import empty, to_cdr
from sdrlinkd.asking import snapshot_at
from sdrlinkd.client import Publisher
from sdrlinkd.config import FleetParams
from sdrlinkd.fleet import Answer, Keys, Passed, encode, open_session
from sdrlinkd.reports import NeighborReport, ReceivedTopicReport, Snapshot

ROBOTS, TOPICS, UPDATES_HZ = 20, 8, 5
ODOMETRY = "nav_msgs/msg/Odometry"
SETTLED_S = 8.0
GATEWAY = 99


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """A page that shows 20 robots, and a daemon that is looked at."""
    del seed
    seconds = 5.0 if quick else 30.0
    yield _desk(seconds)
    yield from _robot(seconds)


def _desk(seconds: float) -> Row:
    endpoint = free_endpoint()
    over = threading.Event()
    with routed(endpoint), _idle_daemon() as folder, ExitStack() as stack:
        report = snapshot_at(folder)
        if report is None:
            raise ValueError("the daemon does not answer")
        driving = threading.Thread(target=lambda: asyncio.run(_drive(endpoint, report, over)))
        driving.start()
        stack.callback(driving.join)
        stack.callback(over.set)
        page = stack.enter_context(_page("--fleet", FLEET, "--connect", endpoint))
        cpu_pct = _cpu_pct(page, seconds)
    return Row(
        "page_desk_cpu_pct", cpu_pct, "%", 20, "less", 1,
        note=f"of one core: the map of {ROBOTS} robots in a browser, {UPDATES_HZ} updates a second",
    )  # fmt: skip


def _robot(seconds: float) -> Iterator[Row]:
    """The daemon's share alone, and with a page that shows its map, and its air."""
    over = threading.Event()
    with _idle_daemon() as folder, ExitStack() as stack:
        sending = threading.Thread(target=_send, args=(folder, over))
        sending.start()
        stack.callback(sending.join)
        stack.callback(over.set)
        daemon = _pid_of(folder)
        time.sleep(SETTLED_S)
        alone = _cpu_pct(daemon, seconds)
        with _page("--runtime-dir", str(folder)):
            watched = _cpu_pct(daemon, seconds)
    yield Row(
        "page_robot_cpu_pct", watched - alone, "%", 2, "less", 1, peers={"daemon_alone": alone},
        note="of one core: what a daemon needs more while a page shows its map",
    )  # fmt: skip


@contextmanager
def _idle_daemon() -> Iterator[Path]:
    with running("direct", [1], ["odom"], "", "", ready=is_up) as started:
        yield started.folders[1]


def _pid_of(folder: Path) -> int:
    return int((folder / "lock").read_text())


@contextmanager
def _page(*options: str) -> Iterator[int]:
    """A page that a browser looks at, from when it shows robots: the id of its process."""
    with ExitStack() as stack:
        arguments = ("web", "--listen", "127.0.0.1:0", *options)
        page = processes.start_module(stack, "page", "sdrlinkd.cli", *arguments)
        url = page.line().removeprefix("page at ")
        profile = stack.enter_context(TemporaryDirectory(prefix="browser-"))
        browser = Browser(Path(profile))
        stack.callback(browser.close)
        browser.open(url)
        browser.see(lambda: browser.all("polyline.path"), "robots")
        time.sleep(SETTLED_S)
        yield page.pid


def _cpu_pct(pid: int, seconds: float) -> float:
    before, began_at = processes.usage(pid), time.monotonic()
    time.sleep(seconds)
    used_s = processes.usage(pid).cpu_s - before.cpu_s
    return 100 * used_s / (time.monotonic() - began_at)


def _send(folder: Path, over: threading.Event) -> None:
    """A robot that publishes where it is."""
    with Publisher(runtime_dir=folder) as out:
        while not over.wait(1 / UPDATES_HZ):
            out.send("/robot_1/odom", _odometry(1, time.monotonic()))


async def _drive(endpoint: str, report: Snapshot, over: threading.Event) -> None:
    """A gateway that hears 20 robots, all of which drive."""
    session = await open_session(FleetParams(name=FLEET, connect=[endpoint]), Path())
    keys = Keys(FLEET)
    key = keys.gateway(GATEWAY, "status")
    session.answer(key, lambda _: [Answer(key, msgspec.json.encode(_crowded(report)))])
    number = 0
    while not over.is_set():
        for robot in range(1, ROBOTS + 1):
            cdr, told = _odometry(robot, time.monotonic()), Passed(GATEWAY, ODOMETRY, 1, 0, number)
            session.put(keys.message(robot, "odom"), cdr, encode(told), "default")
        number += 1
        await asyncio.sleep(1 / UPDATES_HZ)
    await session.close()


def _crowded(report: Snapshot) -> Snapshot:
    """A daemon's report as if it heard 20 robots with eight topics each."""
    robots = range(1, ROBOTS + 1)
    neighbors = [
        NeighborReport(
            src=robot, is_self=False, last_heard_s_ago=0.1, pdus_heard=1000, pdus_lost=10,
            per=0.01, per_lately=0.01, duplicates=0, hops_left=1, reboots=0, snr_db=20.0,
        )
        for robot in robots
    ]  # fmt: skip
    received = [
        ReceivedTopicReport(
            src=robot, topic_id=topic, name=f"/t{topic}",
            republished_as=f"/rx_robot_{robot}/t{topic}", delivered=1000, pdr=0.99,
        )
        for robot in robots for topic in range(TOPICS)
    ]  # fmt: skip
    link = msgspec.structs.replace(report.link, neighbors=neighbors, received=received)
    return msgspec.structs.replace(report, node=GATEWAY, link=link)


def _odometry(robot: int, at_s: float) -> bytes:
    message = empty(ODOMETRY)
    position, turn = message.pose.pose.position, message.pose.pose.orientation
    angle = 0.3 * at_s + robot
    position.x, position.y = robot * math.cos(angle), robot * math.sin(angle)
    turn.z, turn.w = math.sin(angle / 2), math.cos(angle / 2)
    return to_cdr(message, ODOMETRY)
