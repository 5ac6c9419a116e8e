// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The C++ header that an application includes to run a compiled pipeline.

#include "Header/HeaderWriter.h"

#include "Header/RecordWriter.h"
#include "Header/StateMembers.h"
#include "ProgramSymbol.h"

#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SetVector.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/FormatVariadic.h"
#include "llvm/Support/Path.h"
#include "llvm/Support/raw_ostream.h"

using namespace piko;
using llvm::StringRef;

/// The record of state that the host has; null for all else.
static mlir::FlatSymbolRefAttr getHostRecord(mlir::Operation *op) {
  auto image = llvm::dyn_cast<ImageOp>(op);
  return image && image.getInternal() ? mlir::FlatSymbolRefAttr()
                                      : getStateRecord(op);
}

/// The names in a text that may be macros, each once; strings and comments have
/// none.
static llvm::SmallVector<StringRef, 0> findNames(StringRef text) {
  llvm::SetVector<StringRef> names;
  auto isPart = [](char c) { return llvm::isAlnum(c) || c == '_'; };
  while (!text.empty()) {
    if (text.consume_front("//")) {
      text = text.drop_until([](char c) { return c == '\n'; });
    } else if (text.consume_front("\"")) {
      text = text.drop_until([](char c) { return c == '"'; }).drop_front();
    } else if (isPart(text.front())) {
      StringRef word = text.take_while(isPart);
      text = text.drop_front(word.size());
      bool isOurs = word == "std" || word == "piko" || word == "offsetof" ||
                    word.ends_with("_t");
      if (isCppIdentifier(word) && !isOurs)
        names.insert(word);
    } else {
      text = text.drop_front();
    }
  }
  return names.takeVector();
}

namespace {

/// A stage that the host feeds: a member of the pipeline.
struct Input {
  std::string member;
  RecordOp record;
  int64_t number; ///< Of its source; -1 if it has several.
};

/// What the pipeline's class calls a stage, whatever messages call it.
static StringRef getMemberName(StageOp stage) {
  auto name = stage->getAttrOfType<mlir::StringAttr>(cppNameAttr);
  return name ? name.getValue() : stage.getSymName();
}

class HeaderWriter {
public:
  HeaderWriter(PipelineOp pipeline, StringRef file, StringRef nameSpace)
      : pipeline(pipeline), file(file), nameSpace(nameSpace),
        symbol(getProgramSymbol(nameSpace, pipeline.getSymName())),
        className(getUnscopedName(pipeline.getSymName())), records(scope),
        out(text) {
    for (StringRef name :
         {StringRef("State"), StringRef("state"), StringRef("pikoState_"),
          StringRef("pikoBind_"), StringRef(className)})
      scope.reserve(name);
    addInputs();
    // These would hide records, and records these.
    for (StringRef name : {"piko", "glm", "std"})
      scope.reserve(name);
    for (mlir::Operation &op : pipeline.getOps())
      if (getHostRecord(&op))
        scope.reserve(makeIdentifier(getCppName(&op)));
  }

  std::string write() {
    std::string body = writeClass();
    std::string guard = StringRef(symbol).upper() + "_H";
    out << "// Made by pikoc from " << llvm::sys::path::filename(file)
        << "; changes will be lost.\n"
        << "#ifndef " << guard << "\n#define " << guard << "\n\n"
        << "#include <pikort/compiled.hpp>\n\n"
        << "#include <cstddef>\n#include <cstdint>\n";
    for (const std::string &include : records.getIncludes())
      out << "#include <" << include << ">\n";
    // Those of X11, say.
    out << "\n// Macros of the host's that are called as something here is.\n";
    std::string all = (nameSpace + " " + body).str();
    llvm::SmallVector<StringRef, 0> names = findNames(all);
    for (StringRef name : names)
      out << "#pragma push_macro(\"" << name << "\")\n#undef " << name << "\n";
    out << "\nextern \"C\" const pikort_program " << symbol << ";\n\n";
    if (!nameSpace.empty())
      out << "namespace " << nameSpace << " {\n\n";
    out << body;
    if (!nameSpace.empty())
      out << "\n} // namespace " << nameSpace << "\n";
    out << "\n";
    for (StringRef name : names)
      out << "#pragma pop_macro(\"" << name << "\")\n";
    out << "\n#endif // " << guard << "\n";
    return text;
  }

private:
  void addInputs() {
    llvm::MapVector<mlir::Operation *, Input> byStage;
    int64_t number = 0;
    for (auto source : pipeline.getOps<SourceOp>()) {
      auto stage = lookupInPipeline<StageOp>(source, source.getStageAttr());
      auto [it, isNew] = byStage.try_emplace(stage);
      if (isNew)
        it->second = {scope.declare(makeIdentifier(getMemberName(stage))),
                      lookupRecord(stage, stage.getInputAttr()), number};
      else
        it->second.number = -1;
      ++number;
    }
    for (auto &[stage, input] : byStage)
      inputs.push_back(input);
  }

  /// The definitions that the state and the sources need come first.
  std::string writeClass() {
    std::string state = writeState(), sources;
    for (Input &input : inputs)
      sources += llvm::formatv("  piko::rt::Source<{0}> {1}{{{2}};\n",
                               getType(input.record, input.member + "Input"),
                               input.member, input.number);
    return llvm::formatv(
        "/// The pipeline '{0}', compiled.\n"
        "class {1} : public piko::rt::CompiledPipeline {{\n"
        "public:\n"
        "{2}{3}\n"
        "  {1}() : {1}(piko::rt::Device()) {{}\n"
        "  explicit {1}(piko::rt::Device device)\n"
        "      : piko::rt::CompiledPipeline({4}, pikoBind_, device),\n"
        "        pikoState_(\n"
        "            piko::rt::Member{{piko::rt::CompiledPipeline::get()}) "
        "{{}\n"
        "\n"
        "  State &state() {{ return pikoState_; }\n"
        "  const State &state() const {{ return pikoState_; }\n"
        "\n"
        "  // Sources, for feed().\n"
        "{5}\n"
        "private:\n"
        "  static piko::rt::Status pikoBind_(piko::rt::CompiledPipeline &pipe) "
        "{{\n"
        "    return static_cast<{1} &>(pipe).pikoState_.pikoBind_();\n"
        "  }\n"
        "\n"
        "  State pikoState_;\n"
        "};\n",
        pipeline.getSymName(), className, records.getDefinitions(), state,
        symbol, sources);
  }

  std::string getType(RecordOp record, std::string use) {
    use[0] = llvm::toUpper(use[0]);
    return records.getType(record, use);
  }

  std::string getStateType(mlir::Operation &op, RecordOp record) {
    std::string type = getType(record, makeIdentifier(getCppName(&op)));
    if (auto image = llvm::dyn_cast<ImageOp>(op))
      return llvm::formatv("Image<{0}, {1}>", type, image.getRank());
    StringRef kind = "Constant";
    if (auto buffer = llvm::dyn_cast<BufferOp>(op))
      kind = buffer.getPerSource() ? "Array" : "Buffer";
    return llvm::formatv("{0}<{1}>", kind, type);
  }

  std::string writeState() {
    std::vector<StatePiece> pieces;
    for (mlir::Operation &op : pipeline.getOps())
      if (mlir::FlatSymbolRefAttr record = getHostRecord(&op))
        pieces.push_back(
            {getCppName(&op).str(),
             "piko::rt::" + getStateType(op, lookupRecord(&op, record)),
             llvm::isa<ConstantOp>(op)});
    CppScope names;
    names.reserve("pikoBind_");
    std::string members, constants, initializers;
    for (const StateMemberText &member : makeStateMembers(pieces, names)) {
      initializers +=
          (initializers.empty() ? "\n        : " : ",\n          ") +
          member.name + member.initializer;
      members += member.declaration;
      if (member.isConstant)
        constants += (constants.empty() ? "" : ", ") + member.name;
    }
    std::string state = "  struct State {\n    explicit State(piko::rt::Member";
    state += initializers.empty() ? ")" : " in)" + initializers;
    state += " {}\n";
    state += "    piko::rt::Status pikoBind_() const {\n"
             "      return piko::rt::bindConstants(" +
             constants + ");\n    }\n\n" + members + "  };\n";
    return state;
  }

  PipelineOp pipeline;
  StringRef file, nameSpace;
  std::string symbol, className;
  std::vector<Input> inputs;
  CppScope scope;
  RecordWriter records;
  std::string text;
  llvm::raw_string_ostream out;
};

} // namespace

std::string piko::writeHostHeader(PipelineOp pipeline, StringRef file,
                                  StringRef nameSpace) {
  return HeaderWriter(pipeline, file, nameSpace).write();
}
