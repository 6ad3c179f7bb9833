"""The records FLOWS and ADMIT, about air that is reserved (wire document, 6.20 and 6.21)."""

import struct
from typing import NamedTuple

FLOWS_NUMBERS = 1 << 16
"""Count of the numbers of FLOWS and ADMIT, which wrap around."""
FLOW_AIR_UNIT = 1 / 32768
"""Unit of the air of a flow: share of the airtime for one transmission of each message."""
ALL_AIR = 32768
MOST_FLOWS = 16
"""Most flows of a robot."""
_HEAD = struct.Struct(">BH")
_FLOW = struct.Struct(">BBHHII")
FLOW_SIZE = _FLOW.size
"""Octets of a FLOWS record for each flow."""
FLOWS_OVERHEAD = 2 + _HEAD.size
"""Octets of a FLOWS record that lists no flow."""
_ADMIT = struct.Struct(">BHBB")
ADMIT_OVERHEAD = 2 + _ADMIT.size
"""Octets of an ADMIT record that lists no flow."""
_QOS_BITS, _PRIORITY_BITS = 2, 7


class ReservedFlow(NamedTuple):
    """One flow of a FLOWS record: a message of `size` octets every `period_us` to robot `dst`.

    `air` is the share of the airtime that one transmission of each message takes, in FLOW_AIR_UNIT.
    """

    topic: int
    dst: int
    qos: int
    priority: int
    air: int
    period_us: int
    size: int


class Flows(NamedTuple):
    """FLOWS record `number` of robot `node`: all flows for which it wants air."""

    node: int
    number: int
    flows: tuple[ReservedFlow, ...] = ()


class Admit(NamedTuple):
    """ADMIT record `number` of robot `planner`: the topics of robot `node` that have air or not."""

    planner: int
    number: int
    node: int
    admitted: bytes = b""
    refused: bytes = b""


def is_newer_number(number: int, last: int) -> bool:
    """Whether a number of FLOWS or ADMIT is newer than the last one."""
    return 0 < (number - last) % FLOWS_NUMBERS < FLOWS_NUMBERS // 2


def build_flows(flows: Flows) -> bytes:
    """The value of a FLOWS record. Raises ValueError or struct.error if a field does not fit."""
    return _HEAD.pack(*flows[:2]) + b"".join(map(_build_flow, flows.flows))


def parse_flows(value: bytes) -> Flows:
    """The fields of a FLOWS value of sufficient length; octets after the last flow are ignored."""
    node, number = _HEAD.unpack_from(value)
    whole = len(value) - (len(value) - _HEAD.size) % _FLOW.size
    listed = tuple(map(_parsed, _FLOW.iter_unpack(value[_HEAD.size : whole])))
    return Flows(node, number, listed)


def build_admit(admit: Admit) -> bytes:
    """The value of an ADMIT record. Raises struct.error if a field is out of range."""
    head = _ADMIT.pack(*admit[:3], len(admit.admitted))
    return head + admit.admitted + admit.refused


def parse_admit(value: bytes) -> Admit:
    """The fields of an ADMIT value of sufficient length."""
    planner, number, node, n_admitted = _ADMIT.unpack_from(value)
    topics = bytes(value[_ADMIT.size :])
    return Admit(planner, number, node, topics[:n_admitted], topics[n_admitted:])


def _build_flow(flow: ReservedFlow) -> bytes:
    topic, dst, qos, priority, *amounts = flow
    if not (0 <= qos < 1 << _QOS_BITS and 0 <= priority < 1 << _PRIORITY_BITS):
        raise ValueError(f"{flow} does not fit its record")
    return _FLOW.pack(topic, dst, qos << _PRIORITY_BITS | priority, *amounts)


def _parsed(fields: tuple[int, ...]) -> ReservedFlow:
    topic, dst, rank, air, period_us, size = fields
    qos = rank >> _PRIORITY_BITS & (1 << _QOS_BITS) - 1
    priority = rank & (1 << _PRIORITY_BITS) - 1
    return ReservedFlow(topic, dst, qos, priority, air, period_us, size)
