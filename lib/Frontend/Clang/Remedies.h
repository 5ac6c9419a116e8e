//===- Remedies.h - What to write in place of a call of Piko's --*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_CLANG_REMEDIES_H
#define PIKO_LIB_FRONTEND_CLANG_REMEDIES_H

#include "llvm/ADT/StringRef.h"

#include <string>

namespace piko {

/// What Piko says in place of an error of Clang's in a stage's text, because of
/// a note that belongs to it, of a place in piko.h or not; empty where Clang's
/// words will do.
std::string explainNote(llvm::StringRef error, llvm::StringRef note,
                        bool isInLanguage, llvm::StringRef stage);

/// What Piko says in place of an error of Clang's in a stage's text; empty
/// where Clang's words will do.
std::string explainError(llvm::StringRef error);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_CLANG_REMEDIES_H
