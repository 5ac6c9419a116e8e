// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Log.cpp - What a grid has emitted ----------------------------------===//
//
// Threads add entries in any order; what is in their headers orders them. At
// the end each unit is opened, told its entries one after the other, and
// closed, as the CPU's kernel would do it.
//
// Room is address space: the system gives pages where they are written.
//
//===----------------------------------------------------------------------===//

#include "cpu/Kernel.h"
#include "pikort/grid.h"

#include <algorithm>
#include <cstring>
#include <sys/mman.h>

using namespace piko::rt;

static constexpr size_t mostRoom = size_t(1) << 36, leastRoom = size_t(1) << 28;
/// For what has no room: more than any entry takes.
static constexpr int64_t spareRoom = int64_t(1) << 26;
static_assert(sizeof(pikoir_entry) == 64, "as generated code has it");

namespace {

struct Place {
  int32_t function, stage;
  const char *name;
  int32_t code;
};

struct GridLog : pikoir_log {
  GridLog(pikort_pipeline &p, int32_t number, bool isSource, int64_t units);
  GridLog(const GridLog &) = delete;
  GridLog &operator=(const GridLog &) = delete;
  ~GridLog() {
    if (memory)
      munmap(memory, room);
  }

  void close();

  pikort_pipeline &pipeline;
  int32_t number;
  bool isSource;
  int64_t units;
  void *memory = nullptr;
  size_t room = mostRoom;
  std::vector<Place> places;

private:
  std::vector<const pikoir_entry *> sortEntries() const;
  void replay(pikoir_writer *writer, const pikoir_entry &entry);
  void fail(const pikoir_entry &entry);
};

} // namespace

static int64_t numberOf(const pikoir_entry &entry) { return entry.kind >> 32; }

GridLog::GridLog(pikort_pipeline &p, int32_t number, bool isSource,
                 int64_t units)
    : pikoir_log{}, pipeline(p), number(number), isSource(isSource),
      units(units) {
  do {
    memory = mmap(nullptr, room, PROT_READ | PROT_WRITE,
                  MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory != MAP_FAILED)
      break;
    memory = nullptr;
    room /= 2;
  } while (room >= leastRoom);
  if (!memory)
    throw OutOfMemory{static_cast<int64_t>(leastRoom)};
  spare = reinterpret_cast<int64_t>(memory);
  cursor = spare + spareRoom;
  limit = spare + static_cast<int64_t>(room);
}

std::vector<const pikoir_entry *> GridLog::sortEntries() const {
  std::vector<const pikoir_entry *> entries;
  int64_t end = std::min(cursor, limit);
  for (int64_t at = spare + spareRoom; at < end;) {
    const auto *entry = reinterpret_cast<const pikoir_entry *>(at);
    if (entry->bytes == 0)
      break; // this one had no room
    if ((entry->kind & 0xff) != PIKOIR_ENTRY_MEMORY)
      entries.push_back(entry);
    at += entry->bytes;
  }
  std::sort(entries.begin(), entries.end(),
            [](const pikoir_entry *a, const pikoir_entry *b) {
              if (a->unit != b->unit)
                return a->unit < b->unit;
              return std::lexicographical_compare(a->order, a->order + 4,
                                                  b->order, b->order + 4);
            });
  return entries;
}

void GridLog::fail(const pikoir_entry &entry) {
  const Place &place = places[static_cast<size_t>(numberOf(entry))];
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

void GridLog::replay(pikoir_writer *writer, const pikoir_entry &entry) {
  auto port = static_cast<int32_t>(numberOf(entry));
  switch (entry.kind & 0xff) {
  case PIKOIR_ENTRY_RECORD: {
    uint8_t *room = pikoir_append(writer, port);
    std::memcpy(room, &entry + 1,
                static_cast<size_t>(writer->ports[port].size));
    return;
  }
  case PIKOIR_ENTRY_CELL: {
    int64_t cell = 0;
    std::memcpy(&cell, &entry + 1, sizeof(cell));
    return isSource ? pikoir_place_source(writer, cell)
                    : pikoir_place(writer, port, cell);
  }
  case PIKOIR_ENTRY_NEXT:
    return pikoir_next(writer);
  default:
    return fail(entry);
  }
}

void GridLog::close() {
  std::vector<const pikoir_entry *> entries = sortEntries();
  size_t next = 0;
  for (int64_t unit = 0; unit < units; ++unit) {
    pikoir_writer *writer = isSource
                                ? pikoir_open_source(&pipeline, number, unit)
                                : pikoir_open(&pipeline, number, unit);
    for (; next < entries.size() && entries[next]->unit == unit; ++next)
      replay(writer, *entries[next]);
    pikoir_close(writer);
  }
  if (cursor > limit)
    pipeline.report({0, PIKORT_OUT_OF_MEMORY,
                     isSource ? pipeline.sources[number].kernel->stage : number,
                     cursor - limit, 0, 0});
}

extern "C" {

pikoir_log *pikoir_log_open(pikort_pipeline *p, int32_t number, int32_t flags,
                            int64_t units) {
  return new GridLog(*p, number, (flags & PIKOIR_LOG_SOURCE) != 0, units);
}

void pikoir_log_place(pikoir_log *log, int32_t place, int32_t function,
                      int32_t stage, const char *name, int32_t code) {
  auto &places = static_cast<GridLog *>(log)->places;
  if (places.size() <= static_cast<size_t>(place))
    places.resize(static_cast<size_t>(place) + 1);
  places[static_cast<size_t>(place)] = {function, stage, name, code};
}

void pikoir_log_close(pikoir_log *log) {
  auto *grid = static_cast<GridLog *>(log);
  grid->close();
  delete grid;
}

} // extern "C"
