//===- piko/reference/pipe.h - Pipelines ----------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_REFERENCE_PIPE_H
#define PIKO_REFERENCE_PIPE_H

#include <piko/macros_begin.h>

#include <piko/arithmetic.h>
#include <piko/reference/check.h>
#include <piko/reference/contracts.h>
#include <piko/stage.h>

namespace piko {
namespace reference {

/// What a phase takes; not of one that is overloaded or a template.
template <class S, class Result, class Taken>
Taken parameterOf(Result (S::*)(Taken));
template <class S, class Result, class Taken>
Taken parameterOf(Result (S::*)(Taken) const);

/// A phase takes the primitive itself: what it can be converted to would be
/// another value.
template <class Taken, class In> constexpr void expectPrimitive() {
  static_assert(std::is_same_v<Taken, In> || std::is_base_of_v<Taken, In>,
                "expected a phase to take the primitive of its stage, but it "
                "takes another type");
}

// A member of a name that two bases have is ambiguous, whether it is private in
// one of them or not: so a phase that cannot be called is not taken for none.
struct NamesAssignBin {
  int assignBin;
};
struct NamesSchedule {
  int schedule;
};
template <class S, class Names> struct BothNames : S, Names {};
template <class S>
concept hasAssignBin = !std::is_final_v<S> &&
                       !requires { &BothNames<S, NamesAssignBin>::assignBin; };
template <class S>
concept hasSchedule = !std::is_final_v<S> &&
                      !requires { &BothNames<S, NamesSchedule>::schedule; };

template <class S, class In>
concept canAssignBin = requires(S &s, const In &p) { s.assignBin(p); };
template <class S>
concept canSchedule = requires(S &s) { s.schedule(BinId{}); };

/// A Node that calls the phases of the user's stage S.
template <class S, class In> class TypedNode final : public Node {
public:
  explicit TypedNode(S &stage) : stage(stage) {
    address = &stage;
    size = sizeof(S);
    type = typeOf<S>();
    inputType = typeOf<In>();
    inputSize = sizeof(In);
    takesList = !takesOne;
  }

  void assign(const std::byte *primitive) override {
    if constexpr (requires { parameterOf(&S::assignBin); })
      expectPrimitive<std::remove_cvref_t<decltype(parameterOf(&S::assignBin))>,
                      In>();
    if constexpr (canAssignBin<S, In>)
      stage.assignBin(*reinterpret_cast<const In *>(primitive));
    else
      Executor::current()->assignBin(0);
  }
  void schedule(int64_t bin) override {
    if constexpr (canSchedule<S>)
      stage.schedule(BinId{bin});
  }
  void process(const std::byte *primitive) override {
    if constexpr (takesOne && requires { parameterOf(&S::process); })
      expectPrimitive<std::remove_cvref_t<decltype(parameterOf(&S::process))>,
                      In>();
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
      "a stage needs a public process(const In &) or "
      "process(const piko::List<In> &)");
  static_assert(!hasAssignBin<S> || canAssignBin<S, In>,
                "expected assignBin of a stage to be public and to take its "
                "primitive");
  static_assert(!hasSchedule<S> || canSchedule<S>,
                "expected schedule of a stage to be public and to take a "
                "piko::BinId");
  S &stage;
};

/// What a pipeline is apart from the type of its state.
class Pipeline {
public:
  Pipeline() = default;
  Pipeline(const Pipeline &) = delete;
  Pipeline &operator=(const Pipeline &) = delete;
  ~Pipeline() { endMembers(); }

  // For the host; see Pipe.

  void setDomain(const int64_t *extent, int rank) {
    if (rank < 1 || rank > 4)
      throw Error("expected a domain of 1 to 4 dimensions, but got " +
                  std::to_string(rank));
    for (int d = 0; d < rank; ++d)
      if (extent[d] < 1 || extent[d] > maxExtent)
        throw Error("expected a domain of 1 to " + std::to_string(maxExtent) +
                    " cells in each dimension, but got " +
                    std::to_string(extent[d]));
    for (int d = 0; d < 4; ++d)
      domainExtent[d] = d < rank ? extent[d] : 1;
    domainRank = rank;
  }

  template <class T> void feed(int source, const T *primitives, int64_t count) {
    const TypeInfo *type = nullptr;
    if constexpr (!std::is_void_v<T>)
      type = typeOf<std::remove_cv_t<T>>();
    feedBytes(source, type, reinterpret_cast<const std::byte *>(primitives),
              count);
  }
  template <class S> int sourceOf(const S &stage) {
    return sourceOf(&stage, typeName<S>());
  }

  template <auto... Field> void expectNumbers() {
    (executor.numbers.push_back(numberField<Field>(Field)), ...);
  }
  void nameState(const void *piece, size_t size, std::string name) {
    executor.checker.nameState(piece, size, std::move(name));
  }

  void setLoopLimit(int64_t limit) {
    if (limit < 0)
      throw Error("expected a loop limit of at least 0, but got " +
                  std::to_string(limit));
    executor.loopLimit = limit;
  }

  void run();

  // For the pipeline's constructor.

  /// The state is there: what is constructed from here on are stages.
  template <class State> void beginMembers(const State &state) {
    stateBytes = {&state, sizeof(State), typeName<State>()};
    ImageBase::registry() = scope.saved;
    membersUnderConstruction() = &members;
  }
  template <class State, class S> void source(S &stage, State &state) {
    sources.push_back({&nodeOf(stage, state), nullptr, 0});
  }
  template <class State, class From, class To>
  void connect(From &from, int port, To &to, State &state) {
    Node &producer = nodeOf(from, state), &consumer = nodeOf(to, state);
    connectNodes(producer, port, consumer);
  }
  void allocateForSource(BufferBase &buffer, int source) {
    allocations.push_back({&buffer, source});
  }
  void expect(Contract contract) { contracts.push_back(contract); }

private:
  void endMembers() {
    if (membersUnderConstruction() == &members)
      membersUnderConstruction() = nullptr;
  }

  template <class State, class S> Node &nodeOf(S &stage, State &state) {
    endMembers();
    Node *node = findNode(&stage, typeOf<S>());
    return node ? *node : makeNode(stage, stage, state);
  }
  template <class State, class S, class B, int Threads, class In, class... Out>
  Node &makeNode(S &stage, BasicStage<B, Threads, In, Out...> &base,
                 State &state) {
    static_assert(B::wholeDomain || hasAssignBin<S> || canAssignBin<S, In>,
                  "a stage with several bins needs assignBin");
    std::unique_ptr<Node> node(new TypedNode<S, In>(stage));
    node->rank = B::rank;
    for (int d = 0; d < B::rank; ++d)
      node->binSize[d] = B::size[d];
    (node->ports.push_back({typeOf<Out>(), {}}), ...);
    for (Member &member : members)
      if (member.stage == &base)
        member.isNamed = true;
    bindState(&stage, state);
    return addNode(std::move(node));
  }
  template <class Used, class State>
  static void bindState(piko::Uses<Used> *uses, State &state) {
    static_assert(std::is_base_of_v<Used, State>,
                  "the stage uses another state than its pipeline has");
    reference::Uses<Used> &holder = *uses;
    holder.state = &state;
  }
  template <class State> static void bindState(const void *, const State &) {}

  struct Source {
    Node *node;
    const std::byte *primitives;
    int64_t count;
  };
  struct Allocation {
    BufferBase *buffer;
    int source;
  };
  /// Collects the images while the state is constructed.
  struct Scope {
    explicit Scope(std::vector<ImageBase *> &images)
        : saved(std::exchange(ImageBase::registry(), &images)) {}
    std::vector<ImageBase *> *saved;
  };

  template <auto Field, class Record, class Member>
  static NumberField numberField(Member Record::*) {
    return makeNumberField<Record, Member, Field>();
  }

  Node *findNode(const void *stage, const TypeInfo *type) const {
    for (const auto &node : nodes)
      if (node->address == stage && node->type == type)
        return node.get();
    return nullptr;
  }
  /// Members lie in memory in order of declaration.
  Node &addNode(std::unique_ptr<Node> node) {
    auto at = std::find_if(nodes.begin(), nodes.end(), [&](const auto &other) {
      return std::less<>()(node->address, other->address);
    });
    return **nodes.insert(at, std::move(node));
  }
  static void connectNodes(Node &producer, int port, Node &consumer) {
    if (port < 0 || port >= static_cast<int>(producer.ports.size()))
      producer.failPort(-1, port);
    producer.ports[port].to.push_back(&consumer);
  }
  /// The number of the stage's only source.
  int sourceOf(const void *stage, std::string_view name) const {
    int found = -1;
    for (size_t i = 0; i < sources.size(); ++i)
      if (sources[i].node->address == stage) {
        if (found >= 0)
          sources[i].node->fail(-1, "has several sources; feed them by number");
        found = static_cast<int>(i);
      }
    if (found < 0)
      fail(name, -1, "has no source");
    return found;
  }
  /// Without a type it is not checked.
  void feedBytes(int source, const TypeInfo *type, const std::byte *primitives,
                 int64_t count) {
    if (source < 0 || source >= static_cast<int>(sources.size()))
      throw Error("expected one of the " + std::to_string(sources.size()) +
                  " sources, but got source " + std::to_string(source));
    Source &to = sources[source];
    if (type && to.node->inputType != type)
      to.node->fail(-1, "expected primitives of type '" +
                            std::string(to.node->inputType->name) +
                            "' for source " + std::to_string(source) +
                            ", but got '" + std::string(type->name) + "'");
    to.primitives = primitives;
    to.count = count;
  }
  bool hasInput(const Node &node) const;
  void checkGraph() const;
  void prepareState();
  void checkContract(const Contract &contract) const;
  std::vector<Component> prepareStages();
  StageOrder stageOrder(const std::vector<Component> &components) const;

  std::vector<Member> members; ///< as declared
  std::vector<ImageBase *> images;
  Scope scope{images};                      ///< until the state is constructed
  std::vector<std::unique_ptr<Node>> nodes; ///< as declared
  std::vector<Source> sources;
  std::vector<Allocation> allocations;
  std::vector<Contract> contracts;
  Fixed stateBytes;
  Cell domainExtent{0, 1, 1, 1};
  int domainRank = 0;
  Executor executor;
};

inline void Pipeline::checkGraph() const {
  if (domainRank == 0)
    throw Error("the pipeline has no domain; call setDomain");
  for (const auto &node : nodes) {
    if (node->rank != domainRank)
      node->fail(-1, "expected bins of " + std::to_string(domainRank) +
                         " dimensions as the domain has, but got " +
                         std::to_string(node->rank));
    for (size_t port = 0; port < node->ports.size(); ++port) {
      const Port &out = node->ports[port];
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
  const char *noInput =
      "has no input: expected an edge or a source that feeds it";
  for (size_t i = 0; i < members.size(); ++i)
    if (!members[i].isNamed) // never named, so that its type is not known
      throw Error("stage " + std::to_string(i) +
                  " of the pipeline, which takes '" +
                  std::string(members[i].inputType->name) + "', " + noInput);
  for (const auto &node : nodes)
    if (!hasInput(*node))
      node->fail(-1, noInput);
}

inline bool Pipeline::hasInput(const Node &node) const {
  auto isFed = [&](const Source &source) { return source.node == &node; };
  auto leads = [&](const Port &port) { return port.to.front() == &node; };
  return std::ranges::any_of(sources, isFed) ||
         std::ranges::any_of(nodes, [&](const auto &producer) {
           return std::ranges::any_of(producer->ports, leads);
         });
}

inline void Pipeline::prepareState() {
  for (ImageBase *image : images)
    image->prepare(domainExtent);
  for (const Allocation &allocation : allocations) {
    if (allocation.source < 0 ||
        allocation.source >= static_cast<int>(sources.size()))
      throw Error("allocateForSource: expected one of the " +
                  std::to_string(sources.size()) + " sources, but got source " +
                  std::to_string(allocation.source));
    allocation.buffer->allocateZeroed(sources[allocation.source].count);
  }
  for (const Contract &contract : contracts)
    checkContract(contract);
}

inline void Pipeline::checkContract(const Contract &contract) const {
  if (contract.buffer)
    return contract.check(executor.checker);
  std::string name = "source " + std::to_string(contract.source);
  if (contract.source < 0 ||
      contract.source >= static_cast<int>(sources.size()))
    throw Error("expectIndex: expected one of the " +
                std::to_string(sources.size()) + " sources, but got " + name);
  const auto &[node, primitives, count] = sources[contract.source];
  if (contract.rule.record != node->inputType)
    node->fail(-1, "expected a field of '" +
                       std::string(node->inputType->name) + "', which " + name +
                       " has, but got one of '" +
                       std::string(contract.rule.record->name) + "'");
  std::string breach = contract.rule.findBreach(
      executor.checker,
      {primitives, count, static_cast<int64_t>(node->inputSize)},
      [&](int64_t i) {
        return "primitive " + std::to_string(i) + " of " + name;
      });
  if (!breach.empty())
    node->fail(-1, breach);
}

inline std::vector<Component> Pipeline::prepareStages() {
  std::vector<Node *> declared;
  for (const auto &node : nodes) {
    node->grid = BinGrid(domainExtent, node->binSize);
    executor.scheduleBins(*node);
    declared.push_back(node.get());
  }
  for (const Node *node : declared)
    for (const Node *other : declared)
      if (node != other && !node->label.empty() && node->label == other->label)
        node->fail(-1, "expected a name that no other stage has");
  for (const Node *node : declared)
    for (const TypeInfo *type : node->waitsOn)
      if (std::ranges::none_of(
              declared, [&](const Node *other) { return other->type == type; }))
        node->fail(-1,
                   "expected endStage of a stage of the pipeline, but got '" +
                       std::string(type->name) + "'");
  auto isDirect = [](const Node &, const Node &to) { return !to.collects(); };
  int loop = 0;
  for (const Component &component : findComponents(declared, isDirect)) {
    for (Node *node : component.nodes)
      node->loop = component.cyclic ? loop : -1;
    ++loop;
  }
  return orderStages(declared);
}

inline StageOrder
Pipeline::stageOrder(const std::vector<Component> &components) const {
  std::vector<Node *> declared;
  for (const auto &node : nodes)
    declared.push_back(node.get());
  std::vector<StageOrder::SourceOf> fed;
  for (size_t s = 0; s < sources.size(); ++s)
    fed.push_back({static_cast<int64_t>(s), sources[s].node});
  return {declared, fed, components};
}

inline void Pipeline::run() {
  detail::ArithmeticScope arithmetic;
  checkArithmetic();
  checkGraph();
  struct Running {
    Executor *saved;
    explicit Running(Executor *executor)
        : saved(std::exchange(Executor::current(), executor)) {}
    ~Running() { Executor::current() = saved; }
  } running(&executor);
  DivisionTrap::Handler handler;

  prepareState();
  executor.checker.beginRun();
  std::vector<Component> order = prepareStages();
  if constexpr (checking) {
    executor.checker.setOrder(stageOrder(order));
    executor.checker.fix(stateBytes);
    for (const auto &node : nodes)
      executor.checker.fix({node->address, node->size, node->name()});
  }
  for (size_t s = 0; s < sources.size(); ++s) {
    const Source &source = sources[s];
    for (int64_t i = 0; i < source.count; ++i) {
      const std::byte *primitive =
          source.primitives + i * source.node->inputSize;
      Lineage lineage = makeStep(nullptr, {}, s, i);
      executor.checkNumbers(*source.node, -1, source.node->inputType, primitive,
                            lineage);
      executor.deliver(*source.node, primitive, nullptr, -1, lineage);
    }
  }
  for (const Component &component : order)
    executor.runComponent(component);
  if constexpr (checking)
    executor.checker.endRun();
}

/// What a pipeline holds, under names that piko::Pipe hides: the constructor of
/// a pipeline finds no names but those of the language.
template <class State> class Pipe {
public:
  Pipe() : run(), state() { run.beginMembers(state); }

  Pipeline run;
  State state;
};

} // namespace reference

/// The base of pipelines. A pipeline has its stages as members; its
/// constructor names sources and edges.
template <class State = NoState> class Pipe : private reference::Pipe<State> {
public:
  State &state() { return reference::Pipe<State>::state; }
  const State &state() const { return reference::Pipe<State>::state; }

  // For the host. What goes wrong is thrown, where it happens; the Status that
  // a call returns always is well. It is there for texts that use compiled
  // pipelines, too.

  /// The extent of the domain in cells, one number for each dimension.
  Status setDomain(std::initializer_list<int64_t> extent) {
    return setDomain(extent.begin(), static_cast<int>(extent.size()));
  }
  template <int Rank> Status setDomain(const glm::vec<Rank, int> &extent) {
    return setDomain(reference::toCell(extent).data(), Rank);
  }
  Status setDomain(const int64_t *extent, int rank) {
    reference::Pipe<State>::run.setDomain(extent, rank);
    return {};
  }

  /// The primitives of a source; the memory must stay until the run.
  template <class T>
  Status feed(int source, const T *primitives, int64_t count) {
    reference::Pipe<State>::run.feed(source, primitives, count);
    return {};
  }
  /// The same for a vector, an array or a span.
  template <reference::HostRange Range>
  Status feed(int source, Range &&primitives) {
    static_assert(reference::outlives<Range>,
                  "feed does not copy; the primitives must outlive the run");
    return feed(source, std::data(primitives),
                static_cast<int64_t>(std::size(primitives)));
  }
  /// The same for the only source of a stage.
  template <class S, reference::HostRange Range>
    requires std::is_class_v<S>
  Status feed(const S &stage, Range &&primitives) {
    static_assert(reference::outlives<Range>,
                  "feed does not copy; the primitives must outlive the run");
    return feed(reference::Pipe<State>::run.sourceOf(stage),
                std::data(primitives),
                static_cast<int64_t>(std::size(primitives)));
  }

  /// In checking mode: fields, such as &Fragment::z, of which no primitive
  /// that is fed or emitted may hold a NaN.
  template <auto... Field> void expectNumbers() {
    reference::Pipe<State>::run.template expectNumbers<Field...>();
  }
  /// What messages call a piece of the state.
  template <class T> void nameState(const T *piece, std::string name) {
    reference::Pipe<State>::run.nameState(piece, sizeof(T), std::move(name));
  }

  /// How many hops a primitive may take on a cycle of stages, and how many
  /// rounds a cycle may run.
  Status setLoopLimit(int64_t limit) {
    reference::Pipe<State>::run.setLoopLimit(limit);
    return {};
  }

  // How a compiled pipeline runs; here they change nothing.
  Status setThreads(int32_t) { return {}; }
  Status setMemoryLimit(int64_t) { return {}; }
  Status setMemoryBudget(int64_t) { return {}; }
  Status setStripSize(int64_t) { return {}; }
  Status setMappings(const std::string &) { return {}; }

  /// Clears the images and runs the pipeline on what was fed.
  Status run() {
    reference::Pipe<State>::run.run();
    return {};
  }
  /// The same, but an Error is returned.
  Status tryRun() {
    try {
      return run();
    } catch (const Error &error) {
      return Status(error.code(), error.what());
    }
  }

protected:
  Pipe() = default;
  ~Pipe() = default;

  /// A stage that is fed by the host; sources are numbered as they are named.
  template <class S> void source(S &stage) {
    reference::Pipe<State>::run.source(stage, state());
  }
  /// What leaves `from` through a port goes to `to`.
  template <class From, class To> void connect(From &from, int port, To &to) {
    reference::Pipe<State>::run.connect(from, port, to, state());
  }
  /// Gives a buffer as many elements as a source has primitives, zero at the
  /// start of each run.
  template <class T> void allocateForSource(Buffer<T> &buffer, int source) {
    reference::Pipe<State>::run.allocateForSource(buffer, source);
  }
  /// The numbers of a field of a source's primitives, such as
  /// &Triangle::vertex, are indices of a buffer, or below a number.
  template <auto Field, class Limit>
  void expectIndex(int source, const Limit &below) {
    reference::Pipe<State>::run.expect(
        {source, nullptr, reference::makeRule<Field>(below)});
  }
  /// The same for primitives of type T, which are integers.
  template <class T, class Limit>
  void expectIndex(int source, const Limit &below) {
    reference::Pipe<State>::run.expect(
        {source, nullptr, reference::makeRule<T>(below)});
  }
  /// The same for the elements of a buffer that no phase writes.
  template <auto Field, class T, class Limit>
  void expectIndex(Buffer<T> &of, const Limit &below) {
    reference::Pipe<State>::run.expect(
        {-1, &of, reference::makeRule<Field>(below)});
  }
  /// The same for elements that are integers.
  template <class T, class Limit>
  void expectIndex(Buffer<T> &of, const Limit &below) {
    reference::Pipe<State>::run.expect(
        {-1, &of, reference::makeRule<T>(below)});
  }
};

} // namespace piko

#include <piko/macros_end.h>

#endif // PIKO_REFERENCE_PIPE_H
