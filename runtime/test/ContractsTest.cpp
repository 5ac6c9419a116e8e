// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ContractsTest.cpp - Numbers of the host's that are indices ---------===//

#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <gtest/gtest.h>

#include <span>
#include <string>
#include <vector>

using piko::rt::Pipeline;
using piko::rt::Status;

namespace {

struct Triangle {
  int32_t vertex[3];
  uint8_t kind, other;
};
struct Vertex {
  float x;
  uint16_t material;
  int64_t next;
};

enum : int32_t { Vertices, Order, Shine, Sized };
enum Records : int32_t { TriangleRecord, VertexRecord, Index, Float };

// Source 0 indexes vertices, its kinds are below 200; source 1 indexes what is
// as long as source 0; vertices index shines and themselves; order, vertices.
void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Meshes", 1);
  pikoir_declare_record(p, TriangleRecord, "Triangle", sizeof(Triangle), 4);
  pikoir_declare_record(p, VertexRecord, "Vertex", sizeof(Vertex), 8);
  pikoir_declare_record(p, Index, "int", 4, 4);
  pikoir_declare_record(p, Float, "float", 4, 4);
  auto buffer = [&](int32_t id, const char *name, int32_t record,
                    int32_t source) {
    pikoir_declare_state(p, id, name, PIKORT_BUFFER, record, 1, source,
                         nullptr);
  };
  buffer(Vertices, "vertices", VertexRecord, -1);
  buffer(Order, "order", Index, -1);
  buffer(Shine, "shine", Float, -1);
  buffer(Sized, "sized", Float, 0);
  int64_t bins[] = {0};
  pikoir_declare_stage(p, 0, "draw", TriangleRecord, bins, PIKOIR_LOAD_BALANCE,
                       0, 0, 1);
  pikoir_declare_stage(p, 1, "look", Index, bins, PIKOIR_LOAD_BALANCE, 0, 0, 1);
  pikoir_declare_source(p, 0, 0);
  pikoir_declare_source(p, 1, 1);
  pikoir_declare_contract(p, 0, -1, "vertex", PIKORT_I32, 0, 0, 3, 4, Vertices,
                          0);
  pikoir_declare_contract(p, 0, -1, "kind", PIKORT_I8, 1, 12, 1, 0, -1, 200);
  pikoir_declare_contract(p, 0, -1, "other", PIKORT_I8, 0, 13, 1, 0, -1, 200);
  pikoir_declare_contract(p, 1, -1, "value", PIKORT_I32, 0, 0, 1, 0, Sized, 0);
  pikoir_declare_contract(p, -1, Vertices, "material", PIKORT_I16, 1,
                          offsetof(Vertex, material), 1, 0, Shine, 0);
  pikoir_declare_contract(p, -1, Vertices, "next", PIKORT_I64, 0,
                          offsetof(Vertex, next), 1, 0, Vertices, 0);
  pikoir_declare_contract(p, -1, Order, "value", PIKORT_I32, 0, 0, 1, 0,
                          Vertices, 0);
}

int64_t ran = 0, first = -1;

/// A kernel may read the first element of what is indexed in any case.
int32_t run(pikort_pipeline *p) {
  ++ran;
  auto read = [&](int32_t state) {
    return pikoir_get_state(p, state)->data[0];
  };
  first = read(Vertices) + read(Shine) + read(Sized);
  return PIKORT_OK;
}

const pikort_program program{PIKORT_ABI_VERSION, "Meshes", setup, run};

struct Contracts : testing::Test {
  Contracts() {
    EXPECT_TRUE(pipe.created()) << pipe.created().message();
    EXPECT_TRUE(pipe.domain({1}));
    bindAll();
    ran = 0;
  }
  void bindAll() {
    EXPECT_TRUE(pipe.buffer("vertices", vertices));
    EXPECT_TRUE(pipe.buffer("order", order));
    EXPECT_TRUE(pipe.buffer("shine", shine));
    EXPECT_TRUE(pipe.source(0, triangles));
    EXPECT_TRUE(pipe.source(1, looks));
  }
  /// Without a kernel.
  void expectRefused(const std::string &message) {
    int64_t before = ran;
    Status status = pipe.run();
    EXPECT_EQ(status.code(), PIKORT_INDEX_OUTSIDE);
    EXPECT_EQ(std::string(status.message()), message);
    EXPECT_EQ(ran, before);
  }
  void expectRuns() {
    Status status = pipe.run();
    EXPECT_TRUE(status) << status.message();
  }
  std::vector<Vertex> vertices = std::vector<Vertex>(4);
  std::vector<int32_t> order{3, 0, 1}, looks{1, 0};
  std::vector<float> shine{1, 2};
  std::vector<Triangle> triangles{{{0, 1, 2}, 199, 0}, {{3, 3, 3}, 0, 1}};
  Pipeline pipe{program};
};

TEST_F(Contracts, HoldOfWhatIsBound) { expectRuns(); }

TEST_F(Contracts, NameTheFirstNumberThatBreaksOne) {
  triangles[1].vertex[2] = 4;
  ASSERT_TRUE(pipe.source(0, triangles));
  std::string of = "stage 'draw': expected field ";
  expectRefused(of + "'vertex[2]' of primitive 1 of source 0 to be an index "
                     "into 'vertices', in [0, 4), but got 4");
  triangles[1].vertex[2] = 0;
  triangles[0].vertex[1] = -2;
  ASSERT_TRUE(pipe.source(0, triangles));
  expectRefused(of + "'vertex[1]' of primitive 0 of source 0 to be an index "
                     "into 'vertices', in [0, 4), but got -2");
  triangles[0].vertex[1] = 0;
  triangles[1].kind = 200;
  ASSERT_TRUE(pipe.source(0, triangles));
  expectRefused(of + "'kind' of primitive 1 of source 0 in [0, 200), but got "
                     "200");
  triangles[1].kind = 0;
  // With a sign it has at most 127.
  triangles[1].other = 150;
  ASSERT_TRUE(pipe.source(0, triangles));
  expectRefused(of + "'other' of primitive 1 of source 0 in [0, 200), but got "
                     "-106");
  triangles[1].other = 127;
  ASSERT_TRUE(pipe.source(0, triangles));
  expectRuns();
  order[2] = INT32_MIN;
  ASSERT_TRUE(pipe.buffer("order", order));
  expectRefused("buffer 'order': expected element 2 to be an index into "
                "'vertices', in [0, 4), but got -2147483648");
  order[2] = 0;
  ASSERT_TRUE(pipe.buffer("order", order));
  vertices[3].material = 65535;
  vertices[3].next = INT64_MIN;
  ASSERT_TRUE(pipe.buffer("vertices", vertices));
  expectRefused("buffer 'vertices': expected field 'material' of element 3 to "
                "be an index into 'shine', in [0, 2), but got 65535");
  vertices[3].material = 1;
  ASSERT_TRUE(pipe.buffer("vertices", vertices));
  expectRefused("buffer 'vertices': expected field 'next' of element 3 to be "
                "an index into 'vertices', in [0, 4), but got "
                "-9223372036854775808");
}

TEST_F(Contracts, AreTestedAgainWhenSomethingElseIsBound) {
  expectRuns();
  ASSERT_TRUE(pipe.buffer("vertices", std::span(vertices).first(3)));
  expectRefused("stage 'draw': expected field 'vertex[0]' of primitive 1 of "
                "source 0 to be an index into 'vertices', in [0, 3), but got "
                "3");
  ASSERT_TRUE(pipe.buffer("vertices", vertices));
  expectRuns();
  ASSERT_TRUE(pipe.source(0, std::span<const Triangle>(triangles).first(1)));
  expectRefused("stage 'look': expected primitive 0 of source 1 to be an index "
                "into 'sized', in [0, 1), but got 1");
  ASSERT_TRUE(pipe.source(0, triangles));
  expectRuns();
  // In place the host promises it, ...
  triangles[0].vertex[0] = 9;
  expectRuns();
  // ... until it says whether its memory stays as it is.
  ASSERT_TRUE(pipe.staticInput(true));
  EXPECT_EQ(pipe.run().code(), PIKORT_INDEX_OUTSIDE);
  triangles[0].vertex[0] = 0;
  ASSERT_TRUE(pipe.source(0, triangles));
  expectRuns();
}

TEST_F(Contracts, AreTestedAgainWhereTheHostWritesThroughAView) {
  ASSERT_TRUE(pipe.allocate("order", 2));
  expectRuns();
  pipe.view<int32_t>("order").elements[1] = 4;
  expectRefused("buffer 'order': expected element 1 to be an index into "
                "'vertices', in [0, 4), but got 4");
}

TEST_F(Contracts, LetTheFirstElementBeReadWhereThereIsNone) {
  order.clear();
  shine.clear();
  vertices.clear();
  triangles.clear();
  looks.clear();
  bindAll();
  expectRuns();
  EXPECT_EQ(first, 0);
  EXPECT_EQ(pipe.view<Vertex>("vertices").elements.size(), 0u);
  ASSERT_TRUE(pipe.allocate("vertices", 0));
  expectRuns();
  triangles.resize(1);
  ASSERT_TRUE(pipe.source(0, triangles));
  expectRefused("stage 'draw': expected field 'vertex[0]' of primitive 0 of "
                "source 0 to be an index into 'vertices', in [0, 0), but got "
                "0");
}

TEST(ContractDeclarations, MakeSense) {
  static int32_t source, state, type, target;
  static int64_t below;
  const pikort_program wrong{PIKORT_ABI_VERSION, "Wrong",
                             [](pikort_pipeline *p) {
                               setup(p);
                               pikoir_declare_contract(p, source, state, "f",
                                                       type, 0, 0, 1, 0, target,
                                                       below);
                             },
                             run};
  auto expectRefused = [&](const char *part) {
    Pipeline pipe(wrong);
    EXPECT_EQ(pipe.created().code(), PIKORT_BAD_PROGRAM);
    EXPECT_NE(pipe.created().message().find(part), std::string::npos)
        << pipe.created().message();
  };
  source = 2, state = -1, type = PIKORT_I32, target = Vertices, below = 0;
  expectRefused("expected a declared source, but got 2");
  source = -1, state = 9;
  expectRefused("expected the number of a buffer, but got 9");
  state = Order, target = 9;
  expectRefused("expected the number of a buffer, but got 9");
  target = -1;
  expectRefused("expected to be below at least 1, but got 0");
  below = 1, type = PIKORT_F32;
  expectRefused("expected integers");
}

} // namespace
