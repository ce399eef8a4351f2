#!/usr/bin/env bash
# Try a deployment for real, and print a verdict for each step:
#   deploy/check.sh compose        needs Docker Engine with compose and buildx
#   sudo deploy/check.sh systemd   needs systemd as PID 1, on a machine without OneMap
#   deploy/check.sh zenohd         needs zenohd on the PATH and `make setup-dev`
#   deploy/check.sh --self-test ENGINE...   every step on a stub: does it fail where it should?
# CHECK_STEPS=REGEX runs the steps with such a name alone: those that they build on too.
# It works on a copy of the sources, under names and ports of its own, and removes what it started.
# Exit code 0 only if every step held; 2 where it would touch what is not its own.
set -uo pipefail
HERE=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source-path=SCRIPTDIR
for part in steps compose systemd zenohd; do . "$HERE/check/$part.sh"; done

engine=${1:-}
case $engine in
  compose | systemd | zenohd) ;;
  --self-test) . "$HERE/check/self_test.sh"; self_test "${@:2}"; exit ;;
  *) sed -n '2,7s/^# //p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac
# Also from one that still builds, and so has left no trace yet. To the end of this process.
exec 8>>"${TMPDIR:-/tmp}/onemap-check-$engine.lock" && flock --nonblock 8 || refuse "another check of $engine runs"
"refuse_$engine"
work=$(mktemp -d)
finish() { "clean_$engine" >/dev/null 2>&1; rm -rf "$work"; }
trap finish EXIT
trap 'exit 130' INT TERM
copy_sources "$HERE/.." "$work/onemap" || refuse "the sources cannot be copied: is this a git checkout?"
cd "$work/onemap" || exit
"check_$engine"
verdict
