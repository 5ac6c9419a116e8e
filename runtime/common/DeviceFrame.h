// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- DeviceFrame.h - A run without the host between kernels -------------===//
//
// While a frame records, the program's launches are noted, and between them
// joins on the device; nothing runs. Then all of it is submitted at once. What
// comes out of a kernel is known to the device alone.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_DEVICEFRAME_H
#define PIKO_RUNTIME_COMMON_DEVICEFRAME_H

#include "pikort/abi.h"
#include "pikort/grid.h"

namespace piko::rt {

class DeviceFrame {
public:
  virtual ~DeviceFrame() = default;

  /// Whether a run would be recorded, as far as is known: the pipeline, or this
  /// run of it, may need the host between its kernels.
  virtual bool isPossible() const = 0;
  /// Begins to record a run; false if that is not possible. Throws.
  virtual bool begin() = 0;
  virtual bool isRecording() const = 0;
  /// The input of a stage's kernel, or of a source's, for the device to read;
  /// throws.
  virtual const pikoir_input *join(int32_t number, bool isSource) = 0;
  virtual int64_t blocks(int32_t number, bool isSource,
                         int64_t threads) const = 0;
  virtual pikoir_log *log(int32_t number, bool isSource) = 0;
  /// Sets an image, or a buffer that is sized by a source, to its clear value.
  virtual void clear(int32_t state) = 0;
  /// What pikoir_loop_step, pikoir_cycle_takes and pikoir_cycle_turn answer:
  /// they lead the program once through what the device repeats.
  virtual int32_t stepLoop(int32_t loop) = 0;
  virtual bool takes(int32_t stage) = 0;
  virtual int32_t nextTurn(int32_t cycle) = 0;
  /// The same for pikoir_strips_next, where strips are of `size` primitives.
  virtual bool nextStrip(int32_t group, int64_t size) = 0;
  enum class Outcome {
    Done,
    Repeat, ///< Memory or a rule: the host is to take the run step by step.
    Spoilt  ///< The same, but state that was to stay has changed.
  };
  /// Submits what was recorded; false, and nothing runs, if the host is to take
  /// the run step by step. Throws.
  virtual bool submit() = 0;
  /// Whether it has ended; throws.
  virtual bool isDone() const = 0;
  /// Waits for it; throws.
  virtual Outcome await() = 0;
  /// Ends what begin() began, whatever has happened.
  virtual void end() noexcept = 0;
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_DEVICEFRAME_H
