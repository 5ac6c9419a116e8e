// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The C++ header that an application includes to run a compiled pipeline.

#include "HeaderWriter.h"

#include "RecordWriter.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/ADT/StringSet.h"
#include "llvm/Support/FormatVariadic.h"
#include "llvm/Support/Path.h"
#include "llvm/Support/raw_ostream.h"

using namespace piko;
using llvm::StringRef;

/// Letters, digits and '_' stay; "::" and all else become '_', with the code of
/// what is rare.
static std::string mangle(StringRef name) {
  std::string result;
  while (!name.empty()) {
    if (name.consume_front("::")) {
      result += '_';
      continue;
    }
    char c = name.front();
    name = name.drop_front();
    if (llvm::isAlnum(c) || c == '_')
      result += c;
    else
      result += "_" + llvm::utohexstr(static_cast<unsigned char>(c)) + "_";
  }
  return result;
}

std::string piko::getProgramSymbol(StringRef nameSpace, StringRef pipeline) {
  std::string prefix = nameSpace.empty() ? "" : mangle(nameSpace) + "_";
  return prefix + mangle(pipeline) + "_program";
}

namespace {

struct Input {
  std::string member, stage;
  RecordOp record;
};

/// Sources by stage; a stage with several has a member for each.
std::vector<Input> getInputs(PipelineOp pipeline) {
  std::vector<Input> inputs;
  llvm::StringMap<int> counts;
  for (auto source : pipeline.getOps<SourceOp>()) {
    auto stage = lookupInPipeline<StageOp>(source, source.getStageAttr());
    std::string name = mangle(stage.getSymName());
    if (int number = ++counts[name]; number > 1)
      name += std::to_string(number);
    inputs.push_back({name, name, lookupRecord(stage, stage.getInputAttr())});
  }
  return inputs;
}

class HeaderWriter {
public:
  HeaderWriter(PipelineOp pipeline, StringRef file, StringRef nameSpace)
      : pipeline(pipeline), file(file), nameSpace(nameSpace),
        symbol(getProgramSymbol(nameSpace, pipeline.getSymName())),
        className(unscoped(pipeline.getSymName())), inputs(getInputs(pipeline)),
        out(text) {
    // What a record or a source may not be called.
    for (StringRef name : {StringRef("State"), StringRef(className)})
      typeNames.insert(name);
    for (StringRef name : {"state", "run", "feed", "setDomain", "setThreads",
                           "setMemoryLimit", "setLoopLimit", "created", "get"})
      memberNames.insert(name);
    for (Input &input : inputs)
      input.member = makeUnique(input.member, memberNames);
  }

  std::string write() {
    std::string guard = StringRef(symbol).upper() + "_H";
    out << "// Made by pikoc from " << llvm::sys::path::filename(file)
        << "; changes will be lost.\n"
        << "#ifndef " << guard << "\n#define " << guard << "\n\n"
        << "#include <pikort/compiled.hpp>\n\n"
        << "#include <cstddef>\n#include <cstdint>\n\n"
        << "extern \"C\" const pikort_program " << symbol << ";\n\n";
    if (!nameSpace.empty())
      out << "namespace " << nameSpace << " {\n\n";
    writeClass();
    if (!nameSpace.empty())
      out << "\n} // namespace " << nameSpace << "\n";
    out << "\n#endif // " << guard << "\n";
    return text;
  }

private:
  /// The last name of a C++ path.
  static std::string unscoped(StringRef name) {
    if (!name.contains('<'))
      if (size_t at = name.rfind("::"); at != StringRef::npos)
        name = name.substr(at + 2);
    return mangle(name);
  }

  static std::string makeUnique(const std::string &name,
                                llvm::StringSet<> &known) {
    std::string unique = name;
    for (int i = 2; !known.insert(unique).second; ++i)
      unique = name + std::to_string(i);
    return unique;
  }

  void writeClass() {
    out << "/// The pipeline '" << pipeline.getSymName() << "', compiled.\n"
        << "class " << className << " : public piko::rt::CompiledPipeline {\n"
        << "public:\n";
    writeRecords();
    writeState();
    out << "\n  " << className << "()\n      : CompiledPipeline(" << symbol
        << ")";
    for (auto [number, input] : llvm::enumerate(inputs))
      out << ",\n        " << input.member << "(get(), " << number << ")";
    out << ",\n        memory(get()) {}\n\n"
        << "  State &state() { return memory; }\n\n"
        << "  // Sources, for feed().\n";
    for (Input &input : inputs)
      out << "  piko::rt::Source<" << types[input.record] << "> "
          << input.member << ";\n";
    out << "\nprivate:\n  State memory;\n};\n";
  }

  /// Defines the records of state and sources; `use` names one whose own name
  /// is no identifier.
  void defineRecord(RecordOp record, std::string use) {
    if (types.contains(record))
      return;
    if (StringRef scalar = getScalarType(record); !scalar.empty()) {
      types[record] = scalar.str();
      return;
    }
    StringRef own = record.getSymName();
    if (!own.contains('<'))
      use = unscoped(own);
    use[0] = llvm::toUpper(use[0]);
    std::string name = makeUnique(use, typeNames);
    out << writeRecord(record, name, "  ") << "\n";
    types[record] = name;
  }

  void writeRecords() {
    for (mlir::Operation &op : pipeline.getOps())
      if (mlir::FlatSymbolRefAttr record = getStateRecord(&op))
        defineRecord(lookupRecord(&op, record), mangle(getName(&op)));
    for (Input &input : inputs)
      defineRecord(input.record, input.stage + "Input");
  }

  static StringRef getName(mlir::Operation *op) {
    return mlir::SymbolTable::getSymbolName(op).getValue();
  }

  void writeState() {
    out << "  struct State {\n"
        << "    explicit State(pikort_pipeline *pipeline)";
    std::string members;
    const char *separator = "\n        : ";
    for (mlir::Operation &op : pipeline.getOps()) {
      mlir::FlatSymbolRefAttr record = getStateRecord(&op);
      if (!record)
        continue;
      StringRef kind = "Constant";
      if (auto buffer = llvm::dyn_cast<BufferOp>(op))
        kind = buffer.getPerSource() ? "Elements" : "Buffer";
      else if (llvm::isa<ImageOp>(op))
        kind = "Elements";
      std::string name = mangle(getName(&op));
      out << separator << name << "({pipeline, \"" << getName(&op) << "\"})";
      separator = ",\n          ";
      members += llvm::formatv("    piko::rt::{0}<{1}> {2};\n", kind,
                               types[lookupRecord(&op, record)], name);
    }
    if (members.empty())
      out << " { (void)pipeline; }\n";
    else
      out << " {}\n" << members;
    out << "  };\n";
  }

  PipelineOp pipeline;
  StringRef file, nameSpace;
  std::string symbol, className;
  std::vector<Input> inputs;
  llvm::StringSet<> typeNames, memberNames;
  llvm::DenseMap<mlir::Operation *, std::string> types;
  std::string text;
  llvm::raw_string_ostream out;
};

} // namespace

std::string piko::writeHostHeader(PipelineOp pipeline, StringRef file,
                                  StringRef nameSpace) {
  return HeaderWriter(pipeline, file, nameSpace).write();
}
