"""The OFDM modem: bits to samples and back."""

__all__: list[str] = []
