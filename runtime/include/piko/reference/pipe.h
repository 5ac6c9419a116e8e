//===- piko/reference/pipe.h - Pipelines ----------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_REFERENCE_PIPE_H
#define PIKO_REFERENCE_PIPE_H

#include <piko/reference/check.h>
#include <piko/reference/stage.h>

#include <span>

namespace piko {
namespace reference {

/// A Node that calls the phases of the user's stage S.
template <class S, class In> class TypedNode final : public Node {
public:
  explicit TypedNode(S &stage) : stage(stage) {
    address = &stage;
    type = typeOf<S>();
    inputType = typeOf<In>();
    inputSize = sizeof(In);
    takesList = !takesOne;
  }

  void assign(const std::byte *primitive) override {
    if constexpr (requires(const In &p) { stage.assignBin(p); })
      stage.assignBin(*reinterpret_cast<const In *>(primitive));
    else
      Executor::current()->assignBin(0);
  }
  void schedule(int64_t bin) override {
    if constexpr (requires { stage.schedule(BinId{}); })
      stage.schedule(BinId{bin});
  }
  void process(const std::byte *primitive) override {
    if constexpr (takesOne)
      stage.process(*reinterpret_cast<const In *>(primitive));
  }
  void processList(const std::byte *primitives, int64_t count) override {
    if constexpr (!takesOne)
      stage.process(List<In>(reinterpret_cast<const In *>(primitives), count));
  }

private:
  static constexpr bool takesOne =
      requires(S &s, const In &p) { s.process(p); };
  static_assert(
      takesOne || requires(S &s, const List<In> &l) { s.process(l); },
      "a stage needs process(const In &) or "
      "process(const piko::List<In> &)");
  S &stage;
};

} // namespace reference

/// The base of pipelines. A pipeline has its stages as members; its
/// constructor names sources and edges.
template <class State = NoState> class Pipe {
public:
  State &state() { return memory; }
  const State &state() const { return memory; }

  // For the host.

  /// The extent of the domain in cells, one number for each dimension.
  void setDomain(std::initializer_list<int64_t> extent) {
    setDomain(extent.begin(), static_cast<int>(extent.size()));
  }
  template <int Rank> void setDomain(const glm::vec<Rank, int> &extent) {
    int64_t values[Rank];
    for (int d = 0; d < Rank; ++d)
      values[d] = extent[d];
    setDomain(values, Rank);
  }
  void setDomain(const int64_t *extent, int rank) {
    if (rank < 1 || rank > 4)
      throw Error("expected a domain of 1 to 4 dimensions, but got " +
                  std::to_string(rank));
    for (int d = 0; d < 4; ++d) {
      domainExtent[d] = d < rank ? extent[d] : 1;
      if (domainExtent[d] < 1 || domainExtent[d] > INT32_MAX)
        throw Error("expected a domain of 1 to 2147483647 cells in each "
                    "dimension, but got " +
                    std::to_string(domainExtent[d]));
    }
    domainRank = rank;
  }

  /// The primitives of a source; the memory must stay until the run.
  template <class T> void feed(int source, const T *primitives, int64_t count) {
    if (source < 0 || source >= static_cast<int>(sources.size()))
      throw Error("expected one of the " + std::to_string(sources.size()) +
                  " sources, but got source " + std::to_string(source));
    Source &to = sources[source];
    if constexpr (!std::is_void_v<T>)
      if (to.node->inputType != reference::typeOf<std::remove_cv_t<T>>())
        to.node->fail(-1, "expected primitives of type '" +
                              std::string(to.node->inputType->name) +
                              "' for source " + std::to_string(source) +
                              ", but got '" +
                              std::string(reference::typeName<T>()) + "'");
    to.primitives = reinterpret_cast<const std::byte *>(primitives);
    to.count = count;
  }
  /// The same for a vector, an array or a span, and the only source of a
  /// stage.
  template <class S, class Range>
    requires requires(const Range &range) { std::data(range); }
  void feed(const S &stage, Range &&primitives) {
    static_assert(std::is_lvalue_reference_v<Range> ||
                      std::ranges::enable_borrowed_range<Range>,
                  "feed does not copy; the primitives must outlive the run");
    int found = -1;
    for (size_t i = 0; i < sources.size(); ++i)
      if (sources[i].node->address == &stage) {
        if (found >= 0)
          sources[i].node->fail(-1, "has several sources; feed them by number");
        found = static_cast<int>(i);
      }
    if (found < 0)
      reference::fail(reference::typeName<S>(), -1, "has no source");
    feed(found, std::data(primitives),
         static_cast<int64_t>(std::size(primitives)));
  }

  /// In checking mode: fields, such as &Fragment::z, of which no primitive
  /// that is fed or emitted may hold a NaN.
  template <auto... Field> void expectNumbers() {
    (executor.numbers.push_back(numberField<Field>(Field)), ...);
  }
  /// In checking mode: what messages call a buffer or an image.
  void nameState(const void *handle, std::string name) {
    executor.checker.nameState(handle, std::move(name));
  }

  /// How many hops a primitive may take on a cycle of stages, and how many
  /// rounds a cycle may run.
  void setLoopLimit(int64_t limit) { executor.loopLimit = limit; }

  /// Clears the images and runs the pipeline on what was fed.
  void run();

protected:
  Pipe() : memory() { reference::ImageBase::registry() = scope.saved; }
  Pipe(const Pipe &) = delete;
  Pipe &operator=(const Pipe &) = delete;
  ~Pipe() = default;

  /// A stage that is fed by the host; sources are numbered as they are named.
  template <class S> void source(S &stage) {
    sources.push_back({&nodeOf(stage), nullptr, 0});
  }
  /// What leaves `from` through a port goes to `to`.
  template <class From, class To> void connect(From &from, int port, To &to) {
    reference::Node &producer = nodeOf(from), &consumer = nodeOf(to);
    if (port < 0 || port >= static_cast<int>(producer.ports.size()))
      producer.failPort(-1, port);
    producer.ports[port].to.push_back(&consumer);
  }
  /// Gives a buffer as many elements as a source has primitives, zero at the
  /// start of each run.
  template <class T> void allocateForSource(Buffer<T> &buffer, int source) {
    allocations.push_back({&buffer, source});
  }

private:
  struct Source {
    reference::Node *node;
    const std::byte *primitives;
    int64_t count;
  };
  struct Allocation {
    reference::BufferBase *buffer;
    int source;
  };
  /// Collects the images while the state is constructed.
  struct Scope {
    explicit Scope(std::vector<reference::ImageBase *> &images)
        : saved(std::exchange(reference::ImageBase::registry(), &images)) {}
    std::vector<reference::ImageBase *> *saved;
  };

  template <auto Field, class Record, class Member>
  static reference::NumberField numberField(Member Record::*) {
    return reference::makeNumberField<Record, Member, Field>();
  }

  template <class S> reference::Node &nodeOf(S &stage) {
    for (auto &node : nodes)
      if (node->address == &stage && node->type == reference::typeOf<S>())
        return *node;
    return makeNode(stage, stage);
  }
  template <class S, class B, int Threads, class In, class... Out>
  reference::Node &makeNode(S &stage,
                            BasicStage<B, Threads, In, Out...> &base) {
    static_assert(
        B::wholeDomain || requires(const In &p) { stage.assignBin(p); },
        "a stage with several bins needs assignBin");
    auto node = std::make_unique<reference::TypedNode<S, In>>(stage);
    node->rank = B::rank;
    for (int d = 0; d < B::rank; ++d)
      node->binSize[d] = B::size[d];
    (node->ports.push_back({reference::typeOf<Out>(), {}}), ...);
    base.node = node.get();
    bindState(&stage);
    // Members lie in memory in order of declaration.
    auto at = std::find_if(nodes.begin(), nodes.end(), [&](const auto &other) {
      return std::less<>()(node->address, other->address);
    });
    return **nodes.insert(at, std::move(node));
  }
  template <class Used> void bindState(Uses<Used> *uses) {
    static_assert(std::is_base_of_v<Used, State>,
                  "the stage uses another state than its pipeline has");
    uses->bound = &memory;
  }
  void bindState(const void *) {}

  void checkGraph() const;
  void prepareState();
  std::vector<reference::Component> prepareStages();
  reference::StageOrder
  stageOrder(const std::vector<reference::Component> &components) const;

  std::vector<reference::ImageBase *> images;
  Scope scope{images};
  State memory;
  std::vector<std::unique_ptr<reference::Node>> nodes; ///< as declared
  std::vector<Source> sources;
  std::vector<Allocation> allocations;
  reference::Cell domainExtent{0, 1, 1, 1};
  int domainRank = 0;
  reference::Executor executor;
};

template <class State> void Pipe<State>::checkGraph() const {
  if (domainRank == 0)
    throw Error("the pipeline has no domain; call setDomain");
  for (const auto &node : nodes) {
    if (node->rank != domainRank)
      node->fail(-1, "expected bins of " + std::to_string(domainRank) +
                         " dimensions as the domain has, but got " +
                         std::to_string(node->rank));
    for (size_t port = 0; port < node->ports.size(); ++port) {
      const reference::Port &out = node->ports[port];
      std::string name = "port " + std::to_string(port);
      if (out.to.empty())
        node->fail(-1, name + " is not connected");
      if (out.to.size() > 1)
        node->fail(-1, name + " is connected twice, to stage '" +
                           std::string(out.to[0]->name()) + "' and to stage '" +
                           std::string(out.to[1]->name()) + "'");
      if (out.type != out.to[0]->inputType)
        node->fail(-1, "expected an edge between equal types, but " + name +
                           " emits '" + std::string(out.type->name) +
                           "' and stage '" + std::string(out.to[0]->name()) +
                           "' takes '" +
                           std::string(out.to[0]->inputType->name) + "'");
    }
  }
}

template <class State> void Pipe<State>::prepareState() {
  for (reference::ImageBase *image : images)
    image->prepare(domainExtent);
  for (const Allocation &allocation : allocations) {
    if (allocation.source < 0 ||
        allocation.source >= static_cast<int>(sources.size()))
      throw Error("allocateForSource: expected one of the " +
                  std::to_string(sources.size()) + " sources, but got source " +
                  std::to_string(allocation.source));
    allocation.buffer->allocateZeroed(sources[allocation.source].count);
  }
}

template <class State>
std::vector<reference::Component> Pipe<State>::prepareStages() {
  std::vector<reference::Node *> declared;
  for (const auto &node : nodes) {
    node->grid = reference::Grid(domainExtent, node->binSize);
    executor.scheduleBins(*node);
    declared.push_back(node.get());
  }
  auto isDirect = [](const reference::Node &, const reference::Node &to) {
    return !to.collects();
  };
  int loop = 0;
  for (const reference::Component &component :
       reference::findComponents(declared, isDirect)) {
    for (reference::Node *node : component.nodes)
      node->loop = component.cyclic ? loop : -1;
    ++loop;
  }
  return reference::orderStages(declared);
}

template <class State>
reference::StageOrder Pipe<State>::stageOrder(
    const std::vector<reference::Component> &components) const {
  std::vector<reference::Node *> declared;
  for (const auto &node : nodes)
    declared.push_back(node.get());
  std::vector<reference::StageOrder::SourceOf> fed;
  for (size_t s = 0; s < sources.size(); ++s)
    fed.push_back({static_cast<int64_t>(s), sources[s].node});
  return {declared, fed, components};
}

template <class State> void Pipe<State>::run() {
  reference::checkArithmetic();
  checkGraph();
  struct Running {
    reference::Executor *saved;
    explicit Running(reference::Executor *executor)
        : saved(std::exchange(reference::Executor::current(), executor)) {}
    ~Running() { reference::Executor::current() = saved; }
  } running(&executor);

  prepareState();
  executor.checker.beginRun();
  std::vector<reference::Component> order = prepareStages();
  if constexpr (reference::checking)
    executor.checker.setOrder(stageOrder(order));
  for (size_t s = 0; s < sources.size(); ++s) {
    const Source &source = sources[s];
    for (int64_t i = 0; i < source.count; ++i) {
      const std::byte *primitive =
          source.primitives + i * source.node->inputSize;
      reference::Lineage lineage = reference::makeStep(nullptr, {}, s, i);
      executor.checkNumbers(*source.node, -1, source.node->inputType, primitive,
                            lineage);
      executor.deliver(*source.node, primitive, nullptr, -1, lineage);
    }
  }
  for (const reference::Component &component : order)
    executor.runComponent(component);
  if constexpr (reference::checking)
    executor.checker.endRun();
}

} // namespace piko

#endif // PIKO_REFERENCE_PIPE_H
