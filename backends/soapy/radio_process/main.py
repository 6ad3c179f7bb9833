"""The radio process from start to end: signals, priority, and its report when it fails."""

import signal
import socket
import sys

from backends.scheduling import hurry, take_short_slices
from backends.soapy.binding import DriverError, HostError
from backends.soapy.protocol import MOST_BYTES, Blame, Failed, SampleRing, to_open
from backends.soapy.radio_process.session import Session
from backends.soapy.radio_process.tx_commands import TxCommands
from backends.soapy.settings import SettingError

SWITCH_INTERVAL_S = 5e-4
"""Short, because two threads that mostly wait in the driver should not wait for each other."""


def main() -> None:
    """Run with CONTROL, RX, RX_MEMORY, TX_MEMORY as arguments: numbers of descriptors."""
    # When Ctrl-C or systemd stops the daemon, it still sends what is queued before it ends us.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    # Samples do not wait.
    take_short_slices()
    hurry()
    control, rx, rx_memory, tx_memory = (int(each) for each in sys.argv[1:5])
    with socket.socket(fileno=control) as control_socket, socket.socket(fileno=rx) as rx_socket:
        rx_socket.setblocking(False)
        request = to_open(control_socket.recv(MOST_BYTES))
        commands = TxCommands(control_socket, SampleRing(tx_memory, request.tx_samples))
        try:
            Session(request, commands, rx_socket, SampleRing(rx_memory, request.rx_samples)).run()
        except SettingError as error:
            commands.say(Failed(str(error), Blame.SETTINGS))
        except HostError as error:
            commands.say(Failed(str(error), Blame.HOST))
        except DriverError as error:
            commands.say(Failed(str(error), Blame.ABSENT))
