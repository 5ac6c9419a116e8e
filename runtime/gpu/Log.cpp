// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Log.cpp - What a grid has emitted ----------------------------------===//
//
// The directories of a unit are in the order of its work. At the end each unit
// is opened, told its entries one after the other, and closed, as the CPU's
// kernel would do it.
//
// Room is the accelerator's, of which the host copies what was used, or address
// space that is mapped for each grid: the system gives pages where they are
// written.
//
//===----------------------------------------------------------------------===//

#include "cpu/Kernel.h"
#include "pikort/grid.h"

#include <algorithm>
#include <cstring>
#include <sys/mman.h>

using namespace piko::rt;

static constexpr size_t mostRoom = size_t(1) << 36, leastRoom = size_t(1) << 28;
/// Of the head; a multiple of what pieces are aligned to.
static constexpr int64_t headRoom = 64;
/// For what has no room: more than any entry takes.
static constexpr int64_t spareRoom = int64_t(1) << 26;
static_assert(sizeof(pikoir_entry) == 16 && sizeof(pikoir_piece) == 64,
              "as generated code has it");

/// Of what units have, in a multiple of what pieces are aligned to.
static int64_t tableBytes(int64_t units) {
  constexpr int64_t align = sizeof(pikoir_piece);
  int64_t bytes = units * static_cast<int64_t>(sizeof(pikoir_unit_log));
  return (bytes + align - 1) / align * align;
}

namespace {

struct LogPlace {
  int32_t function, stage;
  const char *name;
  int32_t code;
};

} // namespace

namespace piko::rt {

struct GridLog {
  GridLog(pikort_pipeline &p, Kernel &kernel, int32_t number, bool isSource);
  GridLog(const GridLog &) = delete;
  GridLog &operator=(const GridLog &) = delete;
  ~GridLog() {
    if (!pipeline.accelerator && !room.empty())
      munmap(room.data(), room.size());
  }

  void close();
  /// Where threads find it.
  pikoir_log *data() const {
    return reinterpret_cast<pikoir_log *>(room.data());
  }

  pikort_pipeline &pipeline;
  int32_t number;
  bool isSource;
  int64_t units;
  std::span<uint8_t> room;
  std::vector<LogPlace> places;

private:
  using Spans = std::vector<pikoir_span>;

  static std::span<uint8_t> mapRoom();
  /// Lets threads find the head.
  void begin();
  /// Makes all that they have left the host's.
  void fetch();
  /// What is at an address of theirs.
  template <class T> const T *at(int64_t address) const {
    return reinterpret_cast<const T *>(address + shift);
  }

  /// What a unit has.
  Spans collect(int64_t unit) const;
  void replayUnit(int64_t unit, const Spans &spans);
  void replay(pikoir_writer *writer, const pikoir_entry &entry);
  void fail(const pikoir_entry &entry);
  void failAll(std::vector<const pikoir_entry *> &errors);

  pikoir_log head{};
  Array<uint8_t> copy; ///< Of an accelerator's memory.
  int64_t shift = 0;   ///< From there to the copy.
};

} // namespace piko::rt

GridLog::GridLog(pikort_pipeline &p, Kernel &kernel, int32_t number,
                 bool isSource)
    : pipeline(p), number(number), isSource(isSource),
      units(kernel.input.unit_count),
      room(p.accelerator ? p.accelerator->logSpace() : mapRoom()) {
  if (room.empty())
    throw OutOfMemory{static_cast<int64_t>(leastRoom)};
  auto begins = reinterpret_cast<int64_t>(room.data());
  head.spare = begins + headRoom;
  head.units = head.spare + spareRoom;
  head.cursor = head.units + tableBytes(units);
  head.limit = begins + static_cast<int64_t>(room.size());
  begin();
}

std::span<uint8_t> GridLog::mapRoom() {
  for (size_t bytes = mostRoom; bytes >= leastRoom; bytes /= 2) {
    void *memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                        MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory != MAP_FAILED)
      return {static_cast<uint8_t *>(memory), bytes};
  }
  return {};
}

/// The table of units is zero; what threads take they write first.
void GridLog::begin() {
  if (!pipeline.accelerator) {
    *data() = head;
    return;
  }
  if (head.cursor > head.limit)
    throw OutOfMemory{head.cursor - head.limit};
  pipeline.accelerator->upload(
      room.data(), reinterpret_cast<const uint8_t *>(&head), sizeof(head));
  if (units > 0)
    pipeline.accelerator->clear(reinterpret_cast<uint8_t *>(head.units),
                                tableBytes(units));
}

void GridLog::fetch() {
  Accelerator *device = pipeline.accelerator.get();
  if (!device) {
    head = *data();
    return;
  }
  device->download(reinterpret_cast<uint8_t *>(&head), room.data(),
                   sizeof(head));
  device->finishStream();
  int64_t used = std::min(head.cursor, head.limit) - head.units;
  // Neither bins nor queues: those are what it is read for.
  copy =
      Array<uint8_t>(pipeline.memory, std::max<int64_t>(used, 1), Use::State);
  shift = reinterpret_cast<int64_t>(copy.data()) - head.units;
  if (used == 0)
    return;
  device->download(copy.data(), reinterpret_cast<uint8_t *>(head.units), used);
  device->finishStream();
}

GridLog::Spans GridLog::collect(int64_t unit) const {
  Spans found;
  int64_t next = at<pikoir_unit_log>(head.units)[unit].first;
  while (next != 0) {
    const auto *piece = at<pikoir_piece>(next);
    const auto *first = reinterpret_cast<const pikoir_span *>(piece + 1);
    found.insert(found.end(), first, first + piece->spans);
    next = piece->next;
  }
  return found;
}

void GridLog::fail(const pikoir_entry &entry) {
  const LogPlace &place = places[static_cast<size_t>(entry.number)];
  int64_t words[3]; // bin, a, b
  std::memcpy(words, &entry + 1, sizeof(words));
  switch (place.function) {
  case PIKOIR_PLACE_FAIL:
    return pikoir_fail(&pipeline, place.stage, place.name, words[0], place.code,
                       words[1], words[2]);
  case PIKOIR_PLACE_INDEX:
    return pikoir_fail_index(&pipeline, place.stage, place.name, words[0],
                             place.code, words[1], words[2]);
  default:
    return pikoir_fail_barrier(&pipeline, place.stage, place.name, words[0],
                               words[1]);
  }
}

/// In the order of primitives, each in that of its threads.
void GridLog::failAll(std::vector<const pikoir_entry *> &errors) {
  auto positionOf = [](const pikoir_entry *entry) {
    return reinterpret_cast<const int64_t *>(entry + 1)[3];
  };
  std::stable_sort(errors.begin(), errors.end(), [&](auto *a, auto *b) {
    return positionOf(a) < positionOf(b);
  });
  for (const pikoir_entry *error : errors)
    fail(*error);
}

void GridLog::replay(pikoir_writer *writer, const pikoir_entry &entry) {
  int32_t port = entry.number;
  switch (entry.kind) {
  case PIKOIR_ENTRY_RECORD: {
    uint8_t *room = pikoir_append(writer, port);
    std::memcpy(room, &entry + 1,
                static_cast<size_t>(writer->ports[port].size));
    return;
  }
  case PIKOIR_ENTRY_BUCKET: {
    int64_t bucket = 0;
    std::memcpy(&bucket, &entry + 1, sizeof(bucket));
    return isSource ? pikoir_place_source(writer, bucket)
                    : pikoir_place(writer, port, bucket);
  }
  default:
    return pikoir_next(writer);
  }
}

void GridLog::replayUnit(int64_t unit, const Spans &spans) {
  std::vector<std::pair<int32_t, pikoir_writer *>> writers;
  writers.emplace_back(-1, isSource
                               ? pikoir_open_source(&pipeline, number, unit)
                               : pikoir_open(&pipeline, number, unit));
  for (size_t s = 0; s < pipeline.stages.size() && !isSource; ++s)
    if (pipeline.stages[s].host == number)
      writers.emplace_back(
          static_cast<int32_t>(s),
          pikoir_open(&pipeline, static_cast<int32_t>(s), unit));
  std::vector<const pikoir_entry *> errors;
  for (const pikoir_span &span : spans)
    for (int64_t next = span.begin; next != span.end;) {
      const auto *entry = at<pikoir_entry>(next);
      if (entry->kind == PIKOIR_ENTRY_LINK) {
        std::memcpy(&next, &entry->number, sizeof(next));
        continue;
      }
      if (entry->kind == PIKOIR_ENTRY_ERROR)
        errors.push_back(entry);
      for (auto [stage, writer] : writers)
        if (entry->kind != PIKOIR_ENTRY_ERROR && stage == entry->stage)
          replay(writer, *entry);
      next += entry->bytes;
    }
  failAll(errors);
  for (auto it = writers.rbegin(); it != writers.rend(); ++it)
    pikoir_close(it->second);
}

void GridLog::close() {
  if (pipeline.status != PIKORT_OK)
    return; // the grid did not end
  fetch();
  if (head.cursor > head.limit)
    return pipeline.report({0, PIKORT_OUT_OF_MEMORY,
                            isSource ? pipeline.sources[number].stage : number,
                            head.cursor - head.limit, 0, 0});
  for (int64_t unit = 0; unit < units; ++unit)
    replayUnit(unit, collect(unit));
}

/// Of a stage, or of a source.
static Kernel &findKernel(pikort_pipeline &p, int32_t number, int32_t flags) {
  return flags & PIKOIR_LOG_SOURCE
             ? *cpuOf(p).sourceKernels[static_cast<size_t>(number)]
             : kernelOf(p, number);
}

extern "C" {

int64_t pikoir_blocks(pikort_pipeline *p, int32_t number, int32_t flags,
                      int64_t threads) {
  if (p->status != PIKORT_OK)
    return 0;
  return findKernel(*p, number, flags).input.unit_count;
}

pikoir_log *pikoir_log_open(pikort_pipeline *p, int32_t number, int32_t flags) {
  pikoir_log *opened = nullptr;
  guarded(p, "run", [&] {
    auto log =
        std::make_shared<GridLog>(*p, findKernel(*p, number, flags), number,
                                  (flags & PIKOIR_LOG_SOURCE) != 0);
    opened = log->data();
    cpuOf(*p).logs[opened] = std::move(log);
  });
  return opened;
}

void pikoir_log_place(pikort_pipeline *p, pikoir_log *log, int32_t place,
                      int32_t function, int32_t stage, const char *name,
                      int32_t code) {
  if (!log)
    return;
  auto &places = cpuOf(*p).logs.at(log)->places;
  if (places.size() <= static_cast<size_t>(place))
    places.resize(static_cast<size_t>(place) + 1);
  places[static_cast<size_t>(place)] = {function, stage, name, code};
}

void pikoir_log_close(pikort_pipeline *p, pikoir_log *log) {
  if (!log)
    return;
  auto found = cpuOf(*p).logs.find(log);
  guarded(p, "run", [&] { found->second->close(); });
  cpuOf(*p).logs.erase(found);
}

} // extern "C"
