// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Counters.cpp - What a program counts -------------------------------===//

#include "common/Counters.h"

#include "common/Pipeline.h"

#include <algorithm>
#include <bit>

using namespace piko::rt;

/// Threads take shards by turns, so that few of them share one.
static size_t shardOfThread() {
  static std::atomic<size_t> next{0};
  thread_local size_t shard = next.fetch_add(1, std::memory_order_relaxed);
  return shard;
}

void Counter::add(int64_t amount, int64_t bytes) noexcept {
  Shard &shard = shards[shardOfThread() % shardCount];
  shard.count.fetch_add(amount, std::memory_order_relaxed);
  if (bytes)
    shard.bytes.fetch_add(bytes, std::memory_order_relaxed);
}

int64_t Counter::count() const {
  int64_t sum = 0;
  for (const Shard &shard : shards)
    sum += shard.count;
  return sum;
}

int64_t Counter::bytes() const {
  int64_t sum = 0;
  for (const Shard &shard : shards)
    sum += shard.bytes;
  return sum;
}

void Counter::reset() {
  for (Shard &shard : shards)
    shard.count = shard.bytes = 0;
  if (touched)
    std::fill_n(touched.data(), elements * words(), 0);
}

void Counter::expect(Memory &memory, int64_t count, int64_t size) {
  if (count == elements && size == recordSize)
    return;
  elements = 0;
  recordSize = std::max<int64_t>(1, size);
  touched = {};
  touched = Array<uint64_t>(memory, count * words(), Use::State);
  std::fill_n(touched.data(), count * words(), 0);
  elements = count;
}

void Counter::touch(int64_t element, int64_t first, int64_t size) noexcept {
  if (element < 0 || element >= elements || first < 0 || size <= 0 ||
      first + size > recordSize)
    return; // an error that generated code reports
  for (int64_t bit = first / share(); bit <= (first + size - 1) / share();
       ++bit) {
    std::atomic_ref word(touched[element * words() + bit / 64]);
    uint64_t mask = uint64_t(1) << (bit % 64);
    if (~word.load(std::memory_order_relaxed) & mask)
      word.fetch_or(mask, std::memory_order_relaxed);
  }
}

int64_t Counter::distinct() const {
  int64_t sum = 0;
  for (int64_t i = 0; i < elements; ++i)
    sum += std::any_of(&touched[i * words()], &touched[i * words()] + words(),
                       [](uint64_t word) { return word != 0; });
  return sum;
}

int64_t Counter::distinctBytes() const {
  int64_t bits = 0;
  for (int64_t i = 0; i < elements * words(); ++i)
    bits += std::popcount(touched[i]);
  // Four bytes may be one that was accessed and three that were not.
  return std::min(bits * share(), bytes());
}

static Counter *find(pikort_pipeline *p, int32_t index) {
  return index >= 0 && index < static_cast<int32_t>(p->counters.size())
             ? p->counters[index].get()
             : nullptr;
}

static bool isAccess(int32_t kind) {
  return kind >= PIKORT_READS && kind <= PIKORT_ATOMICS;
}

/// The edge that emissions leave by, or null.
static const Edge *findEdge(const pikort_pipeline &p, const Counter &counter) {
  if (counter.kind == PIKORT_EMISSIONS)
    for (const Edge &edge : p.edges)
      if (p.stages[edge.producer].name == counter.stage &&
          edge.port == counter.part)
        return &edge;
  return nullptr;
}

void piko::rt::startCounters(pikort_pipeline &p) {
  for (const std::unique_ptr<Counter> &counter : p.counters) {
    if (!isAccess(counter->kind))
      continue;
    const State &state = p.states[counter->part];
    int64_t elements = 1;
    for (int64_t extent : state.view.extent)
      elements *= extent;
    counter->expect(p.memory, elements, p.records[state.record].size);
  }
}

extern "C" {

void pikoir_declare_counter(pikort_pipeline *p, int32_t index, int32_t kind,
                            const char *stage, int32_t part, int32_t around,
                            const char *place) {
  guarded(p, "pipeline", [&] {
    bool known = isAccess(kind)
                     ? part >= 0 && part < int32_t(p->states.size())
                     : kind >= PIKORT_CALLS && kind <= PIKORT_ACTIVE_LANES;
    if (index != static_cast<int32_t>(p->counters.size()) || !known ||
        around >= index || !stage)
      throw Failure{PIKORT_BAD_PROGRAM,
                    "counter " + std::to_string(index) + " makes no sense"};
    auto counter = std::make_unique<Counter>();
    counter->kind = kind;
    counter->stage = stage;
    counter->part = part;
    counter->around = around;
    counter->place = place ? place : "";
    p->counters.push_back(std::move(counter));
  });
}

void pikoir_count(pikort_pipeline *p, int32_t index, int64_t amount) {
  if (Counter *counter = find(p, index))
    counter->add(amount, 0);
}

void pikoir_count_element(pikort_pipeline *p, int32_t index, int64_t x,
                          int64_t y, int64_t z, int64_t w, int64_t bytes,
                          int64_t offset) {
  Counter *counter = find(p, index);
  if (!counter)
    return;
  const int64_t *extent = p->states[counter->part].view.extent;
  counter->add(1, bytes);
  counter->touch(((w * extent[2] + z) * extent[1] + y) * extent[0] + x, offset,
                 bytes);
}

int32_t pikort_counter_count(const pikort_pipeline *p) {
  return p ? static_cast<int32_t>(p->counters.size()) : 0;
}

int32_t pikort_get_counter(pikort_pipeline *p, int32_t index,
                           pikort_counter *to) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  p->clearStatus();
  return guarded(p, "pipeline", [&] {
    const Counter *counter = find(p, index);
    if (!counter || !to)
      throw Failure{counter ? PIKORT_INVALID_ARGUMENT : PIKORT_NOT_FOUND,
                    counter ? "expected room for a counter, but got null"
                            : "pipeline " + quoted(p->name) +
                                  " has no counter " + std::to_string(index)};
    bool isElements = isAccess(counter->kind);
    const Edge *edge = findEdge(*p, *counter);
    *to = {};
    to->stage = counter->stage.c_str();
    to->place = counter->place.empty() ? nullptr : counter->place.c_str();
    to->kind = counter->kind;
    to->port = counter->kind == PIKORT_EMISSIONS ? counter->part : -1;
    to->around = counter->around;
    to->count = counter->count();
    to->bytes = counter->bytes();
    if (edge) {
      to->consumer = p->stages[edge->consumer].name.c_str();
      to->bytes = to->count * p->records[p->hostRecord(edge->consumer)].size;
    }
    if (isElements) {
      to->state = p->states[counter->part].name.c_str();
      to->distinct = counter->distinct();
      to->distinct_bytes = counter->distinctBytes();
    }
  });
}

} // extern "C"
