// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pipelines that were compiled ahead of time, from a shared library of pikoc's
// objects. No LLVM in it.

#ifndef PIKO_LIB_DRIVER_LIBRARYLOADER_H
#define PIKO_LIB_DRIVER_LIBRARYLOADER_H

#include "Piko/Driver/PipelineLoader.h"

namespace piko {

/// As loadPipeline, of a library.
std::unique_ptr<LoadedProgram> loadFromLibrary(const std::string &file,
                                               const LoadOptions &options,
                                               std::string &diagnostics);

} // namespace piko

#endif // PIKO_LIB_DRIVER_LIBRARYLOADER_H
