# `check.sh compose`: a project of its own, with the simulator, from building to removal.
#
# ONEMAP_VERSION=check gives images and the volume of kernels names that no other project has.
ROLES="router simulator perception mapper planner gateway"
project=onemap-check
setup=deploy/setup.sh

compose() {
  docker compose -p "$project" -f deploy/compose.yaml -f deploy/check.yaml ${CHECK_COMPOSE_FILE:+-f "$CHECK_COMPOSE_FILE"} "$@"
}

refuse_compose() {
  docker info >/dev/null 2>&1 || refuse "the Docker daemon does not answer"
  [[ -z $(docker ps -aq --filter "label=com.docker.compose.project=$project") ]] ||
    refuse "a project $project exists: another check runs, or was cut off (docker compose -p $project down --volumes)"
}

clean_compose() { compose down --volumes --remove-orphans; }

prepare() { # setup.sh and, beside compose.yaml, ports that nothing else has
  "$setup" --demo && [[ -e deploy/secrets/gateway-token ]] && grep -q '^COMPOSE_PROFILES=demo$' deploy/.env &&
    sed -i '/^ONEMAP_VERSION=/d' deploy/.env && echo ONEMAP_VERSION=check >>deploy/.env &&
    cat >deploy/check.yaml <<TEXT
services:
  router: { ports: !override ["127.0.0.1:$(free_port):7447"] }
  gateway: { ports: !override ["127.0.0.1:${URL##*:}:8080"] }
TEXT
}

packages_stay() { # COMMAND...: an edit, after which a build installs OneMap itself and no package
  local log
  "$@" && log=$(compose build --progress plain planner 2>&1) || return
  echo "$log" | grep 'Successfully installed' | grep -q ' onemap-' &&
    ! echo "$log" | grep 'Successfully installed' | grep -v 'Successfully installed onemap-[^ ]*$'
}
edit_planner() { printf '\n' >>services/planner/onemap_planner/__init__.py; }
edit_version() { sed -i 's/^version = .*/version = "0.2.1"/' pyproject.toml; }

container() { docker inspect --format "{{.State.Running}} {{.State.Pid}} {{.RestartCount}} {{with .State.Health}}{{.Status}}{{end}}" "$(compose ps -aq "$1")"; }
all_healthy() { # as many as there are roles
  local health
  health=$(compose ps --format '{{.Service}} {{.Health}}') || return
  [[ $(echo "$health" | grep -c ' healthy$') == $(wc -w <<<"$ROLES") ]]
}
# A new process, that its own health check finds well: /readyz alone may still answer for the old one.
back() { # ROLE PID RESTARTS, as before
  local running pid restarts health
  read -r running pid restarts health < <(container "$1") || return
  [[ $running == true && $pid != "$2" && $health == healthy ]] && ((restarts > $3)) && ready
}
# `docker kill` counts as a stop by hand, after which no restart policy applies: the process is
# killed from outside, in the host's view of it.
kill_process() { # PID
  docker run --rm --pid host --user 0 --cap-add KILL --network none --entrypoint python \
    "onemap-router:check" -c "import os; os.kill($1, 9)"
}
killed() { # ROLE
  local running pid restarts health
  read -r running pid restarts health < <(container "$1") || return
  [[ $running == true && $pid -gt 1 ]] && kill_process "$pid" && within 90 back "$1" "$pid" "$restarts"
}

no_secret() {
  local text
  text=$(docker inspect "$(compose ps -q gateway)") && [[ -n $token ]] &&
    grep -q ONEMAP__GATEWAY__TOKEN_FILE <<<"$text" && ! grep -qF "$token" <<<"$text"
}
no_pip() {
  [[ $(compose exec -T gateway python -c 'import importlib.util as u; print("pip:", u.find_spec("pip"))') == "pip: None" ]]
}
robot_stands() { # while it restarts in the middle of a search, by its own odometry
  searching && compose restart simulator && within 60 ready &&
    compose exec -T gateway python - 25 <"$HERE/check/stands.py"
}
again() { (unset "${!ONEMAP_@}" "${!COMPOSE_@}"; compose down && compose up --detach); }
over='interrupted|failed|found|cancelled'
not_resumed() { within 60 state_is "$over" && throughout 10 state_is "$over"; }
say_peaks() { # of memory, with what the kernel keeps of files
  local role files='/sys/fs/cgroup/memory.peak /sys/fs/cgroup/memory/memory.max_usage_in_bytes'
  for role in $ROLES; do
    compose exec -T "$role" cat $files 2>/dev/null | awk -v role="$role" '{ printf "      %s: peak memory %d MB\n", role, $1 / 1e6 }'
  done
}
removed() {
  compose down --volumes --remove-orphans && docker info &&
    [[ -z $(docker ps -aq --filter "label=com.docker.compose.project=$project") ]] &&
    [[ -z $(docker volume ls -q --filter "label=com.docker.compose.project=$project") ]]
}

check_compose() {
  URL=http://127.0.0.1:$(free_port)
  step "prerequisites, token and .env" no-setup prepare
  ((failed == 0)) || return
  step "build" no-build compose build
  ((failed == 0)) || return
  step "an edit of the planner installs no package anew" packages-anew packages_stay edit_planner
  step "start" no-start compose up --detach
  token=$(compose exec -T gateway cat /run/secrets/gateway-token)
  step "ready within 120 s" never-ready within 120 ready
  step "all healthy within 60 s" one-unhealthy,one-missing within 60 all_healthy
  step "nothing without a token" open-door refused_without_token
  step "twelve wrong tokens do not lock the right one out" open-door,locked-out right_token_after_wrong_ones
  step "the token is not in docker inspect" secret-shown no_secret
  step "no pip in an image" pip-left no_pip
  step "the robot is the simulator" another-robot robot_is_simulator
  ((failed == 0)) || return
  step "one version" two-versions says_version $ROLES
  step "a search of three objects" search-fails found
  $self_testing || say_peaks
  for role in $ROLES; do
    step "$role killed, back and healthy within 90 s" stays-dead,old-answer,starting,kill-misses,never-ready killed "$role"
  done
  step "a robot that restarts in a search stands" robot-drives robot_stands
  step "down in a new shell and up again" no-start again
  step "ready within 120 s" never-ready within 120 ready
  step "the search of before is not resumed" search-resumed not_resumed
  for role in $ROLES; do
    $self_testing || docker image ls --format '      {{.Repository}}:{{.Tag}} {{.Size}}' "onemap-$role:check"
  done
  step "a new version number installs no package anew" packages-anew packages_stay edit_version
  step "down, volumes removed" left-behind removed
}
