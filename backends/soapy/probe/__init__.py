"""The devices attached to this machine, and how a daemon would drive each.

This package owns the inspection of devices, in a process of its own because drivers may crash, and
the assessment of what it finds. It never sets a device, never sends or receives a sample, and never
runs beside a radio process on the same device.
"""

from backends.soapy.probe.assessment import Assessment, assess_device
from backends.soapy.probe.probing import probe_devices
from backends.soapy.probe.report import DeviceProbe, DirectionProbe, ProbeReport

__all__ = [
    "Assessment",
    "DeviceProbe",
    "DirectionProbe",
    "ProbeReport",
    "assess_device",
    "probe_devices",
]
