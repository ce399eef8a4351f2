# What the checks of all engines share: steps and their verdicts, waiting, HTTP.
#
# A step has a name, the defects that must make it fail, and a command. The defects are those of
# `self_test.sh`, which runs every command with and without each of them.
failed=0 skipped=0 began=$SECONDS token='' self_testing=false
URL=http://127.0.0.1:8080 # each engine sets its own

step() { # NAME DEFECTS COMMAND...: run it, print the verdict, the seconds, and on failure its last lines
  local name=$1 defects=$2 start=$SECONDS log
  shift 2
  if $self_testing; then prove "$name" "$defects" "$@"; return; fi
  [[ $name =~ ${CHECK_STEPS:-} ]] || { skip "$name" "not in CHECK_STEPS"; return; }
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

skip() { # NAME REASON
  printf 'skip          %s: %s\n' "$1" "$2"
  skipped=$((skipped + 1))
}

refuse() { echo "check.sh: $*" >&2; exit 2; }

verdict() {
  local seconds=$((SECONDS - began)) and=''
  ((skipped == 0)) || and=", $skipped were skipped"
  if ((failed)); then echo "$failed steps failed$and, in $seconds s"; exit 1; fi
  echo "every step that was run held$and, in $seconds s"
}

within() { # SECONDS COMMAND...: until it succeeds
  local end=$((SECONDS + $1)) tries=$1
  shift
  if $self_testing && ((tries > 3)); then tries=3; fi
  until "$@"; do
    ((SECONDS < end && --tries > 0)) || return 1
    sleep 1
  done
}

throughout() { # SECONDS COMMAND...: it succeeds all the time
  local end=$((SECONDS + $1)) tries=$1
  shift
  if $self_testing; then tries=2; fi
  while ((SECONDS < end && tries-- > 0)); do
    "$@" || return 1
    sleep 1
  done
}

free_port() {
  python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

listens() { # PORT
  python3 -c 'import socket, sys; socket.create_connection(("127.0.0.1", int(sys.argv[1])), 1)' "$1" 2>/dev/null
}

copy_sources() { # FROM TO: what git knows or would add, as it lies there
  mkdir -p "$2" && git -C "$1" ls-files -z --cached --others --exclude-standard |
    (cd "$1" && xargs -0 sh -c 'for f; do [ ! -e "$f" ] || printf "%s\0" "$f"; done' sh) |
    tar -C "$1" --null --files-from=- -cf - | tar -C "$2" -xf - && [[ -e $2/pyproject.toml ]]
}

# HTTP. Every answer is read and compared: an error of curl is never a verdict by itself.
get() { curl -fsS --max-time 10 ${token:+-H "Authorization: Bearer $token"} "$URL$1"; }
post() {
  curl -fsS --max-time 30 ${token:+-H "Authorization: Bearer $token"} \
    -H 'content-type: application/json' -d "$2" "$URL$1"
}
ready() { get /readyz >/dev/null; }
status() { # with the token that is set, or none
  curl -s --max-time 10 -o /dev/null -w '%{http_code}\n' ${token:+-H "Authorization: Bearer $token"} "$URL/v1/status"
}
refused_without_token() { [[ $(token='' status) == 401 ]]; }
right_token_after_wrong_ones() { # an old page's, say, that asks again and again
  local codes
  codes=$(for _ in {1..12}; do token=wrong status & done; wait)
  [[ $(sort -u <<<"$codes") == 401 && $(status) == 200 ]]
}
field() { python3 -c 'import json, sys; print(json.load(sys.stdin)[sys.argv[1]])' "$1"; }
state_is() { [[ $(get /v1/searches/current | field state) =~ ^($1)$ ]]; }
start_search() { post /v1/searches '{"objects": ["bed", "television", "refrigerator"]}'; }
found() { start_search && within 300 state_is found; }
searching() { start_search && within 60 state_is 'exploring|approaching|confirming'; }
interrupted() { within 60 state_is interrupted; }
services_say() { # PYTHON-EXPRESSION of services, a dict of name to what /v1/status says
  get /v1/status | python3 -c '
import json, sys
services = {s["name"]: s for s in json.load(sys.stdin)["services"]}
sys.exit(not eval(sys.argv[1]))' "$1"
}
one_version() { # of all ROLES but the router, which says none: VERSION
  local version=$1 roles
  roles=$(printf '"%s", ' "${@:2}")
  services_say "{services[n][\"version\"] for n in ($roles) if n != \"router\"} == {\"$version\"}"
}
number() { sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml; }
says_version() { within 60 one_version "$(number)" "$@"; } # ROLES
robot_is_simulator() { services_say '"simulator" in services and not {"replay", "ros2"} & set(services)'; }
