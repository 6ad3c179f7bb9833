"""Opens one end of a transport by its name."""

from benchmarks.peers.latency.job import Address, Transport
from benchmarks.peers.latency.local import Local
from benchmarks.peers.latency.mavlink import Mavlink
from benchmarks.peers.latency.serial_port import SerialPort
from benchmarks.peers.latency.xrce import Xrce


def open_transport(address: Address, side: str, size: int) -> Transport:
    """A way for messages from `side`, "companion" or "fcu"; payloads have `size` bytes."""
    if address.transport == "local":
        return Local(int(address.place))
    if address.transport in ("direct", "ether", "line"):
        # Imported here: its dependencies are missing in other environments.
        from benchmarks.peers.latency.ours import BusEnd

        return BusEnd(address, side)
    return open_serial(address, side, size)


def open_serial(address: Address, side: str, size: int) -> SerialPort:
    """A transport over a serial line; see `open_transport`."""
    if address.transport == "mavlink":
        return SerialPort(address.place, Mavlink(side, size))
    return SerialPort(address.place, Xrce(side))
