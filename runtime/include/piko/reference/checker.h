//===- piko/reference/checker.h - Checking mode ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Finds conflicts between concurrent calls and iterations, and other breaches
// of the rules of state: docs/Diagnostics.md, "Checking mode".
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_CHECKER_H
#define PIKO_REFERENCE_CHECKER_H

#include <piko/reference/shadow.h>

#include <utility>

namespace piko::reference {

class Checker {
public:
  /// Names a piece of state by its address and size.
  void nameState(const void *handle, size_t size, std::string name) {
    names.push_back(
        {static_cast<const std::byte *>(handle), size, std::move(name)});
  }
  /// Of the piece that an address is in; empty where it is not known.
  std::string nameOf(const void *address) const {
    const auto *at = static_cast<const std::byte *>(address);
    for (auto known = names.rbegin(); known != names.rend(); ++known)
      if (!std::less<>()(at, known->begin) &&
          std::less<>()(at, known->begin + known->size))
        return known->name;
    return "";
  }

  void beginRun() {
    memories.clear();
    fixed.clear();
    updating = nullptr;
    current = nullptr;
    turn = loops = 0;
  }
  /// Once it is known what stages wait for.
  void setOrder(StageOrder stageOrder) { order = std::move(stageOrder); }
  /// What must stay as it is from now on.
  void fix(Fixed memory) {
    memory.keepContent();
    fixed.push_back(std::move(memory));
  }
  /// After the last call: no element may have changed since.
  void endRun() {
    for (const auto &[handle, memory] : memories)
      for (const std::unique_ptr<Element> &element : memory->elements)
        if (element)
          settle(*element);
  }
  /// A collecting stage runs.
  void nextTurn() { ++turn; }

  // Calls, iterations and barriers. `current` is null between calls.

  std::shared_ptr<Strand> current;

  std::shared_ptr<Strand> beginCall(Phase phase, const Node *node, int64_t bin,
                                    Lineage lineage) {
    if (current)
      checkFixed();
    auto strand = std::make_shared<Strand>();
    strand->call = std::make_shared<Call>(
        Call{phase, node, bin, std::move(lineage), turn});
    return std::exchange(current, std::move(strand));
  }
  /// `outer` is what beginCall gave.
  void endCall(std::shared_ptr<Strand> outer) {
    checkFixed();
    release();
    current = std::move(outer);
  }

  int64_t beginLoop() { return loops++; }
  void beginIteration(int64_t loop, int64_t iteration) {
    enter(current, loop, 0, iteration);
  }
  void endIteration() {
    release();
    current = std::const_pointer_cast<Strand>(current->outer);
  }
  /// Around the barrier: what runs in between has strands of its own.
  std::shared_ptr<Strand> beginBarrier() {
    release();
    std::shared_ptr<Strand> before = current;
    current = std::const_pointer_cast<Strand>(before->outer);
    return before;
  }
  void endBarrier(const Strand &before) {
    enter(std::const_pointer_cast<Strand>(before.outer), before.loop,
          before.interval + 1, before.iteration);
  }

  // Accesses.

  /// The element with an index of the buffer or the image at `handle`.
  template <class GetMemory>
  Element &element(const void *handle, int64_t index, GetMemory getMemory) {
    Memory &memory = memoryOf(handle, getMemory);
    std::unique_ptr<Element> &element = memory.elements[index];
    if (!element) {
      element = std::make_unique<Element>();
      element->memory = &memory;
      element->index = index;
      element->keepContent();
    }
    return *element;
  }
  /// The element that holds an address; null if it is in no state.
  Element *find(const void *address) {
    const auto *at = static_cast<const std::byte *>(address);
    for (const auto &[handle, memory] : memories) {
      const std::byte *end =
          memory->data + memory->elements.size() * memory->elementSize;
      if (!std::less<>()(at, memory->data) && std::less<>()(at, end))
        return memory->elements[(at - memory->data) / memory->elementSize]
            .get();
    }
    return nullptr;
  }

  /// A reference to an element is given to the current strand.
  void give(Element &element, const SourcePlace &at) {
    checkPhase(element, AccessKind::Read, at);
    checkBypass(element, at);
    settle(element);
    Element::Holder &holder = hold(element, at);
    holder.at = at;
    ++holder.reads;
  }
  /// The element changes while `change` runs.
  template <class F>
  auto access(Element &element, AccessKind kind, const SourcePlace &at,
              F &&change) {
    checkPhase(element, kind, at);
    checkBypass(element, at);
    settle(element);
    record(element, {kind, current, at});
    Element::Holder &holder = hold(element, at);
    if (kind == AccessKind::Atomic)
      --holder.reads;
    else
      holder.changed = true;
    const Memory *saved = updating;
    if (kind == AccessKind::Update)
      updating = element.memory;
    auto finish = [&] {
      updating = saved;
      element.keepContent();
      if (kind != AccessKind::Atomic)
        checkWritten(element, *current, at);
    };
    if constexpr (std::is_void_v<decltype(change())>) {
      change();
      finish();
    } else {
      auto result = change();
      finish();
      return result;
    }
  }

  [[noreturn]] void fail(const Strand &by, const SourcePlace &at,
                         const std::string &message,
                         const std::string &more = "") const {
    const Call &call = *by.call;
    call.node->fail(call.phase == Phase::Assign ? -1 : call.bin, message,
                    contextText(at, call.lineage) + more);
  }

private:
  template <class GetMemory>
  Memory &memoryOf(const void *handle, GetMemory getMemory) {
    for (const auto &[known, memory] : memories)
      if (known == handle)
        return *memory;
    auto memory = std::make_unique<Memory>(getMemory());
    memory->name = nameOf(handle);
    memories.emplace_back(handle, std::move(memory));
    return *memories.back().second;
  }

  /// The state comes first, then the stages.
  void checkFixed() const {
    for (const Fixed &memory : fixed)
      if (memory.hasChanged())
        failFixed(memory, &memory == &fixed.front());
  }
  [[noreturn]] void failFixed(const Fixed &memory, bool isState) const {
    size_t place = memory.findChange();
    std::string name = nameOf(memory.bytes() + place);
    std::string what = name.empty()
                           ? "byte " + std::to_string(place) + " of '" +
                                 std::string(memory.type) + "'"
                           : "'" + name + "'";
    fail(*current, {},
         std::string("expected phases to leave ") +
             (isState ? "constants of the state" : "members of a stage") +
             " as they are, but " + what + " was changed");
  }

  void enter(std::shared_ptr<const Strand> outer, int64_t loop,
             int64_t interval, int64_t iteration) {
    auto strand = std::make_shared<Strand>();
    strand->call = outer->call;
    strand->outer = std::move(outer);
    strand->loop = loop;
    strand->interval = interval;
    strand->iteration = iteration;
    current = std::move(strand);
  }

  Element::Holder &hold(Element &element, const SourcePlace &at) {
    if (element.holders.empty() || element.holders.back().strand != current) {
      element.holders.push_back({current, at});
      current->named.push_back(&element);
    }
    return element.holders.back();
  }

  /// Finds what the current strand did with its references.
  void release() {
    for (Element *element : current->named) {
      settle(*element);
      auto held = std::find_if(
          element->holders.begin(), element->holders.end(),
          [&](const auto &holder) { return holder.strand == current; });
      if (held == element->holders.end())
        continue;
      Element::Holder holder = std::move(*held);
      element->holders.erase(held);
      if (!holder.changed && holder.reads > 0 && !updates(*element))
        record(*element, {AccessKind::Read, current, holder.at});
    }
    current->named.clear();
  }
  bool updates(const Element &element) const {
    return std::any_of(element.accesses.begin(), element.accesses.end(),
                       [&](const Access &access) {
                         return access.kind == AccessKind::Update &&
                                access.by->call == current->call;
                       });
  }

  /// Attributes a change since the element was last looked at.
  void settle(Element &element) {
    if (!element.hasChanged())
      return;
    if (element.memory->isImage || element.holders.empty())
      failKept(element);
    Element::Holder &holder = element.holders.back();
    element.keepContent();
    holder.changed = true;
    checkPhase(element, AccessKind::Store, holder.at);
    record(element, {AccessKind::Store, holder.strand, holder.at});
    checkWritten(element, *holder.strand, holder.at);
  }

  [[noreturn]] void failKept(const Element &element) const {
    std::string message = "expected " + element.text() +
                          " to stay as it is between calls, but it was "
                          "changed through a reference that was kept";
    if (current)
      fail(*current, {}, message);
    throw LocatedError(message);
  }

  void checkPhase(const Element &element, AccessKind kind,
                  const SourcePlace &at) const {
    Phase phase = current->call->phase;
    if (phase == Phase::Process ||
        (phase == Phase::Assign && kind == AccessKind::Read))
      return;
    if (kind == AccessKind::Read)
      fail(*current, at,
           "expected schedule to depend on the bin and on constants, but it "
           "reads " +
               element.text());
    fail(*current, at,
         std::string("expected only process to write state, but ") +
             (phase == Phase::Assign ? "assignBin" : "schedule") + " stores " +
             element.text());
  }

  void checkWritten(const Element &element, const Strand &by,
                    const SourcePlace &at) const {
    if (const char *field = element.memory->findUnwritten(element.bytes()))
      fail(by, at, unwrittenText(field, element.memory->elementType));
  }

  void checkBypass(const Element &element, const SourcePlace &at) const {
    if (element.memory == updating)
      fail(*current, at,
           "expected an update to see " + element.memory->text() +
               " only through the pixel that it is given");
  }

  /// Notes an access and checks it against those before it.
  void record(Element &element, const Access &access) {
    for (const Access &other : element.accesses)
      if (conflict(access, other))
        failConflict(element, access, other);
    // The first and the last of a stage are enough to meet any conflict: all
    // others are concurrent with what either is concurrent with.
    Access *first = nullptr, *last = nullptr;
    for (Access &other : element.accesses)
      if (other.kind == access.kind &&
          other.by->call->node == access.by->call->node &&
          other.by->call->phase == access.by->call->phase)
        (first ? last : first) = &other;
    if (first && (first->by == access.by ||
                  !order.areConcurrent(*first->by, *access.by)))
      *first = access;
    else if (last)
      *last = access;
    else
      element.accesses.push_back(access);
  }

  bool conflict(const Access &a, const Access &b) const {
    if (a.by == b.by)
      return false;
    if (a.kind == b.kind &&
        (a.kind == AccessKind::Read || a.kind == AccessKind::Atomic ||
         (a.kind == AccessKind::Update &&
          a.by->call->node == b.by->call->node)))
      return false;
    return order.areConcurrent(*a.by, *b.by);
  }

  [[noreturn]] void failConflict(const Element &element, const Access &access,
                                 const Access &other) const {
    if (access.by->call == other.by->call) {
      auto [a, b] = iterations(*access.by, *other.by);
      fail(*access.by, access.at,
           "expected no conflict between iterations, but " + element.text() +
               " is " + toPast(element, access.kind) + " by iteration " +
               std::to_string(a) + " and " + toPast(element, other.kind) +
               " by iteration " + std::to_string(b),
           contextText(other.at, nullptr, "other "));
    }
    const Access &assign =
        other.by->call->phase == Phase::Assign ? other : access;
    const Access &rest = &assign == &access ? other : access;
    const Call &call = *rest.by->call;
    std::string by = toPast(element, rest.kind) + " by stage '" +
                     std::string(call.node->name()) + "', bin " +
                     std::to_string(call.bin);
    std::string more = contextText(rest.at, call.lineage, "other ");
    if (assign.by->call->phase == Phase::Assign)
      fail(*assign.by, assign.at,
           "expected assignBin to read what is complete, but " +
               element.text() + " is " + by,
           more);
    fail(*access.by, access.at,
         "expected no conflict between concurrent calls, but " +
             element.text() + " is " + toPast(element, access.kind) +
             " here and " + by,
         more);
  }

  /// The iterations of the loop where two strands of a call part.
  static std::pair<int64_t, int64_t> iterations(const Strand &a,
                                                const Strand &b) {
    for (const Strand *x = &a; x->outer; x = x->outer.get())
      for (const Strand *y = &b; y->outer; y = y->outer.get())
        if (x->loop == y->loop && x->iteration != y->iteration)
          return {x->iteration, y->iteration};
    return {a.iteration, b.iteration};
  }

  struct Name {
    const std::byte *begin;
    size_t size;
    std::string name;
  };
  std::vector<Name> names;
  std::vector<std::pair<const void *, std::unique_ptr<Memory>>> memories;
  std::vector<Fixed> fixed;
  StageOrder order;
  const Memory *updating = nullptr;
  int64_t turn = 0, loops = 0;
};

} // namespace piko::reference

#endif // PIKO_REFERENCE_CHECKER_H
