// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Strips.cpp - Runs stages on one part of a source after another -----===//

#include "cpu/loops/Strips.h"
#include "cpu/check/Check.h"
#include "cpu/loops/Cycle.h"
#include "ranks/Ranks.h"

#include <algorithm>

using namespace piko::rt;

Strips::Strips(pikort_pipeline &p, const StripGroup &group)
    : p_(p), group_(group), source_(p.sources[group.source]) {
  for (int32_t s : group.stages)
    for (int32_t e : p.stages[s].outputs)
      if (e >= 0 && p.edges[e].leavesStrips) {
        cpuOf(p).queues[e] = std::make_unique<Queue>();
        leaving_.push_back({&p.edges[e], {}});
      }
  size_ = firstSize();
}

// --- How large strips are ---------------------------------------------------

/// Bytes of a primitive of each stage of the group.
int64_t Strips::primitiveBytes() const {
  int64_t bytes = 0;
  for (int32_t s : group_.stages)
    bytes += p_.records[p_.stages[s].record].size;
  return bytes;
}

/// Each of them has a part of a strip.
int64_t Strips::ranks() const { return p_.ranks ? p_.ranks->size() : 1; }

int64_t Strips::mostSize() const {
  int64_t all = std::max<int64_t>(1, source_.count);
  return group_.chunk > 0 ? std::min(group_.chunk, all) : all;
}

int64_t Strips::firstSize() const {
  int64_t all = std::max<int64_t>(1, source_.count);
  if (checkerOf(p_)) // it knows what is concurrent in whole kernels
    return all;
  if (p_.stripSize > 0)
    return std::min(p_.stripSize, all);
  int64_t budget = p_.memory.budget();
  if (budget == 0)
    return mostSize();
  // What a stage makes of a primitive is not known yet.
  int64_t guess = budget / (16 * primitiveBytes());
  return std::min(mostSize(), std::clamp<int64_t>(guess, 1, 1024) * ranks());
}

/// After a strip: as much as would have used two fifths of what the budget
/// leaves, in steps, since the next primitives may be others.
int64_t Strips::nextSize() const {
  int64_t budget = p_.memory.budget();
  if (p_.stripSize > 0 || budget == 0)
    return size_;
  auto used = static_cast<double>(
      std::max<int64_t>(1, p_.memory.peakSinceMark() - held_));
  double target =
      0.4 * static_cast<double>(std::max<int64_t>(0, budget - held_));
  double scale = std::clamp(target / used, 0.125, 2.0);
  return std::clamp<int64_t>(
      static_cast<int64_t>(static_cast<double>(size_) * scale), 1, mostSize());
}

// --- From strip to strip ----------------------------------------------------

/// Where a rank has failed all hear of it, and then say whether they can take
/// the strip back. The smallest size that one proposes is that of all.
int64_t Strips::agree(int64_t size) {
  Ranks &ranks = *p_.ranks;
  if (!ranks.hasAgreed())
    guarded(&p_, "strips",
            [&] { size = ranks.agreeOnStrip(size, p_.status != PIKORT_OK); });
  if (p_.status == PIKORT_OUT_OF_MEMORY && started_ && ranks.hasAgreed())
    size = ranks.agreeOnStrip(smallerSize(), /*failed=*/false);
  return size;
}

bool Strips::next() {
  int64_t size = p_.status != PIKORT_OK ? smallerSize()
                 : started_             ? nextSize()
                                        : size_;
  if (p_.ranks)
    size = agree(size);
  if (p_.status != PIKORT_OK) {
    if (size == 0 && isCrowded())
      failCollected();
    if (p_.status != PIKORT_OUT_OF_MEMORY || size == 0)
      return false;
    takeBack();
  } else if (started_) {
    source_.takeStrip(source_.stripEnd, source_.stripEnd);
    ++number_;
  }
  size_ = size;
  finished_ = started_ && source_.stripBegin == source_.count;
  if (finished_) {
    p_.memory.limitBins(p_.memory.budget());
    return false;
  }
  start();
  return true;
}

/// What waits for a stage outside of the group leaves no room for strips.
void Strips::failCollected() const {
  p_.clearStatus();
  const Edge *largest = leaving_.front().edge;
  for (const Waiting &waiting : leaving_)
    if (queueOf(p_, *waiting.edge).bytes() > queueOf(p_, *largest).bytes())
      largest = waiting.edge;
  throw Failure{PIKORT_OUT_OF_MEMORY,
                "stage " + quoted(p_.stages[largest->consumer].name) +
                    ": out of memory: what it collects takes " +
                    std::to_string(queueOf(p_, *largest).bytes()) + " of " +
                    std::to_string(held_) + " bytes in bins, and strips need " +
                    std::to_string(p_.memory.budget() / 4) + " more" +
                    memoryLimitText(p_)};
}

void Strips::start() {
  started_ = true;
  committed_ = false;
  int64_t first = source_.stripBegin;
  source_.takeStrip(first, first + std::min(size_, source_.count - first));
  divided_ |= first > 0 || source_.stripEnd < source_.count;
  if (p_.ranks)
    p_.ranks->takePart(source_);
  restartCycles(p_, group_);
  for (Waiting &waiting : leaving_)
    waiting.mark = queueOf(p_, *waiting.edge).mark();
  stats_.clear();
  for (int32_t s : group_.stages)
    stats_.push_back(p_.stageStats[s]);
  held_ = p_.memory.markBins();
  int64_t budget = p_.memory.budget();
  if (budget > 0 && !leaving_.empty() && held_ > budget - budget / 4)
    failCollected();
  bool half = group_.writes && size_ > 1 && budget > held_ && !checkerOf(p_);
  p_.memory.limitBins(half ? held_ + (budget - held_) / 2 : budget);
}

void Strips::commit() {
  if (p_.ranks && !committed_) // throws if another rank has failed
    p_.ranks->agreeOnStrip(0, /*failed=*/false);
  committed_ = true;
  p_.memory.limitBins(0);
}

/// A strip that found no memory becomes a smaller one, if it has written
/// nothing yet.
int64_t Strips::smallerSize() const {
  int64_t size = source_.stripEnd - source_.stripBegin;
  bool canBeTakenBack = started_ && !committed_ && !checkerOf(p_) &&
                        p_.status == PIKORT_OUT_OF_MEMORY;
  return canBeTakenBack && size > 1 ? std::max<int64_t>(1, size / 4) : 0;
}

bool Strips::isCrowded() const {
  int64_t budget = p_.memory.budget();
  return started_ && !committed_ && !checkerOf(p_) && !p_.ranks &&
         p_.status == PIKORT_OUT_OF_MEMORY && !leaving_.empty() && budget > 0 &&
         held_ > budget / 2;
}

void Strips::takeBack() {
  p_.clearStatus();
  if (p_.ranks)
    p_.ranks->takeBack(group_);
  if (Kernel *kernel = cpuOf(p_).sourceKernels[group_.source].get())
    kernel->clear();
  for (size_t i = 0; i < group_.stages.size(); ++i) {
    kernelOf(p_, group_.stages[i]).clear();
    p_.stageStats[group_.stages[i]] = stats_[i];
  }
  for (Waiting &waiting : leaving_)
    queueOf(p_, *waiting.edge).rewind(waiting.mark);
}

void Strips::absorb(Kernel &kernel) {
  if (!divided_)
    return;
  for (Edge &edge : p_.edges) {
    bool isOfKernel =
        edge.producer == kernel.stage ||
        (edge.producer >= 0 && p_.stages[edge.producer].host == kernel.stage);
    if (!isOfKernel || !edge.leavesStrips)
      continue;
    // Too much of it is the fault of the stage that it waits for.
    const std::string &name = p_.stages[edge.consumer].name;
    guarded(&p_, "stage " + quoted(name),
            [&] { enqueue(p_, edge, gatherEdge(p_, edge)); });
  }
}

// --- The strips of a run ----------------------------------------------------

void piko::rt::startStrips(pikort_pipeline &p) {
  for (Source &source : p.sources)
    source.takeStrip(0, source.count);
  p.memory.limitBins(p.memory.budget());
  for (const StripGroup &group : p.stripGroups)
    cpuOf(p).strips.push_back(std::make_unique<Strips>(p, group));
}

void piko::rt::endStrips(pikort_pipeline &p) {
  p.memory.limitBins(0);
  cpuOf(p).strips.clear();
}

extern "C" {

int32_t pikoir_strips_next(pikort_pipeline *p, int32_t id) {
  bool more = false;
  guarded(p, "strips", [&] {
    if (id < 0 || id >= static_cast<int32_t>(p->stripGroups.size()))
      throw Failure{PIKORT_BAD_PROGRAM,
                    "expected the number of a group of stages, but got " +
                        std::to_string(id)};
    more = cpuOf(*p).strips[id]->next();
  });
  return more;
}

} // extern "C"
