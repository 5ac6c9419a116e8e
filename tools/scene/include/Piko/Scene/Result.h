//===- Result.h - Results of what scenes and pictures need ------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_RESULT_H
#define PIKO_SCENE_RESULT_H

#include "Piko/Support/Result.h"

namespace piko::render {

using support::Done;
using support::Error;
using support::Result;

} // namespace piko::render

#endif // PIKO_SCENE_RESULT_H
