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
    **Requires** the authored level, after `piko-apply-precision`: what is folded is
    rounded.

    **Does**: specialization. `values` has the form `settings.shadows=0`,
    `weights.value[2]=0.5` (of an array), `albedo=0.5` (of a constant that is a number)
    or `lights.size=1` (how many elements a buffer has). The value replaces each load of
    the field, or each `piko.extent` of the buffer. A `piko.fixed` has the runtime test,
    before each run, that the host's value is the same. Canonicalization and
    `piko-prune` erase what is unnecessary then.

    **Guarantees** the results of the general pipeline, or an error of the run that
    names the constant.

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

    **Limits**: elements at an index that is not constant are loaded all the same; so is
    a number that an index is computed from, which is tested at run time. Elements of
    buffers are not fixed.
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
    that name, in C++ or in the dialect. It replaces what the stage says itself.

    * `schedule`: `load_balance`, `direct_map`, `serialize`, `all`, or `none`;
    * `split`: how many primitives `all` gives a core at a time;
    * `lanes`: `items`, `iterations`, `collapsed`, `one`, or `none`;
    * `precision`: `strict`, `contracted` or `relaxed`.

    **Guarantees** the same results, but for the last bits of what stages compute whose
    `precision` is set: `end_stage`, `end_bin`, `batch`, `every_bin` and `unordered`
    stay as they are.

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

    **Limits**: a schedule with a dynamic body is refused; so is `none` where a schedule
    says more than where bins run, and `split` where it is not `all`. Lanes that a stage
    cannot have are refused by `piko-map-lanes`.
  }];
  let options = [
    ListOption<"directives", "set", "std::string",
               "Directives to set, as stage:key=value">];
}

def PruneUnreached : Pass<"piko-prune-unreached", "::piko::PipelineOp"> {
  let summary = "Drop edges on which nothing goes, and what they alone feed";
  let description = [{
    **Requires** the authored level with stages in order (`piko-order-stages`): their
    order, and what may not wait, follow from all edges of the text.

    **Does**: erases each port on which no operation of the process phase emits, because
    a constant or a template argument says so, with its edge. Then it erases each stage
    that no primitive can reach from a source, with a remark.

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

    **Limits**: a stage that runs for empty bins, has a dynamic schedule, or is waited
    for by one that is reached, stays, with an edge that leads there. So does a cycle on
    which a stage that is reached collects, because its rounds can be seen. What is fed
    only under a condition that never holds, but is not constant, stays. A pipeline that
    is checked (`piko-add-checks`) stays whole.
  }];
}

def Prune : Pass<"piko-prune", "::mlir::ModuleOp"> {
  let summary = "Drop fields, ports and stages that nothing depends on";
  let description = [{
    **Requires** the authored level with stages in order (`piko-order-stages`).

    **Does**: dead code elimination over the whole graph. It finds what state, and
    errors of a run, depend on, also around cycles. It erases the rest: computations,
    stages and the ports that fed them. Stages that no source feeds get packed records
    of the fields they need; `carried` of an edge keeps the old size. A stage that
    waited for an erased one waits for those before it.

    **Guarantees** that state, the order in which it changes, and the sources stay.

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

    **Limits**: an array is needed as a whole. A stage that may end with an error stays:
    on a cycle, with a dynamic schedule or barrier, or assigning to a bin that may be
    outside. Erased accesses cannot fail any more. A stage without effect that a source
    feeds is emptied.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::ub::UBDialect"];
}

#endif // PIKO_TRANSFORMS_SPECIALIZATIONPASSES_TD
