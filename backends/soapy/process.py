"""The radio process: owns the device and moves samples, nothing else.

Started by SoapyRadio, which hands it two sockets and two pieces of shared memory. A driver that
crashes or hangs takes only this process with it. It opens the device once, and ends when the device
fails or the daemon is gone.
"""

import contextlib
import os
import resource
import signal
import socket
import sys

from backends.soapy.orders import Orders
from backends.soapy.protocol import MOST_BYTES, Blame, Failed, to_open
from backends.soapy.ring import SampleRing
from backends.soapy.session import Session
from backends.soapy.settings import SettingError
from backends.soapy.surface import DriverError, HostError

REALTIME, NICE = 10, -10
"""Priorities, where they may be had: samples do not wait."""
SWITCH_INTERVAL_S = 5e-4
"""Two threads that mostly wait in the driver should not wait for each other."""


def main() -> None:
    """`process.py CONTROL AIR RX_MEMORY TX_MEMORY`, numbers of inherited descriptors."""
    # Whoever stops the daemon, by Ctrl-C or systemd, lets it send what is queued and then end us.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    _hurry()
    control, air, rx_memory, tx_memory = (int(each) for each in sys.argv[1:5])
    with socket.socket(fileno=control) as control_socket, socket.socket(fileno=air) as air_socket:
        air_socket.setblocking(False)
        asked = to_open(control_socket.recv(MOST_BYTES))
        orders = Orders(control_socket, SampleRing(tx_memory, asked.tx_samples))
        try:
            Session(asked, orders, air_socket, SampleRing(rx_memory, asked.rx_samples)).run()
        except SettingError as error:
            orders.say(Failed(str(error), Blame.SETTINGS))
        except HostError as error:
            orders.say(Failed(str(error), Blame.HOST))
        except DriverError as error:
            orders.say(Failed(str(error), Blame.ABSENT))


def _hurry() -> None:
    """Go before others, as far as this process may."""
    may, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    with contextlib.suppress(PermissionError):
        if may >= REALTIME:
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(REALTIME))
        else:
            os.setpriority(os.PRIO_PROCESS, 0, NICE)


if __name__ == "__main__":
    main()
    # Drivers may keep threads that never end.
    sys.stdout.flush()
    os._exit(0)
