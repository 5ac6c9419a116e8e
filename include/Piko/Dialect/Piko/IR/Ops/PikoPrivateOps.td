// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a unit of work has for itself in place of state: copies to reduce to,
// images to select in, and a bin's pixels. A part of PikoCPUOps.td, which
// includes it.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOPRIVATEOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOPRIVATEOPS_TD

def Piko_PrivateCopyOp : Piko_CPUOp<"private_copy", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "where a unit of work reduces to a piece of state";
  let description = [{
    A kernel that changes a field of a buffer or an image by atomic operations of
    one kind alone, and takes no result of them, need not lock: the thread that
    runs the unit has a copy of its own, which starts with numbers that change
    nothing. When the kernel ends, the copies are combined with the state. One of
    the threads uses the state itself. Where copies would cost more than they
    save, the runtime gives none, and the operations are atomic as they were.

    `often` says that a primitive changes many elements.

    ```mlir
    %writer = piko.cpu.open_writer %bins[%unit] : !piko.bins<@Fragment>
    %c = piko.cpu.private_copy add @histogram "value" of %writer often
    piko.atomic add checked @histogram[%i : index] "value", %one in %c : i32
    ```
  }];
  let arguments = (ins Piko_AtomicKind:$kind, FlatSymbolRefAttr:$state,
                       StrAttr:$field, Piko_WriterType:$writer,
                       UnitAttr:$often);
  let results = (outs Piko_PrivateCopyType:$copy);
  let assemblyFormat = [{
    $kind $state $field `of` $writer (`often` $often^)? attr-dict
  }];
}

def Piko_PrivateImagesOp : Piko_CPUOp<"private_images", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "images of which a unit of work has its thread's own";
  let description = [{
    All that the kernel does to the first image is to select, for each pixel, what
    is first by a key (an arg-min reduction): an `update` keeps the new numbers
    where they are before the old ones, and carried images are overwritten where it
    did. Numbers of a record are counted from 0, fields in order. `by` names those
    of the key, the most significant first, and for each the comparison by which a
    new one is before an old one; of equal keys the first in order of lineage is
    kept, or the `last`. `keeps` has the numbers that change, of the first image
    and of each carried one.

    Threads share the bin: each has these images for itself, and keeps in the
    internal image `unit` the unit of what it selected there. When the kernel ends,
    the runtime selects among them, and of equal keys by the unit. One of the
    threads uses the state itself. All of the unit's access to these images goes to
    its own. The result is whether threads share the bin at all: if it is false,
    one thread runs all units, and nothing need be kept in the internal image.

    `often` says that a primitive updates many pixels.

    ```mlir
    %writer = piko.cpu.open_writer %bins[%unit] : !piko.bins<@Fragment>
    %shared = piko.cpu.private_images @depth by [0] ["olt"] carries []
      keeps [array<i64: 0>] unit @depth.unit of %writer often
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$image, DenseI64ArrayAttr:$numbers,
                       StrArrayAttr:$comparisons, UnitAttr:$last,
                       FlatSymbolRefArrayAttr:$carried,
                       TypedArrayAttrBase<DenseI64ArrayAttr, "lists of numbers">:$kept,
                       FlatSymbolRefAttr:$unitImage, Piko_WriterType:$writer,
                       UnitAttr:$often);
  let results = (outs I1:$shared);
  let assemblyFormat = [{
    $image `by` $numbers $comparisons (`last` $last^)? `carries` $carried
    `keeps` $kept `unit` $unitImage `of` $writer (`often` $often^)? attr-dict
  }];
  let extraClassDeclaration = [{
    /// The first image, and those that are carried.
    ::llvm::SmallVector<::mlir::StringAttr> getImages();
  }];
}

def Piko_OpenTileOp : Piko_CPUOp<"open_tile", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "lets a unit of work have a copy of a bin's pixels";
  let description = [{
    From here to where it is closed, in the same block, all of the kernel's access
    to the image is to pixels of the bin, and goes to a copy of these in memory of
    the thread's, if the runtime says that for so many primitives a copy pays: where
    rows of the image compete for the same sets of the cache. The result is whether
    it says so; if memory is refused the image itself is changed.

    ```mlir
    %copied = piko.cpu.open_tile @depth[%bin] of %writer for %n
    piko.cpu.close_tile @depth of %writer if %copied
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$image, Index:$bin,
                       Piko_WriterType:$writer, Index:$count);
  let results = (outs I1:$copied);
  let assemblyFormat = "$image `[` $bin `]` `of` $writer `for` $count attr-dict";
}

def Piko_CloseTileOp : Piko_CPUOp<"close_tile", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "writes a copy of a bin's pixels to the image";
  let description = [{
    See `piko.cpu.open_tile`, whose result it takes.
  }];
  let arguments = (ins FlatSymbolRefAttr:$image, Piko_WriterType:$writer,
                       I1:$copied);
  let assemblyFormat = [{
    $image `of` $writer `if` $copied attr-dict
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOPRIVATEOPS_TD
