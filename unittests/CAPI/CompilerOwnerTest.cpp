// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The C++ owner of the compiler's C interface.

#include "piko-c/compiler.hpp"

#include <pikort/pikort.hpp>

#include <gtest/gtest.h>

namespace {

const char *const text = R"(#include <piko.h>
constexpr int factor = piko::tunable("factor", 3, 5);
struct State { piko::Buffer<int> values; };
struct Set : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) { state().values[i] = factor * i; }
};
struct Table : piko::Pipe<State> {
  Set set;
  Table() { source(set); }
};
)";

TEST(CompilerOwner, LoadsWhatRuns) {
  piko::Program program;
  EXPECT_FALSE(program);
  {
    piko::Compiler compiler;
    ASSERT_EQ(compiler.text("table.piko.cpp", text), PIKO_OK);
    ASSERT_EQ(compiler.option("tunable", "factor=5"), PIKO_OK);
    program = compiler.load();
    ASSERT_TRUE(program) << compiler.diagnostics();
  }
  EXPECT_GT(program.loadMilliseconds(), 0);
  EXPECT_NE(program.codeHash(), 0u);
  piko::rt::Pipeline pipe(*program.get());
  std::vector<int> indices{0, 1, 2}, values(3);
  EXPECT_TRUE(pipe.domain({1, 1}));
  EXPECT_TRUE(pipe.buffer("values", values));
  EXPECT_TRUE(pipe.source(0, indices));
  EXPECT_TRUE(pipe.run());
  EXPECT_EQ(values, (std::vector{0, 5, 10}));
}

TEST(CompilerOwner, ShowsWhatThereIs) {
  piko::Compiler compiler;
  ASSERT_EQ(compiler.text("table.piko.cpp", text), PIKO_OK);
  EXPECT_EQ(compiler.pipelines(), std::vector<std::string>{"Table"});
  auto tunables = compiler.tunables();
  ASSERT_TRUE(tunables && tunables->size() == 1);
  EXPECT_STREQ(tunables->front().name, "factor");
  auto kernels = compiler.emit("kernels");
  ASSERT_TRUE(kernels) << compiler.diagnostics();
  EXPECT_NE(kernels->find("piko.kernel"), std::string::npos);
  auto object = compiler.compile();
  ASSERT_TRUE(object) << compiler.diagnostics();
  EXPECT_STREQ(object->symbol, "pipelines_Table_program");
}

TEST(CompilerOwner, SaysWhatIsWrong) {
  piko::Compiler compiler;
  EXPECT_FALSE(compiler.load());
  EXPECT_EQ(compiler.diagnostics(),
            "error: expected a file or a text to compile\n");
  EXPECT_EQ(compiler.file("none.piko.cpp"), PIKO_OK);
  EXPECT_FALSE(compiler.pipelines());
  EXPECT_FALSE(compiler.tunables());
  EXPECT_FALSE(compiler.emit("kernels"));
  EXPECT_FALSE(compiler.compile());
  EXPECT_NE(compiler.diagnostics().find("none.piko.cpp:1:1: error: "),
            std::string::npos);
  EXPECT_EQ(compiler.option("none", ""), PIKO_INVALID_ARGUMENT);
}

} // namespace
