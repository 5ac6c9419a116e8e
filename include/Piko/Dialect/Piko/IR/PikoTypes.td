// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Types carry the record by symbol, so that fields can be read and written one
// by one and dead ones removed.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOTYPES_TD
#define PIKO_DIALECT_PIKO_IR_PIKOTYPES_TD

include "Piko/Dialect/Piko/IR/PikoBase.td"

class Piko_Type<string name, string typeMnemonic>
    : TypeDef<Piko_Dialect, name> {
  let mnemonic = typeMnemonic;
}

def Piko_PrimType : Piko_Type<"Prim", "prim"> {
  let summary = "a primitive that flows along an edge";
  let description = [{
    An immutable value of the record named, for example
    `!piko.prim<@Fragment>`. `piko.get` reads its fields.
  }];
  let parameters = (ins "::mlir::FlatSymbolRefAttr":$record);
  let assemblyFormat = "`<` $record `>`";
}

def Piko_ListType : Piko_Type<"List", "list"> {
  let summary = "the primitives of a bin that a process phase is called with";
  let description = [{
    An immutable list in lineage order, for example `!piko.list<@Fragment>`.
    `piko.list_at` reads a primitive of it.
  }];
  let parameters = (ins "::mlir::FlatSymbolRefAttr":$record);
  let assemblyFormat = "`<` $record `>`";
}

def Piko_BinsType : Piko_Type<"Bins", "bins"> {
  let summary = "the primitives of a stage, grouped by bin";
  let description = [{
    On the CPU, the storage of a stage's input. It holds the primitives in
    lineage order, a compressed table of the cells they are in, and the units
    of work that the machine's threads take. A *cell* is a bin, or a tile of a
    bin that `piko.owner` divides.
  }];
  let parameters = (ins "::mlir::FlatSymbolRefAttr":$record);
  let assemblyFormat = "`<` $record `>`";
}

def Piko_TileType : Piko_Type<"Tile", "tile"> {
  let summary = "the pixels of a bin";
  let description = [{
    The part of an image that lies in one bin, kept near who runs the bin:
    records of the extents that bins have, for example
    `!piko.tile<@Depth, [32, 32]>`. `piko.tile` makes it.
  }];
  let parameters = (ins "::mlir::FlatSymbolRefAttr":$record,
                        ArrayRefParameter<"int64_t">:$extents);
  let assemblyFormat = "`<` $record `,` `[` $extents `]` `>`";
}

def Piko_EdgeType : Piko_Type<"Edge", "edge"> {
  let summary = "primitives on their way to a stage";
  let description = [{
    What a source holds, or what kernels have emitted to a port and no kernel has
    taken yet. A value of a `piko.program`, for example `!piko.edge<@Fragment>`.
  }];
  let parameters = (ins "::mlir::FlatSymbolRefAttr":$record);
  let assemblyFormat = "`<` $record `>`";
}

def Piko_WriterType : Piko_Type<"Writer", "writer"> {
  let summary = "where a unit of work leaves what it emits";
  let description = [{
    On the CPU, one for each unit of work, so that threads never share one;
    the units are joined in order when the kernel ends.
  }];
}

def Piko_PrivateCopyType : Piko_Type<"PrivateCopy", "private_copy"> {
  let summary = "where a worker keeps what it adds to a piece of state";
  let description = [{
    On the CPU, one for each thread that runs units of work, so that none waits
    for another; what they hold is combined when the kernel ends.
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOTYPES_TD
