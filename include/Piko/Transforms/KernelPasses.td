// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that form kernels of phases, and those on kernels.

#ifndef PIKO_TRANSFORMS_KERNELPASSES_TD
#define PIKO_TRANSFORMS_KERNELPASSES_TD

include "mlir/Pass/PassBase.td"

def FormKernels : Pass<"piko-form-kernels", "::piko::PipelineOp"> {
  let summary = "Group phases into kernels, the BASELINE way";
  let description = [{
    **Requires** the authored level with stages in order (`piko-order-stages`).

    **Does**: makes a kernel of the process phase of each stage and the assign
    phases of the stages that its ports feed; and one of the assign phase for
    each source whose stage has an assign phase. Kernels stand in the order in
    which they run. A schedule that only says where bins run has no code of its
    own and stays with the stage.
    An assign phase that puts everything into the one bin that there is needs no
    code and is left out.

    **Guarantees** the kernels level: stages hold no process or assign phase.

    Before:
    ```
    piko.stage @a ... { piko.process { ... } }
    piko.stage @b ... { piko.assign { ... } piko.process { ... } }
    ```
    After, with an edge from `@a` to `@b`:
    ```
    piko.kernel @kernel_a {
      piko.process of @a { ... }
      piko.assign of @b port 0 { ... }
    }
    piko.kernel @kernel_b { piko.process of @b { ... } }
    ```

    **Limits**: an assign phase that reads state which a stage may still write
    when the primitives arrive is an error. What can be merged further is for
    other passes.
  }];
}

def FuseKernels : Pass<"piko-fuse-kernels", "::piko::PipelineOp"> {
  let summary = "Run stages for a bin, one after another, before the next bin";
  let description = [{
    **Requires** the kernels level, before `piko-form-program`; best after
    `piko-infer-directives`.

    **Does**: merges the kernel of a stage that takes a list, or waits with
    `end_bin`, into the kernel of the stage that feeds it, behind a
    `piko.local_barrier`. So the wait is for the bin alone, the primitives
    between the two are stored for one bin of each thread at a time, and as many
    successive stages as possible run for one bin before the next. Both stages
    have bins of one size, one edge and no source lead to the consumer, and
    `piko.assign_previous` is all that assigns it. Schedules put a bin onto one
    core for both: they are alike, or the consumer's is `load_balance` and the
    producer does not have `serialize`.

    **Guarantees** that lists, updates of a pixel and emissions keep their lineage
    order.

    Before:
    ```
    piko.kernel @kernel_a {
      piko.process of @a { ... piko.emit 0 (%x) : i32 ... }
      piko.assign of @b port 0 { ... piko.assign_previous ... }
    }
    piko.kernel @kernel_b { piko.process of @b { ... } }
    ```
    After:
    ```
    piko.kernel @kernel_a {
      piko.process of @a { ... piko.emit 0 (%x) : i32 ... }
      piko.assign of @b port 0 { ... piko.assign_previous ... }
      piko.local_barrier @a[0] -> @b
      piko.process of @b { ... }
    }
    ```

    **Limits**: one thread runs a bin, so that a bin that is the whole domain, or
    that is cut into tiles, stays with several threads and a kernel break, unless
    it has `serialize`. So do a stage on a cycle, one that waits with `end_stage`
    for what runs later than its producer, one with a schedule for each bin, and
    one that runs for empty bins behind a list that does not. Stages of which one writes state that
    another one uses are not merged, and no kernel is moved past another such
    one, unless both only change it atomically; two stages of one kernel may
    update the same image. Merged kernels do not run in strips. A pipeline that
    is checked is left as it is. A remark gives the reason for each stage that
    stays.
  }];
}

def FormProgram : Pass<"piko-form-program", "::piko::PipelineOp"> {
  let summary = "Say which kernel runs when, and how edges are joined";
  let description = [{
    **Requires** the kernels level, with kernels as they will run; or the resolved
    level.

    **Does**: makes a `piko.program` of a pipeline that has none. Its launches are
    in the order in which kernels stand in the pipeline, but that stages on a
    common cycle run together: in a `piko.waves` if none of them collects, else
    in a `piko.rounds`, which may have waves inside it. A stage that waits for
    another one has a `piko.wait` in front of its launch. Each
    `piko.join` says how its edges are gathered and, where several of them meet,
    how wide the keys are by which they are merged. A remark says of each edge
    that is permuted, and of each merge, why.

    **Guarantees** that what comes to a bin is in lineage order, and that only
    primitives have keys that will be merged.

    Before:
    ```
    piko.source @a
    piko.edge @a[0] -> @b
    piko.kernel @kernel_a { ... }
    piko.kernel @kernel_b { ... }
    ```
    After, behind the kernels:
    ```
    piko.program {
      %0 = piko.feed 0 : !piko.edge<@F>
      %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
      %2 = piko.launch @kernel_a(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
      %3 = piko.join @b(permute %2) : (!piko.edge<@F>) -> !piko.bins<@F>
      piko.launch @kernel_b(%3) : (!piko.bins<@F>) -> ()
    }
    ```

    **Limits**: kernels are not moved, but for those of a cycle.
  }];
}

def FormStrips : Pass<"piko-form-strips", "::piko::PipelineOp"> {
  let summary = "Find launches that can take a source strip by strip";
  let description = [{
    **Requires** the kernels level with a `piko.program`.

    **Does**: moves launches in a row into a `piko.strips` where they may run for
    one strip of a source after another, so that what lies between them stays
    small. All their primitives come from that source, through edges inside the
    group. A stage that waits, for a stage before the group, may be in it if its
    bin is the whole domain or it emits nothing. Stages of which one writes state
    that another one uses are not in one group, unless both only change it
    atomically. A cycle is in a group as a whole, and only if none of its stages
    collects. Where the group's first stage has the schedule `all` with a tile
    split, and one bin, the tile becomes the `chunk`: depth first, several stages
    for one tile before the next.

    **Guarantees** that the order of launches stays as it is, and that lineage
    order does not change, however the source is cut. A remark says of each stage
    that runs in no strips why.

    Before:
    ```
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : ...
    %2 = piko.launch @kernel_a(%1) : ...
    %3 = piko.join @b(concatenate %2) : ...
    piko.launch @kernel_b(%3) : ...
    ```
    After, where `@a` has the schedule `all tile_split 256`:
    ```
    %0 = piko.feed 0 : !piko.edge<@F>
    piko.strips(%0) chunk 256 {
    ^bb0(%strip: !piko.edge<@F>):
      %1 = piko.join @a(concatenate %strip) : ...
      %2 = piko.launch @kernel_a(%1) : ...
      %3 = piko.join @b(concatenate %2) : ...
      piko.launch @kernel_b(%3) : ...
      piko.leave
    } : (!piko.edge<@F>) -> ()
    ```

    **Limits**: strips are of a source's primitives, never of bins, so that a
    stage that waits and emits from several bins ends a group, as does one that
    takes a list, or that primitives of two sources reach. Launches that are not
    in a row are not moved.
  }];
}

#endif // PIKO_TRANSFORMS_KERNELPASSES_TD
