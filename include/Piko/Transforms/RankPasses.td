// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that divide a run among processes.

#ifndef PIKO_TRANSFORMS_RANKPASSES_TD
#define PIKO_TRANSFORMS_RANKPASSES_TD

include "mlir/Pass/PassBase.td"

def PartitionProgram : Pass<"piko-partition-program", "::piko::PipelineOp"> {
  let summary = "Divide the run among ranks that own bins";
  let description = [{
    **Requires** the kernels or the machine level with a `piko.program`.

    **Does**: says of each stage who runs it (`piko.partition`). A stage with bins is
    divided by them. One whose bin is the whole domain is divided by primitives, if
    its calls may run anywhere: each rank runs what it has been fed, or has emitted.
    All else runs on the first rank: stages of cycles, and those whose results show an
    order that ranks do not know. Where an edge leads from one rank to another it
    becomes a `piko.exchange`; where the bins of both ends are the same there is none.
    Primitives that are exchanged get lineage keys, and so does what leads to them.
    State that a kernel uses and others have written is brought together before
    (`piko.keep`, `piko.share`), and what is left at the end goes to the first rank. Each
    `piko.strips` is taken apart, as ranks meet between the launches of a strip.

    **Guarantees** that each bin takes what it did, in the same order, for any number
    of ranks, and that all ranks run the same exchanges in the same order.

    Before:
    ```
    %2 = piko.launch @kernel_a(%1) : ...
    %3 = piko.join @b(concatenate %2) : ...
    piko.launch @kernel_b(%3) : ...
    ```
    After, where `@a` has one bin, and `@b` updates pixels in its bins:
    ```
    piko.partition @a parts
    piko.partition @b bins
    ...
    %2 = piko.launch @kernel_a(%1) : ...
    %3 = piko.exchange %2 : !piko.edge<@F>
    %4 = piko.join @b(concatenate %3 keys 2) : ...
    piko.launch @kernel_b(%4) : ...
    piko.share @color of @b to_first
    ```

    **Limits**: a program that checks itself runs on the first rank as a whole. Remarks
    say why a stage is not divided.
  }];
  let statistics = [
    Statistic<"divided", "num-divided", "Stages that several ranks run">,
    Statistic<"exchanges", "num-exchanges", "Edges that lead between ranks">];
}

#endif // PIKO_TRANSFORMS_RANKPASSES_TD
