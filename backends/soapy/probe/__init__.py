"""What is attached to this machine, and how a daemon would drive it.

This room owns the look at devices, in a process of its own because drivers may crash, and the
judgement of what it finds. It never sets a device, sends or receives a sample, or runs beside a
radio process on the same device.
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
