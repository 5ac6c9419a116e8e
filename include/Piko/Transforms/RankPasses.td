// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that divide a run among processes.

#ifndef PIKO_TRANSFORMS_RANKPASSES_TD
#define PIKO_TRANSFORMS_RANKPASSES_TD

include "mlir/Pass/PassBase.td"

def BinUpdates : Pass<"piko-bin-updates", "::piko::PipelineOp"> {
  let summary = "Give bins to stages that update the pixel of a primitive";
  let description = [{
    **Requires** the authored level.

    **Does**: gives a stage whose only bin is the whole domain bins of 32 x 32 pixels
    (1024, 16 x 16 x 16, or 8 in each of four dimensions), and assigns each primitive to
    the bin of the pixel that its process phase updates, so that ranks can share the
    stage.

    **Guarantees** that the calls for a pixel run in the order in which they did, and
    that a pixel outside of the domain is the same error, though of another bin.

    Before:
    ```
    piko.stage @mark bins [0, 0] threads 64 : @F -> [] {
      piko.process {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.update @count[%x, %x : i32, i32] {
        ...
    ```
    After:
    ```
    piko.stage @mark bins [32, 32] threads 64 : @F -> [] {
      piko.assign {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %at = piko.bin_at %x, %x : i32, i32
        %bin = arith.maxsi %at, %c0 : index
        piko.assign_to %bin
        ...
    ```

    **Limits**: all updates of a call are of one pixel, whose coordinates follow from
    the primitive and constants. A stage that asks for its bin, takes a list, or waits and
    emits keeps its bin. A stage with an assign phase must say the same bin there.
  }];
  let statistics = [Statistic<"binned", "num-binned", "Stages with new bins">];
}

def PartitionProgram : Pass<"piko-partition-program", "::piko::PipelineOp"> {
  let summary = "Divide the run among ranks that own bins";
  let description = [{
    **Requires** the kernels or the machine level with a `piko.program`.

    **Does**: says of each stage who runs it (`piko.partition`). A stage with bins is
    divided by them. One whose bin is the whole domain is divided by primitives, if
    its calls may run anywhere: each rank runs what it has been fed, or has emitted.
    One that a source feeds, and that stores what takes longer to send than to compute,
    is run by each rank. A loop is divided as one stage is, if nothing in it leaves its
    bin. All else runs on the first rank: other stages of cycles, and those whose
    results show an order that ranks do not know. Where an edge leads from one rank to
    another it becomes a `piko.exchange`; where the bins of both ends are the same there
    is none. Of a source whose bins take long to find each rank finds those of a part,
    and bins alone are exchanged. Primitives that are exchanged get lineage keys, and so
    does what leads to them, unless ranks have them in the order of lineage, as parts of
    one source. State that a kernel uses and others have written is brought together
    before (`piko.keep`, `piko.share`), or only to the owners of pixels if these use them
    next, and what is left at the end goes to the first rank. `piko.common` names images
    of which each rank uses its own bins alone. `direct_map` asks for owners of
    neighbouring bins. Of each strip ranks have a part; a `piko.strips` that has cycles,
    that edges leave, or that would share state after each strip, is taken apart.

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
    piko.common @color of @b
    ...
    %2 = piko.launch @kernel_a(%1) : ...
    %3 = piko.exchange %2 : !piko.edge<@F>
    %4 = piko.join @b(concatenate %3) : ...
    piko.launch @kernel_b(%4) : ...
    piko.share @color of @b to_first
    ```

    **Limits**: a program that checks itself runs on the first rank as a whole. Remarks
    say why a stage is not divided.
  }];
  let statistics = [
    Statistic<"divided", "num-divided", "Stages that several ranks run">,
    Statistic<"replicated", "num-replicated", "Stages that each rank runs">,
    Statistic<"exchanges", "num-exchanges", "Edges that lead between ranks">];
}

#endif // PIKO_TRANSFORMS_RANKPASSES_TD
