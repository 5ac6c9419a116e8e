//===- piko/reference/loop.h - One parallelFor that is running ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Iterations run one after the other on the caller's stack, until iteration 0
// calls sync(): it then starts the others, each on a fiber, and lets every one
// run to its own sync(), in order of index. So iteration 0 is also the
// scheduler, and a loop without sync() costs nothing and reads naturally in a
// debugger.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_LOOP_H
#define PIKO_REFERENCE_LOOP_H

#include <piko/reference/fiber.h>
#include <piko/reference/graph.h>

#include <any>
#include <memory>

namespace piko::reference {

/// What iterations meet at: a call of the language and, of one that exchanges
/// values, what it makes of them.
struct Barrier {
  std::string_view call;
  const TypeInfo *combines = nullptr;
  bool operator==(const Barrier &) const = default;
};

/// A primitive on its way to a stage.
struct Emission {
  Node *to;
  std::vector<std::byte> primitive;
};

class HopLoop {
public:
  /// Of a call of Process for `node` and `bin`.
  HopLoop(HopLoop *outer, const Node &node, int64_t bin, int64_t size,
          std::function<void(int64_t)> body)
      : outer(outer), size(size), node(node), bin(bin), body(std::move(body)) {}

  /// Runs all iterations. `deliver` takes what iterations emitted while their
  /// emissions had to be kept.
  template <class Deliver> void run(Deliver deliver) {
    // A division without a result jumps to the innermost guard, which must not
    // be outside of what the fibers belong to.
    if (size > 0)
      DivisionTrap::guard([this] { body(0); });
    for (iteration = 1; iteration < size && fibers.empty(); ++iteration)
      body(iteration);
    for (size_t i = 0; i < fibers.size(); ++i) {
      resume(i);
      if (!fibers[i]->isDone())
        failUniform(arrived);
    }
    running = nullptr;
    for (std::vector<Emission> &list : kept)
      for (const Emission &emission : list)
        deliver(emission);
  }

  /// Called by an iteration: a barrier between all of them.
  void sync(const Barrier &barrier) {
    arrived = barrier;
    if (running) {
      running->suspend();
      return;
    }
    if (iteration != 0)
      failUniform(barrier);
    if (fibers.empty())
      start();
    for (size_t i = 0; i < fibers.size(); ++i) {
      resume(i);
      if (fibers[i]->isDone() || arrived != barrier)
        failUniform(barrier);
    }
    running = nullptr;
    iteration = 0;
  }

  /// Where the running iteration keeps its emissions; null if they can be
  /// delivered at once.
  std::vector<Emission> *keeper() {
    return running ? &kept[iteration - 1] : nullptr;
  }

  HopLoop *const outer;
  const int64_t size;
  int64_t iteration = 0;
  std::any handedIn; ///< what iterations hand in to a collective operation
  std::any result;   ///< and what comes out of it

private:
  void start() {
    kept.resize(size - 1);
    for (int64_t i = 1; i < size; ++i)
      fibers.push_back(
          std::make_unique<Fiber>(node.stacks, [this, i] { body(i); }));
  }

  void resume(size_t fiber) {
    running = fibers[fiber].get();
    iteration = static_cast<int64_t>(fiber) + 1;
    running->resume();
  }

  /// The running iteration, or iteration 0, does not come to a barrier.
  [[noreturn]] void failUniform(const Barrier &barrier) {
    running = nullptr;
    node.fail(bin, "expected every iteration of parallelFor to call " +
                       std::string(barrier.call) +
                       "() as often as iteration 0, but iteration " +
                       std::to_string(iteration) + " does not");
  }

  const Node &node;
  const int64_t bin;
  std::function<void(int64_t)> body;
  std::vector<std::vector<Emission>> kept; ///< of iterations 1, 2, ...
  std::vector<std::unique_ptr<Fiber>> fibers;
  Fiber *running = nullptr;
  Barrier arrived{}; ///< where an iteration came to last
};

} // namespace piko::reference

#endif // PIKO_REFERENCE_LOOP_H
