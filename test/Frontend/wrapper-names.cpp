// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A pipeline, its stages and their members may have the names that the
// compiler's own text uses, and macros do not change that.
// RUN: piko-translate --cpp-to-piko --pipe=State -o - %s | FileCheck %s --check-prefix=STATE
// RUN: pikoc %s --pipe=State -o %t.o --header %t.h
// RUN: pikoc %s --pipe=Pipe -o %t.o --header %t.h
// RUN: pikoc %s --pipe=hidden -o %t.o --header %t.h
// RUN: pikoc %s --pipe=pipe -o %t.o --header %t.h
#include <piko.h>

#define phase 1
#define input 2
#define typename 3
#define nullptr 4
#define type 5
#define marker 6
#undef typename

struct Memory {
  piko::Image<float> draw;
  float state = 2;
};
// STATE-LABEL: piko.stage @read
struct Read : piko::Stage<8, 8, 64, float>, piko::Uses<Memory> {
  struct Input {};
  struct Output {};
  void assignBin(const float &i) { assignToAll(i); }
  void schedule(piko::BinId) {}
  void process(const float &i) {
    update(state().draw, binLo(), [&](float &v) { v += i * state().state; });
  }
};
struct State : piko::Pipe<Memory> {
  Read read;
  State() { source(read); }
};
struct Pipe : piko::Pipe<Memory> {
  struct State {};
  Read pipe;
  Pipe() { source(pipe); }
};
struct hidden : piko::Pipe<Memory> {
  Read __piko_pipe;
  hidden() { source(__piko_pipe); }
};
int hidden = 0;
namespace ours::detail {
struct pipe : piko::Pipe<Memory> {
  Read state;
  pipe() { source(state); }
};
} // namespace ours::detail
