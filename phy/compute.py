"""The kernels as the interpreter calls them, computed by whichever engine is in use."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from phy.kernels.acquisition import acquire as acquire
    from phy.kernels.acquisition import settle as settle
    from phy.kernels.convolution import convolve as convolve
    from phy.kernels.demodulator import demodulate as demodulate
    from phy.kernels.demodulator import learn_channel as learn_channel
    from phy.kernels.demodulator import slip as slip
    from phy.kernels.demodulator import to_tones as to_tones
    from phy.kernels.detector import sanitise as sanitise
    from phy.kernels.detector import search as search
    from phy.kernels.detector import strongest as strongest
    from phy.kernels.ldpc import decode_blocks as decode_blocks
    from phy.kernels.ldpc_encoder import encode_blocks as encode_blocks
    from phy.kernels.list_viterbi import list_decode as list_decode
    from phy.kernels.modulator import modulate as modulate
    from phy.kernels.modulator import modulate_bits as modulate_bits
    from phy.kernels.noise import add_noise as add_noise
    from phy.kernels.resampler import filter_strided as filter_strided
    from phy.kernels.resampler import interpolate as interpolate
    from phy.kernels.sensing import sense as sense
    from phy.kernels.viterbi import decode_rows as decode_rows


def __getattr__(name: str) -> Any:  # noqa: ANN401 (kernels of any kind)
    """Take a kernel from the engine on first use (PEP 562)."""
    if name.startswith("_"):
        raise AttributeError(name)
    from phy.engine import kernel

    found = kernel(name)
    globals()[name] = found
    return found
