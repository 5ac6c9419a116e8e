// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Records as C++ structs.

#ifndef PIKO_LIB_DRIVER_RECORDWRITER_H
#define PIKO_LIB_DRIVER_RECORDWRITER_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include <string>

namespace piko {

/// The C++ type of a record that is a plain number, or an empty string.
llvm::StringRef getScalarType(RecordOp record);

bool isCppIdentifier(llvm::StringRef name);

/// The definition of a struct of that name with the record's layout, and static
/// assertions of it, each line behind `indent`. Where no C++ struct has members
/// at those places, it holds bytes.
std::string writeRecord(RecordOp record, llvm::StringRef name,
                        llvm::StringRef indent);

} // namespace piko

#endif // PIKO_LIB_DRIVER_RECORDWRITER_H
