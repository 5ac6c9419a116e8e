//===- Mappings.h - Which versions of loops run -----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKORENDER_MAPPINGS_H
#define PIKO_TOOLS_PIKORENDER_MAPPINGS_H

#include "pikort/pikort.h"

#include <string>
#include <vector>

namespace piko::render {

/// Of all loops that the code holds in two versions.
std::vector<pikort_mapping_info> readMappings(pikort_pipeline *pipeline);

/// "vectors" or "scalar".
const char *nameVersion(bool isVectors);

/// Why the version runs that does: "measured", "fixed", ...
const char *explainMapping(const pikort_mapping_info &info);

/// A line for each loop, for people; "" if there are none.
std::string printMappings(pikort_pipeline *pipeline);

/// What fixes all loops as they run now: a setting of pikort_set_mappings.
std::string writeMappings(pikort_pipeline *pipeline);

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_MAPPINGS_H
