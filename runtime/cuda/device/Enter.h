// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Enter.h - What comes into a loop -----------------------------------===//
//
// Each stage gets its own. Its places among all of it follow from its keys. It
// waits for the first wave like what a wave before has emitted, or is what a
// stack begins with.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_ENTER_H
#define PIKO_RUNTIME_CUDA_DEVICE_ENTER_H

#include "cuda/device/Inputs.h"
#include "cuda/device/Stack.h"

namespace piko::cuda {

/// Before a loop that is entered at several stages, or has a stack.
class Enter : FrameTask {
public:
  explicit Enter(const EnterArgs &args)
      : FrameTask(*args.frame, args.number, workOf(args)), args_(args) {}

  void run() {
    if (args_.stack)
      runStack();
    else
      runWaves();
  }

private:
  static int64_t workOf(const EnterArgs &args) {
    int64_t work = 0;
    for (int32_t i = 0; i < args.inputCount; ++i)
      work += piko::cuda::workOf(args.inputs()[i], /*walksSource=*/true);
    return work;
  }

  void runWaves() {
    uint32_t *childCounts = nullptr;
    bool goesOn = FrameTask::run([&] {
      const Stream *streams = gatherAll();
      for (int32_t e = 0; e < args_.entryCount && !grid_.hasFailed(); ++e)
        pushChunk(*args_.entries()[e].queue, streams[e]);
      childCounts = grid_.takeZeros(count_);
      if (!grid_.hasFailed())
        placeAll(streams, [&](int32_t e, int64_t i, uint32_t place) {
          const QueueState &queue = *args_.entries()[e].queue;
          const Lineage &lineage = queue.chunks[queue.count - 1].lineage;
          lineage.places[i] = lineage.entries[i] = place;
        });
    });
    if (!goesOn || !Grid::isFirst())
      return;
    endInputs();
    args_.loop->hops = 1; // as far as joins see
    args_.loop->places = count_;
    args_.loop->childCounts = childCounts;
  }

  void runStack() {
    Stack stack(grid_, *args_.stack);
    bool goesOn = FrameTask::run([&] {
      const Stream *streams = gatherAll();
      auto *waiting = grid_.take<Waiting>(count_);
      stack.begin(waiting, count_);
      if (grid_.hasFailed())
        return;
      placeAll(streams, [&](int32_t e, int64_t i, uint32_t place) {
        waiting[place] = describe(args_.entries()[e], streams[e], i, place);
      });
      stack.next();
    });
    if (!Grid::isFirst())
      return;
    args_.loop->again = 0;
    if (!goesOn)
      return;
    endInputs();
    stack.publish(*args_.frame);
  }

  /// What comes in at each stage.
  const Stream *gatherAll() {
    auto *streams = grid_.take<Stream>(args_.entryCount);
    for (int32_t e = 0; e < args_.entryCount && !grid_.hasFailed(); ++e) {
      const LoopEntry &entry = args_.entries()[e];
      Stream stream{};
      Inputs(grid_, entry.shape, args_.inputs() + entry.firstInput,
             entry.inputCount, isFirstRun(*entry.kernel, entry.strip))
          .gather(stream, /*keepsKeys=*/true);
      count_ += stream.count;
      if (Grid::isFirst() && !grid_.hasFailed())
        streams[e] = stream;
    }
    if (count_ > UINT32_MAX)
      grid_.fail();
    grid_.sync();
    return streams;
  }

  /// Calls put(stage, item, place) for all that comes in. Between two barriers.
  template <class Put> void placeAll(const Stream *streams, const Put &put) {
    KeyOrder order(streams, args_.entryCount);
    int32_t width = args_.keyWidth;
    auto *words = width > 0 ? grid_.take<uint64_t>(count_ * width) : nullptr;
    keys_ = {words, 0, width};
    if (grid_.hasFailed())
      return;
    for (int32_t e = 0; e < args_.entryCount; ++e)
      grid_.forEach(streams[e].count, [&](int64_t i) {
        int64_t place = order.placeOf(e, i);
        for (int32_t w = 0; w < width; ++w)
          words[place * width + w] = streams[e].keys.word(i, w);
        put(e, i, static_cast<uint32_t>(place));
      });
    grid_.sync();
  }

  void pushChunk(QueueState &queue, const Stream &stream) {
    Chunk chunk{stream,
                {grid_.take<uint32_t>(stream.count), nullptr,
                 grid_.take<uint32_t>(stream.count)}};
    if (grid_.hasFailed())
      return;
    push(grid_, queue, chunk);
    if (Grid::isFirst())
      queue.ready = queue.count;
  }

  /// On the stack; what is in no bucket goes nowhere.
  static Waiting describe(const LoopEntry &entry, const Stream &stream,
                          int64_t i, uint32_t place) {
    uint32_t begin = stream.pairs ? stream.pairStarts[i] : 0,
             buckets = stream.pairs ? stream.pairStarts[i + 1] - begin : 0;
    bool isPlaced =
        !entry.shape.placed || (buckets > 0 && stream.pairs[begin] != noBucket);
    return {stream.items + i * entry.shape.recordSize,
            stream.pairs + begin,
            buckets,
            place,
            isPlaced ? entry.member : -1,
            /*group=*/-1,
            /*hops=*/0};
  }

  /// What has been taken no longer waits; by the first thread.
  void endInputs() {
    for (int32_t i = 0; i < args_.inputCount; ++i)
      if (args_.inputs()[i].queue && !args_.inputs()[i].isInLoop)
        drop(*args_.inputs()[i].queue, /*isInLoop=*/false);
    for (int32_t e = 0; e < args_.entryCount; ++e) {
      const LoopEntry &entry = args_.entries()[e];
      entry.kernel->strip = numberOf(entry.strip);
      ++entry.kernel->runs;
    }
    args_.loop->entryKeys = keys_;
  }

  const EnterArgs &args_;
  int64_t count_ = 0; ///< Of all that comes in.
  KeyWords keys_{};   ///< By place.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_ENTER_H
