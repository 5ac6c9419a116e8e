// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Inputs.h - What comes into a stage ---------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_INPUTS_H
#define PIKO_RUNTIME_CUDA_DEVICE_INPUTS_H

#include "cuda/device/Merge.h"
#include "cuda/device/Queues.h"

namespace piko::cuda {

/// Calls body(chunk) for the first `count` of a queue.
template <class Body>
void forChunks(const QueueState &queue, int64_t count, const Body &body) {
  for (int64_t c = 0; c < count; ++c)
    body(queue.chunks[c]);
}

/// Drops what has been taken of a queue; by the first thread.
inline void drop(QueueState &queue, bool isInLoop) {
  int64_t taken = isInLoop ? queue.ready : queue.count;
  for (int64_t c = 0; c < taken; ++c)
    queue.items -= queue.chunks[c].stream.count;
  for (int64_t c = taken; c < queue.count; ++c)
    queue.chunks[c - taken] = queue.chunks[c];
  queue.count -= taken;
  queue.ready = 0;
}

/// -1: it is not of a strip.
inline int64_t numberOf(const StripState *strip) {
  return strip ? strip->number : -1;
}

/// Whether a kernel has not run yet, or not for this strip.
inline bool isFirstRun(const KernelState &kernel, const StripState *strip) {
  return kernel.runs == 0 || kernel.strip != numberOf(strip);
}

/// Of a source, what is taken at a time.
inline int64_t countOf(const JoinInput &input) {
  return input.strip ? input.strip->count : input.count;
}

/// About how much it is to go through an input.
inline int64_t workOf(const JoinInput &input, bool walksSource) {
  int64_t work = input.queue ? input.queue->items : 0;
  if (input.producer)
    work += workOf(*input.producer);
  int64_t count = countOf(input);
  return work + (walksSource ? count : count / 256);
}

/// Sources, what kernels have left, and what waits in queues, but for what is
/// in a loop: one stream, in lineage order.
class Inputs {
public:
  /// In the first run of a frame, or of a strip, sources and kernels have what
  /// nobody has taken.
  Inputs(Grid &grid, const Shape &shape, const JoinInput *inputs, int32_t count,
         bool isFirstRun)
      : grid_(grid), shape_(shape), inputs_(inputs), count_(count),
        isFirstRun_(isFirstRun) {}

  /// Between two barriers; `stream` is uniform.
  void gather(Stream &stream, bool keepsKeys) {
    Stream streams[mostMerged];
    int32_t filled = 0;
    for (int32_t i = 0; i < count_ && !grid_.hasFailed(); ++i) {
      if (filled == mostMerged)
        filled = mergeFirst(streams);
      Stream &next = streams[filled];
      next = {};
      gatherInput(inputs_[i], next);
      filled += next.count > 0;
    }
    if (filled == 1)
      stream = streams[0];
    if (filled > 1 && !grid_.hasFailed())
      Merge(grid_, shape_, streams, filled, keepsKeys).run(stream);
  }

private:
  /// Makes one stream of as many as there is room for, which others are still
  /// to be merged with; returns how many there are then.
  int32_t mergeFirst(Stream (&streams)[mostMerged]) {
    Stream merged{};
    Merge(grid_, shape_, streams, mostMerged, /*keepsKeys=*/true).run(merged);
    streams[0] = merged;
    return 1;
  }

  void gatherInput(const JoinInput &input, Stream &stream) {
    if (input.isInLoop) // of this wave, for the next one
      return;
    if (input.queue) {
      Concatenation all(grid_, shape_, input.keyWidth, /*isInLoop=*/false);
      all.run([&](auto &&body) {
        forChunks(*input.queue, input.queue->count, body);
      });
      stream = all.stream;
      return;
    }
    if (!isFirstRun_) // the first one has taken it
      return;
    if (input.isSource) {
      int64_t begin = input.strip ? input.strip->begin : 0;
      stream.items = input.items + begin * shape_.recordSize;
      stream.count = countOf(input);
      stream.keys = {nullptr, input.keyBase + static_cast<uint64_t>(begin), 1};
    }
    if (!input.producer)
      return;
    Spans spans(grid_, *input.producer);
    spans.find();
    Gather(grid_, shape_, input, spans).run(stream);
  }

  Grid &grid_;
  const Shape &shape_;
  const JoinInput *inputs_;
  int32_t count_;
  bool isFirstRun_;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_INPUTS_H
