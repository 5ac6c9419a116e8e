#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# bare-machine.sh [--commit COMMIT] [--folder FOLDER] [--keep] [COMMAND...]
#
# Runs the README's commands (`make demo` and `make check`, or those that are
# named) on a bare Debian 12: what debootstrap's minbase has, and make. It gets a
# clone of this repository at a commit (HEAD), packages from where this machine has
# its own, and nothing else of this machine. Says how long each command took, and
# fails if one does. As root or through sudo.
#
#   --folder FOLDER  where its root is made (a new folder of the temporary ones)
#   --keep           leaves it there; with --folder the next run goes on with it
set -euo pipefail
source="$(cd "$(dirname "$0")/.." && pwd)"
# shellcheck source=utils/bare-root.sh
. "$source/utils/bare-root.sh"

commit=HEAD folder='' keep=''
while [ $# -gt 0 ]; do
  case "$1" in
    --commit | --folder)
      [ $# -gt 1 ] || fail "option '$1' lacks its value"
      declare "${1#--}=$2"
      shift 2
      ;;
    --keep) keep=1 && shift ;;
    --help) sed -n '4,/^set/{/^#/s/^# \{0,1\}//p}' "$0" && exit ;;
    -*) fail "unknown option '$1'" ;;
    *) break ;;
  esac
done
[ $# -gt 0 ] || set -- 'make demo' 'make check'

# A root may not read what is not its own.
git() { command git -c safe.directory='*' "$@"; }
commit="$(git -C "$source" rev-parse --verify --quiet "$commit^{commit}")" ||
  fail "expected a commit of $source"
as_root --commit "$commit" ${folder:+--folder "$folder"} ${keep:+--keep} "$@"
open_root
inside 'apt-get update -q && apt-get install -q -y --no-install-recommends make'
rm -rf "$root/piko"
git init --quiet "$root/piko"
# Of a commit that no branch has, too.
git -C "$root/piko" fetch --quiet "$source" "$commit"
git -C "$root/piko" -c advice.detachedHead=false checkout --quiet FETCH_HEAD
chown -R root:root "$root/piko"

# Wall clock, and what processors were busy with it: others may use them, too.
times=()
failed=0
TIMEFORMAT='%0R s, %0U s user and %0S s system on '"$(nproc)"' processors'
for command in "$@"; do
  echo "bare-machine: $command"
  status=ok
  { time inside "cd /piko && $command" 2>&4 || status="failed ($?)"; } \
    4>&2 2>"$root/time"
  times+=("$command: $status, $(cat "$root/time")")
  [ "$status" = ok ] || failed=1
done
echo "bare-machine: ${commit:0:12} on Debian $(cat "$root/etc/debian_version"):"
printf '  %s\n' "${times[@]}"
exit "$failed"
