// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Operations on the lanes of a vector: elections and votes, which piko-vectorize
// writes as masks; access to state and to primitives, and permutations, which it
// makes. A part of PikoCPUOps.td, which includes it.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOLANEOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOLANEOPS_TD

def Piko_Lanes : VectorOfRankAndType<[1], [F32, F64, I8, I16, I32, I64]>;
def Piko_LaneMask : VectorOfRankAndType<[1], [I1]>;
def Piko_LaneIndex
    : AnyTypeOf<[Index, VectorOfRankAndType<[1], [Index]>],
                "index, or one for each lane">;

def Piko_ElectOp : Piko_CPUOp<"elect", [NoMemoryEffect]> {
  let summary = "which side of a condition the lanes of a vector take in a turn";
  let description = [{
    Iteration delaying, for loops that were merged into one. Of the lanes that are at
    work, those with a true condition are on the first side. `side` is true if the
    first one is taken, and is the same for all lanes: the second one is taken from
    so many `eighths` of these lanes on, or if there are no others. `takes` is
    whether a lane is on the side that is taken; others wait for a turn of theirs.
    Where there are no lanes, an iteration is always on the side that is taken. It
    depends on who is at work where it stands: nothing moves it.

    ```mlir
    %side, %takes = piko.cpu.elect %isInside second 3
    ```
  }];
  let arguments = (ins I1:$condition, Piko_I64Attr:$eighths);
  let results = (outs I1:$side, I1:$takes);
  let assemblyFormat = "$condition `second` $eighths attr-dict";
  let hasVerifier = 1;
}

def Piko_VoteOp : Piko_CPUOp<"vote", [Pure]> {
  let summary = "whether a condition holds in all lanes that are at work";
  let description = [{
    The same for all lanes of a vector: true only if the condition holds in each that is
    at work where it stands, and there is one. Where it is false, a lane may have a
    condition that is true. So it chooses between two ways to the same result, of which
    one is for all cases. Where there are no lanes, it is the condition.

    ```mlir
    %all = piko.cpu.vote %isInside
    ```
  }];
  let arguments = (ins I1:$condition);
  let results = (outs I1:$result);
  let assemblyFormat = "$condition attr-dict";
}

class Piko_LaneAccessOp<string mnemonic, list<Trait> traits = []>
    : Piko_CPUOp<mnemonic, !listconcat(traits, [
        AttrSizedOperandSegments,
        DeclareOpInterfaceMethods<Piko_StateAccessInterface>,
        DeclareOpInterfaceMethods<SymbolUserOpInterface>])>;

def Piko_GatherOp : Piko_LaneAccessOp<"gather", [MemoryEffects<[MemRead]>]> {
  let summary = "reads a field of a piece of state for each lane";
  let description = [{
    An index is that of all lanes, or a vector with one for each. With
    `consecutive` all are scalars, those of the first lane, and each further lane
    has the next x (the first index). Indices of lanes in the mask are inside of
    the state; the others read nothing and get 0.

    ```mlir
    %xs = piko.cpu.gather @vertices[%places : vector<16xindex>] "position.x"
      mask %mask : vector<16xi1>, vector<16xf32>
    %zs = piko.cpu.gather consecutive @depth[%i, %j : index, index] "z"
      mask %mask : vector<16xi1>, vector<16xf32>
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$state,
                       Variadic<Piko_LaneIndex>:$indices, StrAttr:$field,
                       Variadic<Index>:$elements, Piko_LaneMask:$mask,
                       UnitAttr:$consecutive);
  let results = (outs Piko_Lanes:$result);
  let assemblyFormat = [{
    (`consecutive` $consecutive^)? $state
    (`[` $indices^ `:` type($indices) `]`)? $field (`[` $elements^ `]`)?
    `mask` $mask attr-dict `:` type($mask) `,` type($result)
  }];
}

def Piko_LanePlaces : VectorOfRankAndType<[1], [I32, Index]>;

def Piko_GatherRunOp : Piko_CPUOp<"gather_run", [
    MemoryEffects<[MemRead]>,
    DeclareOpInterfaceMethods<Piko_StateAccessInterface>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "reads elements that stand side by side for each lane";
  let description = [{
    A result for each of them, from the index on, of a buffer whose elements are
    no more than this field. They take 1, 2, 4 or 8 bytes together. Those of lanes
    in the mask, of which there is one, are inside of the buffer; the others get
    numbers that do not matter. Each lane loads its own: elements of fewer than 32
    bits have no gathers.

    ```mlir
    %v0, %v1 = piko.cpu.gather_run @vertices[%lanes] "position.x" mask %mask
      : vector<16xi32>, vector<16xi1> -> vector<16xf32>, vector<16xf32>
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$state, Piko_LanePlaces:$index,
                       StrAttr:$field, Piko_LaneMask:$mask);
  let results = (outs Variadic<Piko_Lanes>:$values);
  let assemblyFormat = [{
    $state `[` $index `]` $field `mask` $mask attr-dict
    `:` type($index) `,` type($mask) `->` type($values)
  }];
}

def Piko_ScatterOp : Piko_LaneAccessOp<"scatter", [MemoryEffects<[MemWrite]>]> {
  let summary = "writes a field of an element for each lane";
  let description = [{
    As in `piko.cpu.gather`. No two lanes in the mask write the same element.

    ```mlir
    piko.cpu.scatter %values, consecutive @depth[%i, %j : index, index] "z"
      mask %mask : vector<16xi1>, vector<16xf32>
    ```
  }];
  let arguments = (ins Piko_Lanes:$value, FlatSymbolRefAttr:$state,
                       Variadic<Piko_LaneIndex>:$indices, StrAttr:$field,
                       Variadic<Index>:$elements, Piko_LaneMask:$mask,
                       UnitAttr:$consecutive);
  let assemblyFormat = [{
    $value `,` (`consecutive` $consecutive^)? $state
    (`[` $indices^ `:` type($indices) `]`)? $field (`[` $elements^ `]`)?
    `mask` $mask attr-dict `:` type($mask) `,` type($value)
  }];
}

def Piko_ReduceRowOp
    : Piko_LaneAccessOp<"reduce_row", [MemoryEffects<[MemRead, MemWrite]>]> {
  let summary = "changes elements of a private copy that stand side by side";
  let description = [{
    A `piko.atomic` for each lane in the mask. The indices are those of the first
    lane, and each further lane has the next x, so that no two lanes change one
    element. Those of lanes in the mask are inside of the state. Where the
    runtime has given no copy, each lane changes the state indivisibly.

    ```mlir
    %c = piko.cpu.private_copy add @histogram "value" of %writer
    piko.cpu.reduce_row add %lanes, @histogram[%i] "value" mask %mask in %c
      : vector<16xi1>, vector<16xi32>
    ```
  }];
  let arguments = (ins Piko_AtomicKind:$kind, Piko_Lanes:$value,
                       FlatSymbolRefAttr:$state, Variadic<Index>:$indices,
                       StrAttr:$field, Variadic<Index>:$elements,
                       Piko_LaneMask:$mask, Piko_PrivateCopyType:$copy);
  let assemblyFormat = [{
    $kind $value `,` $state `[` $indices `]` $field (`[` $elements^ `]`)?
    `mask` $mask `in` $copy attr-dict `:` type($mask) `,` type($value)
  }];
  let extraClassDeclaration = [{
    bool getConsecutive() { return true; }
  }];
}

def Piko_Addresses : VectorOfRankAndType<[1], [Index]>;

def Piko_LaneItemsOp : Piko_CPUOp<"items", [MemoryEffects<[MemRead]>]> {
  let hasVerifier = 1;
  let summary = "the address of a primitive for each lane";
  let description = [{
    Of those at these positions, or, from a scalar on, at consecutive ones. The
    positions of lanes in the mask are those of primitives; the other lanes get an
    address of nothing.

    ```mlir
    %as = piko.cpu.items %bins[%first : index] mask %mask
      : !piko.bins<@Fragment>, vector<16xi1>, vector<16xindex>
    ```
  }];
  let arguments = (ins Piko_BinsType:$bins, Piko_LaneIndex:$position,
                       Piko_LaneMask:$mask);
  let results = (outs Piko_Addresses:$result);
  let assemblyFormat = [{
    $bins `[` $position `:` type($position) `]` `mask` $mask attr-dict
    `:` qualified(type($bins)) `,` type($mask) `,` type($result)
  }];
}

def Piko_LaneGetOp : Piko_CPUOp<"get", [
    MemoryEffects<[MemRead]>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "reads a field of a primitive for each lane";
  let description = [{
    The primitives are given by their addresses. Lanes that are not in the mask
    read nothing and get 0.

    ```mlir
    %zs = piko.cpu.get %as "z" of @Fragment mask %mask
      : vector<16xindex>, vector<16xi1>, vector<16xf32>
    ```
  }];
  let arguments = (ins Piko_Addresses:$addresses, StrAttr:$field,
                       Variadic<Index>:$elements, FlatSymbolRefAttr:$record,
                       Piko_LaneMask:$mask);
  let results = (outs Piko_Lanes:$result);
  let assemblyFormat = [{
    $addresses $field (`[` $elements^ `]`)? `of` $record `mask` $mask attr-dict
    `:` type($addresses) `,` type($mask) `,` type($result)
  }];
}

def Piko_LaneElementsOp : Piko_CPUOp<"elements", [
    MemoryEffects<[]>,
    DeclareOpInterfaceMethods<Piko_StateAccessInterface>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "the addresses of elements of a piece of state";
  let description = [{
    An index is that of all lanes, or a vector with one for each; with
    `consecutive` as in `piko.cpu.gather`. Those of lanes whose indices are outside
    of the state are no addresses.

    ```mlir
    %as = piko.cpu.elements @vertices[%places : vector<16xindex>]
      : vector<16xindex>
    %bs = piko.cpu.elements consecutive @vertices[%first : index]
      : vector<16xindex>
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$state,
                       Variadic<Piko_LaneIndex>:$indices,
                       UnitAttr:$consecutive);
  let results = (outs Piko_Addresses:$addresses);
  let assemblyFormat = [{
    (`consecutive` $consecutive^)? $state `[` $indices `:` type($indices) `]` attr-dict `:` type($addresses)
  }];
}

def Piko_LaneGetFieldsOp : Piko_CPUOp<"get_fields", [
    MemoryEffects<[MemRead]>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "reads fields of a record for each lane";
  let description = [{
    As `piko.cpu.get` for each field, none of which is an array. What lies side by
    side is read at once where all lanes read: by loads of 16 bytes, and a
    transposition. Consecutive elements are loaded as wide vectors, whose words are
    de-interleaved.

    ```mlir
    %x, %y, %z = piko.cpu.get_fields %as ["x", "y", "z"] of @Fragment mask %mask
      : vector<16xindex>, vector<16xi1>
        -> vector<16xi32>, vector<16xi32>, vector<16xf32>
    ```
  }];
  let arguments = (ins Piko_Addresses:$addresses, StrArrayAttr:$fields,
                       FlatSymbolRefAttr:$record, Piko_LaneMask:$mask);
  let results = (outs Variadic<Piko_Lanes>:$values);
  let assemblyFormat = [{
    $addresses $fields `of` $record `mask` $mask attr-dict
    `:` type($addresses) `,` type($mask) `->` type($values)
  }];
}

def Piko_LaneSetFieldsOp : Piko_CPUOp<"set_fields", [
    MemoryEffects<[MemWrite]>,
    DeclareOpInterfaceMethods<Piko_StateAccessInterface>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "writes fields of an element for each lane";
  let description = [{
    As `piko.cpu.scatter` for each field, none of which is an array, where the
    elements are those at addresses (`piko.cpu.elements`). What lies side by side is
    written at once where all lanes write: by a transposition, and stores of 16
    bytes. Those of consecutive elements are interleaved.

    ```mlir
    piko.cpu.set_fields(%values) to %as ["position.x"] of @vertices mask %mask
      : vector<16xindex>, vector<16xi1>, vector<16xf32>
    ```
  }];
  let arguments = (ins Variadic<Piko_Lanes>:$values, Piko_Addresses:$addresses,
                       StrArrayAttr:$fields, FlatSymbolRefAttr:$state,
                       Piko_LaneMask:$mask);
  let assemblyFormat = [{
    `(` $values `)` `to` $addresses $fields `of` $state `mask` $mask attr-dict
    `:` type($addresses) `,` type($mask) `,` type($values)
  }];
}

def Piko_Permutable
    : VectorOfRankAndType<[1], [F32, F64, I1, I8, I16, I32, I64, Index]>;
def Piko_LaneNumbers : VectorOfRankAndType<[1], [I32]>;

def Piko_PermuteOp : Piko_CPUOp<"permute", [
    Pure, AllTypesMatch<["vector", "result"]>]> {
  let hasVerifier = 1;
  let summary = "gives each lane what another one has";
  let description = [{
    Lane `i` of the result is lane `lanes[i]` of the vector, modulo their number,
    which is a power of two. One instruction, where the processor has it.

    ```mlir
    %r = piko.cpu.permute %values[%lanes] : vector<16xf32>, vector<16xi32>
    ```
  }];
  let arguments = (ins Piko_Permutable:$vector, Piko_LaneNumbers:$lanes);
  let results = (outs Piko_Permutable:$result);
  let assemblyFormat = [{
    $vector `[` $lanes `]` attr-dict `:` type($vector) `,` type($lanes)
  }];
}

def Piko_CompressOp : Piko_CPUOp<"compress", [
    Pure, AllTypesMatch<["vector", "result"]>]> {
  let hasVerifier = 1;
  let summary = "brings lanes in a mask to the front";
  let description = [{
    In their order; what the lanes after them have does not matter. One instruction,
    where the processor has it, or a permutation that a table says.

    ```mlir
    %r = piko.cpu.compress %values mask %mask : vector<16xf32>, vector<16xi1>
    ```
  }];
  let arguments = (ins Piko_Permutable:$vector, Piko_LaneMask:$mask);
  let results = (outs Piko_Permutable:$result);
  let assemblyFormat = [{
    $vector `mask` $mask attr-dict `:` type($vector) `,` type($mask)
  }];
}

def Piko_LaneBins : VectorOfRankAndType<[1], [Index]>;

def Piko_LaneAppendOp : Piko_CPUOp<"append", [
    AttrSizedOperandSegments,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "emits primitives of the lanes in a mask";
  let description = [{
    What `piko.storage.append` does for one lane in the mask after the other: the
    numbers of the records are those of its fields, and may be followed by those of
    further records, each of which has a mask of its own; a lane emits the first
    record before the second. With bins, each record is put into one of the
    stage's, and into a tile of it where there are tiles. Positions are not
    counted: see `piko.cpu.is_counted`.

    The lanes' records are transposed, and stored one after the other.

    ```mlir
    piko.cpu.append %writer[0] (%values, %values : vector<16xf32>, vector<16xf32>)
      of @Point mask %mask : vector<16xi1>
    piko.cpu.append %writer[0] (%values, %values : vector<16xf32>, vector<16xf32>)
      of @Point mask %mask : vector<16xi1>
      in @plot[%places : vector<16xindex>]
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Piko_I64Attr:$port,
                       Variadic<Piko_Lanes>:$values,
                       FlatSymbolRefAttr:$record,
                       Variadic<Piko_LaneMask>:$masks,
                       OptionalAttr<FlatSymbolRefAttr>:$stage,
                       Variadic<Piko_LaneBins>:$bins,
                       Variadic<Piko_LaneBins>:$tiles);
  let assemblyFormat = [{
    $writer `[` $port `]` `(` $values `:` type($values) `)` `of` $record
    `mask` $masks `:` type($masks) (`in` $stage^ `[` $bins `:` type($bins) `]`)?
    (`tile` $tiles^ `:` type($tiles))? attr-dict
  }];
}

def Piko_StoreRecordsOp : Piko_CPUOp<"store_records", [
    MemoryEffects<[MemWrite]>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "stores a record of each lane";
  let description = [{
    The numbers are those of its fields. Each record is cut into pieces of 16
    bytes, the last of which may be padded: the memory has room for those of all
    lanes.

    ```mlir
    %memory = memref.alloca() : memref<256xi8>
    piko.cpu.store_records %memory (%values, %values
      : vector<16xf32>, vector<16xf32>) of @Point : memref<256xi8>
    ```
  }];
  let arguments = (ins Piko_Bytes:$memory, Variadic<Piko_Lanes>:$values,
                       FlatSymbolRefAttr:$record);
  let assemblyFormat = [{
    $memory `(` $values `:` type($values) `)` `of` $record attr-dict
    `:` qualified(type($memory))
  }];
}

def Piko_AppendRecordOp : Piko_CPUOp<"append_record", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "emits a record that a lane has stored";
  let description = [{
    As `piko.storage.append`, with the numbers of one of the records that
    `piko.cpu.store_records` stored.

    ```mlir
    %memory = memref.alloca() : memref<256xi8>
    %p = piko.cpu.append_record %writer[0] from %memory[%i of 16]
      : memref<256xi8> -> !piko.prim<@Point>
    ```
  }];
  let arguments = (ins Piko_WriterType:$writer, Piko_I64Attr:$port,
                       Piko_Bytes:$memory, Index:$lane, Piko_I64Attr:$lanes);
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = [{
    $writer `[` $port `]` `from` $memory `[` $lane `of` $lanes `]` attr-dict
    `:` qualified(type($memory)) `->` qualified(type($prim))
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOLANEOPS_TD
