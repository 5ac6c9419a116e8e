// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Registers.h - How many registers a thread may have -------*- C++ -*-===//

#ifndef PIKO_LIB_CONVERSION_GPUTONVVM_REGISTERS_H
#define PIKO_LIB_CONVERSION_GPUTONVVM_REGISTERS_H

#include <cstdint>

namespace piko {

/// With this many, half of the threads that a multiprocessor can have find
/// room.
constexpr int32_t halfOccupancyRegisters = 64;

} // namespace piko

#endif // PIKO_LIB_CONVERSION_GPUTONVVM_REGISTERS_H
