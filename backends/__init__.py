"""Radios: IQ samples in and out.

The simulated air needs `phy` and its compiled code. It is loaded on first use, so the radio process
and other users that only move samples never load it.
"""

import importlib
from typing import TYPE_CHECKING

from backends.backend import Backend, ModemNeeds, Presumption, RadioRequest
from backends.base import (
    SENDING,
    AbsentError,
    BackendError,
    Capabilities,
    Hear,
    Levels,
    Patience,
    Radio,
    RefusalError,
    RelaxingRadio,
    RxBlock,
    Samples,
    Tuning,
    TxBurst,
    TxOutcome,
    TxReport,
    TxWindows,
)
from backends.hub_address import HubAddress, hub_at, hub_in, hub_of, is_listening
from backends.late import LateRadio
from backends.outstanding import GAP
from backends.params import EtherParams, IqFileParams, JammerParams, LoopbackParams, ZmqParams
from backends.recording import GAP_LABEL, RecordingInfo, RecordingReader, describe, refuse_same
from backends.registry import BUILT_IN, find_backend, installed_names
from backends.samples import SAMPLE_TYPES
from backends.scheduling import Scheduling, may_lock_memory, take_short_slices
from backends.soapy import (
    Assessment,
    DeviceProbe,
    DirectionProbe,
    ProbeReport,
    SoapyParams,
    SoapyRadio,
    SoapySettings,
    assess_device,
    driver_of,
    probe_devices,
)
from backends.writing import Annotation, RecordingWriter

if TYPE_CHECKING:
    from backends.air import Channel
    from backends.ether import (
        SPEED_OF_LIGHT,
        AirParams,
        Answer,
        Antenna,
        EtherHub,
        EtherRadio,
        Hop,
        HubWatch,
        LinkOverride,
        LocalEther,
        Outage,
        RadioParams,
        Track,
        World,
        lockstep_capabilities,
    )
    from backends.iqfile import IqFileRadio
    from backends.loopback import LoopbackRadio
    from backends.offset import OffsetRadio
    from backends.oversampled import OversampledRadio
    from backends.zmqstream import ZmqRadio, open_endpoint

__all__ = [
    "BUILT_IN",
    "GAP",
    "GAP_LABEL",
    "SAMPLE_TYPES",
    "SENDING",
    "SPEED_OF_LIGHT",
    "AbsentError",
    "AirParams",
    "Annotation",
    "Answer",
    "Antenna",
    "Assessment",
    "Backend",
    "BackendError",
    "Capabilities",
    "Channel",
    "DeviceProbe",
    "DirectionProbe",
    "EtherHub",
    "EtherParams",
    "EtherRadio",
    "Hear",
    "Hop",
    "HubAddress",
    "HubWatch",
    "IqFileParams",
    "IqFileRadio",
    "JammerParams",
    "LateRadio",
    "Levels",
    "LinkOverride",
    "LocalEther",
    "LoopbackParams",
    "LoopbackRadio",
    "ModemNeeds",
    "OffsetRadio",
    "Outage",
    "OversampledRadio",
    "Patience",
    "Presumption",
    "ProbeReport",
    "Radio",
    "RadioParams",
    "RadioRequest",
    "RecordingInfo",
    "RecordingReader",
    "RecordingWriter",
    "RefusalError",
    "RelaxingRadio",
    "RxBlock",
    "Samples",
    "Scheduling",
    "SoapyParams",
    "SoapyRadio",
    "SoapySettings",
    "Track",
    "Tuning",
    "TxBurst",
    "TxOutcome",
    "TxReport",
    "TxWindows",
    "World",
    "ZmqParams",
    "ZmqRadio",
    "assess_device",
    "describe",
    "driver_of",
    "find_backend",
    "hub_at",
    "hub_in",
    "hub_of",
    "installed_names",
    "is_listening",
    "lockstep_capabilities",
    "may_lock_memory",
    "open_endpoint",
    "probe_devices",
    "refuse_same",
    "take_short_slices",
]

_LATER = {
    "backends.air": {"Channel"},
    "backends.iqfile": {"IqFileRadio"},
    "backends.loopback": {"LoopbackRadio"},
    "backends.offset": {"OffsetRadio"},
    "backends.oversampled": {"OversampledRadio"},
    "backends.zmqstream": {"ZmqRadio", "open_endpoint"},
}


def __getattr__(name: str) -> object:
    """Import an attribute on first use (PEP 562)."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    where = next((each for each, names in _LATER.items() if name in names), "backends.ether")
    return getattr(importlib.import_module(where), name)
