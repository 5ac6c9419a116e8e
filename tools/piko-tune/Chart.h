//===- Chart.h - Error against time, as SVG ---------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Written without a library: piko-tune is installed where there may be neither
// Python nor matplotlib, and each point of the SVG says its setting to who
// points at it, which matplotlib's do not.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_PIKOTUNE_CHART_H
#define PIKO_TOOLS_PIKOTUNE_CHART_H

#include "Report.h"

namespace piko::tune {

/// A point for each setting that rendered a full image: milliseconds to the
/// right, the error upwards; a line along those that no other one beats in
/// both, and a dashed one at the error that is allowed. Points have titles.
std::string drawChart(const TuneResult &result);

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_CHART_H
