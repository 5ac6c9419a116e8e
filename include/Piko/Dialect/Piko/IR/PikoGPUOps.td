// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the GPU's lowering makes of kernels besides grids of blocks and threads:
// the log that a grid leaves what it emits in, and memory of its blocks.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOGPUOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOGPUOPS_TD

include "Piko/Dialect/Piko/IR/PikoTypes.td"

/// Says that an operation is a target's: no kernel of the machine level has it.
def Piko_GPUOnly : NativeOpTrait<"CPUOnly"> {
  let cppNamespace = "::piko";
}

class Piko_GPUOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<"gpu." # mnemonic, !listconcat([Piko_GPUOnly], traits)>;

def Piko_OpenLogOp : Piko_GPUOp<"open_log"> {
  let summary = "what all threads of a grid leave their emissions in";
  let description = [{
    Takes the place of the writers of a CPU's units: `piko.storage.append` and its
    like add entries, in any order. In front of the launch.

    ```mlir
    %log = piko.gpu.open_log %bins : !piko.bins<@Fragment>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins);
  let results = (outs Piko_WriterType:$log);
  let assemblyFormat = "$bins attr-dict `:` qualified(type($bins))";
}

def Piko_CloseLogOp : Piko_GPUOp<"close_log"> {
  let summary = "gives the entries of a grid's log to the runtime, in order";
  let description = [{
    Behind the launch.

    ```mlir
    piko.gpu.close_log %log
    ```
  }];
  let arguments = (ins Piko_WriterType:$log);
  let assemblyFormat = "$log attr-dict";
}

def Piko_LogOrderOp : Piko_GPUOp<"log_order"> {
  let summary = "where a thread keeps the order of what it adds to a log";
  let description = [{
    Says for the `gpu.launch` around which numbers order the entries of a block:
    the step that the block has come to, the iteration of a loop that its threads
    share, the piece of that loop, and the number of the entry there.

    ```mlir
    piko.gpu.log_order %log in %order : memref<4xi64>
    ```
  }];
  let arguments = (ins Piko_WriterType:$log, MemRefOf<[I64]>:$order);
  let assemblyFormat = "$log `in` $order attr-dict `:` type($order)";
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
