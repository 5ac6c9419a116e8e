// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Structured work: what kernels hold at the machine level, for every target.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOMACHINEOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOMACHINEOPS_TD

include "Piko/Dialect/Piko/IR/PikoAttributes.td"
include "Piko/Dialect/Piko/IR/PikoInterfaces.td"
include "Piko/Dialect/Piko/IR/PikoTypes.td"

def Piko_BinsOp : Piko_Op<"bins", [
    SingleBlock, NoTerminator, HasParent<"KernelOp">,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "runs for each bin of a stage";
  let description = [{
    The body is for one bin, whose number is its argument, and runs for each bin
    that holds a primitive, or, where the schedule says `every_bin`, for each bin.
    Bins are concurrent; the schedule of the stage says where they run. The first
    `piko.items` or `piko.lists` of the body takes what is in the bin, all others
    take what one before them has emitted there.

    ```mlir
    piko.record @F {"x" : i32 at 0} size 4 align 4
    piko.pipeline @P rank 1 {
      piko.source @split
      piko.edge @split[0] -> @count
      piko.edge @count[0] -> @last
      piko.stage @split bins [8] threads 64 placed : @F -> [@F] {}
      piko.stage @count bins [8] threads 64 placed : list @F -> [@F] {}
      piko.stage @last bins [8] threads 64 placed : @F -> [] {}
      piko.kernel @source_0_split {
        piko.items of @split source 0 {
        ^bb0(%f: !piko.prim<@F>):
          %bin = arith.constant 1 : index
          piko.place %f of @split in %bin : !piko.prim<@F>
        }
      }
      piko.kernel @kernel_split {
        piko.bins of @split {
        ^bb0(%bin: index):
          piko.items of @split {
          ^bb0(%f: !piko.prim<@F>):
            %x = piko.get %f "x" : !piko.prim<@F> -> i32
            %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
            piko.place %p of @count in %bin : !piko.prim<@F>
          }
          piko.lists of @count from @split[0] {
          ^bb0(%l: !piko.list<@F>):
            %n = piko.list_size %l : !piko.list<@F>
          }
        }
      }
    }
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = "`of` $stage attr-dict-with-keyword $body";
  let hasRegionVerifier = 1;
  let extraClassDeclaration = [{
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
    ::mlir::Value getBin() { return getBody().getArgument(0); }
  }];
}

/// Work on what is in a bin. With `from`, on what a port has emitted in the bin
/// so far.
class Piko_WorkOp<string mnemonic> : Piko_Op<mnemonic, [
    Piko_WorkInterface, SingleBlock, NoTerminator, AutomaticAllocationScope,
    ParentOneOf<["BinsOp", "KernelOp"]>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let regions = (region SizedRegion<1>:$body);
  let hasRegionVerifier = 1;
  code common = [{
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
  }];
}

def Piko_ItemsOp : Piko_WorkOp<"items"> {
  let summary = "runs for each primitive of a bin";
  let description = [{
    The body processes one primitive, its argument; `piko.emit` in it is the
    stage's. Primitives are concurrent where that cannot be seen: updates of one
    pixel are in order of lineage, and so is what is emitted.

    With `source` the primitives are those that the host feeds to that source of
    the stage, in no bin; the body places them (`piko.place`). With `from` they are
    those that a port of another stage has emitted in this bin, by what stands in
    front: a local barrier.

    `lanes` says what a lane (of a vector, a thread of a block) is given, and is
    set by `piko-map-lanes`: `items`, a primitive each; `iterations`, those of the
    parallel loops in the body, which all lanes share for one primitive after the
    other; `collapsed`, pairs of a primitive and an iteration; or `one` lane does
    everything. What lanes do at the same time is seen in order of lineage. It stands
    after what the work takes: `piko.items of @split lanes items`.

    See `piko.bins`.
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage,
                       OptionalAttr<Piko_I64Attr>:$source,
                       OptionalAttr<FlatSymbolRefAttr>:$producer,
                       OptionalAttr<Piko_I64Attr>:$port,
                       OptionalAttr<Piko_LaneMappingAttr>:$lanes);
  let assemblyFormat = [{
    `of` $stage (`source` $source^)? (`from` $producer^ `[` $port `]`)?
    (`lanes` $lanes^)? attr-dict-with-keyword $body
  }];
  let extraClassDeclaration = common # [{
    ::mlir::Value getPrim() { return getBody().getArgument(0); }
    bool takesList() { return false; }
  }];
}

def Piko_ListsOp : Piko_WorkOp<"lists"> {
  let summary = "runs for the list of a bin, or for each of its batches";
  let description = [{
    The body is a process phase that takes a list: called once with all that is in
    the bin, or, where the schedule has a batch size, once for so many
    consecutive primitives, the last time for fewer. Of the `lanes` of
    `piko.items` it has `iterations` or `one`: a list is one item.

    See `piko.bins`.
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage,
                       OptionalAttr<FlatSymbolRefAttr>:$producer,
                       OptionalAttr<Piko_I64Attr>:$port,
                       OptionalAttr<Piko_LaneMappingAttr>:$lanes);
  let assemblyFormat = [{
    `of` $stage (`from` $producer^ `[` $port `]`)? (`lanes` $lanes^)?
    attr-dict-with-keyword $body
  }];
  let extraClassDeclaration = common # [{
    ::mlir::Value getList() { return getBody().getArgument(0); }
    bool takesList() { return true; }
  }];
}

def Piko_PositionOp : Piko_Op<"position", [
    Pure, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "where a primitive is among those of its bin";
  let description = [{
    A number that grows in order of lineage, of the argument of a `piko.items`
    inside `piko.bins`. It is below 2^32.

    ```mlir
    piko.record @F {"x" : i32 at 0} size 4 align 4
    piko.pipeline @P rank 1 {
      piko.buffer @last : @F
      piko.source @a
      piko.stage @a bins [0] threads 64 split : @F -> [] {}
      piko.kernel @kernel_a {
        piko.bins of @a {
        ^bb0(%bin: index):
          piko.items of @a {
          ^bb0(%f: !piko.prim<@F>):
            %zero = arith.constant 0 : i32
            %place = piko.position %f : !piko.prim<@F>
            %number = arith.index_cast %place : index to i32
            piko.atomic max_signed @last[%zero : i32] "x", %number : i32
          }
        }
      }
    }
    ```
  }];
  let arguments = (ins Piko_PrimType:$prim);
  let results = (outs Index:$position);
  let assemblyFormat = "$prim attr-dict `:` qualified(type($prim))";
}

def Piko_PlaceOp : Piko_Op<"place", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "puts a primitive into a bin of a stage";
  let description = [{
    The primitive is what a `piko.emit` has sent out of a port, or one of a
    source. Where the stage's bins are divided into tiles, the tile stands after
    the bin. A bin outside the grid is an error when the pipeline runs; one that
    is named twice counts once. See `piko.bins`.
  }];
  let arguments = (ins Piko_PrimType:$prim, FlatSymbolRefAttr:$stage,
                       Index:$bin, Optional<Index>:$tile);
  let assemblyFormat = [{
    $prim `of` $stage `in` $bin (`tile` $tile^)? attr-dict
    `:` qualified(type($prim))
  }];
}

def Piko_TileOp : Piko_Op<"tile", [
    DeclareOpInterfaceMethods<Piko_StateAccessInterface>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "the pixels of an image in a bin, for who runs the bin";
  let description = [{
    From here to `piko.write_tile`, the bin's pixels of the image are in the tile
    and not in the image. Accesses name the tile, after the image that it is of;
    their coordinates stay those of the image. A bin at the end of the domain
    may be smaller than its tile; what is outside is never read.

    The tile begins as the pixels are in the image, or, with `clear`, as the
    image is declared to be cleared, in the first launch of the kernel in a run:
    see `piko.launch`.

    ```mlir
    piko.record @F {"x" : i32 at 0} size 4 align 4
    piko.pipeline @P rank 1 {
      piko.image @count : @F rank 1 clear [0 : i32]
      piko.source @last
      piko.stage @last bins [8] threads 64 ordered : @F -> [] {}
      piko.kernel @kernel_last {
        piko.bins of @last {
        ^bb0(%bin: index):
          %t = piko.tile @count in %bin : !piko.tile<@F, [8]>
          piko.items of @last {
          ^bb0(%f: !piko.prim<@F>):
            %x = piko.get %f "x" : !piko.prim<@F> -> i32
            piko.update @count[%x : i32] in %bin tile(%t : !piko.tile<@F, [8]>) {
            ^bb0(%old: i32):
              %one = arith.constant 1 : i32
              %new = arith.addi %old, %one : i32
              piko.yield [%new : i32]
            }
          }
          piko.write_tile %t to @count in %bin : !piko.tile<@F, [8]>
        }
      }
    }
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$image, UnitAttr:$clear, Index:$bin);
  let results = (outs Piko_TileType:$tile);
  let assemblyFormat = [{
    $image (`clear` $clear^)? `in` $bin attr-dict `:` qualified(type($tile))
  }];
}

def Piko_WriteTileOp : Piko_Op<"write_tile", [
    DeclareOpInterfaceMethods<Piko_StateAccessInterface>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "writes the pixels of a bin back";
  let description = [{
    All of them; the tile is not used any more. See `piko.tile`.
  }];
  let arguments = (ins Piko_TileType:$tile, FlatSymbolRefAttr:$image,
                       Index:$bin);
  let assemblyFormat = [{
    $tile `to` $image `in` $bin attr-dict `:` qualified(type($tile))
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOMACHINEOPS_TD
