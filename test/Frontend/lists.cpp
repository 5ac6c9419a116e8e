// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A list Process reads fields through references, which may be held across
// loops, several at once, and through iterators.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Splat {
  float z;
  int weights[3];
};

// CHECK-LABEL: piko.stage @blend bins [8, 8] threads 64 : list @Splat -> [@Splat]
// CHECK: piko.assign
// CHECK-NEXT: ^bb0(%{{.*}}: !piko.prim<@Splat>):
// CHECK: piko.schedule load_balance batch 256 every_bin
// CHECK: ^bb0(%[[LIST:.*]]: !piko.list<@Splat>):
struct Blend : piko::Stage<8, 8, 64, Splat, Splat> {
  void assignBin(const Splat &s) { assignToAll(s); }
  void schedule(piko::BinId) {
    batch(256);
    everyBin();
  }
  // CHECK-DAG: %[[C1:.*]] = arith.constant 1 : index
  // CHECK-DAG: %[[C2:.*]] = arith.constant 2 : index
  // CHECK-DAG: %[[C3:.*]] = arith.constant 3 : index
  // CHECK: %[[SIZE:.*]] = piko.list_size %[[LIST]]
  void process(const piko::List<Splat> &splats) {
    Splat out{};
    // CHECK: scf.while
    // CHECK: %[[EACH:.*]] = piko.list_at %[[LIST]][
    // CHECK: piko.get %[[EACH]] "z"
    for (const Splat &s : splats)
      out.z += s.z;
    // CHECK: %[[FIRST:.*]] = piko.list_at %[[LIST]][%[[C1]]]
    // CHECK: %[[SECOND:.*]] = piko.list_at %[[LIST]][%[[C2]]]
    const Splat &first = splats[1], &second = splats[2];
    // CHECK-NOT: scf.while
    // CHECK: piko.get %[[FIRST]] "weights"[
    // CHECK: piko.get %[[SECOND]] "weights"[
    for (int i = 0; i < 3; ++i)
      out.weights[0] += first.weights[i] * second.weights[2 - i];
    // CHECK: %[[THIRD:.*]] = piko.list_at %[[LIST]][%[[C3]]]
    // CHECK: piko.get %[[THIRD]] "z"
    auto it = splats.begin() + 3;
    out.z -= it->z;
    emit(out);
  }
};

// CHECK-LABEL: piko.stage @count
// CHECK: %[[SIZE:.*]] = piko.list_size
// CHECK: piko.parallel_for
// CHECK-NOT: piko.list_at
struct Count : piko::Stage<8, 8, 64, Splat> {
  void assignBin(const Splat &s) { assignToPreviousBins(s); }
  void process(const piko::List<Splat> &splats) {
    if (!splats.empty())
      parallelFor(1, [](int) {});
  }
};
struct Pipeline : piko::Pipe<> {
  Blend blend;
  Count count;
  Pipeline() {
    source(blend);
    connect(blend, 0, count);
  }
};
