// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Warp.h - 32 threads in lockstep ------------------------------------===//
//
// Threads of a warp that are at the same place run together, as a group. Where
// a branch parts a group, its parts are new groups, and the old one waits where
// the branch reconverges until they have come there. So groups are a tree, of
// which only leaves run. A group that waits, at a barrier or for other lanes of
// a warp operation, lets other leaves run, as hardware with independent thread
// scheduling does. One that sleeps runs again in the block's next turn.
//
// On request what has parted may stay so, as hardware may have it, too, until
// the group that parted meets, and leaves run in any order: then only warp
// operations and barriers bring lanes together.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_WARP_H
#define PIKO_TEST_DRIVER_PTX_WARP_H

#include "ptx/Scoreboard.h"

#include <bit>
#include <span>
#include <unordered_map>

namespace piko::ptx {

class Block;
class StoreBuffer;
class Workspace;

enum class FaultKind : uint8_t {
  IllegalAddress,
  MisalignedAddress,
  IllegalInstruction, ///< What PTX leaves undefined.
  Trap,
  Deadlock
};

/// Ends a launch. The text names kernel, line, block and thread.
struct Fault {
  FaultKind kind;
  std::string text;
};

/// What an instruction did in a launch, and the range of memory that it used
/// last.
struct Site {
  uint64_t warps = 0;   ///< Times that it ran.
  uint64_t lanes = 0;   ///< Active ones, summed.
  uint64_t bytes = 0;   ///< Of global memory, requested.
  uint64_t sectors = 0; ///< Of 32 bytes, touched.
  uint64_t begin = ~uint64_t(0), end = ~uint64_t(0), distance = 0;
};

/// What memory and registers hold that nobody has written.
inline constexpr uint8_t unwritten = 0xcd;

/// Threads of a warp that run together.
struct Group {
  enum State : uint8_t { Free, Ready, Parted, AtBarrier, Gathering, Sleeping };
  State state = Free;
  bool callee = false; ///< Begins with a call, ends with its return.
  uint16_t children = 0;
  int32_t parent = -1;
  uint32_t mask = 0;
  uint32_t pc = 0;
  uint32_t reconverge = nowhere; ///< Where it ends.
  uint32_t wanted = 0;           ///< Lanes, of Gathering.
  uint32_t barrier = 0;          ///< Of AtBarrier.
  bool yielded = false;          ///< Before the instruction at pc.
  bool aligned = false;          ///< Lanes of a warp must come to it together.
  uint32_t arrivals = 0; ///< Threads that the barrier waits for; 0: all.
};

class Warp {
public:
  Warp(Block &block, uint32_t number, uint32_t threads, Workspace &workspace);

  /// Begins the kernel anew.
  void reset();
  /// Runs until no group can, or for about \p steps instructions; returns
  /// whether anything ran.
  bool run(uint32_t steps);

  template <typename T> T *lanes(Operand operand) const {
    return reinterpret_cast<T *>(bank[operand.bank] + operand.offset);
  }
  uint32_t &predicate(Operand operand) const {
    return *lanes<uint32_t>(operand);
  }
  /// Sets a predicate's active lanes to those of \p value.
  void setPredicate(Operand operand, uint32_t value) const {
    uint32_t &mask = predicate(operand);
    mask = (mask & ~active) | (value & active);
  }

  // What handlers of control flow call, for the current group.
  void jump(uint32_t target) { next = target; }
  /// Active lanes go to \p target, those that the guard leaves out go on.
  void branch(uint32_t target, uint32_t reconverge);
  /// Lanes and where they go. No two parts have the same target, all of them
  /// have all lanes of the group.
  struct Part {
    uint32_t mask, target;
  };
  void part(std::span<const Part> parts, uint32_t reconverge);
  void call(uint32_t target);
  void returnLanes();
  void exitLanes();
  /// Until so many threads have come to it, or all that live if it is 0.
  void waitAtBarrier(uint32_t barrier, uint32_t arrivals, bool aligned);
  /// Until the block's next turn.
  void sleep();
  /// The same, in a loop that waits for memory to change.
  void sleepInLoop();
  /// The same, before the current instruction, which changes memory that
  /// other blocks ask for, too; false if it is this block's turn to do so.
  bool yield();
  /// Where times are asked for and blocks wait for each other: an atomic
  /// operation has changed memory that they share; others see it later.
  void noteChange(uint64_t address, uint64_t value);
  /// What a strong load gets where \p value is: of an address that atomic
  /// operations change one value after the other, at the time of its change, so
  /// that a loop that waits ends when it would have.
  uint64_t see(uint64_t address, uint64_t value);
  /// Whether all lanes of \p members that live are here; `active` is them,
  /// then.
  bool gather(uint32_t members);

  /// Where nothing else can run, lanes that wait for others to reconverge go on
  /// without them; returns whether there are any.
  bool separate();
  /// Whether lanes wait at a barrier.
  bool isAt(uint32_t barrier) const;
  /// Those that bring it a predicate that holds.
  uint32_t lanesThatHold(uint32_t barrier) const;
  /// Lets groups go on that wait at a barrier of \p arrived threads, for
  /// \p holding of which the predicate that they brought holds.
  void release(uint32_t barrier, uint32_t arrived, uint32_t holding);
  /// Lets groups go on that sleep.
  void wake();
  /// A group that sleeps; null if none does.
  const Group *sleeper() const;

  [[noreturn]] void fault(FaultKind kind, const std::string &what,
                          uint32_t lane) const;

  /// Whether the guard leaves no lane of the group out.
  bool isWhole() const { return active == groups[current].mask; }

  // What handlers read.
  std::array<uint8_t *, 3> bank{};
  uint32_t active = 0; ///< Lanes of the current instruction.
  uint32_t pc = 0, next = 0;
  uint32_t live = 0;
  bool changed = false;   ///< Wrote what others may read, and it was new.
  uint64_t ran = 0;       ///< Instructions of this block.
  Scoreboard scoreboard;  ///< Where the launch has latencies.
  Site *site = nullptr;   ///< Of the current instruction.
  uint32_t firstLane = 0; ///< Of atomic operations; others follow in a circle.
  uint64_t sharedBytes = 0;
  uint8_t *shared = nullptr, *local = nullptr, *calls = nullptr;
  const uint8_t *parameters = nullptr;
  const Program *program = nullptr;
  StoreBuffer *buffer = nullptr; ///< The block's, if others see stores late.
  Block &block;
  const uint32_t number, first; ///< In the block: of the warp, its thread 0.
  std::vector<Group> groups;

private:
  void reduce(const Group &group, uint32_t arrived, uint32_t holding);
  uint32_t runGroup(uint32_t steps);
  void endYield();
  bool select();
  int32_t add(const Group &group);
  void finish(int32_t group);
  void removeLanes(uint32_t mask, bool fromCallers);

  std::unordered_map<uint64_t, size_t> seen; ///< Changes, by address.
  int32_t current = -1;
  bool reselect = false;  ///< The current group is not what runs next.
  bool exhausted = false; ///< It has had its turn.
  uint32_t threads;
};

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_WARP_H
