"""Faults that are staged, and the verdict that a person should read within 5 s of each.

It is what `sdrlinkctl status` prints first at the robot named. The list was written before the
verdicts were: what a verdict says follows from it, not the other way round.
"""

from typing import NamedTuple


class Fault(NamedTuple):
    """What is done to a team of two robots, and how the verdict of robot `at` begins."""

    done: str
    at: int
    level: str
    reason: str


SEALED = (
    Fault("nothing, with a key", 1, "OK", ""),
    Fault("robot 2 has another key", 1, "DOWN", "robot 2 is heard, but uses another key"),
    Fault("robot 2 has another key", 2, "DOWN", "robot 1 is heard, but uses another key"),
    Fault("robot 2 has no key", 1, "DOWN", "robot 2 is heard, but sends in the clear"),
    Fault("robot 2 has the key in the mode auth", 1, "DOWN", "robot 2 is heard, but uses the mode"),
    Fault("robot 2 lost the numbers of its key", 2, "DOWN", "the numbers of key 0 are lost here"),
    Fault("robot 2 lost the numbers of its key", 1, "DEGRADED", "robot 2 has lost"),
    Fault("the disk of robot 1's state is full", 1, "DOWN", "the numbers of sealed PDUs cannot be"),
    Fault("another robot has our id and key", 1, "DOWN", "another robot has our id 1 and our key"),
)  # fmt: skip
"""With a key: the first line begins with the level and `, sealed`."""
IN_THE_CLEAR = (
    Fault("nothing, without a key", 1, "OK", ""),
    Fault("robot 2 has no key", 2, "DOWN", "robot 1 is heard, but seals its PDUs"),
    Fault("robot 2 has another network id", 1, "DOWN", "a robot is heard, but in another network"),
    Fault("robot 2 has another PDU size", 1, "DOWN", "a robot is heard, but with another PDU"),
    Fault("robot 2 has another registry", 1, "DEGRADED", "robot 2 has a different topic"),
    Fault("robot 2 is switched off", 1, "DEGRADED", "robot 2 not heard for"),
    Fault("robot 2 was never on", 1, "DEGRADED", "no robot heard yet"),
    Fault("the antenna of robot 1 is off", 1, "DEGRADED", "no robot heard for"),
    Fault("robot 2 hears robot 1 badly", 1, "DEGRADED", "robot 2 hears us at"),
    Fault("two busy processes beside robot 1", 1, "DEGRADED", "the CPU is too slow"),
    Fault("the event loop of robot 1 lags", 1, "DEGRADED", "the event loop lags"),
    Fault("the gain of robot 1 is too high", 1, "DEGRADED", "the receiver clips"),
    Fault("a tone fills robot 1's band in part", 1, "OK", ""),
    Fault("jammers fill more than three eighths of it", 1, "DEGRADED", "interference"),
    Fault("a jammer of preambles", 1, "DEGRADED", "interference"),
    Fault("robot 1 sends more than the air carries", 1, "DEGRADED", "traffic exceeds"),
    Fault("odometry waits 40 s in robot 1's queue", 1, "DEGRADED", "/robot_1/odom waits"),
    Fault("odometry of robot 2 is 44 s old", 1, "DEGRADED", "/rx_robot_2/odom is"),
    Fault("the hub is gone", 1, "DOWN", "no hub since"),
    Fault("the radio is unplugged", 1, "DOWN", "no radio since"),
    Fault("the radio refuses the frequency", 1, "DOWN", "the radio refuses"),
    Fault("a loopback without CPU", 1, "DEGRADED", "the CPU is too slow"),
    Fault("robot 1 stops", 1, "DEGRADED", "stopping"),
)  # fmt: skip
"""Without one: the first line begins with the level and `, in the clear`."""
