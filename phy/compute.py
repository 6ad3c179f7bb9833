"""The kernels as the interpreter calls them, computed by whichever engine is in use."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from phy.kernels import acquire as acquire
    from phy.kernels import add_noise as add_noise
    from phy.kernels import blank as blank
    from phy.kernels import convolve as convolve
    from phy.kernels import cut_lines as cut_lines
    from phy.kernels import decode_blocks as decode_blocks
    from phy.kernels import decode_rows as decode_rows
    from phy.kernels import demodulate as demodulate
    from phy.kernels import encode_blocks as encode_blocks
    from phy.kernels import filter_strided as filter_strided
    from phy.kernels import find_lines as find_lines
    from phy.kernels import find_pulses as find_pulses
    from phy.kernels import interpolate as interpolate
    from phy.kernels import learn_channel as learn_channel
    from phy.kernels import list_decode as list_decode
    from phy.kernels import modulate as modulate
    from phy.kernels import modulate_bits as modulate_bits
    from phy.kernels import sanitise as sanitise
    from phy.kernels import search as search
    from phy.kernels import sense as sense
    from phy.kernels import settle as settle
    from phy.kernels import slip as slip
    from phy.kernels import strongest as strongest
    from phy.kernels import to_tones as to_tones


def __getattr__(name: str) -> Any:  # noqa: ANN401 (kernels of any kind)
    """Take a kernel from the engine on first use (PEP 562)."""
    if name.startswith("_"):
        raise AttributeError(name)
    from phy.engine import kernel

    found = kernel(name)
    globals()[name] = found
    return found
