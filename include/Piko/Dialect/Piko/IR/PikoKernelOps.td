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
    pipeline; a kernel starts when the one before it has ended. At the kernels
    level the body holds phases: the process phase of a stage and the assign
    phases of the stages that it feeds, or the assign phase of a source. At the
    resolved level it holds loops over the units of work of a stage's bins, the
    first of which is an `scf.forall`, and no phase.
  }];
  let arguments = (ins SymbolNameAttr:$sym_name);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = "$sym_name attr-dict-with-keyword $body";
  let hasRegionVerifier = 1;
  let extraClassDeclaration = [{
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
    /// The process phase, or null (a source's kernel, or the resolved level).
    ProcessOp getProcess();
  }];
}

def Piko_OpenBinsOp : Piko_Op<"open_bins", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "starts a kernel over the bins of a stage or over a source";
  let description = [{
    `%bins = piko.open_bins @shade : !piko.bins<@Fragment>` joins what the
    stage's producers left, in lineage order. With `source` the primitives are
    those that the host feeds to that source of the stage, in one bin.
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
    `piko.close_bins %bins : !piko.bins<@Fragment>` joins what the units of
    work emitted, in order, into the bins of the stages that come next.
  }];
  let arguments = (ins Piko_BinsType:$bins);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

def Piko_UnitCountOp : Piko_Op<"unit_count", [Pure]> {
  let summary = "how many units of work there are";
  let description = "`%n = piko.unit_count %bins : !piko.bins<@F>`.";
  let arguments = (ins Piko_BinsType:$bins);
  let results = (outs Index:$result);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

def Piko_UnitCellsOp : Piko_Op<"unit_cells", [Pure]> {
  let summary = "the cells of a unit of work";
  let description = [{
    `%c0, %c1 = piko.unit_cells %bins[%u] : !piko.bins<@F>`, half open.
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$unit);
  let results = (outs Index:$begin, Index:$end);
  let assemblyFormat = "$bins `[` $unit `]` attr-dict `:` qualified(type($bins))";
}

def Piko_CellRangeOp : Piko_Op<"cell_range", [Pure]> {
  let summary = "the positions of a cell that a unit of work holds";
  let description = [{
    `%lo, %hi = piko.cell_range %bins[%u, %c] : !piko.bins<@F>`, half open.
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$unit, Index:$cell);
  let results = (outs Index:$begin, Index:$end);
  let assemblyFormat = [{
    $bins `[` $unit `,` $cell `]` attr-dict `:` qualified(type($bins))
  }];
}

def Piko_CellBinOp : Piko_Op<"cell_bin", [Pure]> {
  let summary = "the bin that a cell belongs to";
  let description = "`%b = piko.cell_bin %bins[%c] : !piko.bins<@F>`.";
  let arguments = (ins Piko_BinsType:$bins, Index:$cell);
  let results = (outs Index:$result);
  let assemblyFormat = "$bins `[` $cell `]` attr-dict `:` qualified(type($bins))";
}

def Piko_ItemOp : Piko_Op<"item", [Pure]> {
  let summary = "the primitive at a position";
  let description = "`%p = piko.item %bins[%i] : !piko.bins<@F> -> !piko.prim<@F>`.";
  let arguments = (ins Piko_BinsType:$bins, Index:$position);
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = [{
    $bins `[` $position `]` attr-dict
    `:` qualified(type($bins)) `->` qualified(type($prim))
  }];
}

def Piko_OpenWriterOp : Piko_Op<"open_writer"> {
  let summary = "where a unit of work leaves what it emits";
  let description = "`%w = piko.open_writer %bins[%u] : !piko.bins<@F>`.";
  let arguments = (ins Piko_BinsType:$bins, Index:$unit);
  let results = (outs Piko_WriterType:$writer);
  let assemblyFormat = "$bins `[` $unit `]` attr-dict `:` qualified(type($bins))";
}

def Piko_CloseWriterOp : Piko_Op<"close_writer"> {
  let summary = "the unit of work has ended";
  let description = "`piko.close_writer %w`.";
  let arguments = (ins Piko_WriterType:$writer);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_AppendOp : Piko_Op<"append"> {
  let summary = "stores a primitive that a port emits";
  let description = [{
    `%p = piko.append %w[0] (%x, %y) : f32, f32 -> !piko.prim<@F>`; the result
    is the primitive as it was stored.
  }];
  let arguments = (ins Piko_WriterType:$writer, Piko_I64Attr:$port,
                       Variadic<Piko_Scalar>:$values);
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = [{
    $writer `[` $port `]` (`(` $values^ `)` `:` type($values))? `->`
    qualified(type($prim)) attr-dict
  }];
}

def Piko_PlaceOp : Piko_Op<"place"> {
  let summary = "puts what a port emitted last into a bin";
  let description = [{
    `piko.place %w[0] of @shade in %bin`, and where the stage's bins are
    divided into tiles the tile behind it: `piko.place %w[0] of @depth in %bin
    tile %t`. Without a port it places the current primitive of a source. A bin
    outside the grid is an error when the pipeline runs.
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
  let description = "`piko.next %w`.";
  let arguments = (ins Piko_WriterType:$writer);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_ThreadsOp : Piko_Op<"threads", [Pure]> {
  let summary = "how many threads the host asked for";
  let description = "`%n = piko.threads`.";
  let results = (outs I32:$result);
  let assemblyFormat = "attr-dict";
}

def Piko_GridOp : Piko_Op<"grid", [Pure]> {
  let summary = "how many bins a stage has in a dimension";
  let description = [{
    `%n = piko.grid @shade[0]`; with `tiles` it is how many tiles a bin of the
    stage has.
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Piko_I64Attr:$dim, UnitAttr:$tiles);
  let results = (outs Index:$result);
  let assemblyFormat = "$stage `[` $dim `]` (`tiles` $tiles^)? attr-dict";
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOKERNELOPS_TD
