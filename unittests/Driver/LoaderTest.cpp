// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Pipelines that an application compiles while it runs. It is built without
// LLVM's headers, as such an application is.

#include "../Support/TemporaryFolder.h"

#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Driver/PipelineLoader.h"

#include <pikort/pikort.hpp>

#include <algorithm>
#include <thread>
#include <vector>

using namespace piko;
namespace fs = std::filesystem;

namespace {

const char *const text = R"(#include FACTOR_HEADER
#include <piko.h>
struct State {
  int offset;
  piko::Buffer<int> values;
};
struct Set : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) {
    state().values[i] = FACTOR * i + state().offset;
  }
};
struct Table : piko::Pipe<State> {
  Set set;
  Table() { source(set); }
};
)";

class Loader : public TemporaryFolder {
protected:
  void SetUp() override {
    TemporaryFolder::SetUp();
    options.cache.directory = folder / "cache";
    options.defines = {"FACTOR_HEADER=\"factor.h\""};
    options.includeDirs = {folder.string()};
    write("factor.h", "#define FACTOR 3\n");
  }

  /// What the loaded pipeline writes for 0, 1, 2 with offset 100.
  static std::vector<int> runTable(const LoadedProgram &program) {
    rt::Pipeline pipe(program.get());
    std::vector<int> indices{0, 1, 2}, values(3);
    EXPECT_TRUE(pipe.domain({1, 1}));
    EXPECT_TRUE(pipe.constant("offset", 100));
    EXPECT_TRUE(pipe.buffer("values", values));
    EXPECT_TRUE(pipe.source(0, indices));
    rt::Status status = pipe.run();
    EXPECT_TRUE(status) << status.message();
    return values;
  }

  std::unique_ptr<LoadedProgram> loadText(const std::string &content) {
    return loadPipelineText("table.piko.cpp", content, options, diagnostics);
  }

  size_t countEntries() const {
    if (!fs::exists(folder / "cache"))
      return 0;
    return std::ranges::count_if(
        fs::directory_iterator(folder / "cache"), [](const auto &entry) {
          return entry.path().filename().string().starts_with("llvmcache-");
        });
  }

  LoadOptions options;
  std::string diagnostics;
};

TEST_F(Loader, LoadsText) {
  auto program = loadText(text);
  ASSERT_TRUE(program) << diagnostics;
  EXPECT_EQ(diagnostics, "");
  EXPECT_STREQ(program->get().name, "Table");
  EXPECT_EQ(runTable(*program), (std::vector{100, 103, 106}));
}

TEST_F(Loader, LoadsAFile) {
  write("table.piko.cpp", text);
  auto program = loadPipeline(folder / "table.piko.cpp", options, diagnostics);
  ASSERT_TRUE(program) << diagnostics;
  EXPECT_EQ(runTable(*program), (std::vector{100, 103, 106}));
}

TEST_F(Loader, LoadsTheReferenceOfText) {
  options.target = ExecutionTarget::Reference;
  for (int pass = 0; pass < 2; ++pass) { // the second from the cache
    auto program = loadText(text);
    ASSERT_TRUE(program) << diagnostics;
    EXPECT_EQ(runTable(*program), (std::vector{100, 103, 106}));
    // Its object, and the texts that the frontend makes of it; piko.h's code.
    EXPECT_EQ(countEntries(), 4u);
  }
}

// The reference executor needs them; a phase cannot have any.
TEST_F(Loader, EachThreadHasItsThreadLocalVariables) {
  write("factor.h", "#ifdef __PIKO__\n"
                    "#define FACTOR 0\n"
                    "#else\n"
                    "inline thread_local int factor = 3;\n"
                    "#define FACTOR factor++\n"
                    "#endif\n");
  options.target = ExecutionTarget::Reference;
  options.optLevel = 0;
  auto program = loadText(text);
  ASSERT_TRUE(program) << diagnostics;
  for (int i = 0; i < 2; ++i)
    std::thread([&] {
      EXPECT_EQ(runTable(*program), (std::vector{100, 104, 110}));
    }).join();
}

TEST_F(Loader, FindsTheSameTextInTheCache) {
  ASSERT_TRUE(loadText(text)) << diagnostics;
  // The object and what the text means, and what leads to each.
  EXPECT_EQ(countEntries(), 4u);
  auto program = loadText(text);
  ASSERT_TRUE(program) << diagnostics;
  EXPECT_EQ(countEntries(), 4u);
  EXPECT_EQ(runTable(*program), (std::vector{100, 103, 106}));
}

TEST_F(Loader, SeesThatAHeaderChanged) {
  ASSERT_TRUE(loadText(text)) << diagnostics;
  write("factor.h", "#define FACTOR 5\n");
  auto program = loadText(text);
  ASSERT_TRUE(program) << diagnostics;
  EXPECT_EQ(runTable(*program), (std::vector{100, 105, 110}));
}

TEST_F(Loader, SeesThatTheTextChanged) {
  ASSERT_TRUE(loadText(text)) << diagnostics;
  auto program = loadText(std::string(text) + "// more\n");
  ASSERT_TRUE(program) << diagnostics;
  // The name alone leads to what the text means.
  EXPECT_EQ(countEntries(), 7u);
}

TEST_F(Loader, KeepsNothingIfTold) {
  options.cache.enabled = false;
  ASSERT_TRUE(loadText(text)) << diagnostics;
  EXPECT_EQ(countEntries(), 0u);
}

TEST_F(Loader, ProgramsAreIndependent) {
  auto three = loadText(text);
  ASSERT_TRUE(three) << diagnostics;
  write("factor.h", "#define FACTOR 7\n");
  auto seven = loadText(text);
  ASSERT_TRUE(seven) << diagnostics;
  EXPECT_EQ(runTable(*three), (std::vector{100, 103, 106}));
  EXPECT_EQ(runTable(*seven), (std::vector{100, 107, 114}));
  three.reset();
  EXPECT_EQ(runTable(*seven), (std::vector{100, 107, 114}));
}

TEST_F(Loader, SaysWhereTheTextIsWrong) {
  EXPECT_FALSE(loadText(
      "#define MINE\n#include <piko.h>\nstruct A : piko::Pipe<> { int }\n"));
  EXPECT_NE(diagnostics.find("table.piko.cpp:3:"), std::string::npos)
      << diagnostics;
  EXPECT_NE(diagnostics.find("struct A : piko::Pipe<> { int }"),
            std::string::npos)
      << diagnostics;
  EXPECT_EQ(countEntries(), 0u);
}

TEST_F(Loader, SaysWhatFileIsMissing) {
  EXPECT_FALSE(loadPipeline(folder / "none.cpp", options, diagnostics));
  EXPECT_NE(diagnostics.find("none.cpp:1:1: error: cannot open the file"),
            std::string::npos)
      << diagnostics;
}

TEST_F(Loader, CompilesTextToAnObject) {
  ObjectOptions request;
  request.source = {.file = "table.piko.cpp",
                    .includeDirs = options.includeDirs,
                    .defines = options.defines,
                    .text = text};
  request.source.cache = options.cache;
  auto object = compileObject(request, diagnostics);
  ASSERT_TRUE(object) << diagnostics;
  EXPECT_EQ(object->pipelines, std::vector<std::string>{"Table"});
  EXPECT_EQ(object->symbol, "pipelines_Table_program");
  EXPECT_EQ(object->code.substr(0, 4), "\x7f"
                                       "ELF");
  EXPECT_NE(object->header.find("class Table"), std::string::npos);
  EXPECT_TRUE(
      std::ranges::count(object->files, (folder / "factor.h").string()));
}

TEST_F(Loader, CompilesAllPipelinesForTheReference) {
  ObjectOptions request;
  request.source = {.file = "table.piko.cpp",
                    .includeDirs = options.includeDirs,
                    .defines = options.defines,
                    .text = std::string(text) +
                            "void unknown();\n"
                            "struct Call : piko::Stage<0, 0, 64, int> {\n"
                            "  void process(const int &) { unknown(); }\n"
                            "};\n"
                            "struct Lost : piko::Pipe<State> {\n"
                            "  Call call;\n"
                            "  Lost() { source(call); }\n"
                            "};\n"
                            "struct More : piko::Pipe<State> {\n"
                            "  Set set;\n"
                            "  More() { source(set); }\n"
                            "};\n"};
  request.execution = ExecutionTarget::Reference;
  request.target = {.cpu = "native", .optLevel = 0};
  request.source.cache = options.cache;
  EXPECT_FALSE(compileObject(request, diagnostics)); // which one?
  request.allPipelines = true;
  std::string code;
  for (int pass = 0; pass < 2; ++pass) { // the second from the cache
    auto object = compileObject(request, diagnostics = "");
    ASSERT_TRUE(object) << diagnostics;
    EXPECT_EQ(object->pipelines, (std::vector<std::string>{"Table", "More"}));
    EXPECT_NE(diagnostics.find("table.piko.cpp:18:"), std::string::npos)
        << diagnostics;
    EXPECT_EQ(countEntries(), 4u); // what it says, and its object
    EXPECT_TRUE(pass == 0 || code == object->code);
    code = object->code;
  }
}

TEST_F(Loader, RefusesAnUnknownProcessor) {
  ObjectOptions request;
  request.source = {.file = "table.piko.cpp", .text = text};
  request.target.cpu = "nope";
  EXPECT_FALSE(compileObject(request, diagnostics));
  EXPECT_TRUE(diagnostics.starts_with("error: there is no processor 'nope'"))
      << diagnostics;
}

} // namespace
