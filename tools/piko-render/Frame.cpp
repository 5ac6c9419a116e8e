//===- Frame.cpp - A pipeline that is bound to a scene --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Frame.h"

#include <cstdio>

using namespace piko;
using namespace piko::render;

Result<Frame> Frame::load(const Options &options) {
  std::string diagnostics;
  Frame frame;
  frame.program = loadPipeline(options.pipeline, options.load, diagnostics);
  if (!frame.program && diagnostics.empty())
    return Error{"cannot load pipeline '" + options.pipeline + "'"};
  std::fputs(diagnostics.c_str(), stderr);
  if (!diagnostics.empty() && diagnostics.back() != '\n')
    std::fputc('\n', stderr);
  if (!frame.program)
    return Error{}; // already said
  return frame;
}

Result<Done> Frame::bind(const Options &options, SceneInput &scene) {
  int32_t code = pikort_create(&program->get(), &owned);
  int64_t extent[] = {options.view.width, options.view.height};
  if (code != PIKORT_OK || pikort_set_domain(owned, 2, extent) != PIKORT_OK ||
      pikort_set_threads(owned, options.threads) != PIKORT_OK ||
      pikort_set_memory_budget(owned, options.memoryBudget) != PIKORT_OK ||
      pikort_set_strip_size(owned, options.stripSize) != PIKORT_OK)
    return Error{pikort_message(owned)};
  auto bound = bindScene(owned, scene);
  if (!bound)
    return bound.error();
  output = *bound;
  return Done{};
}

Result<Done> Frame::run() {
  if (pikort_run(owned) != PIKORT_OK)
    return Error{pikort_message(owned)};
  return Done{};
}
