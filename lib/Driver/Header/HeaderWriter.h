// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The C++ header that an application includes to run a compiled pipeline.

#ifndef PIKO_LIB_DRIVER_HEADERWRITER_H
#define PIKO_LIB_DRIVER_HEADERWRITER_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include <string>

namespace piko {

/// The text of the header for a pipeline of the authored level: a class in the
/// namespace, with the records, state and sources that the host sees.
std::string writeHostHeader(PipelineOp pipeline, llvm::StringRef file,
                            llvm::StringRef nameSpace);

} // namespace piko

#endif // PIKO_LIB_DRIVER_HEADERWRITER_H
