//===- piko/reference/executor.h - How primitives flow --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The executor is recursive: an emitted primitive is at once assigned to bins
// and, for each of them in ascending order, processed. Order is therefore
// lineage. Three things wait:
//
//   * what a stage on a cycle emits is kept until its Process returns, and
//     goes on an explicit stack, which gives the same order;
//   * what iterations emit between syncs is kept until the loop ends;
//   * primitives that reach a collecting stage are kept until it runs.
//
// In checking mode (PIKO_CHECK) it tells a Checker what runs, and each error
// where it happened.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_EXECUTOR_H
#define PIKO_REFERENCE_EXECUTOR_H

#include <piko/macros_begin.h>

#include <piko/reference/checker.h>
#include <piko/reference/loop.h>
#include <piko/reference/numbers.h>

namespace piko::reference {

/// One call of a phase.
struct CallFrame {
  Phase phase;
  Node *node;
  int64_t bin; ///< being scheduled or processed; in Assign, the producer's bin
  const Node *producer = nullptr;           ///< Assign; null for a source
  std::vector<int64_t> *assigned = nullptr; ///< Assign
  std::vector<Emission> *kept = nullptr;    ///< Process, on a cycle
  HopLoop *loop = nullptr;                  ///< the innermost parallelFor
  bool updating = false;                    ///< inside update()
  Lineage lineage{};   ///< of the primitive, or of the call that collected
  int64_t emitted = 0; ///< primitives, so far
  SourcePlace at{};    ///< of the language's call that is running
};

class Executor {
public:
  CallFrame *frame = nullptr; ///< the phase that is running
  int64_t loopLimit = int64_t(1) << 20;
  Checker checker;                  ///< used in checking mode
  std::vector<NumberField> numbers; ///< fields that must not be NaN

  /// The executor that is running on this thread.
  static Executor *&current() {
    static thread_local Executor *executor = nullptr;
    return executor;
  }

  /// Calls schedule() for each bin of a stage.
  void scheduleBins(Node &node) {
    node.schedules.assign(node.grid.bins(), {});
    node.collected.assign(node.grid.bins(), {});
    StageSchedule before;
    for (int64_t bin = 0; bin < node.grid.bins(); ++bin) {
      StageSchedule &said = node;
      said = {};
      CallFrame call{.phase = Phase::Schedule, .node = &node, .bin = bin};
      run(call, [&] { node.schedule(bin); });
      const char *other = bin > 0 ? said.findOther(before) : nullptr;
      if (other)
        node.fail(bin, std::string("expected ") + other +
                           " to be said for all bins or for none");
      before = said;
    }
  }

  /// Brings a primitive to a stage.
  void deliver(Node &to, const std::byte *primitive, const Node *producer,
               int64_t producerBin, const Lineage &lineage) {
    if (!to.collects() && to.loop >= 0)
      return runLoop(to, primitive, producer, producerBin, lineage);
    for (int64_t bin : assign(to, primitive, producer, producerBin, lineage)) {
      if (to.collects()) {
        std::vector<std::byte> &list = to.collected[bin];
        list.insert(list.end(), primitive, primitive + to.inputSize);
      } else {
        process(to, bin, primitive, lineage, nullptr);
      }
    }
  }

  /// Runs a component that collects, in rounds if it is a cycle.
  void runComponent(const Component &component) {
    int64_t round = 0;
    bool more = true;
    while (more) {
      for (Node *node : component.nodes)
        if (node->collects())
          runCollected(*node, round == 0);
      more = false;
      for (Node *node : component.nodes)
        if (holdsPrimitives(*node)) {
          more = true;
          if (++round > loopLimit)
            failLoop(*node, -1, "rounds", nullptr);
          break;
        }
    }
  }

  void emit(int port, const TypeInfo *type, const void *primitive) {
    CallFrame &call = expect(Phase::Process, "emit");
    Node &node = *call.node;
    if (call.updating)
      node.fail(call.bin, "expected emit outside an update");
    if (port < 0 || port >= static_cast<int>(node.ports.size()))
      node.failPort(call.bin, port);
    const Port &out = node.ports[port];
    if (out.type != type)
      node.fail(call.bin, "expected a primitive of type '" +
                              std::string(out.type->name) + "' for port " +
                              std::to_string(port) + ", but got '" +
                              std::string(type->name) + "'");
    const auto *bytes = static_cast<const std::byte *>(primitive);
    checkNumbers(node, call.bin, type, bytes);
    Node *to = out.to.front();
    if (std::vector<Emission> *keeper = keeperOf(call))
      keeper->push_back({to, {bytes, bytes + to->inputSize}});
    else
      deliver(*to, bytes, &node, call.bin, stepFrom(call));
  }

  /// Fails if a field of a primitive that must be a number is NaN.
  void checkNumbers(const Node &node, int64_t bin, const TypeInfo *type,
                    const std::byte *primitive,
                    const Lineage &lineage = nullptr) const {
    if constexpr (checking)
      for (const NumberField &field : numbers)
        if (field.record == type && field.hasNaN(primitive))
          node.fail(bin,
                    "expected a number in field '" + field.name + "' of '" +
                        std::string(type->name) + "', but got NaN",
                    contextText({}, lineage));
  }

  void assignBin(int64_t bin) {
    CallFrame &call = expect(Phase::Assign, "an assign directive");
    int64_t bins = call.node->grid.bins();
    if (bin < 0 || bin >= bins)
      call.node->fail(
          -1,
          "expected a bin id in [0, " + std::to_string(bins) + "), but got " +
              std::to_string(bin) +
              (bin == -1 ? ", which binFromPosition gives outside of the domain"
                         : ""));
    call.assigned->push_back(bin);
  }

  /// Runs a parallelFor of the current Process.
  void parallelFor(int64_t size, std::function<void(int64_t)> body) {
    CallFrame &call = expect(Phase::Process, "parallelFor");
    if (call.updating)
      call.node->fail(call.bin, "expected parallelFor outside an update");
    if constexpr (checking)
      body = [this, number = checker.beginLoop(),
              body = std::move(body)](int64_t i) {
        checker.beginIteration(number, i);
        body(i);
        checker.endIteration();
      };
    HopLoop loop(call.loop, *call.node, call.bin, size, std::move(body));
    struct Restore {
      HopLoop *&slot, *saved;
      ~Restore() { slot = saved; }
    } restore{call.loop, call.loop};
    call.loop = &loop;
    loop.run([&](const Emission &emission) {
      if (call.kept)
        call.kept->push_back(emission);
      else
        deliver(*emission.to, emission.primitive.data(), call.node, call.bin,
                stepFrom(call));
    });
  }

  void sync(const Barrier &barrier) {
    HopLoop &loop = loopForSync(barrier.call.data());
    if constexpr (!checking) {
      loop.sync(barrier);
    } else {
      std::shared_ptr<Strand> before = checker.beginBarrier();
      loop.sync(barrier);
      checker.endBarrier(*before);
    }
  }

  /// The loop that a barrier or a collective operation belongs to.
  HopLoop &loopForSync(const char *what) {
    CallFrame &call = expect(Phase::Process, what);
    if (!call.loop)
      call.node->fail(call.bin, std::string("expected ") + what +
                                    " inside a parallelFor");
    if (call.loop->outer)
      call.node->fail(call.bin, std::string("expected ") + what +
                                    " inside a parallelFor that is not nested");
    if (call.updating)
      call.node->fail(call.bin,
                      std::string("expected ") + what + " outside an update");
    return *call.loop;
  }

  /// The running call, which must be of the given phase.
  CallFrame &expect(Phase phase, const char *what) {
    static constexpr const char *names[] = {"assignBin", "schedule", "process"};
    if (!frame)
      throw Error(std::string(what) + " outside a running pipeline");
    if (frame->phase != phase)
      frame->node->fail(frame->bin, std::string("expected ") + what + " in " +
                                        names[static_cast<int>(phase)] +
                                        ", but it is in " +
                                        names[static_cast<int>(frame->phase)]);
    return *frame;
  }

private:
  /// Makes a call the running one for a scope.
  struct Enter {
    Executor &executor;
    CallFrame *saved;
    Enter(Executor &executor, CallFrame &call)
        : executor(executor), saved(executor.frame) {
      executor.frame = &call;
    }
    ~Enter() { executor.frame = saved; }
  };

  /// Calls a phase. A division is no call of the language, so that its place is
  /// not known.
  template <class F> static void guard(CallFrame &call, F &phase) {
    try {
      DivisionTrap::guard(phase);
    } catch (const NoQuotient &) {
      call.at = {};
      call.node->fail(call.phase == Phase::Assign ? -1 : call.bin,
                      "expected an integer division to have a result, but it "
                      "divides by 0 or overflows");
    }
  }

  /// Runs a call of a phase.
  template <class F> void run(CallFrame &call, F phase) {
    Enter enter(*this, call);
    if constexpr (!checking) {
      guard(call, phase);
    } else {
      try {
        std::shared_ptr<Strand> outer =
            checker.beginCall(call.phase, call.node, call.bin, call.lineage);
        guard(call, phase);
        checker.endCall(std::move(outer));
      } catch (const LocatedError &) {
        throw;
      } catch (const Error &error) {
        throw LocatedError(error.what() + contextText(call.at, call.lineage));
      }
    }
  }

  /// The lineage of the next primitive that a call emits.
  static Lineage stepFrom(CallFrame &call) {
    return makeStep(call.lineage, call.node->name(), call.bin, call.emitted++);
  }

  std::vector<int64_t> assign(Node &to, const std::byte *primitive,
                              const Node *producer, int64_t producerBin,
                              const Lineage &lineage) {
    std::vector<int64_t> bins;
    CallFrame call{.phase = Phase::Assign,
                   .node = &to,
                   .bin = producerBin,
                   .producer = producer,
                   .assigned = &bins,
                   .lineage = lineage};
    run(call, [&] { to.assign(primitive); });
    std::sort(bins.begin(), bins.end());
    bins.erase(std::unique(bins.begin(), bins.end()), bins.end());
    return bins;
  }

  void process(Node &node, int64_t bin, const std::byte *primitive,
               Lineage lineage, std::vector<Emission> *kept) {
    CallFrame call{.phase = Phase::Process,
                   .node = &node,
                   .bin = bin,
                   .kept = kept,
                   .lineage = std::move(lineage)};
    run(call, [&] { node.process(primitive); });
  }

  /// Delivers a primitive to a stage on a cycle, and all that follows from it.
  void runLoop(Node &first, const std::byte *primitive, const Node *producer,
               int64_t producerBin, const Lineage &lineage) {
    struct Work {
      Node *node;
      int64_t bin; ///< -1: not yet assigned
      const Node *producer;
      int64_t producerBin;
      int64_t hops;
      std::vector<std::byte> primitive;
      Lineage lineage;
    };
    std::vector<Work> stack;
    stack.push_back({&first,
                     -1,
                     producer,
                     producerBin,
                     0,
                     {primitive, primitive + first.inputSize},
                     lineage});
    while (!stack.empty()) {
      Work work = std::move(stack.back());
      stack.pop_back();
      if (work.node->loop != first.loop) {
        deliver(*work.node, work.primitive.data(), work.producer,
                work.producerBin, work.lineage);
      } else if (work.bin < 0) {
        std::vector<int64_t> bins =
            assign(*work.node, work.primitive.data(), work.producer,
                   work.producerBin, work.lineage);
        for (auto bin = bins.rbegin(); bin != bins.rend(); ++bin)
          stack.push_back({work.node, *bin, work.producer, work.producerBin,
                           work.hops, work.primitive, work.lineage});
      } else {
        if (work.hops > loopLimit)
          failLoop(*work.node, work.bin, "hops", work.lineage);
        std::vector<Emission> kept;
        process(*work.node, work.bin, work.primitive.data(), work.lineage,
                &kept);
        for (size_t i = kept.size(); i-- > 0;)
          stack.push_back({kept[i].to, -1, work.node, work.bin, work.hops + 1,
                           std::move(kept[i].primitive),
                           makeStep(work.lineage, work.node->name(), work.bin,
                                    static_cast<int64_t>(i))});
      }
    }
  }

  /// Processes what a stage has collected.
  void runCollected(Node &node, bool firstRound) {
    std::vector<std::vector<std::byte>> lists(node.grid.bins());
    lists.swap(node.collected);
    checker.nextTurn();
    for (int64_t bin = 0; bin < node.grid.bins(); ++bin) {
      const std::byte *list = lists[bin].data();
      int64_t count = lists[bin].size() / node.inputSize;
      const BinSchedule &schedule = node.schedules[bin];
      if (!node.takesList) {
        for (int64_t i = 0; i < count; ++i)
          process(node, bin, list + i * node.inputSize,
                  makeStep(nullptr, node.name(), bin, i), nullptr);
        continue;
      }
      if (count == 0 && !(schedule.everyBin && firstRound))
        continue;
      int64_t batch = schedule.batch ? schedule.batch : count;
      int64_t begin = 0;
      do {
        CallFrame call{.phase = Phase::Process, .node = &node, .bin = bin};
        if (batch > 0)
          call.lineage = makeStep(nullptr, node.name(), bin, begin / batch);
        run(call, [&] {
          node.processList(list + begin * node.inputSize,
                           std::min(batch, count - begin));
        });
        begin += batch;
      } while (begin < count);
    }
  }

  static bool holdsPrimitives(const Node &node) {
    return std::any_of(node.collected.begin(), node.collected.end(),
                       [](const auto &list) { return !list.empty(); });
  }

  std::vector<Emission> *keeperOf(CallFrame &call) {
    for (HopLoop *loop = call.loop; loop; loop = loop->outer)
      if (std::vector<Emission> *keeper = loop->keeper())
        return keeper;
    return call.kept;
  }

  [[noreturn]] void failLoop(const Node &node, int64_t bin, const char *what,
                             const Lineage &lineage) {
    node.fail(bin,
              "a loop did not end within " + std::to_string(loopLimit) + " " +
                  what,
              contextText({}, lineage));
  }
};

} // namespace piko::reference

#include <piko/macros_end.h>

#endif // PIKO_REFERENCE_EXECUTOR_H
