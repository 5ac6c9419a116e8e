// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Contracts.h - What code takes for granted of the host's numbers ----===//
//
// Kernels do not test what a contract says: that the numbers of a field are
// indices of a buffer, or below a number. A run tests those of which the host
// has bound others since the last one that went well.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_CONTRACTS_H
#define PIKO_RUNTIME_COMMON_CONTRACTS_H

#include <cstdint>
#include <string>
#include <vector>

struct pikort_pipeline;

namespace piko::rt {

/// The numbers, all of one type, of a source's primitives, or of a buffer's
/// elements.
struct ContractTerms {
  int32_t source, state; ///< One of them is -1.
  int32_t target;        ///< The buffer that they index, or -1: then they are
  int64_t below;         ///< ... below this.
  int32_t type;
  bool isUnsigned;
  bool operator==(const ContractTerms &) const = default;
};

struct ContractField {
  std::string name;
  int64_t offset, elements, stride;
};

struct Contract {
  ContractTerms terms;
  std::vector<ContractField> fields;
  int64_t version = -1; ///< Of what was found to have ...
  uint64_t largest = 0; ///< ... this, a negative number being larger than all.
};

class Contracts {
public:
  /// Fields with the same terms are looked at together.
  void add(const ContractTerms &terms, ContractField field);
  /// Before a run, in the order of the pipeline's stream; throws Failure.
  /// Whether it has looked at numbers, those of a device as the host's copies.
  bool check(pikort_pipeline &p);
  /// All that is bound may be other than it was.
  void forget();

private:
  std::vector<Contract> contracts;
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_CONTRACTS_H
