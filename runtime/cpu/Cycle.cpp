// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Cycle.cpp - Runs a cycle of stages until nothing is left -----------===//

#include "cpu/Cycle.h"

#include <algorithm>

using namespace piko::rt;

// --- The parts of a cycle ---------------------------------------------------

Cycle::Cycle(pikort_pipeline &p, const Component &component)
    : p_(p), component_(component) {
  for (int32_t s : component.stages) {
    const Stage &stage = p.stages[s];
    if (stage.collects()) {
      collectors_.push_back(s);
    } else if (stage.loop < 0) {
      parts_.push_back({{s}, nullptr});
    } else if (const LoopShape &loop = p.loops[stage.loop];
               loop.stages.front() == s) {
      parts_.push_back({loop.stages, Loop::make(p, loop)});
    }
  }
  sortParts();
}

/// Parts form no cycle: a part waits for those that emit into it.
void Cycle::sortParts() {
  std::vector<Part> sorted;
  auto waits = [&](const Part &part) {
    return std::any_of(p_.edges.begin(), p_.edges.end(), [&](const Edge &edge) {
      auto holds = [&](const Part &other, int32_t stage) {
        return std::find(other.stages.begin(), other.stages.end(), stage) !=
               other.stages.end();
      };
      return holds(part, edge.consumer) && !holds(part, edge.producer) &&
             std::any_of(parts_.begin(), parts_.end(), [&](const Part &other) {
               return holds(other, edge.producer);
             });
    });
  };
  while (!parts_.empty()) {
    auto next = std::find_if(parts_.begin(), parts_.end(),
                             [&](const Part &part) { return !waits(part); });
    sorted.push_back(std::move(*next));
    parts_.erase(next);
  }
  parts_ = std::move(sorted);
}

bool Cycle::comesFromOutside(const Stage &stage) const {
  return !stage.sources.empty() ||
         std::any_of(stage.inputs.begin(), stage.inputs.end(), [&](int32_t e) {
           return p_.stages[p_.edges[e].producer].component != stage.component;
         });
}

bool Cycle::hasInput(const Stage &stage, bool fromOutside) const {
  return (fromOutside && comesFromOutside(stage)) ||
         std::any_of(stage.inputs.begin(), stage.inputs.end(), [&](int32_t e) {
           const Edge &edge = p_.edges[e];
           return p_.stages[edge.producer].component == stage.component &&
                  edge.queue->count > 0;
         });
}

// --- What runs next ---------------------------------------------------------

int32_t Cycle::step() {
  if (chosen_ >= 0)
    throw Failure{PIKORT_BAD_PROGRAM,
                  "stage " + quoted(p_.stages[chosen_].name) +
                      ": expected its kernel to run before the next step of "
                      "its cycle"};
  if (loop_ && (chosen_ = loop_->next()) < 0) { // most often it goes on
    parts_[part_++].started = false;
    loop_ = nullptr;
  }
  if (chosen_ < 0 && !finished_)
    chosen_ = choose();
  begun_ = false;
  if (!finished_ && chosen_ < 0)
    finish();
  return chosen_;
}

/// What serial launches kept for the next one is no longer needed.
void Cycle::finish() {
  finished_ = true;
  for (int32_t s : component_.stages)
    if (Kernel &kernel = *p_.stages[s].kernel; kernel.serial)
      kernel.clear();
}

int32_t Cycle::choose() {
  for (;;) {
    for (; part_ < parts_.size(); ++part_)
      if (int32_t stage = runPart(parts_[part_]); stage >= 0)
        return stage;
    if (int32_t stage = nextCollector(); stage >= 0)
      return stage;
    if (std::none_of(collectors_.begin(), collectors_.end(),
                     [&](int32_t s) { return hasInput(p_.stages[s], false); }))
      return -1;
    beginRound();
  }
}

/// The stage of the part that runs next, or -1 if the part has come to rest.
int32_t Cycle::runPart(Part &part) {
  if (!part.started) {
    if (std::none_of(part.stages.begin(), part.stages.end(), [&](int32_t s) {
          return hasInput(p_.stages[s], fromOutside_);
        }))
      return -1;
    part.started = true;
    if (!part.loop)
      return part.stages.front();
    part.loop->start(fromOutside_);
  }
  int32_t stage = part.loop ? part.loop->next() : -1;
  part.started = stage >= 0;
  if (part.started)
    loop_ = part.loop.get();
  return stage;
}

int32_t Cycle::nextCollector() {
  while (collector_ < collectors_.size()) {
    int32_t s = collectors_[collector_++];
    const Stage &stage = p_.stages[s];
    bool everyBin = stage.schedule.everyBin || stage.binSchedules;
    if (!hasInput(stage, round_ == 0) && !(everyBin && round_ == 0))
      continue;
    part_ = 0;
    fromOutside_ = false;
    return s;
  }
  return -1;
}

void Cycle::beginRound() {
  if (round_ == p_.loopLimit)
    for (int32_t s : component_.stages)
      if (p_.stages[s].collects() && hasInput(p_.stages[s], false))
        throw Failure{PIKORT_ENDLESS, "stage " + quoted(p_.stages[s].name) +
                                          ": a loop did not end within " +
                                          std::to_string(p_.loopLimit) +
                                          " rounds"};
  ++round_;
  collector_ = 0;
}

// --- What the kernels take and emit -----------------------------------------

void Cycle::expectChosen(const Kernel &kernel) const {
  if (kernel.stage != chosen_ || begun_)
    throw Failure{PIKORT_BAD_PROGRAM,
                  "stage " + quoted(p_.stages[kernel.stage].name) +
                      ": expected pikoir_cycle_step to name it first"};
}

bool Cycle::takesFromOutside(const Stage &stage) const {
  return stage.collects() ? round_ == 0 : fromOutside_;
}

/// The edge whose queue is all that comes into a stage, or null.
Edge *Cycle::onlyInput(const Stage &stage) const {
  Edge *only = nullptr;
  if (takesFromOutside(stage) && comesFromOutside(stage))
    return nullptr;
  for (int32_t e : stage.inputs) {
    Edge &edge = p_.edges[e];
    if (p_.stages[edge.producer].component != stage.component ||
        edge.queue->count == 0)
      continue;
    if (only)
      return nullptr;
    only = &edge;
  }
  return only;
}

/// Serial launches emit in the order of processing. That must be the order of
/// lineage, too, and what they emit must not need keys that tell cells.
bool Cycle::runsSerially(Kernel &kernel) const {
  expectChosen(kernel);
  if (loop_)
    return loop_->runsSerially(kernel);
  const Stage &stage = p_.stages[kernel.stage];
  const Edge *edge = onlyInput(stage);
  if (!edge)
    return false;
  const Queue &queue = *edge->queue;
  if (!Serial::takes(p_, kernel, std::max(queue.count, queue.pairs.size())))
    return false;
  if (stage.collects())
    return stage.tiles == 1 && round_ > 0;
  return isSorted(queue.view()) &&
         std::none_of(stage.outputs.begin(), stage.outputs.end(),
                      [&](int32_t e) { return e >= 0 && p_.edges[e].keyed; });
}

/// A collecting stage begins a new lineage.
void Cycle::startLaunch(Kernel &kernel) {
  kernel.firstRound = round_ == 0;
  if (launches_ > UINT32_MAX)
    throw Failure{PIKORT_TOO_MANY,
                  "stage " + quoted(p_.stages[kernel.stage].name) +
                      ": expected at most 4294967296 launches in a cycle"};
  kernel.launch = static_cast<uint32_t>(launches_++);
}

Stream Cycle::takeInput(Kernel &kernel) {
  const Stage &stage = p_.stages[kernel.stage];
  begun_ = true;
  if (loop_)
    return loop_->takeInput();
  if (stage.collects())
    startLaunch(kernel);
  return gatherInputs(p_, stage, takesFromOutside(stage));
}

Items Cycle::serialInput(Kernel &kernel) {
  begun_ = true;
  if (loop_)
    return loop_->serialInput();
  const Stage &stage = p_.stages[kernel.stage];
  if (stage.collects())
    startLaunch(kernel);
  input_.reset();
  std::swap(input_, *onlyInput(stage)->queue);
  return input_.view();
}

void Cycle::absorb(Kernel &kernel, bool serial) {
  if (serial)
    kernel.serial->end();
  if (loop_ && serial)
    loop_->absorb(*kernel.serial);
  else if (loop_)
    loop_->absorb(kernel);
  else if (serial)
    absorb(kernel, *kernel.serial);
  else
    for (int32_t e : p_.stages[kernel.stage].outputs)
      if (e >= 0)
        enqueue(p_, p_.edges[e], gatherEdge(p_, p_.edges[e]));
  chosen_ = -1;
}

void Cycle::absorb(const Kernel &kernel, const Serial &launch) {
  const Stage &stage = p_.stages[kernel.stage];
  for (size_t port = 0; port < stage.outputs.size(); ++port) {
    int32_t e = stage.outputs[port];
    const Serial::Emitted &emitted = launch.ports()[port];
    if (emitted.count == 0)
      continue;
    Stream stream{emitted, {}, {}, {}, {}};
    if (p_.edges[e].keyed) { // a new lineage
      stream.keys.width = 2;
      stream.keys.words = Array<uint64_t>(p_.memory, 2 * stream.count);
      for (int64_t i = 0; i < stream.count; ++i) {
        stream.keys.words[2 * i] = uint64_t(stage.root) << 32 | kernel.launch;
        stream.keys.words[2 * i + 1] = emitted.numbers[i];
      }
    }
    enqueue(p_, p_.edges[e], stream);
  }
}

void piko::rt::enqueue(pikort_pipeline &p, Edge &edge, const Stream &stream) {
  const Stage &to = p.stages[edge.consumer];
  checkCount(to, edge.queue->count + stream.count);
  checkCount(to, edge.queue->pairs.size() + stream.pairCount);
  edge.queue->append(p.memory, stream, p.records[to.record].size,
                     edge.keyed ? edge.keyWidth : 0);
}

void piko::rt::startCycles(pikort_pipeline &p) {
  p.activeThreads = p.threads;
  for (Component &component : p.components)
    if (component.cyclic)
      component.cycle = std::make_shared<Cycle>(p, component);
  for (Edge &edge : p.edges)
    if (p.cycleOf(p.stages[edge.producer]))
      edge.queue = std::make_shared<Queue>();
}

void piko::rt::restartCycles(pikort_pipeline &p, const StripGroup &group) {
  for (int32_t s : group.stages)
    if (Component &component = p.components[p.stages[s].component];
        component.cyclic && component.stages.front() == s) {
      component.cycle = std::make_shared<Cycle>(p, component);
      for (Edge &edge : p.edges)
        if (p.stages[edge.producer].component == p.stages[s].component &&
            !edge.leavesStrips)
          *edge.queue = {};
    }
}

void piko::rt::endCycles(pikort_pipeline &p) {
  for (Component &component : p.components)
    component.cycle.reset();
  for (Edge &edge : p.edges)
    edge.queue.reset();
}

extern "C" {

int32_t pikoir_cycle_step(pikort_pipeline *p, int32_t stage) {
  if (p->status != PIKORT_OK)
    return -1;
  int32_t next = -1;
  guarded(p, "cycle", [&] {
    const Stage *found = p->findStage(stage);
    Cycle *cycle = found ? p->cycleOf(*found) : nullptr;
    if (!cycle)
      throw Failure{PIKORT_BAD_PROGRAM,
                    "expected a stage of a cycle, but got stage " +
                        std::to_string(stage)};
    if (p->profile.part() != Part::Cycle)
      p->profile.enter(Part::Cycle);
    next = cycle->step();
  });
  if (next < 0)
    p->profile.enter(Part::Program);
  return next;
}

int64_t pikoir_loop_limit(pikort_pipeline *p) { return p->loopLimit; }

} // extern "C"
