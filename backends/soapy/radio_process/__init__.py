"""The radio process: owns the device and moves samples, nothing else.

SoapyRadio starts it, and hands it two sockets and two pieces of shared memory. A driver that
crashes or hangs takes only this process with it. It opens the device once, and ends when the device
fails or the daemon is gone. It never modulates, decides what is sent, or looks for a device again
once that was open.
"""

from backends.soapy.radio_process.main import main

__all__ = ["main"]
