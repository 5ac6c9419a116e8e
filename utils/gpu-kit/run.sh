#!/bin/bash
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# On a machine with a card, as root, where make.sh has packed this folder:
#
#   ./run.sh unpack
#   ./run.sh check RESULTS SECONDS     EndToEnd's cases against the reference executor
#   ./run.sh time RESULTS SECONDS      pictures of the examples, then times of frames
#   ./run.sh conformance RESULTS SECONDS
#
# Each goes on after what fails, writes a line of JSON for each thing that it has
# done, and ends in time. RESULTS is a folder.
set -uo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
step="${1:?unpack, check, time or conformance}" results="${2:-}" seconds="${3:-100}"

if [ "$step" = unpack ]; then
  tar xJf "$here/rest.tar.xz" -C / &
  mkdir -p /opt/piko-kit/bin
  tar xJf "$here/tools.tar.xz" -C /opt/piko-kit/bin || exit 1
  wait $! || exit 1
  nvidia-smi --query-gpu=name,driver_version,memory.total --format=csv
  exit 0
fi
# shellcheck source=/dev/null
. /opt/piko-kit/environment
mkdir -p "$results"
cd /tmp || exit 1
case "$step" in
  check) OMP_NUM_THREADS=2 python3 "$here/cases.py" "$results/check.jsonl" "$seconds" ;;
  time) python3 "$here/frames.py" "$results/time.jsonl" "$seconds" ;;
  conformance)
    timeout "$seconds" "$PIKO_KIT_BUILD/bin/PikoConformance-cuda" --gtest_brief=1 \
      >"$results/conformance.txt" 2>&1
    tail -n 20 "$results/conformance.txt"
    ;;
  *) echo "run.sh: unknown step $step" >&2 && exit 1 ;;
esac
