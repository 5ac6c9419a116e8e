// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Enter.h - What comes into a loop at several stages -----------------===//
//
// Each stage gets its own. The places of the loop are those of all of it, in
// the order of its keys; so it waits for the first wave like what a wave before
// has emitted.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_ENTER_H
#define PIKO_RUNTIME_CUDA_DEVICE_ENTER_H

#include "cuda/device/Inputs.h"

namespace piko::cuda {

/// In front of a loop.
class Enter : FrameTask {
public:
  explicit Enter(const EnterArgs &args)
      : FrameTask(*args.frame, args.number, workOf(args)), args_(args) {}

  void run() {
    uint32_t *childCounts = nullptr;
    KeyWords keys{};
    int64_t count = 0;
    bool goesOn = FrameTask::run([&] {
      auto *streams = grid_.take<Stream>(args_.entryCount);
      for (int32_t e = 0; e < args_.entryCount && !grid_.hasFailed(); ++e)
        count += gather(args_.entries()[e], streams[e]);
      if (count > UINT32_MAX)
        grid_.fail();
      childCounts = grid_.takeZeros(count);
      int32_t width = args_.keyWidth;
      auto *words = width > 0 ? grid_.take<uint64_t>(count * width) : nullptr;
      keys = {words, 0, width};
      if (!grid_.hasFailed())
        placeAll(streams, words);
    });
    if (!goesOn || !Grid::isFirst())
      return;
    for (int32_t i = 0; i < args_.inputCount; ++i)
      if (args_.inputs()[i].queue && !args_.inputs()[i].isInLoop)
        drop(*args_.inputs()[i].queue, /*isInLoop=*/false);
    LoopState &loop = *args_.loop;
    loop.hops = 1; // as far as joins see
    loop.places = count;
    loop.childCounts = childCounts;
    loop.entryKeys = keys;
  }

private:
  static int64_t workOf(const EnterArgs &args) {
    int64_t work = 0;
    for (int32_t i = 0; i < args.inputCount; ++i)
      work += piko::cuda::workOf(args.inputs()[i], /*walksSource=*/true);
    return work;
  }

  /// Lets what comes in at a stage wait there; returns how much it is.
  int64_t gather(const LoopEntry &entry, Stream &out) {
    const KernelState &kernel = *entry.kernel;
    bool isFirstRun = kernel.runs == 0 || kernel.strip != entry.strip;
    Chunk chunk{};
    Stream &stream = chunk.stream;
    Inputs(grid_, entry.shape, args_.inputs() + entry.firstInput,
           entry.inputCount, isFirstRun)
        .gather(stream, /*keepsKeys=*/true);
    chunk.lineage = {grid_.take<uint32_t>(stream.count), nullptr,
                     grid_.take<uint32_t>(stream.count)};
    if (grid_.hasFailed())
      return 0;
    push(grid_, *entry.queue, chunk);
    if (Grid::isFirst()) {
      entry.queue->ready = entry.queue->count;
      out = stream;
    }
    grid_.sync();
    return stream.count;
  }

  void placeAll(const Stream *streams, uint64_t *words) {
    KeyOrder order(streams, args_.entryCount);
    int32_t width = args_.keyWidth;
    for (int32_t e = 0; e < args_.entryCount; ++e) {
      const QueueState &queue = *args_.entries()[e].queue;
      const Lineage &lineage = queue.chunks[queue.count - 1].lineage;
      grid_.forEach(streams[e].count, [&](int64_t i) {
        int64_t place = order.placeOf(e, i);
        lineage.places[i] = lineage.entries[i] = static_cast<uint32_t>(place);
        for (int32_t w = 0; w < width; ++w)
          words[place * width + w] = streams[e].keys.word(i, w);
      });
    }
    grid_.sync();
  }

  const EnterArgs &args_;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_ENTER_H
