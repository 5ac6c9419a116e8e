// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Queues.h - Primitives that wait for a kernel's next run ------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_QUEUES_H
#define PIKO_RUNTIME_CUDA_DEVICE_QUEUES_H

#include "cuda/device/Gather.h"

namespace piko::cuda {

/// Makes room for one more element of an array whose first `count` are in use.
/// Uniform; what it has is seen by the first thread.
template <class T>
T *makeRoom(Grid &grid, T *elements, int64_t count, int64_t &capacity) {
  if (count < capacity)
    return elements;
  capacity = larger<int64_t>(8, 2 * count);
  T *room = grid.take<T>(capacity);
  for (int64_t i = 0; i < count && room && Grid::isFirst(); ++i)
    room[i] = elements[i];
  return room;
}

/// Puts a chunk at the end of a queue. Between two barriers.
inline void push(Grid &grid, QueueState &queue, const Chunk &chunk) {
  int64_t count = queue.count, capacity = queue.capacity;
  Chunk *chunks = makeRoom(grid, queue.chunks, count, capacity);
  grid.sync(); // all have read the queue
  if (Grid::isFirst() && !grid.hasFailed()) {
    chunks[count] = chunk;
    queue.chunks = chunks;
    queue.capacity = capacity;
    queue.count = count + 1;
    queue.items += chunk.stream.count;
  }
  grid.sync();
}

/// Puts chunks one after the other.
class Concatenation {
public:
  Concatenation(Grid &grid, const Shape &shape, int32_t keyWidth, bool isInLoop)
      : grid_(grid), shape_(shape), keyWidth_(keyWidth), isInLoop_(isInLoop) {}

  /// `forChunks` calls a function for each chunk, in order. Between two
  /// barriers; what comes out is uniform.
  template <class ForChunks> void run(const ForChunks &forChunks) {
    int64_t chunks = 0;
    forChunks([&](const Chunk &chunk) {
      if (chunk.stream.count == 0)
        return;
      stream.count += chunk.stream.count;
      stream.pairCount += chunk.stream.pairCount;
      only_ = &chunk;
      ++chunks;
    });
    if (chunks == 1) {
      stream = only_->stream;
      lineage = only_->lineage;
    }
    if (chunks <= 1)
      return;
    if (stream.count > UINT32_MAX || stream.pairCount > UINT32_MAX)
      return grid_.fail();
    takeRoom();
    if (grid_.hasFailed())
      return;
    int64_t item = 0, pair = 0;
    forChunks([&](const Chunk &chunk) {
      copy(chunk, item, pair);
      item += chunk.stream.count;
      pair += chunk.stream.pairCount;
    });
    if (pairStarts_ && Grid::isFirst())
      pairStarts_[stream.count] = static_cast<uint32_t>(stream.pairCount);
    grid_.sync();
  }

  Stream stream{};
  Lineage lineage{};

private:
  void takeRoom() {
    stream.items = items_ =
        grid_.take<uint8_t>(stream.count * shape_.recordSize);
    if (keyWidth_ > 0) {
      keys_ = grid_.take<uint64_t>(stream.count * keyWidth_);
      stream.keys = {keys_, 0, keyWidth_};
    }
    if (shape_.placed) {
      stream.pairs = pairs_ = grid_.take<uint32_t>(stream.pairCount);
      stream.pairStarts = pairStarts_ = grid_.take<uint32_t>(stream.count + 1);
    }
    if (isInLoop_)
      lineage = {grid_.take<uint32_t>(stream.count), nullptr,
                 grid_.take<uint32_t>(stream.count)};
  }

  /// After so many items and pairs.
  void copy(const Chunk &chunk, int64_t item, int64_t pair) {
    const Stream &from = chunk.stream;
    int64_t size = shape_.recordSize;
    copyBytes(grid_, items_ + item * size, from.items, from.count * size);
    grid_.forEach(from.count, [&](int64_t i) {
      for (int32_t w = 0; w < keyWidth_; ++w)
        keys_[(item + i) * keyWidth_ + w] = from.keys.word(i, w);
      if (pairStarts_)
        pairStarts_[item + i] =
            static_cast<uint32_t>(pair + from.pairStarts[i]);
      if (lineage.places) {
        lineage.places[item + i] = chunk.lineage.places[i];
        lineage.entries[item + i] = chunk.lineage.entries[i];
      }
    });
    if (shape_.placed)
      grid_.forEach(from.pairCount,
                    [&](int64_t k) { pairs_[pair + k] = from.pairs[k]; });
  }

  Grid &grid_;
  const Shape &shape_;
  int32_t keyWidth_;
  bool isInLoop_;
  const Chunk *only_ = nullptr;
  uint8_t *items_ = nullptr;
  uint64_t *keys_ = nullptr;
  uint32_t *pairs_ = nullptr, *pairStarts_ = nullptr;
};

/// Whether something failed before.
inline bool isStopped(const FrameState &frame) {
  const KernelState *latest = frame.latest;
  return frame.failed || (latest && (latest->log.cursor > latest->log.limit ||
                                     latest->log.errors != 0));
}

/// Where a frame's memory begins that nobody has.
inline int64_t cursorOf(const FrameState &frame) {
  return frame.latest ? frame.latest->log.cursor : frame.log.cursor;
}

/// About how much it is to go through what a kernel has emitted.
inline int64_t workOf(const KernelState &kernel) {
  constexpr int64_t perEntry = 64; // bytes
  return kernel.input.unit_count +
         (kernel.log.cursor - kernel.logBegin) / perEntry;
}

/// What runs between kernels and takes memory after the latest one's.
class FrameTask {
public:
  FrameTask(FrameState &frame, int64_t number, int64_t work)
      : grid_(frame, cursorOf(frame), work), frame_(frame), number_(number) {}

  /// Calls body() if nothing has failed; returns whether nothing has then.
  template <class Body> bool run(const Body &body) {
    if (grid_.isIdle())
      return false;
    if (Grid::isFirst())
      *frame_.progress = number_;
    bool goesOn = !isStopped(frame_);
    if (goesOn)
      body();
    grid_.settle();
    goesOn = goesOn && !grid_.hasFailed() && !frame_.failed;
    if (!Grid::isFirst())
      return goesOn;
    if (!goesOn)
      frame_.failed = 1;
    else
      (frame_.latest ? frame_.latest->log : frame_.log).cursor = grid_.top();
    *frame_.progress = number_ + 1;
    return goesOn;
  }

protected:
  Grid grid_;

private:
  FrameState &frame_;
  int64_t number_;
};

/// After a kernel: see QueueArgs.
class Queuer : FrameTask {
public:
  explicit Queuer(const QueueArgs &args)
      : FrameTask(*args.frame, args.number, workOf(*args.kernel)), args_(args) {
  }

  void run() {
    FrameTask::run([&] {
      if (args_.kernel->input.unit_count > 0)
        queueAll();
    });
  }

private:
  void queueAll() {
    Spans spans(grid_, *args_.kernel);
    spans.find();
    Siblings siblings(grid_, spans, args_.ports()[0]);
    if (args_.loop && !grid_.hasFailed())
      siblings.run(args_.loop->childCounts);
    for (int32_t i = 0; i < args_.portCount && !grid_.hasFailed(); ++i) {
      const QueuePort &port = args_.ports()[i];
      Gather gather(grid_, port.shape, port.input, spans,
                    args_.loop ? &siblings : nullptr);
      Chunk chunk{};
      gather.run(chunk.stream);
      chunk.lineage = gather.lineage();
      if (chunk.stream.count == 0 || grid_.hasFailed())
        continue;
      if (port.group >= 0)
        leave(chunk, port);
      else
        push(grid_, *port.queue, chunk);
    }
  }

  void leave(const Chunk &chunk, const QueuePort &port) {
    LoopState &loop = *args_.loop;
    const Stream &from = chunk.stream;
    int64_t count = loop.exitCount, capacity = loop.exitCapacity;
    Exit *exits = loop.exits, *old = exits;
    if (count + from.count > capacity) {
      capacity = larger<int64_t>(2 * count, count + from.count);
      exits = grid_.take<Exit>(capacity);
    }
    if (count + from.count > UINT32_MAX)
      grid_.fail();
    if (grid_.hasFailed())
      return;
    if (exits != old)
      grid_.forEach(count, [&](int64_t i) { exits[i] = old[i]; });
    grid_.forEach(from.count, [&](int64_t i) {
      uint32_t begin = from.pairs ? from.pairStarts[i] : 0,
               end = from.pairs ? from.pairStarts[i + 1] : 0;
      exits[count + i] = {from.items + i * port.shape.recordSize,
                          from.pairs + begin,
                          end - begin,
                          static_cast<uint32_t>(port.group),
                          chunk.lineage.places[i],
                          chunk.lineage.children[i],
                          chunk.lineage.entries[i]};
    });
    grid_.sync(); // all have read the loop's state
    if (Grid::isFirst()) {
      loop.exits = exits;
      loop.exitCount = count + from.count;
      loop.exitCapacity = capacity;
    }
    grid_.sync();
  }

  const QueueArgs &args_;
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_QUEUES_H
