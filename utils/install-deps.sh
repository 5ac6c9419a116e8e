#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# install-deps.sh [LIST...]
#
# Installs the packages of lists (utils/packages-demo.txt and utils/packages.txt) on
# Debian 12, as root or through sudo. Does nothing when all are there.
set -euo pipefail

if [ $# -eq 0 ]; then
  set -- "$(dirname "$0")/packages-demo.txt" "$(dirname "$0")/packages.txt"
fi

if ! command -v dpkg-query >/dev/null; then
  echo "install-deps: not a Debian system: install these by other means," \
    "then go on:" >&2
  grep -hv '^#' "$@" | xargs >&2
  exit 0
fi

missing=()
while read -r package; do
  case "$package" in '' | '#'*) continue ;; esac
  status="$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)"
  [ "$status" = installed ] || missing+=("$package")
done < <(cat "$@")

if [ "${#missing[@]}" -eq 0 ]; then
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "install-deps: expected root or sudo to install: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

update() {
  "${as_root[@]}" apt-get update -q </dev/null
}

install() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y \
    --no-install-recommends "${missing[@]}" </dev/null
}

echo "install-deps: installing ${missing[*]}"
# Lists of the last day serve, but for what has been replaced since.
lists="$(find /var/lib/apt/lists -name '*_Packages*' -mtime -1 2>/dev/null)"
if [ -z "$lists" ] || ! install; then
  update
  install
fi
