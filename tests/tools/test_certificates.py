"""Certificates: signed by the authority, for one name and one use; private, kept, in a folder."""

from __future__ import annotations

import json
from datetime import datetime, timedelta, timezone
from ipaddress import ip_address
from pathlib import Path

import pytest
from typer.testing import CliRunner

x509 = pytest.importorskip("cryptography.x509", reason="cryptography is not installed")

from onemap_shared.config import BusConfig  # noqa: E402
from onemap_shared.keys import ROLES  # noqa: E402
from onemap_tools.certificates import (  # noqa: E402
    BEFORE,
    Identity,
    make_authority,
    sign,
    write_certificates,
)
from onemap_tools.cli.app import app  # noqa: E402
from onemap_tools.doctor import Severity, certificates_that_end  # noqa: E402
from onemap_tools.errors import CliError  # noqa: E402

NOW = datetime(2026, 1, 1, tzinfo=timezone.utc)
NAMES = {"ca", "router", *ROLES}


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


def write(folder: Path) -> dict[str, bool]:
    return write_certificates(folder, ["robot.local"], now=NOW, days=30)


def test_every_role_gets_a_certificate_and_a_key_of_its_own(tmp_path: Path) -> None:
    assert write(tmp_path / "tls") == dict.fromkeys(NAMES, True)
    files = {path.name: path for path in (tmp_path / "tls").iterdir()}
    assert set(files) == {f"{name}.{suffix}" for name in NAMES for suffix in ("pem", "key")}
    assert {path.stat().st_mode & 0o777 for path in files.values() if path.suffix == ".key"} == {
        0o600
    }
    assert len({path.read_bytes() for path in files.values()}) == len(files)


def test_what_is_there_is_kept_and_what_is_missing_is_made(tmp_path: Path) -> None:
    write(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for suffix in ("pem", "key"):
        (tmp_path / f"planner.{suffix}").unlink()
    made = write(tmp_path)
    assert {name for name, new in made.items() if new} == {"planner"}
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert {name for name in before if before[name] != after[name]} == {
        "planner.pem",
        "planner.key",
    }


def test_what_ends_soon_or_is_for_other_hosts_is_made_anew(tmp_path: Path) -> None:
    """The authority stays: every box that knows it goes on trusting."""
    first = write_certificates(tmp_path, ["robot.local"], now=NOW, days=825)
    assert set(first.values()) == {True}
    later = NOW + timedelta(days=825 - 31)
    kept = write_certificates(tmp_path, ["robot.local"], now=later, days=825)
    assert set(kept.values()) == {False}
    other = write_certificates(tmp_path, ["robot.local", "10.0.0.5"], now=later, days=825)
    assert [name for name, new in other.items() if new] == ["router"]
    ending = NOW + timedelta(days=825 - 29)
    renewed = write_certificates(tmp_path, ["robot.local"], now=ending, days=825)
    assert {name for name, new in renewed.items() if new} == set(ROLES)


def test_an_authority_that_ends_signs_nothing(tmp_path: Path) -> None:
    write_certificates(tmp_path, ["robot.local"], now=NOW, days=825)
    later = NOW + timedelta(days=3650 - 20)
    with pytest.raises(CliError, match=r"The authority .*ca.pem ends on \d{4}-.*: move the folder"):
        write_certificates(tmp_path, ["robot.local"], now=later, days=825)


def test_the_doctor_tells_of_a_certificate_that_ends(tmp_path: Path) -> None:
    write_certificates(tmp_path, ["robot.local"], now=NOW, days=825)
    names = ("root_ca_certificate_file=ca.pem", "connect_certificate_file=planner.pem")
    files = ";".join(names).replace("=", f"={tmp_path}/")
    config = BusConfig(connect=(f"tls/robot.local:7447#{files};connect_private_key=x",))
    assert certificates_that_end(config, NOW + timedelta(days=700)) == []
    (soon,) = certificates_that_end(config, NOW + timedelta(days=800))
    assert (soon.severity, soon.sentence[:16]) == (Severity.WARNING, "The certificate ")
    assert "planner.pem ends on 20" in soon.sentence
    (ended,) = certificates_that_end(config, NOW + timedelta(days=900))
    assert (ended.severity, "planner.pem ended on" in ended.sentence) == (Severity.ERROR, True)


def test_what_cannot_be_signed_with_or_written_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "tls")
    (tmp_path / "tls" / "ca.key").unlink()
    with pytest.raises(CliError, match=r"ca\.key is missing"):
        write(tmp_path / "tls")
    for suffix in ("pem", "key"):
        (tmp_path / "tls" / f"ca.{suffix}").write_text("hello")
        (tmp_path / "tls" / f"planner.{suffix}").unlink()
    with pytest.raises(CliError, match=r"Cannot sign with .*ca\.key"):
        write(tmp_path / "tls")
    (tmp_path / "file").write_text("")
    with pytest.raises(CliError, match="Cannot write"):
        write(tmp_path / "file" / "tls")


def test_the_command_says_what_it_made(tmp_path: Path) -> None:
    arguments = ["certs", str(tmp_path / "tls"), "--host", "robot.local"]
    first = CliRunner().invoke(app, arguments)
    assert first.exit_code == 0
    assert first.stdout.count(": made") == len(NAMES)
    assert "PRIVATE" not in first.stdout
    second = CliRunner().invoke(app, [*arguments, "--json"])
    assert json.loads(second.stdout)["made"] == dict.fromkeys(NAMES, False)
