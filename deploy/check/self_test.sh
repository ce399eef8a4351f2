# `check.sh --self-test`: every step of every engine, run on a stub of that engine. It must hold,
# and fail where there is no engine at all and with each of the defects that it is there to see.
# The stubs are functions in place of the programs; each attempt begins on a system that runs.
proofs=0

prove() { # NAME DEFECTS COMMAND...
  local name=$1 defect
  for defect in no-engine ${2//,/ }; do
    proofs=$((proofs + 1))
    DEFECT=$defect attempt "${@:3}" >/dev/null || continue
    echo "FAIL  $engine: '$name' holds with the defect $defect"
    failed=$((failed + 1))
  done
  proofs=$((proofs + 1))
  if ! DEFECT=none attempt "${@:3}" >"$work/log"; then
    echo "FAIL  $engine: '$name' fails on an engine that works"
    sed 's/^/        /' "$work/log"
    failed=$((failed + 1))
  fi
}

attempt() { # in a subshell, so that nothing is left of it but its verdict
  (
    STUB=$(mktemp -d -p "$work") && cd "$STUB" || exit
    installed_here=$STUB/opt configuration_here=$STUB/etc state_here=$STUB/var
    mkdir -p opt/versions/{a,b} etc var deploy/secrets services/planner/onemap_planner
    ln -s versions/b opt/current
    ln -s versions/a opt/previous
    echo 'version = "0.3.0"' >pyproject.toml
    touch services/planner/onemap_planner/{__init__,service}.py
    "$@" 2>&1
  )
}

is() { [[ " $* " == *" $DEFECT "* ]]; } # DEFECT...
works() { ! is no-engine; }
sleep() { :; }
timeout() { ! is start-waits && "${@:2}"; }
free_port() { echo 18080; }

curl() {
  works && ! is never-ready || return
  local state=found name=simulator version=0.3.0 mapper_version
  case "$*" in
    *http_code*)
      if [[ "$*" == *"Bearer secret"* ]]; then if is locked-out; then echo 429; else echo 200; fi
      elif is open-door; then echo 200; else echo 401; fi ;;
    *searches/current*)
      if is search-fails; then state=failed; fi
      if [[ ${FUNCNAME[*]} == *not_resumed* ]] && is search-resumed; then state=exploring; fi
      if [[ ${FUNCNAME[*]} == *searching* ]]; then state=exploring; fi
      echo "{\"state\": \"$state\"}" ;;
    *v1/status*)
      if is another-robot; then name=ros2; fi
      version=$(sed 's/[^0-9.]//g' pyproject.toml) mapper_version=$version
      if is two-versions; then mapper_version=0.1.0; fi
      echo "{\"services\": [{\"name\": \"$name\", \"version\": \"$version\"}, {\"name\": \"robot\", \"version\": \"\"},
        {\"name\": \"gateway\", \"version\": \"$version\"},
        {\"name\": \"perception\", \"version\": \"$version\"}, {\"name\": \"mapper\", \"version\": \"$mapper_version\"},
        {\"name\": \"planner\", \"version\": \"$version\", \"alive\": $(is no-planner && echo false || echo true)}]}" ;;
  esac
}

# Compose.
stub_setup() {
  works && ! is no-setup || return
  echo COMPOSE_PROFILES=demo >deploy/.env
  echo secret >deploy/secrets/gateway-token
}
docker() {
  works || return
  local arguments="$*"
  [[ $1 != compose ]] || { shift; while [[ $1 == -[pf] ]]; do shift 2; done; arguments="compose $*"; }
  case $arguments in
    "compose build"*)
      ! is no-build || return
      echo '#9 1.0 Successfully installed onemap-0.3.0'
      ! is packages-anew || echo '#8 1.0 Successfully installed numpy-2.0.0 scipy-1.0' ;;
    "compose up"*) ! is no-start ;;
    "compose ps --format"*)
      local role state
      for role in $ROLES; do
        state=healthy
        if [[ $role == mapper ]]; then ! is one-missing || continue; ! is one-unhealthy || state=unhealthy; fi
        echo "$role $state"
      done ;;
    "compose ps"*) echo "id-${*: -1}" ;;
    "compose exec"*cat*) echo secret ;;
    "compose exec"*find_spec*) if is pip-left; then echo "pip: ModuleSpec"; else echo "pip: None"; fi ;;
    "compose exec"*"python - "*) ! is robot-drives ;;
    run*kill*) ! is kill-misses && touch "$STUB/killed" ;;
    "inspect --format"*)
      if [[ ! -e $STUB/killed ]] || is old-answer; then echo "true 100 0 healthy"
      elif is stays-dead; then echo "false 0 0 unhealthy"
      elif is starting; then echo "true 200 1 starting"
      else echo "true 200 1 healthy"; fi ;;
    inspect*) echo ONEMAP__GATEWAY__TOKEN_FILE; ! is secret-shown || echo secret ;;
    "ps -aq"* | "volume ls"*) ! is left-behind || echo one ;;
  esac
}

# systemd.
stub_installer() {
  works || return
  case "$*" in
    *--uninstall*) is left-behind || rm -rf opt etc var; return 0 ;;
    *--rollback*) ! is no-install || return; is stays-there || ln -sfn versions/a opt/current; touch restarted; return 0 ;;
  esac
  if [[ ${broken:-} || -s services/planner/onemap_planner/service.py ]]; then
    if is half-left; then mkdir opt/versions/c; fi
    is installs-anyway
  else
    ! is no-install && mkdir -p opt/versions/c && ln -sfn versions/c opt/current && touch restarted
  fi
}
cut_off() { broken=yes install_onemap; }
keeps_extras() { works && ! is extras-lost; }
systemctl() {
  works || return
  case "$*" in
    start* | restart*) ! is no-start ;;
    "stop onemap.target") is never-stops || touch stopped ;;
    kill*) touch killed; ! is kill-misses || rm killed ;;
    *LoadState*) if is left-behind; then echo loaded; else echo not-found; fi ;;
    *NRestarts*) if is crash-loop; then echo 3; else echo 0; fi ;;
    *Result*) echo success ;;
    *ActiveState*)
      if [[ -e stopped ]]; then echo inactive
      elif [[ -e killed ]] && is stays-dead || is one-failed; then echo failed
      else echo active; fi ;;
    *MainPID*) if [[ -e killed || -e restarted ]] && ! is old-processes; then echo 200; else echo 100; fi ;;
  esac
}
systemd-run() { works; }
journalctl() {
  works || return
  case "$*" in
    *"-p err"*)
      is no-priority || echo '{"level": "error"}'
      ! is info-as-error || echo '{"level": "info"}' ;;
    *) ! is killed-at-stop || echo 'Killing process 7 with signal SIGKILL.' ;;
  esac
}

# zenohd.
start_router() { works && ! is no-router && touch "$STUB/listening"; }
listens() { [[ -e listening ]]; }
kill() { works && ! { is no-router && [[ $1 == -0 ]]; }; }
stub_onemap() {
  case $1 in
    certs) works && ! is no-certificates && mkdir -p "$work/tls" && echo x | tee "$work/tls/ca.pem" >"$work/tls/planner.key" ;;
  esac
}
hears_planner() { # who shows no certificate is not let in
  if [[ ${FUNCNAME[*]} == *is_refused* ]]; then is open-door; else services_say 'services["planner"]["alive"]'; fi
}

self_test() { # ENGINES...
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  self_testing=true setup=stub_setup installer=stub_installer onemap=stub_onemap router=$$ planner=$$
  mkdir -p "$work/deploy" && cp "$HERE"/router*.json5 "$work/deploy/" && cd "$work" || exit
  unset CHECK_INSTALL_OPTIONS CHECK_COMPOSE_FILE CHECK_STEPS
  for engine in "$@"; do
    DEFECT=none "check_$engine"
  done
  ((failed == 0)) || { echo "$failed of $proofs proofs failed"; exit 1; }
  echo "each step holds, and fails with each of its defects: $proofs proofs"
}
