#!/usr/bin/env bash
# Prepare this machine for docker compose, once: checks the engine, writes the gateway's token.
#   deploy/setup.sh [--demo]      --demo: a simulated robot is started too
# Safe to run again: a token, a profile and your lines of .env stay.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
NEEDED=2.24.4 # compose.tls.yaml's !override

fail() { echo "setup.sh: $*" >&2; exit 1; }

demo=false
case ${1:-} in
  "") ;;
  --demo) demo=true ;;
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

# The value of a line of .env; empty without it.
line() { [[ ! -e .env ]] || sed -n "s/^$1=//p" .env | tail -1; }

# By its digest, the base image cannot be replaced by another one later. What the environment names
# (a mirror, an image that is here) is taken as it is, and a line that is there stays.
python_image=${ONEMAP_PYTHON_IMAGE:-$(line ONEMAP_PYTHON_IMAGE)}
if [[ -z $python_image ]]; then
  python_image=python:3.11-slim
  if docker image inspect "$python_image" >/dev/null 2>&1; then
    here=$(docker image inspect "$python_image" --format '{{range .RepoDigests}}{{.}} {{end}}')
    python_image+=${here:+@${here#*@}} # made here, not pulled: it has none
    python_image=${python_image%% *}
  else
    digest=$(docker buildx imagetools inspect "$python_image" --format '{{.Manifest.Digest}}') ||
      fail "the base image $python_image is neither here nor in a registry that can be reached; \
name another one: ONEMAP_PYTHON_IMAGE=..."
    python_image+=@$digest
  fi
fi
profiles=$(line COMPOSE_PROFILES)
if $demo && [[ ,$profiles, != *,demo,* ]]; then profiles=${profiles:+$profiles,}demo; fi
{
  echo "# deploy/setup.sh writes COMPOSE_PROFILES and ONEMAP_PYTHON_IMAGE; the other lines are yours."
  if [[ -e .env ]]; then
    grep -vE '^(COMPOSE_PROFILES|ONEMAP_PYTHON_IMAGE)=|^# (Written by )?deploy/setup.sh' .env || true
  fi
  echo "COMPOSE_PROFILES=$profiles"
  echo "ONEMAP_PYTHON_IMAGE=$python_image"
} >.env.new
mv .env.new .env

# A token is in its place once it is readable by the gateway's user alone, who exists in its
# container only; a run that failed before is made good by the next one.
mkdir -p secrets
if [[ ! -e secrets/gateway-token ]]; then (umask 077 && openssl rand -hex 32 >secrets/gateway-token.new); fi
docker run --rm --network none -v "$PWD/secrets:/secrets" "$python_image" sh -ec '
  cd /secrets
  [ -e gateway-token ] || mv gateway-token.new gateway-token
  chown 10007 gateway-token
  chmod 400 gateway-token
  chmod 711 .' || fail "the gateway's token cannot be given to its user: see above, then run this again"
echo "Start with:  docker compose -f deploy/compose.yaml up --build --detach"
echo "The page asks for the token:  docker compose -f deploy/compose.yaml exec gateway \\"
echo "  cat /run/secrets/gateway-token"
