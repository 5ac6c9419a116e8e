// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Kernels, and the structured work that they are at the machine level.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOKERNELOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOKERNELOPS_TD

include "Piko/Dialect/Piko/IR/PikoAttributes.td"
include "Piko/Dialect/Piko/IR/PikoTypes.td"

def Piko_KernelOp : Piko_Op<"kernel", [
    Symbol, NoTerminator, SingleBlock, NoRegionArguments, IsolatedFromAbove,
    AutomaticAllocationScope, HasParent<"PipelineOp">]> {
  let summary = "phases that run together";
  let description = [{
    When a kernel runs is said by the `piko.program`; where there is none yet,
    kernels stand in the order in which they run. At the
    kernels level the body holds phases: the process phase of a stage and, after
    it, the assign phases of the stages that it feeds, or the assign phase of a
    source. More process phases may follow, each after a `piko.local_barrier`.
    At the machine level it holds structured work instead: a `piko.bins`, or the
    `piko.items` of a source. Below, a target has made loops of that, and no phase
    or work is left. The kernel of a dynamic schedule is a loop over bins and runs
    before all others.

    A kernel that `precedes` another one is a part of each launch of that one: it
    takes the same bins first, and emits nothing. `piko-reduce-by-atomics` makes it.

    ```mlir
    piko.record @F {"x" : i32 at 0} size 4 align 4
    piko.pipeline @P rank 1 {
      piko.source @start
      piko.edge @start[0] -> @drop
      piko.stage @start bins [0] threads 64 : @F -> [@F] {}
      piko.stage @drop bins [8] threads 64 : @F -> [] {}
      piko.kernel @kernel_start {
        piko.process of @start {
        ^bb0(%f: !piko.prim<@F>):
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          piko.emit 0 (%x) : i32
          piko.return
        }
        piko.assign of @drop port 0 {
        ^bb0(%f: !piko.prim<@F>):
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          %b = piko.bin_at %x : i32
          piko.assign_to %b
          piko.return
        }
      }
      piko.kernel @kernel_drop {
        piko.process of @drop {
        ^bb0(%f: !piko.prim<@F>):
          piko.return
        }
      }
    }
    ```
  }];
  let arguments = (ins SymbolNameAttr:$sym_name,
                       OptionalAttr<FlatSymbolRefAttr>:$precedes);
  let builders = [OpBuilder<(ins "::llvm::StringRef":$name), [{
    build($_builder, $_state, name, ::mlir::FlatSymbolRefAttr());
  }]>];
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    $sym_name (`precedes` $precedes^)? attr-dict-with-keyword
    custom<IsolatedBody>($body)
  }];
  let hasRegionVerifier = 1;
  let extraClassDeclaration = [{
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
    /// The first process phase, or null (a source's kernel, or below the kernels
    /// level).
    ProcessOp getProcess();
  }];
}

def Piko_LocalBarrierOp : Piko_Op<"local_barrier", [
    HasParent<"KernelOp">, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "what a port emits stays in its bin, for the next phase";
  let description = [{
    Stands before a process phase that runs in the kernel of the stage that
    feeds it. For each bin, the phases before the barrier run for all that is
    in the bin, then the phase after it runs for what they have emitted to the
    port. The consumer collects, has bins of the same size, and has this edge
    alone.

    ```mlir
    piko.record @F {"x" : i32 at 0} size 4 align 4
    piko.pipeline @P rank 1 {
      piko.source @start
      piko.edge @start[0] -> @last
      piko.stage @start bins [8] threads 64 : @F -> [@F] {}
      piko.stage @last bins [8] threads 64 : list @F -> [] {
        piko.schedule load_balance end_bin
      }
      piko.kernel @kernel_start {
        piko.process of @start {
        ^bb0(%f: !piko.prim<@F>):
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          piko.emit 0 (%x) : i32
          piko.return
        }
        piko.assign of @last port 0 {
        ^bb0(%f: !piko.prim<@F>):
          piko.assign_previous
          piko.return
        }
        piko.local_barrier @start[0] -> @last
        piko.process of @last {
        ^bb0(%l: !piko.list<@F>):
          piko.return
        }
      }
    }
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$producer,
                       ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$port,
                       FlatSymbolRefAttr:$consumer);
  let assemblyFormat = "$producer `[` $port `]` `->` $consumer attr-dict";
}

def Piko_BeginScheduleOp : Piko_Op<"begin_schedule", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "starts the kernel of a dynamic schedule";
  let description = [{
    The result is the stage's number of bins.

    ```mlir
    %bins = piko.begin_schedule @blend
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage);
  let results = (outs Index:$bins);
  let assemblyFormat = "$stage attr-dict";
}

def Piko_ScheduleBinOp : Piko_Op<"schedule_bin", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "what a dynamic schedule says about a bin";
  let description = [{
    Before any kernel runs. A batch of the smallest 64-bit integer is none.

    ```mlir
    piko.schedule_bin @blend[%b] kind %kind tile_split %split batch %batch every_bin %always
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Index:$bin, I32:$kind,
                       I64:$tileSplit, I64:$batch, I1:$everyBin);
  let assemblyFormat = [{
    $stage `[` $bin `]` `kind` $kind `tile_split` $tileSplit `batch` $batch
    `every_bin` $everyBin attr-dict
  }];
}

def Piko_GridOp : Piko_Op<"grid", [Pure]> {
  let summary = "how many bins a stage has in a dimension";
  let description = [{
    With `tiles` it is how many tiles a bin of the stage has.

    ```mlir
    %n = piko.grid @shade[0]
    %t = piko.grid @shade[0] tiles
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Piko_I64Attr:$dim, UnitAttr:$tiles);
  let results = (outs Index:$result);
  let assemblyFormat = "$stage `[` $dim `]` (`tiles` $tiles^)? attr-dict";
  let hasVerifier = 1;
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOKERNELOPS_TD
