// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- RankCalls.cpp - What hosts and programs call of ranks --------------===//

#include "common/HostCalls.h"
#include "ranks/Ranks.h"

using namespace piko::rt;

static Stage &findStage(pikort_pipeline *p, int32_t id) {
  if (Stage *stage = p->findStage(id))
    return *stage;
  throw Failure{PIKORT_BAD_PROGRAM,
                "ranks: expected the number of a stage, but got " +
                    std::to_string(id)};
}

/// The edge of a port; throws.
static Edge &findEdge(pikort_pipeline *p, int32_t producer, int32_t port) {
  for (Edge &edge : p->edges)
    if (edge.producer == producer && edge.port == port)
      return edge;
  throw Failure{PIKORT_BAD_PROGRAM, "ranks: expected an edge from port " +
                                        std::to_string(port) + " of stage " +
                                        std::to_string(producer)};
}

static Source &findSource(pikort_pipeline *p, int32_t source) {
  if (static_cast<size_t>(source) < p->sources.size())
    return p->sources[source];
  throw Failure{PIKORT_BAD_PROGRAM,
                "ranks: expected the number of a source, but got " +
                    std::to_string(source)};
}

static void checkOwners(int32_t owners, const std::string &who) {
  if (owners < PIKORT_OWNERS_DEFAULT || owners > PIKORT_OWNERS_LOAD)
    throw Failure{PIKORT_INVALID_ARGUMENT,
                  who + ": expected a way to find owners of bins, but got " +
                      std::to_string(owners)};
}

/// The begin of errors about a piece of state that there is.
static auto nameOf(const pikort_pipeline *p, int32_t state) {
  return [=] { return "state " + quoted(p->states[state].name); };
}

static void checkState(pikort_pipeline *p, int32_t id) {
  if (id < 0 || id >= static_cast<int32_t>(p->states.size()) ||
      p->states[id].kind == PIKORT_CONSTANT)
    throw Failure{PIKORT_BAD_PROGRAM,
                  "ranks: expected the number of an image or a buffer, but "
                  "got " +
                      std::to_string(id)};
}

/// Of ranks, if there are several; ends at once where the run has failed. `who`
/// makes the begin of errors.
template <class Who, class Body>
static int32_t meeting(pikort_pipeline *p, const Who &who,
                       Body &&body) noexcept {
  int32_t status = p->settle();
  if (status != PIKORT_OK || !p->ranks)
    return status;
  Part before = p->profile.part();
  p->profile.enter(Part::Join);
  status = guarded(p, who, body);
  p->profile.enter(before);
  return status == PIKORT_OK ? p->settle() : status;
}

extern "C" {

// --- Programs ---------------------------------------------------------------

void pikoir_declare_partition(pikort_pipeline *p, int32_t stage, int32_t how) {
  guarded(p, "setup", [&] {
    Stage &declared = findStage(p, stage);
    if (how < PIKOIR_FIRST_RANK || how > PIKOIR_EACH_RANK)
      throw Failure{PIKORT_BAD_PROGRAM,
                    "stage " + quoted(declared.name) +
                        ": expected a way to partition it, but got " +
                        std::to_string(how)};
    declared.partition = how;
    declared.launchOrder = ++p->partitionedStages;
  });
}

void pikoir_declare_owners(pikort_pipeline *p, int32_t stage, int32_t owners) {
  guarded(p, "setup", [&] {
    Stage &declared = findStage(p, stage);
    checkOwners(owners, "stage " + quoted(declared.name));
    declared.owners = owners;
  });
}

void pikoir_declare_common(pikort_pipeline *p, int32_t state, int32_t stage) {
  guarded(p, "setup", [&] {
    checkState(p, state);
    if (p->states[state].kind != PIKORT_IMAGE ||
        findStage(p, stage).partition != PIKOIR_BINS)
      throw Failure{PIKORT_BAD_PROGRAM,
                    "state " + quoted(p->states[state].name) +
                        ": expected an image, and a stage whose bins have "
                        "owners"};
    p->states[state].commonStage = stage;
  });
}

void pikoir_declare_exchange(pikort_pipeline *p, int32_t producer,
                             int32_t port) {
  guarded(p, "setup", [&] { findEdge(p, producer, port).exchanged = true; });
}

void pikoir_declare_exchange_source(pikort_pipeline *p, int32_t source) {
  guarded(p, "setup", [&] { findSource(p, source).exchanged = true; });
}

int32_t pikoir_exchange(pikort_pipeline *p, int32_t producer, int32_t port) {
  auto who = [&] {
    return "exchange of stage " + quoted(findStage(p, producer).name);
  };
  return meeting(p, who,
                 [&] { p->ranks->exchange(findEdge(p, producer, port)); });
}

int32_t pikoir_exchange_source(pikort_pipeline *p, int32_t source) {
  auto who = [&] { return "exchange of source " + std::to_string(source); };
  return meeting(p, who, [&] {
    findSource(p, source);
    p->ranks->exchangeSource(source);
  });
}

static int32_t keep(pikort_pipeline *p, int32_t state, bool cleared) {
  return meeting(p, nameOf(p, state), [&] {
    checkState(p, state);
    p->ranks->keep(state, cleared);
  });
}

int32_t pikoir_keep(pikort_pipeline *p, int32_t state) {
  return keep(p, state, /*cleared=*/false);
}

int32_t pikoir_keep_cleared(pikort_pipeline *p, int32_t state) {
  return keep(p, state, /*cleared=*/true);
}

void pikoir_share_field(pikort_pipeline *p, int32_t state, int64_t offset,
                        int64_t elements, int64_t stride, int64_t bytes,
                        int32_t kind) {
  meeting(p, nameOf(p, state), [&] {
    checkState(p, state);
    p->ranks->addField({offset, elements, stride, bytes, kind});
  });
}

int32_t pikoir_share(pikort_pipeline *p, int32_t state, int32_t stage,
                     int32_t flags) {
  return meeting(p, nameOf(p, state), [&] {
    checkState(p, state);
    p->ranks->share(state, stage < 0 ? nullptr : &findStage(p, stage), flags);
  });
}

// --- Hosts ------------------------------------------------------------------

int32_t pikort_set_ranks(pikort_pipeline *p, const pikort_ranks *ranks) {
  return call(p, [&] {
    awaitRun(*p);
    if (!ranks) {
      p->ranks.reset();
      return;
    }
    if (p->partitionedStages == 0)
      invalid(
          "pipeline " + quoted(p->name) +
          ": expected a program that is compiled for ranks (pikoc --ranks)");
    if (p->accelerator)
      invalid("pipeline " + quoted(p->name) +
              ": expected it to run on the processor, because ranks of devices "
              "are not supported");
    if (ranks->size < 1 || ranks->size > PIKORT_MAX_RANKS || ranks->rank < 0 ||
        ranks->rank >= ranks->size || !ranks->exchange || !ranks->message)
      invalid("pipeline " + quoted(p->name) +
              ": expected a rank below the number of ranks, from 1 to " +
              std::to_string(PIKORT_MAX_RANKS) + ", and functions, but got " +
              std::to_string(ranks->rank) + " of " +
              std::to_string(ranks->size));
    p->ranks = std::make_unique<Ranks>(*p, *ranks);
  });
}

int32_t pikort_set_rank_owners(pikort_pipeline *p, int32_t owners) {
  return call(p, [&] {
    checkOwners(owners, "pipeline " + quoted(p->name));
    awaitRun(*p);
    p->rankOwners = owners;
  });
}

int32_t pikort_rank_count(const pikort_pipeline *p) {
  return p && p->ranks ? p->ranks->size() : 0;
}

int32_t pikort_get_rank_totals(pikort_pipeline *p, int32_t rank,
                               pikort_rank_totals *totals) {
  return call(p, [&] {
    if (!totals || rank < 0 || !p->ranks ||
        rank >= static_cast<int32_t>(p->ranks->totals.size()))
      throw Failure{PIKORT_NOT_FOUND, "expected a rank that has run, but got " +
                                          std::to_string(rank)};
    *totals = p->ranks->totals[static_cast<size_t>(rank)];
  });
}

int32_t pikort_rank_traffic_count(const pikort_pipeline *p) {
  return p && p->ranks ? static_cast<int32_t>(p->ranks->traffic.size()) : 0;
}

int32_t pikort_get_rank_traffic(pikort_pipeline *p, int32_t index,
                                pikort_rank_traffic *traffic) {
  return call(p, [&] {
    if (!traffic || index < 0 || index >= pikort_rank_traffic_count(p))
      throw Failure{PIKORT_NOT_FOUND,
                    "expected the number of an edge between ranks, but got " +
                        std::to_string(index)};
    const Ranks::Traffic &from = p->ranks->traffic[static_cast<size_t>(index)];
    *traffic = {from.from.empty() ? nullptr : from.from.c_str(),
                from.to.c_str(), from.records, from.bytes, from.kept};
  });
}

} // extern "C"
