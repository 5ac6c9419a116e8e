// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Joins.cpp - Orders and bins on the device --------------------------===//
//
// Compiled for NVPTX (runtime/CMakeLists.txt): this is no part of the host's
// code.
//
//===----------------------------------------------------------------------===//

#include "cuda/device/Gather.h"
#include "cuda/device/Merge.h"
#include "cuda/device/Units.h"

using namespace piko::cuda;

namespace {

class Join {
public:
  explicit Join(const JoinArgs &args)
      : args_(args),
        grid_(*args.frame, args.previous ? args.previous->log.cursor
                                         : args.frame->log.cursor) {}

  void run() {
    if (Grid::isFirst())
      *args_.frame->progress = args_.number;
    if (isStopped())
      return publishNothing();
    Stream stream{};
    gather(stream);
    Binning bins(grid_, args_, stream);
    if (!grid_.hasFailed())
      bins.run();
    Cutter cutter(grid_, args_, bins);
    if (!grid_.hasFailed())
      cutter.run();
    int64_t units = takeLogs(cutter.unitCount);
    // What a thread alone has found is known to all here.
    grid_.sync();
    if (grid_.hasFailed() || args_.frame->failed)
      return publishNothing();
    clear(cutter, bins);
    if (Grid::isFirst())
      publish(stream, bins, cutter, units);
    grid_.sync();
    if (Grid::isFirst())
      *args_.frame->progress = args_.number + 1;
  }

private:
  /// Whether something failed before.
  bool isStopped() {
    const KernelState *before = args_.previous;
    return args_.frame->failed ||
           (before && (before->log.cursor > before->log.limit ||
                       before->log.errors != 0));
  }

  void gather(Stream &stream) {
    if (Grid::isFirst())
      for (uint64_t &received : args_.kernel->received)
        received = 0;
    Stream streams[mostJoinInputs];
    int32_t filled = 0;
    for (int32_t i = 0; i < args_.inputCount && !grid_.hasFailed(); ++i) {
      const JoinInput &input = args_.inputs[i];
      Stream &next = streams[filled];
      next = {};
      if (input.isSource) {
        next.items = input.items;
        next.count = input.count;
        next.keys = {nullptr, input.keyBase, 1};
      }
      if (input.producer)
        Gather(grid_, args_, i).run(next);
      filled += next.count > 0;
    }
    if (filled == 1)
      stream = streams[0];
    if (filled > 1 && !grid_.hasFailed())
      Merge(grid_, args_, streams, filled).run(stream);
  }

  /// For each unit, that it has emitted nothing yet; returns the address.
  int64_t takeLogs(int64_t count) {
    constexpr int64_t words = sizeof(pikoir_unit_log) / 4;
    return reinterpret_cast<int64_t>(grid_.takeZeros(count * words));
  }

  /// Sets images to their clear values where no unit will.
  void clear(const Cutter &cutter, const Binning &bins) {
    if (args_.clearCount == 0 || (args_.visitsAll && !args_.takesList))
      return;
    bool whole = cutter.unitCount == 0;
    int64_t pixels = 1;
    for (int32_t d = 0; d < args_.rank; ++d)
      pixels *= args_.domain[d];
    grid_.forEach(pixels, [&](int64_t pixel) {
      if (!whole && runs(binOf(pixel), bins))
        return;
      for (int32_t c = 0; c < args_.clearCount; ++c) {
        const JoinClear &image = args_.clears[c];
        copyRecord(image.pixels + pixel * image.size, image.record, image.size);
      }
    });
  }

  int64_t binOf(int64_t pixel) const {
    int64_t bin = 0, stride = 1;
    for (int32_t d = 0; d < args_.rank; ++d) {
      int64_t x = pixel % args_.domain[d];
      pixel /= args_.domain[d];
      if (args_.binSize[d] > 0)
        bin += x / args_.binSize[d] * stride;
      stride *= args_.grid[d];
    }
    return bin;
  }

  bool runs(int64_t bin, const Binning &bins) const {
    return (args_.takesList && args_.everyBin) ||
           bins.offsets[bin] < bins.offsets[bin + 1];
  }

  void publishNothing() {
    if (!Grid::isFirst())
      return;
    args_.frame->failed = 1;
    KernelState &kernel = *args_.kernel;
    kernel = {};
    kernel.log = args_.frame->log;
    kernel.log.cursor = grid_.top();
  }

  void publish(const Stream &stream, const Binning &bins, const Cutter &cutter,
               int64_t units) {
    KernelState &kernel = *args_.kernel;
    kernel.input = {stream.items,        bins.positions, bins.order,
                    bins.offsets,        cutter.units,   cutter.unitCount,
                    args_.tiles,         cutter.calls,   cutter.callCount,
                    args_.clearCount > 0};
    kernel.log = args_.frame->log;
    kernel.log.cursor = grid_.top();
    kernel.log.units = units;
    kernel.cells = args_.cells;
    kernel.rank = bins.rank;
    kernel.rankSize = bins.rankSize;
    kernel.keys = args_.keyWidth > 0 ? stream.keys : KeyWords{};
    kernel.in = stream.count;
    kernel.placed = bins.positions;
  }

  const JoinArgs &args_;
  Grid grid_;
};

} // namespace

/// Fills an image, or zeros a buffer, with copies of a record.
extern "C" [[clang::nvptx_kernel]] void
piko_fill(uint8_t *to, int64_t count, const uint8_t *record, int64_t size) {
  Grid::forEach(count,
                [&](int64_t i) { copyRecord(to + i * size, record, size); });
}

/// Begins a kernel: makes its input and an empty log of what its producers have
/// left. A cooperative launch of joinThreads threads a block.
extern "C" [[clang::nvptx_kernel]] void piko_join(const JoinArgs *args) {
  Join(*args).run();
}
