"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from backends import feed, loopback
from backends.air import Timeline
from backends.dc import DcBlocker
from backends.ether import Medium, Piece, hub, presence, protocol, radio, real_time
from backends.ether.medium import LEAD, MARGIN, NOISE_DBFS
from backends.ether.presence import Presence
from backends.ether.real_time import BEHIND_S
from backends.ether.remote_clock import WINDOW_S, HubClock
from backends.ether.sockets import HubSockets
from backends.feed import MAX_WAITING, BlockFeed
from backends.hub_address import AIR, SKY
from backends.loopback import MAX_LATE_BLOCKS
from backends.outstanding import Outstanding
from backends.oversampled import TRIM
from backends.pace import Pace
from backends.recording import RAW_TYPES
from backends.scheduling import REALTIME
from backends.soapy.binding.api import check_buffer, check_result
from backends.soapy.driver_log import DriverLog
from backends.soapy.radio_process.clock import SampleClock
from backends.soapy.radio_process.session import AWAY_S
from backends.soapy.radio_process.timestamped_tx import TimestampedTransmitter
from backends.soapy.radio_process.tx_stream import TxStream

__all__ = [
    "AIR",
    "AWAY_S",
    "BEHIND_S",
    "CONSTANTS",
    "LEAD",
    "MARGIN",
    "MAX_LATE_BLOCKS",
    "MAX_WAITING",
    "NOISE_DBFS",
    "RAW_TYPES",
    "REALTIME",
    "SKY",
    "TRIM",
    "WINDOW_S",
    "BlockFeed",
    "DcBlocker",
    "DriverLog",
    "HubClock",
    "HubSockets",
    "Medium",
    "Outstanding",
    "Pace",
    "Piece",
    "Presence",
    "SampleClock",
    "Timeline",
    "TimestampedTransmitter",
    "TxStream",
    "check_buffer",
    "check_result",
    "protocol",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "max_waiting": (feed, "MAX_WAITING"),
    "loopback_max_behind_s": (loopback, "MAX_BEHIND_S"),
    "hub_look_after_ms": (hub, "LOOK_AFTER_MS"),
    "hub_answer_ms": (radio, "ANSWER_MS"),
    "hub_refused_s": (radio, "REFUSED_S"),
    "presence_ask_s": (presence, "ASK_S"),
    "presence_quiet_s": (presence, "QUIET_S"),
    "real_time_ask_s": (real_time, "ASK_S"),
    "real_time_max_behind_s": (real_time, "MAX_BEHIND_S"),
}
"""Constants that tests replace: `monkeypatch.setattr(*CONSTANTS["hub_answer_ms"], 50)`."""
