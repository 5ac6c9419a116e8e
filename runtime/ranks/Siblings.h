// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Siblings.h - The other ranks of a pipeline, in threads -------------===//
//
// A pipeline that is to be several ranks by itself is the first of them. The
// others are pipelines of the same program, which are bound as it is before
// each run, and run in threads beside it. What kernels write is each rank's
// own.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_RANKS_SIBLINGS_H
#define PIKO_RUNTIME_RANKS_SIBLINGS_H

#include "common/Pipeline.h"
#include "pikort/ranks.h"

#include <cstddef>
#include <thread>

namespace piko::rt {

class Siblings {
public:
  /// Throws.
  Siblings(pikort_pipeline &first, int32_t count);
  ~Siblings();
  Siblings(const Siblings &) = delete;
  Siblings &operator=(const Siblings &) = delete;

  /// Binds and starts the others; throws.
  void begin();
  /// Waits for them.
  void end() noexcept;
  size_t count() const { return ranks_.size(); }

private:
  struct Sibling {
    pikort_pipeline *pipeline = nullptr;
    std::vector<std::vector<std::max_align_t>> buffers; ///< By state.
    std::thread thread;
  };
  void bind(Sibling &sibling);
  void check(const Sibling &sibling, int32_t status);

  pikort_pipeline &first_;
  std::vector<pikort_ranks> ranks_;
  std::vector<Sibling> siblings_;
};

/// As the host, or $PIKO_RANKS, has it; throws.
void prepareSiblings(pikort_pipeline &p);

} // namespace piko::rt

#endif // PIKO_RUNTIME_RANKS_SIBLINGS_H
