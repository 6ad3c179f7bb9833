"""Runs a scenario: a hub, a daemon per robot, producers and consumers; all stop at the end."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import permutations
from pathlib import Path

from backends import Answer, BackendError, HubWatch
from sdrlinkd.demo import (
    Sample,
    Source,
    Trace,
    daemon_process,
    problems_of,
    run_folder,
    snapshot_of,
    wait_until_up,
)
from sdrlinkd.errors import UserError
from sdrlinkd.lab.over_time import Clock, Passage, classes_over_time
from sdrlinkd.lab.report import LabReport, pair_result, robot_result
from sdrlinkd.lab.robots import open_sources, write_daemon_config
from sdrlinkd.lab.scenario import Scenario, outages_of
from sdrlinkd.lab.traffic import Listener, Player, plan, trace_of
from sdrlinkd.process import Process, module
from sdrlinkd.reports import Snapshot

POLL_S = 0.5
# Longest time in s, after the hub's end, for messages still in daemons and on buses.
CATCH_UP_S = 20.0
SETTLED_S = 0.3
ACQUAINTED_S = 5.0
# The hub first loads compiled code.
START_TIMEOUT_S = 120.0


@dataclass(frozen=True)
class LabOptions:
    """A scenario, and the paths of its parts."""

    path: Path
    scenario: Scenario
    bag: Path | None
    traces: Path | None


@dataclass
class LabState:
    """A moment of a run, for the screen."""

    now_s: float
    until_s: float
    snapshots: list[Snapshot] = field(default_factory=list)


@dataclass
class _Robot:
    id: int
    directory: Path
    source: Source
    process: Process
    listener: Listener
    player: Player | None = None


Watch = Callable[[LabState], None]
Keep = Callable[[int, int, Trace, float], None]
"""Takes what passed from a robot to another one, and when the run began."""


def run_lab(options: LabOptions, watch: Watch, keep: Keep | None = None) -> LabReport:
    """Run a scenario to its end, and leave nothing running in any case. Raises UserError."""
    scenario = options.scenario
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(run_folder())
        outages_of(scenario, options.traces)
        sources = open_sources(scenario, options.bag)
        for source in sources.values():
            stack.callback(source.recording.close)
        configs = {
            robot.id: write_daemon_config(
                folder / f"robot_{robot.id}", scenario, robot, sources[robot.id], options.bag,
                folder / "hub", options.path.name,
            )
            for robot in scenario.robot
        }  # fmt: skip
        hub = _start_hub(stack, folder / "hub", options)
        robots = _start_robots(stack, configs, sources, by_age=scenario.pace == "lockstep")
        watcher = stack.enter_context(HubWatch(folder / "hub"))
        began_at = _begin(stack, robots, scenario)
        _wait_until_over(hub, watcher, robots, scenario, began_at, watch)
        snapshots = _settled(robots)
        watch(LabState(scenario.until_s, scenario.until_s, snapshots))
        problems = {robot.id: problems_of(robot.directory) for robot in robots}
        return _report(options, robots, snapshots, problems, began_at, keep)


def _start_hub(stack: contextlib.ExitStack, directory: Path, options: LabOptions) -> Process:
    scenario = options.scenario
    directory.mkdir()
    arguments = [str(options.path), "--dir", str(directory), "--seed", str(scenario.seed)]
    arguments += ["--duration", str(scenario.duration_s), "--pace", scenario.pace]
    if options.traces is not None:
        arguments += ["--traces", str(options.traces)]
    hub = Process(module("sdrlinkd.cli.ether", *arguments), log=directory / "log")
    stack.callback(hub.stop)
    hub.start()
    deadline = time.monotonic() + START_TIMEOUT_S
    with HubWatch(directory, timeout_s=POLL_S) as watcher:
        while hub.is_running and time.monotonic() < deadline:
            with contextlib.suppress(BackendError):
                watcher.ask()
                return hub
    raise UserError(f"the hub did not start:\n{hub.log()}")


def _start_robots(
    stack: contextlib.ExitStack, configs: dict[int, Path], sources: dict[int, Source], by_age: bool
) -> list[_Robot]:
    """Start all daemons in parallel, as each takes a while."""
    processes = {}
    for robot_id, config in configs.items():
        processes[robot_id] = process = daemon_process(config)
        stack.callback(process.stop)
        process.start()
    robots = []
    for robot_id, process in processes.items():
        directory = configs[robot_id].parent
        wait_until_up(process, directory)
        listener = stack.enter_context(Listener(directory, by_age))
        robots.append(_Robot(robot_id, directory, sources[robot_id], process, listener))
    return robots


def _begin(stack: contextlib.ExitStack, robots: list[_Robot], scenario: Scenario) -> float:
    """Start the senders; returns the start time, on the clock of the sent samples."""
    sending = {robot.id for robot in scenario.robot if robot.sends}
    if scenario.pace == "lockstep":
        return 0.0
    _acquainted(robots, scenario)
    for robot in robots:
        if robot.id in sending:
            robot.player = stack.enter_context(Player(robot.source, robot.directory))
    return time.monotonic()


def _acquainted(robots: list[_Robot], scenario: Scenario) -> None:
    """Wait until all robots have heard those in reach, for at most ACQUAINTED_S.

    Otherwise the first messages would wait until a robot has a schedule.
    """
    deadline = time.monotonic() + ACQUAINTED_S
    wanted = {
        robot.id: {each.id for each in robots if scenario.hears(robot.id, each.id)} - {robot.id}
        for robot in robots
    }
    while time.monotonic() < deadline:
        if all(
            wanted[robot.id] <= {each.src for each in snapshot_of(robot.directory).link.neighbors}
            for robot in robots
        ):
            return
        time.sleep(0.05)


def _wait_until_over(
    hub: Process,
    watcher: HubWatch,
    robots: list[_Robot],
    scenario: Scenario,
    began_at: float,
    watch: Watch,
) -> None:
    while True:
        for name, process in [("the hub", hub), *((f"robot {r.id}", r.process) for r in robots)]:
            if not process.is_running:
                raise UserError(f"{name} has ended:\n{process.log()}")
        for robot in robots:
            if robot.player is not None and robot.player.problem:
                raise UserError(f"robot {robot.id}: {robot.player.problem}")
        answer = _ask(watcher)
        if scenario.pace == "lockstep":
            now_s, is_over = answer.now_s, answer.is_over
        else:
            now_s = time.monotonic() - began_at
            playing = any(each.player and each.player.is_alive() for each in robots)
            is_over = now_s >= scenario.duration_s and not playing
        snapshots = [snapshot_of(robot.directory) for robot in robots]
        watch(LabState(min(now_s, scenario.until_s), scenario.until_s, snapshots))
        if is_over:
            return
        time.sleep(POLL_S)


def _ask(watcher: HubWatch) -> Answer:
    try:
        return watcher.ask()
    except BackendError as error:
        raise UserError(str(error)) from None


def _settled(robots: list[_Robot]) -> list[Snapshot]:
    """Wait until no message is in transit or nothing changes any more; returns the snapshots."""
    deadline = time.monotonic() + CATCH_UP_S
    seen: object = None
    still_since = time.monotonic()
    while True:
        snapshots = [snapshot_of(robot.directory) for robot in robots]
        busy = any(at.link.tx.queued or at.link.tx.in_flight or at.link.rx.held for at in snapshots)
        missing = any(
            at.bus.published != robot.listener.count
            for at, robot in zip(snapshots, robots, strict=True)
        )
        moving = [(at.link.tx.sent, at.link.rx.pdus_heard, at.bus.published) for at in snapshots]
        now = time.monotonic()
        if (moving, missing) != seen:
            seen, still_since = (moving, missing), now
        settled = now - still_since > (SETTLED_S if not (busy or missing) else 3.0)
        if settled or now > deadline:
            return snapshots
        time.sleep(0.05)


def _report(
    options: LabOptions,
    robots: list[_Robot],
    snapshots: list[Snapshot],
    problems: dict[int, list[str]],
    began_at: float,
    keep: Keep | None,
) -> LabReport:
    scenario = options.scenario
    sent = _sent(robots, scenario)
    clock = Clock(began_at=began_at, duration_s=scenario.duration_s)
    hop_limit, world = scenario.hop_limit if scenario.relays else None, scenario.world([])
    classes = {at.node: _classes(at) for at in snapshots}
    pairs, passages = [], list[tuple[str, Passage]]()
    for sender, receiver in permutations(robots, 2):
        if not sent[sender.id] or not scenario.in_reach(sender.id, receiver.id):
            continue
        trace = trace_of(sender.source, sent[sender.id], receiver.listener.received[sender.id])
        if keep is not None:
            keep(sender.id, receiver.id, trace, began_at)

        def counts(sample: Sample, ids: tuple[int, int] = (sender.id, receiver.id)) -> bool:
            """Nobody can expect what was sent while one of the two was off."""
            at = clock.since_begin(sample)
            return not any(world.is_off(robot, at) for robot in ids)

        pair, found = pair_result(sender.id, receiver.id, trace, clock, hop_limit, counts)
        pairs.append(pair)
        passages += [(classes[sender.id][each.topic], each) for each in found]
    out_of_reach = [
        (sender.id, receiver.id)
        for sender in robots
        for receiver in robots
        if sender is not receiver and not scenario.in_reach(sender.id, receiver.id)
    ]
    n_sent = sum(pair.sent for pair in pairs)
    return LabReport(
        scenario=options.path.stem,
        title=scenario.title,
        pace=scenario.pace,
        seed=scenario.seed,
        duration_s=scenario.duration_s,
        source=robots[0].source.title,
        pdr=sum(pair.received for pair in pairs) / n_sent if n_sent else 1.0,
        worst_pdr=min((pair.pdr for pair in pairs), default=1.0),
        robots=[
            robot_result(snapshot, problems[snapshot.node], scenario.until_s)
            for snapshot in snapshots
        ],
        pairs=pairs,
        out_of_reach=out_of_reach,
        damage=robots[0].source.recording.damage,
        classes=classes_over_time(passages, clock),
    )


def _classes(snapshot: Snapshot) -> dict[str, str]:
    """The class of each topic, by its name in the registry."""
    prefix = f"/robot_{snapshot.node}/"
    return {
        topic.name.removeprefix(prefix).removeprefix("/"): topic.qos
        for topic in snapshot.link.topics
    }


def _sent(robots: list[_Robot], scenario: Scenario) -> dict[int, dict[str, list[Sample]]]:
    """The messages sent, by robot and registry name."""
    if scenario.pace == "lockstep":
        sending = {robot.id for robot in scenario.robot if robot.sends}
        return {
            robot.id: plan(robot.source, scenario.duration_s) if robot.id in sending else {}
            for robot in robots
        }
    return {robot.id: robot.player.sent if robot.player else {} for robot in robots}
