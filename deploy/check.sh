#!/usr/bin/env bash
# Try a deployment on this machine for real, and print a verdict for each step:
#   deploy/check.sh compose        needs Docker Engine with compose and buildx
#   sudo deploy/check.sh systemd   needs systemd as PID 1; installs OneMap on this machine
#   deploy/check.sh zenohd         needs zenohd on the PATH and `make setup-demo`
# Everything that it started is stopped at the end; exit code 0 only if every step held.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit
engine=${1:-}
failed=0
began=$SECONDS

step() { # NAME COMMAND...: run it, print the verdict, the seconds, and on failure its last lines
  local name=$1 start=$SECONDS log
  shift
  log=$(mktemp)
  if "$@" >"$log" 2>&1; then
    printf 'ok    %4d s  %s\n' $((SECONDS - start)) "$name"
  else
    printf 'FAIL  %4d s  %s\n' $((SECONDS - start)) "$name"
    tail -15 "$log" | sed 's/^/        /'
    failed=$((failed + 1))
  fi
  rm -f "$log"
}

within() { # SECONDS COMMAND...: until it succeeds
  local end=$((SECONDS + $1))
  shift
  until "$@"; do ((SECONDS < end)) || return 1; sleep 1; done
}

URL=http://127.0.0.1:8080
token=
get() { curl -fsS ${token:+-H "Authorization: Bearer $token"} "$URL$1"; }
post() {
  curl -fsS ${token:+-H "Authorization: Bearer $token"} -H 'content-type: application/json' \
    -d "$2" "$URL$1"
}
field() { python3 -c 'import json, sys; print(json.load(sys.stdin)[sys.argv[1]])' "$1"; }
ready() { get /readyz; }
searching() { [[ $(get /v1/searches/current | field state) =~ exploring|approaching|confirming ]]; }
state_is() { [[ $(get /v1/searches/current | field state) == "$1" ]]; }
start_search() { post /v1/searches '{"objects": ["bed", "television", "refrigerator"]}'; }
found() { within 300 state_is found; }
refused_without_token() {
  [[ $(curl -s -o /dev/null -w '%{http_code}' "$URL/v1/status") == 401 ]]
}
one_version() { ! get /v1/status | grep -q 'update all services together'; }

check_compose() {
  local compose=(docker compose -f deploy/compose.yaml)
  running() { [[ $("${compose[@]}" ps --status running -q "$1") ]]; }
  healthy() { ! "${compose[@]}" ps --format '{{.Health}}' | grep -qv '^healthy$'; }
  no_secret() { ! docker inspect "$("${compose[@]}" ps -q gateway)" | grep -q "$token"; }
  no_pip() { ! "${compose[@]}" exec -T gateway python -m pip --version; }
  step "prerequisites, token and .env" deploy/setup.sh --demo
  step "build" "${compose[@]}" build
  ((failed == 0)) || return
  step "build again after an edit of the planner, packages cached" rebuild "${compose[@]}"
  step "start" "${compose[@]}" up --detach
  token=$("${compose[@]}" exec -T gateway cat /run/secrets/gateway-token)
  step "ready within 120 s" within 120 ready
  step "all healthy within 60 s" within 60 healthy
  step "nothing without a token" refused_without_token
  step "the token is not in docker inspect" no_secret
  step "no pip in an image" no_pip
  step "a search of three objects" eval 'start_search && found'
  for name in perception mapper planner gateway router simulator; do
    step "$name killed, back and ready within 90 s" eval \
      "docker kill --signal KILL \$(docker compose -f deploy/compose.yaml ps -q $name) \
       && sleep 2 && within 90 ready"
  done
  start_search >/dev/null 2>&1
  within 60 searching
  step "down in a new shell" env -i PATH="$PATH" HOME="$HOME" "${compose[@]}" down
  step "up again" "${compose[@]}" up --detach
  step "ready within 120 s" within 120 ready
  step "the search of before is interrupted, not resumed" within 60 state_is interrupted
  step "one version" one_version
  for name in router perception mapper planner gateway simulator; do
    docker image ls --format '      {{.Repository}}:{{.Tag}} {{.Size}}' "onemap-$name"
  done
  step "down, volumes removed" "${compose[@]}" down --volumes
}

rebuild() { # an edit of the planner must not install its packages anew
  local file=services/planner/onemap_planner/__init__.py
  printf '\n' >>"$file"
  "$@" build planner 2>&1 | tee /dev/stderr | grep -c CACHED
  git checkout -q "$file"
}

check_systemd() {
  local install=deploy/systemd/install.sh
  pids() { systemctl show -p MainPID --value 'onemap-*.service' | sort; }
  active() { ! systemctl is-failed --quiet 'onemap-*' && systemctl is-active --quiet onemap.target; }
  updated() { local before; before=$(pids); "$install" && [[ $before != "$(pids)" ]]; }
  back() { "$install" --rollback && within 120 active; }
  pip_cut_off() { # an installation that ends in the middle leaves the one that runs
    local before; before=$(readlink /opt/onemap/current)
    PIP_INDEX_URL=http://127.0.0.1:1 "$install" && return 1
    [[ $(readlink /opt/onemap/current) == "$before" ]] && active
  }
  killed() {
    systemctl kill --signal KILL "onemap-$1" && sleep 2 && within 60 systemctl is-active -q "onemap-$1"
  }
  stopped_cleanly() {
    systemctl stop onemap.target &&
      ! journalctl -u 'onemap-*' --since "-60 s" | grep -q 'Killing process'
  }
  step "install" "$install"
  ((failed == 0)) || return
  step "start" systemctl start onemap.target
  step "all active within 180 s" within 180 active
  step "the gateway answers" within 60 get /healthz
  for name in router perception mapper planner gateway; do
    step "$name killed, back within 60 s" killed "$name"
  done
  step "a broken installation leaves the old one running" pip_cut_off
  step "an update restarts the services" updated
  step "a rollback" back
  step "errors have their priority" eval "! journalctl -u 'onemap-*' -p err -n 1 | grep -q '\"level\": \"info\"'"
  step "stop, no SIGKILL" stopped_cleanly
  step "uninstall" "$install" --uninstall
}

check_zenohd() {
  local onemap=.venv/bin/onemap pid gateway file
  reached() { get /v1/status | grep -q '"services"' && ! get /v1/status | grep -q 'lost the router'; }
  for file in deploy/router.json5 deploy/router-tls.json5; do
    [[ $file == *tls* && ! -e /etc/onemap/tls/router.key ]] &&
      { echo "skip           $file: no certificates in /etc/onemap/tls"; continue; }
    zenohd -c "$file" >/dev/null 2>&1 &
    pid=$!
    sleep 2
    step "zenohd takes $file" kill -0 "$pid"
    "$onemap" gateway >/dev/null 2>&1 &
    gateway=$!
    step "the gateway reaches it" within 30 reached
    kill "$gateway" "$pid"
    wait "$gateway" "$pid" 2>/dev/null
  done
}

case $engine in
  compose) check_compose ;;
  systemd) check_systemd ;;
  zenohd) check_zenohd ;;
  *) sed -n '2,6s/^# //p' "$0" >&2; exit 2 ;;
esac
if ((failed)); then echo "$failed steps failed, in $((SECONDS - began)) s"; exit 1; fi
echo "every step held, in $((SECONDS - began)) s"
