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
import yaml

from onemap_shared.config import read, section
from onemap_shared.watchdog import STOP_LIMIT_S
from tests.deploy.deployment import DEPLOY, ROLES, compose, compose_document, models, mounts
from tests.deploy.test_extras import project
from tests.deploy.test_locks import lock
from tests.structure import ROOT

SERVICES = compose()
VERSION = project()["version"]
GPU_SERVICES = compose("compose.gpu.yaml")
OURS = {name: service for name, service in SERVICES.items() if name in ROLES}
ALL = pytest.mark.parametrize("name", sorted(SERVICES))
EACH_ROLE = pytest.mark.parametrize("name", ROLES)


def flag(arguments: list[str], name: str) -> str:
    return arguments[arguments.index(name) + 1]


def test_it_starts_a_router_and_every_role() -> None:
    assert set(SERVICES) == {"router", *ROLES}
    assert SERVICES["simulator"]["profiles"] == ["demo"]
    assert all("profiles" not in SERVICES[name] for name in set(SERVICES) - {"simulator"})


def test_the_router_ends_when_it_no_longer_routes() -> None:
    """``onemap router`` has a watchdog; zenohd has none and would hang for good."""
    router = SERVICES["router"]
    assert router["command"][0] == "router"
    file = flag(router["command"], "--zenoh-config")
    assert (DEPLOY / mounts(router)[file]).is_file()
    assert router["restart"] == "unless-stopped"


@ALL
def test_each_is_checked_restarted_and_confined(name: str) -> None:
    service = SERVICES[name]
    assert "/tmp/ready" in service["healthcheck"]["test"][1]
    assert service["environment"]["ONEMAP_READY_FILE"] == "/tmp/ready"
    assert "/tmp" in service["tmpfs"]
    assert service["image"] == f"onemap-{name}:${{ONEMAP_VERSION:-{VERSION}}}"
    assert float(service["stop_grace_period"].rstrip("s")) > STOP_LIMIT_S
    assert service["restart"] == "unless-stopped"
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert "no-new-privileges:true" in service["security_opt"]
    assert not service.get("privileged")
    assert not any("unconfined" in option for option in service["security_opt"])
    assert service["mem_limit"][-1] in "mg"
    assert service["pids_limit"] > 0


@ALL
def test_ports_are_published_on_loopback_only(name: str) -> None:
    for port in SERVICES[name].get("ports", []):
        assert port.startswith("127.0.0.1:")


def test_the_gateway_never_starts_without_a_token() -> None:
    """Whatever its port line says: compose refuses to start without the secret's file."""
    service = SERVICES["gateway"]
    assert service["secrets"] == ["gateway-token"]
    assert service["environment"]["ONEMAP__GATEWAY__TOKEN_FILE"] == "/run/secrets/gateway-token"
    secret = compose_document()["secrets"]["gateway-token"]["file"]
    assert f"/deploy/{secret.removeprefix('./').split('/')[0]}/" in ignored_by_git()
    assert not any("TOKEN" in str(value) for value in service["environment"].values())


def ignored_by_git() -> list[str]:
    return (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()


@ALL
def test_what_is_mounted_exists(name: str) -> None:
    volumes = set(yaml.safe_load((DEPLOY / "compose.yaml").read_text(encoding="utf-8"))["volumes"])
    for source in mounts(SERVICES[name]).values():
        assert (DEPLOY / source).exists() if source.startswith(".") else source in volumes


@EACH_ROLE
def test_commands_name_a_service_and_a_configuration_that_is_there(name: str) -> None:
    service = SERVICES[name]
    assert service["command"][0] == name
    path = Path(flag(service["command"], "--config"))
    assert path.parent == Path("/etc/onemap")
    assert mounts(service)["/etc/onemap"] == "./config"
    assert (DEPLOY / "config" / path.name).is_file()


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
def test_services_meet_at_the_router(name: str) -> None:
    endpoint = SERVICES[name]["environment"]["ONEMAP__BUS__CONNECT"]
    port = flag(SERVICES["router"]["command"], "--listen").rpartition(":")[2]
    assert endpoint == f'["tcp/router:{port}"]'
    assert "router" in SERVICES[name]["depends_on"]


@EACH_ROLE
def test_images_are_built_from_extras_that_exist(name: str) -> None:
    build = SERVICES[name]["build"]
    dockerfile = ROOT / build["dockerfile"]
    assert dockerfile.is_file()
    extras = set(build["args"]["EXTRAS"].split(","))
    assert extras == set(lock.EXTRAS[name])
    assert name in extras
    assert extras <= set(project()["optional-dependencies"])  # type: ignore[call-overload]


def test_only_services_that_can_use_a_gpu_reserve_one() -> None:
    for name, service in GPU_SERVICES.items():
        (device,) = service["deploy"]["resources"]["reservations"]["devices"]
        assert device["capabilities"] == ["gpu"]
        assert set(service["build"]["args"]) <= set(dockerfile_arguments())
        assert service["environment"] == {f"ONEMAP__{name.upper()}__DEVICE": "cuda"}


def dockerfile_lines() -> list[str]:
    text = (DEPLOY / "service.Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def dockerfile_arguments() -> list[str]:
    return re.findall(r"^ARG (\w+)", "\n".join(dockerfile_lines()), re.MULTILINE)


def test_the_image_does_not_run_as_root() -> None:
    users = [line.split()[1] for line in dockerfile_lines() if line.startswith("USER")]
    assert users == ["onemap"]
    assert not any("user" in service for service in SERVICES.values())


def test_each_service_has_a_user_of_its_own() -> None:
    ids = [service["build"]["args"]["SERVICE_UID"] for service in SERVICES.values()]
    assert len(set(ids)) == len(ids)
    assert min(ids) > 10_000
    assert "SERVICE_UID" in dockerfile_arguments()


@ALL
def test_the_base_image_can_be_given_by_its_digest(name: str) -> None:
    image = SERVICES[name]["build"]["args"]["PYTHON_IMAGE"]
    assert image == "${ONEMAP_PYTHON_IMAGE:-python:3.11-slim}"
    stages = [line.split()[1] for line in dockerfile_lines() if line.startswith("FROM")]
    own = {line.split()[3] for line in dockerfile_lines() if re.match("FROM .* AS ", line)}
    assert set(stages) <= {"${PYTHON_IMAGE}", *own}


@ALL
def test_an_image_takes_only_files_of_known_hashes(name: str) -> None:
    assert SERVICES[name]["build"]["args"]["LOCK"] == name
    installs = [
        line for line in dockerfile_lines() if re.search(r"pip\S* (install|wheel)|install --", line)
    ]
    assert installs
    for line in installs:
        assert "--require-hashes" in line or "--no-index" in line, line


def test_sources_are_copied_after_the_packages_are_installed() -> None:
    """An edit of a service must not install torch anew: its wheel comes from a stage of its own."""
    text = (DEPLOY / "service.Dockerfile").read_text(encoding="utf-8")
    last = text[text.rindex("\nFROM base\n") :]
    assert last.index("--require-hashes") < last.index("/onemap/*.whl")
    assert "COPY services" not in last
    mounted = re.findall(r"--mount=from=(\w+)", last)
    assert "pins" in mounted
    pins = text[text.index(" AS pins") : text.index(" AS wheel")]
    assert not re.search(r"COPY .*(services|shared|tools|client)", pins)


def test_what_the_image_copies_exists_and_is_not_ignored() -> None:
    ignore = (DEPLOY / "service.Dockerfile.dockerignore").read_text(encoding="utf-8").splitlines()
    allowed = {line[1:] for line in ignore if line.startswith("!")}
    copied = {
        source
        for line in dockerfile_lines()
        if line.startswith("COPY") and "--from" not in line
        for source in line.split()[1:-1]
    }
    assert all((ROOT / source).exists() for source in copied)
    assert all(any(Path(source).is_relative_to(path) for path in allowed) for source in copied)


@pytest.fixture
def machine(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs a copy of setup.sh beside a stub of docker with these answers."""
    shutil.copy(DEPLOY / "setup.sh", tmp_path)
    stub = tmp_path / "bin" / "docker"
    stub.parent.mkdir()

    def run(*arguments: str, compose: str = "2.26.1", fails: str = "-") -> Any:
        stub.write_text(
            f"""#!/bin/sh
case "$*" in {fails}*) exit 1 ;; "compose version --short") echo {compose} ;;
  *imagetools*) echo sha256:abc ;; esac
"""
        )
        stub.chmod(0o755)
        return subprocess.run(
            ["bash", str(tmp_path / "setup.sh"), *arguments],
            env={**os.environ, "PATH": f"{stub.parent}{os.pathsep}{os.environ['PATH']}"},
            capture_output=True,
            text=True,
            check=False,
        )

    return run


def test_the_first_run_writes_a_token_once(
    machine: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    assert machine("--demo").returncode == 0
    token = tmp_path / "secrets" / "gateway-token"
    first = token.read_text(encoding="ascii")
    assert len(first.strip()) == 64
    assert token.stat().st_mode & 0o077 == 0
    settings = (tmp_path / ".env").read_text(encoding="utf-8")
    assert "COMPOSE_PROFILES=demo\n" in settings
    assert "ONEMAP_PYTHON_IMAGE=python:3.11-slim@sha256:abc\n" in settings
    assert machine().returncode == 0
    assert token.read_text(encoding="ascii") == first


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
