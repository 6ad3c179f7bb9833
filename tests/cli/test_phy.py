"""`sdrlinkctl phy`: tables, pictures and PDUs of recordings, and what bad input gets."""

import json
import re

import numpy as np
import pytest

from sdrlinkd.cli import run
from tests.iq.recordings import RATE_HZ, write_bursts


@pytest.fixture
def ctl(capsys):
    """Runs a command line; (exit code, stdout, stderr). No traceback, ever."""

    def call(*arguments):
        code = run(["phy", *(str(argument) for argument in arguments)])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return code, out, err

    return call


def test_info_for_people_and_programs(ctl):
    code, out, _ = ctl("info", "--rate", "1e6", "--pdu-size", 220)
    assert code == 0
    for part in ("1 Msps: 64 carriers 15.625 kHz apart", "16QAM 3/4", "64QAM 3/4", "3.55 ms"):
        assert part in out
    code, out, _ = ctl("info", "--json")
    told = json.loads(out)
    assert (told["rate_hz"], len(told["mcs"])) == (5e6, 10)


def test_decode_for_people_and_programs(ctl, tmp_path):
    sent = write_bursts(tmp_path / "rec")
    code, out, _ = ctl("decode", tmp_path / "rec.sigmf-meta")
    assert code == 0
    assert "QPSK 1/2  2 of 2 PDUs of 64 B good" in out
    assert "src 3 dst all seq 0" in out
    (offset_khz,) = re.findall(r"CFO (\S+) kHz", out.split("\n")[0])
    assert float(offset_khz) == pytest.approx(19.6, abs=0.05)
    assert "pdus_good 6" in out
    code, out, _ = ctl("decode", "--json", tmp_path / "rec")
    bursts = [json.loads(line) for line in out.splitlines()]
    assert [pdu["hex"] for burst in bursts for pdu in burst["pdus"]] == [s.hex() for s in sent]
    assert bursts[1]["start_s"] == pytest.approx(25_000 / RATE_HZ, abs=1e-5)
    code, out, _ = ctl("decode", "--network", 5, tmp_path / "rec")
    assert "bursts_foreign 3" in out


def test_noise_has_no_bursts(ctl, tmp_path):
    rng = np.random.default_rng(1)
    rng.standard_normal(200_000).astype(np.float32).tofile(tmp_path / "noise.cf32")
    code, out, _ = ctl("decode", tmp_path / "noise.cf32")
    assert (code, out) == (0, "no burst in 100000 samples\n")
    code, _, err = ctl("constellation", tmp_path / "noise.cf32")
    assert code == 2
    assert "no burst was found in 100000 samples" in err


@pytest.mark.parametrize("picture", ["spectrum", "constellation"])
def test_pictures_are_drawn(ctl, tmp_path, picture):
    write_bursts(tmp_path / "rec")
    code, out, _ = ctl(picture, tmp_path / "rec.sigmf-data")
    assert code == 0
    path = tmp_path / f"rec.{picture}.png"
    assert str(path) in out.replace("\n", "")
    assert path.read_bytes().startswith(b"\x89PNG")
    assert path.stat().st_size > 8000
    other = tmp_path / "other.png"
    assert ctl(picture, tmp_path / "rec", "--out", other)[0] == 0
    assert other.is_file()


def test_a_recording_cut_in_mid_sample_is_read_as_far_as_it_goes(ctl, tmp_path):
    write_bursts(tmp_path / "rec")
    data = (tmp_path / "rec.sigmf-data").read_bytes()
    (tmp_path / "rec.sigmf-data").write_bytes(data[: 4 * 20_000 + 3])
    code, out, err = ctl("decode", tmp_path / "rec")
    assert code == 0
    assert "2 of 2 PDUs" in out
    assert "ends with 3 bytes that are no whole ci16_le sample" in err


def test_bad_input_is_refused_in_one_line(ctl, tmp_path):
    (tmp_path / "what.dat").write_bytes(bytes(100))
    (tmp_path / "lone.sigmf-meta").write_text('{"global": {"core:datatype": "cf32_le"}}')
    (tmp_path / "odd.sigmf-meta").write_text('{"global": {"core:datatype": "cf64_le"}}')
    (tmp_path / "odd.sigmf-data").write_bytes(bytes(160))
    write_bursts(tmp_path / "rec", mcs_list=(1,))
    for arguments, says in (
        (("decode", tmp_path / "none"), "no such recording"),
        (("decode", tmp_path / "what.dat"), "its sample type is not known"),
        (("decode", tmp_path / "what.dat", "--type", "ci12"), "allowed: cf32_le, ci16_le"),
        (("decode", tmp_path / "lone"), "lone.sigmf-data: no such file"),
        (("spectrum", tmp_path / "odd"), 'got "cf64_le"; allowed: cf32_le'),
        (("decode", tmp_path / "rec", "--type", "ci8"), "is ci16_le, but ci8 was asked for"),
        (("decode", tmp_path / "rec", "--rate", "1e6"), "is 2000000.0, but 1000000.0 was asked"),
        (("spectrum", tmp_path / "rec", "--out", tmp_path / "no/dir.png"), "No such file"),
    ):
        code, out, err = ctl(*arguments)
        assert (code, out) == (2, ""), arguments
        assert says in err, arguments
        assert err.count("\n") == 1, err
