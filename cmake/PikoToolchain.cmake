# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# One LLVM release, pinned; MLIR, LLVM and Clang are linked as the shared
# libraries that Debian packages.
set(PIKO_LLVM_VERSION 22)
set(PIKO_LLVM_PREFIX /usr/lib/llvm-${PIKO_LLVM_VERSION} CACHE PATH
    "Where LLVM, MLIR and Clang are installed")
list(PREPEND CMAKE_PREFIX_PATH ${PIKO_LLVM_PREFIX})

find_program(PIKO_CCACHE ccache)
if(NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Clang takes a tenth less time where glibc asks the kernel for huge pages, and the
  # dialect, which is the largest file, half of it where the heap grows by many at once.
  string(CONCAT PIKO_COMPILER_TUNABLES glibc.malloc.hugetlb=1
    :glibc.malloc.top_pad=0x10000000 :glibc.malloc.mmap_threshold=0x40000000)
  set(PIKO_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env GLIBC_TUNABLES=${PIKO_COMPILER_TUNABLES})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${PIKO_COMPILER_LAUNCHER})
  if(PIKO_CCACHE)
    set(CMAKE_C_COMPILER_LAUNCHER ${PIKO_CCACHE})
    # What is in a precompiled header is known by a checksum beside it.
    list(APPEND CMAKE_CXX_COMPILER_LAUNCHER
      CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_PCH_EXTSUM=true ${PIKO_CCACHE})
  endif()
endif()

set(PIKO_SANITIZE "" CACHE STRING
    "Sanitizers for everything, as -fsanitize takes them")
if(PIKO_SANITIZE)
  set(PIKO_SANITIZE_FLAGS -fsanitize=${PIKO_SANITIZE} -fno-omit-frame-pointer
    -fno-sanitize-recover=undefined
    # LLVM, MLIR and Clang are built without the type information that vptr
    # checks compare. A function check reads the eight bytes before a function,
    # which are not mapped where the JIT puts a function first.
    -fno-sanitize=vptr,function)
  set(PIKO_SANITIZE_LINK_FLAGS -fsanitize=${PIKO_SANITIZE})
  add_library(piko_sanitizer_options OBJECT ${CMAKE_CURRENT_LIST_DIR}/SanitizerOptions.cpp)
  if(PIKO_SANITIZE MATCHES thread)
    # Only the runtime is instrumented, and the code that the compiler makes:
    # the compiler's threads wait for each other in libLLVM, unseen.
    set(PIKO_RUNTIME_FLAGS ${PIKO_SANITIZE_FLAGS} -gline-tables-only)
    # OpenMP's runtime looks for this tool in the program.
    find_library(PIKO_ARCHER archer PATHS ${PIKO_LLVM_PREFIX}/lib REQUIRED)
    list(APPEND PIKO_SANITIZE_LINK_FLAGS
      LINKER:--push-state,--no-as-needed ${PIKO_ARCHER} LINKER:--pop-state
      LINKER:-rpath,${PIKO_LLVM_PREFIX}/lib)
  else()
    add_compile_options(${PIKO_SANITIZE_FLAGS})
  endif()
  add_link_options(${PIKO_SANITIZE_LINK_FLAGS})
endif()

find_package(OpenMP REQUIRED COMPONENTS CXX)

if(PIKO_ENABLE_COMPILER)
  find_package(MLIR REQUIRED CONFIG
    PATHS ${PIKO_LLVM_PREFIX}/lib/cmake/mlir NO_DEFAULT_PATH)
  if(NOT LLVM_VERSION_MAJOR EQUAL PIKO_LLVM_VERSION)
    message(FATAL_ERROR
      "expected LLVM ${PIKO_LLVM_VERSION}, but got ${LLVM_VERSION}")
  endif()
  list(APPEND CMAKE_MODULE_PATH ${MLIR_CMAKE_DIR} ${LLVM_CMAKE_DIR})
  include(TableGen)
  include(AddLLVM)
  include(AddMLIR)
  set(PIKO_CLANG_RESOURCE_DIR
      ${PIKO_LLVM_PREFIX}/lib/clang/${PIKO_LLVM_VERSION})
endif()
