// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What lowerings make of kernels: loops over the storage of bins, cut into units
// of work (`piko.storage.*`, every target's), and the writers that the CPU's
// units leave what they emit in (`piko.cpu.*`).

#ifndef PIKO_DIALECT_PIKO_IR_PIKOCPUOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOCPUOPS_TD

include "Piko/Dialect/Piko/IR/PikoAttributes.td"
include "Piko/Dialect/Piko/IR/PikoInterfaces.td"
include "Piko/Dialect/Piko/IR/PikoTypes.td"

class Piko_CPUOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<"cpu." # mnemonic, !listconcat([Piko_TargetLevel], traits)>;

/// How bins are stored is the runtime's business, for every target.
class Piko_StorageOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<"storage." # mnemonic, !listconcat([Piko_TargetLevel], traits)>;

def Piko_OpenBinsOp : Piko_StorageOp<"open_bins", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "starts a kernel over the bins of a stage or over a source";
  let description = [{
    Joins what the stage's producers left, in lineage order. With `source` the
    primitives are those that the host feeds to that source of the stage, in one
    bin.

    ```mlir
    %bins = piko.storage.open_bins @shade : !piko.bins<@Fragment>
    %first = piko.storage.open_bins @rasterize source 0 : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, OptionalAttr<Piko_I64Attr>:$source);
  let results = (outs Piko_BinsType:$bins);
  let assemblyFormat = [{
    $stage (`source` $source^)? attr-dict `:` qualified(type($bins))
  }];
}

def Piko_CloseBinsOp : Piko_StorageOp<"close_bins"> {
  let summary = "ends a kernel";
  let description = [{
    Joins what the units of work emitted, in order, into the bins of the stages
    that come next.

    ```mlir
    piko.storage.close_bins %bins : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

def Piko_UnitCountOp : Piko_StorageOp<"unit_count", [Pure]> {
  let summary = "how many units of work there are";
  let description = [{
    ```mlir
    %n = piko.storage.unit_count %bins : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins);
  let results = (outs Index:$result);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

def Piko_ClearsOp : Piko_StorageOp<"clears", [Pure]> {
  let summary = "whether tiles begin with their clear value";
  let description = [{
    In the first launch of a kernel that clears images: see `piko.launch`.

    ```mlir
    %first = piko.storage.clears %bins : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins);
  let results = (outs I1:$result);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

def Piko_UnitBucketsOp : Piko_StorageOp<"unit_buckets", [Pure]> {
  let summary = "the buckets of a unit of work";
  let description = [{
    The range is half open. Of a stage that takes lists it is the calls of its
    process phase.

    ```mlir
    %c0, %c1 = piko.storage.unit_buckets %bins[%unit] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$unit);
  let results = (outs Index:$begin, Index:$end);
  let assemblyFormat = "$bins `[` $unit `]` attr-dict `:` qualified(type($bins))";
}

def Piko_BucketRangeOp : Piko_StorageOp<"bucket_range", [Pure]> {
  let summary = "the positions of a bucket that a unit of work holds";
  let description = [{
    The range is half open.

    ```mlir
    %lo, %hi = piko.storage.bucket_range %bins[%unit, %bucket] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$unit, Index:$bucket);
  let results = (outs Index:$begin, Index:$end);
  let assemblyFormat = [{
    $bins `[` $unit `,` $bucket `]` attr-dict `:` qualified(type($bins))
  }];
}

def Piko_BucketBinOp : Piko_StorageOp<"bucket_bin", [Pure]> {
  let summary = "the bin that a bucket belongs to";
  let description = [{
    ```mlir
    %b = piko.storage.bucket_bin %bins[%bucket] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$bucket);
  let results = (outs Index:$result);
  let assemblyFormat = "$bins `[` $bucket `]` attr-dict `:` qualified(type($bins))";
}

def Piko_CallRangeOp : Piko_StorageOp<"call_range", [Pure]> {
  let summary = "the positions that a call of a list Process is for";
  let description = [{
    A call is for a bin, or for a batch of it. The range is half open, and empty
    for an empty bin that runs nevertheless.

    ```mlir
    %lo, %hi = piko.storage.call_range %bins[%call] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$call);
  let results = (outs Index:$begin, Index:$end);
  let assemblyFormat = "$bins `[` $call `]` attr-dict `:` qualified(type($bins))";
}

def Piko_CallBinOp : Piko_StorageOp<"call_bin", [Pure]> {
  let summary = "the bin that a call of a list Process is for";
  let description = [{
    ```mlir
    %b = piko.storage.call_bin %bins[%call] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$call);
  let results = (outs Index:$result);
  let assemblyFormat = "$bins `[` $call `]` attr-dict `:` qualified(type($bins))";
}

def Piko_ListOp : Piko_StorageOp<"list", [Pure]> {
  let hasVerifier = 1;
  let summary = "the primitives at consecutive positions";
  let description = [{
    ```mlir
    %l = piko.storage.list %bins[%lo to %hi] : !piko.bins<@Fragment> -> !piko.list<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$begin, Index:$end);
  let results = (outs Piko_ListType:$list);
  let assemblyFormat = [{
    $bins `[` $begin `to` $end `]` attr-dict
    `:` qualified(type($bins)) `->` qualified(type($list))
  }];
}

def Piko_ItemOp : Piko_StorageOp<"item", [Pure]> {
  let hasVerifier = 1;
  let summary = "the primitive at a position";
  let description = [{
    ```mlir
    %p = piko.storage.item %bins[%i] : !piko.bins<@Fragment> -> !piko.prim<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$position);
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = [{
    $bins `[` $position `]` attr-dict
    `:` qualified(type($bins)) `->` qualified(type($prim))
  }];
}

def Piko_ListMemory : MemRefRankOf<[F32, F64, I8, I16, I32, I64, Index], [1]>;
def Piko_ListCount : MemRefRankOf<[I32, I64, Index], [1]>;

def Piko_PushOp : Piko_StorageOp<"push", [
    AttrSizedOperandSegments, MemoryEffects<[MemRead, MemWrite]>]> {
  let hasVerifier = 1;
  let summary = "appends numbers to lists of one length";
  let description = [{
    Stores each number into its array at the count, which is the first element of its
    own array, and counts one up. With `below`, only where the count is less than that
    number; `unsigned` says how these two compare. Lanes of a vector push one after
    the other, by stream compaction. With `padded` they may also overwrite what stands
    after the new count: nothing else is in the arrays, which have as many more
    elements as there are lanes. Without a limit a count is inside of the arrays.

    ```mlir
    %zs = memref.alloca() : memref<64xf32>
    %numbers = memref.alloca() : memref<64xi32>
    %count = memref.alloca() : memref<1xi32>
    piko.storage.push(%z, %x : f32, i32)
      to(%zs, %numbers : memref<64xf32>, memref<64xi32>)
      count %count below %x : memref<1xi32>, i32
    piko.storage.push count %count : memref<1xi32>
    ```
  }];
  let arguments = (ins Variadic<Piko_Scalar>:$values, Variadic<Piko_ListMemory>:$arrays,
                       Piko_ListCount:$count, Optional<AnySignlessIntegerOrIndex>:$limit,
                       UnitAttr:$isUnsigned, UnitAttr:$padded);
  let assemblyFormat = [{
    (`(` $values^ `:` type($values) `)`)? (`to` `(` $arrays^ `:` type($arrays) `)`)?
    `count` $count (`below` $limit^)? (`unsigned` $isUnsigned^)?
    (`padded` $padded^)? attr-dict `:` type($count) (`,` type($limit)^)?
  }];
}

def Piko_PrefetchItemOp : Piko_CPUOp<"prefetch_item"> {
  let summary = "says that the primitive at a position will be read";
  let description = [{
    A hint that changes nothing. After the last position it is for the last one.
    Nothing is asked for where primitives lie in the order of positions.

    ```mlir
    piko.cpu.prefetch_item %bins[%i] : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$position);
  let assemblyFormat = [{
    $bins `[` $position `]` attr-dict `:` qualified(type($bins))
  }];
}

def Piko_OpenWriterOp : Piko_CPUOp<"open_writer", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "where a unit of work leaves what it emits";
  let description = [{
    With `of` it is for the emissions of another stage, which runs in the same
    kernel (`piko.storage.local_bin`).

    ```mlir
    %w = piko.cpu.open_writer %bins[%unit] : !piko.bins<@Fragment>
    %v = piko.cpu.open_writer %bins[%unit] of @shade : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$unit,
                       OptionalAttr<FlatSymbolRefAttr>:$stage);
  let results = (outs Piko_WriterType:$writer);
  let assemblyFormat = [{
    $bins `[` $unit `]` (`of` $stage^)? attr-dict `:` qualified(type($bins))
  }];
}

def Piko_TakesVectorsOp : Piko_CPUOp<"takes_vectors", [
    Pure, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "whether a unit of work runs a loop as vectors";
  let description = [{
    Of a loop that the kernel holds in two versions, both of which do the same:
    the runtime measures which takes less. Loops have numbers from 0 in the
    kernel; one that is in the scalar version of another names it, `within`.
    `vectors` and `scalar` are the cycles that the versions are expected to take
    for as many iterations as there are lanes, and `expected` says that the vectors
    are expected to be faster.

    ```mlir
    %0 = piko.cpu.takes_vectors %writer {
      expected, loop = "process, raster.cpp:12", number = 0, scalar = 140,
      vectors = 120}
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Piko_I64Attr:$number,
                       OptionalAttr<Piko_I64Attr>:$within, UnitAttr:$expected,
                       Piko_I64Attr:$vectors, Piko_I64Attr:$scalar,
                       StrAttr:$loop);
  let results = (outs I1:$result);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_LocalBinOp : Piko_StorageOp<"local_bin", [
    SingleBlock, NoTerminator,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "runs a stage on what a port has emitted in a bin";
  let description = [{
    A local barrier: the body is the stage's, and its argument holds all that the
    port of the first writer has kept since the last time, in the order of its
    emission, as the one unit, and the one bucket, of a bin. Of a stage that takes
    a list, the buckets of the unit are the calls. It is gone at the end. What the
    stage emits goes to the second writer.

    ```mlir
    %other = piko.cpu.open_writer %bins[%unit] of @plot : !piko.bins<@Fragment>
    piko.storage.local_bin @plot from %writer[0] writer %other {
    ^bb0(%local: !piko.bins<@Point>):
      %c0, %c1 = piko.storage.unit_buckets %local[%unit] : !piko.bins<@Point>
      piko.storage.next %other
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

def Piko_CloseWriterOp : Piko_CPUOp<"close_writer"> {
  let summary = "the unit of work has ended";
  let description = [{
    ```mlir
    piko.cpu.close_writer %writer
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_AppendOp : Piko_StorageOp<"append", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "stores a primitive that a port emits";
  let description = [{
    The result is the primitive as it was stored.

    ```mlir
    %p = piko.storage.append %writer[0] (%u, %v) : f32, f32 -> !piko.prim<@Point>
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

def Piko_AppendBinOp : Piko_StorageOp<"append_bin", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "puts what a port emitted last into a bin";
  let description = [{
    Where the stage's bins are divided into tiles, the tile stands after the
    bin. Without a port it places the current primitive of a source. A bin
    outside the grid is an error when the pipeline runs.

    ```mlir
    piko.storage.append_bin %writer[0] of @plot in %bin
    piko.storage.append_bin %writer[0] of @plot in %bin tile %tile
    ```
    ```mlir
    %first = piko.storage.open_bins @rasterize source 0 : !piko.bins<@Fragment>
    %placer = piko.cpu.open_writer %first[%unit] : !piko.bins<@Fragment>
    piko.storage.append_bin %placer of @rasterize in %bin
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, OptionalAttr<Piko_I64Attr>:$port,
                       FlatSymbolRefAttr:$stage, Index:$bin,
                       Optional<Index>:$tile);
  let assemblyFormat = [{
    $writer (`[` $port^ `]`)? `of` $stage `in` $bin (`tile` $tile^)? attr-dict
  }];
}

def Piko_NextOp : Piko_StorageOp<"next"> {
  let summary = "all that follows comes from the next primitive";
  let description = [{
    ```mlir
    piko.storage.next %writer
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_IsCountedOp : Piko_CPUOp<"is_counted"> {
  let summary = "whether `piko.storage.next` has anything to do";
  let description = [{
    It has where the order of what was emitted is to be found from the primitives
    that it came from. That does not change within a unit of work, except between
    `piko.cpu.reorder_begin` and `piko.cpu.reorder_end`.

    ```mlir
    %counted = piko.cpu.is_counted %writer
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer);
  let results = (outs I1:$result);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_ReorderBeginOp : Piko_CPUOp<"reorder_begin"> {
  let summary = "what iterations emit is put in their order later";
  let description = [{
    From here to `piko.cpu.reorder_end`, primitives are kept for each of so many
    iterations; there they follow each other by iteration, then as they came.

    ```mlir
    piko.cpu.reorder_begin %writer[%n]
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Index:$iterations);
  let assemblyFormat = "$writer `[` $iterations `]` attr-dict";
}

def Piko_ReorderIterationOp : Piko_CPUOp<"reorder_iteration"> {
  let summary = "all that follows comes from this iteration";
  let description = [{
    ```mlir
    piko.cpu.reorder_iteration %writer[%i]
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Index:$iteration);
  let assemblyFormat = "$writer `[` $iteration `]` attr-dict";
}

def Piko_ReorderEndOp : Piko_CPUOp<"reorder_end"> {
  let summary = "emits what iterations have kept";
  let description = [{
    ```mlir
    piko.cpu.reorder_end %writer
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_ScratchMarkOp : Piko_CPUOp<"scratch_mark"> {
  let summary = "how much scratch memory is in use";
  let description = [{
    ```mlir
    %mark = piko.cpu.scratch_mark %writer
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer);
  let results = (outs I64:$mark);
  let assemblyFormat = "$writer attr-dict";
}

def Piko_ScratchOp : Piko_CPUOp<"scratch"> {
  let summary = "takes scratch memory of so many bytes";
  let description = [{
    The second result is false where there was none: the run then ends with an
    error, and the memory must not be used.

    ```mlir
    %bytes, %granted = piko.cpu.scratch %writer[%n]
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Index:$size);
  let results = (outs Piko_Bytes:$bytes, I1:$granted);
  let assemblyFormat = "$writer `[` $size `]` attr-dict";
}

def Piko_ScratchReleaseOp : Piko_CPUOp<"scratch_release"> {
  let summary = "gives back the scratch memory taken since a mark";
  let description = [{
    ```mlir
    piko.cpu.scratch_release %writer[%mark]
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, I64:$mark);
  let assemblyFormat = "$writer `[` $mark `]` attr-dict";
}

def Piko_NoItemOp : Piko_StorageOp<"no_item", [Pure]> {
  let summary = "a primitive of zeros";
  let description = [{
    What a read outside a list gives, in a run that ends with an error.

    ```mlir
    %p = piko.storage.no_item : !piko.prim<@Fragment>
    ```
  }];
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = "attr-dict `:` qualified(type($prim))";
}

def Piko_ToAddressOp : Piko_StorageOp<"to_address", [Pure]> {
  let summary = "where a primitive is, as a number that memory can hold";
  let description = [{
    ```mlir
    %a = piko.storage.to_address %p : !piko.prim<@Fragment>
    ```
  }];
  let arguments = (ins Piko_PrimType:$prim);
  let results = (outs Index:$address);
  let assemblyFormat = "$prim attr-dict `:` qualified(type($prim))";
}

def Piko_FromAddressOp : Piko_StorageOp<"from_address", [Pure]> {
  let summary = "the primitive that is at an address";
  let description = [{
    The address is that of a primitive of the same record, by
    `piko.storage.to_address`, in the same kernel.

    ```mlir
    %p = piko.storage.from_address %a : !piko.prim<@Fragment>
    ```
  }];
  let arguments = (ins Index:$address);
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = "$address attr-dict `:` qualified(type($prim))";
}

def Piko_ThreadsOp : Piko_CPUOp<"threads", [Pure]> {
  let summary = "how many threads the host asked for";
  let description = [{
    ```mlir
    %n = piko.cpu.threads
    ```
  }];
  let results = (outs I32:$result);
  let assemblyFormat = "attr-dict";
}

def Piko_ThreadOp : Piko_CPUOp<"thread", [MemoryEffects<[MemRead]>]> {
  let summary = "the number of the thread, of those that share a kernel";
  let description = [{
    ```mlir
    %t = piko.cpu.thread
    ```
  }];
  let results = (outs Index:$result);
  let assemblyFormat = "attr-dict";
}

def Piko_TakeUnitOp : Piko_CPUOp<"take_unit", [
    MemoryEffects<[MemRead, MemWrite]>]> {
  let summary = "the next unit of work, without a scheduler";
  let description = [{
    By an atomic addition: the next one of those that any thread may run, a number that
    is not below their count at the end; or, of a thread, the next one of those that
    have their home with it, -1 at the end.

    ```mlir
    %u = piko.cpu.take_unit %bins : !piko.bins<@Fragment>
    %t = piko.cpu.thread
    %v = piko.cpu.take_unit %bins of %t : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Optional<Index>:$thread);
  let results = (outs Index:$result);
  let assemblyFormat =
      "$bins (`of` $thread^)? attr-dict `:` qualified(type($bins))";
}

def Piko_NextUnitOp : Piko_CPUOp<"next_unit", [
    MemoryEffects<[MemRead, MemWrite]>]> {
  let summary = "the unit of work that a thread runs next";
  let description = [{
    First those that have their home with the thread, in order, then the next one of
    those that any thread may run, then those that others have not begun; -1 at the
    end.

    ```mlir
    %u = piko.cpu.next_unit %bins : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins);
  let results = (outs Index:$result);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

include "Piko/Dialect/Piko/IR/Ops/PikoLaneOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoPrivateOps.td"

#endif // PIKO_DIALECT_PIKO_IR_PIKOCPUOPS_TD
