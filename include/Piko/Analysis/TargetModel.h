// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What passes expect of the processors that they write for. Costs of operations
// are in lib/Transforms/Vectorize/Cost; limits of single chips, which the text
// of a kernel does not depend on, in lib/Target/NVPTX/KernelResources.cpp.

#ifndef PIKO_ANALYSIS_TARGETMODEL_H
#define PIKO_ANALYSIS_TARGETMODEL_H

#include <cstdint>

namespace piko {

//===----------------------------------------------------------------------===//
// CPUs
//===----------------------------------------------------------------------===//

/// Of a cache line, in bytes.
constexpr int64_t lineSize = 64;

/// What a core has of a cache of the second level, and of the third one, in
/// bytes: state that is larger is read ahead.
constexpr int64_t secondLevelBytes = 1 << 20, thirdLevelBytes = 4 << 20;

/// Lanes of 32 bits of the widest vectors, and their bits; such processors have
/// registers for two vectors of each number.
constexpr int64_t widestLanes = 16;
constexpr unsigned widestVectorBits = 512;

//===----------------------------------------------------------------------===//
// GPUs
//===----------------------------------------------------------------------===//

constexpr int64_t warpSize = 32;

/// What a block has on each of them: threads, and bytes of shared memory that
/// is declared in PTX.
constexpr int64_t maxThreads = 1024, maxSharedBytes = 48 << 10;

/// Shared memory of a block with which a multiprocessor still has enough of
/// them, in bytes.
constexpr int64_t fewSharedBytes = 24 << 10;

/// Registers of a multiprocessor, and the most of a thread.
constexpr int64_t registersOfMultiprocessor = 64 << 10,
                  maxRegistersOfThread = 255;

/// Registers are given to a warp in pieces of so many.
constexpr int64_t registerPiece = 256;

/// With so many, half of the threads that a multiprocessor can have find room.
constexpr int32_t halfOccupancyRegisters = 64;

} // namespace piko

#endif // PIKO_ANALYSIS_TARGETMODEL_H
