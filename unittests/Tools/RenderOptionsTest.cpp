//===- RenderOptionsTest.cpp - The command line of piko-render ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Options.h"

#include <gtest/gtest.h>

using namespace piko;
using namespace piko::render;

namespace {

std::string errorOf(std::vector<std::string> words) {
  auto options = parseOptions(words);
  return options ? "no error" : options.error().message;
}

TEST(RenderOptions, AllOfThem) {
  auto o = parseOptions(
      {"--pipe",    "Binned",   "a.piko.cpp", "--width",   "320",
       "--height",  "200",      "--lights",   "7",         "--eye",
       "1",         "-2",       "3e1",        "--at",      "0",
       "0.5",       "0",        "--fovy",     "60",        "--cull",
       "--ground",  "--target", "reference",  "--threads", "2",
       "--warmup",  "0",        "--frames",   "4",         "--seconds",
       "2.5",       "--out",    "o.exr",      "--json",    "-I",
       "inc",       "-Iother",  "-DX=1",      "-D",        "Y",
       "scene.obj", "--set",    "depth=3",    "--set",     "text=a=b",
       "--without", "prune",    "--counters", "-O1"});
  ASSERT_TRUE(o) << o.error().message;
  EXPECT_EQ(o->pipeline, "a.piko.cpp");
  EXPECT_EQ(o->scene, "scene.obj");
  EXPECT_EQ(o->load.pipeName, "Binned");
  EXPECT_EQ(o->load.target, ExecutionTarget::Reference);
  EXPECT_EQ(o->load.optLevel, 1);
  EXPECT_EQ(o->load.includeDirs, (std::vector<std::string>{"inc", "other"}));
  EXPECT_EQ(o->load.defines, (std::vector<std::string>{"X=1", "Y"}));
  EXPECT_EQ(o->view.width, 320);
  EXPECT_EQ(o->view.height, 200);
  EXPECT_EQ(o->view.fovy, 60);
  EXPECT_EQ(*o->view.eye, glm::vec3(1, -2, 30));
  EXPECT_EQ(*o->view.at, glm::vec3(0, 0.5f, 0));
  EXPECT_EQ(o->lights, 7);
  EXPECT_TRUE(o->cull && o->ground && o->json && o->help.empty());
  EXPECT_TRUE(o->counters && !o->explain);
  EXPECT_EQ(o->threads, 2);
  EXPECT_EQ(o->warmup, 0);
  EXPECT_EQ(o->frames, 4);
  EXPECT_EQ(o->seconds, 2.5);
  EXPECT_EQ(o->images, std::vector<std::string>{"o.exr"});
  ASSERT_EQ(o->values.size(), 2u);
  EXPECT_EQ(o->values[0], (std::pair<std::string, std::string>("depth", "3")));
  EXPECT_EQ(o->values[1], (std::pair<std::string, std::string>("text", "a=b")));
}

TEST(RenderOptions, PlanesOfDepth) {
  auto o = parseOptions({"a.piko.cpp", "b.obj", "--near", "0.5", "--far", "3"});
  ASSERT_TRUE(o) << o.error().message;
  EXPECT_EQ(o->view.nearZ, 0.5f);
  EXPECT_EQ(o->view.farZ, 3.0f);
  for (const char *wrong : {"0", "-1", "1e-60", "1e60"})
    for (const char *name : {"--near", "--far"})
      EXPECT_EQ(errorOf({"a.piko.cpp", "b.obj", name, wrong}),
                name + std::string(": expected a distance above 0 that a float "
                                   "holds"));
  EXPECT_EQ(errorOf({"a.piko.cpp", "b.obj", "--near", "nan"}),
            "--near: expected a finite number");
  EXPECT_EQ(errorOf({"a.piko.cpp", "b.obj", "--near", "2", "--far", "2"}),
            "--far: expected a distance above that of --near");
}

TEST(RenderOptions, HelpNeedsNothingElse) {
  auto o = parseOptions({"--help"});
  ASSERT_TRUE(o);
  EXPECT_FALSE(o->help.empty());
}

TEST(RenderOptions, Explain) {
  auto o = parseOptions({"a", "b", "--explain"});
  ASSERT_TRUE(o);
  EXPECT_TRUE(o->explain);
  EXPECT_EQ(errorOf({"a", "b", "--explain", "--target", "reference"}),
            "--explain is for pipelines that are compiled: nothing is measured "
            "of --target reference");
}

TEST(RenderOptions, Level) {
  EXPECT_EQ(parseOptions({"a", "b"})->load.optLevel, 3);
  EXPECT_EQ(parseOptions({"a", "b", "-O0"})->load.optLevel, 0);
  for (const char *bad : {"-O4", "-Os", "-O12"})
    EXPECT_EQ(errorOf({"a", "b", bad}),
              std::string("expected -O0 to -O3, but got ") + bad);
  EXPECT_EQ(errorOf({"a", "b", "-O"}), "option '-O' lacks its value");
}

// Neither --fix nor --without takes back what the other one says.
TEST(RenderOptions, Fix) {
  auto o = parseOptions({"a", "b", "--fix", "all,depth=3", "--without", "prune",
                         "--fix", "lights.size"});
  ASSERT_TRUE(o) << o.error().message;
  EXPECT_EQ(o->fix,
            (std::vector<std::string>{"all", "depth=3", "lights.size"}));
  EXPECT_EQ(o->load.synthesis.without, std::vector<std::string>{"prune"});
  for (const char *wrong : {"", ",", "a,", "a,,b"})
    EXPECT_EQ(errorOf({"a", "b", "--fix", wrong}),
              std::string("--fix: expected names with commas between them, but "
                          "got '") +
                  wrong + "'");
  EXPECT_EQ(errorOf({"a", "b", "--fix", "all", "--target", "reference"}),
            "--fix is for pipelines that are compiled, and does nothing with "
            "--target reference");
}

TEST(RenderOptions, Check) {
  auto o = parseOptions({"a", "b"});
  ASSERT_TRUE(o);
  EXPECT_FALSE(o->load.check.enabled);
  o = parseOptions({"a", "b", "--check"});
  ASSERT_TRUE(o);
  EXPECT_TRUE(o->load.check.enabled);
  EXPECT_TRUE(o->load.check.numbers.empty());
  o = parseOptions({"a", "b", "--check=nan:F.z,F.at.x"});
  ASSERT_TRUE(o);
  EXPECT_EQ(o->load.check.numbers, (std::vector<std::string>{"F.z", "F.at.x"}));
  for (const char *bad :
       {"--check=inf:F.z", "--check=nan:", "--check=nan:F", "--check=nan:.z",
        "--check=nan:F.", "--check=nan:F.z,"})
    EXPECT_FALSE(parseOptions({"a", "b", bad})) << bad;
}

TEST(RenderOptions, Errors) {
  EXPECT_EQ(errorOf({"a", "b", "--nope"}),
            "unknown option '--nope'; see --help");
  EXPECT_EQ(errorOf({"a", "b", "-x"}), "unknown option '-x'; see --help");
  EXPECT_EQ(errorOf({"a", "b", "c"}), "unexpected argument 'c'");
  EXPECT_EQ(errorOf({"a"}), "expected a pipeline file and a scene file");
  EXPECT_EQ(errorOf({"a", "b", "--width"}), "option '--width' lacks its value");
  EXPECT_EQ(errorOf({"a", "b", "--width", "12x"}),
            "--width: expected a whole number, but got '12x'");
  EXPECT_EQ(errorOf({"a", "b", "--height", "0"}),
            "--height: expected a number from 1 to 65536, but got 0");
  EXPECT_EQ(errorOf({"a", "b", "--eye", "1", "2"}),
            "option '--eye' lacks its value");
  EXPECT_EQ(errorOf({"a", "b", "--fovy", "nan"}),
            "--fovy: expected a finite number");
  EXPECT_EQ(errorOf({"a", "b", "--fovy", "180"}),
            "--fovy: expected an angle between 0 and 180 degrees");
  for (const char *bad : {"depth", "=3"})
    EXPECT_EQ(errorOf({"a", "b", "--set", bad}),
              "--set: expected NAME=VALUE, but got '" + std::string(bad) + "'");
  EXPECT_EQ(errorOf({"a", "b", "--target", "gpu"}),
            "--target: expected cpu, cuda, auto, gpu-on-cpu or reference, but "
            "got 'gpu'");
}

} // namespace
