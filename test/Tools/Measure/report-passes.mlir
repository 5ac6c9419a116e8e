// Which passes changed anything, and what: seen from outside, as no pass counts for
// itself.
// RUN: piko-opt %s --split-input-file --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-map-lanes,piko-map-lanes),cse)' --report-passes=text -o %t.mlir 2>&1 | FileCheck %s
// RUN: piko-opt %s --split-input-file --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-map-lanes,piko-map-lanes),cse)' --report-passes=json -o %t.mlir 2> %t.json
// RUN: tail -n 1 %t.json | %python -m json.tool | FileCheck %s --check-prefix=JSON
// RUN: FileCheck %s --check-prefix=MODULE --input-file=%t.mlir
// A pass that fails has changed nothing that anybody gets.
// RUN: not piko-opt %s --split-input-file --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=3}))' --report-passes=text 2>&1 | FileCheck %s --check-prefix=FAILS
// FAILS: error: expected 4, 8 or 16 lanes, but got 3
// FAILS-NOT: piko-plan-vectors:

// Both pieces of the file together.
// CHECK:      {{^  }}piko-form-kernels: +4 piko.kernel
// CHECK:      {{^  }}piko-form-work: +
// CHECK:      {{^  }}piko-map-lanes: as many operations of each kind
// CHECK:      {{^  }}cse: -1 arith.constant
// JSON:      "pass": "piko-map-lanes",
// JSON-NEXT: "runs": 4,
// JSON-NEXT: "changes": 2,
// JSON-NEXT: "operations": {}
// MODULE-COUNT-4: piko.kernel @

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %one = arith.constant 1 : i32
      %other = arith.constant 1 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = arith.addi %x, %one : i32
      %z = arith.addi %y, %other : i32
      piko.emit 0 (%z) : i32
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Q rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
