# `check.sh zenohd`: the two router files under a real zenohd, on ports and with certificates of
# the check's own.
onemap=$HERE/../.venv/bin/onemap

refuse_zenohd() {
  command -v zenohd >/dev/null || refuse "zenohd is not on the PATH"
  "$onemap" --version >/dev/null 2>&1 || refuse "$onemap is missing: make setup-dev"
}
clean_zenohd() { # shellcheck disable=SC2046 # one word for each process
  kill $(jobs -p)
}

# FILE PLAIN-PORT TLS-PORT: the file with these ports and, for TLS, the certificates of this check
# and no plain endpoint.
moved() {
  sed -e "s|tcp/127.0.0.1:7447\", \"tls/0.0.0.0:7448|tls/127.0.0.1:$3|" \
    -e "s|tcp/127.0.0.1:7447|tcp/127.0.0.1:$2|" -e "s|/etc/onemap/tls|$work/tls|" "deploy/$1" >"$work/$1"
}
start_router() { zenohd -c "$1" >"$work/zenohd.log" 2>&1 & router=$!; }
serves() { # FILE PORT: zenohd reads it and listens there, and nothing did before
  ! listens "$2" || return
  start_router "$work/$1"
  within 20 listens "$2" && kill -0 "$router"
}
endpoint() { # PORT [ROLE]: over TLS with the certificate of the role
  if [[ -z ${2:-} ]]; then echo "tcp/127.0.0.1:$1"; return; fi
  echo "tls/localhost:$1#enable_mtls=true;root_ca_certificate_file=$work/tls/ca.pem;connect_certificate_file=$work/tls/$2.pem;connect_private_key_file=$work/tls/$2.key"
}
joins() { # ENDPOINT: a gateway hears a planner there, over this router alone
  ONEMAP__BUS__CONNECT="[\"$1\"]" ONEMAP__GATEWAY__PORT=${URL##*:} "$onemap" gateway >"$work/gateway.log" 2>&1 &
  local pid=$! code
  within 30 hears_planner
  code=$?
  kill "$pid" && wait "$pid"
  return "$code"
}
hears_planner() { services_say 'services["planner"]["alive"]'; }
planner_at() { # ENDPOINT
  ONEMAP__BUS__CONNECT="[\"$1\"]" ONEMAP__PLANNER__STATE_DIR="$work/planner" "$onemap" planner >"$work/planner.log" 2>&1 &
  planner=$!
}
is_refused() { # ENDPOINT: whoever shows no certificate, while the router lives
  kill -0 "$router" && ! joins "$1" && kill -0 "$router"
}
ends() { kill "$planner" "$router" && wait "$planner" "$router" 2>/dev/null; ! kill -0 "$router" 2>/dev/null; }

check_zenohd() {
  local plain tls
  plain=$(free_port) tls=$(free_port)
  URL=http://127.0.0.1:$(free_port)
  moved router.json5 "$plain" 0
  step "zenohd takes router.json5" no-router serves router.json5 "$plain"
  ((failed == 0)) || return
  planner_at "$(endpoint "$plain")"
  step "gateway and planner meet there" no-planner joins "$(endpoint "$plain")"
  ends
  step "certificates" no-certificates certificates
  ((failed == 0)) || return
  moved router-tls.json5 0 "$tls"
  step "zenohd takes router-tls.json5" no-router serves router-tls.json5 "$tls"
  planner_at "$(endpoint "$tls" planner)"
  step "gateway and planner meet there, over TLS" no-planner joins "$(endpoint "$tls" gateway)"
  step "without a certificate nobody gets in" open-door is_refused "tls/localhost:$tls#root_ca_certificate_file=$work/tls/ca.pem"
  step "plain TCP gets nobody in" open-door is_refused "tcp/127.0.0.1:$tls"
  ends
}
certificates() { "$onemap" certs "$work/tls" --host localhost && [[ -s $work/tls/ca.pem && -s $work/tls/planner.key ]]; }
