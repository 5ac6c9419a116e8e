// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Deferral/CommonSlice.h"

#include "mlir/IR/IRMapping.h"
#include "llvm/ADT/DenseMap.h"
#include "llvm/ADT/STLExtras.h"

#include <limits>
#include <queue>

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// The same in all places
//===----------------------------------------------------------------------===//

namespace {

/// Compares operations, with what they hold, and finds what they use.
class Comparison {
public:
  explicit Comparison(ArrayRef<Operation *> ops)
      : ops(ops), inner(ops.size()) {}

  /// Whether they do the same with the values that they use; those are in
  /// `uses` then.
  bool run();
  SmallVector<Counterparts> uses;

private:
  bool isInside(Value value, size_t place) const;
  bool mayMatch(Value first, Value other, size_t place) const;
  SmallVector<Value> getOperands(Operation *first, Operation *op,
                                 size_t place) const;
  bool compare(ArrayRef<Operation *> same);
  bool compareOperands(ArrayRef<Operation *> same);
  bool compareRegions(ArrayRef<Operation *> same);
  void pair(ArrayRef<ValueRange> values);

  ArrayRef<Operation *> ops;
  /// For each place, what stands for the first place's values inside.
  SmallVector<llvm::DenseMap<Value, Value>> inner;
};

} // namespace

bool Comparison::run() { return compare(ops); }

void Comparison::pair(ArrayRef<ValueRange> values) {
  for (size_t place = 0; place < values.size(); ++place)
    for (auto [first, other] : llvm::zip(values.front(), values[place]))
      inner[place][first] = other;
}

bool Comparison::isInside(Value value, size_t place) const {
  return ops[place]->isAncestor(value.getParentRegion()->getParentOp());
}

bool Comparison::mayMatch(Value first, Value other, size_t place) const {
  bool inside = isInside(first, 0);
  if (inside != isInside(other, place) || first.getType() != other.getType())
    return false;
  return !inside || inner[place].lookup(first) == other;
}

/// The operands of an operation in the order of those of the first place's.
SmallVector<Value> Comparison::getOperands(Operation *first, Operation *op,
                                           size_t place) const {
  SmallVector<Value> operands(op->getOperands());
  if (!op->hasTrait<OpTrait::IsCommutative>() || operands.size() != 2)
    return operands;
  auto rate = [&](Value a, Value b) {
    Operation *x = a.getDefiningOp(), *y = b.getDefiningOp();
    bool isAlike = x && y ? x->getName() == y->getName() : x == y;
    return mayMatch(a, b, place) ? 1 + isAlike + (a == b) : -3;
  };
  Value a = first->getOperand(0), b = first->getOperand(1);
  if (rate(a, operands[1]) + rate(b, operands[0]) >
      rate(a, operands[0]) + rate(b, operands[1]))
    std::swap(operands[0], operands[1]);
  return operands;
}

bool Comparison::compareOperands(ArrayRef<Operation *> same) {
  SmallVector<Counterparts> operands(same.front()->getNumOperands());
  for (auto [place, op] : llvm::enumerate(same))
    for (auto [values, operand] :
         llvm::zip(operands, getOperands(same.front(), op, place)))
      values.push_back(operand);
  for (const Counterparts &values : operands) {
    for (auto [place, value] : llvm::enumerate(values))
      if (!mayMatch(values.front(), value, place))
        return false;
    if (!isInside(values.front(), 0))
      uses.push_back(values);
  }
  return true;
}

bool Comparison::compareRegions(ArrayRef<Operation *> same) {
  for (unsigned i = 0, e = same.front()->getNumRegions(); i < e; ++i) {
    SmallVector<Block *> blocks;
    for (Operation *op : same) {
      Region &region = op->getRegion(i);
      if (region.empty() != same.front()->getRegion(i).empty() ||
          (!region.empty() && !region.hasOneBlock()))
        return false;
      if (!region.empty())
        blocks.push_back(&region.front());
    }
    if (blocks.empty())
      continue;
    SmallVector<ValueRange> arguments;
    SmallVector<Block::iterator> at;
    for (Block *block : blocks) {
      if (block->getArgumentTypes() != blocks.front()->getArgumentTypes() ||
          block->getOperations().size() !=
              blocks.front()->getOperations().size())
        return false;
      arguments.push_back(block->getArguments());
      at.push_back(block->begin());
    }
    pair(arguments);
    for (size_t rest = blocks.front()->getOperations().size(); rest; --rest) {
      SmallVector<Operation *> next;
      for (Block::iterator &op : at)
        next.push_back(&*op++);
      if (!compare(next))
        return false;
    }
  }
  return true;
}

bool Comparison::compare(ArrayRef<Operation *> same) {
  Operation *first = same.front();
  SmallVector<ValueRange> results;
  for (Operation *op : same) {
    if (op->getName() != first->getName() ||
        op->getNumOperands() != first->getNumOperands() ||
        op->getNumRegions() != first->getNumRegions() ||
        op->getResultTypes() != first->getResultTypes() ||
        op->getPropertiesAsAttribute() != first->getPropertiesAsAttribute())
      return false;
    results.push_back(op->getResults());
  }
  if (!compareOperands(same) || !compareRegions(same))
    return false;
  if (same.front() != ops.front())
    pair(results);
  return true;
}

//===----------------------------------------------------------------------===//
// The graph
//===----------------------------------------------------------------------===//

template <class T> static std::vector<void *> makeKey(ArrayRef<T> values) {
  std::vector<void *> key;
  for (T value : values)
    if constexpr (std::is_same_v<T, Value>)
      key.push_back(value.getAsOpaquePointer());
    else
      key.push_back(value);
  return key;
}

bool CommonSlice::fill(Instance &instance, ArrayRef<Operation *> ops) {
  Comparison comparison(ops);
  if (!comparison.run())
    return false;
  for (const Counterparts &values : comparison.uses) {
    int node = getNode(values);
    // One clone can use one value in the place of another.
    for (auto [value, other] : instance.uses)
      if (value == values.front() && other != node)
        return false;
    instance.uses.emplace_back(values.front(), node);
  }
  return true;
}

int CommonSlice::getInstance(ArrayRef<Operation *> ops) {
  std::vector<void *> key = makeKey(ops);
  if (auto found = instanceOf.find(key); found != instanceOf.end())
    return found->second;
  int number = -1;
  if (Instance instance{ops.front(), {}}; fill(instance, ops)) {
    number = instances.size();
    instances.push_back(std::move(instance));
  }
  return instanceOf[key] = number;
}

int CommonSlice::getNode(const Counterparts &values) {
  std::vector<void *> key = makeKey(ArrayRef<Value>(values));
  if (auto found = nodeOf.find(key); found != nodeOf.end())
    return found->second;
  Node node{values, rules.isKnown(values)};
  SmallVector<Operation *> ops;
  auto first = dyn_cast<OpResult>(values.front());
  for (Value value : values)
    if (auto result = dyn_cast<OpResult>(value);
        first && result && rules.isMovable(result.getOwner()) &&
        result.getResultNumber() == first.getResultNumber())
      ops.push_back(result.getOwner());
  if (!node.isKnown && ops.size() == values.size())
    node.instance = getInstance(ops);
  nodes.push_back(node);
  return nodeOf[key] = nodes.size() - 1;
}

bool CommonSlice::addRoot(ArrayRef<Operation *> ops) {
  int root = getInstance(ops);
  if (root >= 0)
    roots.push_back(root);
  return root >= 0;
}

bool CommonSlice::isRoot(int instance) const {
  return llvm::is_contained(roots, instance);
}

//===----------------------------------------------------------------------===//
// The cut
//===----------------------------------------------------------------------===//

namespace {

/// A flow network, and its minimum cut (L. R. Ford and D. R. Fulkerson, 1956,
/// by shortest paths).
class FlowNetwork {
public:
  static constexpr int64_t infinite = std::numeric_limits<int32_t>::max();

  explicit FlowNetwork(int size) : edges(size) {}
  void addEdge(int from, int to, int64_t capacity) {
    edges[from].push_back({to, (int)edges[to].size(), capacity});
    edges[to].push_back({from, (int)edges[from].size() - 1, 0});
  }
  /// The greatest flow; `infinite` or more if there is no finite cut.
  int64_t run(int source, int sink);
  /// After `run`: whether a vertex is on the source's side of the cut that is
  /// nearest to the source.
  SmallVector<bool> getSourceSide(int source) const;

private:
  struct Edge {
    int to, reverse;
    int64_t capacity;
  };
  /// The edge by which a shortest path comes to each vertex, or null.
  SmallVector<Edge *> findPaths(int source);

  std::vector<std::vector<Edge>> edges;
};

} // namespace

SmallVector<FlowNetwork::Edge *> FlowNetwork::findPaths(int source) {
  SmallVector<Edge *> by(edges.size());
  std::queue<int> open({source});
  while (!open.empty()) {
    int from = open.front();
    open.pop();
    for (Edge &edge : edges[from])
      if (edge.capacity > 0 && !by[edge.to] && edge.to != source) {
        by[edge.to] = &edge;
        open.push(edge.to);
      }
  }
  return by;
}

int64_t FlowNetwork::run(int source, int sink) {
  int64_t flow = 0;
  while (flow < infinite) {
    SmallVector<Edge *> by = findPaths(source);
    if (!by[sink])
      return flow;
    auto getStart = [&](Edge *edge) {
      return edges[edge->to][edge->reverse].to;
    };
    int64_t more = infinite;
    for (int at = sink; at != source; at = getStart(by[at]))
      more = std::min(more, by[at]->capacity);
    for (int at = sink; at != source; at = getStart(by[at])) {
      by[at]->capacity -= more;
      edges[at][by[at]->reverse].capacity += more;
    }
    flow += more;
  }
  return flow;
}

SmallVector<bool> FlowNetwork::getSourceSide(int source) const {
  SmallVector<Edge *> by = const_cast<FlowNetwork *>(this)->findPaths(source);
  SmallVector<bool> side;
  for (Edge *edge : by)
    side.push_back(edge);
  side[source] = true;
  return side;
}

/// The bytes of a number; too many of anything else.
static int64_t getBytes(Type type) {
  if (type.isIndex())
    return 8;
  return type.isIntOrFloat() ? std::max(type.getIntOrFloatBitWidth() / 8, 4u)
                             : FlowNetwork::infinite;
}

bool CommonSlice::cut() {
  // A vertex for each instance (it moves, on the sink's side), one for what is
  // kept of each node, one for each node that cannot move.
  int firstKept = instances.size(), firstLeaf = firstKept + nodes.size();
  int source = firstLeaf + nodes.size(), sink = source + 1;
  FlowNetwork network(sink + 1);
  for (auto [number, node] : llvm::enumerate(nodes)) {
    if (node.isKnown)
      continue;
    int producer = node.instance >= 0 ? node.instance : firstLeaf + (int)number;
    if (node.instance < 0)
      network.addEdge(source, producer, FlowNetwork::infinite);
    network.addEdge(producer, firstKept + number,
                    getBytes(node.values.front().getType()));
  }
  for (auto [number, instance] : llvm::enumerate(instances)) {
    if (isRoot(number) || rules.mustMove(instance.op))
      network.addEdge(number, sink, FlowNetwork::infinite);
    for (auto [value, used] : instance.uses) {
      if (nodes[used].isKnown)
        continue;
      network.addEdge(firstKept + used, number, FlowNetwork::infinite);
      // What uses something that has moved, moves.
      if (nodes[used].instance >= 0)
        network.addEdge(number, nodes[used].instance, FlowNetwork::infinite);
    }
  }
  if (network.run(source, sink) >= FlowNetwork::infinite)
    return false;
  SmallVector<bool> stays = network.getSourceSide(source);
  moves.clear();
  for (size_t i = 0; i < instances.size(); ++i)
    moves.push_back(!stays[i]);
  SmallVector<bool> isUsed(nodes.size());
  for (auto [number, instance] : llvm::enumerate(instances))
    for (auto [value, used] : instance.uses)
      isUsed[used] = isUsed[used] || moves[number];
  for (auto [number, node] : llvm::enumerate(nodes)) {
    bool isComputed =
        node.isKnown || (node.instance >= 0 && moves[node.instance]);
    if (!isComputed && isUsed[number]) {
      kept.push_back(node.values);
      keptNodes.push_back(number);
    }
  }
  return true;
}

SmallVector<Operation *> CommonSlice::getOperations() const {
  SmallVector<Operation *> all;
  for (const Instance &instance : instances)
    all.push_back(instance.op);
  return all;
}

SmallVector<Operation *> CommonSlice::getMoved() const {
  SmallVector<Operation *> moved;
  for (auto [number, instance] : llvm::enumerate(instances))
    if (moves[number])
      moved.push_back(instance.op);
  return moved;
}

void CommonSlice::rebuild(OpBuilder &builder,
                          llvm::function_ref<Value(const Counterparts &)> known,
                          ArrayRef<Value> keptValues) const {
  SmallVector<Value> values(nodes.size());
  for (auto [number, value] : llvm::zip(keptNodes, keptValues))
    values[number] = value;
  SmallVector<Operation *> clones(instances.size());
  auto get = [&](int number) {
    const Node &node = nodes[number];
    if (!values[number])
      values[number] =
          node.isKnown
              ? known(node.values)
              : clones[node.instance]->getResult(
                    cast<OpResult>(node.values.front()).getResultNumber());
    return values[number];
  };
  for (auto [number, instance] : llvm::enumerate(instances)) {
    if (!moves[number])
      continue;
    IRMapping mapping;
    for (auto [value, node] : instance.uses)
      mapping.map(value, get(node));
    clones[number] = builder.clone(*instance.op, mapping);
  }
}
