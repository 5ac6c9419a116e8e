// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CheckShadow.cpp - Conflicts between concurrent accesses ------------===//

#include "cpu/check/Check.h"

#include <algorithm>

using namespace piko::rt;

// --- Stages -----------------------------------------------------------------

StageRelation::StageRelation(const pikort_pipeline &p)
    : p(p), producers(p.stages.size()), waits(p.stages.size()) {
  for (const Edge &edge : p.edges)
    producers[edge.consumer].push_back(static_cast<size_t>(edge.producer));
  for (const Wait &wait : p.waits)
    waits[wait.stage].push_back(static_cast<size_t>(wait.waitsFor));
  findReachable();
  findDone();
}

void StageRelation::findReachable() {
  size_t n = p.stages.size();
  reaches.assign(n, Set(n, false));
  for (const Edge &edge : p.edges)
    reaches[edge.producer][edge.consumer] = true;
  for (size_t via = 0; via < n; ++via)
    for (size_t from = 0; from < n; ++from)
      for (size_t to = 0; to < n; ++to)
        reaches[from][to] =
            reaches[from][to] || (reaches[from][via] && reaches[via][to]);
  inRounds.assign(n, false);
  for (size_t x = 0; x < n; ++x)
    for (size_t y = 0; y < n; ++y)
      inRounds[x] = inRounds[x] || (shareCycle(x, y) && p.stages[y].collects());
}

/// Adds a stage and all that is finished when it is.
void StageRelation::addFinished(size_t stage, Set &set) const {
  if (set[stage])
    return;
  set[stage] = true;
  for (size_t producer : producers[stage])
    addFinished(producer, set);
  for (size_t waited : waits[stage])
    addFinished(waited, set);
}

/// done[y] holds the stages that are done before y begins: those that y itself
/// waits for, and those that all its producers come after.
void StageRelation::findDone() {
  size_t n = p.stages.size();
  std::vector<Set> own(n, Set(n, false));
  for (size_t y = 0; y < n; ++y) {
    for (size_t waited : waits[y])
      addFinished(waited, own[y]);
    if (p.stages[y].collects())
      for (size_t producer : producers[y])
        addFinished(producer, own[y]);
  }
  // The greatest solution, because of cycles.
  done.assign(n, Set(n, true));
  for (bool changed = true; changed;) {
    changed = false;
    for (size_t y = 0; y < n; ++y) {
      Set next(n, p.stages[y].sources.empty());
      for (size_t producer : producers[y])
        for (size_t x = 0; x < n; ++x)
          next[x] = next[x] && done[producer][x];
      for (size_t x = 0; x < n; ++x)
        next[x] = (next[x] || own[y][x]) && !shareCycle(x, y);
      changed |= next != done[y];
      done[y] = std::move(next);
    }
  }
}

bool StageRelation::areConcurrent(int32_t x, int64_t turnOfX, int32_t y,
                                  int64_t turnOfY) const {
  auto a = static_cast<size_t>(x), b = static_cast<size_t>(y);
  if (shareCycle(a, b) && inRounds[a] && turnOfX != turnOfY)
    return false;
  return !done[a][b] && !done[b][a];
}

// --- Iterations -------------------------------------------------------------

/// From the call inwards.
std::vector<int32_t> Checker::path(int32_t inner) const {
  std::vector<int32_t> strandsOnPath;
  for (int32_t s = inner; s >= 0; s = strands[s].outer)
    strandsOnPath.push_back(s);
  std::reverse(strandsOnPath.begin(), strandsOnPath.end());
  return strandsOnPath;
}

/// The iterations of one loop, between the same barriers, in which two strands
/// part; a pair of equal ones if they do not run at the same time.
std::pair<int64_t, int64_t> Checker::iterations(int32_t a, int32_t b) const {
  std::vector<int32_t> x = path(a), y = path(b);
  for (size_t i = 1; i < x.size() && i < y.size(); ++i) {
    const Strand &s = strands[x[i]], &t = strands[y[i]];
    if (s.loop != t.loop || s.interval != t.interval)
      break;
    if (s.iteration != t.iteration)
      return {s.iteration, t.iteration};
  }
  return {0, 0};
}

// --- Accesses ---------------------------------------------------------------

bool Checker::areConcurrent(const Access &a, const Access &b) const {
  if (a.call == b.call) {
    auto [first, second] = iterations(a.strand, b.strand);
    return first != second;
  }
  const CheckedCall &x = calls[a.call], &y = calls[b.call];
  return relation->areConcurrent(x.stage, x.turn, y.stage, y.turn);
}

bool Checker::conflict(const Access &a, const Access &b) const {
  bool sameStage = calls[a.call].stage == calls[b.call].stage;
  if (a.kind == b.kind &&
      (a.kind == PIKOIR_CHECK_READ || a.kind == PIKOIR_CHECK_ATOMIC ||
       (a.kind == PIKOIR_CHECK_UPDATE && sameStage)))
    return false;
  return areConcurrent(a, b);
}

void Checker::access(int32_t state, int32_t kind, const int64_t (&index)[4]) {
  const pikoir_state &view = p.states[state].view;
  int64_t linear = 0;
  for (int d = 3; d >= 0; --d) {
    if (index[d] < 0 || index[d] >= view.extent[d])
      return; // an error that generated code reports
    linear = linear * view.extent[d] + index[d];
  }
  uint64_t element = (uint64_t(state) << 44) | uint64_t(linear);
  Access access{kind & ~PIKOIR_CHECK_UPDATES, strand,
                static_cast<int64_t>(calls.size()) - 1, place};
  if (kind == (PIKOIR_CHECK_READ | PIKOIR_CHECK_UPDATES))
    reads.push_back({element, access});
  else
    record(element, access);
}

/// Whether the call that is running updates the element, too.
bool Checker::updatesPixel(uint64_t element) const {
  auto found = shadow.find(element);
  auto call = static_cast<int64_t>(calls.size()) - 1;
  return found != shadow.end() &&
         std::any_of(found->second.begin(), found->second.end(),
                     [&](const Access &access) {
                       return access.kind == PIKOIR_CHECK_UPDATE &&
                              access.call == call;
                     });
}

/// At the end of a call it is known which pixels it updates.
void Checker::flushReads() {
  for (const PendingRead &read : reads)
    if (!updatesPixel(read.element))
      record(read.element, read.access);
  reads.clear();
}

/// Notes an access and checks it against those before it.
void Checker::record(uint64_t element, const Access &access) {
  if (failed)
    return;
  std::vector<Access> &known = shadow[element];
  for (const Access &other : known)
    if (conflict(access, other))
      return failConflict(element, access, other);
  // The first and the last of a stage are enough to meet any conflict: all
  // others are concurrent with what either is concurrent with.
  Access *first = nullptr, *last = nullptr;
  for (Access &other : known)
    if (other.kind == access.kind &&
        calls[other.call].stage == calls[access.call].stage)
      (first ? last : first) = &other;
  bool same =
      first && first->call == access.call && first->strand == access.strand;
  if (first && (same || !areConcurrent(*first, access)))
    *first = access;
  else if (last)
    *last = access;
  else
    known.push_back(access);
}

// --- Messages ---------------------------------------------------------------

static std::string toPast(int32_t kind) {
  static const char *const words[] = {"read", "stored", "updated",
                                      "changed atomically"};
  return words[kind];
}

/// 'depth[3, 4]'
std::string Checker::elementText(uint64_t element) const {
  const State &state = p.states[element >> 44];
  auto rest = static_cast<int64_t>(element & ((uint64_t(1) << 44) - 1));
  std::string text = state.name + "[";
  for (int32_t d = 0; d < state.rank; ++d) {
    text += (d ? ", " : "") + std::to_string(rest % state.view.extent[d]);
    rest /= state.view.extent[d];
  }
  return quoted(text + "]");
}

void Checker::failConflict(uint64_t element, const Access &access,
                           const Access &other) {
  const CheckedCall &call = calls[access.call], &then = calls[other.call];
  std::string who = "stage " + quoted(p.stages[call.stage].name) + ", bin " +
                    std::to_string(call.bin) + ": ";
  std::string what = elementText(element) + " is " + toPast(access.kind);
  std::string here = context(access.place, access.call, "");
  if (access.call == other.call) {
    auto [a, b] = iterations(access.strand, other.strand);
    return fail(call.stage,
                who + "expected no conflict between iterations, but " + what +
                    " by iteration " + std::to_string(a) + " and " +
                    toPast(other.kind) + " by iteration " + std::to_string(b) +
                    here + context(other.place, -1, "other "));
  }
  fail(call.stage, who + "expected no conflict between concurrent calls, but " +
                       what + " here and " + toPast(other.kind) + " by stage " +
                       quoted(p.stages[then.stage].name) + ", bin " +
                       std::to_string(then.bin) + here +
                       context(other.place, other.call, "other "));
}
