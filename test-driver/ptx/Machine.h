// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Machine.h - Launches of kernels ------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_MACHINE_H
#define PIKO_TEST_DRIVER_PTX_MACHINE_H

#include "ptx/Warp.h"
#include "ptx/memory/Footprint.h"
#include "ptx/memory/StoreBuffer.h"

#include <initializer_list>
#include <memory>
#include <random>

namespace piko::ptx {

/// Global memory: what kernels may access.
class Memory {
public:
  /// Addresses, and how far after each of them its memory lies in the host.
  struct Range {
    uint64_t begin = 0, end = 0, distance = 0;
  };
  virtual ~Memory() = default;
  /// The allocation or variable that an address lies in; empty if there is
  /// none.
  virtual Range find(uint64_t address) const = 0;
  /// What is known of an address that lies in none; empty if nothing.
  virtual std::string describe(uint64_t address) const { return {}; }
};

/// What the conditional nodes of a graph ask.
class Conditions {
public:
  virtual ~Conditions() = default;
  /// Whether there is a condition of this handle.
  virtual bool set(uint64_t handle, uint32_t value) = 0;
};

struct Launch {
  const Program &program;
  const Memory &memory;
  std::string_view source; ///< The module's text, for messages.
  std::array<uint32_t, 3> blocks, threads;
  uint32_t dynamicSharedBytes = 0;
  std::vector<uint8_t> parameters;
  /// All blocks make progress: each runs until it sleeps or has had its turn.
  /// Without it a block that sleeps lets no other one run.
  bool cooperative = false;
  /// Of the order of blocks, of warps, and of lanes in atomic operations; 0: as
  /// they are numbered.
  uint64_t seed = 0;
  /// Lanes that have parted may stay apart, and run in any order.
  bool apart = false;
  /// What a block stores others see at its fences, and when it ends.
  bool buffered = false;
  Conditions *conditions = nullptr; ///< Of the graph that launches it.
  uint64_t resident = 1; ///< How many blocks find room at the same time.
  /// How many of them are on a multiprocessor, if all have as many.
  uint64_t together = 1;
  const Latencies *latencies = nullptr; ///< Null: nobody asks for times.
  std::vector<Site> sites{};
  Footprint footprint{};
  // Where there are latencies:
  Touches touches{};
  uint32_t fences = 1; ///< Of the device's scope so far, and one.
  /// The most that one warp ran.
  uint64_t longestWarp = 0;
  /// What went by until the last block ended.
  uint64_t lastBlock = 0;
  /// The same in cycles, of warps of which each has a multiprocessor for
  /// itself.
  Time span{};
  /// By address, of a cooperative launch with latencies: what atomic operations
  /// made of it, and when.
  struct Change {
    uint64_t value;
    Time at;
  };
  std::unordered_map<uint64_t, std::vector<Change>> changes{};
};

/// Memory of the blocks that run: registers, local and shared memory. Kept from
/// one launch to the next, because to map and clear pages anew takes longer
/// than most kernels.
class Workspace {
public:
  /// The bytes that parts of these sizes take.
  static size_t sizeOf(std::initializer_list<size_t> parts);
  /// Room for so many bytes; what was taken is invalid.
  void reset(size_t bytes);
  /// The next part, at a multiple of 64 bytes. Its content is unspecified.
  uint8_t *take(size_t bytes);

private:
  std::unique_ptr<uint8_t[]> memory;
  size_t capacity = 0;
  uint8_t *next = nullptr;
};

/// A block and its warps.
class Block {
public:
  Block(Launch &launch, Workspace &workspace);
  /// The memory that a block takes of a workspace.
  static size_t bytesFor(const Launch &launch);
  void begin(uint64_t number);
  enum class Turn : uint8_t { Ended, Over, Asleep };
  /// Wakes what sleeps, and runs until nothing is awake or the turn is over.
  Turn run();
  /// Whether memory has changed since the last question.
  bool takeChange();
  /// As `Warp::separate`.
  bool separate();
  /// Something sleeps, and nothing that runs changes what it reads.
  [[noreturn]] void reportEndlessSleep(const std::string &others) const;
  /// A group of a warp has come to a barrier.
  void arrive() { arrived = true; }
  bool takesTurns() const { return !launch.cooperative && launch.resident > 1; }
  /// Of blocks that take turns: instructions up to which this one may go on.
  uint64_t turnEnd = 0;
  /// Whether the turn is over for a warp that has run so many, and asks for
  /// what others may take before it.
  bool endTurn(uint64_t ran) {
    yielded |= ran > turnEnd;
    return ran > turnEnd;
  }
  /// A number below \p count.
  uint64_t pick(uint64_t count) { return random() % count; }
  /// The instructions that its longest warp has run.
  uint64_t ran() const;
  /// When its last warp is where it is.
  Time time() const;
  /// At a fence of the device's scope: what is read after it may be another
  /// multiprocessor's.
  void emptyCaches() {
    cache.clear();
    fences = ++launch.fences;
  }

  Launch &launch;
  // Where the launch has latencies:
  SectorCache cache;   ///< The block's part.
  uint32_t fences = 1; ///< Of the launch, at the block's latest.
  std::array<uint32_t, 3> index{};
  uint32_t threadCount;
  uint64_t sharedSize;

private:
  bool runWarps();
  bool hasSleepers() const;
  bool releaseBarriers();
  uint32_t liveThreads() const;
  [[noreturn]] void reportDeadlock() const;

  bool arrived = false, yielded = false;
  std::mt19937_64 random;
  StoreBuffer stores;
  uint8_t *sharedMemory;
  std::vector<std::unique_ptr<Warp>> warps;
};

/// A line of a text, from 1 on, without the space that it begins with.
std::string_view lineOf(std::string_view source, uint32_t line);

/// Runs all blocks. Throws Fault.
void run(Launch &launch);

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_MACHINE_H
