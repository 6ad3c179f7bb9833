"""Recordings that contain bursts."""

import numpy as np

import phy
from backends import RecordingWriter
from sdrlinkd.wire import Entry, Pdu, build

RATE_HZ = 2e6


def pdu(seq, size=64):
    """A small message of robot 3."""
    entry = Entry(0, seq, 0, 1, b"\0\1\0\0" + bytes(20))
    return build(
        Pdu(qos=0, compressed=False, src=3, dst=255, seq=seq, hop=1, entries=[entry]), size
    )


def write_bursts(path, mcs_list=(1, 3, 6), sample_type="ci16_le", snr_db=25.0, n_pdus=2):
    """Write one burst for each MCS, 20 000 samples apart, in noise; returns the PDUs."""
    rng = np.random.default_rng(4)
    writer = RecordingWriter(path, sample_type, RATE_HZ, 2.45e9)
    front_end = phy.FrontEnd(phy.FrontEndParams(noise_dbfs=-12 - snr_db), rng)
    air = phy.Path(phy.PathParams(RATE_HZ, 2.45e9, clock_ppm=8), rng)
    samples = np.zeros(20_000 * (len(mcs_list) + 1), np.complex64)
    sent = []
    for i, mcs in enumerate(mcs_list):
        pdus = [pdu(n_pdus * i + k) for k in range(n_pdus)]
        offset, burst = air.carry(phy.Transmitter(network=2).modulate(pdus, mcs))
        start = 20_000 * i + 5000 + offset
        samples[start : start + len(burst)] += burst * np.float32(10 ** (-12 / 20))
        sent += pdus
    writer.write(0, front_end.receive(samples))
    writer.close()
    return sent
