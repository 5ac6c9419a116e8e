//===- Work.h - How much a frame does, and how much it must -----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A frame is counted twice, by programs that are compiled for it: what the text
// of each stage does (piko-count-work), which is the same on every machine and
// number of threads; and what lanes the code uses (piko-count-lanes).
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_PIKORENDER_WORK_H
#define PIKO_TOOLS_PIKORENDER_WORK_H

#include "Frame.h"

#include "Piko/Scene/Json.h"

#include <map>

namespace piko::render {

/// What the text of a stage does.
struct StageWork {
  std::string name;
  int64_t calls = 0, floats = 0, integers = 0;
  int64_t updates = 0, emissions = 0;
  int64_t primitives = 0; ///< That came in; calls are for each of their bins.
  /// Elements of state that the stage or those after it write, each once:
  /// pixels of the picture, or entries of a buffer. No more calls than these
  /// are needed; at most `calls`.
  int64_t least = 0;
  bool takesList = false; ///< It is called for each bin, not each primitive.

  int64_t operations() const { return floats + integers; }
};

struct EdgeWork {
  std::string from, to;
  int32_t port = 0;
  int64_t primitives = 0;
  int64_t bytes = 0;  ///< If each were stored as the text has it.
  int64_t stored = 0; ///< That the code stores, by the edge's primitives.
};

struct AccessWork {
  std::string stage, state;
  int32_t kind = 0; ///< pikort_counter_kind
  int64_t count = 0, bytes = 0;
  int64_t distinct = 0, distinctBytes = 0; ///< Each once.
};

struct LoopWork {
  std::string stage, place;
  bool isParallel = false;
  int64_t iterations = 0;
  int64_t around = 0; ///< Iterations of the loop around, or calls of the stage.
  /// Emissions, updates and atomics whose innermost loop it is.
  int64_t effects = 0;
};

/// What code does: operations on scalars and on vectors, the lanes of these,
/// and how many of them are at work.
struct CodeWork {
  int64_t scalars = 0, vectors = 0, lanes = 0, active = 0;
};

/// What the code of a kernel does.
struct KernelWork {
  std::string name;
  CodeWork all;
  CodeWork outside;                      ///< Of loops.
  std::map<std::string, CodeWork> loops; ///< Without those inside, by place.
};

struct Work {
  std::vector<StageWork> stages;
  std::vector<EdgeWork> edges;
  std::vector<AccessWork> accesses;
  std::vector<LoopWork> loops;
  std::vector<KernelWork> kernels;
};

/// Compiles the pipeline for counting and counts a frame of the scene. `timed`
/// has run: what it stored is its own.
Result<Work> measureWork(const Options &options, SceneInput &scene,
                         pikort_pipeline *timed);

/// The same for programs: what is needed is beside what is done.
Json reportWork(const Work &work);

/// The same for people: tables.
std::string printWork(const Work &work, int64_t pixels);

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_WORK_H
