#!/bin/bash
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# Packs what it takes to try pipelines on a machine with a card that has NVIDIA's
# driver, Python and a C++ library's headers, and nothing of LLVM.
#
#   utils/gpu-kit/make.sh [--build FOLDER] [--scene FILE].. OUT
#
# OUT gets run.sh, cases.py, frames.py and, to be unpacked by run.sh, tools.tar.xz
# (piko-compare and piko-render, linked statically with LLVM, 50 MB) and rest.tar.xz.
# They are unpacked to the folders that they have here, which the tools know: it is a
# kit for machines that are thrown away. Takes four minutes.
set -euo pipefail

fail() {
  echo "gpu-kit: $*" >&2
  exit 1
}

here="$(cd "$(dirname "$0")" && pwd)"
build="$(cd "$here/../.." && pwd)/build" out="" scenes=()
while [ $# -gt 0 ]; do
  case "$1" in
    --build) build="$(cd "$2" && pwd)" && shift ;;
    --scene) scenes+=("$(realpath "$2")") && shift ;;
    -*) fail "unknown option $1" ;;
    *) out="$1" ;;
  esac
  shift
done
[ -n "$out" ] || fail "expected a folder to write to"
for tool in piko-compare piko-render PikoConformance-cuda; do
  [ -x "$build/bin/$tool" ] || fail "expected $tool in $build/bin"
done
mkdir -p "$out"
out="$(cd "$out" && pwd)"
stage="$(mktemp -d)"
trap 'rm -rf "$stage"' EXIT

# Whose folders the tools know.
root="$(sed -n 's/^CMAKE_HOME_DIRECTORY:[A-Z]*=//p' "$build/CMakeCache.txt")"
llvm="$(sed -n 's/^PIKO_LLVM_PREFIX:[A-Z]*=//p' "$build/CMakeCache.txt")"
[ -n "$llvm" ] || llvm=/usr/lib/llvm-22
# Clang asks Polly for its passes, which Debian's archives lack.
cat >"$stage/absent.cpp" <<'END'
#if __has_include(<llvm/Plugins/PassPlugin.h>)
#include <llvm/Plugins/PassPlugin.h>
#else
#include <llvm/Passes/PassPlugin.h>
#endif
llvm::PassPluginLibraryInfo getPollyPluginInfo() {
  return {LLVM_PLUGIN_API_VERSION, "none", "0", [](llvm::PassBuilder &) {}};
}
END
"$llvm/bin/clang++" -std=c++20 -fno-rtti -I "$llvm/include" \
  -c "$stage/absent.cpp" -o "$stage/absent.o"
shared() { # the library of a name that programs are run with
  ldconfig -p | awk -v name="$1" '$1 == name && !found++ { print $NF }'
}
list() { # libraries of a prefix, without those that are programs' or tests'
  find "$llvm/lib" -name "$1*.a" | grep -vE "$2" | sort
}
archives=()
while IFS= read -r file; do archives+=("$file"); done < <(
  list libclang 'clang(d|_|Tidy|Daemon|Doc|Include|Apply|Change|Move|Query|Reorder|\.a)'
  list libMLIR '[Tt]est|ExecutionEngine|Lsp|_runner|CAPI'
  list libLLVM 'Testing|Fuzz'
)
others=()
for name in libz.so.1 libzstd.so.1 libz3.so.4 libxml2.so.2 libedit.so.2 libffi.so.8; do
  others+=("$(shared "$name")")
done

# The tool as the build links it, but for LLVM, which comes from archives.
link_tool() {
  local words=() word command
  command="$(ninja -C "$build" -t commands "bin/$1" | tail -n 1)"
  command="${command#: && }"
  for word in ${command% && :}; do
    case "$word" in
      "$llvm"/lib/lib*.so* | */libLLVM*.so* | -Wl,-rpath,*) ;;
      "bin/$1") words+=("$stage/bin/$1") ;;
      *) words+=("$word") ;;
    esac
  done
  (cd "$build" && "${words[@]}" "$stage/absent.o" -Wl,--gc-sections -Wl,-s \
    -Wl,--icf=all -Wl,--start-group "${archives[@]}" -Wl,--end-group "${others[@]}" \
    "-Wl,-rpath,$build/lib" '-Wl,--export-dynamic-symbol=piko*')
}
mkdir -p "$stage/bin"
for tool in piko-compare piko-render; do
  link_tool "$tool"
done

# What the tools are run with, but for what every machine has.
copy() {
  local to
  for file in "$@"; do
    to="$stage/root$(dirname "$(realpath -s "$file")")"
    mkdir -p "$to" && cp -rL "$file" "$to/"
  done
}
kit_lib="$stage/root/opt/piko-kit/lib"
mkdir -p "$kit_lib"
for tool in "$stage"/bin/*; do ldd "$tool"; done | awk '$3 ~ /^\// { print $3 }' |
  sort -u | grep -vE '/(libc|libm|libstdc\+\+|libgcc_s)\.so|libpikort' |
  while IFS= read -r file; do cp -L "$file" "$kit_lib/"; done
# Of these two programs call nothing: their functions and data are absent.
nm -D --undefined-only "$stage"/bin/* | awk '$NF ~ /^Z3_/ { print "void " $NF "(void){}" }' |
  sort -u | gcc -shared -x c - -o "$kit_lib/libz3.so.4" -Wl,-soname,libz3.so.4
for file in "$kit_lib"/libicudata.so.*; do
  name="$(basename "$file")"
  echo "const char icudt${name##*.}_dat[64] = {0};" |
    gcc -shared -x c - -o "$file" "-Wl,-soname,$name"
done
strip "$kit_lib"/*.so*
copy "$build/lib/libpikort.so" "$build/lib/libpiko-test-driver.so" \
  "$build/bin/PikoConformance-cuda" \
  "$root/runtime/include" "$root/examples" "$root/test/EndToEnd" \
  "$("$llvm/bin/clang" -print-resource-dir)/include" /usr/include/glm
mkdir -p "$stage/root/opt/piko-kit/scenes"
for scene in "${scenes[@]}"; do
  cp "$scene" "$stage/root/opt/piko-kit/scenes/"
done
cat >"$stage/root/opt/piko-kit/environment" <<END
export PIKO_KIT_ROOT="$root" PIKO_KIT_BUILD="$build"
export LD_LIBRARY_PATH=/opt/piko-kit/lib PIKO_CACHE_DIR=/tmp/piko-cache
export CUDA_CACHE_PATH=/tmp/cuda-cache CUDA_CACHE_MAXSIZE=4294967296
END

# One dictionary for both tools, which are much the same.
tar c -C "$stage/bin" . | xz --x86 --lzma2=preset=9,dict=256MiB >"$out/tools.tar.xz" &
tar c -C "$stage/root" . | xz -6 >"$out/rest.tar.xz"
wait
cp "$here"/run.sh "$here"/cases.py "$here"/frames.py "$out/"
ls -l "$out"
