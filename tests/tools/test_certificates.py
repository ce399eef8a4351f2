"""Certificates: signed by the authority, for one name, for a while, for one use."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from ipaddress import ip_address

import pytest

x509 = pytest.importorskip("cryptography.x509", reason="cryptography is not installed")

from onemap_tools.certificates import BEFORE, Identity, make_authority, sign  # noqa: E402

NOW = datetime(2026, 1, 1, tzinfo=timezone.utc)


@pytest.fixture(scope="module")
def authority() -> Identity:
    return make_authority(NOW)


def test_a_client_has_the_name_of_its_role_and_no_other_use(authority: Identity) -> None:
    certificate = x509.load_pem_x509_certificate(
        sign(authority, "planner", (), now=NOW, days=30).certificate
    )
    ca = x509.load_pem_x509_certificate(authority.certificate)
    certificate.verify_directly_issued_by(ca)
    (name,) = certificate.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)
    assert name.value == "planner"
    assert certificate.not_valid_before_utc == NOW - BEFORE
    assert certificate.not_valid_after_utc == NOW + timedelta(days=30)
    extensions = certificate.extensions
    assert not extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    (use,) = extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    assert use == x509.ExtendedKeyUsageOID.CLIENT_AUTH


def test_a_server_has_the_names_and_addresses_it_is_reached_by(authority: Identity) -> None:
    identity = sign(authority, "router", ("robot.local", "10.0.0.5"), now=NOW, days=1)
    extensions = x509.load_pem_x509_certificate(identity.certificate).extensions
    names = extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["robot.local"]
    assert names.get_values_for_type(x509.IPAddress) == [ip_address("10.0.0.5")]
    (use,) = extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    assert use == x509.ExtendedKeyUsageOID.SERVER_AUTH


def test_the_authority_signs_certificates_but_no_further_authorities(authority: Identity) -> None:
    extensions = x509.load_pem_x509_certificate(authority.certificate).extensions
    constraints = extensions.get_extension_for_class(x509.BasicConstraints).value
    assert constraints.ca
    assert constraints.path_length == 0
    usage = extensions.get_extension_for_class(x509.KeyUsage).value
    assert usage.key_cert_sign
    assert not usage.digital_signature
