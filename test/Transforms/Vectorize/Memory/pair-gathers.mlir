// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-pair-gathers))' %s | FileCheck %s

piko.record @Number {"value" : i32 at 0} size 4 align 4
piko.record @Byte {"value" : i8 at 0} size 1 align 1
piko.record @Two {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

piko.pipeline @P rank 1 {
  piko.buffer @table : @Number
  piko.buffer @bytes : @Byte
  piko.buffer @points : @Two
  piko.buffer @out : @Number
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Number -> [] {}

  // An entry of a table and the next one, each tested by itself: what the second
  // one needs is computed before the first one.
  // CHECK-LABEL: piko.kernel @next
  // CHECK:         %[[JS:.*]] = arith.addi %[[IS:.*]], %{{.*}} : vector<16xi32>
  // CHECK:         %[[N:.*]] = arith.cmpi ult, %[[JS]]
  // CHECK:         %[[SOME:.*]] = arith.ori %[[M:.*]], %[[N]] : vector<16xi1>
  // CHECK-NEXT:    %[[ANY:.*]] = vector.reduction <or>, %[[SOME]]
  // CHECK-NEXT:    %[[AB:.*]]:2 = scf.if %[[ANY]]
  // CHECK:           piko.extent @table[0]
  // CHECK:           %[[IN:.*]] = arith.cmpi ult, %[[IS]]
  // CHECK:           scf.if
  // CHECK-COUNT-2:     piko.cpu.gather @table
  // CHECK:           } else {
  // CHECK-NEXT:        piko.cpu.gather_run @table[%[[IS]]] "value" mask %[[SOME]] : vector<16xi32>, vector<16xi1> -> vector<16xi32>, vector<16xi32>
  // CHECK:         piko.cpu.scatter %[[AB]]#0, @out
  // CHECK-NEXT:    piko.cpu.scatter %[[AB]]#1, @out
  piko.kernel @next {
    %zero = arith.constant dense<0> : vector<16xi32>
    %one = arith.constant dense<1> : vector<16xi32>
    %limit = arith.constant dense<100> : vector<16xi32>
    %steps = vector.step : vector<16xindex>
    %is = arith.index_cast %steps : vector<16xindex> to vector<16xi32>
    %m = arith.cmpi ult, %is, %limit : vector<16xi32>
    %some = vector.reduction <or>, %m : vector<16xi1> into i1
    %a = scf.if %some -> vector<16xi32> {
      %at = arith.index_cast %is : vector<16xi32> to vector<16xindex>
      %0 = piko.cpu.gather @table[%at : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
      scf.yield %0 : vector<16xi32>
    } else {
      scf.yield %zero : vector<16xi32>
    }
    %js = arith.addi %is, %one : vector<16xi32>
    %n = arith.cmpi ult, %js, %limit : vector<16xi32>
    %more = vector.reduction <or>, %n : vector<16xi1> into i1
    %b = scf.if %more -> vector<16xi32> {
      %at = arith.index_cast %js : vector<16xi32> to vector<16xindex>
      %0 = piko.cpu.gather @table[%at : vector<16xindex>] "value" mask %n : vector<16xi1>, vector<16xi32>
      scf.yield %0 : vector<16xi32>
    } else {
      scf.yield %zero : vector<16xi32>
    }
    piko.cpu.scatter %a, @out[%steps : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
    piko.cpu.scatter %b, @out[%steps : vector<16xindex>] "value" mask %n : vector<16xi1>, vector<16xi32>
  }

  // Clamped neighbours in a row of an image are compared: at its end both are the
  // same. The second one is read first.
  // CHECK-LABEL: piko.kernel @clamped
  // CHECK:         arith.subi %[[HIGH:.*]], %[[LOW:.*]] : vector<16xi32>
  // CHECK:         piko.cpu.gather_run @table[%[[LOW]]]
  // CHECK-NEXT:    arith.cmpi eq, %[[LOW]], %[[HIGH]] : vector<16xi32>
  // CHECK-NEXT:    arith.select
  piko.kernel @clamped {
    %one = arith.constant dense<1> : vector<16xi32>
    %last = arith.constant dense<9> : vector<16xi32>
    %m = arith.constant dense<true> : vector<16xi1>
    %steps = vector.step : vector<16xindex>
    %xs = arith.index_cast %steps : vector<16xindex> to vector<16xi32>
    %row = arith.muli %xs, %last : vector<16xi32>
    %next = arith.addi %xs, %one : vector<16xi32>
    %right = arith.minsi %next, %last : vector<16xi32>
    %js = arith.addi %row, %right : vector<16xi32>
    %bs = arith.index_cast %js : vector<16xi32> to vector<16xindex>
    %b = piko.cpu.gather @table[%bs : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
    %left = arith.minsi %xs, %last : vector<16xi32>
    %is = arith.addi %row, %left : vector<16xi32>
    %as = arith.index_cast %is : vector<16xi32> to vector<16xindex>
    %a = piko.cpu.gather @table[%as : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
    %sum = arith.addi %a, %b : vector<16xi32>
    piko.cpu.scatter %sum, @out[%steps : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
  }

  // The iterations of a loop read bytes side by side: it is unrolled, and eight of them
  // are one load for each lane. The ninth is loaded alone.
  // CHECK-LABEL: piko.kernel @turns
  // CHECK-NOT:     scf.for
  // CHECK:         piko.cpu.gather_run @bytes[%{{.*}}] "value" mask %{{.*}} -> vector<16xi8>, vector<16xi8>, vector<16xi8>, vector<16xi8>, vector<16xi8>, vector<16xi8>, vector<16xi8>, vector<16xi8>
  // CHECK:         piko.cpu.gather_run @bytes[%{{.*}}] "value" mask %{{.*}} -> vector<16xi8>{{$}}
  // CHECK-NOT:     gather_run
  // CHECK:         piko.cpu.scatter
  piko.kernel @turns {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c9 = arith.constant 9 : index
    %none = arith.constant dense<0> : vector<16xi32>
    %m = arith.constant dense<true> : vector<16xi1>
    %steps = vector.step : vector<16xindex>
    %is = arith.index_cast %steps : vector<16xindex> to vector<16xi32>
    %starts = arith.muli %is, %is : vector<16xi32>
    %all = scf.for %i = %c0 to %c9 step %c1 iter_args(%sum = %none) -> vector<16xi32> {
      %one = arith.index_cast %i : index to i32
      %each = vector.broadcast %one : i32 to vector<16xi32>
      %at = arith.addi %starts, %each : vector<16xi32>
      %place = arith.index_cast %at : vector<16xi32> to vector<16xindex>
      %byte = piko.cpu.gather @bytes[%place : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi8>
      %number = arith.extui %byte : vector<16xi8> to vector<16xi32>
      %next = arith.addi %sum, %number : vector<16xi32>
      scf.yield %next : vector<16xi32>
    }
    piko.cpu.scatter %all, @out[%steps : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
  }

  // Elements of two words, other distances, and state that the kernel changes stay
  // gathers.
  // CHECK-LABEL: piko.kernel @left
  // CHECK-NOT:     gather_run
  // CHECK:         piko.cpu.scatter
  piko.kernel @left {
    %one = arith.constant dense<1> : vector<16xi32>
    %two = arith.constant dense<2> : vector<16xi32>
    %m = arith.constant dense<true> : vector<16xi1>
    %steps = vector.step : vector<16xindex>
    %is = arith.index_cast %steps : vector<16xindex> to vector<16xi32>
    %as = arith.index_cast %is : vector<16xi32> to vector<16xindex>
    %next = arith.addi %is, %one : vector<16xi32>
    %bs = arith.index_cast %next : vector<16xi32> to vector<16xindex>
    %far = arith.addi %is, %two : vector<16xi32>
    %cs = arith.index_cast %far : vector<16xi32> to vector<16xindex>
    %x = piko.cpu.gather @points[%as : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xi32>
    %y = piko.cpu.gather @points[%bs : vector<16xindex>] "x" mask %m : vector<16xi1>, vector<16xi32>
    %a = piko.cpu.gather @table[%as : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
    %c = piko.cpu.gather @table[%cs : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
    %o = piko.cpu.gather @out[%as : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
    %p = piko.cpu.gather @out[%bs : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
    %0 = arith.addi %x, %y : vector<16xi32>
    %1 = arith.addi %a, %c : vector<16xi32>
    %2 = arith.addi %o, %p : vector<16xi32>
    %3 = arith.addi %0, %1 : vector<16xi32>
    %4 = arith.addi %3, %2 : vector<16xi32>
    piko.cpu.scatter %4, @out[%steps : vector<16xindex>] "value" mask %m : vector<16xi1>, vector<16xi32>
  }
}
