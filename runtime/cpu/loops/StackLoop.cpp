// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- StackLoop.cpp - A loop that runs one position at a time ------------===//

#include "cpu/loops/StackLoop.h"

#include <algorithm>

using namespace piko::rt;

void StackLoop::begin() {
  stack_.shrink(0);
  records_.shrink(0);
  buckets_.shrink(0);
  nextEntry_ = 0;
  left_ = 0;
  order_ = Array<Entry>(p_.memory, entryCount_);
  starts_.clear();
  for (size_t m = 0; m < members(); ++m) {
    bool placed = member(m).placed() && entries_[m].count > 0;
    starts_.push_back(placed ? pairStarts(p_.memory, entries_[m])
                             : Array<uint32_t>());
    for (int64_t i = 0; i < entries_[m].count; ++i)
      order_[places_[m] ? places_[m][i] : i] = {static_cast<uint32_t>(m),
                                                static_cast<uint32_t>(i)};
  }
}

void StackLoop::push(const Waiting &waiting, const uint8_t *record,
                     const uint32_t *buckets) {
  records_.append(p_.memory, record, recordSize(p_.stages[waiting.stage]));
  buckets_.append(p_.memory, buckets, waiting.buckets);
  *stack_.extend(p_.memory, 1) = waiting;
}

/// Pushes an item in each of its buckets, the last one first.
void StackLoop::pushBuckets(int32_t stage, int64_t hops, const uint8_t *record,
                            const uint32_t *buckets, int64_t count) {
  if (!p_.stages[stage].placed())
    return push({-1, stage, hops, 0}, record, nullptr);
  while (count-- > 0)
    if (uint32_t bucket = buckets[count]; bucket != noBucket) {
      bucket |= PIKOIR_FIRST_BUCKET;
      push({-1, stage, hops, 1}, record, &bucket);
    }
}

Items StackLoop::pop() {
  Waiting top = stack_[stack_.size() - 1];
  stack_.shrink(stack_.size() - 1);
  records_.shrink(records_.size() - recordSize(p_.stages[top.stage]));
  buckets_.shrink(buckets_.size() - top.buckets);
  return {records_.data() + records_.size(), 1,
          buckets_.data() + buckets_.size(), top.buckets};
}

/// The top of the stack leaves the loop.
void StackLoop::leave() {
  const Edge &edge = exitTo(p_.edges[stack_[stack_.size() - 1].edge]);
  Stream stream{pop(), {}, {}, {}, {}, {}};
  if (edge.keyed()) {
    stream.keys.width = edge.keyWidth;
    stream.keys.words = std::move(key_);
    if (stream.keys.words.capacity() < edge.keyWidth)
      stream.keys.words = Array<uint64_t>(p_.memory, edge.keyWidth);
    writeKey(edge, stream.keys.words.data(), nextEntry_ - 1, left_++);
  }
  const Stage &to = p_.stages[edge.consumer];
  Queue &queue = queueOf(p_, edge);
  checkCount(to, queue.count + 1);
  checkCount(to, queue.pairCount() + stream.pairCount);
  queue.append(p_.memory, stream, recordSize(to), stream.keys.width);
  if (edge.keyed())
    key_ = std::move(stream.keys.words);
}

void StackLoop::pushEntry(const Entry &entry) {
  const Stream &stream = entries_[entry.member];
  int32_t stage = shape_.stages[entry.member];
  const Array<uint32_t> &starts = starts_[entry.member];
  int64_t begin = starts ? starts[entry.item] : 0;
  int64_t end = starts ? starts[entry.item + 1] : 0;
  pushBuckets(stage, 0, stream.item(entry.item, recordSize(p_.stages[stage])),
              stream.pairs + begin, end - begin);
}

int32_t StackLoop::next() {
  for (;;) {
    while (stack_.size() > 0) {
      running_ = stack_[stack_.size() - 1];
      if (running_.edge < 0) {
        const Stage &stage = p_.stages[running_.stage];
        if (running_.hops > p_.loopLimit)
          failHops(stage,
                   running_.buckets
                       ? buckets_[buckets_.size() - 1] & ~PIKOIR_FIRST_BUCKET
                       : 0,
                   records_.data() + records_.size() - recordSize(stage));
        return running_.stage;
      }
      leave();
    }
    if (nextEntry_ == entryCount_) {
      entries_.clear();
      return -1;
    }
    const Entry &entry = order_[nextEntry_++];
    pushEntry(entry);
  }
}

Items StackLoop::serialInput() {
  Items input = pop();
  int64_t size = recordSize(p_.stages[running_.stage]);
  input_.shrink(0); // in its own memory, a record is aligned
  input_.append(p_.memory, input.items, size);
  input.items = input_.data();
  inputBucket_ = input.pairCount > 0 ? *input.pairs : 0;
  input.pairs = &inputBucket_;
  return input;
}

/// Pushes what the position emitted, the last one first.
void StackLoop::absorb(const Serial &launch) {
  tails_.clear();
  const std::vector<int32_t> &outputs = p_.stages[running_.stage].outputs;
  for (size_t port = 0; port < outputs.size(); ++port)
    if (const Serial::Emitted &emitted = launch.ports()[port];
        emitted.count > 0)
      tails_.push_back(
          {outputs[port], &emitted, emitted.count, emitted.pairCount});
  auto number = [](const Tail &tail) {
    return tail.emitted->numbers[tail.count - 1];
  };
  while (!tails_.empty()) {
    auto last = std::max_element(
        tails_.begin(), tails_.end(),
        [&](const Tail &a, const Tail &b) { return number(a) < number(b); });
    pushLast(*last);
    if (last->count == 0)
      tails_.erase(last);
  }
}

void StackLoop::pushLast(Tail &tail) {
  const Edge &edge = p_.edges[tail.edge];
  const Stage &to = p_.stages[edge.consumer];
  const Items &emitted = *tail.emitted;
  const uint8_t *record = emitted.items + --tail.count * recordSize(to);
  int64_t end = tail.pairs;
  if (to.placed())
    while (!(emitted.pairs[--tail.pairs] & PIKOIR_FIRST_BUCKET))
      ;
  const uint32_t *buckets = emitted.pairs + tail.pairs;
  if (edge.insideLoop)
    pushBuckets(edge.consumer, running_.hops + 1, record, buckets,
                end - tail.pairs);
  else
    push({tail.edge, edge.consumer, 0, end - tail.pairs}, record, buckets);
}
