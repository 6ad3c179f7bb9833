"""Radios: IQ samples in and out."""

from backends.air import Channel
from backends.base import (
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
from backends.iqfile import IqFileRadio
from backends.loopback import LoopbackRadio
from backends.outstanding import GAP
from backends.recording import RecordingInfo, RecordingReader, RecordingWriter, describe
from backends.samples import SAMPLE_TYPES

__all__ = [
    "GAP",
    "SAMPLE_TYPES",
    "BackendError",
    "Capabilities",
    "Channel",
    "IqFileRadio",
    "LoopbackRadio",
    "Radio",
    "RecordingInfo",
    "RecordingReader",
    "RecordingWriter",
    "RxBlock",
    "Samples",
    "Tuning",
    "TxBurst",
    "TxOutcome",
    "TxReport",
    "describe",
]
