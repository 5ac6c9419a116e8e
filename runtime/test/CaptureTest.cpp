// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CaptureTest.cpp - What a run takes, written and read ---------------===//

#include "pikort/capture.h"

#include "../../unittests/Support/TemporaryFolder.h"
#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <random>
#include <string>
#include <vector>

using namespace piko::rt;

namespace {

struct Particle {
  float at;
  int32_t kind;
};

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Particles", 2);
  pikoir_declare_record(p, 0, "Particle", sizeof(Particle), 4);
  pikoir_declare_field(p, 0, "at", PIKORT_F32, 0, 1, 0);
  pikoir_declare_field(p, 0, "kind", PIKORT_I32, 4, 1, 0);
  Particle clear{};
  pikoir_declare_state(p, 0, "gravity", PIKORT_CONSTANT, 0, 0, -1, nullptr);
  pikoir_declare_state(p, 1, "cells", PIKORT_BUFFER, 0, 1, -1, nullptr);
  pikoir_declare_state(p, 2, "made", PIKORT_BUFFER, 0, 1, 0, nullptr);
  pikoir_declare_state(p, 3, "picture", PIKORT_IMAGE, 0, 2, -1, &clear);
  int64_t bins[] = {0, 0};
  pikoir_declare_stage(p, 0, "move", 0, bins, PIKOIR_LOAD_BALANCE, 0, 0, 0);
  pikoir_declare_source(p, 0, 0);
}

int32_t run(pikort_pipeline *p) { return pikoir_status(p); }

const pikort_program program = {PIKORT_ABI_VERSION, "Particles", setup, run};

class Captures : public TemporaryFolder {
protected:
  void SetUp() override {
    TemporaryFolder::SetUp();
    ASSERT_TRUE(pipe.created()) << pipe.created().message();
    ASSERT_TRUE(pipe.domain({40, 30}));
    ASSERT_TRUE(pipe.stripSize(7));
    ASSERT_TRUE(pipe.memoryBudget(1 << 20));
    ASSERT_TRUE(pipe.loopLimit(99));
    ASSERT_TRUE(pipe.constant("gravity", Particle{9.5f, 2}));
    ASSERT_TRUE(pipe.buffer("cells", cells));
    ASSERT_TRUE(pipe.source(0, source));
  }
  std::string content() {
    Status status = pipe.capture(pathOf("a.capture"));
    EXPECT_TRUE(status) << status.message();
    std::ifstream file(pathOf("a.capture"), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  /// With a sum that is right again.
  static std::string sealed(std::string text) {
    uint64_t sum = captureSum(text);
    text.append(reinterpret_cast<const char *>(&sum), sizeof(sum));
    return text;
  }

  Pipeline pipe{program};
  std::vector<Particle> cells{{1, 2}, {3, 4}, {5, 6}};
  std::vector<Particle> source{{7, 8}, {9, 10}};
};

TEST_F(Captures, HoldWhatARunTakes) {
  Capture capture;
  ASSERT_EQ(capture.read(content()), "");
  EXPECT_EQ(capture.pipeline, "Particles");
  EXPECT_EQ(capture.rank, 2);
  EXPECT_EQ(capture.domain[0], 40);
  EXPECT_EQ(capture.domain[1], 30);
  EXPECT_EQ(capture.stripSize, 7);
  EXPECT_EQ(capture.memoryBudget, 1 << 20);
  EXPECT_EQ(capture.loopLimit, 99);
  ASSERT_EQ(capture.states.size(), 2u); // no image, and nothing a source sizes
  EXPECT_EQ(capture.states[0].name, "gravity");
  EXPECT_EQ(capture.states[1].name, "cells");
  ASSERT_EQ(capture.states[1].count, 3);
  EXPECT_EQ(std::memcmp(capture.states[1].data(), cells.data(), 24), 0);
  ASSERT_EQ(capture.states[1].layout.fields.size(), 2u);
  EXPECT_EQ(capture.states[1].layout.fields[1].name, "kind");
  ASSERT_EQ(capture.sources.size(), 1u);
  ASSERT_EQ(capture.sources[0].count, 2);
  EXPECT_EQ(std::memcmp(capture.sources[0].data(), source.data(), 16), 0);
}

TEST_F(Captures, AreBoundAndGiveTheSame) {
  std::string first = content();
  Capture capture;
  ASSERT_EQ(capture.read(first), "");
  pipe = Pipeline(program);
  ASSERT_EQ(capture.bind(pipe.get()), "");
  EXPECT_TRUE(pipe.run());
  EXPECT_EQ(content(), first);
}

TEST_F(Captures, SayWhatDoesNotFit) {
  Capture whole;
  ASSERT_EQ(whole.read(content()), "");
  auto bind = [&](auto change) {
    Capture capture = whole;
    change(capture);
    return capture.bind(pipe.get());
  };
  EXPECT_EQ(bind([](Capture &c) { c.rank = 3; }),
            "expected a domain of rank 2, but the capture has 3");
  EXPECT_EQ(bind([](Capture &c) { c.sources.clear(); }),
            "expected 1 sources, but the capture has 0");
  EXPECT_EQ(bind([](Capture &c) { c.states[1].kind = PIKORT_CONSTANT; }),
            "'cells': expected a buffer, but the capture has another kind of "
            "state");
  EXPECT_EQ(bind([](Capture &c) { c.states[1].layout.fields.pop_back(); }),
            "'cells': expected records of 2 fields, but the capture has 1");
  EXPECT_EQ(bind([](Capture &c) { c.states[0].layout.fields[0].type = 1; }),
            "'gravity': expected field 'at' at 0, but the capture has 'at' at "
            "0 of another type");
  EXPECT_EQ(bind([](Capture &c) { c.sources[0].layout.size = 12; }),
            "source 0: expected records of 8 bytes, but the capture has 12");
  EXPECT_EQ(
      bind([](Capture &c) { c.domain[1] = 0; }),
      "pipeline 'Particles': expected domain extents in [1, 1073741824], but "
      "got 0 in dimension 1");
}

TEST_F(Captures, NeedARunThatCouldBe) {
  Pipeline fresh(program);
  EXPECT_EQ(fresh.capture(pathOf("b.capture")).code(), PIKORT_UNBOUND);
  EXPECT_EQ(pipe.capture(pathOf("none/b.capture")).code(), PIKORT_NOT_WRITTEN);
  EXPECT_EQ(pikort_capture(pipe.get(), nullptr), PIKORT_INVALID_ARGUMENT);
  EXPECT_TRUE(pipe.run());
}

TEST_F(Captures, ThatAreCutOffOrChangedAreErrors) {
  std::string whole = content();
  for (size_t size = 0; size < whole.size(); ++size) {
    EXPECT_NE(Capture().read(whole.substr(0, size)), "") << size;
    if (size + 8 < whole.size()) // so that the reader itself has to see it
      EXPECT_NE(Capture().read(sealed(whole.substr(0, size))), "") << size;
  }
  std::string text = whole.substr(0, whole.size() - 8);
  std::mt19937 random;
  for (int i = 0; i < 20000; ++i) {
    std::string changed = text;
    for (int k = random() % 3; k >= 0; --k)
      changed[captureMagic.size() + random() % (text.size() - 16)] =
          char(random() % 4 ? random() % 8 : random());
    Capture capture;
    if (capture.read(sealed(changed)).empty())
      (void)capture.bind(pipe.get());
  }
}

} // namespace
