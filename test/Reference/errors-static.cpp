// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the C++ compiler refuses, in words of the language.
// RUN: %cxx_after_header -DCASE=0 -fsyntax-only %s
// RUN: not %cxx_after_header -DCASE=1 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=INT
// RUN: not %cxx_after_header -DCASE=2 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=ASSIGN
// RUN: not %cxx_after_header -DCASE=3 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=MUTABLE
// RUN: not %cxx_after_header -DCASE=4 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=CONST
// RUN: not %cxx_after_header -DCASE=5 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=CONST
// RUN: not %cxx_after_header -DCASE=6 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=COPY
// RUN: not %cxx_after_header -DCASE=7 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=COPY
// RUN: not %cxx_after_header -DCASE=8 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=PROCESS
// RUN: not %cxx_after_header -DCASE=9 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=SCHEDULE
// RUN: not %cxx_after_header -DCASE=10 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=BIN
// RUN: not %cxx_after_header -DCASE=11 -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=SCHEDULE
// RUN: not pikoc -DCASE=6 --pipe TakePipe %s -o %t.o 2>&1 | FileCheck %s --check-prefix=COPY
#include <piko.h>

#include <vector>

struct Base {
  float x;
};
struct Derived : Base {
  int y;
};
struct State {
  piko::Buffer<int> out;
  piko::Image<int> image;
};

// INT: error: {{.*}}expected a phase to take the primitive of its stage, but it takes another type
// INT: expectPrimitive{{.*}}int{{.*}}float
// ASSIGN: error: {{.*}}expected a phase to take the primitive of its stage, but it takes another type
// ASSIGN: expectPrimitive{{.*}}double{{.*}}float
struct Take : piko::Stage<0, 0, 4, float>, piko::Uses<State> {
#if CASE == 1
  void process(const int &) {}
#else
  void process(float) const noexcept {}
#endif
#if CASE == 2
  void assignBin(double) {}
#endif
};
struct TakeBase : piko::Stage<0, 0, 4, Derived> {
  void process(const Base &) {}
};
struct TakeAny : piko::Stage<0, 0, 4, float>, piko::Uses<State> {
  void process(const auto &value) {
#if CASE == 3
    // MUTABLE: error: {{.*}}expected a function that can be called if it is const: iterations share what it has captured by value
    // MUTABLE: errors-static.cpp:[[#@LINE+1]]:
    parallelFor(2, [value](int i) mutable { i += int(value); });
#else
    parallelFor(2, [&](int i) { state().out[i] = int(value); });
#endif
  }
};
// COPY: error: {{.*}}expected a function that takes the pixel by reference, as in [&](Pixel &p): it gives nothing, and what it changes is a copy
struct TakeImage : piko::Stage<0, 0, 4, float>, piko::Uses<State> {
  void process(float value) {
#if CASE == 6
    update(state().image, {0, 0}, [&](int pixel) { pixel = int(value); });
#elif CASE == 7
    auto add = [sum = 0](const int &pixel) mutable { sum += pixel; };
    update(state().image, {0, 0}, add);
#endif
    update(state().image, {0, 0}, [&](int &pixel) { pixel = int(value); });
    update(state().image, {0, 0}, [&](auto &pixel) { pixel = int(value); });
    int old = update(state().image, {0, 0}, [](int pixel) { return pixel; });
    state().out[0] = old;
  }
};
// A phase that cannot be called is not taken for one that is not there.
// PROCESS: error: {{.*}}a stage needs a public process(const In &) or process(const piko::List<In> &)
// SCHEDULE: error: {{.*}}expected schedule of a stage to be public and to take a piko::BinId
// BIN: error: {{.*}}expected assignBin of a stage to be public and to take its primitive
class Phases : public piko::Stage<0, 0, 4, float> {
#if CASE != 8
public:
#endif
  void process(float) {}
#if CASE == 11
  void schedule() {}
#else
#if CASE == 9
private:
#endif
  void schedule(piko::BinId) {}
#endif
#if CASE == 10
private:
#else
public:
#endif
  void assignBin(float value) {
    if (value > 0)
      assignToBin(value, piko::BinId{0});
  }
};
struct TakePipe : piko::Pipe<State> {
  Phases phases;
  TakeImage takeImage;
  Take take;
  TakeBase takeBase;
  TakeAny takeAny;
  TakePipe() {
    source(phases);
    source(takeImage);
    source(take);
    source(takeBase);
    source(takeAny);
  }
};

int main() {
  std::vector<int> out(3);
  const std::vector<int> constant(3);
  TakePipe pipe;
  pipe.state().out.bind(out);
  // CONST: error: {{.*}}a pipeline may write to a buffer; assign copies
  // CONST: errors-static.cpp:
#if CASE == 4
  pipe.state().out.bind(constant);
#elif CASE == 5
  pipe.state().out.bind(constant.data(), 3);
#endif
}
