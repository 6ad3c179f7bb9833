"""Certificates of a team, by which gateways and operators know each other over an IP network."""

import base64
import datetime
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from sdrlinkd.errors import UserError
from sdrlinkd.keyring.files import create_secret

AUTHORITY = "authority.pem"
NAME = re.compile(r"[A-Za-z0-9_-]{1,64}\Z")
AUTHORITY_DAYS = 3650
EARLIER = datetime.timedelta(days=1)
"""Clocks of robots may be behind."""


class Authority(NamedTuple):
    """What signs a team's certificates."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey


def make_certificates(folder: Path, names: Sequence[str], days: int) -> list[Path]:
    """Write a file of Zenoh's for each name, with a certificate of the team's authority.

    The authority is made in `folder` if there is none. Raises UserError.
    """
    for name in names:
        if not NAME.match(name):
            raise UserError(
                f'name of a certificate: got "{name}"; allowed: up to 64 letters, digits, - and _'
            )
    paths = [folder / f"{name}.json5" for name in names]
    for path in paths:
        if path.exists():
            raise UserError(f"{path}: there already; allowed: the name of a new file")
    authority = _authority(folder)
    for name, path in zip(names, paths, strict=True):
        create_secret(path, zenoh_file(authority, name, days).encode())
    return paths


def zenoh_file(authority: Authority, name: str, days: float) -> str:
    """A file of Zenoh's, for the section `[fleet]`: whoever connects needs a certificate, too.

    All of the team may do the same, so no certificate is bound to a host.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    usages = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    built = (
        _begun(name, key, days)
        .issuer_name(authority.certificate.subject)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(name)]), critical=False)
        .add_extension(x509.ExtendedKeyUsage(usages), critical=False)
    )
    certificate = built.sign(authority.key, hashes.SHA256())
    own, secret = _base64(_pem(certificate)), _base64(_secret(key))
    tls = {
        "root_ca_certificate_base64": _base64(_pem(authority.certificate)),
        "enable_mtls": True,
        "verify_name_on_connect": False,
        "close_link_on_expiration": True,
        **{f"{end}_certificate_base64": own for end in ("listen", "connect")},
        **{f"{end}_private_key_base64": secret for end in ("listen", "connect")},
    }
    told = json.dumps({"transport": {"link": {"tls": tls}}}, indent=2)
    until = certificate.not_valid_after_utc.date()
    return f"// Certificate of {name}, until {until}. Who has this file can command.\n{told}\n"


def new_authority() -> Authority:
    """What signs certificates, new."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = "sdrlink team"
    built = (
        _begun(name, key, AUTHORITY_DAYS)
        .issuer_name(_name(name))
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
    )
    return Authority(built.sign(key, hashes.SHA256()), key)


def _begun(name: str, key: ec.EllipticCurvePrivateKey, days: float) -> x509.CertificateBuilder:
    now = datetime.datetime.now(datetime.UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(_name(name))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - EARLIER)
        .not_valid_after(now + datetime.timedelta(days=days))
    )


def _authority(folder: Path) -> Authority:
    """The authority in a folder; a new one if there is none. Raises UserError."""
    path = folder / AUTHORITY
    try:
        text = path.read_bytes()
        certificate = x509.load_pem_x509_certificate(text)
        key = serialization.load_pem_private_key(text, None)
    except FileNotFoundError:
        authority = new_authority()
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(f"{folder} cannot be made ({error.strerror})") from None
        create_secret(path, _pem(authority.certificate) + _secret(authority.key))
        return authority
    except OSError as error:
        raise UserError(f"{path} cannot be read ({error.strerror})") from None
    except (ValueError, TypeError) as error:
        raise UserError(
            f"{path}: {error}; allowed: what sdrlinkctl key certificates wrote"
        ) from None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise UserError(f"{path}: another kind of key; allowed: what sdrlinkctl wrote")
    return Authority(certificate, key)


def _name(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)


def _secret(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def _base64(octets: bytes) -> str:
    return base64.b64encode(octets).decode()
