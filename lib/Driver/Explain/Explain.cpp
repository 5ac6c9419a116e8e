// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The report compares two states of the pipeline: as it was written, with its
// stages in order, and as kernels.

#include "Piko/Driver/Explain.h"

#include "Explain/ExplainKernels.h"

#include "Piko/Analysis/StageGraph.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/PassReport.h"
#include "Piko/Driver/Sequences.h"

#include "mlir/Pass/Pass.h"
#include "mlir/Pass/PassInstrumentation.h"
#include "mlir/Pass/PassManager.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/ADT/StringMap.h"
#include "llvm/ADT/StringSet.h"

using namespace mlir;
using namespace piko;

namespace {

/// What a run of the passes leaves behind.
struct Trace {
  struct Remarks {
    std::string pass;
    std::vector<std::string> texts = {}; ///< each once
    llvm::StringSet<> known = {};
  };
  OwningOpRef<ModuleOp> ordered; ///< as it was after piko-order-stages
  std::vector<Remarks> remarks;  ///< of the passes that made any, in order
  std::string pass;              ///< that is running
  llvm::StringSet<> passes;      ///< that have run
  /// Of stages that need not be strict, by name.
  llvm::StringMap<Precision> precisions;
  llvm::StringMap<int64_t> ulps;

  void add(Diagnostic &remark);
};

/// Keeps a trace of the passes of a manager, which owns it.
struct Tracer : PassInstrumentation {
  explicit Tracer(Trace &trace) : trace(trace) {}
  void runBeforePass(Pass *pass, Operation *op) override {
    trace.pass = pass->getArgument().str();
    if (trace.pass == "piko-apply-precision")
      notePrecisions(cast<PipelineOp>(op));
    trace.passes.insert(trace.pass);
  }
  void runAfterPass(Pass *pass, Operation *op) override {
    if (pass->getArgument() == "piko-order-stages")
      trace.ordered = op->getParentOfType<ModuleOp>().clone();
  }
  void notePrecisions(PipelineOp pipeline) {
    for (auto stage : pipeline.getOps<StageOp>()) {
      ProcessOp process = stage.getProcess();
      if (process && process.getPrecision())
        trace.precisions[stage.getSymName()] = *process.getPrecision();
      if (process && process.getUlps())
        trace.ulps[stage.getSymName()] = int64_t(*process.getUlps());
    }
  }
  Trace &trace;
};

class Report {
public:
  Report(const Trace &trace, PipelineOp kernels, raw_ostream &out);
  void write();

private:
  void writeStage(StageOp stage);
  void writeInputs(StageOp stage);
  void writeWaits(StageOp stage);
  void writeKernel(KernelOp kernel);
  void writeProcess(ProcessOp process);
  void writeFused(StageOp host);
  void writeAssign(StageOp stage, bool hasPhase, const Twine &origin = "");
  void writeStatements(Block &statements, unsigned depth);
  void writeRegion(Operation *region, unsigned depth);
  void writeJoin(JoinOp join);
  /// Whether a kernel is there to assign what a source is fed.
  bool hasKernel(int64_t source);
  /// The kernel that runs a stage's process phase, or an empty name.
  StringRef getKernelOf(StringRef stage);
  /// The barrier before a stage's process phase, or null.
  LocalBarrierOp getBarrier(StringRef stage);
  /// How the stage waits until a bin is complete.
  std::string describeBinWait(StageOp stage);

  const Trace &trace;
  PipelineOp written, kernels;
  raw_ostream &out;
  /// By the name of a stage as it was written: the stage that it is now or that
  /// it has become a part of. Without those that were removed.
  llvm::StringMap<StageOp> hosts;
};

} // namespace

//===----------------------------------------------------------------------===//
// Remarks
//===----------------------------------------------------------------------===//

/// The place in the user's file, or nothing where there is none.
static std::string describe(Location location) {
  std::string text;
  location->walk([&](Location inner) {
    auto file = dyn_cast<FileLineColLoc>(inner);
    if (!file)
      return WalkResult::advance();
    text = (file.getFilename().getValue() + ":" + Twine(file.getLine()) + ":" +
            Twine(file.getColumn()) + ": ")
               .str();
    return WalkResult::interrupt();
  });
  return text;
}

void Trace::add(Diagnostic &remark) {
  auto found = llvm::find_if(
      remarks, [&](const Remarks &other) { return other.pass == pass; });
  if (found == remarks.end())
    found = remarks.insert(remarks.end(), Remarks{pass});
  std::string lines;
  llvm::raw_string_ostream text(lines);
  text << "    " << describe(remark.getLocation()) << remark << "\n";
  for (Diagnostic &note : remark.getNotes()) {
    text << "      ";
    if (note.getLocation() != remark.getLocation())
      text << describe(note.getLocation());
    text << note << "\n";
  }
  if (found->known.insert(lines).second)
    found->texts.push_back(lines);
}

//===----------------------------------------------------------------------===//
// Stages
//===----------------------------------------------------------------------===//

static std::string describeBins(StageOp stage) {
  if (stage.isWholeDomain())
    return "one bin";
  std::string text = "bins of ";
  llvm::raw_string_ostream stream(text);
  llvm::interleave(
      stage.getBins(),
      [&](int64_t extent) { extent ? stream << extent : stream << "all"; },
      [&] { stream << " x "; });
  return text;
}

/// Which core a bin goes to, where the stage's text says so for all bins alike.
static std::string describeKind(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  std::string text = stringifyScheduleKind(schedule.getKind()).str();
  if (auto split = schedule.getTileSplit())
    text += " in tiles of " + std::to_string(*split) + " primitives";
  return text;
}

static bool isDynamic(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  return schedule && !schedule.getBody().empty();
}

static bool isLoadBalanced(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  return !schedule || schedule.getKind() == ScheduleKind::LoadBalance;
}

static std::string describeSchedule(StageOp stage) {
  if (isDynamic(stage))
    return "a schedule for each bin";
  return stage.getSchedule() ? describeKind(stage) : "no schedule";
}

StringRef Report::getKernelOf(StringRef stage) {
  StageOp host = hosts.lookup(stage);
  for (auto kernel : kernels.getOps<KernelOp>())
    for (auto process : kernel.getOps<ProcessOp>())
      if (host && process.getStage() == host.getSymName())
        return kernel.getSymName();
  return "";
}

LocalBarrierOp Report::getBarrier(StringRef stage) {
  StageOp host = hosts.lookup(stage);
  for (auto kernel : kernels.getOps<KernelOp>())
    for (auto barrier : kernel.getOps<LocalBarrierOp>())
      if (host && barrier.getConsumer() == host.getSymName())
        return barrier;
  return {};
}

std::string Report::describeBinWait(StageOp stage) {
  if (LocalBarrierOp barrier = getBarrier(stage.getSymName()))
    return ("a local barrier after " + barrier.getProducer() + " in " +
            getKernelOf(stage.getSymName()))
        .str();
  std::string text = "a kernel break, ";
  if (!trace.passes.contains("piko-fuse-kernels"))
    return text + "because piko-fuse-kernels did not run";
  bool isFed = llvm::any_of(written.getOps<EdgeOp>(), [&](EdgeOp edge) {
    return edge.getConsumer() == stage.getSymName();
  });
  return text + (isFed ? "for the reason that piko-fuse-kernels gives below"
                       : "because only the host feeds it");
}

/// How many bytes a primitive of the stage's input has.
static int64_t getInputSize(StageOp stage) {
  return lookupRecord(stage, stage.getInputAttr()).getSize();
}

void Report::writeInputs(StageOp stage) {
  StageOp now = hosts.lookup(stage.getSymName());
  if (now.getSymName() != stage.getSymName()) {
    for (auto edge : written.getOps<EdgeOp>())
      if (edge.getConsumer() == stage.getSymName())
        out << "    from " << edge.getProducer()
            << ": nothing is stored, because both run in "
            << getKernelOf(stage.getSymName()) << "\n";
    return;
  }
  for (auto [number, source] : llvm::enumerate(kernels.getOps<SourceOp>()))
    if (source.getStage() == now.getSymName())
      out << "    from source " << number << ": " << getInputSize(now)
          << " bytes a primitive\n";
  for (auto edge : kernels.getOps<EdgeOp>()) {
    if (edge.getConsumer() != now.getSymName())
      continue;
    out << "    from " << edge.getProducer() << " port " << edge.getPort()
        << ": " << getInputSize(now) << " bytes a primitive";
    if (auto carried = edge.getCarried();
        carried && *carried != getInputSize(now))
      out << ", " << *carried << " before it was pruned";
    if (getBarrier(now.getSymName()))
      out << ", stored for one bin at a time";
    out << "\n";
  }
}

void Report::writeWaits(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  if (schedule && schedule.getEndStageAttr())
    for (auto other :
         schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>()) {
      StringRef kernel = getKernelOf(other.getValue());
      out << "    waits for the end of stage " << other.getValue() << ": ";
      if (kernel.empty())
        out << "it was removed\n";
      else
        out << "a kernel break after " << kernel << "\n";
    }
  if (schedule && schedule.getEndBin())
    out << "    waits until nothing can reach the bin: "
        << describeBinWait(stage) << "\n";
  if (!stage.getTakesList())
    return;
  out << "    takes lists";
  if (auto batch = schedule ? schedule.getBatch() : std::nullopt)
    out << " of " << *batch << " primitives";
  if (schedule && schedule.getEveryBin())
    out << ", of empty bins too";
  out << ": " << describeBinWait(stage) << "\n";
}

void Report::writeStage(StageOp stage) {
  out << "  " << stage.getSymName();
  // A member that is called as a part of the state has another symbol.
  if (StringRef name = getCppName(stage); name != stage.getSymName())
    out << " ('" << name << "')";
  out << ": " << describeBins(stage) << ", " << stage.getThreads()
      << " threads, " << describeSchedule(stage);
  if (ScheduleOp schedule = stage.getSchedule();
      schedule && schedule.getUnordered())
    out << ", unordered";
  if (auto said = trace.precisions.find(stage.getSymName());
      said != trace.precisions.end())
    out << ", " << stringifyPrecision(said->second) << " precision";
  if (auto said = trace.ulps.find(stage.getSymName()); said != trace.ulps.end())
    out << ", functions within " << said->second << " ULP";
  if (isOnCycle(stage))
    out << ", on a cycle";
  if (!hosts.contains(stage.getSymName())) {
    out << "\n    was removed\n";
    return;
  }
  out << "\n";
  writeInputs(stage);
  writeWaits(stage);
}

//===----------------------------------------------------------------------===//
// Kernels
//===----------------------------------------------------------------------===//

bool Report::hasKernel(int64_t source) {
  return llvm::any_of(kernels.getOps<KernelOp>(), [&](KernelOp kernel) {
    return llvm::any_of(kernel.getOps<AssignOp>(), [&](AssignOp assign) {
      return assign.getSource() == source;
    });
  });
}

void Report::writeAssign(StageOp stage, bool hasPhase, const Twine &origin) {
  out << "    AssignBin " << stage.getSymName() << origin
      << (hasPhase ? "\n" : ": there is one bin\n");
  if (!isDynamic(stage) && !isLoadBalanced(stage))
    out << "    Schedule " << stage.getSymName() << ": " << describeKind(stage)
        << ", pre-scheduled, because "
        << (stage.getSchedule().getKind() == ScheduleKind::All
                ? "all cores take part\n"
                : "the core follows from the bin\n");
}

void Report::writeFused(StageOp host) {
  if (!host.getFusedAttr())
    return;
  for (auto name : host.getFusedAttr().getAsRange<StringAttr>())
    for (auto edge : written.getOps<EdgeOp>()) {
      if (edge.getConsumer() != name.getValue())
        continue;
      out << "      AssignBin " << name.getValue() << ": the same bin\n"
          << "      Schedule " << name.getValue() << ": with "
          << host.getSymName() << "\n"
          << "      Process " << name.getValue() << ", where "
          << edge.getProducer() << " emits\n";
    }
}

void Report::writeProcess(ProcessOp process) {
  StageOp stage = getPhaseStage(process);
  for (auto [number, source] : llvm::enumerate(kernels.getOps<SourceOp>()))
    if (source.getStage() == stage.getSymName() && !hasKernel(number))
      writeAssign(stage, /*hasPhase=*/false, " for source " + Twine(number));
  if (LocalBarrierOp barrier = getBarrier(stage.getSymName()))
    out << "    Local barrier: what " << barrier.getProducer()
        << " emits in the bin is complete\n    Schedule " << stage.getSymName()
        << ": with " << barrier.getProducer() << "\n";
  else if (!isDynamic(stage) && isLoadBalanced(stage))
    out << "    Schedule " << stage.getSymName()
        << (trace.passes.contains("piko-eliminate-schedules")
                ? ": eliminated, because "
                : ": ")
        << "any core takes the next bins\n";
  out << "    Process " << stage.getSymName();
  if (auto tile = stage.getTile())
    out << ", by tiles with a side of " << *tile << " cells";
  out << "\n";
  writeFused(stage);
  auto kernel = process->getParentOfType<KernelOp>();
  for (auto edge : kernels.getOps<EdgeOp>()) {
    if (edge.getProducer() != stage.getSymName())
      continue;
    auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
    bool hasPhase =
        llvm::any_of(kernel.getOps<AssignOp>(), [&](AssignOp assign) {
          return assign.getStageAttr() == edge.getConsumerAttr() &&
                 assign.getPort() == edge.getPort();
        });
    if (getBarrier(consumer.getSymName()))
      out << "    AssignBin " << consumer.getSymName() << ": the same bin\n";
    else
      writeAssign(consumer, hasPhase);
  }
}

void Report::writeKernel(KernelOp kernel) {
  out << "  " << kernel.getSymName();
  if (ProcessOp process = kernel.getProcess())
    if (isOnCycle(getPhaseStage(process)))
      out << ", again until its cycle is empty";
  out << "\n";
  for (Operation &op : *kernel.getBodyBlock()) {
    if (auto process = dyn_cast<ProcessOp>(op))
      writeProcess(process);
    auto assign = dyn_cast<AssignOp>(op);
    if (assign && assign.getSource())
      writeAssign(getPhaseStage(assign), /*hasPhase=*/true,
                  " for source " + Twine(*assign.getSource()));
  }
}

//===----------------------------------------------------------------------===//
// The program
//===----------------------------------------------------------------------===//

/// Where an edge of a program leads from.
static std::string describeOrigin(Value edge) {
  Operation *origin = getOrigin(edge);
  if (auto from = dyn_cast<EdgeOp>(origin))
    return (from.getProducer() + " port " + Twine(from.getPort())).str();
  int64_t number = 0;
  for (auto source : getPipeline(origin).getOps<SourceOp>()) {
    if (source == origin)
      break;
    ++number;
  }
  return "source " + std::to_string(number);
}

void Report::writeJoin(JoinOp join) {
  out << " of what comes from ";
  int64_t words = 0;
  for (auto [number, edge] : llvm::enumerate(join.getEdges())) {
    out << (number ? ", " : "") << describeOrigin(edge)
        << (join.getPermutes()[number] ? ", permuted" : ", concatenated");
    words = std::max(words, join.getKeys()[number]);
  }
  if (join.getMerge())
    out << "; merged by keys of " << words << (words == 1 ? " word" : " words");
}

void Report::writeRegion(Operation *region, unsigned depth) {
  out << std::string(depth, ' ');
  if (auto strips = dyn_cast<StripsOp>(region)) {
    out << "in strips of " << describeOrigin(strips.getSource());
    if (auto chunk = strips.getChunk())
      out << ", of " << *chunk << " primitives";
  } else {
    out << (isa<WavesOp>(region) ? "in waves" : "in rounds")
        << ", until nothing is left";
  }
  out << ":\n";
  writeStatements(region->getRegion(0).front(), depth + 2);
}

void Report::writeStatements(Block &statements, unsigned depth) {
  std::string indent(depth, ' ');
  for (Operation &op : statements) {
    if (auto clear = dyn_cast<ClearOp>(op)) {
      out << indent << "clear ";
      llvm::interleaveComma(
          clear.getStates().getAsRange<FlatSymbolRefAttr>(), out,
          [&](FlatSymbolRefAttr name) { out << name.getValue(); });
      out << "\n";
    } else if (auto schedule = dyn_cast<ScheduleBinsOp>(op)) {
      out << indent << "the schedule of " << schedule.getStage()
          << ", for each bin\n";
    } else if (auto wait = dyn_cast<WaitOp>(op)) {
      out << indent << "wait for " << wait.getStage() << "\n";
    } else if (auto launch = dyn_cast<LaunchOp>(op)) {
      out << indent << "launch " << launch.getKernel();
      if (auto turn = launch.getTurn())
        out << ", in turn " << *turn;
      Value bins = launch.getInput();
      if (auto join = bins ? bins.getDefiningOp<JoinOp>() : JoinOp())
        writeJoin(join);
      out << "\n";
    } else if (isa<StripsOp, WavesOp, RoundsOp>(op)) {
      writeRegion(&op, depth);
    }
  }
}

//===----------------------------------------------------------------------===//
// The report
//===----------------------------------------------------------------------===//

static PipelineOp getOnlyPipeline(ModuleOp module) {
  return *module.getOps<PipelineOp>().begin();
}

Report::Report(const Trace &trace, PipelineOp kernels, raw_ostream &out)
    : trace(trace), written(getOnlyPipeline(trace.ordered.get())),
      kernels(kernels), out(out) {
  for (auto stage : kernels.getOps<StageOp>()) {
    hosts[stage.getSymName()] = stage;
    if (stage.getFusedAttr())
      for (auto name : stage.getFusedAttr().getAsRange<StringAttr>())
        hosts[name.getValue()] = stage;
  }
}

void Report::write() {
  out << "Pipeline " << written.getSymName() << "\n\nStages, in order:\n";
  for (auto stage : written.getOps<StageOp>())
    writeStage(stage);
  out << "\nKernels, in order:\n";
  for (auto stage : kernels.getOps<StageOp>())
    if (isDynamic(stage))
      out << "  before all others\n    Schedule " << stage.getSymName()
          << ", for each bin\n";
  for (auto kernel : kernels.getOps<KernelOp>())
    writeKernel(kernel);
  if (ProgramOp program = getProgram(kernels)) {
    out << "\nProgram:\n";
    writeStatements(*program.getBodyBlock(), 2);
  }
  if (!trace.remarks.empty())
    out << "\nWhat the passes did or refused:\n";
  auto write = [&](bool areTests) {
    for (const Trace::Remarks &pass : trace.remarks)
      if ((pass.pass == "piko-prove-bounds") == areTests) {
        out << "  " << pass.pass << "\n";
        for (const std::string &text : pass.texts)
          out << text;
      }
  };
  // There are many, and none costs much.
  write(/*areTests=*/false);
  write(/*areTests=*/true);
}

FailureOr<std::string>
piko::explainPipeline(ModuleOp module, const CheckOptions &check,
                      const SynthesisOptions &synthesis, const CPUOptions &cpu,
                      const GPUOptions &gpu, int optLevel) {
  MLIRContext *context = module.getContext();
  Trace trace;
  ScopedDiagnosticHandler handler(context, [&](Diagnostic &diagnostic) {
    if (diagnostic.getSeverity() == DiagnosticSeverity::Remark)
      trace.add(diagnostic);
    return failure(); // others want to see it, too
  });
  if (Level level = getLevel(module); level != Level::Authored)
    return emitError(module.getLoc())
           << "--explain: expected the authored level, but the file is at the "
           << getName(level) << " level";
  bool isCUDA = gpu.target == GPUTarget::CUDA;
  PassReport changes;
  auto run = [&](Level from, Level to) {
    PassManager passes(context);
    passes.addInstrumentation(std::make_unique<Tracer>(trace));
    changes.follow(passes);
    addPasses(passes, from, isCUDA ? std::min(to, Level::Machine) : to, check,
              synthesis, {}, cpu);
    if (isCUDA && to == Level::Target)
      addGPUSequence(passes, {.threads = gpu.threads});
    return passes.run(module);
  };
  if (failed(run(Level::Authored, Level::Kernels)))
    return failure();
  OwningOpRef<ModuleOp> kernels = module.clone();
  // What is below has remarks alone.
  std::vector<KernelTraffic> traffic;
  std::vector<KernelUnits> units;
  if (isCUDA) {
    if (failed(run(Level::Kernels, Level::Machine)))
      return failure();
    for (auto kernel : getOnlyPipeline(module).getOps<KernelOp>()) {
      traffic.push_back(findKernelTraffic(kernel));
      if (std::optional<UnitOrder> order = getUnitOrder(kernel))
        units.push_back({kernel.getSymName().str(), *order});
    }
  }
  if (failed(run(isCUDA ? Level::Machine : Level::Kernels, Level::Target)))
    return failure();
  std::string text;
  llvm::raw_string_ostream out(text);
  PipelineOp pipeline = getOnlyPipeline(*kernels);
  Report(trace, pipeline, out).write();
  out << "\nWhat passes changed, as operations that are more or fewer:\n";
  changes.writeText(out);
  if (isCUDA) {
    explainUnits(units, out);
    if (failed(explainResources(module, pipeline.getSymName(), gpu, optLevel,
                                out)))
      return failure();
    explainTraffic(traffic, out);
  }
  return text;
}
