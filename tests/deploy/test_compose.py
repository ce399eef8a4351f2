"""compose.yaml against the services, the configurations and the image it starts."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from onemap_shared import keys
from onemap_shared.config import read, section
from onemap_shared.watchdog import STOP_LIMIT_S
from tests.deploy.deployment import DEPLOY, ROLES, compose, compose_document, models, mounts
from tests.deploy.test_packages import LOCK, PROJECT

SERVICES = compose()
VERSION = PROJECT["version"]
GPU_SERVICES = compose("compose.gpu.yaml")
ALL = pytest.mark.parametrize("name", sorted(SERVICES))
EACH_ROLE = pytest.mark.parametrize("name", ROLES)


def flag(arguments: list[str], name: str) -> str:
    return arguments[arguments.index(name) + 1]


@ALL
def test_each_is_confined_and_may_end_by_itself(name: str) -> None:
    service = SERVICES[name]
    assert service["image"] == f"onemap-{name}:${{ONEMAP_VERSION:-{VERSION}}}"
    assert float(service["stop_grace_period"].rstrip("s")) > STOP_LIMIT_S
    assert (service["read_only"], service["cap_drop"]) == (True, ["ALL"])
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert service.keys() >= {"mem_limit", "pids_limit", "cpu_shares", "restart", "healthcheck"}
    assert not service.keys() & {"privileged", "user"}
    assert all(port.startswith("127.0.0.1:") for port in service.get("ports", []))
    volumes = compose_document()["volumes"]
    for source in mounts(service).values():
        assert (DEPLOY / source).exists() if source.startswith(".") else source in volumes
    ids = [int(each["build"]["args"]["SERVICE_UID"]) for each in SERVICES.values()]
    assert len({0, *ids}) == len(ids) + 1


def test_the_gateway_never_starts_without_a_token() -> None:
    """Whatever its port line says: compose refuses to start without the secret's file."""
    service = SERVICES["gateway"]
    assert service["secrets"] == ["gateway-token"]
    assert service["environment"]["ONEMAP__GATEWAY__TOKEN_FILE"] == "/run/secrets/gateway-token"


@EACH_ROLE
def test_the_environment_sets_only_what_the_service_reads(name: str) -> None:
    variables = {
        variable: "secret" if str(value).startswith("${") else str(value)
        for source in (SERVICES, GPU_SERVICES)
        for variable, value in source.get(name, {}).get("environment", {}).items()
        if variable.startswith("ONEMAP__")
    }
    sections = read(None, variables)
    assert set(sections) <= {"bus", "log", name}
    for part in sections:
        section(sections, part, models()[part])


@EACH_ROLE
def test_a_service_is_built_of_its_extras_and_meets_the_others_at_the_router(name: str) -> None:
    service, router = SERVICES[name], SERVICES["router"]
    path = Path(flag(service["command"], "--config"))
    assert (DEPLOY / mounts(service)[str(path.parent)] / path.name).is_file()
    port = flag(router["command"], "--listen").rpartition(":")[2]
    assert service["environment"]["ONEMAP__BUS__CONNECT"] == f'["tcp/router:{port}"]'
    extras = service["build"]["args"]["EXTRAS"].split(",")
    assert name in extras  # what else of the services the image has is removed
    assert tuple(extras) == LOCK.EXTRAS[service["build"]["args"]["LOCK"]]


def role_of(name: str) -> str:
    """The certificate that a service needs."""
    return next(role for role, access in keys.ROLES.items() if name in access.names)


def test_the_page_makes_each_key_readable_by_its_service_alone() -> None:
    page = (DEPLOY / "security.md").read_text(encoding="utf-8")
    owners = dict(re.findall(r"\b(100\d\d):([a-z]+)\b", page))
    ids = {str(s["build"]["args"]["SERVICE_UID"]): n for n, s in SERVICES.items()}
    assert owners == {uid: n if n == "router" else role_of(n) for uid, n in ids.items()}
    assert "onemap certs deploy/tls --host router" in page


@pytest.fixture
def machine(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs a copy of setup.sh beside a stub of docker with these answers.

    ``docker run`` runs the shell command of the container in the folder that is mounted.
    """
    shutil.copy(DEPLOY / "setup.sh", tmp_path)
    stub = tmp_path / "bin" / "docker"
    stub.parent.mkdir()
    chown = stub.with_name("chown")
    chown.write_text('#!/bin/sh\n[ "$*" = "10007 gateway-token" ]\n')
    chown.chmod(0o755)

    def run(
        *arguments: str, compose: str = "2.26.1", fails: str = "-", here: str = "-", image: str = ""
    ) -> Any:
        stub.write_text(
            f"""#!/bin/sh
case "$*" in {fails}*) exit 1 ;; "compose version --short") echo {compose} ;;
  "image inspect"*RepoDigests*) echo {here} ;;
  "image inspect"*) [ "{here}" != - ] ;;
  *imagetools*) echo sha256:abc ;;
  run*) echo "$*" | grep -q "{tmp_path}/secrets:/secrets" || exit 1
    while [ "$1" != -ec ]; do shift; done; exec sh -ec "$(echo "$2" | sed s,/secrets,secrets,)" ;;
esac
"""
        )
        stub.chmod(0o755)
        return subprocess.run(
            ["bash", str(tmp_path / "setup.sh"), *arguments],
            env={
                **os.environ,
                "PATH": f"{stub.parent}{os.pathsep}{os.environ['PATH']}",
                "ONEMAP_PYTHON_IMAGE": image,
            },
            capture_output=True,
            text=True,
            check=False,
        )

    return run


def test_the_first_run_writes_a_token_once(
    machine: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    """One that failed is made good by the next."""
    token = tmp_path / "secrets" / "gateway-token"
    failed = machine("--demo", fails="run")
    assert failed.returncode == 1
    assert "the gateway's token cannot be given to its user" in failed.stderr
    assert not token.exists()
    assert machine("--demo").returncode == 0
    first = token.read_text(encoding="ascii")
    assert len(first.strip()) == 64
    assert token.stat().st_mode & 0o077 == 0
    assert machine().returncode == 0
    assert token.read_text(encoding="ascii") == first


def test_settings_of_before_and_lines_of_the_user_stay(
    machine: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    assert machine("--demo").returncode == 0
    file = tmp_path / ".env"
    text = file.read_text(encoding="utf-8") + "ONEMAP__MAPPER__CELL_SIZE_M=0.05\n"
    file.write_text(text, encoding="utf-8")
    for options in ([], ["--demo"], []):
        assert machine(*options).returncode == 0
    lines = file.read_text(encoding="utf-8").splitlines()
    assert sorted(lines[1:]) == [
        "COMPOSE_PROFILES=demo",
        "ONEMAP_PYTHON_IMAGE=python:3.11-slim@sha256:abc",
        "ONEMAP__MAPPER__CELL_SIZE_M=0.05",
    ]


@pytest.mark.parametrize(
    ("options", "image"),
    [
        ({}, "python:3.11-slim@sha256:abc"),
        ({"here": "python@sha256:def", "fails": "*imagetools"}, "python:3.11-slim@sha256:def"),
        ({"here": "", "fails": "*imagetools"}, "python:3.11-slim"),  # made on this machine
        ({"image": "mirror/python:3.11", "fails": "*imagetools"}, "mirror/python:3.11"),
    ],
)
def test_a_registry_is_asked_only_for_what_is_not_here(
    machine: Callable[..., subprocess.CompletedProcess[str]],
    options: dict[str, str],
    image: str,
    tmp_path: Path,
) -> None:
    result = machine(**options)
    assert result.returncode == 0, result.stderr
    settings = (tmp_path / ".env").read_text(encoding="utf-8")
    assert f"ONEMAP_PYTHON_IMAGE={image}\n" in settings


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"compose": "1.29.2"}, "compose 1.29.2 is too old: 2.24.4 or newer is needed"),
        ({"fails": "compose"}, "docker has no 'compose'"),
        ({"fails": "buildx"}, "docker has no 'buildx'"),
        ({"fails": "info"}, "the Docker daemon does not answer"),
    ],
)
def test_what_the_engine_lacks_is_named(
    machine: Callable[..., subprocess.CompletedProcess[str]],
    options: dict[str, str],
    sentence: str,
    tmp_path: Path,
) -> None:
    result = machine(**options)
    assert result.returncode == 1
    assert sentence in result.stderr
    assert not (tmp_path / ".env").exists()


@pytest.mark.parametrize(
    "files",
    [
        ["compose.yaml"],
        ["compose.yaml", "compose.gpu.yaml"],
        ["compose.yaml", "compose.tls.yaml"],
        ["compose.yaml", "compose.robots.yaml"],
    ],
)
def test_docker_compose_accepts_it(files: list[str]) -> None:
    if shutil.which("docker") is None:
        pytest.skip("docker is not installed")
    compose_command = ["docker", "compose"]
    if subprocess.run([*compose_command, "version"], capture_output=True, check=False).returncode:
        pytest.skip("docker has no compose plugin")
    options = [part for file in files for part in ("-f", str(DEPLOY / file))]
    subprocess.run(
        [*compose_command, *options, "--profile", "demo", "config", "-q"],
        check=True,
    )
