//===- Specialize.h - A pipeline for one scene ------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKORENDER_SPECIALIZE_H
#define PIKO_TOOLS_PIKORENDER_SPECIALIZE_H

#include "Frame.h"

namespace piko::render {

/// The options with the values that `options.fix` names, as a scene has them,
/// in place of the names: `CONSTANT` with all of its fields, `BUFFER.size`,
/// `all` for all constants but cameras and the sizes of small buffers, or
/// `NAME=VALUE`, which stays. The general pipeline, which is bound to the
/// scene, says what there is.
Result<Options> specialize(Options options, pikort_pipeline *general);

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_SPECIALIZE_H
