// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Strips.h - Runs stages on one part of a source after another -------===//
//
// A group of stages, all of whose primitives come from one source, takes that
// source strip by strip: consecutive primitives, so that lineage order stays as
// it is. What leaves the group waits in the queues of its edges, unless the
// first strip is the whole source.
//
// A strip for which there is no memory is taken back and cut, as long as none
// of its kernels that write state has begun. To make that likely to come first,
// a strip may use half of what a budget leaves until then; afterwards a budget
// holds no more, and the next strip is smaller.
//
// Ranks run the same strips, of which each has its part. They meet before each
// strip, and before the first of its kernels that writes state: so all know
// whether one of them found no memory while all can still take the strip back.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_STRIPS_H
#define PIKO_RUNTIME_CPU_STRIPS_H

#include "cpu/Queue.h"

namespace piko::rt {

class Strips {
public:
  Strips(pikort_pipeline &p, const StripGroup &group);

  /// Goes on to the next strip, or to a smaller one of the same primitives;
  /// false at the end, or on an error. Throws.
  bool next();
  bool isFinished() const { return finished_; }
  /// How many primitives the next one has at most.
  int64_t size() const { return size_; }
  /// Whether what leaves is in queues.
  bool isDivided() const { return divided_; }
  /// The strip's number: of two, the earlier one's primitives come first.
  uint32_t number() const { return number_; }
  /// The strip can no longer be taken back. Throws.
  void commit();
  /// Takes what a kernel outside of cycles emitted to stages that are not in
  /// the group.
  void absorb(Kernel &kernel);

private:
  struct Waiting {
    Edge *edge;
    Queue::Mark mark; ///< When the strip began.
  };

  int64_t ranks() const;
  int64_t mostSize() const;
  int64_t firstSize() const;
  int64_t nextSize() const;
  int64_t primitiveBytes() const;
  [[noreturn]] void failCollected() const;
  void start();
  /// The size of a strip in place of the one that failed; 0: the error stays.
  int64_t smallerSize() const;
  void takeBack();
  int64_t agree(int64_t size);
  /// Whether a strip found no memory because of what waits for other stages.
  bool isCrowded() const;

  pikort_pipeline &p_;
  const StripGroup &group_;
  Source &source_;
  std::vector<Waiting> leaving_;
  std::vector<StageStats> stats_; ///< When the strip began.
  int64_t size_ = 0;              ///< Primitives of the source in a strip.
  int64_t held_ = 0;              ///< Bytes when the strip began.
  uint32_t number_ = 0;
  bool started_ = false, committed_ = false, divided_ = false,
       finished_ = false;
};

/// Makes the strips of a run, and frees them.
void startStrips(pikort_pipeline &p);
void endStrips(pikort_pipeline &p);

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_STRIPS_H
