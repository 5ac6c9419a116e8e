// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Loop.cpp - What goes into a loop -----------------------------------===//

#include "cpu/loops/Loop.h"
#include "cpu/Parallel.h"
#include "cpu/check/Check.h"
#include "cpu/loops/StackLoop.h"
#include "cpu/loops/WaveLoop.h"

#include <algorithm>

using namespace piko::rt;

StageLoop::StageLoop(pikort_pipeline &p, const LoopShape &shape)
    : p_(p), shape_(shape) {
  for (int32_t s : shape.stages)
    for (int32_t e : p.stages[s].outputs)
      if (e >= 0 && !p.edges[e].insideLoop)
        exits_.push_back(e);
}

Edge &StageLoop::exitTo(const Edge &edge) const {
  size_t i = 0;
  while (p_.edges[exits_[i]].consumer != edge.consumer)
    ++i;
  return p_.edges[exits_[i]];
}

std::unique_ptr<StageLoop> StageLoop::make(pikort_pipeline &p,
                                           const LoopShape &shape) {
  if (shape.ordered)
    return std::make_unique<StackLoop>(p, shape);
  return std::make_unique<WaveLoop>(p, shape);
}

void StageLoop::start(bool fromOutside) {
  entries_.clear();
  places_.clear();
  entryCount_ = 0;
  size_t used = 0;
  for (size_t m = 0; m < members(); ++m) {
    entries_.push_back(gatherInputs(p_, member(m), fromOutside));
    entryCount_ += entries_[m].count;
    used += entries_[m].count > 0;
  }
  checkCount(member(0), entryCount_);
  if (used > 1)
    places_ = mergePlaces(p_, entries_);
  else
    places_.resize(members());
  if (int32_t width = shape_.keyWidth) {
    keys_ = Array<uint64_t>(p_.memory, entryCount_ * width);
    for (size_t m = 0; m < members(); ++m) {
      const Keys &keys = entries_[m].keys;
      parallelChunks(p_.threads, entries_[m].count, 1 << 14,
                     [&](int64_t begin, int64_t end) {
                       for (int64_t i = begin; i < end; ++i) {
                         int64_t place = places_[m] ? places_[m][i] : i;
                         for (int32_t w = 0; w < width; ++w)
                           keys_[place * width + w] = keys.word(i, w);
                       }
                     });
    }
  }
  begin();
}

void StageLoop::writeKey(const Edge &edge, uint64_t *key, int64_t entry,
                         uint64_t place) const {
  for (int32_t w = 0; w < edge.keyWidth; ++w)
    key[w] = w < shape_.keyWidth    ? keys_[entry * shape_.keyWidth + w]
             : w == shape_.keyWidth ? place
                                    : 0;
}

void StageLoop::failHops(const Stage &stage, int64_t bucket,
                         const uint8_t *record) const {
  std::string text = "stage " + quoted(stage.name) + ", bin " +
                     std::to_string(bucket / stage.tiles) +
                     ": a loop did not end within " +
                     std::to_string(p_.loopLimit) + " hops";
  if (Checker *checker = checkerOf(p_))
    text += checker->contextOf(stage, record);
  throw Failure{PIKORT_ENDLESS, text};
}
