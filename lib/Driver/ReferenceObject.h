// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The reference executor of a file as an object, through the cache. It takes
// two steps, so that it is compiled again only where Clang would make something
// else: the frontend describes the file's pipelines to the runtime, in C++, and
// Clang compiles that after the file. What the first step gave is kept as long
// as the frontend is the same; of the second, the key is Clang, what it is
// given, and the files that it reads. No pass of Piko's is in either.

#ifndef PIKO_LIB_DRIVER_REFERENCEOBJECT_H
#define PIKO_LIB_DRIVER_REFERENCEOBJECT_H

#include "Cache/SourceRecorder.h"
#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Frontend/PipelineDescription.h"
#include "Piko/Target/Processor.h"

#include <functional>

namespace piko {

/// All pipelines of a file, for who has parsed it for more than this. Reads
/// files through the recorder, and adds to the diagnostics.
using PipelineDescriber = std::function<std::vector<PipelineDescription>(
    llvm::IntrusiveRefCntPtr<SourceRecorder> files, std::string &diagnostics)>;

/// Like compileObject. `describeAll`, where there is one, takes the place of
/// reading all pipelines of the file.
std::optional<CompiledObject>
compileReferenceObject(const ObjectOptions &options, std::string &diagnostics,
                       const PipelineDescriber &describeAll = nullptr);

} // namespace piko

#endif // PIKO_LIB_DRIVER_REFERENCEOBJECT_H
