// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages and their three phases.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOSTAGEOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOSTAGEOPS_TD

include "Piko/Dialect/Piko/IR/PikoAttributes.td"
include "Piko/Dialect/Piko/IR/PikoTypes.td"

def Piko_StageOp : Piko_Op<"stage", [
    Symbol, NoTerminator, SingleBlock, NoRegionArguments,
    IsolatedFromAbove, HasParent<"PipelineOp">,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "a stage of a pipeline";
  let description = [{
    Holds a `piko.process`, at most one `piko.assign` and at most one
    `piko.schedule`. `bins` gives the extent of a bin in each dimension of
    the domain; 0 stands for the whole domain. Without an assign phase every
    primitive is in bin 0, which is legal only where one bin is the whole
    domain. Without a schedule phase the stage is load-balanced.

    `label` is what reports and traces call the stage, and no other stage; without
    one that is the stage's name in C++.

    `lineage` is the stage's place in the order that lineage roots are numbered
    in, and is set by `piko-order-stages`, which moves stages. `tile` is the side
    of the tiles that a bin is divided into where `piko.owner` tells whose they
    are. `list` says that the process phase takes the list of a bin. `fused` names the stages whose phases `piko-fuse-stages` has made part
    of this one. At the machine level, `split` says that a bin's primitives (its
    batches, where the phase takes a list) may be divided over threads in any
    way, `ordered` that the order in which they are processed shows in the
    state, `placed` that kernels place them, and `writes` that the process phase
    may write state.

    At the kernels level and below, the phases have moved into
    `piko.kernel`s and the stage's body is empty but for its schedule.

    ```mlir
    piko.record @F {"z" : f32 at 0} size 4 align 4
    piko.pipeline @P rank 2 {
      piko.source @pass
      piko.stage @pass bins [0, 0] threads 64 : @F -> [] {
        piko.schedule load_balance
        piko.process {
        ^bb0(%f: !piko.prim<@F>):
          piko.return
        }
      }
    }
    ```
  }];
  let arguments = (ins SymbolNameAttr:$sym_name, DenseI64ArrayAttr:$bins,
                       ConfinedAttr<Piko_I64Attr, [IntPositive]>:$threads,
                       FlatSymbolRefAttr:$input,
                       TypedArrayAttrBase<FlatSymbolRefAttr, "records of the ports">:$outputs,
                       OptionalAttr<Piko_I64Attr>:$lineage,
                       OptionalAttr<Piko_I64Attr>:$tile,
                       UnitAttr:$split, UnitAttr:$ordered, UnitAttr:$placed,
                       UnitAttr:$writes, UnitAttr:$takesList,
                       OptionalAttr<StrArrayAttr>:$fused,
                       OptionalAttr<Piko_LabelAttr>:$label);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    $sym_name (`label` $label^)? `bins` $bins `threads` $threads
    (`lineage` $lineage^)?
    (`tile` $tile^)? (`split` $split^)?
    (`ordered` $ordered^)? (`placed` $placed^)? (`writes` $writes^)?
    (`fused` $fused^)?
    `:` (`list` $takesList^)? $input `->` $outputs attr-dict-with-keyword
    custom<IsolatedBody>($body)
  }];
  // The stage as a text says it: without what passes find.
  let builders = [OpBuilder<(ins "::mlir::StringAttr":$name,
      "::mlir::DenseI64ArrayAttr":$bins, "::mlir::IntegerAttr":$threads,
      "::mlir::FlatSymbolRefAttr":$input, "::mlir::ArrayAttr":$outputs), [{
    Properties &said = $_state.getOrAddProperties<Properties>();
    said.sym_name = name;
    said.bins = bins;
    said.threads = threads;
    said.input = input;
    said.outputs = outputs;
    $_state.addRegion();
  }]>];
  let hasRegionVerifier = 1;
  let extraClassDeclaration = [{
    /// The phases, or null where the stage does not hold them.
    AssignOp getAssign();
    ScheduleOp getSchedule();
    ProcessOp getProcess();
    /// Whether one bin is the whole domain.
    bool isWholeDomain();
    /// The type of what the process phase takes: a primitive or a list.
    ::mlir::Type getProcessType();
    /// Whether the stage runs only when no primitive can still reach it.
    bool collects();
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
  }];
}

class Piko_PhaseOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<mnemonic, !listconcat(traits, [
        AutomaticAllocationScope, IsolatedFromAbove,
        ParentOneOf<["StageOp", "KernelOp"]>,
        SingleBlockImplicitTerminator<"ReturnOp">])>;

def Piko_AssignOp : Piko_PhaseOp<"assign"> {
  let summary = "the AssignBin phase";
  let description = [{
    Says which bins a primitive belongs to. The bins are a set: a bin that is
    named twice counts once, and bins are visited in ascending row-major order.
    A primitive that is assigned to no bin is culled. Inside a `piko.kernel`
    the phase names its stage.

    ```mlir
    piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
    piko.pipeline @P rank 2 {
      piko.source @s
      piko.stage @s bins [8, 8] threads 64 : @F -> [] {
        piko.assign {
        ^bb0(%f: !piko.prim<@F>):
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          %y = piko.get %f "y" : !piko.prim<@F> -> i32
          %b = piko.bin_at %x, %y : i32, i32
          piko.assign_to %b
          piko.return
        }
        piko.process {
        ^bb0(%f: !piko.prim<@F>):
          piko.return
        }
      }
    }
    ```
  }];
  let arguments = (ins OptionalAttr<FlatSymbolRefAttr>:$stage,
                       OptionalAttr<Piko_I64Attr>:$port,
                       OptionalAttr<Piko_I64Attr>:$source);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    (`of` $stage^)? (`port` $port^)? (`source` $source^)?
    attr-dict-with-keyword custom<PhaseBody>($body)
  }];
  let hasRegionVerifier = 1;
}

def Piko_ProcessOp : Piko_PhaseOp<"process"> {
  let summary = "the Process phase";
  let description = [{
    Says what is computed for a primitive and what is emitted. Calls are
    concurrent; what they may write is `piko.update` on pixels of their own
    bin, `piko.atomic`, and `piko.store` where no two calls write the same
    element. Inside a `piko.kernel` the phase names its stage.

    In a stage that takes a `list` the block argument is a `!piko.list`: all
    primitives of a bin in lineage order, or a batch of them.

    A `precision` other than `strict` is a permission that `piko-apply-precision`
    makes use of, and takes away: below, operations say exactly what they
    compute. So are `ulps`, of functions. Only the authored level has them.

    ```mlir
    piko.record @F {"z" : f32 at 0} size 4 align 4
    piko.pipeline @P rank 2 {
      piko.source @half
      piko.edge @half[0] -> @drop
      piko.stage @half bins [0, 0] threads 64 : @F -> [@F] {
        piko.process {
        ^bb0(%f: !piko.prim<@F>):
          %z = piko.get %f "z" : !piko.prim<@F> -> f32
          %c = arith.constant 0.5 : f32
          %h = arith.mulf %z, %c : f32
          piko.emit 0 (%h) : f32
          piko.return
        }
      }
      piko.stage @drop bins [0, 0] threads 64 : @F -> [] {
        piko.process {
        ^bb0(%f: !piko.prim<@F>):
          piko.return
        }
      }
    }
    ```
  }];
  let arguments = (ins OptionalAttr<FlatSymbolRefAttr>:$stage,
                       OptionalAttr<Piko_PrecisionAttr>:$precision,
      OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntPositive]>>:$ulps);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    (`of` $stage^)? (`precision` $precision^)? (`ulps` $ulps^)?
    attr-dict-with-keyword custom<PhaseBody>($body)
  }];
  let hasRegionVerifier = 1;
}

def Piko_ScheduleOp : Piko_Op<"schedule", [
    AutomaticAllocationScope, HasParent<"StageOp">, IsolatedFromAbove,
    SingleBlock, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "the Schedule phase: directives, and code that gives more";
  let description = [{
    Where bins run (`load_balance`, `direct_map`, `serialize`, `all` with
    the `tile_split` size of the chunks that a bin is cut into), what they
    wait for (`end_stage`, `end_bin`, a `batch` of primitives), and whether
    the stage gives up the order of its emissions (`unordered`). `after` is set by
    `piko-fuse-stages`: if `piko-fuse-kernels` makes one kernel of the stage and
    the one that feeds it, a list of the bin is between them. `lanes` says what
    lanes are given (see `piko.items`), in place of `piko-map-lanes`. What depends
    on the bin or on constants is said by a `dynamic` body, which runs for each
    bin before the pipeline does and overrides the directives.

    A `resolved` schedule says all that is known of its bins, and kernels ask no
    scheduler who runs a unit of work (`piko-pre-schedule`,
    `piko-eliminate-schedules`).

    ```mlir
    piko.record @F {"z" : f32 at 0} size 4 align 4
    piko.pipeline @P rank 2 {
      piko.source @a
      piko.source @b
      piko.stage @a bins [0, 0] threads 64 : @F -> [] {
        piko.process {
        ^bb0(%f: !piko.prim<@F>):
          piko.return
        }
      }
      piko.stage @b bins [0, 0] threads 64 : @F -> [] {
        piko.schedule all tile_split 256 end_stage [@a]
        piko.process {
        ^bb0(%f: !piko.prim<@F>):
          piko.return
        }
      }
    }
    ```
  }];
  let arguments = (ins Piko_ScheduleKind:$kind,
    OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntPositive]>>:$tileSplit,
    OptionalAttr<TypedArrayAttrBase<FlatSymbolRefAttr, "stages to wait for">>:$endStage,
    UnitAttr:$endBin, UnitAttr:$after,
    OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntPositive]>>:$batch,
    UnitAttr:$everyBin, UnitAttr:$unordered, UnitAttr:$resolved,
    OptionalAttr<Piko_LaneMappingAttr>:$lanes);
  let regions = (region MaxSizedRegion<1>:$body);
  let assemblyFormat = [{
    $kind (`tile_split` $tileSplit^)? (`end_stage` $endStage^)?
    (`end_bin` $endBin^)? (`after` $after^)? (`batch` $batch^)? (`every_bin`
    $everyBin^)? (`unordered` $unordered^)? (`resolved` $resolved^)? (`lanes`
    $lanes^)? attr-dict-with-keyword (`dynamic` custom<IsolatedBody>($body)^)?
  }];
  // Of the directives, those that are said; see piko/markers.def.
  let builders = [OpBuilder<(ins "ScheduleKind":$kind,
      CArg<"::llvm::ArrayRef<::mlir::NamedAttribute>", "{}">:$directives), [{
    $_state.addAttribute(getKindAttrName($_state.name),
                         ScheduleKindAttr::get($_builder.getContext(), kind));
    $_state.addAttributes(directives);
    $_state.addRegion();
  }]>];
  let hasRegionVerifier = 1;
}

/// What the dynamic body of a schedule says about its bin.
class Piko_DirectiveOp<string mnemonic> : Piko_Op<mnemonic> {
  let hasVerifier = 1;
}

def Piko_SetScheduleOp : Piko_DirectiveOp<"set_schedule"> {
  let summary = "where the bin runs";
  let description = [{
    The last one that is reached counts. It never changes a result. The kind is
    a number, as in `ScheduleKind`; the tile split is 0 where there is none.

    ```mlir
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      %kind = arith.constant 3 : i32
      %split = arith.constant 64 : i64
      piko.set_schedule %kind tile_split %split
      piko.return
    }
    ```
  }];
  let arguments = (ins I32:$kind, I64:$tileSplit);
  let assemblyFormat = "$kind `tile_split` $tileSplit attr-dict";
}

def Piko_SetBatchOp : Piko_DirectiveOp<"set_batch"> {
  let summary = "how many primitives a list Process gets at a time";
  let description = [{
    The last one that is reached counts. Less than one is an error when the
    pipeline runs.

    ```mlir
    piko.set_batch %batch
    ```
  }];
  let arguments = (ins I64:$size);
  let assemblyFormat = "$size attr-dict";
}

def Piko_SetEveryBinOp : Piko_DirectiveOp<"set_every_bin"> {
  let summary = "a list Process runs for the bin even if it is empty";
  let description = [{
    ```mlir
    piko.set_every_bin
    ```
  }];
  let assemblyFormat = "attr-dict";
}

def Piko_ReturnOp : Piko_Op<"return", [
    Pure, Terminator, ParentOneOf<["AssignOp", "ProcessOp", "ScheduleOp"]>]> {
  let summary = "ends a phase";
  let description = "See `piko.process`.";
  let assemblyFormat = "attr-dict";
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOSTAGEOPS_TD
