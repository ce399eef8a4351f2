"""Certificates for the bus: an authority, and what it signs for the router and each role.

Keys are ECDSA on P-256, which every TLS library takes. Times are arguments.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from ipaddress import ip_address
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric.ec import (
    SECP256R1,
    EllipticCurvePrivateKey,
    generate_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from onemap_shared.keys import ROLES
from onemap_tools.errors import CliError

AUTHORITY, ROUTER = "ca", "router"
AUTHORITY_DAYS = 3650
SIGNING = {"key_cert_sign": True, "crl_sign": True}
USES = (
    "digital_signature", "content_commitment", "key_encipherment", "data_encipherment",
    "key_agreement", "key_cert_sign", "crl_sign", "encipher_only", "decipher_only",
)  # fmt: skip
RENEW = timedelta(days=30)  # before its end: a robot is not serviced every week
BEFORE = timedelta(days=1)  # the clock of a robot without a network may be behind


@dataclass(frozen=True, slots=True)
class Identity:
    """A certificate and its private key, both PEM."""

    certificate: bytes
    key: bytes


def make_authority(now: datetime) -> Identity:
    """An authority that may sign certificates, and nothing below them."""
    key, name = generate_private_key(SECP256R1()), _name("onemap authority")
    certificate = (
        _builder(key, name, name, now=now, days=AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(x509.KeyUsage(**dict.fromkeys(USES, False) | SIGNING), critical=True)
        .sign(key, hashes.SHA256())
    )
    return _identity(certificate, key)


def sign(
    authority: Identity, name: str, hosts: Sequence[str], *, now: datetime, days: int
) -> Identity:
    """A certificate of ``authority`` for ``name``; with ``hosts`` for a server at these addresses.

    hosts: names and IP addresses under which clients connect.
    """
    ca = x509.load_pem_x509_certificate(authority.certificate)
    ca_key = serialization.load_pem_private_key(authority.key, None)
    if not isinstance(ca_key, EllipticCurvePrivateKey):
        raise ValueError("the authority's key is not one of onemap certs")
    key = generate_private_key(SECP256R1())
    usage = ExtendedKeyUsageOID.SERVER_AUTH if hosts else ExtendedKeyUsageOID.CLIENT_AUTH
    alternatives = [_alternative(host) for host in hosts or (name,)]
    certificate = (
        _builder(key, _name(name), ca.subject, now=now, days=days)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.SubjectAlternativeName(alternatives), critical=False)
        .add_extension(x509.ExtendedKeyUsage([usage]), critical=False)
        .sign(ca_key, hashes.SHA256())
    )
    return _identity(certificate, key)


def _builder(
    key: EllipticCurvePrivateKey, subject: x509.Name, issuer: x509.Name, *, now: datetime, days: int
) -> x509.CertificateBuilder:
    return x509.CertificateBuilder(
        issuer_name=issuer,
        subject_name=subject,
        public_key=key.public_key(),
        serial_number=x509.random_serial_number(),
        not_valid_before=now - BEFORE,
        not_valid_after=now + timedelta(days=days),
    )


def _identity(certificate: x509.Certificate, key: EllipticCurvePrivateKey) -> Identity:
    pem = serialization.Encoding.PEM
    private = key.private_bytes(
        pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    return Identity(certificate.public_bytes(pem), private)


def _name(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _alternative(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def write_certificates(
    folder: Path, hosts: Sequence[str], *, now: datetime, days: int
) -> dict[str, bool]:
    """Certificates of the authority, the router and every role; whether each is new.

    One that ends within ``RENEW`` or, of the router, is not for all of ``hosts`` is made anew.
    A private key is readable by its owner alone. Raises CliError.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        authority = _read(folder, AUTHORITY)
        made = {AUTHORITY: authority is None}
        if authority is None:
            authority = make_authority(now)
            _write(folder, AUTHORITY, authority)
        elif _ends_soon(ca := x509.load_pem_x509_certificate(authority.certificate), now):
            raise CliError(
                f"The authority {folder / AUTHORITY}.pem ends on "
                f"{ca.not_valid_after_utc:%Y-%m-%d}: move the folder away, and give all machines "
                "certificates of a new one."
            )
        for name in (ROUTER, *ROLES):
            names = hosts if name == ROUTER else ()
            kept = _read(folder, name)
            made[name] = kept is None or not _serves(kept, names, now)
            if made[name]:
                for suffix in ("key", "pem"):
                    (folder / f"{name}.{suffix}").unlink(missing_ok=True)
                _write(folder, name, sign(authority, name, names, now=now, days=days))
    except OSError as problem:
        raise CliError(f"Cannot write {problem.filename}: {problem.strerror}.") from problem
    except ValueError as problem:
        raise CliError(f"Cannot sign with {folder / AUTHORITY}.key: {problem}.") from problem
    return made


def _serves(identity: Identity, hosts: Sequence[str], now: datetime) -> bool:
    """Whether a certificate is valid long enough, for all of these hosts."""
    certificate = x509.load_pem_x509_certificate(identity.certificate)
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    return not _ends_soon(certificate, now) and all(_alternative(host) in names for host in hosts)


def _ends_soon(certificate: x509.Certificate, now: datetime) -> bool:
    """Whether it ends within ``RENEW``, or a third of its life where that is shorter."""
    ends = certificate.not_valid_after_utc
    return ends - now <= min(RENEW, (ends - certificate.not_valid_before_utc) / 3)


def ending(files: Iterable[str], now: datetime) -> dict[str, datetime]:
    """Those of these files that are certificates which have ended or end soon, and when."""
    ends = {}
    for name in files:
        try:
            certificate = x509.load_pem_x509_certificate(Path(name).read_bytes())
        except (OSError, ValueError):  # a key, or what cannot be read, which is told elsewhere
            continue
        if _ends_soon(certificate, now):
            ends[name] = certificate.not_valid_after_utc
    return ends


def _read(folder: Path, name: str) -> Identity | None:
    """The identity in the folder; None if there is none."""
    certificate, key = folder / f"{name}.pem", folder / f"{name}.key"
    if certificate.exists() != key.exists():
        missing = key if certificate.exists() else certificate
        raise CliError(
            f"{missing} is missing, and its other half is there: restore it, or remove both."
        )
    return Identity(certificate.read_bytes(), key.read_bytes()) if key.exists() else None


def _write(folder: Path, name: str, identity: Identity) -> None:
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    for suffix, content, mode in (
        ("key", identity.key, 0o600),
        ("pem", identity.certificate, 0o644),
    ):
        with os.fdopen(os.open(folder / f"{name}.{suffix}", flags, mode), "wb") as file:
            file.write(content)
