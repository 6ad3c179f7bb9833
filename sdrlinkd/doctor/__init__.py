"""Checks whether this machine can run a node, and says what to do if it cannot.

A check takes its input as arguments and returns findings. It prints nothing and changes nothing; a
radio is opened only to receive.
"""

from sdrlinkd.doctor.clock import check_clock
from sdrlinkd.doctor.directory import check_directory
from sdrlinkd.doctor.environment import check_environment
from sdrlinkd.doctor.finding import Finding, State
from sdrlinkd.doctor.headroom import Headroom, check_headroom, headroom_found, measure_headroom
from sdrlinkd.doctor.host import HostTerm, check_host, measure_host
from sdrlinkd.doctor.limits import Granted, check_limits, granted
from sdrlinkd.doctor.machine import check_machine, check_machine_id
from sdrlinkd.doctor.radio import check_radio
from sdrlinkd.doctor.usb import ON_USB, check_usb, is_networked

__all__ = [
    "ON_USB",
    "Finding",
    "Granted",
    "Headroom",
    "HostTerm",
    "State",
    "check_clock",
    "check_directory",
    "check_environment",
    "check_headroom",
    "check_host",
    "check_limits",
    "check_machine",
    "check_machine_id",
    "check_radio",
    "check_usb",
    "granted",
    "headroom_found",
    "is_networked",
    "measure_headroom",
    "measure_host",
]
