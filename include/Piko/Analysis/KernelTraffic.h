// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a kernel's text reads and writes of memory that all blocks see.

#ifndef PIKO_ANALYSIS_KERNELTRAFFIC_H
#define PIKO_ANALYSIS_KERNELTRAFFIC_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include <string>
#include <vector>

namespace piko {

/// Bytes that are moved whenever the work runs, and at most.
struct ByteRange {
  int64_t least = 0, most = 0;
  void add(int64_t bytes, bool always) {
    least += always ? bytes : 0;
    most += bytes;
  }
};

/// One time through a piece of a kernel, without the pieces inside of it.
struct TrafficPart {
  std::string per; ///< Such as "primitive of setup".
  unsigned depth = 0;
  ByteRange reads, writes;
  /// Of numbers that are changed indivisibly: read and written.
  ByteRange atomics;
};

/// A record that goes out of a port.
struct TrafficEmission {
  int64_t port = 0, bytes = 0;
  std::string consumer; ///< Empty: nobody takes it.
  bool isLocal = false; ///< It stays in its block.
};

struct KernelTraffic {
  std::string kernel;
  std::vector<TrafficPart> parts; ///< Outer ones first.
  std::vector<TrafficEmission> emissions;
  std::vector<std::string> placements; ///< Stages into whose bins it puts.
  std::vector<std::string> unknown;    ///< Operations, by their names.
};

/// Of a kernel at the machine level. A field of a primitive counts once for the
/// primitive, an element of state for each access whose indices differ.
/// Constants, which lanes share, and arrays of a call are not counted; of
/// tiles, which a block keeps, that they are read and written back.
KernelTraffic findKernelTraffic(KernelOp kernel);

} // namespace piko

#endif // PIKO_ANALYSIS_KERNELTRAFFIC_H
