// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The run of a pipeline: launches, joins, strips, waves and rounds.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOPROGRAMOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOPROGRAMOPS_TD

include "Piko/Dialect/Piko/IR/PikoTypes.td"

def Piko_ProgramOp : Piko_Op<"program", [
    NoTerminator, SingleBlock, NoRegionArguments, IsolatedFromAbove,
    HasParent<"PipelineOp">]> {
  let summary = "the run of a pipeline";
  let description = [{
    Says which kernel runs when, and how what one has emitted comes to the next.
    Statements run in order, each when the one before it has ended. A value of
    type `!piko.edge` holds primitives in lineage order, and is used once: it is
    joined into the bins of a stage, whose kernel takes them.

    `roots` are the stages that collect and emit: each begins a lineage, after
    those of the sources, and in this order. Stages of one `piko.rounds` share
    one. A program of `ranks` is run by several processes together
    (`piko.partition`).

    ```mlir
    piko.record @F {"x" : i32 at 0} size 4 align 4
    piko.pipeline @P rank 1 {
      piko.image @count : @F rank 1
      piko.source @start
      piko.edge @start[0] -> @last
      piko.stage @start bins [8] threads 64 : @F -> [@F] {}
      piko.stage @last bins [0] threads 64 : @F -> [] {}
      piko.kernel @assign {
        piko.assign of @start source 0 {
        ^bb0(%f: !piko.prim<@F>):
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          %b = piko.bin_at %x : i32
          piko.assign_to %b
          piko.return
        }
      }
      piko.kernel @kernel_start {
        piko.process of @start {
        ^bb0(%f: !piko.prim<@F>):
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          piko.emit 0 (%x) : i32
          piko.return
        }
      }
      piko.kernel @kernel_last {
        piko.process of @last {
        ^bb0(%f: !piko.prim<@F>):
          piko.return
        }
      }
      piko.program {
        piko.clear @count
        %source = piko.feed 0 : !piko.edge<@F>
        %placed = piko.launch @assign(%source)
          : (!piko.edge<@F>) -> !piko.edge<@F>
        %bins = piko.join @start(concatenate %placed)
          : (!piko.edge<@F>) -> !piko.bins<@F>
        %emitted = piko.launch @kernel_start(%bins)
          : (!piko.bins<@F>) -> !piko.edge<@F>
        %all = piko.join @last(permute %emitted)
          : (!piko.edge<@F>) -> !piko.bins<@F>
        piko.launch @kernel_last(%all) : (!piko.bins<@F>) -> ()
      }
    }
    ```
  }];
  let arguments = (ins OptionalAttr<
    TypedArrayAttrBase<FlatSymbolRefAttr, "stages that begin a lineage">>:$roots,
    UnitAttr:$ranks);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    (`roots` $roots^)? (`ranks` $ranks^)? attr-dict-with-keyword custom<IsolatedBody>($body)
  }];
  let hasRegionVerifier = 1;
  let extraClassDeclaration = [{
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
  }];
}

class Piko_ProgramStatement<string mnemonic, list<Trait> traits = []>
    : Piko_Op<mnemonic, !listconcat(traits, [
        ParentOneOf<["ProgramOp", "StripsOp", "WavesOp", "RoundsOp"]>])>;

def Piko_ClearOp : Piko_ProgramStatement<"clear"> {
  let summary = "state as it is at the start of a run";
  let description = [{
    Sets the pixels of images to their clear value, and the elements of buffers
    that are sized by a source to zeros.

    ```mlir
    piko.clear @depth, @color
    ```
  }];
  let arguments = (ins
    TypedArrayAttrBase<FlatSymbolRefAttr, "images and buffers">:$states);
  let assemblyFormat = "custom<Symbols>($states) attr-dict";
  let hasVerifier = 1;
}

def Piko_FeedOp : Piko_ProgramStatement<"feed"> {
  let summary = "the primitives of a source";
  let description = [{
    They stay where the host has them.

    ```mlir
    %triangles = piko.feed 0 : !piko.edge<@Triangle>
    ```
  }];
  let arguments = (ins ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$source);
  let results = (outs Piko_EdgeType:$edge);
  let assemblyFormat = "$source attr-dict `:` qualified(type($edge))";
  let hasVerifier = 1;
  let extraClassDeclaration = [{
    /// The source, or null.
    SourceOp getSourceOp();
  }];
}

def Piko_ScheduleBinsOp : Piko_ProgramStatement<"schedule_bins"> {
  let summary = "runs the body of a schedule for each bin";
  let description = [{
    Of a stage whose schedule depends on the bin. `piko-form-work` makes a
    kernel of the body, and a launch of this.

    ```mlir
    piko.schedule_bins @shade
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage);
  let assemblyFormat = "$stage attr-dict";
  let hasVerifier = 1;
}

def Piko_JoinOp : Piko_ProgramStatement<"join"> {
  let summary = "what comes to a stage, in lineage order and grouped by bin";
  let description = [{
    Gathers each edge in one of two ways. `concatenate`: the units of the kernel
    that emitted it are in the order of emission, and follow each other.
    `permute`: they may not be, as the kernel ran bin by bin; then what each
    position emitted goes to the place that the position's rank in lineage order
    gives. `keys` is how many words the key of a primitive has, that tells its
    lineage: what comes along several edges is merged (`merge`) by key, or, if the
    stage's results do not depend on its order, one edge follows the other. `keeps`
    is how many of these words go on with a primitive through the stage, because
    what it emits needs keys as well. Without edges bins are empty: of a stage that
    takes lists, whose process phase runs for each bin all the same (`every_bin`).

    ```mlir
    %bins = piko.join @shade(permute %fragments)
      : (!piko.edge<@Fragment>) -> !piko.bins<@Fragment>
    %both = piko.join @meet merge(concatenate %a keys 1, permute %b keys 2) keeps 2
      : (!piko.edge<@F>, !piko.edge<@F>) -> !piko.bins<@F>
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, UnitAttr:$merge,
                       Variadic<Piko_EdgeType>:$edges,
                       DenseBoolArrayAttr:$permutes,
                       DenseI64ArrayAttr:$keys,
                       OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntPositive]>>:$keeps);
  let results = (outs Piko_BinsType:$bins);
  let assemblyFormat = [{
    $stage (`merge` $merge^)? `` custom<Gathers>($edges, $permutes, $keys)
    (`keeps` $keeps^)? attr-dict `:` functional-type($edges, $bins)
  }];
  let hasVerifier = 1;
  let extraClassDeclaration = [{
    StageOp getStageOp();
  }];
}

def Piko_LaunchOp : Piko_ProgramStatement<"launch"> {
  let summary = "runs a kernel";
  let description = [{
    The kernel of a process phase takes the bins of its stage, and has a result
    for each port of the stages in it, in order, but for those that a
    `piko.local_barrier` keeps in the kernel. The kernel of the assign phase of a
    source takes the source's primitives, and its result is the same with their
    bins. The kernel of a schedule takes and gives nothing.

    In a `piko.rounds`, a kernel with a `turn` runs in its turn alone.

    With `clears`, the first launch in a run sets the pixels of these images to
    their clear value: the kernel begins with tiles (`piko.tile`) of this value in
    bins that it visits, and those of all other bins are set beside it. Such a
    kernel is launched at least once.

    ```mlir
    %fragments = piko.launch @kernel_rasterize(%bins)
      : (!piko.bins<@Triangle>) -> !piko.edge<@Fragment>
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$kernel,
                       Optional<AnyTypeOf<[Piko_EdgeType, Piko_BinsType]>>:$input,
                       OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntNonNegative]>>:$turn,
                       OptionalAttr<TypedArrayAttrBase<FlatSymbolRefAttr, "images">>:$clears);
  let results = (outs Variadic<Piko_EdgeType>:$edges);
  let assemblyFormat = [{
    $kernel `` `(` ($input^)? `)` (`turn` $turn^)?
    (`clears` custom<Symbols>($clears)^)? attr-dict `:`
    functional-type(operands, results)
  }];
  let hasVerifier = 1;
  let extraClassDeclaration = [{
    KernelOp getKernelOp();
  }];
}

def Piko_WaitOp : Piko_ProgramStatement<"wait"> {
  let summary = "goes on when a stage has ended";
  let description = [{
    What follows waits for the stage (`end_stage`), though no edge leads from it.

    ```mlir
    piko.wait @shade
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage);
  let assemblyFormat = "$stage attr-dict";
  let hasVerifier = 1;
}

/// As pikoir_partition has them, but for the first rank's.
def Piko_Division : I32EnumAttr<"RankDivision", "which rank runs what of a stage", [
  I32EnumAttrCase<"First", 0, "first">, // the first rank, all of it
  I32EnumAttrCase<"Parts", 1, "parts">, // what each is fed, or has emitted
  I32EnumAttrCase<"Bins", 2, "bins">,   // the bins that each owns
  I32EnumAttrCase<"All", 3, "all">]> {  // each rank, all of it
  let cppNamespace = "::piko";
}

/// As pikort_owners has them.
def Piko_Owners : I32EnumAttr<"RankOwners", "which bins belong to one rank", [
  I32EnumAttrCase<"Pattern", 1, "pattern">, // neighbours have different owners
  I32EnumAttrCase<"Blocks", 2, "blocks">,   // neighbours, row by row
  I32EnumAttrCase<"Morton", 3, "morton">,   // neighbours, along a Morton curve
  I32EnumAttrCase<"Load", 4, "load">]> {    // as many primitives as in others
  let cppNamespace = "::piko";
}

def Piko_PartitionOp : Piko_ProgramStatement<"partition"> {
  let summary = "which rank runs what of a stage";
  let description = [{
    Of a program that several processes, its ranks, run together. With `bins` a
    rank runs the bins that it owns; with `parts` what it has been fed or has
    itself emitted, where all primitives are in one bin; with `all` each rank runs
    all of the stage, so that what it writes is the same everywhere. A stage of
    which the program does not say this is run by the first rank alone. `owners`
    says which bins those of one rank are, where the host does not.

    ```mlir
    piko.partition @rasterize bins owners blocks
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Piko_Division:$division,
                       OptionalAttr<Piko_Owners>:$owners);
  let assemblyFormat = "$stage $division (`owners` $owners^)? attr-dict";
  let hasVerifier = 1;
}

def Piko_ExchangeOp : Piko_ProgramStatement<"exchange", [
    SameOperandsAndResultType]> {
  let summary = "brings primitives to the ranks that run what takes them";
  let description = [{
    All ranks run it alike: counts first, then records, each with the bins that
    the receiver owns of it. By the keys that the join names, what comes from
    several ranks is merged into the order of lineage; without keys what comes
    from one rank follows what comes from the one before. Of a source each rank
    has found the bins of a part, and bins alone are exchanged.

    ```mlir
    %here = piko.exchange %fragments : !piko.edge<@Fragment>
    ```
  }];
  let arguments = (ins Piko_EdgeType:$edge);
  let results = (outs Piko_EdgeType:$received);
  let assemblyFormat = "$edge attr-dict `:` qualified(type($edge))";
}

def Piko_KeepOp : Piko_ProgramStatement<"keep"> {
  let summary = "remembers what a piece of state holds now";
  let description = [{
    All ranks hold the same then. A `piko.share` finds by it what each has
    changed. State that is `cleared` is as it was at the start of the run, so that
    there is nothing to copy.

    ```mlir
    piko.keep @histogram
    piko.keep @visible cleared
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$state, UnitAttr:$cleared);
  let assemblyFormat = "$state (`cleared` $cleared^)? attr-dict";
  let hasVerifier = 1;
}

def Piko_CommonOp : Piko_ProgramStatement<"common"> {
  let summary = "ranks of one machine may hold an image once";
  let description = [{
    No rank uses pixels but those of the bins that it owns `of` a stage, from the
    start of the run to its end. Then ranks that share memory need not bring them
    to the first one.

    ```mlir
    piko.common @depth of @rasterize
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$image, FlatSymbolRefAttr:$stage);
  let assemblyFormat = "$image `of` $stage attr-dict";
  let hasVerifier = 1;
}

def Piko_ShareOp : Piko_ProgramStatement<"share"> {
  let summary = "brings together what ranks have written of a piece of state";
  let description = [{
    After it all ranks hold the same, or, with `to_first`, the first rank holds
    all. What each brings is the pixels of the bins that it owns `of` a stage;
    or, with `from_first`, all that the first rank holds; or else the elements
    that it has changed since the `piko.keep` of this state, and with `to_owners`
    only to the rank that owns the bin `of` the stage, which then has its pixels.
    Fields that several ranks change `reduce`, each by one operation: the changes
    are combined in the order of ranks.

    ```mlir
    piko.share @depth of @rasterize to_first
    piko.share @sums from_first
    piko.share @histogram reduce ["value", "add"]
    piko.share @visible of @shade to_owners reduce ["key", "max_unsigned"]
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$state,
                       OptionalAttr<FlatSymbolRefAttr>:$stage,
                       UnitAttr:$from_first, UnitAttr:$to_first,
                       UnitAttr:$to_owners,
                       OptionalAttr<StrArrayAttr>:$reduce);
  let assemblyFormat = [{
    $state (`of` $stage^)? (`from_first` $from_first^)? (`to_first` $to_first^)?
    (`to_owners` $to_owners^)? (`reduce` $reduce^)? attr-dict
  }];
  let hasVerifier = 1;
}

class Piko_ProgramRegion<string mnemonic, list<Trait> traits = []>
    : Piko_ProgramStatement<mnemonic, !listconcat(traits, [
        SingleBlockImplicitTerminator<"LeaveOp">])> {
  let regions = (region SizedRegion<1>:$body);
  let hasRegionVerifier = 1;
}

def Piko_StripsOp : Piko_ProgramRegion<"strips"> {
  let summary = "runs for one part of a source after another";
  let description = [{
    The region runs for one strip of the source, consecutive primitives, before
    it runs for the next one; all primitives in it come from that source. What
    leaves the strips is joined in order. `chunk` is how many primitives a strip
    has at most; without it the runtime chooses.

    ```mlir
    %out = piko.strips(%source) chunk 256 {
    ^bb0(%strip: !piko.edge<@F>):
      %bins = piko.join @split(concatenate %strip)
        : (!piko.edge<@F>) -> !piko.bins<@F>
      %half = piko.launch @kernel_split(%bins)
        : (!piko.bins<@F>) -> !piko.edge<@F>
      piko.leave %half : !piko.edge<@F>
    } : (!piko.edge<@F>) -> !piko.edge<@F>
    ```
  }];
  let arguments = (ins Piko_EdgeType:$source,
    OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntPositive]>>:$chunk);
  let results = (outs Variadic<Piko_EdgeType>:$edges);
  let assemblyFormat = [{
    `` `(` $source `)` (`chunk` $chunk^)? $body attr-dict `:`
    functional-type($source, $edges)
  }];
}

def Piko_WavesOp : Piko_ProgramRegion<"waves"> {
  let summary = "stages on a cycle, again and again until nothing is left";
  let description = [{
    No stage of the cycle collects. The first block arguments are what comes
    into the cycle, and hold something in the first wave alone; the others are
    what goes around. In each wave the kernels run for which there is something;
    what they emit along the cycle is there in the next wave. What leaves the
    cycle is in lineage order, which is depth first, whatever the waves. `keys`
    is how many words there are in the key of what comes in, if what leaves
    needs keys.

    ```mlir
    %out = piko.waves(%in) {
    ^bb0(%first: !piko.edge<@F>, %again: !piko.edge<@F>):
      %bins = piko.join @split(concatenate %first, permute %again)
        : (!piko.edge<@F>, !piko.edge<@F>) -> !piko.bins<@F>
      %half, %done = piko.launch @kernel_split(%bins)
        : (!piko.bins<@F>) -> (!piko.edge<@F>, !piko.edge<@F>)
      piko.leave %done : !piko.edge<@F> again %half : !piko.edge<@F>
    } : (!piko.edge<@F>) -> !piko.edge<@F>
    ```
  }];
  let arguments = (ins Variadic<Piko_EdgeType>:$entries,
    OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntPositive]>>:$keys);
  let results = (outs Variadic<Piko_EdgeType>:$edges);
  let assemblyFormat = [{
    `` `(` $entries `)` (`keys` $keys^)? $body attr-dict `:`
    functional-type($entries, $edges)
  }];
}

def Piko_RoundsOp : Piko_ProgramRegion<"rounds"> {
  let summary = "stages on a cycle, some of which collect";
  let description = [{
    The region runs again and again. Kernels without a `turn` run when something
    has come for them, so that all spreads until it has come to stages that
    collect, or has left the cycle. After them, one kernel with a turn takes
    all that has come for it: the next one for which there is something. When
    each has had its turn and something is left, another round begins. An edge
    holds what was emitted until it is taken.

    ```mlir
    %out = piko.rounds(%in) {
    ^bb0(%first: !piko.edge<@F>, %again: !piko.edge<@F>):
      %bins = piko.join @grow merge(concatenate %first keys 1, concatenate %again keys 2)
        : (!piko.edge<@F>, !piko.edge<@F>) -> !piko.bins<@F>
      %more, %done = piko.launch @kernel_grow(%bins) turn 0
        : (!piko.bins<@F>) -> (!piko.edge<@F>, !piko.edge<@F>)
      piko.leave %done : !piko.edge<@F> again %more : !piko.edge<@F>
    } : (!piko.edge<@F>) -> !piko.edge<@F>
    ```
  }];
  let arguments = (ins Variadic<Piko_EdgeType>:$entries);
  let results = (outs Variadic<Piko_EdgeType>:$edges);
  let assemblyFormat = [{
    `` `(` $entries `)` $body attr-dict `:` functional-type($entries, $edges)
  }];
}

def Piko_LeaveOp : Piko_Op<"leave", [
    Terminator, AttrSizedOperandSegments,
    ParentOneOf<["StripsOp", "WavesOp", "RoundsOp"]>]> {
  let summary = "what leaves a region of a program, and what goes around";
  let description = [{
    ```mlir
    piko.leave %done : !piko.edge<@F> again %half : !piko.edge<@F>
    ```
  }];
  let arguments = (ins Variadic<Piko_EdgeType>:$leaving,
                       Variadic<Piko_EdgeType>:$around);
  let builders = [OpBuilder<(ins), "build($_builder, $_state, ::mlir::ValueRange(), ::mlir::ValueRange());">];
  let assemblyFormat = [{
    ($leaving^ `:` qualified(type($leaving)))?
    (`again` $around^ `:` qualified(type($around)))? attr-dict
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOPROGRAMOPS_TD
