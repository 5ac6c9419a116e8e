//===- mapping.h - Where the stages of a pipeline run ---------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What can be changed about a pipeline without changing its results, but for
// the last bits if its precision is not strict.
//
//===----------------------------------------------------------------------===//
#ifndef COMMON_MAPPING_H
#define COMMON_MAPPING_H

#include <piko.h>

namespace raster {

/// How stages that share their bins are mapped: the first one and the rest,
/// which take its primitives further.
struct Mapping {
  int bin = 0; ///< side of a bin in pixels; 0: one bin is the whole screen
  piko::SchedulePolicy core = piko::LoadBalance;
  piko::SchedulePolicy rest = core; ///< of the stages behind the second one
  int64_t split = 0;                ///< how many primitives `All` cores share
  bool apart = true;  ///< whether stages after the first ask for a core
  bool waits = false; ///< whether shading begins when a bin is complete
  piko::Precision precision = piko::Precision::Strict; ///< of shading
};

} // namespace raster

#endif // COMMON_MAPPING_H
