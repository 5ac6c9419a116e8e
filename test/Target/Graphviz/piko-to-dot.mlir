// RUN: piko-translate --piko-to-dot %s | FileCheck %s
// RUN: piko-opt --piko-synthesize %s | piko-translate --piko-to-dot | FileCheck %s --check-prefix=KERNELS
// RUN: piko-opt --piko-synthesize --piko-to-machine %s -o %t
// RUN: not piko-translate --piko-to-dot %t 2>&1 | FileCheck %s --check-prefix=MACHINE

piko.record @Point {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

// CHECK: digraph "Draw" {
// CHECK-DAG: "process rast" [label="rast\nbins whole domain, 64 threads
// CHECK-DAG: "process plot" [label="plot\nbins 8x8, 64 threads\ndirect_map"];
// CHECK: "source.0" [label="source 0", shape=invhouse];
// CHECK-NEXT: "source.0" -> "process rast" [label="Point"];
// CHECK-NEXT: "process rast" -> "process plot" [label="port 0: Point"];
// CHECK-NEXT: "drain plot" [label="drain", shape=house];
// CHECK-NEXT: "process plot" -> "drain plot" [style=dashed];
// CHECK-NEXT: }

// KERNELS: subgraph "cluster_strips0" {
// KERNELS-NEXT: label="strips"; style=dashed;
// KERNELS-NEXT: subgraph "cluster_[[KERNEL:.*]]" {
// KERNELS-NEXT: label="[[KERNEL]]";
// KERNELS-NEXT: "process rast" [label="process rast
// KERNELS-NEXT: "assign plot rast.0" [label="assign plot"];
// KERNELS-NEXT: }
// KERNELS: "source.0" -> "process rast" [label="Point\nconcatenated"];
// KERNELS-NEXT: "process rast" -> "assign plot rast.0" [label="port 0: Point\nconcatenated"];
// KERNELS-NEXT: "assign plot rast.0" -> "process plot";

// MACHINE: error: expected a kernel that holds phases, but got none
piko.pipeline @Draw rank 2 {
  piko.source @rast
  piko.edge @rast[0] -> @plot
  piko.stage @rast bins [0, 0] threads 64 : @Point -> [@Point] {
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      piko.emit 0 (%x, %y) : i32, i32
      piko.return
    }
  }
  piko.stage @plot bins [8, 8] threads 64 : @Point -> [] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %y = piko.get %p "y" : !piko.prim<@Point> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.schedule direct_map
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      piko.return
    }
  }
}
