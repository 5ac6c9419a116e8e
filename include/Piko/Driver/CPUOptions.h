// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What kernels are made for on a CPU.

#ifndef PIKO_DRIVER_CPUOPTIONS_H
#define PIKO_DRIVER_CPUOPTIONS_H

#include <cstdint>

namespace piko {

struct CPUOptions {
  /// Lanes of a vector, 4, 8 or 16: as many numbers of 32 bits as a register of
  /// the processor holds.
  int64_t lanes = 16;
  /// For who fits the cost model: see piko-plan-vectors.
  bool printsSensitivities = false;
  /// Merges nests of loops where that is expected to take no more than this
  /// share of what else does; for tests, more than 1.
  double mergeGain = 0.9;
};

} // namespace piko

#endif // PIKO_DRIVER_CPUOPTIONS_H
