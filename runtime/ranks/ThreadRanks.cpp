// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ThreadRanks.cpp - Ranks in threads of one process ------------------===//
//
// A meeting has two barriers: after the first all have said where their bytes
// are, and each copies what is for it; after the second they may go.

#include "pikort/ranks.h"

#include <condition_variable>
#include <cstring>
#include <memory>
#include <mutex>
#include <vector>

namespace {

struct Room;

struct Seat {
  Room *room = nullptr;
  int32_t rank = 0;
  const void *const *send = nullptr;
  const int64_t *sendBytes = nullptr;
  bool hasLeft = false;
};

struct Room {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Seat> seats;
  size_t waiting = 0;
  uint64_t round = 0;
  bool isEmptied = false; ///< Somebody has left.

  /// Waits for all; false if some have left.
  bool wait() {
    std::unique_lock lock(mutex);
    if (isEmptied)
      return false;
    uint64_t now = round;
    if (++waiting == seats.size()) {
      waiting = 0;
      ++round;
      changed.notify_all();
      return true;
    }
    changed.wait(lock, [&] { return round != now || isEmptied; });
    return round != now;
  }
};

int32_t exchange(void *context, const void *const *send,
                 const int64_t *sendBytes, void *const *receive,
                 const int64_t *receiveBytes) {
  Seat &seat = *static_cast<Seat *>(context);
  Room &room = *seat.room;
  seat.send = send;
  seat.sendBytes = sendBytes;
  if (!room.wait())
    return 1;
  bool fits = true;
  auto self = static_cast<size_t>(seat.rank);
  for (size_t r = 0; r < room.seats.size(); ++r) {
    const Seat &other = room.seats[r];
    fits &= other.sendBytes[self] == receiveBytes[r];
    if (fits && receiveBytes[r] > 0)
      std::memcpy(receive[r], other.send[self],
                  static_cast<size_t>(receiveBytes[r]));
  }
  return room.wait() && fits ? 0 : 1;
}

const char *message(void *) { return "a rank has left the run"; }

} // namespace

extern "C" {

int32_t pikort_make_thread_ranks(int32_t size, pikort_ranks *ranks) {
  if (!ranks || size < 1 || size > PIKORT_MAX_RANKS)
    return PIKORT_INVALID_ARGUMENT;
  try {
    auto room = std::make_unique<Room>();
    room->seats.resize(static_cast<size_t>(size));
    for (int32_t r = 0; r < size; ++r) {
      Seat &seat = room->seats[static_cast<size_t>(r)];
      seat.room = room.get();
      seat.rank = r;
      ranks[r] = {r, size, &seat, exchange, message};
    }
    room.release(); // pikort_free_thread_ranks
    return PIKORT_OK;
  } catch (...) {
    return PIKORT_OUT_OF_MEMORY;
  }
}

void pikort_free_thread_ranks(pikort_ranks *ranks) {
  if (ranks && ranks->context)
    delete static_cast<Seat *>(ranks->context)->room;
}

void pikort_leave_thread_ranks(const pikort_ranks *rank) {
  if (!rank || !rank->context)
    return;
  Room &room = *static_cast<Seat *>(rank->context)->room;
  std::lock_guard lock(room.mutex);
  room.isEmptied = true;
  room.changed.notify_all();
}

} // extern "C"
