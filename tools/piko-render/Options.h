//===- Options.h - The command line of piko-render --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKORENDER_OPTIONS_H
#define PIKO_TOOLS_PIKORENDER_OPTIONS_H

#include "Piko/CommandLine/CommandLine.h"
#include "Piko/Driver/PipelineLoader.h"
#include "Piko/Scene/View.h"

#include <string>

namespace piko::render {

struct Options {
  std::string help; ///< the text, if that is asked for
  std::string pipeline, scene;
  std::string sizeOption;  ///< the first one that captures do not have
  std::string sceneOption; ///< the first one that only scenes have
  LoadOptions load;
  std::string tuned; ///< the file of a setting that piko-tune wrote
  ViewOptions view;
  int lights = 1;
  bool cull = false;
  bool ground = false;
  std::vector<std::pair<std::string, std::string>> values; ///< of constants
  std::vector<std::string> fix; ///< what to specialize the pipeline for
  int threads = 0;
  int ranks = 0; ///< in threads; 0 = one, or what $PIKO_RANKS says
  bool usesMPI = false;
  double rankSeconds = 60; ///< that an exchange may take
  int64_t memoryBudget = 0, stripSize = 0;
  int warmup = 5, frames = 30;
  int reruns = 0; ///< more frames, whose pictures must be that of the last
  double seconds = 1000;
  std::vector<std::string> images; ///< to write
  std::string mappings; ///< as pikort_set_mappings takes it; "" = unsaid
  std::vector<std::string> against; ///< targets that must give the same
  double tolerance = 0;  ///< relative, where stages need not be strict
  std::string trace;     ///< where to write which thread ran which bins
  bool counters = false; ///< count the work of one more frame
  bool explain = false;
  bool json = false, kernelTimes = false;
  bool quiet = false; ///< no summary
};

/// The image's size, and how a scene is seen and lit, which a renderer beside
/// Piko has, too.
void addSizeOptions(CommandLine &line, Options &options);
void addViewOptions(CommandLine &line, Options &options);

/// Those, what is rendered, and how it is run, which piko-tune has, too.
void addSceneOptions(CommandLine &line, Options &options);

/// Whether what was read is fine together; returns what is wrong, or nothing.
std::string checkOptions(const CommandLine &line, Options &options);

/// Reads the command line, without the program's name.
Result<Options> parseOptions(const std::vector<std::string> &words);

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_OPTIONS_H
