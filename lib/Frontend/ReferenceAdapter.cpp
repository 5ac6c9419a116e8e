//===- ReferenceAdapter.cpp - The reference executor as a program ---------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The text declares to the runtime what the compiled pipeline would declare,
// so that a host cannot tell the two apart. Its run binds the runtime's memory
// to the pipeline object, runs it, and copies images and allocated buffers
// back.
//
//===----------------------------------------------------------------------===//

#include "Piko/Frontend/Frontend.h"
#include "llvm/ADT/SmallString.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/FileSystem.h"
#include "llvm/Support/raw_ostream.h"

using namespace piko;

namespace {

std::string quote(llvm::StringRef string) {
  std::string quoted = "\"";
  for (char c : string) {
    if (c == '"' || c == '\\')
      quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

constexpr llvm::StringLiteral helpers = R"(
template <class Image> struct Pixel;
template <class T, int Rank> struct Pixel<piko::Image<T, Rank>> {};
template <class T, int Rank> T clearValue(Pixel<piko::Image<T, Rank>>) {
  return T{};
}
template <class T> void load(T &constant, const pikoir_state *s) {
  std::memcpy(static_cast<void *>(&constant), s->data, sizeof(T));
}
template <class T> void bind(piko::Buffer<T> &buffer, const pikoir_state *s) {
  buffer.bind(reinterpret_cast<T *>(s->data), s->extent[0]);
}
template <class T> void save(const piko::Buffer<T> &buffer,
                             const pikoir_state *s) {
  if (buffer.size())
    std::memcpy(s->data, buffer.data(), buffer.size() * sizeof(T));
}
template <class T, int Rank> void save(const piko::Image<T, Rank> &image,
                                       const pikoir_state *s) {
  if (image.size())
    std::memcpy(s->data, static_cast<const void *>(image.data()),
                image.size() * sizeof(T));
}
)";

/// Writes a namespace for one pipeline.
class AdapterWriter {
public:
  AdapterWriter(const PipelineDescription &pipeline, llvm::raw_ostream &out)
      : pipeline(pipeline), out(out) {}

  void write(size_t index) {
    out << "namespace piko_adapter::pipeline" << index << " {\n"
        << "using Pipeline = class ::" << pipeline.typeName << ";\n";
    writeSetup();
    writeRun();
    out << "const pikort_program program = {PIKORT_ABI_VERSION, "
        << quote(pipeline.name) << ", setup, run};\n"
        << "} // namespace piko_adapter::pipeline" << index << "\n";
  }

private:
  void writeSetup() {
    out << "void setup(pikort_pipeline *p) {\n"
        << "  pikoir_declare_pipeline(p, " << quote(pipeline.name) << ", "
        << pipeline.rank << ");\n";
    for (auto [id, record] : llvm::enumerate(pipeline.records)) {
      out << "  pikoir_declare_record(p, " << id << ", " << quote(record.name)
          << ", " << record.size << ", " << record.align << ");\n";
      for (const LeafField &field : record.fields)
        writeField(id, field);
    }
    for (auto [id, state] : llvm::enumerate(pipeline.state))
      writeState(id, state);
    for (auto [id, stage] : llvm::enumerate(pipeline.stages))
      writeStage(id, stage);
    for (auto [index, source] : llvm::enumerate(pipeline.sources))
      out << "  pikoir_declare_source(p, " << index << ", " << source.stage
          << ");\n";
    for (const EdgeDescription &edge : pipeline.edges)
      out << "  pikoir_declare_edge(p, " << edge.producer << ", " << edge.port
          << ", " << edge.consumer << ");\n";
    out << "}\n";
  }

  static llvm::StringRef getTypeName(ScalarType type) {
    switch (type) {
    case ScalarType::F32:
      return "PIKORT_F32";
    case ScalarType::F64:
      return "PIKORT_F64";
    case ScalarType::I8:
      return "PIKORT_I8";
    case ScalarType::I16:
      return "PIKORT_I16";
    case ScalarType::I32:
      return "PIKORT_I32";
    case ScalarType::I64:
      return "PIKORT_I64";
    }
    llvm_unreachable("all scalar types are listed");
  }

  /// A field whose elements are not evenly spaced is declared row by row.
  void writeField(unsigned record, const LeafField &field) {
    int64_t dense = field.counts.empty() ? 0 : field.strides.back();
    bool isEven = true;
    for (size_t d = field.counts.size(); d-- > 0;) {
      isEven &= field.strides[d] == dense;
      dense = field.strides[d] * field.counts[d];
    }
    if (isEven) {
      int64_t stride = field.strides.empty() ? 0 : field.strides.back();
      declareField(record, field.name, field, field.offset,
                   field.getElementCount(), stride);
      return;
    }
    int64_t rows = field.getElementCount() / field.counts.back();
    for (int64_t row = 0; row < rows; ++row) {
      int64_t offset = field.offset, rest = row;
      for (size_t d = field.counts.size() - 1; d-- > 0;) {
        offset += rest % field.counts[d] * field.strides[d];
        rest /= field.counts[d];
      }
      declareField(record, field.name + "[" + std::to_string(row) + "]", field,
                   offset, field.counts.back(), field.strides.back());
    }
  }

  void declareField(unsigned record, llvm::StringRef name,
                    const LeafField &field, int64_t offset, int64_t elements,
                    int64_t stride) {
    out << "  pikoir_declare_field(p, " << record << ", " << quote(name) << ", "
        << getTypeName(field.type) << ", " << offset << ", " << elements << ", "
        << stride << ");\n";
  }

  void writeState(unsigned id, const StateDescription &state) {
    static const char *const kinds[] = {"PIKORT_CONSTANT", "PIKORT_BUFFER",
                                        "PIKORT_IMAGE"};
    bool hasClear = state.kind == StateDescription::Image;
    if (hasClear)
      out << "  const auto clear" << id << " = clearValue(Pixel<"
          << "std::remove_reference_t<decltype(std::declval<Pipeline &>()"
          << ".state()." << state.name << ")>>());\n";
    if (state.hasValue)
      out << "  const auto initial" << id
          << " = std::make_unique<Pipeline>();\n";
    out << "  pikoir_declare_state(p, " << id << ", " << quote(state.name)
        << ", " << kinds[state.kind] << ", " << state.record << ", "
        << state.rank << ", " << state.perSource.value_or(-1) << ", ";
    if (hasClear)
      out << "&clear" << id << ");\n";
    else if (state.hasValue)
      out << "&initial" << id << "->state()." << state.name << ");\n";
    else
      out << "nullptr);\n";
  }

  void writeStage(unsigned id, const StageDescription &stage) {
    static const char *const policies[] = {"PIKOIR_LOAD_BALANCE",
                                           "PIKOIR_DIRECT_MAP",
                                           "PIKOIR_SERIALIZE", "PIKOIR_ALL"};
    const ScheduleDescription &schedule = stage.schedule;
    int flags = 0;
    if (schedule.says("endStage") || schedule.says("endBin") || stage.takesList)
      flags |= 1; // PIKOIR_COLLECTS
    if (stage.takesList)
      flags |= 16; // PIKOIR_LIST
    if (schedule.says("unordered"))
      flags |= 8; // PIKOIR_UNORDERED
    out << "  static const int64_t bins" << id << "[] = {"
        << llvm::join(
               llvm::map_range(stage.bins,
                               [](int64_t n) { return std::to_string(n); }),
               ", ")
        << "};\n"
        << "  pikoir_declare_stage(p, " << id << ", " << quote(stage.name)
        << ", " << stage.input << ", bins" << id << ", "
        << policies[static_cast<int>(schedule.getNumber("kind"))] << ", "
        << schedule.getNumber("tileSplit") << ", " << flags << ", 0);\n";
  }

  void writeRun() {
    out << "int32_t run(pikort_pipeline *p) try {\n"
        << "  auto pipe = std::make_unique<Pipeline>();\n"
        << "  auto &state = pipe->state();\n  (void)state;\n"
        << "  pipe->setDomain(pikoir_domain(p), " << pipeline.rank << ");\n"
        << "  pipe->setLoopLimit(pikoir_loop_limit(p));\n";
    for (auto [id, state] : llvm::enumerate(pipeline.state))
      if (state.kind == StateDescription::Constant)
        out << "  load(state." << state.name << ", pikoir_get_state(p, " << id
            << "));\n";
      else if (state.kind == StateDescription::Buffer && !state.perSource)
        out << "  bind(state." << state.name << ", pikoir_get_state(p, " << id
            << "));\n";
    for (const StateDescription &state : pipeline.state)
      out << "  pipe->nameState(&state." << state.name << ", "
          << quote(state.name) << ");\n";
    for (unsigned i = 0; i < pipeline.sources.size(); ++i)
      out << "  { int64_t count; const void *data = pikoir_get_source(p, " << i
          << ", &count);\n    pipe->template feed<void>(" << i
          << ", data, count); }\n";
    out << "  pipe->run();\n";
    for (auto [id, state] : llvm::enumerate(pipeline.state))
      if (state.kind == StateDescription::Image || state.perSource)
        out << "  save(state." << state.name << ", pikoir_get_state(p, " << id
            << "));\n";
    out << "  return pikoir_status(p);\n"
        << "} catch (const std::bad_alloc &) {\n"
        << "  return pikoir_fail_text(p, PIKORT_OUT_OF_MEMORY, \"out of "
           "memory\");\n"
        << "} catch (const std::exception &error) {\n"
        << "  return pikoir_fail_text(p, PIKORT_BAD_PROGRAM, error.what());\n"
        << "}\n";
  }

  const PipelineDescription &pipeline;
  llvm::raw_ostream &out;
};

} // namespace

std::string
piko::generateReferenceAdapter(llvm::ArrayRef<PipelineDescription> pipelines,
                               llvm::StringRef userFile) {
  // The text is compiled as a file of no folder.
  llvm::SmallString<128> path(userFile);
  llvm::sys::fs::make_absolute(path);
  std::string text;
  llvm::raw_string_ostream out(text);
  out << "#include " << quote(path) << "\n"
      << "#include <pikort/abi.h>\n"
      << "#include <cstring>\n#include <memory>\n#include <new>\n"
      << "#include <utility>\n"
      << "namespace piko_adapter {" << helpers
      << "} // namespace piko_adapter\n";
  for (auto [index, pipeline] : llvm::enumerate(pipelines))
    AdapterWriter(pipeline, out).write(index);
  out << "extern \"C\" const pikort_program *piko_reference_program(int i) {\n"
      << "  static const pikort_program *const programs[] = {";
  for (size_t index = 0; index < pipelines.size(); ++index)
    out << "\n    &piko_adapter::pipeline" << index << "::program,";
  out << "};\n  return programs[i];\n}\n";
  return text;
}
