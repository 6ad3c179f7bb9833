"""Certificates of a team: one authority, a file for each name, for its owner alone."""

import base64
import json

import pytest
from cryptography import x509

from sdrlinkd.errors import UserError
from sdrlinkd.keyring import make_certificates


def tls_in(path):
    comment, text = path.read_text().split("\n", 1)
    assert comment.startswith(f"// Certificate of {path.stem}, until 20")
    return json.loads(text)["transport"]["link"]["tls"]


def certificate_in(path, name="listen_certificate_base64"):
    return x509.load_pem_x509_certificate(base64.b64decode(tls_in(path)[name]))


def test_each_name_has_a_file_of_its_own_by_one_authority(tmp_path):
    folder = tmp_path / "made" / "here"
    first = make_certificates(folder, ["base", "mast"], 10)
    more = make_certificates(folder, ["desk"], 20)
    assert [each.name for each in first + more] == ["base.json5", "mast.json5", "desk.json5"]
    roots = {tls_in(each)["root_ca_certificate_base64"] for each in first + more}
    assert len(roots) == 1
    authority = certificate_in(first[0], "root_ca_certificate_base64")
    for path, days in (*((each, 10) for each in first), (more[0], 20)):
        assert tls_in(path)["enable_mtls"] is True
        certificate = certificate_in(path)
        certificate.verify_directly_issued_by(authority)
        lasts = certificate.not_valid_after_utc - certificate.not_valid_before_utc
        assert lasts.days == days + 1
        assert path.stat().st_mode & 0o777 == 0o600
    assert len({certificate_in(each).serial_number for each in first + more}) == 3
    assert (folder / "authority.pem").stat().st_mode & 0o777 == 0o600
    assert folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("base", "base.json5: there already; allowed: the name of a new file"),
        ("a b", 'name of a certificate: got "a b"; allowed: up to 64 letters'),
        ("../base", 'got "../base"; allowed: up to 64'),
        ("", 'got ""; allowed: up to 64'),
        ("x" * 65, "allowed: up to 64"),
    ],
)
def test_names_that_cannot_be_are_refused_before_anything_is_written(name, said, tmp_path):
    make_certificates(tmp_path, ["base"], 10)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(UserError, match=said):
        make_certificates(tmp_path, ["new", name], 10)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("text", "said"),
    [(b"", "authority.pem: .*; allowed: what sdrlinkctl key certificates wrote"), (None, "cannot")],
)
def test_an_authority_that_cannot_be_read_is_named(text, said, tmp_path):
    make_certificates(tmp_path, ["base"], 10)
    path = tmp_path / "authority.pem"
    if text is None:
        path.unlink()
        path.mkdir()
    else:
        path.write_bytes(text)
    with pytest.raises(UserError, match=said):
        make_certificates(tmp_path, ["new"], 10)
