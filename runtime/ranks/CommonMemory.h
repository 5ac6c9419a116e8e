// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CommonMemory.h - Memory that ranks of one machine share ------------===//
//
// The first rank makes it, without a name that could stay behind, and says
// where; others map what they find there if it begins with the first rank's
// token. On another machine, or in another container, there is no such thing.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_RANKS_COMMONMEMORY_H
#define PIKO_RUNTIME_RANKS_COMMONMEMORY_H

#include <cstdint>

namespace piko::rt {

class CommonMemory {
public:
  /// What the first rank tells the others; no file: there is none.
  struct Place {
    int64_t process = 0, file = -1, bytes = 0;
    uint64_t token[2] = {};
  };

  CommonMemory() = default;
  CommonMemory(const CommonMemory &) = delete;
  CommonMemory &operator=(const CommonMemory &) = delete;
  ~CommonMemory() { reset(); }

  /// Of so many bytes, all of which there are; or nothing.
  Place make(int64_t bytes);
  /// That of another rank; whether it is here.
  bool find(const Place &place);
  /// Nobody can find it any more; who has found it keeps it.
  void close();
  void reset();

  uint8_t *data() const { return data_ ? data_ + tokenBytes : nullptr; }

private:
  /// So that what follows begins at a page.
  static constexpr int64_t tokenBytes = 4096;
  bool map(int file, int64_t bytes);

  uint8_t *data_ = nullptr;
  int64_t bytes_ = 0;
  int file_ = -1;
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_RANKS_COMMONMEMORY_H
