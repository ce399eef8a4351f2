#!/usr/bin/env bash
# Prepare this machine for docker compose, once: checks the engine, writes the gateway's token.
#   deploy/setup.sh [--demo]      --demo: a simulated robot is started too
# Safe to run again: a token that is there stays.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
NEEDED=2.24.4 # compose.tls.yaml's !override

fail() { echo "setup.sh: $*" >&2; exit 1; }

profiles=
case ${1:-} in
  "") ;;
  --demo) profiles=demo ;;
  *) echo "usage: deploy/setup.sh [--demo]" >&2; exit 2 ;;
esac
command -v docker >/dev/null || fail "docker is not installed: see docs.docker.com/engine/install"
found=$(docker compose version --short 2>/dev/null) ||
  fail "docker has no 'compose': install the package docker-compose-plugin (not docker-compose)"
[[ $(printf '%s\n' "$NEEDED" "${found#v}" | sort -V | head -1) == "$NEEDED" ]] ||
  fail "compose ${found#v} is too old: $NEEDED or newer is needed (package docker-compose-plugin)"
docker buildx version >/dev/null 2>&1 ||
  fail "docker has no 'buildx', which builds the images: install the package docker-buildx-plugin"
docker info >/dev/null 2>&1 ||
  fail "the Docker daemon does not answer: start it, or add your user to the group docker"

python_image=python:3.11-slim
digest=$(docker buildx imagetools inspect "$python_image" --format '{{.Manifest.Digest}}') ||
  fail "the base image $python_image cannot be looked up: is the registry reachable?"
{
  echo "# Written by deploy/setup.sh, read by docker compose."
  echo "COMPOSE_PROFILES=$profiles"
  # By its digest, the base image cannot be replaced by another one later.
  echo "ONEMAP_PYTHON_IMAGE=$python_image@$digest"
} >.env

if [[ ! -e secrets/gateway-token ]]; then
  (umask 077 && mkdir -p secrets && openssl rand -hex 32 >secrets/gateway-token)
  # Readable by the gateway's user alone, which exists in its container only.
  docker run --rm --network none -v "$PWD/secrets:/secrets" "$python_image@$digest" \
    sh -c 'chown 10007 /secrets/gateway-token && chmod 711 /secrets'
fi
echo "Start with:  docker compose -f deploy/compose.yaml up --build --detach"
echo "The page asks for the token:  docker compose -f deploy/compose.yaml exec gateway \\"
echo "  cat /run/secrets/gateway-token"
