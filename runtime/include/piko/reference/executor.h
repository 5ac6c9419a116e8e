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
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_EXECUTOR_H
#define PIKO_REFERENCE_EXECUTOR_H

#include <piko/reference/loop.h>

namespace piko::reference {

enum class Phase { Assign, Schedule, Process };

/// One call of a phase.
struct Frame {
  Phase phase;
  Node *node;
  int64_t bin; ///< being scheduled or processed; in Assign, the producer's bin
  const Node *producer = nullptr;           ///< Assign; null for a source
  std::vector<int64_t> *assigned = nullptr; ///< Assign
  std::vector<Emission> *kept = nullptr;    ///< Process, on a cycle
  Loop *loop = nullptr;                     ///< the innermost parallelFor
  bool updating = false;                    ///< inside update()
};

class Executor {
public:
  Frame *frame = nullptr; ///< the phase that is running
  int64_t loopLimit = int64_t(1) << 20;

  /// The executor that is running on this thread.
  static Executor *&current() {
    static thread_local Executor *executor = nullptr;
    return executor;
  }

  /// Calls schedule() for each bin of a stage.
  void scheduleBins(Node &node) {
    node.schedules.assign(node.grid.bins(), {});
    node.collected.assign(node.grid.bins(), {});
    node.waitsOn.clear();
    node.waits = node.unordered = false;
    for (int64_t bin = 0; bin < node.grid.bins(); ++bin) {
      Frame call{.phase = Phase::Schedule, .node = &node, .bin = bin};
      Enter enter(*this, call);
      node.schedule(bin);
    }
  }

  /// Brings a primitive to a stage.
  void deliver(Node &to, const std::byte *primitive, const Node *producer,
               int64_t producerBin) {
    if (!to.collects() && to.loop >= 0)
      return runLoop(to, primitive, producer, producerBin);
    for (int64_t bin : assign(to, primitive, producer, producerBin)) {
      if (to.collects()) {
        std::vector<std::byte> &list = to.collected[bin];
        list.insert(list.end(), primitive, primitive + to.inputSize);
      } else {
        process(to, bin, primitive, nullptr);
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
            failLoop(*node, -1, "rounds");
          break;
        }
    }
  }

  void emit(int port, const TypeInfo *type, const void *primitive) {
    Frame &call = expect(Phase::Process, "emit");
    Node &node = *call.node;
    if (call.updating)
      node.fail(call.bin, "emit inside update");
    if (port < 0 || port >= static_cast<int>(node.ports.size()))
      node.fail(call.bin, "expected a port below " +
                              std::to_string(node.ports.size()) + ", but got " +
                              std::to_string(port));
    const Port &out = node.ports[port];
    if (out.type != type)
      node.fail(call.bin, "expected a primitive of type '" +
                              std::string(out.type->name) + "' for port " +
                              std::to_string(port) + ", but got '" +
                              std::string(type->name) + "'");
    const auto *bytes = static_cast<const std::byte *>(primitive);
    Node *to = out.to.front();
    if (std::vector<Emission> *keeper = keeperOf(call))
      keeper->push_back({to, {bytes, bytes + to->inputSize}});
    else
      deliver(*to, bytes, &node, call.bin);
  }

  void assignBin(int64_t bin) {
    Frame &call = expect(Phase::Assign, "an assign directive");
    int64_t bins = call.node->grid.bins();
    if (bin < 0 || bin >= bins)
      call.node->fail(-1, "expected a bin id in [0, " + std::to_string(bins) +
                              "), but got " + std::to_string(bin));
    call.assigned->push_back(bin);
  }

  /// Runs a parallelFor of the current Process.
  void parallelFor(int64_t size, std::function<void(int64_t)> body) {
    Frame &call = expect(Phase::Process, "parallelFor");
    if (call.updating)
      call.node->fail(call.bin, "parallelFor inside update");
    Loop loop(call.loop, size, std::move(body));
    struct Restore {
      Loop *&slot, *saved;
      ~Restore() { slot = saved; }
    } restore{call.loop, call.loop};
    call.loop = &loop;
    loop.run(*call.node, [&](const Emission &emission) {
      if (call.kept)
        call.kept->push_back(emission);
      else
        deliver(*emission.to, emission.primitive.data(), call.node, call.bin);
    });
  }

  void sync() { loopForSync("sync()").sync(*frame->node); }

  /// The loop that a barrier or a collective operation belongs to.
  Loop &loopForSync(const char *what) {
    Frame &call = expect(Phase::Process, what);
    if (!call.loop)
      call.node->fail(call.bin, std::string(what) + " outside parallelFor");
    if (call.loop->outer)
      call.node->fail(call.bin,
                      std::string(what) + " inside a nested parallelFor");
    if (call.updating)
      call.node->fail(call.bin, std::string(what) + " inside update");
    return *call.loop;
  }

  /// The running call, which must be of the given phase.
  Frame &expect(Phase phase, const char *what) {
    static constexpr const char *names[] = {"assignBin", "schedule", "process"};
    if (!frame)
      throw Error(std::string(what) + " outside a running pipeline");
    if (frame->phase != phase)
      frame->node->fail(frame->bin, std::string(what) + " is for " +
                                        names[static_cast<int>(phase)] +
                                        ", but is used in " +
                                        names[static_cast<int>(frame->phase)]);
    return *frame;
  }

private:
  /// Makes a call the running one for a scope.
  struct Enter {
    Executor &executor;
    Frame *saved;
    Enter(Executor &executor, Frame &call)
        : executor(executor), saved(executor.frame) {
      executor.frame = &call;
    }
    ~Enter() { executor.frame = saved; }
  };

  std::vector<int64_t> assign(Node &to, const std::byte *primitive,
                              const Node *producer, int64_t producerBin) {
    std::vector<int64_t> bins;
    Frame call{.phase = Phase::Assign,
               .node = &to,
               .bin = producerBin,
               .producer = producer,
               .assigned = &bins};
    {
      Enter enter(*this, call);
      to.assign(primitive);
    }
    std::sort(bins.begin(), bins.end());
    bins.erase(std::unique(bins.begin(), bins.end()), bins.end());
    return bins;
  }

  void process(Node &node, int64_t bin, const std::byte *primitive,
               std::vector<Emission> *kept) {
    Frame call{
        .phase = Phase::Process, .node = &node, .bin = bin, .kept = kept};
    Enter enter(*this, call);
    node.process(primitive);
  }

  /// Delivers a primitive to a stage on a cycle, and all that follows from it.
  void runLoop(Node &first, const std::byte *primitive, const Node *producer,
               int64_t producerBin) {
    struct Work {
      Node *node;
      int64_t bin; ///< -1: not yet assigned
      const Node *producer;
      int64_t producerBin;
      int64_t hops;
      std::vector<std::byte> primitive;
    };
    std::vector<Work> stack;
    stack.push_back({&first,
                     -1,
                     producer,
                     producerBin,
                     0,
                     {primitive, primitive + first.inputSize}});
    while (!stack.empty()) {
      Work work = std::move(stack.back());
      stack.pop_back();
      if (work.node->loop != first.loop) {
        deliver(*work.node, work.primitive.data(), work.producer,
                work.producerBin);
      } else if (work.bin < 0) {
        std::vector<int64_t> bins = assign(*work.node, work.primitive.data(),
                                           work.producer, work.producerBin);
        for (auto bin = bins.rbegin(); bin != bins.rend(); ++bin)
          stack.push_back({work.node, *bin, work.producer, work.producerBin,
                           work.hops, work.primitive});
      } else {
        if (work.hops > loopLimit)
          failLoop(*work.node, work.bin, "hops");
        std::vector<Emission> kept;
        process(*work.node, work.bin, work.primitive.data(), &kept);
        for (auto next = kept.rbegin(); next != kept.rend(); ++next)
          stack.push_back({next->to, -1, work.node, work.bin, work.hops + 1,
                           std::move(next->primitive)});
      }
    }
  }

  /// Processes what a stage has collected.
  void runCollected(Node &node, bool firstRound) {
    std::vector<std::vector<std::byte>> lists(node.grid.bins());
    lists.swap(node.collected);
    for (int64_t bin = 0; bin < node.grid.bins(); ++bin) {
      const std::byte *list = lists[bin].data();
      int64_t count = lists[bin].size() / node.inputSize;
      const BinSchedule &schedule = node.schedules[bin];
      if (!node.takesList) {
        for (int64_t i = 0; i < count; ++i)
          process(node, bin, list + i * node.inputSize, nullptr);
        continue;
      }
      if (count == 0 && !(schedule.everyBin && firstRound))
        continue;
      int64_t batch = schedule.batch ? schedule.batch : count;
      int64_t begin = 0;
      do {
        Frame call{.phase = Phase::Process, .node = &node, .bin = bin};
        Enter enter(*this, call);
        node.processList(list + begin * node.inputSize,
                         std::min(batch, count - begin));
        begin += batch;
      } while (begin < count);
    }
  }

  static bool holdsPrimitives(const Node &node) {
    return std::any_of(node.collected.begin(), node.collected.end(),
                       [](const auto &list) { return !list.empty(); });
  }

  std::vector<Emission> *keeperOf(Frame &call) {
    for (Loop *loop = call.loop; loop; loop = loop->outer)
      if (std::vector<Emission> *keeper = loop->keeper())
        return keeper;
    return call.kept;
  }

  [[noreturn]] void failLoop(const Node &node, int64_t bin, const char *what) {
    node.fail(bin, "a loop did not end within " + std::to_string(loopLimit) +
                       " " + what);
  }
};

} // namespace piko::reference

#endif // PIKO_REFERENCE_EXECUTOR_H
