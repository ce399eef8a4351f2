# `check.sh systemd`: installs, updates, breaks and removes OneMap on a machine without it.
#
# CHECK_INSTALL_OPTIONS: further options of install.sh, such as --torch WHEEL.
# CHECK_ROLES: fewer services than all, where torch is too large to install for a check.
SYSTEM_ROLES=${CHECK_ROLES:-router perception mapper planner gateway}
installer=deploy/systemd/install.sh
installed_here=/opt/onemap configuration_here=/etc/onemap state_here=/var/lib/onemap

refuse_systemd() {
  local place
  ((EUID == 0)) || refuse "run it with sudo: it installs OneMap"
  [[ $(ps -p 1 -o comm=) == systemd ]] || refuse "systemd is not PID 1 here"
  for place in /opt/onemap /etc/onemap /var/lib/onemap /usr/local/lib/systemd/system/onemap* /etc/systemd/system/onemap*; do
    [[ ! -e $place ]] || refuse "$place is there: use a machine without OneMap, such as a container"
  done
  for place in 7447 8080; do
    ! listens "$place" || refuse "something listens on port $place: use a machine without OneMap"
  done
}

clean_systemd() { # nothing of OneMap was here before
  systemctl stop check-second-planner.service
  "$installer" --uninstall --purge
}

# shellcheck disable=SC2086 # options are words
install_onemap() { "$installer" --services "${SYSTEM_ROLES// /,}" ${CHECK_INSTALL_OPTIONS:-} "$@"; }
installed() { install_onemap --extras certs && keeps_extras; }
current() { readlink "$installed_here/current"; }
versions() { ls "$installed_here/versions"; }
of_unit() { systemctl show -p "$2" --value "onemap-$1.service"; }
pids() { for role in $SYSTEM_ROLES; do of_unit "$role" MainPID; done; }
are_active() { # ROLES: none has crashed meanwhile
  local role
  for role in "$@"; do
    [[ $(of_unit "$role" ActiveState) == active && $(of_unit "$role" NRestarts) == 0 ]] || return
  done
}
# shellcheck disable=SC2086 # roles are words
all_active() { are_active $SYSTEM_ROLES; }
# Longer than a service takes to its first crash: a loop of crashes is never settled.
settled() { within 180 all_active && throughout 30 all_active; }
answers() { within 60 get /healthz; }

back_by_systemd() { # ROLE PID, as before
  local pid
  pid=$(of_unit "$1" MainPID)
  [[ $(of_unit "$1" ActiveState) == active && ${pid:-0} -gt 1 && $pid != "$2" ]]
}
killed_by_systemd() { # ROLE
  local pid
  pid=$(of_unit "$1" MainPID)
  [[ ${pid:-0} -gt 1 ]] && systemctl kill --signal KILL "onemap-$1" &&
    within 60 back_by_systemd "$1" "$pid" && throughout 5 back_by_systemd "$1" "$pid"
}

starts_without_router() { # `systemctl start` does not wait for a robot that is off, and nothing gives up
  systemctl stop onemap-router && timeout 60 systemctl restart onemap-planner onemap-perception &&
    throughout 45 are_active planner perception && systemctl start onemap-router && settled
}
restarted() { systemctl reset-failed 'onemap-*'; systemctl restart onemap.target && settled; }

fails_and_keeps() { # COMMAND...: it fails; version, processes and folders are as before
  local version kept running
  version=$(current) kept=$(versions) running=$(pids)
  [[ -n $version && -n $kept ]] || return
  ! "$@" && within 30 as_before "$version" "$kept" "$running"
}
as_before() { [[ $(current) == "$1" && $(versions) == "$2" && $(pids) == "$3" ]] && all_active; }
cut_off() { # an installation that is ended while pip works
  local pid
  set -m # a process group of its own
  install_onemap &
  pid=$!
  set +m
  within 120 pip_works && kill -TERM -- "-$pid"
  wait "$pid"
}
pip_works() { pgrep -f "$installed_here/versions/.*pip install" >/dev/null; }
breaks() { # SENTENCE FILE: an update with this line at the end of the file
  cp "$2" "$work/kept" && printf '%s\n' "$1" >>"$2"
  install_onemap
  local code=$?
  cp "$work/kept" "$2"
  return $code
}
cannot_be_imported() { breaks 'raise SystemExit(1)' services/planner/onemap_planner/service.py; }
cannot_be_built() { breaks 'def build(bus, config): raise SystemExit(1)' services/planner/onemap_planner/service.py; }
goes_back() { # COMMAND...: it fails, and what was there before runs anew
  local version kept
  version=$(current) kept=$(versions)
  [[ -n $version && -n $kept ]] || return
  ! "$@" || return
  [[ $(current) == "$version" && $(versions) == "$kept" ]] && settled
}
keeps_extras() { "$installed_here/current/bin/python" -c 'import cryptography'; } # of certs
updated() { # without --extras, which the first installation had
  local before version
  before=$(pids) version=$(current)
  [[ -n $version ]] && sed -i 's/^version = .*/version = "0.2.1"/' pyproject.toml && install_onemap &&
    [[ $(current) != "$version" && $(pids) != "$before" ]] && settled && says_version $SYSTEM_ROLES && keeps_extras
}
rolled_back() {
  local version
  version=$(readlink "$installed_here/previous") && "$installer" --rollback &&
    [[ $(current) == "$version" ]] && settled
}

error_has_its_priority() { # of a second planner, which must refuse to run beside the first
  systemctl reset-failed check-second-planner.service 2>/dev/null
  # Not named onemap-*, to which the units' common settings apply.
  systemd-run --quiet --wait --unit check-second-planner -p User=onemap-planner -p Group=onemap \
    -E ONEMAP__LOG__FORMAT=json "$installed_here/current/bin/onemap" planner
  local errors
  errors=$(journalctl -u check-second-planner -p err -o cat) || return
  grep -q '"level": "error"' <<<"$errors" && ! grep -q '"level": "info"' <<<"$errors"
}
stopped() { local role; for role in $SYSTEM_ROLES; do [[ $(of_unit "$role" ActiveState) == inactive ]] || return; done; }
stopped_cleanly() { # each ended by itself, within its time
  local role since
  all_active && since=$(date '+%Y-%m-%d %H:%M:%S') && systemctl stop onemap.target && within 30 stopped || return
  for role in $SYSTEM_ROLES; do [[ $(of_unit "$role" Result) == success ]] || return; done
  journalctl -u 'onemap-*' --since "$since" -o cat >"$work/stopped" && ! grep -q 'Killing process' "$work/stopped"
}
uninstalled() {
  "$installer" --uninstall --purge && [[ ! -e $installed_here && ! -e $configuration_here && ! -e $state_here ]] &&
    systemctl daemon-reload && [[ $(systemctl show -p LoadState --value onemap-planner.service) == not-found ]]
}

check_systemd() {
  local role
  step "install, with an extra" no-install,extras-lost installed
  ((failed == 0)) || return
  step "start" no-start systemctl start onemap.target
  step "all active within 180 s, and 30 s later" crash-loop,one-failed settled
  step "the gateway answers" never-ready answers
  for role in $SYSTEM_ROLES; do
    step "$role killed, back within 60 s" stays-dead,kill-misses killed_by_systemd "$role"
  done
  step "restarted, all active" crash-loop restarted
  step "a service starts without its router, and waits" start-waits,crash-loop,one-failed starts_without_router
  step "an installation that is cut off leaves the old one running" installs-anyway,half-left,one-failed fails_and_keeps cut_off
  step "an update that cannot be imported is refused" installs-anyway,half-left,one-failed fails_and_keeps cannot_be_imported
  step "an update whose planner ends at its start goes back" installs-anyway,half-left,crash-loop goes_back cannot_be_built
  step "an update runs, in all services, with the extra" no-install,old-processes,crash-loop,two-versions,extras-lost updated
  step "a rollback" no-install,crash-loop,stays-there rolled_back
  step "errors have their priority" no-priority,info-as-error error_has_its_priority
  step "stop, no SIGKILL" killed-at-stop,never-stops stopped_cleanly
  step "uninstall" left-behind uninstalled
}
