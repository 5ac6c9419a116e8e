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

    **Does**: makes a kernel of the process phase of each stage and the assign phases
    of the stages that its ports feed. Makes another one of the assign phase for each
    source whose stage has an assign phase. Kernels stand in the order in which they
    run. A schedule stays with its stage. An assign phase that puts everything into
    the one bin that there is needs no code, and is left out.

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

    **Limits**: an assign phase that reads state which a stage may still write when
    the primitives arrive is an error. What can be merged further is left to other
    passes.
  }];
}

def FuseKernels : Pass<"piko-fuse-kernels", "::piko::PipelineOp"> {
  let summary = "Run stages for a bin, one after another, before the next bin";
  let description = [{
    **Requires** the kernels level, before `piko-form-program`; best after
    `piko-infer-directives`.

    **Does**: appends the kernel of a stage that takes a list, or waits with `end_bin`
    or `after`, to the kernel of the stage that feeds it, after a
    `piko.local_barrier`. So the wait is for one bin, whose primitives alone are
    stored between. Both stages have bins of one size. One edge and no source lead to
    the consumer, which `piko.assign_previous` alone assigns. Schedules are of one
    kind, or the consumer's is `load_balance` and the producer's not `serialize`.

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

    **Limits**: one thread runs a bin. A kernel break stays where the bin is the whole
    domain, unless the producer has `serialize`, and where bins are cut into tiles. It
    stays on cycles, with `dynamic` schedules, and where one stage writes what another
    uses. A remark says why.
  }];
}

def FormProgram : Pass<"piko-form-program", "::piko::PipelineOp"> {
  let summary = "Say which kernel runs when, and how edges are joined";
  let description = [{
    **Requires** the kernels level, with kernels as they will run, or the machine
    level.

    **Does**: makes a `piko.program` of a pipeline that has none. Launches are in the
    order of kernels, but a kernel comes after what feeds it. Stages on a common cycle
    run together: in a `piko.waves` if none of them collects, else in a `piko.rounds`,
    which may hold waves. A `piko.wait` stands before a stage that waits for another
    one, unless edges lead there. Each `piko.join` says how its edges are gathered,
    and how wide the keys are by which several are merged. A remark says why an edge
    is permuted, or edges are merged.

    **Guarantees** that what comes to a bin is in lineage order, and that only
    primitives that will be merged have keys.

    Before:
    ```
    piko.source @a
    piko.edge @a[0] -> @b
    piko.kernel @kernel_a { ... }
    piko.kernel @kernel_b { ... }
    ```
    After, after the kernels:
    ```
    piko.program {
      %0 = piko.feed 0 : !piko.edge<@F>
      %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
      %2 = piko.launch @kernel_a(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
      %3 = piko.join @b(permute %2) : (!piko.edge<@F>) -> !piko.bins<@F>
      piko.launch @kernel_b(%3) : (!piko.bins<@F>) -> ()
    }
    ```

    **Limits**: a stage without a kernel is an error, and so are waits that cannot
    end.
  }];
}

def FormStrips : Pass<"piko-form-strips", "::piko::PipelineOp"> {
  let summary = "Find launches that can take a source strip by strip";
  let description = [{
    **Requires** the kernels level with a `piko.program`.

    **Does**: moves successive launches into a `piko.strips` (strip-mining), so that
    what lies between them stays small. All their primitives come from one source,
    through edges inside the group. A stage that waits for one before the group may be
    in it if its bin is the whole domain or it emits nothing. A cycle is in it as a
    whole, if none of its stages collects. The tile split of a first stage with `all`
    and one bin becomes the `chunk`.

    **Guarantees** that launches and lineage keep their order, however the source is
    cut.

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

    **Limits**: a stage that takes a list, waits for a bin, or gets primitives of two
    sources ends a group. So does state that one stage writes and another uses, unless
    both change it atomically. Remarks say why.
  }];
}

#endif // PIKO_TRANSFORMS_KERNELPASSES_TD
