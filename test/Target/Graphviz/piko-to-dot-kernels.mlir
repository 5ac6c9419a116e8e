// RUN: piko-opt --piko-synthesize %s | piko-translate --piko-to-dot | FileCheck %s

piko.record @Point {"x" : i32 at 0} size 4 align 4

// Stages that were fused stand in the box of their kernel, and a schedule that
// has code of its own has a box, too.
// CHECK: digraph "Draw" {
// CHECK: subgraph "cluster_kernel_start" {
// CHECK-NEXT: label="kernel_start";
// CHECK-NEXT: "process start" [label="process start\nbins 8, 64 threads\ndirect_map"];
// CHECK-NEXT: "process shade" [label="process shade"];
// CHECK-NEXT: "process start" -> "process shade" [style=dotted];
// CHECK-NEXT: "process split" [label="process split"];
// CHECK-NEXT: "process start" -> "process split" [style=dotted];
// CHECK-NEXT: "assign plot start.0" [label="assign plot"];
// CHECK-NEXT: }
// CHECK-NEXT: subgraph "cluster_kernel_plot" {
// CHECK-NEXT: label="kernel_plot";
// CHECK-NEXT: "process plot" [label="process plot\n
// CHECK-NEXT: }
// CHECK-NEXT: }
// CHECK-NEXT: subgraph "cluster_schedule plot" {
// CHECK-NEXT: "schedule plot";
// CHECK-NEXT: }
// CHECK-NEXT: "schedule plot" -> "process plot" [style=dashed];
// CHECK: "process start" -> "assign plot start.0" [label="port 0: Point\nconcatenated"];
// CHECK-NEXT: "assign plot start.0" -> "process plot";
piko.pipeline @Draw rank 1 {
  piko.buffer @sums : @Point
  piko.source @start
  piko.edge @start[0] -> @shade
  piko.edge @shade[0] -> @split
  piko.edge @split[0] -> @plot
  piko.stage @start bins [8] threads 64 : @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %b = piko.bin_at %x : i32
      piko.assign_to %b
      piko.return
    }
    piko.schedule direct_map
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @shade bins [8] threads 64 : @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @split bins [8] threads 64 : @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @plot bins [4] threads 64 : @Point -> [] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %b = piko.bin_at %x : i32
      piko.assign_to %b
      piko.return
    }
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %kind = arith.index_cast %bin : index to i32
      %split = arith.constant 0 : i64
      piko.set_schedule %kind tile_split %split
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      %zero = arith.constant 0 : index
      piko.atomic add @sums[%zero : index] "x", %x : i32
      piko.return
    }
  }
}

// What a local barrier keeps in a bin is bold, and in one box.
// CHECK: digraph "Local" {
// CHECK: subgraph "cluster_kernel_spread" {
// CHECK: "process spread" [label=
// CHECK-NEXT: "assign sort spread.0" [label="assign sort"];
// CHECK-NEXT: "process sort" [label="process sort\nbins 8, 64 threads"];
// CHECK-NEXT: }
// CHECK: "process spread" -> "assign sort spread.0" [label="port 0: Point", style=bold];
// CHECK-NEXT: "assign sort spread.0" -> "process sort" [style=bold];
piko.pipeline @Local rank 1 {
  piko.buffer @sums : @Point
  piko.source @spread
  piko.edge @spread[0] -> @sort
  piko.stage @spread bins [8] threads 64 : @Point -> [@Point] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%p: !piko.prim<@Point>):
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @sort bins [8] threads 64 : list @Point -> [] {
    piko.assign {
    ^bb0(%p: !piko.prim<@Point>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@Point>):
      %zero = arith.constant 0 : index
      %p = piko.list_at %l[%zero] : !piko.list<@Point> -> !piko.prim<@Point>
      %x = piko.get %p "x" : !piko.prim<@Point> -> i32
      piko.atomic add @sums[%zero : index] "x", %x : i32
      piko.return
    }
  }
}
