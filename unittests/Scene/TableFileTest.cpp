//===- TableFileTest.cpp - Tables of primitives, and broken ones ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "../Support/TemporaryFolder.h"

#include "Piko/Scene/TableFile.h"

#include <pikort/abi.h>

#include <cmath>

using namespace piko::render;

namespace {

struct Spot {
  float x;
  double weight;
  int8_t kind;
  uint16_t group;
  int32_t id[2];
  uint64_t seed;
};

void declareSpots(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Test", 2);
  pikoir_declare_record(p, 0, "Spot", sizeof(Spot), alignof(Spot));
  auto declare = [&](const char *name, int32_t type, size_t offset,
                     int64_t elements = 1) {
    pikoir_declare_field(p, 0, name, type, int64_t(offset), elements, 4);
  };
  declare("x", PIKORT_F32, offsetof(Spot, x));
  declare("weight", PIKORT_F64, offsetof(Spot, weight));
  declare("kind", PIKORT_I8, offsetof(Spot, kind));
  declare("group", PIKORT_I16, offsetof(Spot, group));
  declare("id", PIKORT_I32, offsetof(Spot, id), 2);
  declare("seed", PIKORT_I64, offsetof(Spot, seed));
}

class TableFile : public TemporaryFolder {
protected:
  TableFile() {
    pikort_program program{PIKORT_ABI_VERSION, "Test", declareSpots,
                           [](pikort_pipeline *) { return int32_t(0); }};
    EXPECT_EQ(pikort_create(&program, &pipeline), PIKORT_OK)
        << pikort_message(pipeline);
  }
  ~TableFile() override { pikort_destroy(pipeline); }

  Result<TableRecords> read(const std::string &text) {
    auto table = loadTable(write("spots.csv", text));
    if (!table)
      return table.error();
    return makeRecords(*table, pipeline, 0);
  }
  /// What is wrong, after the file's name.
  std::string errorOf(const std::string &text) {
    auto records = read(text);
    if (records)
      return "no error";
    std::string message = records.error().message;
    std::string prefix = "table '" + pathOf("spots.csv") + "'";
    EXPECT_EQ(message.substr(0, prefix.size()), prefix);
    return message.substr(prefix.size());
  }
  /// A table of all fields, whose second line has another seed.
  static std::string withSeed(const std::string &seed) {
    return "x,weight,kind,group,id[0],id[1],seed\n1,1,1,1,1,1,1\n"
           "1,1,1,1,1,1," +
           seed + "\n";
  }

  pikort_pipeline *pipeline = nullptr;
};

TEST_F(TableFile, Names) {
  EXPECT_TRUE(isTableFile("a/spots.csv"));
  EXPECT_TRUE(isTableFile("spots.CSV.gz"));
  EXPECT_FALSE(isTableFile("spots.obj"));
  EXPECT_FALSE(isTableFile("csv"));
}

// Columns in any order, spaces, comments, empty lines, a byte order mark, line
// ends of two characters, and the numbers at the ends of their ranges.
TEST_F(TableFile, Fields) {
  auto records = read("\xef\xbb\xbf# spots\r\n"
                      "weight, x, kind, group, id[1], id[0], seed\r\n\r\n"
                      "1e300,0.1,-128,65535,2147483647,-2147483648,"
                      "18446744073709551615\r\n"
                      "# more\n"
                      " nan , -inf ,255,0,4294967295,7,-9223372036854775808");
  ASSERT_TRUE(records) << records.error().message;
  ASSERT_EQ(records->count, 2);
  ASSERT_EQ(records->size, int64_t(sizeof(Spot)));
  auto *spots = reinterpret_cast<const Spot *>(records->memory.data());
  EXPECT_EQ(spots[0].x, 0.1f);
  EXPECT_EQ(spots[0].weight, 1e300);
  EXPECT_EQ(spots[0].kind, -128);
  EXPECT_EQ(spots[0].group, 65535);
  EXPECT_EQ(spots[0].id[0], INT32_MIN);
  EXPECT_EQ(spots[0].id[1], INT32_MAX);
  EXPECT_EQ(spots[0].seed, UINT64_MAX);
  EXPECT_EQ(spots[1].x, -INFINITY);
  EXPECT_TRUE(std::isnan(spots[1].weight));
  EXPECT_EQ(spots[1].kind, -1);
  EXPECT_EQ(spots[1].id[1], -1);
  EXPECT_EQ(spots[1].seed, uint64_t(INT64_MIN));
}

TEST_F(TableFile, NoLines) {
  auto records = read("x,weight,kind,group,id[0],id[1],seed\n");
  ASSERT_TRUE(records) << records.error().message;
  EXPECT_EQ(records->count, 0);
}

TEST_F(TableFile, WrongNumbers) {
  EXPECT_EQ(errorOf(withSeed("1.5")), ", line 3: expected a whole number of 64 "
                                      "bits for 'seed', but got '1.5'");
  EXPECT_EQ(errorOf(withSeed("18446744073709551616")),
            ", line 3: expected a whole number of 64 bits for 'seed', but got "
            "'18446744073709551616'");
  EXPECT_EQ(errorOf(withSeed("")), ", line 3: expected a whole number of 64 "
                                   "bits for 'seed', but got ''");
  EXPECT_EQ(errorOf(withSeed("1,2")),
            ", line 3: expected 7 numbers, but got 8");
  EXPECT_EQ(errorOf("x,weight,kind,group,id[0],id[1],seed\n"
                    "\"1\",1,1,1,1,1,1"),
            ", line 2: expected a number that a float holds for 'x', but got "
            "'\"1\"'");
  EXPECT_EQ(errorOf("x,weight,kind,group,id[0],id[1],seed\n"
                    "1e39,1,1,1,1,1,1"),
            ", line 2: expected a number that a float holds for 'x', but got "
            "'1e39'");
  EXPECT_EQ(errorOf("x,weight,kind,group,id[0],id[1],seed\n"
                    "1,1,256,1,1,1,1"),
            ", line 2: expected a whole number of 8 bits for 'kind', but got "
            "'256'");
}

TEST_F(TableFile, WrongNames) {
  EXPECT_EQ(errorOf("\n# nothing\n"),
            ": expected a line of names, but it is empty");
  EXPECT_EQ(errorOf("x,,weight\n"),
            ", line 1: expected a name of a field between commas, but got "
            "nothing");
  EXPECT_EQ(errorOf("\nx,weight,x\n"),
            ", line 2: expected each field once, but got 'x' twice");
  EXPECT_EQ(errorOf("x,wait\n"),
            ": expected fields of 'Spot' (x, weight, kind, group, id[0], "
            "id[1], seed), but got 'wait'");
  EXPECT_EQ(errorOf("x,weight,kind,group,id[0],seed\n"),
            ": expected all fields of 'Spot' (x, weight, kind, group, id[0], "
            "id[1], seed), but 'id[1]' is missing");
}

TEST_F(TableFile, NoFile) {
  auto table = loadTable(pathOf("none.csv"));
  ASSERT_FALSE(table);
  EXPECT_EQ(table.error().message.substr(0, 18), "cannot read table ");
}

} // namespace
