// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Declare.cpp - What a program's setup declares ----------------------===//
//
// Each function notes one declaration. A wrong one sets the status, which
// pikort_create returns; relations between declarations are checked once all
// are there, by pikort_pipeline::finish.
//
//===----------------------------------------------------------------------===//

#include "common/Pipeline.h"

#include <algorithm>
#include <bit>

using namespace piko::rt;

/// The entry `id` of a list that grows as needed.
template <class T>
static T &entry(std::vector<T> &list, int32_t id, const char *what) {
  if (id < 0 || id > 1 << 20)
    throw Failure{PIKORT_BAD_PROGRAM, std::string("expected a small ") + what +
                                          " number, but got " +
                                          std::to_string(id)};
  if (list.size() <= static_cast<size_t>(id))
    list.resize(static_cast<size_t>(id) + 1);
  return list[id];
}

/// The same, marked as declared.
template <class T>
static T &declare(std::vector<T> &list, int32_t id, const char *what) {
  T &declared = entry(list, id, what);
  if (declared.declared)
    throw Failure{PIKORT_BAD_PROGRAM, std::string("expected ") + what + " " +
                                          std::to_string(id) +
                                          " to be declared once"};
  declared.declared = true;
  return declared;
}

static void expect(bool condition, const std::string &text) {
  if (!condition)
    throw Failure{PIKORT_BAD_PROGRAM, text};
}

/// A cycle aside, a stage adds a word.
constexpr int32_t mostKeyWords = 1 << 20;

static const char *orEmpty(const char *text) { return text ? text : ""; }

static State &findState(pikort_pipeline *p, int32_t id, int32_t kind,
                        const char *what) {
  expect(id >= 0 && id < static_cast<int32_t>(p->states.size()) &&
             p->states[id].kind == kind,
         std::string("expected the number of ") + what + ", but got " +
             std::to_string(id));
  return p->states[id];
}

static State &findBuffer(pikort_pipeline *p, int32_t id) {
  return findState(p, id, PIKORT_BUFFER, "a buffer");
}

extern "C" {

void pikoir_declare_pipeline(pikort_pipeline *p, const char *name,
                             int32_t rank) {
  guarded(p, "setup", [&] {
    p->name = orEmpty(name);
    p->rank = rank;
  });
}

void pikoir_declare_max_extent(pikort_pipeline *p, int64_t cells) {
  p->maxExtent = cells;
}

void pikoir_declare_record(pikort_pipeline *p, int32_t id, const char *name,
                           int64_t size, int64_t align) {
  guarded(p, "setup", [&] {
    Record &record = declare(p->records, id, "record");
    record.name = orEmpty(name);
    record.size = size;
    record.align = align;
    expect(size > 0 && size <= 1 << 20,
           "record " + quoted(record.name) +
               ": expected a size in [1, 1048576], but got " +
               std::to_string(size));
    expect(align > 0 && align <= 4096 &&
               std::has_single_bit(static_cast<uint64_t>(align)) &&
               size % align == 0,
           "record " + quoted(record.name) +
               ": expected an alignment that divides its size, but got " +
               std::to_string(align));
  });
}

void pikoir_declare_field(pikort_pipeline *p, int32_t record, const char *leaf,
                          int32_t type, int64_t offset, int64_t elements,
                          int64_t stride) {
  guarded(p, "setup", [&] {
    expect(record >= 0 && record < static_cast<int32_t>(p->records.size()),
           "field " + quoted(orEmpty(leaf)) +
               ": expected a declared record, but got " +
               std::to_string(record));
    expect(type >= PIKORT_F32 && type <= PIKORT_I64 && elements >= 0 &&
               elements <= 1 << 20,
           "field " + quoted(orEmpty(leaf)) + ": expected a scalar type");
    p->records[record].fields.push_back(
        {orEmpty(leaf), type, offset, elements, stride});
  });
}

void pikoir_declare_state(pikort_pipeline *p, int32_t id, const char *name,
                          int32_t kind, int32_t record, int32_t rank,
                          int32_t perSource, const void *clear) {
  guarded(p, "setup", [&] {
    State &state = declare(p->states, id, "state");
    state.name = orEmpty(name);
    state.kind = kind;
    state.record = record;
    state.rank = kind == PIKORT_BUFFER ? 1 : kind == PIKORT_CONSTANT ? 0 : rank;
    state.perSource = kind == PIKORT_BUFFER ? perSource : -1;
    expect(kind >= PIKORT_CONSTANT && kind <= PIKORT_IMAGE,
           "state " + quoted(state.name) +
               ": expected a kind in [0, 2], but got " + std::to_string(kind));
    expect(kind != PIKORT_IMAGE || (rank >= 1 && rank <= 4),
           "state " + quoted(state.name) +
               ": expected a rank in [1, 4], but got " + std::to_string(rank));
    expect(record >= 0 && record < static_cast<int32_t>(p->records.size()),
           "state " + quoted(state.name) +
               ": expected its record to be declared first");
    int64_t size = p->records[record].size;
    auto *bytes = static_cast<const uint8_t *>(clear);
    if (bytes)
      state.clear.assign(bytes, bytes + size);
    if (kind != PIKORT_CONSTANT)
      return;
    state.bytes.resize(static_cast<size_t>(size));
    if (bytes)
      state.bytes = state.clear;
    state.view = {state.bytes.data(), {1, 1, 1, 1}};
    state.bound = bytes != nullptr;
  });
}

void pikoir_declare_fixed(pikort_pipeline *p, int32_t id, const char *field,
                          int64_t offset, int64_t size, int64_t bits) {
  guarded(p, "setup", [&] {
    expect(id >= 0 && id < static_cast<int32_t>(p->states.size()),
           "expected declared state that is fixed, but got " +
               std::to_string(id));
    int32_t kind = size ? PIKORT_CONSTANT : PIKORT_BUFFER;
    const State &state = p->states[id];
    expect(state.kind == kind && size >= 0 && size <= 8 && offset >= 0 &&
               offset + size <= p->records[state.record].size,
           "state " + quoted(state.name) + ": expected what can be fixed");
    p->fixed.push_back({id, orEmpty(field), offset, size, bits});
  });
}

void pikoir_declare_contract(pikort_pipeline *p, int32_t source, int32_t state,
                             const char *field, int32_t type,
                             int32_t isUnsigned, int64_t offset,
                             int64_t elements, int64_t stride, int32_t target,
                             int64_t below) {
  guarded(p, "setup", [&] {
    std::string name = orEmpty(field), who = "field " + quoted(name);
    expect(source < 0 || source < static_cast<int32_t>(p->sources.size()),
           who + ": expected a declared source, but got " +
               std::to_string(source));
    if (source < 0)
      (void)findBuffer(p, state);
    expect(type >= PIKORT_I8 && type <= PIKORT_I64 && offset >= 0 &&
               elements > 0 && stride >= 0,
           who + ": expected integers");
    expect(target >= 0 || below > 0,
           who + ": expected to be below at least 1, but got " +
               std::to_string(below));
    if (target >= 0)
      findBuffer(p, target).indexed = true;
    p->contracts.add({source < 0 ? -1 : source, source < 0 ? state : -1,
                      target < 0 ? -1 : target, below, type, isUnsigned != 0},
                     {std::move(name), offset, elements, stride});
  });
}

void pikoir_declare_internal(pikort_pipeline *p, int32_t id) {
  guarded(p, "setup",
          [&] { findState(p, id, PIKORT_IMAGE, "an image").internal = true; });
}

void pikoir_declare_written(pikort_pipeline *p, int32_t id) {
  guarded(p, "setup", [&] { findBuffer(p, id).written = true; });
}

void pikoir_declare_unused(pikort_pipeline *p, int32_t id) {
  guarded(p, "setup", [&] { findBuffer(p, id).unused = true; });
}

void pikoir_declare_mapping(pikort_pipeline *p, int32_t stage, int32_t source,
                            int32_t number, const char *loop, int32_t within,
                            int32_t expected, int64_t vectors, int64_t scalar) {
  guarded(p, "setup", [&] {
    auto isOwn = [&](const Mapping &other) {
      return other.stage == stage && other.source == source;
    };
    auto isNext = [&] {
      return number == 0
                 ? std::none_of(p->mappings.begin(), p->mappings.end(), isOwn)
                 : !p->mappings.empty() && isOwn(p->mappings.back()) &&
                       p->mappings.back().number == number - 1;
    };
    expect(number >= 0 && number < PIKOIR_MOST_MAPPINGS && isNext(),
           "expected the loops of a kernel in order, fewer than " +
               std::to_string(PIKOIR_MOST_MAPPINGS) + ", but got " +
               std::to_string(number));
    expect(within >= -1 && within < number,
           "expected the number of a loop around it, but got " +
               std::to_string(within));
    Mapping &mapping = p->mappings.emplace_back();
    mapping.stage = stage;
    mapping.source = source;
    mapping.number = number;
    mapping.within = within;
    mapping.loop = orEmpty(loop);
    mapping.expected = mapping.chosen = expected != 0;
    mapping.vectors = vectors;
    mapping.scalar = scalar;
  });
}

void pikoir_declare_stage(pikort_pipeline *p, int32_t id, const char *name,
                          int32_t record, const int64_t *binSize,
                          int32_t schedule, int64_t tileSplit, int32_t flags,
                          int64_t tileSize) {
  guarded(p, "setup", [&] {
    Stage &stage = declare(p->stages, id, "stage");
    stage.name = orEmpty(name);
    stage.record = record;
    stage.schedule.kind = schedule;
    stage.schedule.tileSplit = tileSplit;
    stage.flags = flags;
    stage.tileSize = tileSize;
    std::string who = "stage " + quoted(stage.name);
    expect(p->rank >= 1 && p->rank <= 4,
           who + ": expected the pipeline to be declared first");
    expect(schedule >= PIKOIR_LOAD_BALANCE && schedule <= PIKOIR_ALL,
           who + ": expected a schedule in [0, 3], but got " +
               std::to_string(schedule));
    expect(tileSplit >= 0 && tileSize >= 0,
           who + ": expected no negative tile size");
    for (int32_t d = 0; d < p->rank; ++d) {
      stage.binSize[d] = binSize ? binSize[d] : 0;
      expect(stage.binSize[d] >= 0,
             who + ": expected a bin size of at least 0, but got " +
                 std::to_string(stage.binSize[d]));
    }
  });
}

void pikoir_declare_source(pikort_pipeline *p, int32_t index, int32_t stage) {
  guarded(p, "setup",
          [&] { declare(p->sources, index, "source").stage = stage; });
}

void pikoir_declare_edge(pikort_pipeline *p, int32_t producer, int32_t port,
                         int32_t consumer) {
  guarded(p, "setup", [&] {
    Edge &edge = p->edges.emplace_back();
    edge.producer = producer;
    edge.port = port;
    edge.consumer = consumer;
  });
}

void pikoir_declare_local(pikort_pipeline *p, int32_t producer, int32_t port) {
  guarded(p, "setup", [&] { p->joins.push_back({producer, port, true}); });
}

void pikoir_declare_join(pikort_pipeline *p, int32_t producer, int32_t port,
                         int32_t gather, int32_t keys) {
  guarded(p, "setup", [&] {
    expect(keys >= 0 && keys <= mostKeyWords,
           "port " + std::to_string(port) +
               ": expected keys of at least 0 words, but got " +
               std::to_string(keys));
    p->joins.push_back({producer, port, false, gather, keys});
  });
}

void pikoir_declare_keys(pikort_pipeline *p, int32_t stage, int32_t keys) {
  guarded(p, "setup", [&] {
    expect(keys >= 0 && keys <= mostKeyWords,
           "stage " + std::to_string(stage) +
               ": expected keys of at least 0 words, but got " +
               std::to_string(keys));
    entry(p->stages, stage, "stage").keyWidth = keys;
  });
}

void pikoir_declare_root(pikort_pipeline *p, int32_t stage, int32_t root) {
  guarded(p, "setup", [&] { entry(p->stages, stage, "stage").root = root; });
}

void pikoir_declare_cycle(pikort_pipeline *p, int32_t id, const int32_t *stages,
                          int32_t count) {
  guarded(p, "setup", [&] {
    CycleShape &cycle = declare(p->cycles, id, "cycle");
    expect(count > 0, "cycle " + std::to_string(id) + ": expected stages");
    cycle.stages.assign(stages, stages + count);
  });
}

void pikoir_declare_loop(pikort_pipeline *p, int32_t id, const int32_t *stages,
                         int32_t count, int32_t keys) {
  guarded(p, "setup", [&] {
    LoopShape &loop = declare(p->loops, id, "loop");
    expect(count > 0 && keys >= 0 && keys <= mostKeyWords,
           "loop " + std::to_string(id) +
               ": expected stages, and keys of at least 0 words");
    loop.stages.assign(stages, stages + count);
    loop.keyWidth = keys;
  });
}

void pikoir_declare_schedule(pikort_pipeline *p, int32_t stage, int64_t batch,
                             int32_t everyBin) {
  guarded(p, "setup", [&] {
    Stage &declared = entry(p->stages, stage, "stage");
    expect(batch >= 0, "stage " + quoted(declared.name) +
                           ": expected a batch of at least 1, but got " +
                           std::to_string(batch));
    declared.schedule.batch = batch;
    declared.schedule.everyBin = everyBin != 0;
  });
}

void pikoir_declare_clears(pikort_pipeline *p, int32_t stage, int32_t state) {
  guarded(p, "setup",
          [&] { entry(p->stages, stage, "stage").clears.push_back(state); });
}

void pikoir_declare_private(pikort_pipeline *p, int32_t stage, int32_t copy,
                            int32_t state, const void *identity,
                            int32_t runShift, int32_t often,
                            pikoir_combine combine) {
  guarded(p, "setup", [&] {
    Reduction &reduction = declare(entry(p->stages, stage, "stage").reductions,
                                   copy, "private copy");
    expect(state >= 0 && state < static_cast<int32_t>(p->states.size()) &&
               p->states[state].declared &&
               p->states[state].kind != PIKORT_CONSTANT,
           "private copy " + std::to_string(copy) +
               ": expected a declared buffer or image, but got state " +
               std::to_string(state));
    expect(identity && combine && runShift >= 0 && runShift < 32,
           "private copy " + std::to_string(copy) +
               ": expected an identity, a function, and a shift in [0, 31]");
    const auto *bytes = static_cast<const uint8_t *>(identity);
    reduction.state = state;
    reduction.identity.assign(bytes,
                              bytes + p->records[p->states[state].record].size);
    reduction.runShift = runShift;
    reduction.often = often != 0;
    reduction.combine = combine;
  });
}

void pikoir_declare_selection(pikort_pipeline *p, int32_t stage,
                              int32_t selection, const int32_t *images,
                              int32_t count, int32_t often,
                              pikoir_select select) {
  guarded(p, "setup", [&] {
    Selection &declared = declare(entry(p->stages, stage, "stage").selections,
                                  selection, "selection");
    std::string who = "selection " + std::to_string(selection) + ": ";
    expect(images && count > 0 && select,
           who + "expected images and a function");
    for (int32_t state : std::vector(images, images + count))
      expect(state >= 0 && state < static_cast<int32_t>(p->states.size()) &&
                 p->states[state].declared &&
                 p->states[state].kind == PIKORT_IMAGE,
             who + "expected a declared image, but got state " +
                 std::to_string(state));
    declared.images.assign(images, images + count);
    declared.often = often != 0;
    declared.select = select;
  });
}

void pikoir_declare_strips(pikort_pipeline *p, int32_t id, int32_t source,
                           int64_t chunk, const int32_t *stages,
                           int32_t count) {
  guarded(p, "setup", [&] {
    StripGroup &group = declare(p->stripGroups, id, "group of stages");
    expect(chunk >= 0 && count > 0,
           "strips: expected stages, and a chunk of at least 0");
    group.source = source;
    group.chunk = chunk;
    group.stages.assign(stages, stages + count);
  });
}

void pikoir_declare_wait(pikort_pipeline *p, int32_t stage, int32_t waitsFor) {
  guarded(p, "setup", [&] { p->waits.push_back({stage, waitsFor}); });
}

} // extern "C"
