//===- DivisionTest.cpp - Integer divisions that have no result -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Trace.h"

#include <csignal>
#include <functional>

// Elsewhere a machine's division gives a number.
#if defined(__x86_64__)
namespace {

/// A divisor that nobody knows.
volatile int divisor = 0;

struct Results {
  piko::Buffer<int> data;
  piko::Image<int> image;
};

/// Does what a test says.
struct Divide : piko::Stage<4, 4, 8, int>, piko::Uses<Results> {
  static inline std::function<void(Divide &, int)> body, assigning;

  void assignBin(const int &i) {
    if (assigning)
      assigning(*this, i);
    assignToBin(i, {3});
  }
  void process(const int &i) {
    if (body)
      body(*this, i);
  }
  int &at(int i) { return state().data[i]; }
};

struct DividePipe : piko::Pipe<Results> {
  Divide divide;
  DividePipe() {
    setDomain({8, 8});
    state().data.assign(std::vector<int>(16));
    source(divide);
  }
};

constexpr auto text =
    "Divide', bin 3: expected an integer division to have a result, but it "
    "divides by 0 or overflows";

class Division : public testing::Test {
protected:
  void SetUp() override {
    Divide::body = Divide::assigning = nullptr;
    divisor = 0;
  }
  std::string message() {
    return messageOf([&] { run(pipe, {5}); });
  }
  DividePipe pipe;
};

TEST_F(Division, Quotient) {
  Divide::body = [](Divide &s, int i) { s.at(0) = i / divisor; };
  EXPECT_THAT(message(), HasSubstr(text));
}

TEST_F(Division, Remainder) {
  Divide::body = [](Divide &s, int i) { s.at(0) = i % divisor; };
  EXPECT_THAT(message(), HasSubstr(text));
}

TEST_F(Division, Overflow) {
  Divide::body = [](Divide &s, int i) {
    s.at(0) = (INT32_MIN + divisor + i - i) / (divisor - 1);
  };
  EXPECT_THAT(message(), HasSubstr(text));
}

TEST_F(Division, InAssignBin) {
  [[maybe_unused]] static volatile int quotient;
  Divide::assigning = [](Divide &, int i) { quotient = i / divisor; };
  EXPECT_THAT(message(), HasSubstr("Divide': expected an integer division"));
}

TEST_F(Division, InAnUpdate) {
  Divide::body = [](Divide &s, int i) {
    s.update(s.state().image, {4, 4}, [&](int &pixel) { pixel = i / divisor; });
  };
  EXPECT_THAT(message(), HasSubstr(text));
}

// Iterations but the first have a stack of their own.
TEST_F(Division, InIterations) {
  for (int wrong = 0; wrong < 4; ++wrong) {
    Divide::body = [&](Divide &s, int i) {
      s.parallelFor(4, [&](int k) {
        s.sync();
        if (k == wrong)
          s.at(k) = i / divisor;
        s.sync();
      });
    };
    EXPECT_THAT(message(), HasSubstr(text)) << wrong;
  }
}

// The pipeline runs again, and an exception of the user's own goes its way.
TEST_F(Division, RunsAgain) {
  Divide::body = [](Divide &s, int i) { s.at(0) = i / divisor; };
  EXPECT_THAT(message(), HasSubstr(text));
  divisor = 2;
  EXPECT_EQ(message(), "(no error)");
  EXPECT_EQ(pipe.state().data[0], 2);
  Divide::body = [](Divide &, int) { throw 7; };
  EXPECT_THROW(run(pipe, {5}), int);
}

// The signal is the host's again.
void ignore(int) {}
TEST_F(Division, LeavesTheSignalToTheHost) {
  auto before = std::signal(SIGFPE, ignore);
  Divide::body = [](Divide &s, int i) { s.at(0) = i / divisor; };
  EXPECT_THAT(message(), HasSubstr(text));
  EXPECT_EQ(std::signal(SIGFPE, before), ignore);
}

} // namespace
#endif
