// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Counts.h - Counts of kernels ---------------------------------------===//

#ifndef PIKO_TEST_DRIVER_COUNTS_H
#define PIKO_TEST_DRIVER_COUNTS_H

#include "TestDriver.h"
#include "ptx/Machine.h"

#include <string>

namespace piko::testdriver {

/// Adds what a launch did.
void addCounts(const ptx::Launch &launch, PikoTestDriverCounts &counts);

void addCounts(const PikoTestDriverCounts &more, PikoTestDriverCounts &sum);

/// A line for a reader.
std::string describeCounts(const PikoTestDriverCounts &counts);

/// Objects of JSON, with a member for each of the counts.
std::string toJSON(const PikoTestDriverCounts &counts);
std::string toJSON(const PikoTestDriverHostCounts &counts);

} // namespace piko::testdriver

#endif // PIKO_TEST_DRIVER_COUNTS_H
