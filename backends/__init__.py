"""Radios: IQ samples in and out."""

from backends.air import Channel
from backends.base import (
    SENDING,
    BackendError,
    Capabilities,
    Radio,
    RxBlock,
    Samples,
    Tuning,
    TxBurst,
    TxOutcome,
    TxReport,
)
from backends.ether import (
    AirParams,
    AirSense,
    Answer,
    BurstMedium,
    BurstShape,
    EtherHub,
    EtherRadio,
    Flight,
    HubWatch,
    LinkOverride,
    LocalEther,
    Outage,
    RadioParams,
    Track,
    World,
    burst_shape,
)
from backends.iqfile import IqFileRadio
from backends.loopback import LoopbackRadio
from backends.outstanding import GAP
from backends.oversampled import OversampledRadio
from backends.recording import RecordingInfo, RecordingReader, RecordingWriter, describe
from backends.samples import SAMPLE_TYPES

__all__ = [
    "GAP",
    "SAMPLE_TYPES",
    "SENDING",
    "AirParams",
    "AirSense",
    "Answer",
    "BackendError",
    "BurstMedium",
    "BurstShape",
    "Capabilities",
    "Channel",
    "EtherHub",
    "EtherRadio",
    "Flight",
    "HubWatch",
    "IqFileRadio",
    "LinkOverride",
    "LocalEther",
    "LoopbackRadio",
    "Outage",
    "OversampledRadio",
    "Radio",
    "RadioParams",
    "RecordingInfo",
    "RecordingReader",
    "RecordingWriter",
    "RxBlock",
    "Samples",
    "Track",
    "Tuning",
    "TxBurst",
    "TxOutcome",
    "TxReport",
    "World",
    "burst_shape",
    "describe",
]
