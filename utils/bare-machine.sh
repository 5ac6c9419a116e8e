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
readonly suite=bookworm

fail() {
  echo "bare-machine: $*" >&2
  exit 2
}

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

source="$(cd "$(dirname "$0")/.." && pwd)"
# A root may not read what is not its own.
git() { command git -c safe.directory='*' "$@"; }
commit="$(git -C "$source" rev-parse --verify --quiet "$commit^{commit}")" ||
  fail "expected a commit of $source"
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || fail "expected root or sudo"
  exec sudo --preserve-env=http_proxy,https_proxy,no_proxy,TMPDIR -- "$0" \
    --commit "$commit" ${folder:+--folder "$folder"} ${keep:+--keep} "$@"
fi
"$source/utils/install-deps.sh" "$source/utils/packages-bare.txt"

if [ -n "$folder" ]; then
  mkdir -p "$folder"
else
  folder="$(mktemp -d)"
fi
root="$(cd "$folder" && pwd)/root"
mounts=(proc sys dev dev/pts dev/shm)
mkdir -p "$root"

# shellcheck disable=SC2317 # a trap
clean_up() {
  local i
  for ((i = ${#mounts[@]} - 1; i >= 0; --i)); do
    if mountpoint -q "$root/${mounts[i]}"; then
      umount "$root/${mounts[i]}" || umount --lazy "$root/${mounts[i]}"
    fi
  done
  if [ -n "$keep" ]; then
    echo "bare-machine: its root is $root"
  else
    # Nothing of this machine goes with it, should something be mounted still.
    rm -rf --one-file-system "$root"
    rmdir --ignore-fail-on-non-empty "$folder"
  fi
}
trap clean_up EXIT
trap 'exit 130' INT TERM

# Where apt has this release's packages from, its proxy, and its keys.
make_root() {
  local mirror proxy
  # shellcheck disable=SC2016 # apt's own fields
  mirror="$(apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' \
    'Created-By: Packages' |
    awk -v suite="$suite" '$2 == suite && $3 == "main" { print $1; exit }')"
  [ -n "$mirror" ] || fail "expected Debian's $suite in apt's sources" \
    "(apt-get update reads them)"
  eval "$(apt-config shell proxy Acquire::http::Proxy)"
  if [ -n "${proxy:-}" ]; then
    export http_proxy="$proxy"
  fi
  debootstrap --variant=minbase "$suite" "$root" "$mirror"
}

# Sources, keys and settings of apt, and how names are resolved.
copy_apt() {
  local path
  rm -rf "$root/etc/apt"
  for path in /etc/apt /usr/share/keyrings /etc/ssl/certs /etc/resolv.conf \
    /etc/hosts; do
    if [ -e "$path" ]; then
      mkdir -p "$root$(dirname "$path")"
      cp -RL --no-target-directory "$path" "$root$path" 2>/dev/null ||
        echo "bare-machine: not all of $path can be read" >&2
    fi
  done
  # No service is started in there.
  printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
  chmod +x "$root/usr/sbin/policy-rc.d"
}

# A bind mount of this machine's would lose its devices to whoever removes the
# folder while it is mounted.
make_devices() {
  local dev=$root/dev name number
  mount -t tmpfs -o mode=755 tmpfs "$dev"
  for name in null:3 zero:5 full:7 random:8 urandom:9; do
    number=${name#*:} name=${name%:*}
    mknod -m 666 "$dev/$name" c 1 "$number"
  done
  mknod -m 666 "$dev/tty" c 5 0
  ln -s /proc/self/fd "$dev/fd"
  ln -s fd/0 "$dev/stdin"
  ln -s fd/1 "$dev/stdout"
  ln -s fd/2 "$dev/stderr"
  ln -s pts/ptmx "$dev/ptmx"
  mkdir "$dev/pts" "$dev/shm"
}

mount_all() {
  mount -t proc proc "$root/proc"
  mount -t sysfs -o ro sysfs "$root/sys"
  make_devices
  mount --bind /dev/pts "$root/dev/pts"
  mount -t tmpfs tmpfs "$root/dev/shm"
}

inside() {
  local name set=()
  for name in http_proxy https_proxy no_proxy TERM; do
    [ -z "${!name:-}" ] || set+=("$name=${!name}")
  done
  env -i HOME=/root LANG=C.UTF-8 "${set[@]}" \
    PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    chroot "$root" bash -c "$1" </dev/null
}

if ! [ -x "$root/usr/bin/apt-get" ]; then
  make_root
fi
copy_apt
mount_all
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
