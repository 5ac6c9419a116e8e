// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-reduce-strength{lanes=8},canonicalize,cse))' %s | FileCheck %s

piko.record @Box {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @Key {"k" : i32 at 0} size 4 align 4

piko.pipeline @P rank 2 {
  piko.image @seen : @Key rank 2
  piko.source @a
  piko.stage @a bins [16, 16] threads 64 : @Box -> [] {}

  // An edge is what all lanes share and a part of each; twice as much and one more
  // is a vector of its own. Neither a sum that the loop itself hands on nor what is
  // squared is linear.
  // CHECK-LABEL: piko.kernel @rows
  // CHECK:         scf.for
  // CHECK:           %[[ALL:.*]] = vector.broadcast %{{.*}} : i32 to vector<8xi32>
  // CHECK:           %[[FIRST:.*]] = arith.addi %[[ALL]], %{{.*}} : vector<8xi32>
  // CHECK:           %[[STEP:.*]] = vector.broadcast %{{.*}} : i32 to vector<8xi32>
  // CHECK:           scf.for {{.*}} iter_args({{.*}}%[[EDGE:arg[0-9]+]] = %[[FIRST]]{{.*}}vector<8xi32>
  // CHECK-NOT:         vector.broadcast
  // CHECK:             arith.maxsi %{{.*}}, %[[EDGE]]
  // CHECK:             arith.addi %[[EDGE]], %[[STEP]] : vector<8xi32>
  // CHECK:             scf.yield
  piko.kernel @rows {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %i0 = arith.constant 0 : i32
    %i1 = arith.constant 1 : i32
    %i16 = arith.constant 16 : i32
    %one = arith.constant dense<1> : vector<8xi32>
    %all = arith.constant dense<true> : vector<8xi1>
    %lanes = arith.constant dense<[0, 1, 2, 3, 4, 5, 6, 7]> : vector<8xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@Box>
    %units = piko.storage.unit_count %bins : !piko.bins<@Box>
    scf.forall (%u) in (%units) {
      %begin, %end = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Box>
      scf.for %i = %begin to %end step %c1 {
        %p = piko.storage.item %bins[%i] : !piko.bins<@Box> -> !piko.prim<@Box>
        %x = piko.get %p "x" : !piko.prim<@Box> -> i32
        %y = piko.get %p "y" : !piko.prim<@Box> -> i32
        %r = scf.for %row = %i0 to %i16 step %i1 iter_args(%e = %x) -> (i32) : i32 {
          %shared = vector.broadcast %e : i32 to vector<8xi32>
          %edge = arith.addi %shared, %lanes : vector<8xi32>
          %squared = arith.muli %edge, %edge : vector<8xi32>
          %doubled = arith.shli %edge, %one : vector<8xi32>
          %other = arith.addi %doubled, %one : vector<8xi32>
          %m = arith.maxsi %squared, %edge : vector<8xi32>
          %n = arith.maxsi %m, %other : vector<8xi32>
          %at = arith.index_cast %row : i32 to index
          piko.cpu.scatter %n, consecutive @seen[%c0, %at : index, index] "k" mask %all : vector<8xi1>, vector<8xi32>
          %next = arith.addi %e, %y : i32
          scf.yield %next : i32
        }
      }
    }
  }

  // A difference from what does not grow falls, a product grows by the factor's
  // multiple, also under a condition; a primitive that the condition says is
  // there is not read before the loop.
  // CHECK-LABEL: piko.kernel @kinds
  // CHECK:         %[[STEP:.*]] = arith.constant dense<-3> : vector<8xi32>
  // CHECK:         scf.forall
  // CHECK-NOT:       piko.storage.item
  // CHECK:           scf.for {{.*}} iter_args(%[[FALLS:.*]] = %{{.*}}) -> (vector<8xi32>)
  // CHECK:             scf.if
  // CHECK-NEXT:          piko.storage.item
  // CHECK:               arith.addi %[[FALLS]], %
  // CHECK:             arith.addi %[[FALLS]], %[[STEP]] : vector<8xi32>
  piko.kernel @kinds {
    %c0 = arith.constant 0 : index
    %i0 = arith.constant 0 : i32
    %i1 = arith.constant 1 : i32
    %i3 = arith.constant 3 : i32
    %i16 = arith.constant 16 : i32
    %all = arith.constant dense<true> : vector<8xi1>
    %lanes = arith.constant dense<[0, 1, 2, 3, 4, 5, 6, 7]> : vector<8xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@Box>
    %units = piko.storage.unit_count %bins : !piko.bins<@Box>
    scf.forall (%u) in (%units) {
      %begin, %end = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Box>
      %any = arith.cmpi slt, %begin, %end : index
      scf.for %row = %i0 to %i16 step %i1 : i32 {
        scf.if %any {
          %p = piko.storage.item %bins[%begin] : !piko.bins<@Box> -> !piko.prim<@Box>
          %x = piko.get %p "x" : !piko.prim<@Box> -> i32
          %xs = vector.broadcast %x : i32 to vector<8xi32>
          %three = arith.muli %row, %i3 : i32
          %shared = vector.broadcast %three : i32 to vector<8xi32>
          %falls = arith.subi %lanes, %shared : vector<8xi32>
          %sum = arith.addi %falls, %xs : vector<8xi32>
          %at = arith.index_cast %row : i32 to index
          piko.cpu.scatter %sum, consecutive @seen[%c0, %at : index, index] "k" mask %all : vector<8xi1>, vector<8xi32>
        }
      }
    }
  }

  // A broadcast alone is one operation, as is a sum; and loops around others stay.
  // CHECK-LABEL: piko.kernel @left
  // CHECK:         scf.for %{{.*}} = %{{.*}} to %{{.*}} step %c1_i32 : i32 {
  // CHECK-NEXT:      vector.broadcast
  piko.kernel @left {
    %c0 = arith.constant 0 : index
    %i0 = arith.constant 0 : i32
    %i1 = arith.constant 1 : i32
    %i16 = arith.constant 16 : i32
    %all = arith.constant dense<true> : vector<8xi1>
    %bins = piko.storage.open_bins @a : !piko.bins<@Box>
    %units = piko.storage.unit_count %bins : !piko.bins<@Box>
    scf.forall (%u) in (%units) {
      scf.for %row = %i0 to %i16 step %i1 : i32 {
        %shared = vector.broadcast %row : i32 to vector<8xi32>
        %at = arith.index_cast %row : i32 to index
        piko.cpu.scatter %shared, consecutive @seen[%c0, %at : index, index] "k" mask %all : vector<8xi1>, vector<8xi32>
      }
    }
  }
}
