// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What passes change, seen from outside: by the operations that are there
// before and after them. No pass counts for itself.

#ifndef PIKO_DRIVER_PASSREPORT_H
#define PIKO_DRIVER_PASSREPORT_H

#include "llvm/ADT/MapVector.h"
#include "llvm/Support/raw_ostream.h"

#include <cstdint>
#include <map>
#include <string>

namespace mlir {
class PassManager;
} // namespace mlir

namespace piko {

/// Of all passes of some managers, by name in the order of their first runs.
class PassReport {
public:
  /// Watches a manager's passes, which must not outlive this.
  void follow(mlir::PassManager &passes);

  /// A line for each pass that changed anything, with the operations whose
  /// numbers changed most.
  void writeText(llvm::raw_ostream &out) const;
  /// An array of all passes: how often each ran and changed anything, and how
  /// many operations there are more (or, negative, less) by name.
  void writeJSON(llvm::raw_ostream &out) const;

private:
  struct Instrumentation;
  struct Entry {
    int64_t runs = 0, changes = 0;
    std::map<std::string, int64_t> operations;
  };
  llvm::MapVector<std::string, Entry, std::map<std::string, unsigned>> entries;
};

} // namespace piko

#endif // PIKO_DRIVER_PASSREPORT_H
