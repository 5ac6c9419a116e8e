# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# Builds for AArch64 (64-bit Arm) on another Linux machine, with Debian's
# g++-aarch64-linux-gnu: Piko's runtime (PIKO_ENABLE_COMPILER=OFF), and applications with
# pipelines. With qemu-user installed CTest runs what is built.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
# Headers alone, such as GLM's, are the same for all machines.
set(CMAKE_CXX_FLAGS_INIT "-idirafter /usr/include")

# Libraries are AArch64's; programs run on the machine that builds.
set(CMAKE_FIND_ROOT_PATH /usr/aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
# What was installed by these rules, too, wherever it is.
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE BOTH)

find_program(PIKO_QEMU_AARCH64 qemu-aarch64)
mark_as_advanced(PIKO_QEMU_AARCH64)
if(PIKO_QEMU_AARCH64)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${PIKO_QEMU_AARCH64} -L ${CMAKE_FIND_ROOT_PATH})
endif()
