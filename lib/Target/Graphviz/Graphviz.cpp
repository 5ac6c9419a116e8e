// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pipelines drawn as graphs. The stages of a pipeline are nodes at every level;
// once kernels are formed, their phases are, inside a box for each kernel, and
// an edge of the pipeline runs from a process phase to the assign phase that
// takes its port, or to the next process phase where there is none; it is bold
// where a local barrier keeps what it carries in a bin. A dotted edge leads to
// the process phases of the stages that were fused with it. A schedule that has
// code of its own is a kernel, too. An edge that is dashed and red leads from a
// stage to one that waits for its end. Of the program, strips, waves and rounds
// are boxes around kernels, and the way to join is said at edges.

#include "Piko/Target/Graphviz.h"

#include "Piko/Dialect/Piko/IR/PikoProgram.h"
#include "Piko/Driver/Registration.h"

#include "mlir/Tools/mlir-translate/Translation.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/ADT/StringSet.h"

using namespace mlir;
using namespace piko;

namespace {

class DotWriter {
public:
  DotWriter(PipelineOp pipeline, raw_ostream &stream)
      : pipeline(pipeline), stream(stream) {}
  void write();

private:
  void writeStage(StageOp stage);
  void writeKernel(KernelOp kernel);
  void writeStatements(Block &statements);
  void writeRegion(Operation *region);
  void noteJoin(JoinOp join);
  void writeFused(StageOp stage);
  void writeSchedule(StageOp stage);
  void writeSource(SourceOp source, int64_t number);
  void writeEdge(EdgeOp edge);
  void writeDrain(StageOp stage);
  void writeWaits(StageOp stage);
  /// The node of a stage's process phase.
  std::string processNode(StringRef stage);
  /// The nodes of assign phases that take a port of a stage on its way to a
  /// consumer: `from` is "producer.port", or "source.number".
  std::string assignNode(StringRef stage, StringRef from);
  bool hasAssignPhase(StringRef stage, StringRef from);

  PipelineOp pipeline;
  raw_ostream &stream;
  llvm::DenseMap<Operation *, std::string> joins; ///< By source or edge.
  int64_t regions = 0;
  llvm::StringSet<> assignNodes;
  bool kernels = false;
};

} // namespace

/// Text in Graphviz's quotes; `\n` stays a line break.
static std::string quote(const Twine &text) {
  std::string result = "\"";
  for (char c : text.str()) {
    if (c == '"')
      result += '\\';
    if (c == '\n')
      result += "\\n";
    else
      result += c;
  }
  return result + "\"";
}

std::string DotWriter::processNode(StringRef stage) {
  return quote("process " + stage);
}

std::string DotWriter::assignNode(StringRef stage, StringRef from) {
  return quote("assign " + stage + " " + from);
}

bool DotWriter::hasAssignPhase(StringRef stage, StringRef from) {
  return assignNodes.contains(assignNode(stage, from));
}

static std::string describeBins(StageOp stage) {
  std::string text = "bins ";
  llvm::raw_string_ostream out(text);
  if (stage.isWholeDomain())
    out << "whole domain";
  else
    llvm::interleave(
        stage.getBins(), out,
        [&](int64_t size) {
          if (size)
            out << size;
          else
            out << "all";
        },
        "x");
  out << ", " << stage.getThreads() << " threads";
  if (ScheduleOp schedule = stage.getSchedule())
    out << "\n" << stringifyScheduleKind(schedule.getKind());
  return text;
}

void DotWriter::writeStage(StageOp stage) {
  stream << "  " << processNode(stage.getSymName())
         << " [label=" << quote(stage.getSymName() + "\n" + describeBins(stage))
         << "];\n";
}

void DotWriter::writeKernel(KernelOp kernel) {
  stream << "  subgraph " << quote("cluster_" + kernel.getSymName())
         << " {\n    label=" << quote(kernel.getSymName()) << ";\n";
  std::string producer;
  for (Operation &op : *kernel.getBodyBlock()) {
    if (auto process = dyn_cast<ProcessOp>(op)) {
      producer = process.getStage().value_or("").str();
      auto stage = lookupInPipeline<StageOp>(kernel, process.getStageAttr());
      stream << "    " << processNode(producer) << " [label="
             << quote("process " + producer + "\n" +
                      (stage ? describeBins(stage) : ""))
             << "];\n";
      if (stage)
        writeFused(stage);
    }
    if (auto assign = dyn_cast<AssignOp>(op)) {
      std::string from =
          assign.getSource()
              ? "source." + std::to_string(*assign.getSource())
              : producer + "." + std::to_string(assign.getPort().value_or(0));
      StringRef stage = assign.getStage().value_or("");
      std::string node = assignNode(stage, from);
      assignNodes.insert(node);
      stream << "    " << node << " [label=" << quote("assign " + stage)
             << "];\n";
    }
  }
  stream << "  }\n";
}

/// How what comes to a stage is joined, by where it comes from.
void DotWriter::noteJoin(JoinOp join) {
  for (auto [edge, permute, keys] :
       llvm::zip(join.getEdges(), join.getPermutes(), join.getKeys())) {
    std::string text = permute ? "permuted" : "concatenated";
    if (join.getMerge())
      text += ", merged";
    if (keys > 0)
      text += ", keys of " + std::to_string(keys);
    joins[getOrigin(edge)] = text;
  }
}

void DotWriter::writeRegion(Operation *region) {
  std::string label = "rounds";
  if (auto strips = dyn_cast<StripsOp>(region)) {
    label = "strips";
    if (auto chunk = strips.getChunk())
      label += " of " + std::to_string(*chunk);
  } else if (isa<WavesOp>(region)) {
    label = "waves";
  }
  stream << "  subgraph " << quote("cluster_" + label + Twine(regions++))
         << " {\n    label=" << quote(label) << "; style=dashed;\n";
  writeStatements(region->getRegion(0).front());
  stream << "  }\n";
}

void DotWriter::writeStatements(Block &statements) {
  for (Operation &op : statements) {
    if (auto join = dyn_cast<JoinOp>(op))
      noteJoin(join);
    else if (auto launch = dyn_cast<LaunchOp>(op))
      writeKernel(launch.getKernelOp());
    else if (isa<StripsOp, WavesOp, RoundsOp>(op))
      writeRegion(&op);
  }
}

void DotWriter::writeFused(StageOp stage) {
  if (!stage.getFusedAttr())
    return;
  for (auto name : stage.getFusedAttr().getAsRange<StringAttr>())
    stream << "    " << processNode(name)
           << " [label=" << quote("process " + name.getValue()) << "];\n    "
           << processNode(stage.getSymName()) << " -> " << processNode(name)
           << " [style=dotted];\n";
}

void DotWriter::writeSchedule(StageOp stage) {
  std::string node = quote("schedule " + stage.getSymName());
  stream << "  subgraph " << quote("cluster_schedule " + stage.getSymName())
         << " {\n    " << node << ";\n  }\n  " << node << " -> "
         << processNode(stage.getSymName()) << " [style=dashed];\n";
}

void DotWriter::writeSource(SourceOp source, int64_t number) {
  StringRef stage = source.getStage();
  std::string from = "source." + std::to_string(number);
  std::string node = quote(from);
  auto consumer = lookupInPipeline<StageOp>(source, source.getStageAttr());
  std::string text = (consumer ? consumer.getInput() : "").str();
  if (auto join = joins.find(source); join != joins.end())
    text += "\n" + join->second;
  std::string label = quote(text);
  stream << "  " << node << " [label=" << quote("source " + Twine(number))
         << ", shape=invhouse];\n  " << node << " -> ";
  if (hasAssignPhase(stage, from))
    stream << assignNode(stage, from) << " [label=" << label << "];\n  "
           << assignNode(stage, from) << " -> ";
  stream << processNode(stage) << " [label=" << label << "];\n";
}

void DotWriter::writeEdge(EdgeOp edge) {
  StringRef style = isLocal(edge) ? ", style=bold" : "";
  auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  std::string label = "port " + std::to_string(edge.getPort());
  if (producer && edge.getPort() < int64_t(producer.getOutputs().size()))
    label +=
        ": " + cast<FlatSymbolRefAttr>(producer.getOutputs()[edge.getPort()])
                   .getValue()
                   .str();
  if (auto join = joins.find(edge); join != joins.end())
    label += "\n" + join->second;
  std::string from = (edge.getProducer() + "." + Twine(edge.getPort())).str();
  stream << "  " << processNode(edge.getProducer()) << " -> ";
  if (hasAssignPhase(edge.getConsumer(), from))
    stream << assignNode(edge.getConsumer(), from) << " [label=" << quote(label)
           << style << "];\n  " << assignNode(edge.getConsumer(), from)
           << " -> " << processNode(edge.getConsumer())
           << (style.empty() ? "" : " [style=bold]") << ";\n";
  else
    stream << processNode(edge.getConsumer()) << " [label=" << quote(label)
           << style << "];\n";
}

void DotWriter::writeDrain(StageOp stage) {
  std::string node = quote("drain " + stage.getSymName());
  stream << "  " << node << " [label=\"drain\", shape=house];\n  "
         << processNode(stage.getSymName()) << " -> " << node
         << " [style=dashed];\n";
}

void DotWriter::writeWaits(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  if (!schedule || !schedule.getEndStageAttr())
    return;
  for (auto name : schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>())
    stream << "  " << processNode(name.getValue()) << " -> "
           << processNode(stage.getSymName())
           << " [label=\"endStage\", style=dashed, color=red];\n";
}

void DotWriter::write() {
  stream << "digraph " << quote(pipeline.getSymName())
         << " {\n  node [shape=box];\n";
  kernels = !pipeline.getOps<KernelOp>().empty();
  if (ProgramOp program = getProgram(pipeline))
    writeStatements(*program.getBodyBlock());
  else
    for (auto kernel : pipeline.getOps<KernelOp>())
      writeKernel(kernel);
  for (auto stage : pipeline.getOps<StageOp>()) {
    if (!kernels)
      writeStage(stage);
    else if (ScheduleOp schedule = stage.getSchedule();
             schedule && !schedule.getBody().empty())
      writeSchedule(stage);
  }
  int64_t number = 0;
  for (auto source : pipeline.getOps<SourceOp>())
    writeSource(source, number++);
  for (auto edge : pipeline.getOps<EdgeOp>())
    writeEdge(edge);
  for (auto stage : pipeline.getOps<StageOp>())
    if (stage.getOutputs().empty())
      writeDrain(stage);
  for (auto stage : pipeline.getOps<StageOp>())
    writeWaits(stage);
  stream << "}\n";
}

/// Below the kernels level no phase is left that could be drawn.
static LogicalResult checkLevel(PipelineOp pipeline) {
  for (auto kernel : pipeline.getOps<KernelOp>())
    if (kernel.getBodyBlock()->getOps<ProcessOp>().empty() &&
        kernel.getBodyBlock()->getOps<AssignOp>().empty())
      return kernel.emitError("expected a kernel that holds phases, but got "
                              "none");
  return success();
}

LogicalResult piko::writeDot(ModuleOp module, raw_ostream &stream) {
  for (auto pipeline : module.getOps<PipelineOp>())
    if (failed(checkLevel(pipeline)))
      return failure();
  for (auto pipeline : module.getOps<PipelineOp>())
    DotWriter(pipeline, stream).write();
  return success();
}

static LogicalResult translate(Operation *op, raw_ostream &stream) {
  auto module = dyn_cast<ModuleOp>(op);
  if (!module)
    return op->emitError("expected a module");
  return writeDot(module, stream);
}

void piko::registerPikoToDotTranslation() {
  static TranslateFromMLIRRegistration registration(
      "piko-to-dot", "draw pipelines as graphs for Graphviz", translate,
      registerPikoDialects);
}
