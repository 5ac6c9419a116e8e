// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that specialize stages for values and directives that are chosen from
// outside, and drop what is not needed then.

#ifndef PIKO_TRANSFORMS_SPECIALIZATIONPASSES_TD
#define PIKO_TRANSFORMS_SPECIALIZATIONPASSES_TD

include "mlir/Pass/PassBase.td"

def FixConstants : Pass<"piko-fix-constants", "::piko::PipelineOp"> {
  let summary = "Specialize a pipeline for values of its constants";
  let description = [{
    **Requires** the authored level, behind `piko-apply-precision`: what is folded
    is rounded.

    **Does**: `values` has the form `settings.shadows=0`, `weights.value[2]=0.5`
    (of an array), `albedo=0.5` (a constant that is a number) or `lights.size=1`
    (how many elements a buffer has). The value takes the place of each load of
    the field and of each `piko.extent` of the buffer, and a `piko.fixed` has the
    runtime test, before each run, that the host's value is the same.

    **Guarantees** that results are those of the general pipeline, or a run is an
    error that names the constant. What the value makes unnecessary goes by
    canonicalization and `piko-prune`.

    Before:
    ```
    piko.constant @settings : @Settings
    ...
      %shadows = piko.load @settings "shadows" : i32
    ```
    After:
    ```
    piko.constant @settings : @Settings
    piko.fixed @settings "shadows" = 0 : i32
    ...
      %shadows = arith.constant 0 : i32
    ```

    **Limits**: an element that is indexed by what is not constant is loaded all
    the same, and so is a number that an index is computed from, which is tested
    when the pipeline runs. Elements of buffers are not fixed.
  }];
  let options = [
    ListOption<"values", "values", "std::string",
               "CONSTANT[.FIELD][[ELEMENT]]=VALUE or BUFFER.size=COUNT">];
  let dependentDialects = ["::mlir::arith::ArithDialect"];
}

def SetDirectives : Pass<"piko-set-directives", "::piko::PipelineOp"> {
  let summary = "Set directives that change no result, or only last bits";
  let description = [{
    **Requires** the authored level, with stages as they are written.

    **Does**: sets, for each `stage:key=value` of `set`, a directive of the stage of
    that name, in C++ or in the dialect, in the place of what it says itself:

    * `schedule`: `load_balance`, `direct_map`, `serialize`, `all`, or `none`, as if
      the stage said nothing;
    * `split`: how many primitives `all` gives a core at a time;
    * `lanes`: `items`, `iterations`, `collapsed`, `one`, or `none`;
    * `precision`: `strict`, `contracted` or `relaxed`.

    **Guarantees** the results of the pipeline as it was, but for the last bits of
    what stages compute whose `precision` is set: `end_stage`, `end_bin`, `batch`,
    `every_bin` and `unordered` stay as they are.

    Before, with `set=shade:schedule=direct_map,shade:precision=contracted`:
    ```
    piko.stage @shade ... {
      piko.schedule load_balance end_bin
      piko.process {
    ```
    After:
    ```
    piko.stage @shade ... {
      piko.schedule direct_map end_bin
      piko.process precision contracted {
    ```

    **Limits**: a schedule with a dynamic body says where bins run when the pipeline
    does, and is refused; so is `none` where a schedule says what a stage waits for.
    Lanes that a stage cannot have are refused by `piko-map-lanes`.
  }];
  let options = [
    ListOption<"directives", "set", "std::string",
               "Directives to set, as stage:key=value">];
}

def PruneUnreached : Pass<"piko-prune-unreached", "::piko::PipelineOp"> {
  let summary = "Drop edges on which nothing goes, and what they alone feed";
  let description = [{
    **Requires** the authored level with stages in order (`piko-order-stages`):
    their order, and what may not wait, follow from all edges of the text.

    **Does**: a port on which no operation of the process phase emits, because a
    constant or a template argument says so, goes with its edge; so does each
    stage that no primitive can reach from a source.

    **Guarantees** the same results, and the same order of what is left.

    Before:
    ```
    piko.edge @shade[0] -> @trace
    piko.edge @shade[1] -> @accumulate
    piko.edge @trace[0] -> @accumulate
    piko.stage @shade ... -> [@Ray, @Radiance] {
      ... piko.emit 1 (%color) : f32 // and no other
    ```
    After:
    ```
    piko.edge @shade[0] -> @accumulate
    piko.stage @shade ... -> [@Radiance] {
      ... piko.emit 0 (%color) : f32
    ```

    **Limits**: a stage that runs for empty bins, or that one which is reached
    waits for, stays, with an edge that leads there. So does a cycle on which a
    stage that is reached collects, because its rounds can be seen; and all that
    is fed only behind a condition which never holds, but is not constant.
  }];
}

def Prune : Pass<"piko-prune", "::mlir::ModuleOp"> {
  let summary = "Drop fields, ports and stages that nothing depends on";
  let description = [{
    **Requires** the authored level with stages in order (`piko-order-stages`).

    **Does**: finds what state, and errors that a stage can end with, depend on,
    over all of the graph at once, so that a field or a stage that only feeds
    itself around a cycle is not among it. All else is erased: computations in
    the phases, stages, and the ports that fed them. Each stage that no source
    feeds gets a record of its own with the fields it needs, without room
    between them; what its producers emit shrinks with it. `carried` of each
    edge is the size of its primitives before. A stage that waits for one that
    is removed waits for those that this one came after.

    **Guarantees** that state, the order in which it changes, and the sources
    stay as they are.

    Before, where `@keep` does not read `"y"`:
    ```
    piko.record @F {"x" : f32 at 0, "y" : f32 at 4} size 8 align 4
    piko.edge @move[0] -> @ignore
    piko.edge @move[1] -> @keep
    piko.stage @move ... : @F -> [@F, @F] { ... piko.emit 1 (%x, %y) : f32, f32 ... }
    ```
    After:
    ```
    piko.record @F.keep {"x" : f32 at 0} size 4 align 4
    piko.edge @move[0] -> @keep carried 8
    piko.stage @move ... : @F -> [@F.keep] { ... piko.emit 0 (%x) : f32 ... }
    ```

    **Limits**: an array is needed as a whole or not at all. A stage may end with
    an error, and is kept, if it is on a cycle, has a dynamic schedule or a
    barrier, or assigns to a bin that no test of `piko.bin_at` has found to be
    inside. A stage that a source feeds is emptied, not removed. An access to
    state that only erased work needs is not made, so it cannot fail; a pipeline
    that is checked (`piko-add-checks`) is left as it is.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::ub::UBDialect"];
}

#endif // PIKO_TRANSFORMS_SPECIALIZATIONPASSES_TD
