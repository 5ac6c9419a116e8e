// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- GridLog.cpp - What kernels for a GPU have inline -------------------===//
//
// A thread puts entries into its append buffer, which is one of its own; where
// that is full it takes another piece of memory. What a block does with them is
// a round:
//   1. threads meet, and go on if one of them has something;
//   2. they vote whether they have, and a sum over warps gives each its place:
//      the order is that of threads;
//   3. one thread takes room for the directory, in which each says what it has;
//   4. records of a local edge are copied after those that the block has; where
//      they come to follows from a sum of their numbers.
//
//===----------------------------------------------------------------------===//

#include "pikort/grid_log.h"

/// What is in a log is in global memory; addresses are numbers.
#define PIKO_GLOBAL __attribute__((address_space(1)))

namespace {

constexpr int32_t warpSize = 32;
/// After the numbers of warps: what one thread tells the others.
constexpr int32_t told = warpSize;
/// Threads of a warp that are there.
using Lanes = uint32_t;

template <class T> PIKO_GLOBAL T *at(int64_t address) {
  return (PIKO_GLOBAL T *)address; // NOLINT: from a number
}
constexpr int64_t alignTo(int64_t bytes, int64_t alignment) {
  return (bytes + alignment - 1) & -alignment;
}
int32_t thread() { return __nvvm_read_ptx_sreg_tid_x(); }
int32_t count(Lanes lanes) { return __builtin_popcount(lanes); }
Lanes lanesBelow() {
  return static_cast<Lanes>(__nvvm_read_ptx_sreg_lanemask_lt());
}
int32_t shuffle(Lanes lanes, int32_t value, int32_t from) {
  return __nvvm_shfl_sync_idx_i32(lanes, value, from, warpSize - 1);
}
int64_t shuffle(Lanes lanes, int64_t value, int32_t from) {
  auto low = static_cast<uint32_t>(
           shuffle(lanes, static_cast<int32_t>(value), from)),
       high = static_cast<uint32_t>(
           shuffle(lanes, static_cast<int32_t>(value >> 32), from));
  return static_cast<int64_t>(low | static_cast<uint64_t>(high) << 32);
}
/// A barrier that says whether the condition holds for a thread of the block.
bool meetAny(bool condition) { return __nvvm_bar0_or(condition) != 0; }

//===----------------------------------------------------------------------===//
// Memory
//===----------------------------------------------------------------------===//

/// A piece of so many bytes, a multiple of 64: its address, or 0.
int64_t take(pikoir_log *log, int64_t bytes, int64_t kind) {
  int64_t mine = __atomic_fetch_add(&log->cursor, bytes, __ATOMIC_RELAXED);
  if (mine + bytes > log->limit)
    return 0;
  at<pikoir_piece>(mine)->bytes = bytes;
  at<pikoir_piece>(mine)->kind = kind;
  return mine;
}

/// The same for so many bytes after a header.
int64_t takeWithHeader(pikoir_log *log, int64_t bytes, int64_t kind) {
  constexpr int64_t header = sizeof(pikoir_piece);
  return take(log, alignTo(header + bytes, header), kind);
}

/// So many bytes for each of the lanes of a warp that come here together, in
/// one piece: where those of this one begin, or 0.
int64_t takeForLanes(pikoir_log *log, int64_t bytes) {
  auto lanes = static_cast<Lanes>(__nvvm_activemask());
  int64_t rank = count(lanes & lanesBelow());
  int64_t piece = 0;
  if (rank == 0)
    piece = takeWithHeader(log, count(lanes) * bytes, PIKOIR_PIECE_MEMORY);
  piece = shuffle(lanes, piece, __builtin_ctz(lanes));
  return piece == 0 ? 0 : piece + int64_t(sizeof(pikoir_piece)) + rank * bytes;
}

//===----------------------------------------------------------------------===//
// Append buffers
//===----------------------------------------------------------------------===//

/// The words of an append buffer.
struct Words {
  Words(int64_t *first, int64_t stride) : first(first), stride(stride) {}
  /// Of one of several buffers.
  Words(int64_t *first, int64_t stride, int64_t buffer)
      : Words(first + buffer * PIKOIR_APPEND_WORDS * stride, stride) {}
  int64_t &operator[](int64_t which) const { return first[which * stride]; }
  int64_t *first;
  int64_t stride;
};

constexpr int64_t entryHeader = sizeof(pikoir_entry),
                  pieceHeader = sizeof(pikoir_piece);

/// Two numbers of an entry, in one store.
void store(int64_t address, int64_t low, int64_t high) {
  *at<uint64_t>(address) =
      static_cast<uint32_t>(low) | static_cast<uint64_t>(high) << 32;
}

/// More memory for an append buffer, with an entry of `size` bytes at its
/// front: the entry's address, or that of memory that nobody reads. What comes
/// first is for a record and where it goes, as most threads have no more, and
/// taken by all lanes of a warp together: an atomic each would make them wait
/// for each other.
int64_t extend(pikoir_log *log, Words words, int64_t size) {
  constexpr int64_t least = 512, others = 6 * entryHeader;
  int64_t single = size + others + entryHeader;
  int64_t need = alignTo(pieceHeader + size + entryHeader, 64);
  need = need < least ? least : need;
  int64_t cursor = words[PIKOIR_APPEND_CURSOR],
          before = words[PIKOIR_APPEND_BYTES];
  auto more = static_cast<int64_t>(static_cast<uint64_t>(2 * before) >
                                           static_cast<uint64_t>(need)
                                       ? 2 * before
                                       : need);
  bool isNew = cursor == 0;
  int64_t first;
  if (isNew) {
    first = takeForLanes(log, single);
  } else {
    int64_t piece = take(log, more, PIKOIR_PIECE_MEMORY);
    first = piece == 0 ? 0 : piece + pieceHeader;
  }
  if (first == 0)
    return log->spare;
  if (isNew) {
    words[PIKOIR_APPEND_BEGIN] = first;
  } else {
    store(cursor, entryHeader, PIKOIR_ENTRY_LINK);
    *at<int64_t>(cursor + int64_t(offsetof(pikoir_entry, number))) = first;
  }
  words[PIKOIR_APPEND_CURSOR] = first + size;
  int64_t room = isNew ? single : more - pieceHeader;
  words[PIKOIR_APPEND_LIMIT] = first + room - entryHeader;
  // Twice as much is a multiple of 64.
  words[PIKOIR_APPEND_BYTES] = isNew ? alignTo(single, 32) : more;
  return first;
}

int64_t append(pikoir_log *log, Words words, int64_t kind, int64_t number,
               int64_t stage, int64_t bytes) {
  int64_t size = alignTo(entryHeader + bytes, entryHeader);
  int64_t entry = words[PIKOIR_APPEND_CURSOR];
  if (entry + size <= words[PIKOIR_APPEND_LIMIT])
    words[PIKOIR_APPEND_CURSOR] = entry + size;
  else
    entry = extend(log, words, size);
  store(entry, size, kind);
  store(entry + int64_t(offsetof(pikoir_entry, number)), number, stage);
  return entry;
}

/// The words of an append buffer for errors, of which there may have been none:
/// their address, or 0 where there is no memory.
int64_t openErrorBuffer(pikoir_log *log, Words buffers) {
  int64_t known = buffers[PIKOIR_APPEND_BEGIN];
  if (known != 0)
    return known;
  int64_t piece = takeWithHeader(
      log, PIKOIR_APPEND_WORDS * int64_t(sizeof(int64_t)), PIKOIR_PIECE_MEMORY);
  if (piece == 0)
    return 0;
  int64_t words = piece + pieceHeader;
  for (int32_t i = 0; i < PIKOIR_APPEND_WORDS; ++i)
    at<int64_t>(words)[i] = 0;
  buffers[PIKOIR_APPEND_BEGIN] = words;
  return words;
}

//===----------------------------------------------------------------------===//
// Sums over the threads of a block
//===----------------------------------------------------------------------===//

/// Of the block's `threads`, those of a warp.
struct Warp {
  explicit Warp(int32_t threads) : threads(threads) {}
  Lanes all() const {
    return threads >= warpSize ? ~Lanes(0) : (Lanes(1) << threads) - 1;
  }
  int32_t size() const { return threads < warpSize ? threads : warpSize; }
  static int32_t lane() { return thread() % warpSize; }
  static int32_t number() {
    return static_cast<int32_t>(static_cast<uint32_t>(thread()) / warpSize);
  }
  int32_t threads;
};

/// A number of the thread's, those of all below it, and of all.
struct Sum {
  int64_t below, total;
};

/// Of the warps below; of each warp one lane is the writer. After a barrier:
/// what was said in the last round has been read.
Sum sumOfWarps(Warp warp, int64_t *words, int64_t ofWarp, bool isWriter) {
  if (isWriter)
    words[Warp::number()] = ofWarp;
  __syncthreads();
  Sum sum{0, 0};
  for (int32_t other = 0; other * warpSize < warp.threads; ++other) {
    int64_t number = words[other];
    sum.below += other < Warp::number() ? number : 0;
    sum.total += number;
  }
  return sum;
}

/// How many of the threads below are meant.
Sum countBelow(Warp warp, int64_t *words, bool has) {
  auto votes = static_cast<Lanes>(__nvvm_vote_ballot_sync(warp.all(), has));
  Sum sum = sumOfWarps(warp, words, count(votes), Warp::lane() == 0);
  sum.below += count(votes & lanesBelow());
  return sum;
}

Sum sumBelow(Warp warp, int64_t *words, int64_t number) {
  auto upTo = static_cast<int32_t>(number);
  for (int32_t distance = 1; distance < warp.size(); distance *= 2) {
    int32_t other = shuffle(warp.all(), upTo, Warp::lane() - distance);
    upTo += Warp::lane() >= distance ? other : 0;
  }
  auto wide = static_cast<int64_t>(static_cast<uint32_t>(upTo));
  Sum sum = sumOfWarps(warp, words, wide, Warp::lane() == warp.size() - 1);
  sum.below += wide - number;
  return sum;
}

//===----------------------------------------------------------------------===//
// The directory
//===----------------------------------------------------------------------===//

/// Appends a directory to the unit's.
void link(pikoir_log *log, int64_t unit, int64_t directory) {
  at<pikoir_piece>(directory)->unit = unit;
  at<pikoir_piece>(directory)->next = 0;
  int64_t mine = log->units + unit * int64_t(sizeof(pikoir_unit_log));
  int64_t before = at<pikoir_unit_log>(mine)->last;
  *at<int64_t>(before == 0 ? mine + int64_t(offsetof(pikoir_unit_log, first))
                           : before + int64_t(offsetof(pikoir_piece, next))) =
      directory;
  at<pikoir_unit_log>(mine)->last = directory;
}

void publish(pikoir_log *log, int64_t unit, int64_t *words, Warp warp,
             pikoir_span mine, bool has) {
  constexpr int64_t span = sizeof(pikoir_span);
  Sum spans = countBelow(warp, words, has);
  if (thread() == 0) {
    int64_t piece =
        takeWithHeader(log, spans.total * span, PIKOIR_PIECE_DIRECTORY);
    if (piece != 0) {
      at<pikoir_piece>(piece)->spans = spans.total;
      link(log, unit, piece);
    }
    words[told] = piece;
  }
  __syncthreads();
  if (!has)
    return;
  int64_t piece = words[told];
  if (piece == 0)
    return;
  PIKO_GLOBAL auto *place =
      at<pikoir_span>(piece + pieceHeader + spans.below * span);
  place->begin = mine.begin;
  place->end = mine.end;
}

//===----------------------------------------------------------------------===//
// Local edges
//===----------------------------------------------------------------------===//

template <class Word> void copyWords(int64_t from, int64_t to, int64_t size) {
  for (int64_t i = 0; i < size; i += int64_t(sizeof(Word)))
    *at<Word>(to + i) = *at<Word>(from + i);
}

/// Of the same alignment, which follows from their number.
void copyBytes(int64_t from, int64_t to, int64_t size) {
  if (size % 8 == 0)
    copyWords<uint64_t>(from, to, size);
  else if (size % 4 == 0)
    copyWords<uint32_t>(from, to, size);
  else if (size % 2 == 0)
    copyWords<uint16_t>(from, to, size);
  else
    copyWords<uint8_t>(from, to, size);
}

/// What was placed between two places of an append buffer.
void copyPlaced(int64_t from, int64_t end, int64_t to, int64_t size) {
  while (from != end) {
    const PIKO_GLOBAL auto *entry = at<pikoir_entry>(from);
    if (entry->kind == PIKOIR_ENTRY_KEPT) {
      copyBytes(from + entryHeader, to, size);
      to += size;
    }
    from = entry->kind == PIKOIR_ENTRY_LINK
               ? *at<int64_t>(from + int64_t(offsetof(pikoir_entry, number)))
               : from + entry->bytes;
  }
}

/// Room for so many records; the last told is whether there is.
void reserve(pikoir_log *log, int64_t *kept, int64_t most, int64_t size,
             int64_t *words, int32_t threads) {
  int64_t old = kept[PIKOIR_LOCAL_RECORDS], room = kept[PIKOIR_LOCAL_ROOM],
          records = kept[PIKOIR_LOCAL_COUNT];
  __syncthreads();
  if (thread() == 0) {
    words[told] = 1;
    if (most * size > room) {
      int64_t more = alignTo(pieceHeader + 2 * most * size, pieceHeader);
      int64_t piece = take(log, more, PIKOIR_PIECE_MEMORY);
      words[told] = piece != 0;
      if (piece != 0) {
        kept[PIKOIR_LOCAL_RECORDS] = piece + pieceHeader;
        kept[PIKOIR_LOCAL_ROOM] = more - pieceHeader;
      }
    }
  }
  __syncthreads();
  int64_t now = kept[PIKOIR_LOCAL_RECORDS];
  if (old != now)
    for (int64_t i = thread(); i < records; i += threads)
      copyBytes(old + i * size, now + i * size, size);
}

void keepRecords(pikoir_log *log, Words buffer, int64_t *kept, int64_t size,
                 int64_t *words, Warp warp) {
  Sum placed = sumBelow(warp, words, buffer[PIKOIR_APPEND_KEPT]);
  int64_t records = kept[PIKOIR_LOCAL_COUNT], most = records + placed.total;
  reserve(log, kept, most, size, words, warp.threads);
  bool has = words[told] != 0;
  if (has)
    copyPlaced(buffer[PIKOIR_APPEND_BEGIN], buffer[PIKOIR_APPEND_CURSOR],
               kept[PIKOIR_LOCAL_RECORDS] + (records + placed.below) * size,
               size);
  __syncthreads();
  if (has && thread() == 0)
    kept[PIKOIR_LOCAL_COUNT] = most;
  __syncthreads();
}

} // namespace

extern "C" {

void *pikoir_grid_append(pikoir_log *log, int64_t *buffers, int64_t stride,
                         int64_t buffer, int32_t kind, int32_t number,
                         int32_t stage, int64_t bytes) {
  Words words(buffers, stride, buffer);
  int64_t entry = append(log, words, kind, number, stage, bytes);
  if (buffer != 0)
    words[PIKOIR_APPEND_LAST] = entry;
  return (void *)at<char>(entry + entryHeader);
}

void pikoir_grid_keep(int64_t *buffers, int64_t stride, int64_t buffer) {
  Words words(buffers, stride, buffer);
  PIKO_GLOBAL auto *entry = at<pikoir_entry>(words[PIKOIR_APPEND_LAST]);
  if (entry->kind == PIKOIR_ENTRY_KEPT)
    return;
  entry->kind = PIKOIR_ENTRY_KEPT;
  ++words[PIKOIR_APPEND_KEPT];
}

void pikoir_grid_fail(pikoir_log *log, int64_t *first, int64_t stride,
                      int32_t apart, int32_t place, int64_t bin, int64_t a,
                      int64_t b) {
  constexpr int64_t bytes = 4 * sizeof(int64_t);
  Words buffers(first, stride);
  int64_t payload;
  if (!apart) {
    payload = append(log, buffers, PIKOIR_ENTRY_ERROR, place, -1, bytes) +
              entryHeader;
  } else {
    int64_t words = openErrorBuffer(log, buffers);
    payload = words == 0 ? log->spare
                         : append(log, {(int64_t *)at<int64_t>(words), 1},
                                  PIKOIR_ENTRY_ERROR, place, -1, bytes) +
                               entryHeader;
  }
  PIKO_GLOBAL int64_t *out = at<int64_t>(payload);
  out[0] = bin;
  out[1] = a;
  out[2] = b;
  out[3] = buffers[PIKOIR_APPEND_POSITION];
  log->errors = 1;
}

void pikoir_grid_flush(pikoir_log *log, int64_t *first, int64_t stride,
                       int32_t apart, int64_t unit, int64_t *words,
                       int32_t threads) {
  Words buffers(first, stride);
  pikoir_span mine{0, 0};
  PIKO_GLOBAL int64_t *inLog = nullptr;
  if (!apart) {
    mine = {buffers[PIKOIR_APPEND_BEGIN], buffers[PIKOIR_APPEND_CURSOR]};
  } else if (buffers[PIKOIR_APPEND_BEGIN] != 0) {
    inLog = at<int64_t>(buffers[PIKOIR_APPEND_BEGIN]);
    mine = {inLog[PIKOIR_APPEND_BEGIN], inLog[PIKOIR_APPEND_CURSOR]};
  }
  bool has = mine.begin != mine.end;
  if (!meetAny(has))
    return;
  publish(log, unit, words, Warp(threads), mine, has);
  if (!has)
    return;
  if (apart)
    inLog[PIKOIR_APPEND_BEGIN] = mine.end;
  else
    buffers[PIKOIR_APPEND_BEGIN] = mine.end;
}

void pikoir_grid_flush_local(pikoir_log *log, int64_t *buffers, int64_t stride,
                             int64_t buffer, int64_t *kept, int64_t size,
                             int64_t *words, int32_t threads) {
  Words mine(buffers, stride, buffer);
  if (meetAny(mine[PIKOIR_APPEND_KEPT] != 0))
    keepRecords(log, mine, kept + (buffer - 1) * PIKOIR_LOCAL_WORDS, size,
                words, Warp(threads));
  mine[PIKOIR_APPEND_BEGIN] = mine[PIKOIR_APPEND_CURSOR];
  mine[PIKOIR_APPEND_KEPT] = 0;
}

int64_t pikoir_grid_allocate(pikoir_log *log, int64_t size) {
  // What is too large, or negative, must not wrap.
  constexpr uint64_t most = uint64_t(1) << 48;
  uint64_t bytes =
      static_cast<uint64_t>(size) < most ? static_cast<uint64_t>(size) : most;
  int64_t piece =
      takeWithHeader(log, static_cast<int64_t>(bytes), PIKOIR_PIECE_MEMORY);
  return piece == 0 ? 0 : piece + pieceHeader;
}

int64_t pikoir_grid_take_units(pikoir_log *log, int32_t launch, int64_t count) {
  return __atomic_fetch_add(&log->taken[launch], count, __ATOMIC_RELAXED);
}

int64_t pikoir_grid_rest(pikoir_log *log, int64_t unit) {
  return at<pikoir_unit_log>(log->units)[unit].rest;
}

void pikoir_grid_leave_rest(pikoir_log *log, int64_t unit, int64_t position) {
  at<pikoir_unit_log>(log->units)[unit].rest = position + 1;
}

} // extern "C"
