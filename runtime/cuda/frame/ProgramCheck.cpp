// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ProgramCheck.cpp - Whether a table of steps can be run -------------===//
//
// A frame indexes by what a table says: by numbers of what is declared, by
// members and exits of loops on the device. So each is compared with the
// declarations, from which it follows.
//
//===----------------------------------------------------------------------===//

#include "cuda/frame/ProgramCheck.h"

#include <algorithm>

using namespace piko::cuda;
using namespace piko::rt;

namespace {

class ProgramChecker {
public:
  ProgramChecker(const pikort_pipeline &p, Steps program)
      : p_(p), program_(program) {}

  void run();

private:
  using Step = pikoir_cuda_step;

  size_t indexOf(const Step &step) const {
    return static_cast<size_t>(&step - program_.data());
  }
  std::string nameOf(const Step &step) const {
    return "step " + std::to_string(indexOf(step)) + " of its program";
  }
  [[noreturn]] void fail(const std::string &text) const {
    throw Failure{PIKORT_BAD_PROGRAM,
                  "pipeline " + quoted(p_.name) + ": " + text};
  }
  [[noreturn]] void failUnexpected(const Step &step) const {
    fail("did not expect " + nameOf(step) + ", of kind " +
         std::to_string(step.kind) + " and number " +
         std::to_string(step.number));
  }
  void expect(const Step &step, const char *what, int32_t wanted,
              int32_t got) const {
    if (got != wanted)
      fail(nameOf(step) + ", of kind " + std::to_string(step.kind) +
           " and number " + std::to_string(step.number) + ": expected " + what +
           " " + std::to_string(wanted) + ", but got " + std::to_string(got));
  }

  /// How many things there are of what a step's number counts.
  size_t countOf(int32_t kind) const;
  void checkNumber(const Step &step) const;
  void checkGrids(const Step &step) const;
  void begin(const Step &step);
  void end(const Step &step, int32_t kind);
  // What stands in a loop, or after one of its kernels.
  const Step *openLoop() const;
  const LoopShape &shapeOf(const Step &loop) const {
    return p_.loops[static_cast<size_t>(loop.number)];
  }
  /// Which one of a loop's stages, or -1.
  static int32_t memberOf(const LoopShape &loop, int32_t stage);
  /// By which of its exits primitives of an edge leave a loop; -1: by none.
  int32_t exitOf(const Step &loop, const Edge &edge) const;
  void checkStage(const Step &step) const;
  void checkQueue(const Step &step) const;
  void checkEntry(const Step &step) const;
  void checkExit(const Step &step) const;
  void checkLoop(const Step &loop) const;
  /// The steps of a kind in a loop.
  std::vector<const Step *> stepsOf(const Step &loop, int32_t kind) const;

  const pikort_pipeline &p_;
  Steps program_;
  std::vector<const Step *> open_; ///< What is repeated, where a step stands.
};

} // namespace

size_t ProgramChecker::countOf(int32_t kind) const {
  switch (kind) {
  case PIKOIR_STEP_CLEAR:
    return p_.states.size();
  case PIKOIR_STEP_SOURCE:
    return p_.sources.size();
  case PIKOIR_STEP_STAGE:
  case PIKOIR_STEP_ENTRY:
    return p_.stages.size();
  case PIKOIR_STEP_QUEUE:
  case PIKOIR_STEP_EXIT:
    return p_.edges.size();
  case PIKOIR_STEP_STRIPS:
  case PIKOIR_STEP_END_STRIPS:
    return p_.stripGroups.size();
  case PIKOIR_STEP_WAVES:
  case PIKOIR_STEP_END_WAVES:
    return p_.loops.size();
  case PIKOIR_STEP_ROUNDS:
  case PIKOIR_STEP_END_ROUNDS:
    return p_.cycles.size();
  case PIKOIR_STEP_HOST:
    return 1;
  default:
    return 0;
  }
}

void ProgramChecker::checkNumber(const Step &step) const {
  bool hasGrids =
      step.kind == PIKOIR_STEP_STAGE || step.kind == PIKOIR_STEP_SOURCE;
  if (step.number < 0 ||
      static_cast<size_t>(step.number) >= countOf(step.kind) ||
      hasGrids != (step.grids != nullptr) ||
      (step.kind == PIKOIR_STEP_HOST) != (step.host != nullptr))
    failUnexpected(step);
  bool hasMember =
      step.kind == PIKOIR_STEP_QUEUE || step.kind == PIKOIR_STEP_ENTRY;
  bool hasExit =
      step.kind == PIKOIR_STEP_QUEUE || step.kind == PIKOIR_STEP_EXIT;
  if (!hasMember)
    expect(step, "member", -1, step.member);
  if (!hasExit)
    expect(step, "exit", -1, step.exit);
}

void ProgramChecker::checkGrids(const Step &step) const {
  constexpr int64_t mostThreads = 1024, mostArguments = 4096 / 8;
  for (const pikoir_cuda_grid *grid = step.grids; grid->kernel; ++grid)
    if (grid->threads < 1 || grid->threads > mostThreads || grid->count < 0 ||
        grid->count > mostArguments || !grid->arguments)
      fail(nameOf(step) + ": expected grid '" + grid->kernel +
           "' to have 1 to 1024 threads a block, at most 512 arguments, and a "
           "function that writes them, but got " +
           std::to_string(grid->threads) + " threads and " +
           std::to_string(grid->count) + " arguments");
}

// --- Nesting -----------------------------------------------------------------

/// Strips repeat rounds and waves, and rounds waves.
void ProgramChecker::begin(const Step &step) {
  auto isOpen = [&](int32_t kind) {
    return std::any_of(open_.begin(), open_.end(),
                       [&](const Step *it) { return it->kind == kind; });
  };
  if (isOpen(PIKOIR_STEP_WAVES) ||
      (step.kind != PIKOIR_STEP_WAVES && isOpen(PIKOIR_STEP_ROUNDS)) ||
      (step.kind == PIKOIR_STEP_STRIPS && isOpen(PIKOIR_STEP_STRIPS)))
    failUnexpected(step);
  open_.push_back(&step);
}

void ProgramChecker::end(const Step &step, int32_t kind) {
  if (open_.empty() || open_.back()->kind != kind ||
      open_.back()->number != step.number)
    failUnexpected(step);
  open_.pop_back();
}

// --- Loops -------------------------------------------------------------------

const pikoir_cuda_step *ProgramChecker::openLoop() const {
  bool isInLoop = !open_.empty() && open_.back()->kind == PIKOIR_STEP_WAVES;
  return isInLoop ? open_.back() : nullptr;
}

int32_t ProgramChecker::memberOf(const LoopShape &loop, int32_t stage) {
  auto found = std::find(loop.stages.begin(), loop.stages.end(), stage);
  return found == loop.stages.end()
             ? -1
             : static_cast<int32_t>(found - loop.stages.begin());
}

std::vector<const pikoir_cuda_step *>
ProgramChecker::stepsOf(const Step &loop, int32_t kind) const {
  std::vector<const Step *> steps;
  for (const Step &step : program_.subspan(indexOf(loop))) {
    if (step.kind == PIKOIR_STEP_END_WAVES)
      break;
    if (step.kind == kind)
      steps.push_back(&step);
  }
  return steps;
}

int32_t ProgramChecker::exitOf(const Step &loop, const Edge &edge) const {
  std::vector<const Step *> exits = stepsOf(loop, PIKOIR_STEP_EXIT);
  auto found = std::find_if(exits.begin(), exits.end(), [&](const Step *exit) {
    size_t number = static_cast<size_t>(exit->number);
    return number < p_.edges.size() &&
           p_.edges[number].consumer == edge.consumer;
  });
  return found == exits.end() ? -1
                              : static_cast<int32_t>(found - exits.begin());
}

/// A stage is in its loop, and runs by itself.
void ProgramChecker::checkStage(const Step &step) const {
  const Stage &stage = p_.stages[static_cast<size_t>(step.number)];
  const Step *loop = openLoop();
  if (stage.loop != (loop ? loop->number : -1) || stage.host >= 0)
    failUnexpected(step);
}

void ProgramChecker::checkQueue(const Step &step) const {
  size_t before = indexOf(step);
  while (before > 0 && program_[before].kind == PIKOIR_STEP_QUEUE)
    --before;
  const Edge &edge = p_.edges[static_cast<size_t>(step.number)];
  const Stage &from = p_.stages[static_cast<size_t>(edge.producer)];
  int32_t kernel = from.host >= 0 ? from.host : edge.producer;
  if (program_[before].kind != PIKOIR_STEP_STAGE ||
      program_[before].number != kernel || edge.local)
    failUnexpected(step);
  const Step *loop = openLoop();
  expect(step, "member",
         edge.insideLoop ? memberOf(shapeOf(*loop), edge.consumer) : -1,
         step.member);
  if (!loop || edge.insideLoop)
    return expect(step, "exit", -1, step.exit);
  int32_t exit = exitOf(*loop, edge);
  if (exit < 0)
    fail(nameOf(step) + ": expected an exit of loop " +
         std::to_string(loop->number) + " to stage " +
         quoted(p_.stages[static_cast<size_t>(edge.consumer)].name));
  expect(step, "exit", exit, step.exit);
}

void ProgramChecker::checkEntry(const Step &step) const {
  const Step *loop = openLoop();
  int32_t member = loop ? memberOf(shapeOf(*loop), step.number) : -1;
  if (member < 0)
    failUnexpected(step);
  expect(step, "member", member, step.member);
}

void ProgramChecker::checkExit(const Step &step) const {
  const Step *loop = openLoop();
  const Edge &edge = p_.edges[static_cast<size_t>(step.number)];
  if (!loop || edge.insideLoop ||
      p_.stages[static_cast<size_t>(edge.producer)].loop != loop->number)
    failUnexpected(step);
  std::vector<const Step *> exits = stepsOf(*loop, PIKOIR_STEP_EXIT);
  auto found = std::find(exits.begin(), exits.end(), &step);
  expect(step, "exit", static_cast<int32_t>(found - exits.begin()), step.exit);
  if (exitOf(*loop, edge) != step.exit)
    failUnexpected(step); // an exit before it leads to the same stage
}

/// A loop that runs one position at a time finds the kernel of a member by its
/// number, and nothing comes into it but by an entry.
void ProgramChecker::checkLoop(const Step &loop) const {
  const LoopShape &shape = shapeOf(loop);
  if (!shape.ordered)
    return;
  if (stepsOf(loop, PIKOIR_STEP_ENTRY).empty())
    fail("expected an entry of what " + nameOf(loop) + " begins");
  std::vector<const Step *> kernels = stepsOf(loop, PIKOIR_STEP_STAGE);
  bool isSame = std::equal(
      kernels.begin(), kernels.end(), shape.stages.begin(), shape.stages.end(),
      [](const Step *step, int32_t stage) { return step->number == stage; });
  if (!isSame)
    fail("expected the stages of what " + nameOf(loop) +
         " begins in the order of their declaration, each once");
}

// --- All ---------------------------------------------------------------------

void ProgramChecker::run() {
  for (const Step &step : program_) {
    checkNumber(step);
    switch (step.kind) {
    case PIKOIR_STEP_SOURCE:
      checkGrids(step);
      break;
    case PIKOIR_STEP_STAGE:
      checkGrids(step);
      checkStage(step);
      break;
    case PIKOIR_STEP_QUEUE:
      checkQueue(step);
      break;
    case PIKOIR_STEP_ENTRY:
      checkEntry(step);
      break;
    case PIKOIR_STEP_EXIT:
      checkExit(step);
      break;
    case PIKOIR_STEP_STRIPS:
    case PIKOIR_STEP_ROUNDS:
      begin(step);
      break;
    case PIKOIR_STEP_WAVES:
      begin(step);
      checkLoop(step);
      break;
    case PIKOIR_STEP_END_STRIPS:
      end(step, PIKOIR_STEP_STRIPS);
      break;
    case PIKOIR_STEP_END_WAVES:
      end(step, PIKOIR_STEP_WAVES);
      break;
    case PIKOIR_STEP_END_ROUNDS:
      end(step, PIKOIR_STEP_ROUNDS);
      break;
    default:
      break;
    }
  }
  if (!open_.empty())
    fail("expected an end of what " + nameOf(*open_.back()) + " begins");
}

void piko::cuda::checkProgram(const pikort_pipeline &p, Steps program) {
  ProgramChecker(p, program).run();
}
