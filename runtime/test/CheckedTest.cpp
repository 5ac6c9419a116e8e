// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A status that nobody looks at is thrown, once.

#include "pikort/checked.hpp"

#include "gtest/gtest.h"

using piko::Error;
using piko::Status;
using piko::rt::CheckedStatus;

static CheckedStatus fail() { return Status(3, "wrong"); }
static CheckedStatus succeed() { return Status(); }

TEST(Checked, IsThrown) {
  EXPECT_NO_THROW(succeed());
  try {
    fail();
    FAIL();
  } catch (const Error &error) {
    EXPECT_EQ(error.code(), 3);
    EXPECT_STREQ(error.what(), "wrong");
  }
  EXPECT_THROW({ auto status = fail(); }, Error);
}

TEST(Checked, IsLookedAt) {
  EXPECT_NO_THROW(if (auto status = fail()) FAIL(););
  EXPECT_NO_THROW(EXPECT_EQ(fail().code(), 3));
  EXPECT_NO_THROW(EXPECT_EQ(fail().message(), "wrong"));
  EXPECT_NO_THROW(Status kept = fail(); EXPECT_FALSE(kept));
  auto print = [](const Status &status) { return status.message(); };
  EXPECT_NO_THROW(EXPECT_EQ(print(fail()), "wrong"));
  EXPECT_THROW(fail().orThrow(), Error);
}

TEST(Checked, IsMoved) {
  auto pass = [](CheckedStatus status) { return status; };
  EXPECT_THROW(pass(fail()), Error);
  EXPECT_NO_THROW(EXPECT_FALSE(pass(fail())));
}

// Another exception goes on.
TEST(Checked, IsDroppedWhileUnwinding) {
  EXPECT_THROW(
      {
        auto status = fail();
        throw 1;
      },
      int);
  struct Guard {
    ~Guard() { EXPECT_THROW(fail(), Error); }
  };
  EXPECT_THROW(
      {
        Guard guard;
        throw 1;
      },
      int);
}
