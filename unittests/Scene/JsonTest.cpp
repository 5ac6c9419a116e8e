//===- JsonTest.cpp - Lines of JSON ---------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/Json.h"

#include <gtest/gtest.h>

#include <limits>

using namespace piko::render;

TEST(Json, IsOneLineInOrder) {
  Json inner = {{"x", 1}};
  EXPECT_EQ(writeLine(Json::object({{"text", "a, {\"b\"} \\ c\n"},
                                    {"one", inner},
                                    {"list", Json::array({inner, inner})},
                                    {"none", Json::array()}})),
            R"({"text": "a, {\"b\"} \\ c\n", "one": {"x": 1}, )"
            R"("list": [{"x": 1}, {"x": 1}], "none": []})");
}

TEST(Json, NumbersStayNumbers) {
  EXPECT_EQ(
      writeLine(
          Json::object({{"big", 5'000'000'000},
                        {"ms", roundToThousandths(1.23456)},
                        {"whole", roundToThousandths(2.0001)},
                        {"large", roundToThousandths(123456789.125)},
                        {"inf", std::numeric_limits<double>::infinity()}})),
      R"({"big": 5000000000, "ms": 1.235, "whole": 2, "large": 123456789.125, "inf": null})");
}

TEST(Json, BytesThatAreNotUTF8BecomeReplacementCharacters) {
  EXPECT_EQ(writeLine(Json::object(
                {{"\xff.obj", "\xc3\xbc \xe2\x82\xac \xf0\x9f\x98\x80"},
                 {"short", "a\xe2\x82"}})),
            "{\"\uFFFD.obj\": \"\u00fc \u20ac \U0001F600\", "
            "\"short\": \"a\uFFFD\"}");
}
