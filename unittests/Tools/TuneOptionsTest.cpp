//===- TuneOptionsTest.cpp - The command line of piko-tune ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "TuneOptions.h"

#include <gtest/gtest.h>

using namespace piko;
using namespace piko::tune;

namespace {

TEST(TuneOptions, ItsOwnAndThoseOfTheScene) {
  auto o = parseTuneOptions({"--pipe",
                             "A,B",
                             "a.piko.cpp",
                             "--eye",
                             "1",
                             "-2",
                             "3e1",
                             "s.obj",
                             "--error",
                             "2/256",
                             "--json",
                             "-I",
                             "inc",
                             "-DX=1",
                             "--lights",
                             "7",
                             "--cull",
                             "--metric",
                             "p99",
                             "--space",
                             "passes,strips",
                             "--budget",
                             "50",
                             "--threads",
                             "1",
                             "--exhaustive",
                             "--out",
                             "o.json",
                             "--set",
                             "a=b"});
  ASSERT_TRUE(o) << o.error().message;
  EXPECT_EQ(o->pipes, (std::vector<std::string>{"A", "B"}));
  EXPECT_EQ(o->render.pipeline, "a.piko.cpp");
  EXPECT_EQ(o->render.scene, "s.obj");
  EXPECT_EQ(*o->render.view.eye, glm::vec3(1, -2, 30));
  EXPECT_EQ(o->render.load.includeDirs, std::vector<std::string>{"inc"});
  EXPECT_EQ(o->render.load.defines, std::vector<std::string>{"X=1"});
  EXPECT_EQ(o->render.lights, 7);
  EXPECT_EQ(o->render.threads, 1);
  EXPECT_TRUE(o->render.cull && o->json && o->exhaustive);
  EXPECT_EQ(o->error, 2.0 / 256);
  EXPECT_EQ(o->errorText, "2/256");
  EXPECT_EQ(o->metric, Metric::P99);
  EXPECT_EQ(o->space, (std::set<std::string>{"passes", "strips"}));
  EXPECT_EQ(o->budget, 50);
  EXPECT_EQ(o->out, "o.json");
}

TEST(TuneOptions, Standard) {
  auto o = parseTuneOptions({"a.piko.cpp", "s.obj"});
  ASSERT_TRUE(o);
  EXPECT_EQ(o->error, 1.0 / 255);
  EXPECT_EQ(o->metric, Metric::Max);
  EXPECT_FALSE(o->space.contains("strips"));
  EXPECT_TRUE(o->space.contains("numbers"));
  EXPECT_FALSE(parseTuneOptions({"--help"})->help.empty());
}

} // namespace
