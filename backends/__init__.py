"""Radios: IQ samples in and out."""

__all__: list[str] = []
