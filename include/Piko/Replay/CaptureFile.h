// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Files that pikort_capture has written.

#ifndef PIKO_REPLAY_CAPTUREFILE_H
#define PIKO_REPLAY_CAPTUREFILE_H

#include "Piko/Support/Result.h"

#include "pikort/capture.h"

#include <string>

namespace piko::replay {

/// Whether there is a file that begins as captures do.
bool isCaptureFile(const std::string &path);

/// "cannot read capture 'PATH': " and why.
support::Result<rt::Capture> readCapture(const std::string &path);

} // namespace piko::replay

#endif // PIKO_REPLAY_CAPTUREFILE_H
