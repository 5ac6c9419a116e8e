// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Siblings.cpp - The other ranks of a pipeline, in threads -----------===//

#include "ranks/Siblings.h"
#include "ranks/Ranks.h"

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string_view>

using namespace piko::rt;

Siblings::Siblings(pikort_pipeline &first, int32_t count)
    : first_(first), ranks_(static_cast<size_t>(count)),
      siblings_(static_cast<size_t>(count) - 1) {
  if (pikort_make_thread_ranks(count, ranks_.data()) != PIKORT_OK)
    throw Failure{PIKORT_OUT_OF_MEMORY, "out of memory for ranks"};
  pikort_program program = first.program;
  program.name = first.name.c_str();
  for (size_t s = 0; s < siblings_.size(); ++s) {
    Sibling &sibling = siblings_[s];
    check(sibling,
          pikort_create_on(&program, PIKORT_PROCESSOR, &sibling.pipeline));
    sibling.pipeline->ranks =
        std::make_unique<Ranks>(*sibling.pipeline, ranks_[s + 1]);
  }
  first.ranks = std::make_unique<Ranks>(first, ranks_[0]);
}

Siblings::~Siblings() {
  end();
  first_.ranks.reset();
  for (Sibling &sibling : siblings_)
    pikort_destroy(sibling.pipeline);
  pikort_free_thread_ranks(ranks_.data());
}

void Siblings::check(const Sibling &sibling, int32_t status) {
  if (status != PIKORT_OK)
    throw Failure{status, sibling.pipeline ? sibling.pipeline->message
                                           : "out of memory for ranks"};
}

void Siblings::bind(Sibling &sibling) {
  pikort_pipeline *to = sibling.pipeline;
  sibling.buffers.resize(first_.states.size());
  if (first_.domain[0] > 0)
    check(sibling, pikort_set_domain(to, first_.rank, first_.domain.data()));
  check(sibling, pikort_set_memory_limit(to, first_.memory.limit()));
  check(sibling, pikort_set_memory_budget(to, first_.memory.budget()));
  to->wantedThreads = first_.wantedThreads;
  to->stripSize = first_.stripSize;
  to->loopLimit = first_.loopLimit;
  to->rankOwners = first_.rankOwners;
  for (size_t s = 0; s < first_.states.size(); ++s) {
    const State &state = first_.states[s];
    if (!state.bound || state.internal)
      continue;
    if (state.kind == PIKORT_CONSTANT) {
      check(sibling,
            pikort_bind_constant(to, state.name.c_str(), state.bytes.data(),
                                 static_cast<int64_t>(state.bytes.size())));
      continue;
    }
    int64_t size = first_.records[state.record].size;
    auto bytes = static_cast<size_t>(state.view.extent[0] * size);
    uint8_t *data = state.view.data;
    if (bytes > 0 && (state.written || state.owned)) {
      auto &own = sibling.buffers[s];
      own.resize(bytes / sizeof(std::max_align_t) + 1);
      std::memcpy(own.data(), data, bytes);
      data = reinterpret_cast<uint8_t *>(own.data());
    }
    check(sibling, pikort_bind_buffer(to, state.name.c_str(), data,
                                      state.view.extent[0], size));
  }
  for (size_t s = 0; s < first_.sources.size(); ++s) {
    const Source &source = first_.sources[s];
    check(sibling, pikort_bind_source(
                       to, static_cast<int32_t>(s), source.data, source.count,
                       first_.records[first_.hostRecord(source.stage)].size));
  }
}

void Siblings::begin() {
  for (Sibling &sibling : siblings_)
    bind(sibling);
  for (Sibling &sibling : siblings_)
    sibling.thread = std::thread([p = sibling.pipeline] { pikort_run(p); });
}

void Siblings::end() noexcept {
  for (Sibling &sibling : siblings_)
    if (sibling.thread.joinable())
      sibling.thread.join();
}

/// What $PIKO_RANKS says; 1 if nothing.
static int32_t ranksOfEnvironment() {
  const char *text = std::getenv("PIKO_RANKS");
  if (!text || !*text)
    return 1;
  std::string_view all = text;
  int32_t count = 0;
  auto [end, error] = std::from_chars(all.begin(), all.end(), count);
  if (error != std::errc() || end != all.end() || count < 1 || count > 1024)
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  "PIKO_RANKS: expected a number of ranks from 1 to 1024, but "
                  "got '" +
                      std::string(all) + "'"};
  return count;
}

void piko::rt::prepareSiblings(pikort_pipeline &p) {
  if (p.partitionedStages == 0 || p.accelerator || (p.ranks && !p.siblings))
    return;
  int32_t count = p.threadRanks > 0 ? p.threadRanks : ranksOfEnvironment();
  if (p.siblings && static_cast<int32_t>(p.siblings->count()) != count)
    p.siblings.reset();
  if (!p.siblings && count > 1)
    p.siblings = std::make_unique<Siblings>(p, count);
}

extern "C" int32_t pikort_set_thread_ranks(pikort_pipeline *p, int32_t count) {
  if (!p)
    return PIKORT_INVALID_ARGUMENT;
  p->clearStatus();
  return guarded(p, "pipeline", [&] {
    if (p->partitionedStages == 0)
      throw Failure{PIKORT_INVALID_ARGUMENT,
                    "pipeline " + quoted(p->name) +
                        ": expected a program that is compiled for ranks "
                        "(pikoc --ranks)"};
    if (count < 0 || count > 1024)
      throw Failure{
          PIKORT_INVALID_ARGUMENT,
          "pipeline " + quoted(p->name) +
              ": expected a number of ranks from 0 to 1024, but got " +
              std::to_string(count)};
    p->threadRanks = count;
  });
}
