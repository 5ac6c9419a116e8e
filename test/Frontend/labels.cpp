// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A name that a stage is given is the label of its operation, and no schedule:
// the symbol stays the member.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
// RUN: pikoc %s --explain | FileCheck %s --check-prefix=EXPLAIN
#include <piko.h>

// CHECK-LABEL: piko.stage @depth label "Shadow pass (1 of 2)" bins [0, 0]
// CHECK-NOT: piko.schedule
// CHECK: piko.process
// EXPLAIN: {{^  }}depth ('Shadow pass (1 of 2)'): one bin, 64 threads, no schedule
struct Depth : piko::Stage<0, 0, 64, int, int> {
  const char *name = "Shadow pass (1 of 2)";
  void schedule(piko::BinId) { specifyName(name); }
  void process(const int &i) { emit(i); }
};

// Beside what depends on the bin; the same name twice is one.
// CHECK-LABEL: piko.stage @shade label "Shade" bins [8, 8]
// CHECK: piko.schedule load_balance dynamic {
// EXPLAIN: {{^  }}shade ('Shade'): bins of 8 x 8
template <bool isNamed> struct Shade : piko::Stage<8, 8, 64, int> {
  void assignBin(const int &i) { assignToAll(i); }
  void schedule(piko::BinId bin) {
    specifySchedule(bin.index % 2 ? piko::Serialize : piko::DirectMap);
    if constexpr (isNamed) {
      specifyName("Shade");
      specifyName("Shade");
    }
  }
  void process(const int &) {}
};

// CHECK-LABEL: piko.stage @other bins [8, 8]
// EXPLAIN: {{^  }}other: bins of 8 x 8
struct Pipeline : piko::Pipe<> {
  Depth depth;
  Shade<true> shade;
  Shade<false> other;
  Pipeline() {
    source(depth);
    source(other);
    connect(depth, 0, shade);
  }
};
