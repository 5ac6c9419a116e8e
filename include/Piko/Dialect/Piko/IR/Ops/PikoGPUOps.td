// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the GPU's lowering makes of kernels besides grids of blocks and threads:
// the log that a grid leaves what it emits in, and memory of its blocks.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOGPUOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOGPUOPS_TD

include "Piko/Dialect/Piko/IR/PikoTypes.td"

class Piko_GPUOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<"gpu." # mnemonic, !listconcat([Piko_TargetLevel], traits)>;

def Piko_OpenLogOp : Piko_GPUOp<"open_log"> {
  let summary = "what the blocks of a grid leave their emissions in";
  let description = [{
    Takes the place of the writers of a CPU's units. Before the launch.

    ```mlir
    %log = piko.gpu.open_log %bins : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins);
  let results = (outs Piko_WriterType:$log);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

def Piko_BlockCountOp : Piko_GPUOp<"block_count"> {
  let summary = "how many blocks run the units of work";
  let description = [{
    Before the launch. None if there is nothing to do. Where the runtime does
    not know how many units there are, as many as fill the device: a block takes
    one unit after the other.

    ```mlir
    %blocks = piko.gpu.block_count %bins of %threads : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Index:$threads);
  let results = (outs Index:$blocks);
  let assemblyFormat =
      "$bins `of` $threads attr-dict `:` qualified(type($bins))";
}

def Piko_CloseLogOp : Piko_GPUOp<"close_log"> {
  let summary = "gives what a grid has emitted to the runtime, unit by unit";
  let description = [{
    After the launch.

    ```mlir
    piko.gpu.close_log %log
    ```
  }];
  let arguments = (ins Piko_WriterType:$log);
  let assemblyFormat = "$log attr-dict";
}

def Piko_LogOfOp : Piko_GPUOp<"log_of", [Pure]> {
  let summary = "the log, for what another stage of the kernel emits";
  let description = [{
    As `piko.cpu.open_writer` with `of` on a CPU.

    ```mlir
    %other = piko.gpu.log_of %log of @shade
    ```
  }];
  let arguments = (ins Piko_WriterType:$log, FlatSymbolRefAttr:$stage);
  let results = (outs Piko_WriterType:$writer);
  let assemblyFormat = "$log `of` $stage attr-dict";
}

def Piko_AppendBuffersOp : Piko_GPUOp<"append_buffers"> {
  let summary = "where a thread keeps what it emits, until the block takes it";
  let description = [{
    Says for the `gpu.launch` around where each thread has its append buffers: one
    for the log and one for each port of a local edge, of six numbers each. What the
    block has of a local edge is in its memory, four numbers each. `for errors`:
    that of the log is in the log itself, from the first error on, and the first
    number is its address; so a grid that emits nothing keeps one number. `words` are
    those that the block needs to take what is in them (`piko.gpu.flush`).

    ```mlir
    piko.gpu.append_buffers %log in %numbers : memref<6xi64> using %words
      : memref<33xi64, 3>
    piko.gpu.append_buffers %log for errors in %numbers : memref<6xi64> using %words
      : memref<33xi64, 3>
    piko.gpu.append_buffers %log in %more : memref<12xi64> using %words
      : memref<33xi64, 3> local [@test] [0] in %kept : memref<4xi64, 3>
    ```
  }];
  let arguments = (ins Piko_WriterType:$log, MemRefOf<[I64]>:$state,
                       MemRefOf<[I64]>:$words,
                       OptionalAttr<FlatSymbolRefArrayAttr>:$producers,
                       OptionalAttr<DenseI64ArrayAttr>:$ports,
                       Optional<MemRefOf<[I64]>>:$kept,
                       UnitAttr:$forErrors);
  let assemblyFormat = [{
    $log (`for` `errors` $forErrors^)? `in` $state `:` type($state)
    `using` $words `:` type($words)
    (`local` $producers^ $ports `in` $kept `:` type($kept))? attr-dict
  }];
}

def Piko_FlushOp : Piko_GPUOp<"flush"> {
  let summary = "puts what threads have emitted after what the block has";
  let description = [{
    All threads of the block come here; it is a barrier. By one reservation in the
    log the block takes what is in the append buffers, in the order of threads: a
    thread's place follows from votes in its warp and a sum over warps, whose
    numbers are in memory of the block, one for each warp and one more. It belongs
    to a unit of work, which all of them run.

    ```mlir
    piko.gpu.flush %log[%unit] using %words : memref<33xi64, 3>
    ```
  }];
  let arguments = (ins Piko_WriterType:$log, Index:$unit,
      MemRefOf<[I64]>:$words);
  let assemblyFormat =
      "$log `[` $unit `]` `using` $words attr-dict `:` type($words)";
}

def Piko_DeviceCallOp : Piko_GPUOp<"call"> {
  let summary = "calls what kernels have inline of the runtime";
  let description = [{
    A function of `pikort/grid_log.h`, of which the compiler has bitcode. It is
    linked into the kernel and inlined when that is LLVM IR. A memref is passed as
    the address of its first element.

    ```mlir
    piko.gpu.call "pikoir_grid_keep"(%buffers, %stride, %1)
      : (memref<14xi64>, i64, i64) -> ()
    ```
  }];
  let arguments = (ins StrAttr:$callee, Variadic<AnyType>:$args);
  let results = (outs Optional<AnyType>:$result);
  let assemblyFormat = [{
    $callee `(` $args `)` attr-dict `:` functional-type(operands, results)
  }];
}

def Piko_AllocateOp : Piko_GPUOp<"allocate"> {
  let summary = "takes memory for a block, by one of its threads";
  let description = [{
    The address, or 0 where there is no memory: the run then ends with an error.
    It is there until the grid has ended.

    ```mlir
    %address = piko.gpu.allocate %log[%n]
    ```
  }];
  let arguments = (ins Piko_WriterType:$log, Index:$size);
  let results = (outs Index:$address);
  let assemblyFormat = "$log `[` $size `]` attr-dict";
}

def Piko_RestOp : Piko_GPUOp<"rest"> {
  let summary = "where a unit of work goes on";
  let description = [{
    One more than the position from which on the unit's primitives have been left
    to another launch (`piko.gpu.leave_rest`); 0 where none have been.

    ```mlir
    %rest = piko.gpu.rest %log[%unit]
    ```
  }];
  let arguments = (ins Piko_WriterType:$log, Index:$unit);
  let results = (outs Index:$rest);
  let assemblyFormat = "$log `[` $unit `]` attr-dict";
}

def Piko_LeaveRestOp : Piko_GPUOp<"leave_rest"> {
  let summary = "leaves primitives of a unit to the next launch";
  let description = [{
    Those from a position on: the next launch of the same kernel takes them. By one
    thread of a block.

    ```mlir
    piko.gpu.leave_rest %log[%unit] from %position
    ```
  }];
  let arguments = (ins Piko_WriterType:$log, Index:$unit, Index:$position);
  let assemblyFormat = "$log `[` $unit `]` `from` $position attr-dict";
}

def Piko_LeaveRoundOp : Piko_GPUOp<"leave_round"> {
  let summary = "a thread has come to a primitive that the next launch takes";
  let description = [{
    In a loop over primitives that threads share: before this round of it, the block
    leaves the unit to the kernel's second launch. What threads have emitted in the
    round is dropped. `piko-map-blocks` makes a `piko.gpu.leave_rest` of it.

    ```mlir
    piko.gpu.leave_round
    ```
  }];
  let assemblyFormat = "attr-dict";
}

def Piko_DrainOp : Piko_GPUOp<"drain", [
    SingleBlock, NoTerminator, RecursiveMemoryEffects]> {
  let summary = "does what iterations of a shared loop have put off";
  let description = [{
    Of the loop before it. Iterations put an entry into a queue in shared memory, of
    which `count` are there; `lengths` has how many there are of each class of
    length, and `classes` the class of each entry (the lower eight bits) and its
    place in that. The threads of the block do the body for each entry, whose number
    is its argument, the longest first: after the loop, and between rounds of it
    after which another one might find no room. `starts` and `order` are needed on
    the way.

    ```mlir
    scf.for %i = %begin to %end step %one {
      %entry = memref.atomic_rmw addi %one_i32, %count[%zero]
        : (i32, memref<1xi32, 3>) -> i32
      ...
    } {piko.shared}
    piko.gpu.drain %count, %lengths, %starts, %classes, %order : memref<1xi32, 3>,
        memref<32xi32, 3>, memref<32xi32, 3>, memref<96xi32, 3>, memref<96xi16, 3> {
    ^bb0(%entry: index):
      piko.atomic add @counts[%entry : index] "n", %one_i32 : i32
    }
    ```
  }];
  let arguments = (ins MemRefRankOf<[I32], [1]>:$count,
                       MemRefRankOf<[I32], [1]>:$lengths,
                       MemRefRankOf<[I32], [1]>:$starts,
                       MemRefRankOf<[I32], [1]>:$classes,
                       MemRefRankOf<[I16], [1]>:$order);
  let regions = (region SizedRegion<1>:$body);
  let hasRegionVerifier = 1;
  let assemblyFormat = [{
    operands attr-dict `:` type(operands) $body
  }];
  let extraClassDeclaration = [{
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
    ::mlir::Value getEntry() { return getBody().getArgument(0); }
    /// How many entries the queue has room for.
    int64_t getCapacity() { return getOrder().getType().getNumElements(); }
  }];
}

def Piko_TakeUnitsOp : Piko_GPUOp<"take_units"> {
  let summary = "takes the next units of work for a block";
  let description = [{
    So many, by one thread of a block: the number of the first one, which may be
    after the last unit. Each is given once to all blocks of a launch. `for rest`
    counts those of the kernel's second launch.

    ```mlir
    %first = piko.gpu.take_units %log[%n]
    %again = piko.gpu.take_units %log[%n] for rest
    ```
  }];
  let arguments = (ins Piko_WriterType:$log, Index:$count, UnitAttr:$rest);
  let results = (outs Index:$first);
  let assemblyFormat = "$log `[` $count `]` (`for` `rest` $rest^)? attr-dict";
}

def Piko_BytesAtOp : Piko_GPUOp<"bytes_at", [Pure]> {
  let summary = "so many bytes from an address on";
  let description = [{
    ```mlir
    %bytes = piko.gpu.bytes_at %address[%n]
    ```
  }];
  let arguments = (ins Index:$address, Index:$size);
  let results = (outs Piko_Bytes:$bytes);
  let assemblyFormat = "$address `[` $size `]` attr-dict";
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOGPUOPS_TD
