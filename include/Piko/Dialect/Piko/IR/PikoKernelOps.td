// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Kernels, and the storage of bins that resolved kernels work on.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOKERNELOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOKERNELOPS_TD

include "Piko/Dialect/Piko/IR/PikoAttributes.td"
include "Piko/Dialect/Piko/IR/PikoTypes.td"

def Piko_KernelOp : Piko_Op<"kernel", [
    Symbol, NoTerminator, SingleBlock, NoRegionArguments, IsolatedFromAbove,
    AutomaticAllocationScope, HasParent<"PipelineOp">]> {
  let summary = "phases that run together";
  let description = [{
    Kernels run one after another, in the order in which they stand in the
    pipeline; a kernel starts when the one before it has ended. Kernels of stages
    on a common cycle run again and again, until nothing is left of it. At the
    kernels level the body holds phases: the process phase of a stage and, behind
    it, the assign phases of the stages that it feeds, or the assign phase of a
    source. More process phases may follow, each behind a `piko.local_barrier`.
    At the resolved level it holds loops over the units of work of a stage's
    bins, the first of which is an `scf.forall`, and no phase. The kernel of a
    dynamic schedule is a loop over bins and runs before all others.

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
  let arguments = (ins SymbolNameAttr:$sym_name);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = "$sym_name attr-dict-with-keyword $body";
  let hasRegionVerifier = 1;
  let extraClassDeclaration = [{
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
    /// The first process phase, or null (a source's kernel, or the resolved
    /// level).
    ProcessOp getProcess();
  }];
}

def Piko_LocalBarrierOp : Piko_Op<"local_barrier", [
    HasParent<"KernelOp">, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "what a port emits stays in its bin, for the next phase";
  let description = [{
    Stands in front of a process phase that runs in the kernel of the stage that
    feeds it. For each bin, the phases in front of the barrier run for all that is
    in the bin, then the phase behind it runs for what they have emitted to the
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

def Piko_StripsOp : Piko_Op<"strips", [
    HasParent<"PipelineOp">, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "kernels that take a source strip by strip";
  let description = [{
    The kernels, which stand in a row, run for one strip of the source, consecutive
    primitives, before the first of them runs for the next strip. All their
    primitives come from that source. `chunk` is how many primitives a strip has
    at most; without it the runtime chooses.

    ```mlir
    piko.record @F {"x" : i32 at 0} size 4 align 4
    piko.pipeline @P rank 1 {
      piko.source @start
      piko.edge @start[0] -> @drop
      piko.stage @start bins [0] threads 64 : @F -> [@F] {}
      piko.stage @drop bins [0] threads 64 : @F -> [] {}
      piko.strips source 0 [@kernel_start, @kernel_drop] chunk 256
      piko.kernel @kernel_start {
        piko.process of @start {
        ^bb0(%f: !piko.prim<@F>):
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          piko.emit 0 (%x) : i32
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
  let arguments = (ins
    ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$source,
    TypedArrayAttrBase<FlatSymbolRefAttr, "kernels in a row">:$kernels,
    OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntPositive]>>:$chunk);
  let assemblyFormat = [{
    `source` $source $kernels (`chunk` $chunk^)? attr-dict
  }];
}

def Piko_OpenBinsOp : Piko_Op<"open_bins", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "starts a kernel over the bins of a stage or over a source";
  let description = [{
    Joins what the stage's producers left, in lineage order. With `source` the
    primitives are those that the host feeds to that source of the stage, in one
    bin.

    ```mlir
    %bins = piko.open_bins @shade : !piko.bins<@Fragment>
    %first = piko.open_bins @rasterize source 0 : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, OptionalAttr<Piko_I64Attr>:$source);
  let results = (outs Piko_BinsType:$bins);
  let assemblyFormat = [{
    $stage (`source` $source^)? attr-dict `:` qualified(type($bins))
  }];
}

def Piko_CloseBinsOp : Piko_Op<"close_bins"> {
  let summary = "ends a kernel";
  let description = [{
    Joins what the units of work emitted, in order, into the bins of the stages
    that come next.

    ```mlir
    piko.close_bins %bins : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

def Piko_UnitCountOp : Piko_Op<"unit_count", [Pure]> {
  let summary = "how many units of work there are";
  let description = [{
    ```mlir
    %n = piko.unit_count %bins : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins);
  let results = (outs Index:$result);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

def Piko_UnitCellsOp : Piko_Op<"unit_cells", [Pure]> {
  let summary = "the cells of a unit of work";
  let description = [{
    The range is half open. Of a stage that takes lists it is the calls of its
    process phase.

    ```mlir
    %c0, %c1 = piko.unit_cells %bins[%unit] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$unit);
  let results = (outs Index:$begin, Index:$end);
  let assemblyFormat = "$bins `[` $unit `]` attr-dict `:` qualified(type($bins))";
}

def Piko_CellRangeOp : Piko_Op<"cell_range", [Pure]> {
  let summary = "the positions of a cell that a unit of work holds";
  let description = [{
    The range is half open.

    ```mlir
    %lo, %hi = piko.cell_range %bins[%unit, %cell] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$unit, Index:$cell);
  let results = (outs Index:$begin, Index:$end);
  let assemblyFormat = [{
    $bins `[` $unit `,` $cell `]` attr-dict `:` qualified(type($bins))
  }];
}

def Piko_CellBinOp : Piko_Op<"cell_bin", [Pure]> {
  let summary = "the bin that a cell belongs to";
  let description = [{
    ```mlir
    %b = piko.cell_bin %bins[%cell] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$cell);
  let results = (outs Index:$result);
  let assemblyFormat = "$bins `[` $cell `]` attr-dict `:` qualified(type($bins))";
}

def Piko_CallRangeOp : Piko_Op<"call_range", [Pure]> {
  let summary = "the positions that a call of a list Process is for";
  let description = [{
    A call is for a bin, or for a batch of it. The range is half open, and empty
    for an empty bin that runs nevertheless.

    ```mlir
    %lo, %hi = piko.call_range %bins[%call] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$call);
  let results = (outs Index:$begin, Index:$end);
  let assemblyFormat = "$bins `[` $call `]` attr-dict `:` qualified(type($bins))";
}

def Piko_CallBinOp : Piko_Op<"call_bin", [Pure]> {
  let summary = "the bin that a call of a list Process is for";
  let description = [{
    ```mlir
    %b = piko.call_bin %bins[%call] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$call);
  let results = (outs Index:$result);
  let assemblyFormat = "$bins `[` $call `]` attr-dict `:` qualified(type($bins))";
}

def Piko_ListOp : Piko_Op<"list", [Pure]> {
  let hasVerifier = 1;
  let summary = "the primitives at consecutive positions";
  let description = [{
    ```mlir
    %l = piko.list %bins[%lo to %hi] : !piko.bins<@Fragment> -> !piko.list<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$begin, Index:$end);
  let results = (outs Piko_ListType:$list);
  let assemblyFormat = [{
    $bins `[` $begin `to` $end `]` attr-dict
    `:` qualified(type($bins)) `->` qualified(type($list))
  }];
}

def Piko_ItemOp : Piko_Op<"item", [Pure]> {
  let hasVerifier = 1;
  let summary = "the primitive at a position";
  let description = [{
    ```mlir
    %p = piko.item %bins[%i] : !piko.bins<@Fragment> -> !piko.prim<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$position);
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = [{
    $bins `[` $position `]` attr-dict
    `:` qualified(type($bins)) `->` qualified(type($prim))
  }];
}

def Piko_PrefetchItemOp : Piko_Op<"prefetch_item"> {
  let summary = "says that the primitive at a position will be read";
  let description = [{
    A hint that changes nothing; the position is that of a primitive.

    ```mlir
    piko.prefetch_item %bins[%i] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$position);
  let assemblyFormat = [{
    $bins `[` $position `]` attr-dict `:` qualified(type($bins))
  }];
}

def Piko_OpenWriterOp : Piko_Op<"open_writer", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "where a unit of work leaves what it emits";
  let description = [{
    With `of` it is for the emissions of another stage, which runs in the same
    kernel (`piko.local_bin`).

    ```mlir
    %w = piko.open_writer %bins[%unit] : !piko.bins<@Fragment>
    %v = piko.open_writer %bins[%unit] of @shade : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$unit,
                       OptionalAttr<FlatSymbolRefAttr>:$stage);
  let results = (outs Piko_WriterType:$writer);
  let assemblyFormat = [{
    $bins `[` $unit `]` (`of` $stage^)? attr-dict `:` qualified(type($bins))
  }];
}

def Piko_LocalBinOp : Piko_Op<"local_bin", [
    SingleBlock, NoTerminator,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "runs a stage on what a port has emitted in a bin";
  let description = [{
    A local barrier: the body is the stage's, and its argument holds all that the
    port of the first writer has kept since the last time, in the order of its
    emission, as the one unit, and the one cell, of a bin. Of a stage that takes
    a list, the cells of the unit are the calls. It is gone at the end. What the
    stage emits goes to the second writer.

    ```mlir
    %other = piko.open_writer %bins[%unit] of @plot : !piko.bins<@Fragment>
    piko.local_bin @plot from %writer[0] writer %other {
    ^bb0(%local: !piko.bins<@Point>):
      %c0, %c1 = piko.unit_cells %local[%unit] : !piko.bins<@Point>
      piko.next %other
    }
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Piko_WriterType:$source,
                       Piko_I64Attr:$port, Piko_WriterType:$writer);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    $stage `from` $source `[` $port `]` `writer` $writer
    attr-dict-with-keyword $body
  }];
  let extraClassDeclaration = [{
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
    ::mlir::Value getBins() { return getBody().getArgument(0); }
  }];
}

def Piko_CloseWriterOp : Piko_Op<"close_writer"> {
  let summary = "the unit of work has ended";
  let description = [{
    ```mlir
    piko.close_writer %writer
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_AppendOp : Piko_Op<"append", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "stores a primitive that a port emits";
  let description = [{
    The result is the primitive as it was stored.

    ```mlir
    %p = piko.append %writer[0] (%u, %v) : f32, f32 -> !piko.prim<@Point>
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Piko_I64Attr:$port,
                       Variadic<Piko_Scalar>:$values);
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = [{
    $writer `[` $port `]` (`(` $values^ `)` `:` type($values))? `->`
    qualified(type($prim)) attr-dict
  }];
}

def Piko_PlaceOp : Piko_Op<"place", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "puts what a port emitted last into a bin";
  let description = [{
    Where the stage's bins are divided into tiles, the tile stands behind the
    bin. Without a port it places the current primitive of a source. A bin
    outside the grid is an error when the pipeline runs.

    ```mlir
    piko.place %writer[0] of @plot in %bin
    piko.place %writer[0] of @plot in %bin tile %tile
    ```
    ```mlir
    %first = piko.open_bins @rasterize source 0 : !piko.bins<@Fragment>
    %placer = piko.open_writer %first[%unit] : !piko.bins<@Fragment>
    piko.place %placer of @rasterize in %bin
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, OptionalAttr<Piko_I64Attr>:$port,
                       FlatSymbolRefAttr:$stage, Index:$bin,
                       Optional<Index>:$tile);
  let assemblyFormat = [{
    $writer (`[` $port^ `]`)? `of` $stage `in` $bin (`tile` $tile^)? attr-dict
  }];
}

def Piko_NextOp : Piko_Op<"next"> {
  let summary = "all that follows comes from the next primitive";
  let description = [{
    ```mlir
    piko.next %writer
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_DeferBeginOp : Piko_Op<"defer_begin"> {
  let summary = "what iterations emit is put in their order later";
  let description = [{
    From here to `piko.defer_end`, primitives are kept for each of so many
    iterations; there they follow each other by iteration, then as they came.

    ```mlir
    piko.defer_begin %writer[%n]
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Index:$iterations);
  let assemblyFormat = "$writer `[` $iterations `]` attr-dict";
}

def Piko_DeferIterationOp : Piko_Op<"defer_iteration"> {
  let summary = "all that follows comes from this iteration";
  let description = [{
    ```mlir
    piko.defer_iteration %writer[%i]
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Index:$iteration);
  let assemblyFormat = "$writer `[` $iteration `]` attr-dict";
}

def Piko_DeferEndOp : Piko_Op<"defer_end"> {
  let summary = "emits what iterations have kept";
  let description = [{
    ```mlir
    piko.defer_end %writer
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_ScratchMarkOp : Piko_Op<"scratch_mark"> {
  let summary = "how much scratch memory is in use";
  let description = [{
    ```mlir
    %mark = piko.scratch_mark %writer
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer);
  let results = (outs I64:$mark);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_ScratchOp : Piko_Op<"scratch"> {
  let summary = "takes scratch memory of so many bytes";
  let description = [{
    The second result is false where there was none: the run then ends with an
    error, and the memory must not be used.

    ```mlir
    %bytes, %granted = piko.scratch %writer[%n]
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Index:$size);
  let results = (outs Piko_Bytes:$bytes, I1:$granted);
  let assemblyFormat = "$writer `[` $size `]` attr-dict";
}

def Piko_ScratchReleaseOp : Piko_Op<"scratch_release"> {
  let summary = "gives back the scratch memory taken since a mark";
  let description = [{
    ```mlir
    piko.scratch_release %writer[%mark]
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, I64:$mark);
  let assemblyFormat = "$writer `[` $mark `]` attr-dict";
}

def Piko_NoItemOp : Piko_Op<"no_item", [Pure]> {
  let summary = "a primitive of zeros";
  let description = [{
    What a read outside a list gives, in a run that ends with an error.

    ```mlir
    %p = piko.no_item : !piko.prim<@Fragment>
    ```
  }];
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = "attr-dict `:` qualified(type($prim))";
}

def Piko_ToAddressOp : Piko_Op<"to_address", [Pure]> {
  let summary = "where a primitive is, as a number that memory can hold";
  let description = [{
    ```mlir
    %a = piko.to_address %p : !piko.prim<@Fragment>
    ```
  }];
  let arguments = (ins Piko_PrimType:$prim);
  let results = (outs Index:$address);
  let assemblyFormat = "$prim attr-dict `:` qualified(type($prim))";
}

def Piko_FromAddressOp : Piko_Op<"from_address", [Pure]> {
  let summary = "the primitive that is at an address";
  let description = [{
    The address is that of a primitive of the same record, by
    `piko.to_address`, in the same kernel.

    ```mlir
    %p = piko.from_address %a : !piko.prim<@Fragment>
    ```
  }];
  let arguments = (ins Index:$address);
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = "$address attr-dict `:` qualified(type($prim))";
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

def Piko_ThreadsOp : Piko_Op<"threads", [Pure]> {
  let summary = "how many threads the host asked for";
  let description = [{
    ```mlir
    %n = piko.threads
    ```
  }];
  let results = (outs I32:$result);
  let assemblyFormat = "attr-dict";
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
