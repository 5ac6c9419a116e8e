# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""lit's configuration for Piko.

Tools are found by name: those of this build and LLVM's FileCheck, not and
split-file. Substitutions:

  %piko_include  folder of piko.h
  %examples      folder of the example pipelines
  %benchmarks    folder of the benchmarks
  %bunny         a mesh of 69,666 triangles that a Debian package installs
  %python        the Python interpreter
  %module_python the Python that the Python module is for
  %cache         the cache that tests share, for one that has its own
  %utils, %docs  folders of the developer scripts and of the documents
  %readme        the README
  %cmake         the CMake that configured this build
  %piko          the build tree, which find_package(Piko) can use
  %cxx           the C++ compiler of this build
  %compare_targets
                 piko-compare on all targets, where all tests are asked for; else a
                 case runs on one of them, in turn
  %compare_checked
                 the same on the targets that have checking mode
  %other_cxx     another C++ compiler, where one can use this build's runtime
  %aarch64_cxx   a C++ compiler for AArch64, and %aarch64_run what runs its programs
  %cxx_host      compiler and flags that build a host of compiled pipelines
  %cxx_quick_host
                 the same after the precompiled header that such a host includes
  %link_host     what such a host links
  %llvm_lib      folder of LLVM's libraries
  %qt_include    folder of Qt's headers
  %test_driver   the driver for tests, in place of NVIDIA's
  %test_driver_11  the same without what came with CUDA 12
  %cxx_ptx       compiler and flags that make PTX of a file of CUDA's
  %cxx_reference compiler and flags that build a pipeline file with the
                 reference executor
  %cxx_after_header
                 the same after a precompiled piko.h, for a file that includes
                 it first and whose options it does not depend on

PIKO_TEST_AARCH64=aarch64 has %compare_targets run cases on AArch64 alone.
PIKO_TEST_ALL=1 asks for all tests, as `make check-all` does. Features: `all` where
that is so, `bunny` where that mesh is installed, `gpu` where an NVIDIA driver
is, `aarch64` where Debian's compiler for it and qemu are, `on-aarch64` where
PIKO_TEST_AARCH64 is set, `mpi` where ranks may be processes, `ptxas` where NVIDIA's assembler is, `chromium` and `doxygen`
where these are, `asan` and `tsan` in builds with that sanitizer, `fork-server` where
tools fork.
"""

import atexit
import glob
import os
import platform
import shutil
import subprocess
import sys
import tempfile

import lit.formats

config.name = "Piko"
config.test_format = lit.formats.ShTest(execute_external=False)
config.suffixes = [".mlir", ".cpp", ".test"]
config.excludes = ["Inputs"]
config.test_source_root = os.path.dirname(__file__)
config.test_exec_root = os.path.join(config.piko_binary_root, "test")


def start_fork_server(tools):
    """Folder of stand-ins for `tools` that fork instead of beginning anew.

    Loading LLVM's libraries takes most of a short run's time. The server lasts as
    long as this process."""
    folder = tempfile.mkdtemp(prefix="piko-tests-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for name in ("bin", "tools"):
        os.mkdir(os.path.join(folder, name))
    for tool in tools:
        name = os.path.basename(tool)
        os.symlink(tool, os.path.join(folder, "tools", name))
        os.symlink(fork_server, os.path.join(folder, "bin", name))
    server = subprocess.Popen(
        [fork_server, "--serve", folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    server.stdout.readline()
    atexit.register(server.wait)
    atexit.register(server.stdin.close)  # which ends it
    config.environment["PIKO_FORK_SERVER"] = folder
    return os.path.join(folder, "bin")


all_tests = os.environ.get("PIKO_TEST_ALL", "0") != "0"
path = [config.piko_tools, config.llvm_tools, config.environment["PATH"]]
fork_server = os.path.join(config.test_exec_root, "support/fork-server/fork-server")
if not all_tests and not config.sanitize and os.path.exists(fork_server):
    config.available_features.add("fork-server")
    kinds = "compare diff import opt render test-opt translate tune".split()
    tools = ["pikoc"] + ["piko-" + kind for kind in kinds]
    tools = [os.path.join(config.piko_tools, tool) for tool in tools]
    path.insert(0, start_fork_server(tools + [config.cxx]))
    config.cxx = os.path.join(path[0], os.path.basename(config.cxx))
config.environment["PATH"] = os.path.pathsep.join(path)
for name in ("OMP_NUM_THREADS", "ASAN_OPTIONS", "TSAN_OPTIONS", "HOME",
             "PIKO_TEST_DRIVER_MODES"):
    if name in os.environ:
        config.environment[name] = os.environ[name]

# More threads than cores: to wait must not cost time.
config.environment["OMP_WAIT_POLICY"] = "passive"

# What the tests compile is kept apart from the user's own.
config.environment["PIKO_CACHE_SIZE"] = str(2 << 30)
config.environment["PIKO_CACHE_DIR"] = os.path.join(
    config.test_exec_root, "cache"
)

bunny = "/usr/share/glmark2/models/bunny.obj"
include = os.path.join(config.piko_source_root, "runtime", "include")
reference = [config.cxx, *config.reference_flags, "-I", include]
after_header = reference + (
    ["-include-pch", config.reference_header] if config.reference_header else []
)
host = [config.cxx, *config.host_flags, "-Wall -Wextra -Werror -I", include]
quick_host = host + (["-include-pch", config.host_header] if config.host_header else [])
# Kernels of an application's own, in CUDA C++, without a toolkit.
ptx = [os.path.join(config.llvm_tools, "clang++"), "-x cuda -std=c++20 -O2 -S"]
ptx += ["--cuda-device-only --cuda-gpu-arch=sm_70 -nocudainc -nocudalib"]
# A toolkit that Clang finds would say which PTX; the one that there is not gives
# every machine the same, and sm_70 takes no PTX before 6.0.
ptx += ["--cuda-path=/nonexistent --cuda-feature=+ptx63"]
ptx += ["-ffp-contract=off -Wno-unknown-cuda-version"]
ptx += ["-include __clang_cuda_builtin_vars.h"]
ptx += [f"'-D__{it}__=__attribute__(({it}))'" for it in ("global", "device", "host")]
library_dir = os.path.join(config.piko_binary_root, "lib")
link_host = ["-fuse-ld=lld", f"-L{library_dir}", f"-Wl,-rpath,{library_dir}", "-lpikort"]
link_host.append(config.openmp_runtime)
other_cxx = "g++"
if config.sanitize:
    options = os.path.join(
        config.piko_source_root, "cmake", "SanitizerOptions.cpp"
    )
    link_host += [f"-fsanitize={config.sanitize}", options]
    # The sanitizer's runtime is the compiler's own.
    other_cxx = config.cxx
    if config.archer:
        link_host += ["-Wl,--no-as-needed", config.archer]
        link_host.append("-Wl,-rpath," + os.path.dirname(config.archer))
targets = ["cpu", "gpu-on-cpu", "cuda"]
if platform.machine() in ("x86_64", "AMD64"):
    targets[1:1] = ["x86-64-v3", "x86-64"]
test_driver = os.path.join(config.piko_binary_root, "lib", "libpiko-test-driver.so")


# The processor that all cases are to run on, under an emulator, in place of all targets.
aarch64 = os.environ.get("PIKO_TEST_AARCH64", "")
aarch64_run = "qemu-aarch64 -L /usr/aarch64-linux-gnu"
aarch64_runner = f"{aarch64_run} {config.piko_binary_root}/aarch64/bin/piko-run-capture"


def compare_on(names):
    if aarch64:
        return f"piko-compare --targets {aarch64} --runner '{aarch64_runner}'"
    command = f"env PIKO_CUDA_DRIVER={test_driver} PIKO_TEST_DRIVER_SEED=2"
    command += f" piko-compare --gpu-threads 32 --targets {','.join(names)}"
    return command if all_tests else command + " --spread"


config.substitutions += [
    ("%compare_targets", compare_on(targets)),
    ("%compare_checked", compare_on(targets[:-1])),
    ("%piko_include", include),
    ("%examples", os.path.join(config.piko_source_root, "examples")),
    ("%benchmarks", os.path.join(config.piko_source_root, "benchmarks")),
    ("%bunny", bunny),
    # A version manager would look for the right one each time.
    ("%python", sys.executable),
    ("%module_python", config.module_python),
    ("%cache", config.environment["PIKO_CACHE_DIR"]),
    ("%qt_include", "".join(glob.glob("/usr/include/*/qt5")[:1])),
    ("%utils", os.path.join(config.piko_source_root, "utils")),
    (
        "%test_driver_11",
        os.path.join(config.piko_binary_root, "lib", "libpiko-test-driver-11.so"),
    ),
    ("%test_driver", test_driver),
    ("%readme", os.path.join(config.piko_source_root, "README.md")),
    ("%docs", os.path.join(config.piko_source_root, "docs")),
    ("%cmake", config.cmake),
    ("%piko", config.piko_binary_root),
    ("%cxx_host", " ".join(host)),
    ("%cxx_quick_host", " ".join(quick_host)),
    ("%link_host", " ".join(link_host)),
    ("%llvm_lib", os.path.dirname(config.openmp_runtime)),
    ("%cxx_reference", " ".join(reference)),
    ("%cxx_after_header", " ".join(after_header)),
    ("%cxx_ptx", " ".join(ptx)),
    ("%cxx", config.cxx),
    ("%other_cxx", other_cxx),
    # What is no machine's own, such as GLM, is there last.
    ("%aarch64_cxx", "aarch64-linux-gnu-g++ -idirafter /usr/include"),
    ("%aarch64_run", aarch64_run),
]

if all_tests:
    config.available_features.add("all")
if os.path.exists(bunny):
    config.available_features.add("bunny")
if shutil.which("aarch64-linux-gnu-g++") and shutil.which("qemu-aarch64"):
    config.available_features.add("aarch64")
if aarch64:
    config.available_features.add("on-aarch64")
if os.path.exists("/dev/nvidiactl"):
    config.available_features.add("gpu")
if platform.machine() in ("x86_64", "AMD64"):
    config.available_features.add("x86_64")
if config.mpirun:
    config.available_features.add("mpi")
# NVIDIA's installers leave PATH as it is.
cuda = os.environ.get("CUDA_HOME", "/usr/local/cuda")
if not shutil.which("ptxas"):
    path.append(os.path.join(cuda, "bin"))
    config.environment["PATH"] = os.path.pathsep.join(path)
if shutil.which("ptxas", path=config.environment["PATH"]):
    config.available_features.add("ptxas")
if shutil.which("chromium"):
    config.available_features.add("chromium")
if shutil.which("doxygen"):
    config.available_features.add("doxygen")
if "address" in config.sanitize:
    config.available_features.add("asan")
if "thread" in config.sanitize:
    config.available_features.add("tsan")
    # The program has this option; Archer looks for it here, and complains.
    config.environment.setdefault(
        "TSAN_OPTIONS", "ignore_noninstrumented_modules=1"
    )
