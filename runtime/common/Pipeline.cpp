// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Pipeline.cpp - Completes declarations, keeps the status ------------===//

#include "common/Pipeline.h"

#include <algorithm>
#include <tuple>

using namespace piko::rt;

// --- Completing declarations ------------------------------------------------

[[noreturn]] static void bad(const std::string &text) {
  throw Failure{PIKORT_BAD_PROGRAM, text};
}

/// True if some byte of the record belongs to no field.
static bool hasPadding(const Record &record) {
  std::vector<bool> covered(static_cast<size_t>(record.size));
  for (const Field &field : record.fields) {
    static constexpr int64_t bytes[] = {4, 8, 1, 2, 4, 8};
    for (int64_t e = 0; e < field.elements; ++e)
      for (int64_t b = 0; b < bytes[field.type]; ++b) {
        int64_t at = field.offset + e * field.stride + b;
        if (at < 0 || at >= record.size)
          bad("record " + quoted(record.name) + ": expected field " +
              quoted(field.name) + " inside " + std::to_string(record.size) +
              " bytes, but got offset " + std::to_string(at));
        covered[static_cast<size_t>(at)] = true;
      }
  }
  return std::find(covered.begin(), covered.end(), false) != covered.end();
}

void pikort_pipeline::checkDeclared() {
  if (rank < 1 || rank > 4)
    bad("pipeline " + quoted(name) + ": expected a rank in [1, 4], but got " +
        std::to_string(rank));
  auto all = [&](const auto &list, const char *what) {
    for (size_t i = 0; i < list.size(); ++i)
      if (!list[i].declared)
        bad("pipeline " + quoted(name) + ": expected " + what + " " +
            std::to_string(i) + " to be declared");
  };
  all(records, "record");
  all(states, "state");
  all(stages, "stage");
  all(sources, "source");
  all(stripGroups, "group of stages");
  all(cycles, "cycle");
  all(loops, "loop");
  auto checkRecord = [&](int32_t id, const std::string &user) {
    if (id < 0 || id >= static_cast<int32_t>(records.size()))
      bad(quoted(user) + ": expected a declared record, but got " +
          std::to_string(id));
  };
  for (Record &record : records)
    record.padded = hasPadding(record);
  for (const Stage &stage : stages) {
    checkRecord(stage.record, stage.name);
    if (stage.takesList() && stage.tileSize > 0)
      bad("stage " + quoted(stage.name) +
          ": a process that takes a list has no owner tiles");
    if (!stage.takesList() && (stage.schedule.batch || stage.schedule.everyBin))
      bad("stage " + quoted(stage.name) +
          ": a batch needs a process that takes a list");
    for (int32_t id : stage.clears)
      if (static_cast<size_t>(id) >= states.size() ||
          states[id].kind != PIKORT_IMAGE || stage.tileSize > 0 ||
          stage.flags & PIKOIR_SPLIT)
        bad("stage " + quoted(stage.name) +
            ": expected an image to clear, and bins that are not split, but "
            "got state " +
            std::to_string(id));
  }
  for (const State &state : states) {
    checkRecord(state.record, state.name);
    if (state.perSource >= static_cast<int32_t>(sources.size()))
      bad("state " + quoted(state.name) +
          ": expected a declared source, but got " +
          std::to_string(state.perSource));
  }
}

void pikort_pipeline::connect() {
  auto exists = [&](int32_t id) { return findStage(id) != nullptr; };
  for (size_t s = 0; s < sources.size(); ++s) {
    if (!exists(sources[s].stage))
      bad("source " + std::to_string(s) +
          ": expected a declared stage, but got " +
          std::to_string(sources[s].stage));
    stages[sources[s].stage].sources.push_back(static_cast<int32_t>(s));
  }
  for (size_t e = 0; e < edges.size(); ++e) {
    const Edge &edge = edges[e];
    if (!exists(edge.producer) || !exists(edge.consumer) || edge.port < 0 ||
        edge.port > 1 << 16)
      bad("pipeline " + quoted(name) + ": edge " + std::to_string(e) +
          " connects stages that are not declared");
    auto &outputs = stages[edge.producer].outputs;
    if (outputs.size() <= static_cast<size_t>(edge.port))
      outputs.resize(static_cast<size_t>(edge.port) + 1, -1);
    if (outputs[edge.port] >= 0)
      bad("stage " + quoted(stages[edge.producer].name) +
          ": expected one edge from port " + std::to_string(edge.port) +
          ", but got two");
    outputs[edge.port] = static_cast<int32_t>(e);
    stages[edge.consumer].inputs.push_back(static_cast<int32_t>(e));
  }
  for (const Wait &wait : waits)
    if (!exists(wait.stage) || !exists(wait.waitsFor))
      bad("pipeline " + quoted(name) + ": expected a declared stage to wait " +
          "for, but got " + std::to_string(wait.waitsFor));
}

/// Completes edges by what is said of their ports.
void pikort_pipeline::findJoins() {
  for (const PortJoin &join : joins) {
    const Stage *from = findStage(join.producer);
    bool exists = from && join.port >= 0 &&
                  join.port < static_cast<int32_t>(from->outputs.size()) &&
                  from->outputs[join.port] >= 0;
    if (!exists)
      bad("pipeline " + quoted(name) + ": expected the port of " +
          (join.local ? "a local edge" : "an edge"));
    Edge &edge = edges[from->outputs[join.port]];
    edge.local |= join.local;
    if (!join.local) {
      edge.gather = join.gather;
      edge.keyWidth = join.keyWidth;
    }
  }
}

/// Completes cycles, and loops, which are in them.
void pikort_pipeline::findCycles() {
  auto note = [&](const auto &list, int32_t Stage::*member, auto &&accepts) {
    for (size_t i = 0; i < list.size(); ++i)
      for (int32_t s : list[i].stages) {
        if (!findStage(s) || stages[s].*member >= 0 || !accepts(stages[s]))
          bad("pipeline " + quoted(name) +
              ": expected a declared stage of one cycle or loop, but got " +
              std::to_string(s));
        stages[s].*member = static_cast<int32_t>(i);
      }
  };
  note(cycles, &Stage::cycle, [](const Stage &) { return true; });
  note(loops, &Stage::loop, [](const Stage &stage) {
    return stage.cycle >= 0 && !stage.collects();
  });
  for (LoopShape &loop : loops)
    for (int32_t s : loop.stages) {
      if (s != loop.stages.front() && stages[s].cycle != loop.cycle)
        bad("stage " + quoted(stages[s].name) +
            ": expected its loop to be part of one cycle");
      loop.cycle = stages[s].cycle;
      loop.ordered |= stages[s].ordered();
    }
  for (Edge &edge : edges) {
    int32_t loop = stages[edge.producer].loop;
    edge.insideLoop = loop >= 0 && loop == stages[edge.consumer].loop;
  }
}

/// Completes the groups of strips, once cycles are known.
void pikort_pipeline::findStrips() {
  for (size_t g = 0; g < stripGroups.size(); ++g) {
    StripGroup &group = stripGroups[g];
    if (group.source < 0 ||
        group.source >= static_cast<int32_t>(sources.size()))
      bad("strips: expected a declared source, but got " +
          std::to_string(group.source));
    for (int32_t s : group.stages) {
      if (!findStage(s) || stages[s].stripGroup >= 0)
        bad("strips: expected a declared stage of one group, but got " +
            std::to_string(s));
      stages[s].stripGroup = static_cast<int32_t>(g);
      group.writes |= stages[s].writes();
    }
  }
  for (Edge &edge : edges) {
    int32_t from = stages[edge.producer].stripGroup;
    int32_t to = stages[edge.consumer].stripGroup;
    if (to >= 0 && from != to)
      bad("stage " + quoted(stages[edge.consumer].name) +
          ": runs in strips, but gets primitives of stage " +
          quoted(stages[edge.producer].name) + ", which does not run in them");
    edge.leavesStrips = from >= 0 && from != to;
  }
  for (Stage &stage : stages) {
    if (stage.stripGroup < 0)
      continue;
    if (stage.takesList())
      bad("stage " + quoted(stage.name) +
          ": a process that takes a list does not run in strips");
    const StripGroup &group = stripGroups[stage.stripGroup];
    for (int32_t source : stage.sources)
      if (source != group.source)
        bad("stage " + quoted(stage.name) + ": expected strips of one source");
    for (size_t other = 0; stage.cycle >= 0 && other < stages.size(); ++other)
      if (stages[other].cycle == stage.cycle &&
          stages[other].stripGroup != stage.stripGroup)
        bad("stage " + quoted(stage.name) +
            ": expected its cycle to run in strips as a whole");
    stage.sharesTile = group.chunk > 0 && !stage.sources.empty();
  }
}

/// Completes the stages after local edges.
void pikort_pipeline::findLocals() {
  for (const Edge &edge : edges) {
    if (!edge.local)
      continue;
    const Stage &from = stages[edge.producer], &to = stages[edge.consumer];
    auto isAlone = [](const Stage &stage) {
      return stage.cycle < 0 && stage.tileSize == 0 &&
             !(stage.flags & PIKOIR_SPLIT);
    };
    if (from.stripGroup != to.stripGroup || !to.collects() ||
        to.inputs.size() != 1 || !to.sources.empty() ||
        from.binSize != to.binSize || !isAlone(from) || !isAlone(to))
      bad("stage " + quoted(to.name) +
          ": expected a local edge between stages with the same bins, which "
          "are not split, the second of which collects what this edge brings");
  }
  for (Stage &stage : stages) {
    const Stage *at = &stage;
    while (!at->inputs.empty() && edges[at->inputs.front()].local) {
      stage.host = edges[at->inputs.front()].producer;
      at = &stages[stage.host];
      if (++stage.depth > static_cast<int32_t>(stages.size()))
        bad("stage " + quoted(stage.name) + ": expected local edges to end");
    }
    if (stage.host < 0)
      continue;
    stages[stage.host].hosts = true;
    stages[stage.host].visitsAll |= stage.schedule.everyBin;
  }
}

void pikort_pipeline::finish() {
  checkDeclared();
  connect();
  findJoins();
  findCycles();
  findStrips();
  findLocals();
  stageStats.resize(stages.size());
}

void pikort_pipeline::computeGrids() {
  for (int32_t d = 0; d < rank; ++d)
    if (domain[d] > maxExtent)
      throw Failure{PIKORT_INVALID_ARGUMENT,
                    "pipeline " + quoted(name) + ": expected at most " +
                        std::to_string(maxExtent) +
                        " cells in each dimension where positions are floats, "
                        "but the domain has " +
                        std::to_string(domain[d])};
  for (Stage &stage : stages) {
    stage.grid = stage.tileGrid = {1, 1, 1, 1};
    stage.tiles = stage.buckets = 1;
    bool overflow = false;
    for (int32_t d = 0; d < rank; ++d) {
      int64_t bin = stage.binSize[d] == 0
                        ? domain[d]
                        : std::min(stage.binSize[d], domain[d]);
      stage.grid[d] = (domain[d] + bin - 1) / bin;
      if (stage.tileSize > 0)
        stage.tileGrid[d] = (bin + stage.tileSize - 1) / stage.tileSize;
      overflow |=
          __builtin_mul_overflow(stage.tiles, stage.tileGrid[d], &stage.tiles);
      overflow |= __builtin_mul_overflow(
          stage.buckets, stage.grid[d] * stage.tileGrid[d], &stage.buckets);
    }
    // Buckets are noted in 31 bits, and one value is kept for "none".
    if (overflow || stage.buckets >= INT32_MAX)
      throw Failure{PIKORT_TOO_MANY,
                    "stage " + quoted(stage.name) +
                        ": expected fewer than 2147483647 buckets, but the "
                        "domain has more"};
  }
}

// --- Status -----------------------------------------------------------------

int32_t pikort_pipeline::fail(int32_t code, const std::string &text) noexcept {
  int32_t none = 0;
  if (!status.compare_exchange_strong(none, code))
    return code;
  errorPlace = {.kernel = runningKernel};
  try {
    message = text.empty() ? std::string("out of memory") : text;
  } catch (...) {
    message.clear();
  }
  return code;
}

void pikort_pipeline::report(const KernelError &found) noexcept {
  std::lock_guard<std::mutex> lock(errorMutex);
  if (executor->reportsInOrder()) { // the first error is the earliest
    if (hasError)
      return;
    executor->noteError();
  }
  auto key = [](const KernelError &e) {
    return std::tie(e.unit, e.code, e.stage, e.name, e.bin, e.state, e.a, e.b,
                    e.barrier);
  };
  // In one unit the first report is the first error.
  bool earlier = found.depth != error.depth ? found.depth < error.depth
                 : found.unit == INT64_MAX  ? key(found) < key(error)
                                            : found.unit < error.unit;
  if (!hasError || earlier)
    error = found;
  hasError = true;
  reported = found.code;
}

static const char *describe(BadCall call) {
  switch (call) {
  case BadCall::PlaceFirst:
    return "expected a record before its place";
  case BadCall::Next:
    return "expected one pikoir_next for each position";
  case BadCall::Nested:
    return "expected reordered emissions to end before others begin";
  case BadCall::NotReordering:
    return "expected pikoir_reorder_begin before an iteration and the end";
  case BadCall::Iteration:
    return "expected an iteration of those that pikoir_reorder_begin named";
  case BadCall::StillReordering:
    return "expected pikoir_reorder_end before the position ends";
  }
  return "made a wrong call";
}

/// Of a pixel, from numbers that have two each.
static std::string describeCell(int64_t low, int64_t high, int32_t rank) {
  std::string text = "(";
  for (int32_t d = 0; d < rank; ++d) {
    int64_t pair = d < 2 ? low : high;
    text += (d ? ", " : "") +
            std::to_string(static_cast<int32_t>(pair >> (d % 2 * 32)));
  }
  return text + ")";
}

/// "; the bin has (0, 0) to (15, 15)"; nothing where the stage is not known.
static std::string describeBin(const Stage *stage, int64_t bin,
                               const std::array<int64_t, 4> &domain,
                               int32_t rank) {
  if (!stage || bin < 0 || bin >= stage->bins())
    return "";
  std::string first = "(", last = "(";
  for (int32_t d = 0; d < rank; ++d) {
    int64_t size = stage->binSize[d] ? stage->binSize[d] : domain[d];
    int64_t count = (domain[d] + size - 1) / size;
    int64_t lo = bin % count * size;
    bin /= count;
    first += (d ? ", " : "") + std::to_string(lo);
    last +=
        (d ? ", " : "") + std::to_string(std::min(lo + size, domain[d]) - 1);
  }
  return "; the bin has " + first + ") to " + last + ")";
}

static std::string describe(const std::string &stage, const KernelError &e,
                            int32_t rank, const State *state,
                            const std::string &bin,
                            const std::string &memoryLimit) {
  std::string a = std::to_string(e.a), b = std::to_string(e.b);
  std::string text = "stage " + quoted(stage);
  if (e.bin >= 0)
    text += ", bin " + std::to_string(e.bin);
  text += ": ";
  switch (e.code) {
  case PIKORT_BIN_OUTSIDE:
    text += "expected a bin id";
    if (e.b > 0)
      text += " in [0, " + b + ")";
    text += ", but got " + a;
    if (e.a == -1)
      text += ", which binFromPosition gives outside of the domain";
    return text;
  case PIKORT_UPDATE_OUTSIDE:
    return text +
           "expected an update inside the stage's own bin, but got "
           "pixel " +
           describeCell(e.a, e.b, rank) + bin;
  case PIKORT_INDEX_OUTSIDE:
    return text + "expected an index " +
           (state ? "into " + quoted(state->name) + " " : "") + "in [0, " + b +
           "), but got " + a;
  case PIKORT_ENDLESS:
    return text + "expected a loop that ends, but it still runs after " + a +
           " iterations";
  case PIKORT_NOT_A_NUMBER:
    return text + "expected positions of numbers, but got NaN";
  case PIKORT_NOT_UNIFORM:
    return text + "expected every iteration of parallelFor to call " +
           std::string(e.barrier) +
           "() as often as iteration 0, but iteration " + a + " does not";
  case PIKORT_NO_QUOTIENT:
    return text + "expected an integer division to have a result, but it "
                  "divides by 0 or overflows";
  case PIKORT_OUT_OF_MEMORY:
    if (e.a < 0)
      return text + "expected memory of at least 0 bytes, but got " + a;
    return text + "out of memory: expected " + a + " more bytes" + memoryLimit;
  case PIKORT_BAD_PROGRAM:
    return text + describe(static_cast<BadCall>(e.a));
  default:
    return text + "failed with status " + std::to_string(e.code) + " (" + a +
           ", " + b + ")";
  }
}

void pikort_pipeline::settleReported() noexcept {
  std::lock_guard<std::mutex> lock(errorMutex);
  if (hasError) {
    hasError = false;
    try {
      Stage *stage = findStage(error.stage);
      bool hasState =
          error.state >= 0 && error.state < static_cast<int32_t>(states.size());
      std::string text = describe(
          !error.name.empty() ? std::string(error.name)
          : stage             ? stage->name
                              : std::to_string(error.stage),
          error, rank, hasState ? &states[error.state] : nullptr,
          describeBin(stage, error.bin, domain, rank), memoryLimitText(*this));
      fail(error.code, executor->describe(error.code, text));
      errorPlace = {runningKernel,
                    error.depth,
                    ranks ? executor->placeOf(error) : error.unit,
                    error.stage,
                    error.bin,
                    error.state,
                    error.a,
                    error.b};
      errorName = error.name;
      errorBarrier = error.barrier;
    } catch (...) {
      fail(error.code, {});
    }
  }
}

void pikort_pipeline::clearStatus() noexcept {
  std::lock_guard<std::mutex> lock(errorMutex);
  hasError = false;
  reported = 0;
  status = 0;
  message.clear();
  errorName.clear();
  errorBarrier.clear();
}
