# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
# shellcheck shell=bash
#
# A bare Debian 12 in a folder: what debootstrap's minbase has, and packages from where
# this machine has its own. For scripts that include it, which have set `source`, the
# tree's folder, and may set `folder` and `keep`, as bare-machine.sh says.
#
#   as_root ARGUMENT...  runs the script again as root, with these, if it is not
#   open_root            makes the root, which `root` names, and mounts what it needs;
#                        at the script's end all is removed, or left without mounts
#   inside COMMAND       runs a command of bash in it
readonly suite=bookworm
mounts=(proc sys dev dev/pts dev/shm)

fail() {
  echo "$(basename "$0" .sh): $*" >&2
  exit 2
}

as_root() {
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "expected root or sudo"
    exec sudo --preserve-env=http_proxy,https_proxy,no_proxy,TMPDIR -- "$0" "$@"
  fi
}

# shellcheck disable=SC2317 # a trap
clean_up() {
  local i
  for ((i = ${#mounts[@]} - 1; i >= 0; --i)); do
    if mountpoint -q "$root/${mounts[i]}"; then
      umount "$root/${mounts[i]}" || umount --lazy "$root/${mounts[i]}"
    fi
  done
  if [ -n "$keep" ]; then
    echo "$(basename "$0" .sh): its root is $root"
  else
    # Nothing of this machine goes with it, should something be mounted still.
    rm -rf --one-file-system "$root"
    rmdir --ignore-fail-on-non-empty "$folder"
  fi
}
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
        echo "$(basename "$0" .sh): not all of $path can be read" >&2
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

open_root() {
  "$source/utils/install-deps.sh" "$source/utils/packages-bare.txt"
  if [ -n "$folder" ]; then
    mkdir -p "$folder"
  else
    folder="$(mktemp -d)"
  fi
  root="$(cd "$folder" && pwd)/root"
  mkdir -p "$root"
  trap clean_up EXIT
  trap 'exit 130' INT TERM
  if ! [ -x "$root/usr/bin/apt-get" ]; then
    make_root
  fi
  copy_apt
  mount_all
}
