// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Joins.cpp - Orders and bins on the device --------------------------===//
//
// Compiled for NVPTX (runtime/CMakeLists.txt): this is no part of the host's
// code.
//
//===----------------------------------------------------------------------===//

#include "cuda/device/Enter.h"
#include "cuda/device/Loops.h"
#include "cuda/device/Strips.h"
#include "cuda/device/Units.h"

using namespace piko::cuda;

namespace {

class Join {
public:
  explicit Join(const JoinArgs &args)
      : args_(args), clears_(args.clearCount > 0 && args.kernel->runs == 0),
        grid_(*args.frame, cursorOf(*args.frame), workOf(args, clears_)),
        isFirstRun_(isFirstRun(*args.kernel, args.strip)) {}

  void run() {
    if (grid_.isIdle())
      return;
    if (Grid::isFirst())
      *args_.frame->progress = args_.number;
    if (isStopped(*args_.frame)) {
      grid_.settle();
      return publishNothing();
    }
    Stream stream{};
    gather(stream);
    bool everyBin = args_.everyBin && isFirstRun_;
    bool isIdle = (args_.loop || args_.cycle) && stream.count == 0 &&
                  !(args_.collects && everyBin);
    Binning bins(grid_, args_, stream);
    if (!isIdle && !grid_.hasFailed())
      bins.run();
    Cutter cutter(grid_, args_, bins, everyBin);
    if (!isIdle && !grid_.hasFailed())
      cutter.run();
    int64_t units = takeLogs(cutter.unitCount);
    uint32_t *childCounts = takeChildCounts(stream);
    grid_.settle(); // what a thread alone has found is known to all
    if (grid_.hasFailed() || args_.frame->failed)
      return publishNothing();
    clear(cutter, bins);
    if (Grid::isFirst()) {
      publish(stream, bins, cutter, units);
      endInputs(stream, childCounts);
      *args_.frame->progress = args_.number + 1;
    }
  }

private:
  /// About how much there is to do; of what comes in without bins, a unit each.
  static int64_t workOf(const JoinArgs &args, bool clears) {
    int64_t work = args.shape.placed || args.everyBin ? args.shape.buckets : 0;
    int64_t pixels = clears ? 1 : 0;
    for (int32_t d = 0; d < args.rank; ++d)
      pixels *= args.domain[d];
    work += pixels;
    for (int32_t i = 0; i < args.inputCount; ++i)
      work += piko::cuda::workOf(args.inputs()[i],
                                 args.shape.placed || args.inputCount > 1);
    return work;
  }

  bool isInLaterWave() const { return args_.loop && args_.loop->hops > 0; }

  void gather(Stream &stream) {
    if (isInLaterWave())
      return gatherWave(stream);
    Inputs(grid_, args_.shape, args_.inputs(), args_.inputCount, isFirstRun_)
        .gather(stream, args_.shape.keyWidth > 0);
  }

  /// The order of a wave's primitives is free: their places tell it.
  void gatherWave(Stream &stream) {
    Concatenation all(grid_, args_.shape, /*keyWidth=*/0, /*isInLoop=*/true);
    all.run([&](auto &&body) {
      for (int32_t i = 0; i < args_.inputCount; ++i)
        if (args_.inputs()[i].isInLoop)
          forChunks(*args_.inputs()[i].queue, args_.inputs()[i].queue->ready,
                    body);
    });
    stream = all.stream;
    lineage_ = all.lineage;
  }

  /// Of what comes into a loop.
  uint32_t *takeChildCounts(const Stream &stream) {
    bool isEntry = args_.loop && !isInLaterWave() && stream.count > 0;
    return isEntry ? grid_.takeZeros(stream.count) : nullptr;
  }

  /// What has been taken no longer waits; by the first thread.
  void endInputs(const Stream &stream, uint32_t *childCounts) {
    for (int32_t i = 0; i < args_.inputCount; ++i)
      if (args_.inputs()[i].queue)
        drop(*args_.inputs()[i].queue, args_.inputs()[i].isInLoop);
    if (!childCounts)
      return;
    args_.loop->places = stream.count;
    args_.loop->childCounts = childCounts;
    args_.loop->entryKeys = stream.keys;
  }

  /// For each unit, that it has emitted nothing yet; returns the address.
  int64_t takeLogs(int64_t count) {
    constexpr int64_t words = sizeof(pikoir_unit_log) / 4;
    return reinterpret_cast<int64_t>(grid_.takeZeros(count * words));
  }

  /// Sets images to their clear values where no unit will.
  void clear(const Cutter &cutter, const Binning &bins) {
    if (!clears_ || (args_.visitsAll && !args_.takesList))
      return;
    bool whole = cutter.unitCount == 0;
    int64_t pixels = 1;
    for (int32_t d = 0; d < args_.rank; ++d)
      pixels *= args_.domain[d];
    grid_.forEach(pixels, [&](int64_t pixel) {
      if (!whole && runs(binOf(pixel), bins))
        return;
      for (int32_t c = 0; c < args_.clearCount; ++c) {
        const JoinClear &image = args_.clears()[c];
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
    bool everyBin =
        args_.cutting == CutBins ? args_.cuts[bin].everyBin : args_.everyBin;
    return (args_.takesList && everyBin) ||
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
    args_.frame->latest = &kernel;
  }

  void publish(const Stream &stream, const Binning &bins, const Cutter &cutter,
               int64_t units) {
    KernelState &kernel = *args_.kernel;
    kernel.input = {stream.items, bins.positions, bins.order,
                    bins.offsets, cutter.units,   cutter.unitCount,
                    args_.tiles,  cutter.calls,   cutter.callCount,
                    clears_,      nullptr,        0};
    kernel.log = args_.frame->log;
    kernel.log.cursor = kernel.logBegin = grid_.top();
    kernel.log.units = units;
    kernel.buckets = args_.shape.buckets;
    kernel.rank = bins.rank;
    kernel.rankSize = bins.rankSize;
    kernel.keys = args_.shape.keyWidth > 0 ? stream.keys : KeyWords{};
    kernel.pairStarts = stream.pairStarts;
    kernel.items = stream.count;
    kernel.lineage = lineage_;
    if (args_.cycle && args_.collects)
      kernel.launch = static_cast<uint64_t>(args_.cycle->launches++);
    kernel.strip = numberOf(args_.strip);
    if (args_.strip && args_.collects)
      kernel.launch = static_cast<uint64_t>(kernel.strip);
    ++kernel.runs;
    kernel.in += stream.count;
    kernel.placed += bins.positions;
    args_.frame->latest = &kernel;
  }

  const JoinArgs &args_;
  /// In the kernel's first run, of all strips: the first thread counts it
  /// after the last barrier, so that it is asked before.
  bool clears_;
  Grid grid_;
  bool isFirstRun_; ///< Of a strip.
  Lineage lineage_{};
};

} // namespace

/// Fills an image, or zeros a buffer, with copies of a record.
extern "C" [[clang::nvptx_kernel]] void
piko_fill(uint8_t *to, int64_t count, const uint8_t *record, int64_t size) {
  using Words = uint32_t __attribute__((vector_size(16)));
  constexpr int64_t together = sizeof(Words);
  int64_t first = __nvvm_read_ptx_sreg_ctaid_x() * joinThreads + Grid::thread(),
          threads = __nvvm_read_ptx_sreg_nctaid_x() * joinThreads;
  auto forEach = [&](int64_t n, const auto &body) {
    for (int64_t i = first; i < n; i += threads)
      body(i);
  };
  if (together % size != 0 || reinterpret_cast<uint64_t>(to) % together != 0)
    return forEach(count,
                   [&](int64_t i) { copyRecord(to + i * size, record, size); });
  Words words;
  for (int64_t i = 0; i < together; ++i)
    reinterpret_cast<uint8_t *>(&words)[i] = record[i % size];
  int64_t whole = count * size / together;
  forEach(whole, [&](int64_t i) { reinterpret_cast<Words *>(to)[i] = words; });
  forEach(count * size - whole * together,
          [&](int64_t i) { to[whole * together + i] = record[i % size]; });
}

/// Begins a kernel: makes its input and an empty log of what its producers have
/// left. A cooperative launch of joinThreads threads a block.
extern "C" [[clang::nvptx_kernel]] void piko_join(const JoinArgs *args) {
  Join(*args).run();
}

/// After a kernel that may run again: keeps what it has left for others. This,
/// and what follows, is launched as a join is.
extern "C" [[clang::nvptx_kernel]] void piko_queue(const QueueArgs *args) {
  Queuer(*args).run();
}

extern "C" [[clang::nvptx_kernel]] void piko_enter(const EnterArgs *args) {
  Enter(*args).run();
}

extern "C" [[clang::nvptx_kernel]] void piko_wave(const StepArgs *args) {
  Wave(*args).run();
}

extern "C" [[clang::nvptx_kernel]] void piko_round(const StepArgs *args) {
  Round(*args).run();
}

extern "C" [[clang::nvptx_kernel]] void piko_leave(const LeaveArgs *args) {
  Leave(*args).run();
}

extern "C" [[clang::nvptx_kernel]] void piko_strip(const StripArgs *args) {
  Strip(*args).run();
}
