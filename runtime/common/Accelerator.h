// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Accelerator.h - A device that kernels run on -----------------------===//
//
// What a pipeline needs of a device that runs its grids. Memory is of two
// kinds: what allocate() gives is the device's alone, and what map() gives is
// the host's, which kernels reach at the same address, as slowly as the bus is.
// Host and device never use the latter at the same time, because launch()
// returns when the grid has ended, and nobody touches what a frame uses before
// it has been waited for.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_ACCELERATOR_H
#define PIKO_RUNTIME_COMMON_ACCELERATOR_H

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace piko::rt {

/// While a host's call lasts: at the end of the outermost one the thread has
/// the device (the context, in CUDA) that it had before.
class DeviceScope {
public:
  DeviceScope() noexcept;
  DeviceScope(const DeviceScope &) = delete;
  DeviceScope &operator=(const DeviceScope &) = delete;
  ~DeviceScope();
};

class Accelerator {
public:
  virtual ~Accelerator() = default;

  /// Which one it is of its kind.
  virtual int32_t number() const = 0;
  /// Throws Failure if the device is lost: then what map() gave may be gone.
  virtual void checkAlive() const = 0;
  /// Throws Failure if the device takes the program's kernels not. Otherwise
  /// their first launch does.
  virtual void loadKernels() = 0;

  /// Memory of the host's that kernels reach, aligned to a page; null if
  /// refused.
  virtual uint8_t *map(size_t bytes) noexcept = 0;
  virtual void unmap(uint8_t *data) noexcept = 0;
  /// Memory of the device; null if refused.
  virtual uint8_t *allocate(size_t bytes) noexcept = 0;
  virtual void release(uint8_t *data) noexcept = 0;

  /// Memory of the device for what grids emit, the same for all. Nobody makes
  /// it zero. Empty if refused.
  virtual std::span<uint8_t> logSpace() noexcept = 0;

  // --- what the host says is where. Errors begin with `who`.
  /// Throws Failure unless kernels may use so many bytes there.
  virtual void checkMemory(const std::string &who, const void *address,
                           int64_t bytes) const = 0;
  /// Throws Failure if that is memory of a device alone.
  virtual void checkHosts(const std::string &who, const void *data) const = 0;

  // --- runs. What these begin is in the order of the stream; they may return
  // before it is done, and throw Failure.
  /// The stream of the run that begins: the host's, or PIKORT_OWN_STREAM.
  /// Whether the host waits for its end at once.
  virtual void useStream(void *stream, bool waits) = 0;
  /// Waits for what the stream has been given; what follows is in one of ours.
  virtual void finishStream() = 0;
  /// The same, where it has anything to do for the run, and after an error.
  virtual void endStream() noexcept = 0;
  /// Copies to the device, on it, and to the host.
  virtual void upload(uint8_t *to, const uint8_t *from, int64_t bytes) = 0;
  virtual void copy(uint8_t *to, const uint8_t *from, int64_t bytes) = 0;
  virtual void download(uint8_t *to, const uint8_t *from, int64_t bytes) = 0;
  /// Makes memory of the device zero.
  virtual void clear(uint8_t *data, int64_t bytes) = 0;

  /// How many threads it takes to fill the device.
  virtual int64_t residentThreads() const = 0;

  /// Runs a kernel of the program's and waits for it; throws Failure.
  /// `arguments` are `count` words of eight bytes.
  virtual void launch(const char *kernel, int64_t blocks, int64_t threads,
                      const void *arguments, int64_t count) = 0;
};

/// Bytes of a device's own memory; none at first.
class DeviceBytes {
public:
  /// Makes them `size` bytes; true if they are other ones than before, where
  /// both need not fit. Throws OutOfMemory.
  bool resize(Accelerator &from, int64_t size);
  uint8_t *data() const { return data_.get(); }
  int64_t size() const { return size_; }
  explicit operator bool() const { return data_ != nullptr; }

private:
  struct Release {
    Accelerator *from;
    void operator()(uint8_t *data) const { from->release(data); }
  };
  std::unique_ptr<uint8_t, Release> data_;
  int64_t size_ = 0;
};

/// Whether that is what a program calls a kind of device.
bool isDeviceKind(std::string_view name) noexcept;
/// Throws Failure unless this machine has a device of a kind with this number,
/// or the one that is taken for PIKORT_ANY_DEVICE.
void checkDevice(std::string_view kind, int32_t number);

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_ACCELERATOR_H
