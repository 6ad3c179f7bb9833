"""`sdrlinkctl phy`: tables, figures and PDUs of recordings, and its response to bad input."""

import json
import re

import numpy as np
import pytest

import phy
from tests.iq.recordings import RATE_HZ, write_bursts
from tests.phy.signals import noisy, silence
from tests.phy.wifi_frames import frame, ht_frame, with_fcs


@pytest.fixture
def phy_ctl(ctl):
    """Runs `sdrlinkctl phy …`; (exit code, stdout, stderr)."""
    return lambda *arguments: ctl("phy", *arguments)


def test_info_for_people_and_programs(phy_ctl):
    code, out, _ = phy_ctl("info", "--rate", "1e6", "--pdu-size", 220)
    assert code == 0
    for part in ("1 Msps: 64 subcarriers 15.625 kHz apart", "16QAM 3/4", "64QAM 3/4", "3.55 ms"):
        assert part in out
    assert "the receiver searches for bursts up to 196 kHz off: two crystals of ±40 ppm" in out
    code, out, _ = phy_ctl("info", "--rate", "1e6", "--frequency", "5.9e9")
    assert "up to 250 kHz off" in out
    assert "raise modem.rate_hz, or state better crystals" in out
    code, out, _ = phy_ctl("info", "--json")
    told = json.loads(out)
    assert (told["rate_hz"], len(told["mcs"])) == (5e6, 10)


def test_decode_for_people_and_programs(phy_ctl, tmp_path):
    sent = write_bursts(tmp_path / "rec")
    code, out, _ = phy_ctl("decode", tmp_path / "rec.sigmf-meta")
    assert code == 0
    assert "QPSK 1/2  2 of 2 PDUs of 64 B good" in out
    assert "src 3 dst all seq 0" in out
    (offset_khz,) = re.findall(r"CFO (\S+) kHz", out.split("\n")[0])
    assert float(offset_khz) == pytest.approx(19.6, abs=0.05)
    assert "pdus_good 6" in out
    code, out, _ = phy_ctl("decode", "--json", tmp_path / "rec")
    bursts = [json.loads(line) for line in out.splitlines()]
    assert [pdu["hex"] for burst in bursts for pdu in burst["pdus"]] == [s.hex() for s in sent]
    assert bursts[1]["start_s"] == pytest.approx(25_000 / RATE_HZ, abs=1e-5)
    code, out, _ = phy_ctl("decode", "--network", 5, tmp_path / "rec")
    assert "bursts_foreign 3" in out


def test_noise_has_no_bursts(phy_ctl, tmp_path):
    rng = np.random.default_rng(1)
    rng.standard_normal(200_000).astype(np.float32).tofile(tmp_path / "noise.cf32")
    code, out, _ = phy_ctl("decode", tmp_path / "noise.cf32")
    assert (code, out) == (0, "no burst in 100000 samples\n")
    code, _, err = phy_ctl("constellation", tmp_path / "noise.cf32")
    assert code == 2
    assert "no burst was found in 100000 samples" in err


@pytest.mark.slow
@pytest.mark.parametrize("picture", ["spectrum", "constellation"])
def test_pictures_are_drawn(phy_ctl, tmp_path, monkeypatch, picture):
    """Figures are written to the working folder, not next to the recordings."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    write_bursts(tmp_path / "rec")
    recorded = sorted(tmp_path.iterdir())
    code, out, _ = phy_ctl(picture, tmp_path / "rec.sigmf-data")
    assert code == 0
    path = tmp_path / "here" / f"rec.{picture}.png"
    assert f"wrote rec.{picture}.png" in out
    assert sorted(tmp_path.iterdir()) == recorded
    assert path.read_bytes().startswith(b"\x89PNG")
    assert path.stat().st_size > 8000
    other = tmp_path / "other.png"
    assert phy_ctl(picture, tmp_path / "rec", "--out", other)[0] == 0
    assert other.is_file()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "options", "told"),
    [
        ("rec", (), "; at 2 Msps, from its metadata"),
        ("raw.i16", ("--rate", "4e6"), "; at 4 Msps, as given"),
        ("raw.i16", (), "; sample rate unknown: frequencies are in cycles per sample"),
    ],
)
def test_a_spectrum_says_of_which_rate_it_is(phy_ctl, tmp_path, monkeypatch, file, options, told):
    monkeypatch.chdir(tmp_path)
    write_bursts(tmp_path / "rec")
    (tmp_path / "raw.i16").write_bytes((tmp_path / "rec.sigmf-data").read_bytes())
    code, out, _ = phy_ctl("spectrum", tmp_path / file, *options)
    assert code == 0
    assert told in out


def test_a_recording_cut_in_mid_sample_is_read_as_far_as_it_goes(phy_ctl, tmp_path):
    write_bursts(tmp_path / "rec")
    data = (tmp_path / "rec.sigmf-data").read_bytes()
    (tmp_path / "rec.sigmf-data").write_bytes(data[: 4 * 20_000 + 3])
    code, out, err = phy_ctl("decode", tmp_path / "rec")
    assert code == 0
    assert "2 of 2 PDUs" in out
    assert "ends with 3 bytes, less than a ci16_le sample" in err


@pytest.mark.slow
def test_bad_input_is_refused_in_one_line(phy_ctl, tmp_path):
    (tmp_path / "what.dat").write_bytes(bytes(100))
    (tmp_path / "lone.sigmf-meta").write_text('{"global": {"core:datatype": "cf32_le"}}')
    (tmp_path / "odd.sigmf-meta").write_text('{"global": {"core:datatype": "cf64_le"}}')
    (tmp_path / "odd.sigmf-data").write_bytes(bytes(160))
    write_bursts(tmp_path / "rec", mcs_list=(1,))
    for arguments, says in (
        (("decode", tmp_path / "none"), "no such recording"),
        (("decode", tmp_path / "what.dat"), "unknown sample type"),
        (("decode", tmp_path / "what.dat", "--type", "ci12"), "allowed: cf32_le, ci16_le"),
        (("decode", tmp_path / "lone"), "lone.sigmf-data: no such file"),
        (("spectrum", tmp_path / "odd"), 'got "cf64_le"; allowed: cf32_le'),
        (("decode", tmp_path / "rec", "--type", "ci8"), "is ci16_le, but ci8 was requested"),
        (
            ("decode", tmp_path / "rec", "--rate", "1e6"),
            "is 2000000.0, but 1000000.0 was requested",
        ),
        (("spectrum", tmp_path / "rec", "--out", tmp_path / "no/dir.png"), "No such file"),
    ):
        code, out, err = phy_ctl(*arguments)
        assert (code, out) == (2, ""), arguments
        assert says in err, arguments
        assert err.count("\n") == 1, err


@pytest.fixture
def wifi_file(tmp_path):
    """A recording of three 802.11a frames, the second with a wrong octet; and the frames."""
    rng = np.random.default_rng(3)
    beacon = with_fcs(bytes([0x80, 0, 0, 0]) + bytes(6 * [255]) + bytes(range(12)) + rng.bytes(40))
    broken = bytearray(with_fcs(rng.bytes(60)))
    broken[30] ^= 1
    ack = with_fcs(bytes([0xD4, 0, 0, 0]) + bytes([2, 4, 6, 8, 10, 12]))
    sent = [(beacon, 12), (bytes(broken), 6), (ack, 54)]
    parts = [silence(400)]
    for psdu, mbps in sent:
        parts += [frame(psdu, mbps), silence(600)]
    path = tmp_path / "air.cf32"
    noisy(rng, np.concatenate(parts), 28).astype(np.complex64).tofile(path)
    return path, sent


@pytest.mark.slow
def test_wifi_frames_for_people_and_programs(phy_ctl, wifi_file):
    path, sent = wifi_file
    code, out, _ = phy_ctl("decode-wifi", path)
    assert code == 0
    beacon, broken, ack, summary = out.strip().split("\n")
    assert "12 Mbit/s QPSK 1/2  66 B  FCS right" in beacon
    assert beacon.endswith("beacon 00:01:02:03:04:05 → ff:ff:ff:ff:ff:ff")
    assert "6 Mbit/s BPSK 1/2  64 B  FCS wrong" in broken
    assert ack.endswith("ack → 02:04:06:08:0a:0c")
    assert summary == f"3 frames, 2 with good FCS, in {path.stat().st_size // 8} samples"
    code, out, _ = phy_ctl("decode-wifi", path, "--json")
    told = [json.loads(line) for line in out.strip().split("\n")]
    assert [(bytes.fromhex(each["psdu"]), each["mbps"]) for each in told] == sent
    assert [each["fcs"] for each in told] == [True, False, True]


def test_frames_of_802_11n_are_told_as_such(phy_ctl, tmp_path):
    """In mixed format they begin like a wrong frame of 6 Mbit/s."""
    parts = [silence(400), ht_frame(3, 138), silence(400), ht_frame(7, 900, True, True)]
    path = tmp_path / "air.cf32"
    rng = np.random.default_rng(3)
    noisy(rng, np.concatenate([*parts, silence(400)]), 28).astype(np.complex64).tofile(path)
    code, out, _ = phy_ctl("decode-wifi", path)
    assert code == 0
    mixed, greenfield, summary = out.strip().split("\n")
    assert "802.11n HT-mixed, MCS 3, 20 MHz  138 B, not decoded  SNR" in mixed
    assert "802.11n HT-greenfield, MCS 7, 40 MHz  900 B, not decoded  SNR" in greenfield
    assert summary.startswith("0 frames, 0 with good FCS, in")
    assert summary.endswith("; 2 frames of 802.11n, not decoded")
    assert "wrong" not in out
    _, out, _ = phy_ctl("decode-wifi", path, "--json")
    told = [json.loads(line) for line in out.strip().split("\n")]
    assert [(each["format"], each["mcs"], each["mhz"], each["n_bytes"]) for each in told] == [
        ("HT-mixed", 3, 20, 138), ("HT-greenfield", 7, 40, 900),
    ]  # fmt: skip


@pytest.mark.parametrize("piece", [3000, 4000, 4500])
def test_wifi_frames_across_the_pieces_that_are_read_are_told_once(
    phy_ctl, wifi_file, monkeypatch, piece
):
    path, sent = wifi_file
    monkeypatch.setattr("sdrlinkd.cli.wifi.PIECE", piece)
    monkeypatch.setattr("sdrlinkd.cli.wifi.LONGEST_FRAME", 2500)
    _, out, _ = phy_ctl("decode-wifi", path, "--json")
    told = [json.loads(line) for line in out.strip().split("\n")]
    assert [bytes.fromhex(each["psdu"]) for each in told] == [psdu for psdu, _ in sent]
    assert [each["sample"] for each in told] == sorted(each["sample"] for each in told)


def test_a_recording_without_wifi_frames_is_said_to_have_none(phy_ctl, tmp_path):
    path = tmp_path / "quiet.cf32"
    np.zeros(5000, np.complex64).tofile(path)
    code, out, _ = phy_ctl("decode-wifi", path)
    assert (code, out.strip()) == (0, "0 frames, 0 with good FCS, in 5000 samples")
    code, _, err = phy_ctl("decode-wifi", tmp_path / "missing.cf32")
    assert code != 0
    assert "missing.cf32" in err


@pytest.mark.slow
@pytest.mark.parametrize("grid", ["64/16", "128/16"])
def test_recordings_on_any_grid(phy_ctl, tmp_path, grid):
    rng = np.random.default_rng(4)
    burst = phy.Transmitter(grid=phy.GRIDS[grid]).modulate([bytes(64)], 1)
    path = tmp_path / "air.cf32"
    noisy(rng, np.concatenate((silence(500), burst, silence(500))), 20).tofile(path)
    _, out, _ = phy_ctl("decode", path, "--grid", grid)
    assert "1 of 1 PDUs of 64 B good" in out
    code, _, _ = phy_ctl("constellation", path, "--grid", grid, "--out", tmp_path / "points.png")
    assert (code, (tmp_path / "points.png").exists()) == (0, True)
    _, out, _ = phy_ctl("info", "--grid", grid)
    assert f"{grid.split('/')[0]} subcarriers" in out
    code, _, err = phy_ctl("decode", path, "--grid", "64/4")
    assert code != 0
    for part in ("--grid: got 64/4", "64/16, 64/8, 128/16, 256/32"):
        assert part in err
