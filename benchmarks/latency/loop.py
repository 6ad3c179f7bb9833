"""The control loop over links in lock-step, on a channel that other robots load.

The plant is at robot 1, the controller at robot 2. Ages are those that the receiving links report.
"""

import struct
from collections.abc import Callable
from random import Random
from typing import NamedTuple

import numpy as np

from backends import AirParams, RadioParams, World
from benchmarks.latency.control import (
    PERIOD_S,
    Controller,
    Held,
    Holding,
    Knows,
    Plant,
    State,
    at_the_plant,
    pushes,
)
from benchmarks.worlds.arrivals import poisson
from benchmarks.worlds.bursts import Simulation
from sdrlinkd.config import ModemParams
from sdrlinkd.link import (
    AccessParams,
    Delivered,
    Link,
    LinkParams,
    Overrides,
    Qos,
    QueueParams,
    ReassemblyParams,
)
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import make_registry

REGISTRY = make_registry([(name, "std_msgs/msg/UInt8MultiArray") for name in ("y", "u", "load")])
Y, U, LOAD = range(3)
PLANT, CONTROLLER = 1, 2
ROBOTS = 4
CDR = b"\0\1\0\0"
_STATE = struct.Struct("<ddddd")
"""Vc, Vc', and the fields of Held, in order."""
_ANSWER = struct.Struct("<Id")
"""Number, voltage."""
FAST, SLOW = Overrides(qos=Qos.LATENCY), Overrides(qos=Qos.BULK)
LOAD_SIZE = 3000
PPM = 10.0
BEGIN_S = 5.0
"""When the loop begins; until then the robots find out about each other."""


class Case(NamedTuple):
    """A channel, the turnaround of its radios, and the share of the air that bulk takes."""

    policy: str
    rate_hz: float
    mcs: int
    turnaround_s: float
    load: float
    pdu_size: int = 256


OLD = Case("tdma", 1e6, 1, 5e-3, 0.3)
"""A slow channel, on which messages wait for their robot's turn."""
FRESH = Case("minislot", 5e6, 3, 1e-4, 0.3)


class Loop(NamedTuple):
    """A run: Vc's difference to a controller at the plant, in V, and the ages of both ways in s."""

    error_v: State
    inputs_s: list[float]
    answers_s: list[float]
    n_sent: int


def run_loop(case: Case, knows: Knows, seed: int, seconds: float) -> Loop:
    """Close the loop over the links for so long."""
    pushed = pushes(np.random.default_rng(seed), seconds)
    plant, controller = Plant(pushed), Controller(knows)
    inputs_s: list[float] = []
    answers_s: list[float] = []
    holding, newest = Holding(), -1

    def tick(k: int) -> None:
        plant.advance(simulation.now - BEGIN_S)
        held = holding.report(simulation.now * simulation.stations[PLANT].pace)
        state = _STATE.pack(*plant.x, *held)
        simulation.submit(PLANT, Y, CDR + state, FAST)
        if (k + 1) * PERIOD_S < seconds:
            simulation.call(BEGIN_S + (k + 1) * PERIOD_S, lambda: tick(k + 1))

    def listen(node: int, message: Delivered, now: float) -> None:
        nonlocal newest
        is_ours = (node, message.topic_id) in ((PLANT, U), (CONTROLLER, Y))
        if message.origin_at is None or not is_ours:
            return
        own_now = now * simulation.stations[node].pace
        age_s = own_now - message.origin_at
        if node == CONTROLLER:
            vc, slope, *held = _STATE.unpack_from(message.payload, len(CDR))
            inputs_s.append(age_s)
            voltage = controller.answer(np.array([vc, slope]), Held(*held), age_s, own_now)
            simulation.submit(CONTROLLER, U, CDR + _ANSWER.pack(len(inputs_s), voltage), FAST)
            return
        number, voltage = _ANSWER.unpack_from(message.payload, len(CDR))
        # Only the newest counts, whatever the order of arrival.
        if number > newest:
            plant.advance(now - BEGIN_S)
            holding.take(voltage, message.origin_at, own_now)
            newest, plant.held = number, voltage
            answers_s.append(age_s)

    simulation = _simulation(case, seed, BEGIN_S + seconds, listen)
    simulation.call(BEGIN_S, lambda: tick(0))
    simulation.run(BEGIN_S + seconds)
    plant.advance(seconds)
    error_v = np.array(plant.vc) - at_the_plant(pushed)
    return Loop(error_v, inputs_s, answers_s, round(seconds / PERIOD_S))


def _simulation(
    case: Case, seed: int, seconds: float, listen: Callable[[int, Delivered, float], None]
) -> Simulation:
    rng, robots = np.random.default_rng([seed, 1]), range(1, ROBOTS + 1)
    modem = ModemParams(rate_hz=case.rate_hz, mcs=case.mcs, max_burst_s=0.02, block_s=1e-3)
    airtimes = Airtimes(modem, case.pdu_size)
    air = AirParams(rate_hz=case.rate_hz, snr_db=25.0, block_s=modem.block_s)
    pdus = airtimes.most_pdus(case.mcs, modem.max_burst_s)
    bytes_per_s = pdus * case.pdu_size / airtimes.airtime_s(case.mcs, pdus)
    per_s = case.load * bytes_per_s / LOAD_SIZE / ROBOTS
    return Simulation(
        air,
        World(air, {}),
        {
            robot: RadioParams(
                turnaround_s=case.turnaround_s, clock_ppm=float(rng.uniform(-PPM, PPM))
            )
            for robot in robots
        },
        {
            robot: Link(
                LinkParams(pdu_size=case.pdu_size), QueueParams(), ReassemblyParams(), REGISTRY,
                robot, Random(100 * seed + robot),
            )
            for robot in robots
        },
        modem,
        airtimes,
        AccessParams(policy=case.policy, nodes=list(robots), force=True),  # type: ignore[arg-type]
        {
            robot: poisson(
                np.random.default_rng([seed, 2, robot]), LOAD, per_s, LOAD_SIZE, seconds, SLOW
            )
            for robot in robots
        },
        seed=seed,
        listen=listen,
    )  # fmt: skip
