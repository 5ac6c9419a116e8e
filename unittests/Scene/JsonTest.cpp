//===- JsonTest.cpp - Lines of JSON ---------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/Json.h"

#include <gtest/gtest.h>

#include <limits>

using namespace piko::render;

TEST(Json, KeepsOrderAndQuotes) {
  JsonObject object;
  object.add("name", "a \"b\" \\ c\n").add("count", 3).add("ms", 1.23456);
  EXPECT_EQ(object.text(),
            R"({"name": "a \"b\" \\ c\u000a", "count": 3, "ms": 1.235})");
}

TEST(Json, Nests) {
  JsonObject inner;
  inner.add("x", 1);
  JsonObject object;
  object.add("one", inner).add("list", std::vector<JsonObject>{inner, inner});
  object.add("none", std::vector<JsonObject>{});
  EXPECT_EQ(object.text(), R"({"one": {"x": 1}, "list": [{"x": 1}, {"x": 1}], )"
                           R"("none": []})");
}

TEST(Json, NumbersStayNumbers) {
  JsonObject object;
  object.add("big", 5'000'000'000).add("large", 123456789.125);
  object.add("inf", std::numeric_limits<double>::infinity());
  EXPECT_EQ(object.text(),
            R"({"big": 5000000000, "large": 123456789.125, "inf": null})");
}

TEST(Json, BytesThatAreNotUTF8BecomeReplacementCharacters) {
  JsonObject object;
  object.add("\xff.obj", "\xc3\xbc \xe2\x82\xac \xf0\x9f\x98\x80")
      .add("short", "\xe2\x82")
      .add("long", "\xc0\xaf")
      .add("surrogate", "\xed\xa0\x80")
      .add("beyond", "\xf4\x90\x80\x80");
  EXPECT_EQ(object.text(),
            "{\"\uFFFD.obj\": \"\u00fc \u20ac \U0001F600\", "
            "\"short\": \"\uFFFD\uFFFD\", \"long\": \"\uFFFD\uFFFD\", "
            "\"surrogate\": \"\uFFFD\uFFFD\uFFFD\", "
            "\"beyond\": \"\uFFFD\uFFFD\uFFFD\uFFFD\"}");
}
