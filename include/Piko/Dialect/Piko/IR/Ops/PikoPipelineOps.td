// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records, pipelines, their state and the edges between their stages.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOPIPELINEOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOPIPELINEOPS_TD

include "Piko/Dialect/Piko/IR/PikoAttributes.td"
include "Piko/Dialect/Piko/IR/PikoTypes.td"

def Piko_RecordOp : Piko_Op<"record", [Symbol, HasParent<"::mlir::ModuleOp">]> {
  let summary = "the layout of a C++ struct";
  let description = [{
    Names the leaf fields of a trivially copyable struct, in the order in which
    they are declared, with their byte offsets. Primitives, constants, and the
    elements of buffers and images are records; a plain number is a record with
    the one field `value`.

    ```mlir
    piko.record @Fragment {"pos.x" : f32 at 0, "pos.y" : f32 at 4,
                           "weights" : f32[4 : 4] at 8} size 24 align 4
    ```

    Each number is aligned to its size, and no byte is of two. What C++ calls the
    types of the fields, for the headers of hosts, is said by the attribute
    [`piko.cpp_types`](Piko.md#records-keep-the-byte-layout-of-c).
  }];
  let arguments = (ins SymbolNameAttr:$sym_name, Piko_FieldArrayAttr:$fields,
                       Piko_I64Attr:$size, Piko_I64Attr:$align);
  let assemblyFormat = [{
    $sym_name custom<Fields>($fields) `size` $size `align` $align attr-dict
  }];
  let hasVerifier = 1;
  let extraClassDeclaration = [{
    /// The field of that name, or null.
    FieldAttr getField(::llvm::StringRef name);
    /// The types of all numbers in the record, fields in order, arrays
    /// row-major: what `piko.emit` takes.
    ::llvm::SmallVector<::mlir::Type> getElementTypes();
    /// The byte offsets that belong to getElementTypes().
    ::llvm::SmallVector<int64_t> getElementOffsets();
  }];
}

def Piko_PipelineOp : Piko_Op<"pipeline", [
    Symbol, SymbolTable, NoTerminator, SingleBlock, NoRegionArguments,
    IsolatedFromAbove, HasParent<"::mlir::ModuleOp">]> {
  let summary = "a graph of stages and the state they share";
  let description = [{
    Holds, at the authored level, state (`piko.constant`, `piko.buffer`,
    `piko.image`), stages, sources and edges. Bins are a grid of `rank`
    dimensions over a domain (the screen, or a volume) whose extent the host
    gives at run time: at most `max_extent` cells in each dimension, if that is
    said.

    ```mlir
    piko.record @float {"value" : f32 at 0} size 4 align 4
    piko.pipeline @Copy rank 2 {
      piko.buffer @sink : @float
      piko.source @copy
      piko.stage @copy bins [0, 0] threads 64 : @float -> [] {
        piko.process {
        ^bb0(%p: !piko.prim<@float>):
          %v = piko.get %p "value" : !piko.prim<@float> -> f32
          %zero = arith.constant 0 : index
          piko.store %v, @sink[%zero : index] "value" : f32
          piko.return
        }
      }
    }
    ```
  }];
  let arguments = (ins SymbolNameAttr:$sym_name,
                       ConfinedAttr<Piko_I64Attr, [IntMinValue<1>, IntMaxValue<4>]>:$rank,
                       OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntPositive]>>:$max_extent);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    $sym_name `rank` $rank (`max_extent` $max_extent^)?
    attr-dict-with-keyword custom<IsolatedBody>($body)
  }];
  let hasRegionVerifier = 1;
  let extraClassDeclaration = [{
    ::mlir::Block *getBodyBlock() { return &getBody().front(); }
  }];
}

class Piko_StateOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<mnemonic, !listconcat(traits, [
        Symbol, HasParent<"PipelineOp">,
        DeclareOpInterfaceMethods<SymbolUserOpInterface>])>;

def Piko_ConstantOp : Piko_StateOp<"constant"> {
  let summary = "a value that the host sets before a run";
  let description = [{
    Until the host sets it, it is `value`, one number for each number of the
    record. Without one the host must set it.

    ```mlir
    piko.record @Camera {"eye.x" : f32 at 0} size 4 align 4
    piko.pipeline @P rank 2 {
      piko.constant @camera : @Camera
      piko.constant @other : @Camera value [1.0 : f32]
    }
    ```
  }];
  let arguments = (ins SymbolNameAttr:$sym_name, FlatSymbolRefAttr:$record,
                       OptionalAttr<ArrayAttr>:$value);
  let assemblyFormat = [{
    $sym_name `:` $record (`value` $value^)? attr-dict
  }];
}

def Piko_BufferOp : Piko_StateOp<"buffer"> {
  let summary = "a one-dimensional array";
  let description = [{
    The host binds its elements, unless `per_source` names a source: then the
    runtime gives it one element for each primitive of that source and zeroes
    them at the start of each run.

    ```mlir
    piko.record @Light {"color.x" : f32 at 0} size 4 align 4
    piko.pipeline @P rank 2 {
      piko.buffer @lights : @Light
    }
    ```
  }];
  let arguments = (ins SymbolNameAttr:$sym_name, FlatSymbolRefAttr:$record,
                       OptionalAttr<Piko_I64Attr>:$perSource);
  let assemblyFormat = [{
    $sym_name `:` $record (`per_source` $perSource^)? attr-dict
  }];
}

def Piko_ImageOp : Piko_StateOp<"image"> {
  let summary = "a grid of pixels as large as the domain";
  let description = [{
    At the start of each run every pixel is set to the `clear` value, one
    number for each number of the record, or to zeros where there is none.
    An `internal` image is no state of the pipeline's, and the host does not see
    it: kernels have it for themselves, or threads (`piko.cpu.private_images`).

    ```mlir
    piko.record @Depth {"z" : f32 at 0} size 4 align 4
    piko.pipeline @P rank 2 {
      piko.image @depth : @Depth rank 2 clear [1.0 : f32]
    }
    ```
  }];
  let arguments = (ins SymbolNameAttr:$sym_name, FlatSymbolRefAttr:$record,
                       ConfinedAttr<Piko_I64Attr, [IntMinValue<1>, IntMaxValue<4>]>:$rank,
                       OptionalAttr<ArrayAttr>:$clear, UnitAttr:$internal);
  let assemblyFormat = [{
    $sym_name `:` $record `rank` $rank (`clear` $clear^)? (`internal` $internal^)?
    attr-dict
  }];
}

def Piko_SourceOp : Piko_Op<"source", [
    HasParent<"PipelineOp">, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "primitives from the host enter a stage";
  let description = [{
    Sources are numbered in the order in which they stand in the pipeline; the
    number is the first component of a primitive's lineage.

    ```mlir
    piko.record @float {"value" : f32 at 0} size 4 align 4
    piko.pipeline @P rank 2 {
      piko.source @drop
      piko.stage @drop bins [0, 0] threads 1 : @float -> [] {
        piko.process {
        ^bb0(%p: !piko.prim<@float>):
          piko.return
        }
      }
    }
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage);
  let assemblyFormat = "$stage attr-dict";
}

def Piko_EdgeOp : Piko_Op<"edge", [
    HasParent<"PipelineOp">, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "connects a port of a stage with a stage";
  let description = [{
    Each port of each stage has exactly one edge, and its primitives are of the
    record that the consumer takes. Here what `@half` emits to port 0 is what
    `@drop` processes. `carried` is set by `piko-prune`, which may give the
    consumer a smaller record: how many bytes a primitive had before. At the
    machine level, `local` says that the consumer runs in the producer's
    kernel.

    ```mlir
    piko.record @F {"z" : f32 at 0} size 4 align 4
    piko.pipeline @P rank 2 {
      piko.source @half
      piko.edge @half[0] -> @drop
      piko.stage @half bins [0, 0] threads 64 : @F -> [@F] {
        piko.process {
        ^bb0(%f: !piko.prim<@F>):
          %z = piko.get %f "z" : !piko.prim<@F> -> f32
          piko.emit 0 (%z) : f32
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
  let arguments = (ins FlatSymbolRefAttr:$producer,
                       ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$port,
                       FlatSymbolRefAttr:$consumer,
                       OptionalAttr<ConfinedAttr<Piko_I64Attr, [IntPositive]>>:$carried,
                       UnitAttr:$local);
  let assemblyFormat = [{
    $producer `[` $port `]` `->` $consumer (`carried` $carried^)?
    (`local` $local^)? attr-dict
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOPIPELINEOPS_TD
