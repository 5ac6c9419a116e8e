// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Check.cpp - Calls, lineages and messages of checking mode ----------===//

#include "cpu/check/Check.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

using namespace piko::rt;

/// The lineage of primitive `index` of a source; those of emissions are not
/// negative.
static int64_t lineageOf(int32_t source, int64_t index) {
  return ~((int64_t(source) << 32) | index);
}

// --- Runs -------------------------------------------------------------------

void Checker::beginRun() {
  calls.clear();
  emissions.clear();
  strands.assign(1, {});
  loops.clear();
  reads.clear();
  shadow.clear();
  turn = loopCount = trips = assignTrips = 0;
  strand = 0;
  place = nullptr;
  assignStage = -1;
  failed = false;
  finding.clear();
  errorContext.clear();
  relation = std::make_unique<StageRelation>(p);
  copies.clear();
  hostSources.clear();
  for (const Source &source : p.sources)
    hostSources.push_back(source.data);
  for (size_t s = 0; s < p.sources.size(); ++s)
    copySource(static_cast<int32_t>(s));
  p.settle();
}

void Checker::endRun() {
  for (size_t s = 0; s < hostSources.size(); ++s)
    p.sources[s].data = hostSources[s];
  hostSources.clear();
  copies.clear();
}

void Checker::copySource(int32_t s) {
  Source &source = p.sources[s];
  const Record &checked = p.records[p.stages[source.stage].record];
  int64_t hostSize = p.records[checked.host].size;
  Array<uint8_t> copy(p.memory, source.count * checked.size);
  std::memset(copy.data(), 0, static_cast<size_t>(source.count * checked.size));
  for (int64_t i = 0; i < source.count; ++i) {
    const uint8_t *from = source.data + i * hostSize;
    uint8_t *to = copy.data() + i * checked.size;
    std::memcpy(to, from, static_cast<size_t>(hostSize));
    int64_t lineage = lineageOf(s, i);
    std::memcpy(to + checked.lineageOffset, &lineage, sizeof(lineage));
    testNumbers(s, from, i);
  }
  source.data = copy.data();
  copies.push_back(std::move(copy));
}

/// Whether a leaf is the field or one of its parts.
static bool isPartOf(const std::string &leaf, const std::string &field) {
  if (leaf.compare(0, field.size(), field) != 0)
    return false;
  return leaf.size() == field.size() || leaf[field.size()] == '.' ||
         leaf[field.size()] == '[';
}

static bool holdsNaN(const Field &field, const uint8_t *primitive) {
  for (int64_t e = 0; e < field.elements; ++e) {
    const uint8_t *at = primitive + field.offset + e * field.stride;
    float single = 0;
    double number = 0;
    if (field.type == PIKORT_F64)
      std::memcpy(&number, at, sizeof(number));
    else if (field.type == PIKORT_F32)
      std::memcpy(&single, at, sizeof(single));
    if (std::isnan(single) || std::isnan(number))
      return true;
  }
  return false;
}

void Checker::testNumbers(int32_t source, const uint8_t *primitive,
                          int64_t index) {
  int32_t stage = p.sources[source].stage;
  int32_t host = p.records[p.stages[stage].record].host;
  for (const Number &number : numbers) {
    if (number.record != host)
      continue;
    for (const Field &field : p.records[host].fields) {
      if (!isPartOf(field.name, number.field) || !holdsNaN(field, primitive))
        continue;
      assign(stage, lineageOf(source, index));
      wrongValue(PIKOIR_CHECK_NAN, host, number.field.c_str());
      assign(stage, PIKOIR_NO_LINEAGE);
    }
  }
}

// --- Calls ------------------------------------------------------------------

void Checker::beginStage(int32_t stage) {
  callsOfBin.clear();
  if (p.stages[stage].collects())
    ++turn;
}

void Checker::beginCall(int32_t stage, int64_t bin, int64_t lineage) {
  flushReads();
  int64_t number = p.stages[stage].collects() ? callsOfBin[bin]++ : 0;
  calls.push_back({stage, bin, lineage, number, turn});
  strands.assign(1, {});
  loops.clear();
  strand = 0;
  ordinal = trips = 0;
  place = nullptr;
}

void Checker::assign(int32_t stage, int64_t lineage) {
  assignStage = lineage == PIKOIR_NO_LINEAGE ? -1 : stage;
  assignLineage = lineage;
  assignTrips = 0;
  place = nullptr;
}

int64_t Checker::emit() {
  emissions.push_back({static_cast<int64_t>(calls.size()) - 1, ordinal++});
  if (!loops.empty())
    loops.front().emitters.push_back(strands[path(strand)[1]].iteration);
  return static_cast<int64_t>(emissions.size()) - 1;
}

// --- Loops ------------------------------------------------------------------

/// Goes on with an iteration of the innermost loop.
void Checker::enter(int64_t iteration) {
  LoopState &loop = loops.back();
  strands.push_back(
      {loop.strand, loop.number, loop.intervals[iteration], iteration});
  strand = static_cast<int32_t>(strands.size()) - 1;
}

void Checker::loop(int32_t event, int64_t iteration) {
  if (event == PIKOIR_CHECK_BEGIN) {
    loops.push_back({loopCount++, strand, emissions.size(), {}, {}});
    return;
  }
  if (loops.empty())
    return;
  if (event == PIKOIR_CHECK_END) {
    strand = loops.back().strand;
    if (loops.size() == 1)
      numberEmissions(loops.back());
    loops.pop_back();
    return;
  }
  if (event == PIKOIR_CHECK_BARRIER)
    ++loops.back().intervals[iteration];
  enter(iteration);
}

/// Iterations that meet take turns; their emissions are in order of iteration
/// nevertheless.
void Checker::numberEmissions(const LoopState &loop) {
  std::vector<size_t> order(loop.emitters.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return loop.emitters[a] < loop.emitters[b];
  });
  int64_t first = ordinal - static_cast<int64_t>(order.size());
  for (size_t i = 0; i < order.size(); ++i)
    emissions[loop.firstEmission + order[i]].ordinal =
        first + static_cast<int64_t>(i);
}

// --- Messages ---------------------------------------------------------------

std::string Checker::callText(int64_t number) const {
  const CheckedCall &call = calls[number];
  const Stage &stage = p.stages[call.stage];
  if (!stage.collects())
    return lineageText(call.parent);
  return quoted(stage.name) + " bin " + std::to_string(call.bin) + " call " +
         std::to_string(call.number);
}

std::string Checker::hopText(const Emission &emission) const {
  const CheckedCall &call = calls[emission.call];
  return ", " + quoted(p.stages[call.stage].name) + " bin " +
         std::to_string(call.bin) + " emit " + std::to_string(emission.ordinal);
}

std::string Checker::lineageText(int64_t lineage) const {
  // Of a long way the first and the last hops, as the reference does.
  constexpr size_t shown = 8;
  std::vector<const Emission *> hops;
  std::string text;
  while (text.empty()) {
    if (lineage < 0) {
      text = "source " + std::to_string(~lineage >> 32) + " primitive " +
             std::to_string(~lineage & UINT32_MAX);
      break;
    }
    const Emission &emission = emissions[lineage];
    hops.push_back(&emission);
    if (p.stages[calls[emission.call].stage].collects())
      text = callText(emission.call);
    lineage = calls[emission.call].parent;
  }
  for (size_t left = hops.size(); left-- > 0;) {
    if (left > shown && hops.size() - left > shown) {
      text += ", ... " + std::to_string(left + 1 - shown) + " hops ...";
      left = shown;
      continue;
    }
    text += hopText(*hops[left]);
  }
  return text;
}

std::string Checker::contextOf(const Stage &stage,
                               const uint8_t *record) const {
  int64_t lineage = 0;
  std::memcpy(&lineage, record + p.records[stage.record].lineageOffset,
              sizeof(lineage));
  return "\n  lineage: " + lineageText(lineage);
}

std::string Checker::context(const char *at, int64_t call,
                             const std::string &prefix) const {
  std::string text;
  if (at)
    text += "\n  " + prefix + "at " + at;
  if (call >= 0)
    text += "\n  " + prefix + "lineage: " + callText(call);
  return text;
}

std::string Checker::currentContext() const {
  if (assignStage < 0)
    return context(place, static_cast<int64_t>(calls.size()) - 1, "");
  return context(place, -1, "") + "\n  lineage: " + lineageText(assignLineage);
}

std::string Checker::header() const {
  if (assignStage >= 0)
    return "stage " + quoted(p.stages[assignStage].name) + ": ";
  const CheckedCall &call = calls.back();
  return "stage " + quoted(p.stages[call.stage].name) + ", bin " +
         std::to_string(call.bin) + ": ";
}

void Checker::fail(int32_t stage, const std::string &text) {
  if (failed)
    return;
  finding = text;
  p.report({0, PIKORT_RULE_BROKEN, stage, 0, 0});
}

void Checker::noteError() {
  failed = true;
  errorContext = calls.empty() && assignStage < 0 ? "" : currentContext();
}

std::string Checker::describe(int32_t code, const std::string &plain) const {
  return code == PIKORT_RULE_BROKEN ? finding : plain + errorContext;
}

void Checker::wrongValue(int32_t kind, int32_t record, const char *field) {
  std::string of = quoted(field) + " of " + quoted(p.records[record].name);
  std::string text =
      kind == PIKOIR_CHECK_NAN
          ? "expected a number in field " + of + ", but got NaN"
          : "expected field " + of + " to be written, but it never was";
  fail(currentStage(), header() + text + currentContext());
}

/// An error that runs without checking know, too.
void Checker::report(int32_t code, int64_t a, int64_t b) {
  int64_t bin = assignStage >= 0 ? -1 : calls.back().bin;
  p.report({0, code, currentStage(), a, b, 0, bin});
}

void Checker::wrongIndex(int64_t index, int64_t size) {
  report(PIKORT_INDEX_OUTSIDE, index, size);
}

void Checker::endless(const char *at) {
  place = at;
  report(PIKORT_ENDLESS, PIKOIR_MOST_TRIPS, 0);
}

// --- What programs call -----------------------------------------------------

/// Does it unless the program is not checked; a lack of memory is an error of
/// the run.
template <class Body>
static void checked(pikort_pipeline *p, Body &&body) noexcept {
  try {
    if (Checker *checker = checkerOf(*p))
      body(*checker);
  } catch (...) {
    p->report({0, PIKORT_OUT_OF_MEMORY, 0, 0, 0});
  }
}

extern "C" {

void pikoir_declare_checked_record(pikort_pipeline *p, int32_t record,
                                   int32_t host, int64_t lineageOffset) {
  guarded(p, "setup", [&] {
    auto exists = [&](int32_t id) {
      return id >= 0 && id < static_cast<int32_t>(p->records.size());
    };
    if (!exists(record) || !exists(host) || lineageOffset < 0 ||
        lineageOffset + 8 > p->records[record].size ||
        p->records[host].size > lineageOffset)
      throw Failure{PIKORT_BAD_PROGRAM,
                    "expected a checked record to hold the host's and a "
                    "lineage after it"};
    p->records[record].host = host;
    p->records[record].lineageOffset = lineageOffset;
    if (std::unique_ptr<Checker> &checker = cpuOf(*p).checker; !checker)
      checker = std::make_unique<Checker>(*p);
  });
}

void pikoir_declare_number(pikort_pipeline *p, int32_t record,
                           const char *field) {
  checked(
      p, [&](Checker &checker) { checker.numbers.push_back({record, field}); });
}

void pikoir_check_call(pikort_pipeline *p, int32_t stage, int64_t bin,
                       int64_t lineage) {
  checked(p, [&](Checker &checker) { checker.beginCall(stage, bin, lineage); });
}

void pikoir_check_assign(pikort_pipeline *p, int32_t stage, int64_t lineage) {
  checked(p, [&](Checker &checker) { checker.assign(stage, lineage); });
}

int64_t pikoir_check_emit(pikort_pipeline *p) {
  int64_t lineage = lineageOf(0, 0);
  checked(p, [&](Checker &checker) { lineage = checker.emit(); });
  return lineage;
}

void pikoir_check_place(pikort_pipeline *p, const char *place) {
  checked(p, [&](Checker &checker) { checker.at(place); });
}

void pikoir_check_access(pikort_pipeline *p, int32_t state, int32_t kind,
                         int64_t x, int64_t y, int64_t z, int64_t w,
                         const char *place) {
  checked(p, [&](Checker &checker) {
    checker.at(place);
    checker.access(state, kind, {x, y, z, w});
  });
}

void pikoir_check_loop(pikort_pipeline *p, int32_t event, int64_t iteration) {
  checked(p, [&](Checker &checker) { checker.loop(event, iteration); });
}

int64_t pikoir_check_index(pikort_pipeline *p, int64_t index, int64_t size,
                           const char *place) {
  if (index >= 0 && index < size)
    return index;
  checked(p, [&](Checker &checker) {
    checker.at(place);
    checker.wrongIndex(index, size);
  });
  return 0;
}

int32_t pikoir_check_trip(pikort_pipeline *p, const char *place) {
  bool may = true;
  checked(p, [&](Checker &checker) { may = checker.trip(place); });
  return may;
}

void pikoir_check_value(pikort_pipeline *p, int32_t flag, int32_t kind,
                        int32_t record, const char *field, const char *place) {
  if (flag)
    checked(p, [&](Checker &checker) {
      checker.at(place);
      checker.wrongValue(kind, record, field);
    });
}

} // extern "C"
