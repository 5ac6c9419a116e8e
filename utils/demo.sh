#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# demo.sh BUILD OUT [PIPE]
#
# Renders the bunny with the piko-render of a build into a folder, and says where
# the picture is, how long a frame took, and what to try next. From the root of the
# tree, as `make demo` runs it.
set -euo pipefail
render="$1/bin/piko-render" out="$2" pipe="${3:-Fused}"
bunny=/usr/share/glmark2/models/bunny.obj
raster=examples/raster/raster.piko.cpp
size='--width 1024 --height 768'

mkdir -p "$out"
# shellcheck disable=SC2086 # words
"$render" "$raster" --pipe "$pipe" "$bunny" $size --out "$out/bunny.png" |
  tee "$out/bunny.txt"

# The line is "Fused: 1.9 ms a frame (median of 30, ...), ...".
frame="$(sed -n 's/^[^:]*: \([0-9.e+-]*\) ms a frame.*/\1/p' "$out/bunny.txt")"
[ -n "$frame" ] || { echo "demo: expected the time of a frame" >&2 && exit 1; }
cat <<END

The picture: $(cd "$out" && pwd)/bunny.png
The speed:   $frame ms a frame, $(awk "BEGIN { printf \"%.0f\", 1000 / $frame }") frames a second, on $(nproc) processors

To try next, the same triangles in a kernel for each stage, and rays:

  $render $raster --pipe Baseline $bunny $size --out $out/baseline.png
  $render examples/raytrace/raytrace.piko.cpp $bunny $size --out $out/raytrace.png

END
