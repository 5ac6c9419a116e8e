// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Cycle.cpp - Runs a cycle of stages until nothing is left -----------===//

#include "cpu/loops/Cycle.h"

#include <algorithm>

using namespace piko::rt;

Cycle::Cycle(pikort_pipeline &p, int32_t number)
    : p_(p), number_(number), stages_(p.cycles[number].stages) {
  for (size_t l = 0; l < p.loops.size(); ++l)
    if (p.loops[l].cycle == number)
      loops_.push_back(
          {static_cast<int32_t>(l), StageLoop::make(p, p.loops[l]), false});
  std::copy_if(stages_.begin(), stages_.end(), std::back_inserter(collectors_),
               [&](int32_t s) { return p.stages[s].collects(); });
}

bool Cycle::comesFromOutside(const Stage &stage) const {
  return !stage.sources.empty() ||
         std::any_of(stage.inputs.begin(), stage.inputs.end(), [&](int32_t e) {
           return p_.stages[p_.edges[e].producer].cycle != number_;
         });
}

bool Cycle::hasInput(const Stage &stage, bool fromOutside) const {
  return (fromOutside && comesFromOutside(stage)) ||
         std::any_of(stage.inputs.begin(), stage.inputs.end(), [&](int32_t e) {
           const Edge &edge = p_.edges[e];
           return p_.stages[edge.producer].cycle == number_ &&
                  queueOf(p_, edge).count > 0;
         });
}

// --- What runs next ---------------------------------------------------------

/// One kernel runs at a time.
void Cycle::expectNone() const {
  if (chosen_ >= 0)
    throw Failure{PIKORT_BAD_PROGRAM,
                  "stage " + quoted(p_.stages[chosen_].name) +
                      ": expected its kernel to run before the next step of "
                      "its cycle"};
}

int32_t Cycle::choose(int32_t stage) {
  begun_ = false;
  return chosen_ = stage;
}

int32_t Cycle::stepLoop(int32_t number) {
  expectNone();
  Part *part = loops_.data();
  while (part->number != number)
    ++part;
  if (!part->started) {
    const std::vector<int32_t> &stages = p_.loops[number].stages;
    if (!finished_ && std::any_of(stages.begin(), stages.end(), [&](int32_t s) {
          return hasInput(p_.stages[s], fromOutside_);
        })) {
      part->loop->start(fromOutside_);
      part->started = true;
    }
  }
  loop_ = part->loop.get();
  int32_t next = part->started ? loop_->next() : -1;
  if (next >= 0)
    return choose(next);
  part->started = false;
  loop_ = nullptr;
  if (collectors_.empty())
    finish();
  return -1;
}

bool Cycle::takes(int32_t stage) {
  expectNone();
  if (finished_ || !hasInput(p_.stages[stage], fromOutside_))
    return false;
  choose(stage);
  return true;
}

int32_t Cycle::nextTurn() {
  expectNone();
  while (!finished_) {
    if (int32_t stage = nextCollector(); stage >= 0)
      return choose(stage);
    if (std::none_of(collectors_.begin(), collectors_.end(),
                     [&](int32_t s) { return hasInput(p_.stages[s], false); }))
      finish();
    else
      beginRound();
  }
  return -1;
}

/// What serial launches kept for the next one is no longer needed.
void Cycle::finish() {
  finished_ = true;
  for (int32_t s : stages_)
    if (Kernel &kernel = kernelOf(p_, s); kernel.serial)
      kernel.clear();
}

int32_t Cycle::nextCollector() {
  while (collector_ < collectors_.size()) {
    int32_t s = collectors_[collector_++];
    const Stage &stage = p_.stages[s];
    bool everyBin = stage.schedule.everyBin || stage.binSchedules;
    if (!hasInput(stage, round_ == 0) && !(everyBin && round_ == 0))
      continue;
    fromOutside_ = false;
    return s;
  }
  return -1;
}

void Cycle::beginRound() {
  if (round_ == p_.loopLimit)
    for (int32_t s : collectors_)
      if (hasInput(p_.stages[s], false))
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
                      ": expected a step of its cycle to name it first"};
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
    if (p_.stages[edge.producer].cycle != number_ ||
        queueOf(p_, edge).count == 0)
      continue;
    if (only)
      return nullptr;
    only = &edge;
  }
  return only;
}

/// Serial launches emit in the order of processing. That must be the order of
/// lineage, too, and what they emit must not need keys that tell buckets.
bool Cycle::runsSerially(Kernel &kernel) const {
  expectChosen(kernel);
  if (loop_)
    return loop_->runsSerially(kernel);
  const Stage &stage = p_.stages[kernel.stage];
  const Edge *edge = onlyInput(stage);
  if (!edge)
    return false;
  const Queue &queue = queueOf(p_, *edge);
  if (!Serial::takes(p_, kernel, std::max(queue.count, queue.pairCount())))
    return false;
  if (stage.collects())
    return stage.tiles == 1 && round_ > 0;
  return isSorted(queue.view()) &&
         std::none_of(stage.outputs.begin(), stage.outputs.end(),
                      [&](int32_t e) { return e >= 0 && p_.edges[e].keyed(); });
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
  std::swap(input_, queueOf(p_, *onlyInput(stage)));
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
    Stream stream{emitted, {}, {}, {}, {}, {}};
    if (p_.edges[e].keyed()) { // a new lineage
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

/// The queue of an edge, if there is room in it.
static Queue &roomFor(const pikort_pipeline &p, Edge &edge,
                      const Stream &stream) {
  const Stage &to = p.stages[edge.consumer];
  Queue &queue = queueOf(p, edge);
  checkCount(to, queue.count + stream.count);
  checkCount(to, queue.pairCount() + stream.pairCount);
  return queue;
}

void piko::rt::enqueue(pikort_pipeline &p, Edge &edge, const Stream &stream) {
  roomFor(p, edge, stream)
      .append(p.memory, stream, p.records[p.stages[edge.consumer].record].size,
              edge.keyWidth);
}

void piko::rt::enqueue(pikort_pipeline &p, Edge &edge, Stream &&stream) {
  if (edge.leavesStrips) // which may be taken back
    return enqueue(p, edge, std::as_const(stream));
  roomFor(p, edge, stream)
      .add(p.memory, std::move(stream),
           p.records[p.stages[edge.consumer].record].size, edge.keyWidth);
}

void piko::rt::startCycles(pikort_pipeline &p) {
  CPUExecutor &cpu = cpuOf(p);
  for (size_t c = 0; c < p.cycles.size(); ++c)
    cpu.cycles.push_back(std::make_unique<Cycle>(p, static_cast<int32_t>(c)));
  cpu.queues.resize(p.edges.size());
  for (size_t e = 0; e < p.edges.size(); ++e)
    if (cycleOf(p, p.stages[p.edges[e].producer]))
      cpu.queues[e] = std::make_unique<Queue>();
}

void piko::rt::restartCycles(pikort_pipeline &p, const StripGroup &group) {
  for (size_t c = 0; c < p.cycles.size(); ++c) {
    auto number = static_cast<int32_t>(c);
    int32_t first = p.cycles[c].stages.front();
    if (std::find(group.stages.begin(), group.stages.end(), first) ==
        group.stages.end())
      continue;
    cpuOf(p).cycles[c] = std::make_unique<Cycle>(p, number);
    for (const Edge &edge : p.edges)
      if (p.stages[edge.producer].cycle == number && !edge.leavesStrips)
        queueOf(p, edge) = {};
  }
}

void piko::rt::endCycles(pikort_pipeline &p) {
  cpuOf(p).cycles.clear();
  cpuOf(p).queues.clear();
}

/// Asks the cycle number `number` what is next; -1 at its end, and on an error.
static int32_t ask(pikort_pipeline *p, int32_t number, auto &&question) {
  if (p->status != PIKORT_OK)
    return -1;
  int32_t next = -1;
  Cycle *cycle = cpuOf(*p).cycles[static_cast<size_t>(number)].get();
  guarded(p, "cycle", [&] {
    if (p->profile.part() != Part::Cycle)
      p->profile.enter(Part::Cycle);
    next = question(*cycle);
  });
  if (cycle->isFinished() || p->status != PIKORT_OK)
    p->profile.enter(Part::Program);
  return next;
}

static int32_t failNumber(pikort_pipeline *p, const char *what,
                          int32_t number) {
  guarded(p, "cycle", [&] {
    throw Failure{PIKORT_BAD_PROGRAM, std::string("expected ") + what +
                                          ", but got " +
                                          std::to_string(number)};
  });
  return -1;
}

extern "C" {

int32_t pikoir_loop_step(pikort_pipeline *p, int32_t loop) {
  if (static_cast<size_t>(loop) >= p->loops.size())
    return failNumber(p, "the number of a loop", loop);
  return ask(p, p->loops[loop].cycle,
             [&](Cycle &cycle) { return cycle.stepLoop(loop); });
}

int32_t pikoir_cycle_takes(pikort_pipeline *p, int32_t stage) {
  const Stage *found = p->findStage(stage);
  if (!found || found->cycle < 0 || found->loop >= 0 || found->collects())
    return failNumber(p, "a stage between the loops of a cycle", stage) > 0;
  return ask(p, found->cycle,
             [&](Cycle &cycle) { return cycle.takes(stage) ? 1 : -1; }) > 0;
}

int32_t pikoir_cycle_turn(pikort_pipeline *p, int32_t cycle) {
  if (static_cast<size_t>(cycle) >= p->cycles.size())
    return failNumber(p, "the number of a cycle", cycle);
  return ask(p, cycle, [](Cycle &cycle) { return cycle.nextTurn(); });
}

int64_t pikoir_loop_limit(pikort_pipeline *p) { return p->loopLimit; }

} // extern "C"
