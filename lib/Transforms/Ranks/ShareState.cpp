// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where ranks use state that others have written. Each piece of state is clean,
// that is the same on all ranks, or has been written since in one of three
// ways: by the first rank alone, by owners in their bins, or anywhere. A
// statement that uses it otherwise than so shares it before. What is written
// anywhere is found by comparison with what was kept. All strips of a source
// use state as the first one does, and what that needs is done before them;
// strips that would need it again are taken apart.

#include "Ranks/Partition.h"
#include "Support/StateAccess.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "llvm/ADT/MapVector.h"

using namespace mlir;
using namespace piko;

namespace {

/// How a statement uses a piece of state.
struct Use {
  int kinds = 0;          ///< Bits of StateAccess.
  bool staysInBin = true; ///< All accesses are to pixels of the call's bin.
  /// By field, what atomic operations do; none where they differ.
  llvm::MapVector<StringAttr, std::optional<AtomicKind>> atomics;
};
using Uses = llvm::MapVector<Attribute, Use>;

enum class Way { Clean, FirstRank, Owners, Anywhere };

struct Written {
  Way way = Way::Clean;
  StageOp stage; ///< Of owners.
  llvm::MapVector<StringAttr, std::optional<AtomicKind>> atomics;
  bool onlyAtomics = false;
};

/// Over all statements so far.
struct History {
  bool isClear = true; ///< Nothing has changed it in this run.
  /// Whether each pixel is used by who owns its bin alone; a stage with such
  /// bins.
  bool isCommon = true;
  StageOp owner;
};

class StateSharer {
public:
  StateSharer(ProgramOp program, const Divisions &divisions)
      : program(program), pipeline(getPipeline(program)), divisions(divisions),
        builder(program.getContext()) {}

  void run();

private:
  void visit(Operation *statement);
  void visitAll(Block &statements);
  bool isSharedOnce(StripsOp strips);
  /// Where something is done before a statement, or before its strips.
  void setInsertionPoint(Operation *statement) {
    builder.setInsertionPoint(
        program.getBodyBlock()->findAncestorOpInBlock(*statement));
  }
  void use(Operation *statement, Attribute state, const Use &use,
           RankDivision division, StageOp stage);
  bool continues(const Written &before, const Use &use, Way way,
                 RankDivision division, StageOp stage);
  void share(Attribute state, bool atEnd, StageOp to = {});
  bool outlivesRun(Attribute state);
  void note(Attribute state, bool writes, bool isOwners, StageOp stage);
  void declareCommon();

  ProgramOp program;
  PipelineOp pipeline;
  const Divisions &divisions;
  OpBuilder builder;
  llvm::MapVector<Attribute, Written> written;
  llvm::MapVector<Attribute, History> histories;
  bool onlyCounts = false; ///< Makes no statements.
  int64_t made = 0;        ///< Statements, or those that were counted.
};

} // namespace

bool piko::isInBin(Operation *access) {
  if (isa<UpdateOp>(access))
    return true; // by its rule
  return isa<LoadOp, StoreOp>(access) && access->hasAttr(marks::inside) &&
         access->getParentOfType<ProcessOp>();
}

static void addUses(KernelOp kernel, Uses &uses) {
  kernel.walk([&](Operation *op) {
    auto [state, kinds] = getStateAccess(op);
    if (!state || lookupInPipeline<ConstantOp>(op, state))
      return;
    Use &use = uses[state];
    use.kinds |= kinds;
    use.staysInBin &= isInBin(op);
    if (auto atomic = dyn_cast<AtomicOp>(op)) {
      auto [known, isNew] =
          use.atomics.insert({atomic.getFieldAttr(), atomic.getKind()});
      if (!isNew && known->second != atomic.getKind())
        known->second.reset();
    }
  });
}

/// Images and buffers that a source sizes are cleared when a run begins.
bool StateSharer::outlivesRun(Attribute state) {
  auto buffer =
      lookupInPipeline<BufferOp>(program, cast<FlatSymbolRefAttr>(state));
  return buffer && !buffer.getPerSource();
}

/// `to`, if not null: whose owners alone will use its pixels.
void StateSharer::share(Attribute state, bool atEnd, StageOp to) {
  Written now = std::exchange(written[state], {});
  auto name = cast<FlatSymbolRefAttr>(state);
  bool toFirst = atEnd && !outlivesRun(state);
  bool toOwners = to && now.way == Way::Anywhere &&
                  lookupInPipeline<ImageOp>(program, name);
  if (now.way == Way::Clean || (now.way == Way::FirstRank && toFirst))
    return;
  if (toOwners) {
    now.stage = to;
    written[state].way = Way::Owners;
    written[state].stage = to;
  }
  ++made;
  if (onlyCounts)
    return;
  FlatSymbolRefAttr owner;
  if (now.way == Way::Owners || toOwners)
    owner = FlatSymbolRefAttr::get(now.stage.getSymNameAttr());
  SmallVector<Attribute> reduce;
  if (now.way == Way::Anywhere)
    for (auto [field, kind] : now.atomics) {
      reduce.push_back(field);
      reduce.push_back(builder.getStringAttr(stringifyAtomicKind(*kind)));
    }
  auto unit = [&](bool isSet) {
    return isSet ? builder.getUnitAttr() : UnitAttr();
  };
  ShareOp::create(builder, program.getLoc(), name, owner,
                  unit(now.way == Way::FirstRank), unit(toFirst),
                  unit(toOwners),
                  reduce.empty() ? ArrayAttr() : builder.getArrayAttr(reduce));
}

/// Whether a statement may use the state as it is on each rank, because it uses
/// it as the statements before it did.
bool StateSharer::continues(const Written &before, const Use &use, Way way,
                            RankDivision division, StageOp stage) {
  switch (before.way) {
  case Way::Clean:
    return true;
  case Way::FirstRank:
    return division == RankDivision::First;
  case Way::Owners:
    return division == RankDivision::Bins && use.staysInBin &&
           haveSameOwners(before.stage, stage, divisions);
  case Way::Anywhere:
    // Changes of one kind are combined, however many kernels make them.
    return division != RankDivision::First && division != RankDivision::All &&
           before.onlyAtomics && use.kinds == StateAccess::changesAtomically &&
           llvm::all_of(use.atomics, [&](const auto &atomic) {
             auto known = before.atomics.find(atomic.first);
             return known == before.atomics.end() ||
                    known->second == atomic.second;
           });
  }
  return false;
}

void StateSharer::note(Attribute state, bool writes, bool isOwners,
                       StageOp stage) {
  History &history = histories[state];
  history.isClear &= !writes;
  if (!history.owner)
    history.owner = stage;
  history.isCommon &=
      isOwners && haveSameOwners(history.owner, stage, divisions);
}

void StateSharer::use(Operation *statement, Attribute state, const Use &use,
                      RankDivision division, StageOp stage) {
  setInsertionPoint(statement);
  bool writes = use.kinds & ~StateAccess::reads;
  bool isOwners = division == RankDivision::Bins && use.staysInBin;
  Way way = !writes || division == RankDivision::All ? Way::Clean
            : division == RankDivision::First        ? Way::FirstRank
            : isOwners                               ? Way::Owners
                                                     : Way::Anywhere;
  // What is not the same on all ranks would be written to by all.
  bool isMixed =
      division == RankDivision::All && written[state].way != Way::Clean;
  if (isMixed || !continues(written[state], use, way, division, stage))
    share(state, /*atEnd=*/false, isOwners ? stage : StageOp());
  bool isCleared = histories[state].isClear && !outlivesRun(state);
  note(state, writes, isOwners, stage);
  if (way == Way::Clean)
    return;
  Written &now = written[state];
  if (way == Way::Anywhere && now.way == Way::Clean) {
    ++made;
    if (!onlyCounts)
      KeepOp::create(builder, statement->getLoc(),
                     cast<FlatSymbolRefAttr>(state),
                     isCleared ? builder.getUnitAttr() : UnitAttr());
    now.onlyAtomics = use.kinds == StateAccess::changesAtomically;
  }
  now.way = way;
  now.stage = stage;
  for (const auto &atomic : use.atomics)
    now.atomics.insert(atomic);
}

void StateSharer::visit(Operation *statement) {
  Uses uses;
  RankDivision division = RankDivision::First; // of rounds
  StageOp stage;
  statement->walk([&](LaunchOp launch) {
    KernelOp kernel = launch.getKernelOp();
    addUses(kernel, uses);
    if (SmallVector<StageOp> stages = getStages(kernel); !stages.empty()) {
      stage = stages.front();
      if (!isa<RoundsOp>(statement))
        division = divisions.lookup(stage).division;
    } else if (launch == statement) {
      division = RankDivision::Parts; // AssignBin of a source, which only reads
    }
  });
  for (const auto &[state, used] : uses)
    use(statement, state, used, division, stage);
}

/// Ranks that share memory need not send these.
void StateSharer::declareCommon() {
  for (const auto &[state, history] : histories) {
    auto name = cast<FlatSymbolRefAttr>(state);
    if (!history.isCommon || written.lookup(state).way != Way::Owners ||
        !lookupInPipeline<ImageOp>(program, name))
      continue;
    Operation *last = nullptr;
    for (auto partition : program.getBodyBlock()->getOps<PartitionOp>())
      last = partition;
    builder.setInsertionPointAfter(last);
    CommonOp::create(
        builder, program.getLoc(), name,
        FlatSymbolRefAttr::get(StageOp(history.owner).getSymNameAttr()));
  }
}

void StateSharer::visitAll(Block &statements) {
  Operation *next = nullptr;
  for (Operation *op = &statements.front(); op; op = next) {
    next = op->getNextNode();
    auto strips = dyn_cast<StripsOp>(op);
    if (strips && !isSharedOnce(strips)) {
      strips.emitRemark() << "ranks run no strips of the source, as they would "
                             "share state after each";
      next = takeApart(strips);
    } else if (strips) {
      visitAll(strips.getBody().front());
    } else if (isa<LaunchOp, WavesOp, RoundsOp>(op)) {
      visit(op);
    }
  }
}

/// Whether a second strip uses state as the first one has left it.
bool StateSharer::isSharedOnce(StripsOp strips) {
  auto before = std::make_tuple(written, histories, made);
  onlyCounts = true;
  visitAll(strips.getBody().front());
  int64_t first = made;
  visitAll(strips.getBody().front());
  bool isOnce = made == first;
  std::tie(written, histories, made) = std::move(before);
  onlyCounts = false;
  return isOnce;
}

void StateSharer::run() {
  visitAll(*program.getBodyBlock());
  builder.setInsertionPointToEnd(program.getBodyBlock());
  SmallVector<Attribute> states;
  for (const auto &[state, now] : written)
    states.push_back(state);
  declareCommon();
  builder.setInsertionPointToEnd(program.getBodyBlock());
  for (Attribute state : states)
    share(state, /*atEnd=*/true);
}

void piko::shareState(ProgramOp program, const Divisions &divisions) {
  StateSharer(program, divisions).run();
}
