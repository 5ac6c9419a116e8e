//===- Mappings.cpp - Which versions of loops run -------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Mappings.h"

#include <cstdio>

using namespace piko;

std::vector<pikort_mapping_info>
render::readMappings(pikort_pipeline *pipeline) {
  std::vector<pikort_mapping_info> mappings;
  for (int32_t i = 0; i < pikort_mapping_count(pipeline); ++i) {
    pikort_mapping_info info;
    if (pikort_get_mapping(pipeline, i, &info) == PIKORT_OK)
      mappings.push_back(info);
  }
  return mappings;
}

const char *render::nameVersion(bool isVectors) {
  return isVectors ? "vectors" : "scalar";
}

const char *render::explainMapping(const pikort_mapping_info &info) {
  switch (info.state) {
  case PIKORT_MAPPING_TRIED:
    return "not yet measured enough";
  case PIKORT_MAPPING_MEASURED:
    return "measured";
  case PIKORT_MAPPING_FIXED:
    return "fixed";
  default:
    return "expected";
  }
}

std::string render::printMappings(pikort_pipeline *pipeline) {
  std::string all;
  for (const pikort_mapping_info &info : readMappings(pipeline)) {
    char ratios[96];
    int length =
        std::snprintf(ratios, sizeof ratios, "; expected %.2f of scalar's time",
                      info.expected_ratio);
    if (info.measured_ratio > 0)
      std::snprintf(ratios + length, sizeof ratios - size_t(length),
                    ", measured %.2f", info.measured_ratio);
    all += std::string("  ") + info.kernel + ":" + std::to_string(info.number) +
           " (" + info.loop + ") runs as " +
           (info.vectors ? "vectors" : "a scalar loop") + ": " +
           explainMapping(info) + ratios + "\n";
  }
  return all.empty() ? all
                     : "loops held as vectors and as scalar loops:\n" + all;
}

std::string render::writeMappings(pikort_pipeline *pipeline) {
  std::string all;
  for (const pikort_mapping_info &info : readMappings(pipeline))
    all += (all.empty() ? "" : ",") + std::string(info.kernel) + ":" +
           std::to_string(info.number) + "=" + nameVersion(info.vectors);
  return all;
}
