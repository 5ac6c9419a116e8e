// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Strips.h - From one strip of a source to the next ------------------===//
//
// What a strip has taken is free when it has ended, but for what has left it
// and waits in queues. From the second strip on that is copied after all
// memory of the strip, and from there to its front, where it stays; what is
// after it is the next strip's, which finds there what was. The first strip's
// memory stays: nobody has noted where it begins.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CUDA_DEVICE_STRIPS_H
#define PIKO_RUNTIME_CUDA_DEVICE_STRIPS_H

#include "cuda/device/Queues.h"

namespace piko::cuda {

/// After a strip.
class Strip : FrameTask {
public:
  explicit Strip(const StripArgs &args) : Strip(args, bytesOf(args)) {}

  void run() {
    int64_t begin = strip_.begin + strip_.count;
    bool isLast = begin >= strip_.all;
    bool goesOn = FrameTask::run([&] {
      if (bytes_ > 0 && !isLast)
        compact();
    });
    if (!Grid::isFirst())
      return;
    strip_.again = goesOn && !isLast;
    if (!strip_.again)
      return;
    publishMemory();
    strip_.begin = begin;
    strip_.count = smaller(strip_.size, strip_.all - begin);
    ++strip_.number;
    for (int32_t i = 0; i < args_.insideCount; ++i)
      *args_.inside()[i] = {};
    for (int32_t i = 0; i < args_.cycleCount; ++i)
      *args_.cycles()[i] = {/*again=*/1, /*rounds=*/0, /*launches=*/0};
  }

private:
  Strip(const StripArgs &args, int64_t bytes)
      : FrameTask(*args.frame, args.number, bytes / lineBytes), args_(args),
        strip_(*args.strip), bytes_(bytes) {}

  struct Line {
    uint32_t words __attribute__((vector_size(16)));
  };
  static constexpr int64_t lineBytes = sizeof(Line);

  /// Of a piece of memory, as Grid::take gives it.
  static int64_t align(int64_t bytes) { return (bytes + 63) / 64 * 64; }
  static int64_t addressOf(const void *pointer) {
    return reinterpret_cast<int64_t>(pointer);
  }

  /// Calls body(pointer, bytes) for each piece of memory of what has left the
  /// strip, if that is not the first one.
  template <class Body>
  static void forPieces(const StripArgs &args, const Body &body) {
    const StripState &strip = *args.strip;
    for (int32_t q = 0; q < args.leavingCount && strip.number > 0; ++q) {
      QueueState &queue = *args.leaving()[q].queue;
      if (addressOf(queue.chunks) >= strip.memory)
        body(queue.chunks,
             align(queue.capacity * static_cast<int64_t>(sizeof(Chunk))));
      for (int64_t c = queue.count - 1; c >= 0; --c) {
        Stream &stream = queue.chunks[c].stream;
        if (addressOf(stream.items) < strip.memory)
          break; // of a strip before
        forPieces(stream, args.leaving()[q].recordSize, body);
      }
    }
  }
  template <class Body>
  static void forPieces(Stream &stream, int64_t recordSize, const Body &body) {
    constexpr int64_t word = sizeof(uint32_t), key = sizeof(uint64_t);
    body(stream.items, align(stream.count * recordSize));
    if (stream.pairs) {
      body(stream.pairs, align(stream.pairCount * word));
      body(stream.pairStarts, align((stream.count + 1) * word));
    }
    if (stream.keys.words)
      body(stream.keys.words, align(stream.count * stream.keys.width * key));
  }
  static int64_t bytesOf(const StripArgs &args) {
    int64_t sum = 0;
    forPieces(args, [&](auto *&, int64_t bytes) { sum += bytes; });
    return sum;
  }

  void copy(int64_t from, int64_t to, int64_t bytes) const {
    grid_.forEach(bytes / lineBytes, [&](int64_t i) {
      reinterpret_cast<Line *>(to)[i] = reinterpret_cast<const Line *>(from)[i];
    });
  }

  /// Copies what stays to the front. There it does not reach to where it is
  /// copied from: its pieces are some of those of the strip.
  void compact() {
    int64_t after = addressOf(grid_.take<uint8_t>(bytes_)), to = after;
    if (grid_.hasFailed())
      return;
    forPieces(args_, [&](auto *&pointer, int64_t bytes) {
      copy(addressOf(pointer), to, bytes);
      to += bytes;
    });
    grid_.sync();
    copy(after, strip_.memory, bytes_);
  }

  /// By the first thread, after all of that.
  void publishMemory() {
    FrameState &frame = *args_.frame;
    frame.highest = larger(frame.highest, grid_.top());
    int64_t to = strip_.number > 0 ? strip_.memory : grid_.top();
    forPieces(args_, [&](auto *&pointer, int64_t bytes) {
      pointer = reinterpret_cast<decltype(+pointer)>(to);
      to += bytes;
    });
    strip_.memory = to;
    frame.latest = nullptr;
    frame.log.cursor = to;
  }

  const StripArgs &args_;
  StripState &strip_;
  int64_t bytes_; ///< Of what has left the strip.
};

} // namespace piko::cuda

#endif // PIKO_RUNTIME_CUDA_DEVICE_STRIPS_H
