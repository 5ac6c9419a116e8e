// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that have a pipeline tell the runtime what it does: checks and counts.

#ifndef PIKO_TRANSFORMS_INSTRUMENTATIONPASSES_TD
#define PIKO_TRANSFORMS_INSTRUMENTATIONPASSES_TD

include "mlir/Pass/PassBase.td"

def AddChecks : Pass<"piko-add-checks", "::mlir::ModuleOp"> {
  let summary = "Check the rules of state while the pipeline runs";
  let description = [{
    **Requires** the authored level, no `piko.check_*` yet.

    **Does**: gives each record of a primitive a longer form, whose last field is the
    primitive's lineage. It tells the runtime of each call, emission, access to a buffer
    or an image, parallel iteration and barrier. It tests the fields in `numbers` for
    NaN where they are emitted, and follows each `piko.undefined` by flags to where it
    is emitted or stored. Indices of local arrays and of arrays in fields go through
    `piko.check_index`. `piko.check_trip` may end an `scf.while`.

    **Guarantees** that the results of a run without findings stay as they are, and that
    no process phase has a `piko.undefined`.

    Before:
    ```
    piko.store %v, @verts[%i : index] "x" : f32
    piko.emit 0 (%z) : f32
    ```
    After:
    ```
    piko.check_access store @verts[%i : index]
    piko.store %v, @verts[%i : index] "x" : f32
    piko.check_place
    %lineage = piko.check_emit
    piko.emit 0 (%z, %lineage) : f32, i64
    ```

    **Limits**: elements of private arrays count as written. An index into several
    dimensions, which is one number by then, is tested as such. Iterations of `scf.for`
    are not counted. Access to state by other operations is an error.
  }];
  let options = [
    ListOption<"numbers", "numbers", "std::string",
               "Fields that must not be NaN, as Record.field">];
  let dependentDialects = ["::mlir::arith::ArithDialect",
                           "::mlir::memref::MemRefDialect"];
}

def CountWork : Pass<"piko-count-work", "::piko::PipelineOp"> {
  let summary = "Count what the text of each stage does";
  let description = [{
    **Requires** the authored level, with stages as they are written.

    **Does**: counts what each process phase does: its calls, the iterations of each
    loop, and the emissions, updates and atomics whose innermost loop that is. It also
    counts emissions by port, accesses by piece of state, and arithmetic operations on
    floats and on integers. Each number is a `piko.counter`, whose location is the loop,
    or the first emission or access.

    **Guarantees** that the pipeline computes what it did. Without the passes that fuse
    and leave out work, the counts are those of the reference, on any number of threads.

    Before:
    ```
    piko.stage @shade ... {
      piko.process {
        %x = piko.load @lights[%i : index] "x" : f32
        %y = arith.mulf %x, %x : f32
        piko.emit 0 (%y) : f32
    ```
    After:
    ```
    piko.counter 0 calls of "shade"
    piko.counter 1 floats of "shade"
    piko.counter 2 integers of "shade"
    piko.counter 3 reads of "shade" to @lights
    piko.counter 4 emissions of "shade" port 0
    piko.stage @shade ... {
      piko.process {
        %one = arith.constant 1 : index
        piko.count 0 by %one
        piko.count 1 by %one
        piko.count_element 3 @lights[%i : index] 4 bytes at 0
        %x = piko.load @lights[%i : index] "x" : f32
        %y = arith.mulf %x, %x : f32
        piko.count 4 by %one
        piko.emit 0 (%y) : f32
    ```

    **Limits**: moves, choices, integer conversions and the logic of conditions are no
    arithmetic; a function such as an exponential is one operation. Of a loop with a
    `break` the last iteration counts, be it only its test. The assign and schedule
    phases are not counted.
  }];
  let dependentDialects = ["::mlir::arith::ArithDialect"];
}

def CountLanes : Pass<"piko-count-lanes", "::piko::PipelineOp"> {
  let summary = "Count the operations that kernels do, and their lanes";
  let description = [{
    **Requires** loops over units, as the last pass on them leaves them.

    **Does**: counts, in each kernel, the arithmetic operations on scalars, those on
    vectors, the lanes of these, and the lanes that are active. A lane is active if it
    is set in the mask that an `scf.if` or an `scf.while` around the block tests for
    any, or else in the mask of the block's first masked access. What stands in a loop
    is counted for the loop's line, `inside` of the kernel's first counter. A unit of
    work adds up in memory of its own, and tells the runtime (`piko.count`) at its end.

    **Guarantees** that the pipeline computes what it did, by the same vectors.

    Before:
    ```
    scf.forall (%unit) in (%units) {
      ...
        %any = vector.reduction <or>, %mask : vector<16xi1> into i1
        scf.if %any {
          %y = arith.mulf %x, %x : vector<16xf32>
    ```
    After:
    ```
    scf.forall (%unit) in (%units) {
      %sums = memref.alloca() : memref<4xindex>
      ...
        scf.if %any {
          %y = arith.mulf %x, %x : vector<16xf32>
          %bits = vector.bitcast %mask : vector<16xi1> to vector<1xi16>
          ... // adds 1 vector, 16 lanes, and the bits that are set
      piko.count 1 by %vectors
    ```

    **Limits**: a lane whose result a select drops counts as active. What the runtime
    does between kernels is not counted.
  }];
  let dependentDialects = ["::mlir::math::MathDialect",
                           "::mlir::memref::MemRefDialect",
                           "::mlir::vector::VectorDialect"];
}

#endif // PIKO_TRANSFORMS_INSTRUMENTATIONPASSES_TD
