"""The radio process: owns the device and moves samples, nothing else.

SoapyRadio starts it with two sockets and two pieces of shared memory. A driver that crashes or
hangs takes down only this process. It opens the device once, and ends when the device fails or the
daemon is gone. It never modulates, never decides what to send, and never reopens a device.
"""

from backends.soapy.radio_process.main import main

__all__ = ["main"]
