#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# check-packages.sh [--folder FOLDER] [--keep] PACKAGES
#
# Installs the Debian packages of a folder, as `make packages` leaves them, on a bare
# Debian 12, and does there what their users do: builds the applications of the tutorial
# and of docs/Scale.md and the project of docs/OutOfTree.md by the documents' own
# commands, renders the bunny, draws it from Python, reads a manual page, completes a
# command line, and takes the packages away again. Lintian looks at them, too. As root or through sudo; also `make package-check`.
#
#   --folder FOLDER  where its root is made (a new folder of the temporary ones)
#   --keep           leaves it there; with --folder the next run goes on with it
set -euo pipefail
source="$(cd "$(dirname "$0")/.." && pwd)"
# shellcheck source=utils/bare-root.sh
. "$source/utils/bare-root.sh"

folder='' keep=''
while [ $# -gt 0 ]; do
  case "$1" in
    --folder)
      [ $# -gt 1 ] || fail "option '$1' lacks its value"
      folder="$2"
      shift 2
      ;;
    --keep) keep=1 && shift ;;
    --help) sed -n '4,/^set/{/^#/s/^# \{0,1\}//p}' "$0" && exit ;;
    -*) fail "unknown option '$1'" ;;
    *) break ;;
  esac
done
[ $# -eq 1 ] || fail "expected the folder of the packages"
packages=("$1"/*.deb)
[ -e "${packages[0]}" ] || fail "expected packages in '$1'; make packages makes them"
as_root ${folder:+--folder "$folder"} ${keep:+--keep} "$1"

step() {
  echo "check-packages: $1"
  inside "set -euo pipefail; cd /checked; $2"
}

open_root
rm -rf "$root/checked"
mkdir "$root/checked" "$root/checked/packages"
cp "${packages[@]}" "$root/checked/packages"
cp "$source"/utils/{check-tutorial,install-documents,document_links,tool}.py "$root/checked"
readonly install='env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends'
readonly doc=/usr/share/doc/piko

step 'install' "apt-get update -q; $install --allow-downgrades --reinstall ./packages/*.deb"
step 'every library is found' \
  'for file in /usr/bin/piko* /usr/lib/libpiko*.so.* /usr/lib/piko/modules/*.so \
       /usr/lib/python3/dist-packages/piko/*.so; do
     ! ldd "$file" | grep "not found"
   done'
step 'what others need' "$install cmake g++ make python3 libmlir-22-dev llvm-22-dev mlir-22-tools \
  glmark2-data openmpi-bin man-db bash-completion zsh lintian"

step 'documents lead to what is installed' "python3 install-documents.py --check $doc"
step 'an application, as the tutorial makes it' \
  "python3 check-tutorial.py --piko /usr --work tutorial $doc/docs/Tutorial.md"
step 'a pass out of tree' \
  "cp -r $doc/examples/out-of-tree .
   cp tutorial/spheres.piko.cpp out-of-tree
   awk '/^\`\`\`sh/ {inside = 1; next} /^\`\`\`/ {inside = 0} inside' \
     $doc/docs/OutOfTree.md >out-of-tree/commands.sh
   (cd out-of-tree && PIKO=/usr sh -e commands.sh)
   grep -q 'bins \[16, 16\]' out-of-tree/larger.mlir"
# As root, and with more processes than cores.
readonly mpi='export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
  OMPI_MCA_rmaps_base_oversubscribe=1'
step 'an application in several processes' \
  "$mpi; python3 check-tutorial.py --piko /usr --work disks $doc/docs/Scale.md
   mpirun -np 2 piko-render --mpi $doc/examples/raster/raster.piko.cpp --pipe Fused \
     /usr/share/glmark2/models/bunny.obj --width 320 --height 240 --warmup 0 --frames 1"
step 'the bunny' \
  "piko-render $doc/examples/raster/raster.piko.cpp --pipe Fused \
     /usr/share/glmark2/models/bunny.obj --width 1024 --height 768 --out bunny.png
   piko-render $doc/examples/raster/raster.piko.cpp --pipe Fused \
     /usr/share/glmark2/models/bunny.obj --width 1024 --height 768 --out reference.png \
     --target reference --warmup 0 --frames 1
   piko-diff reference.png bunny.png --fail-above 0"
step 'the bunny from Python' \
  "cp $doc/examples/python/bunny.py .
   time python3 bunny.py $doc/examples/raster/raster.piko.cpp /usr/share/glmark2/models/bunny.obj \
     python.ppm
   head -c 15 python.ppm | grep -aq '^P6'"
step 'manual pages and completion' \
  "man --warnings -E UTF-8 -l /usr/share/man/man1/pikoc.1.gz 2>&1 >pikoc.txt | (! grep .)
   grep -q -e --header pikoc.txt
   for file in /usr/share/zsh/vendor-completions/_piko*; do zsh -n \"\$file\"; done
   bash -c '. /usr/share/bash-completion/bash_completion
     _completion_loader pikoc || true
     COMP_WORDS=(pikoc --targ) COMP_CWORD=1
     _pikoc; echo \"\${COMPREPLY[@]}\"' | grep -qx -e --target"
# They are not uploaded to Debian, where a first upload closes a bug.
step 'lintian' "lintian --tag-display-limit 0 --fail-on error,warning --allow-root \
  --suppress-tags initial-upload-closes-no-bugs packages/*.deb"
step 'take them away' \
  'names=$(for file in packages/*.deb; do dpkg-deb --field "$file" Package; done)
   apt-get purge -q -y $names
   ! ls -d /usr/bin/piko* /usr/include/piko* /usr/include/Piko /usr/lib/libpiko* \
     /usr/lib/piko /usr/lib/cmake/Piko /usr/share/doc/*piko* 2>/dev/null'
echo "check-packages: all is well"
