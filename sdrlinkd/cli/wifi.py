"""`phy decode-wifi`: decodes 802.11a frames, to test the modem's parts on foreign signals."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer
from rich.console import Console

from sdrlinkd.cli.phy import RecordingFile, SampleType, open_recording, phys, show_progress

if TYPE_CHECKING:
    from phy.wifi import HtFrame, WifiFrame
    from sdrlinkd.iq import IqRecording
    from sdrlinkd.iq.recording import Progress as OnProgress

PIECE = 1 << 20
SHORT_TRAINING = 320
LONGEST_FRAME = 1 << 17
"""Upper limit of a frame's length in samples: 4095 octets at 6 Mbit/s take 109 920."""

_KINDS = {
    0b0000: "association request", 0b0001: "association response", 0b0100: "probe request",
    0b0101: "probe response", 0b1000: "beacon", 0b1011: "authentication",
    0b1100: "deauthentication", 0b1101: "action",
    0b01_1000: "block ack request", 0b01_1001: "block ack", 0b01_1011: "RTS", 0b01_1100: "CTS",
    0b01_1101: "ack", 0b10_0000: "data", 0b10_0100: "null", 0b10_1000: "QoS data",
    0b10_1100: "QoS null",
}  # fmt: skip


@phys.command("decode-wifi")
def decode_wifi(
    file: RecordingFile,
    type_name: SampleType = "",
    json: Annotated[bool, typer.Option("--json", help="One JSON object a line.")] = False,
) -> None:
    """Decode 802.11a frames in a recording at 20 Msps; 802.11n frames are listed, not decoded."""
    from phy.wifi import HtFrame

    console = Console(soft_wrap=True)
    n, n_right, n_ht = 0, 0, 0
    with (
        open_recording(file, type_name, 20e6) as recording,
        show_progress(f"decode {file.name}", recording) as progress,
    ):
        for at, frame in _frames(recording, progress):
            if isinstance(frame, HtFrame):
                n_ht += 1
                record, line = _as_ht_record(at, frame), _ht_line(at, frame)
            else:
                n, n_right = n + 1, n_right + frame.is_right
                record, line = _as_record(at, frame), _line(at, frame)
            if json:
                typer.echo(msgspec.json.encode(record))
            else:
                console.print(line, highlight=False, markup=False)
        n_samples = recording.info.n_samples
    if not json:
        told = f"{n} frames, {n_right} with good FCS, in {n_samples} samples"
        told += f"; {n_ht} frames of 802.11n, not decoded" if n_ht else ""
        console.print(told, highlight=False)


def _frames(
    recording: "IqRecording", progress: "OnProgress"
) -> Iterator[tuple[int, "WifiFrame | HtFrame"]]:
    """(index of a frame's first sample, frame) for all frames, read piece by piece."""
    from phy.wifi import receive

    total, first = recording.info.n_samples, 0
    told_to = 0
    while told_to < total:
        is_last = first + PIECE >= total
        told_from, told_to = told_to, total if is_last else first + PIECE - LONGEST_FRAME
        for frame in receive(recording.read(first, PIECE)):
            if told_from <= first + frame.start < told_to:
                yield first + frame.start, frame
        # The next piece must include the short training before its first possible frame.
        first = told_to - SHORT_TRAINING
        progress(told_to)


def _line(at: int, frame: "WifiFrame") -> str:
    fcs = "right" if frame.is_right else "wrong"
    told = (
        f"{at / 20e6:.6f} s  {frame.rate.mbps} Mbit/s {frame.rate.name}  {len(frame.psdu)} B  "
        f"FCS {fcs}  SNR {frame.snr_db:.1f} dB  CFO {frame.cfo_hz / 1e3:+.2f} kHz"
    )
    return f"{told}  {_kind(frame.psdu)} {_addresses(frame.psdu)}" if frame.is_right else told


def _ht_line(at: int, frame: "HtFrame") -> str:
    signal = frame.signal
    width = "40" if signal.is_40_mhz else "20"
    return (
        f"{at / 20e6:.6f} s  802.11n {_format(frame)}, MCS {signal.mcs}, {width} MHz  "
        f"{signal.n_bytes} B, not decoded  SNR {frame.snr_db:.1f} dB  "
        f"CFO {frame.cfo_hz / 1e3:+.2f} kHz"
    )


def _format(frame: "HtFrame") -> str:
    return "HT-greenfield" if frame.is_greenfield else "HT-mixed"


def _as_ht_record(at: int, frame: "HtFrame") -> dict[str, object]:
    return {
        "sample": at,
        "format": _format(frame),
        "mcs": frame.signal.mcs,
        "mhz": 40 if frame.signal.is_40_mhz else 20,
        "n_bytes": frame.signal.n_bytes,
        "snr_db": round(frame.snr_db, 2),
        "cfo_hz": round(frame.cfo_hz, 1),
    }


def _as_record(at: int, frame: "WifiFrame") -> dict[str, object]:
    return {
        "sample": at,
        "mbps": frame.rate.mbps,
        "fcs": frame.is_right,
        "snr_db": round(frame.snr_db, 2),
        "cfo_hz": round(frame.cfo_hz, 1),
        "psdu": frame.psdu.hex(),
    }


def _kind(psdu: bytes) -> str:
    kind = (psdu[0] >> 2 & 3) << 4 | psdu[0] >> 4
    return _KINDS.get(kind, f"type {kind >> 4}, subtype {kind & 15}")


def _addresses(psdu: bytes) -> str:
    """Sender and receiver as text; acknowledgements contain only the receiver."""
    to, by = psdu[4:10].hex(":"), psdu[10:16].hex(":")
    return f"{by} → {to}" if len(psdu) >= 20 else f"→ {to}"
