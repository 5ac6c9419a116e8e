// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The runtime's functions and structs as its own header declares them: names,
// types, offsets and sizes come from pikort/abi.h, and from nowhere else.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_RUNTIMEABI_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_RUNTIMEABI_H

#include "pikort/abi_layout.h"

#include "mlir/IR/Builders.h"
#include "llvm/ADT/StringRef.h"

#include <array>
#include <cstddef>
#include <type_traits>

namespace piko {

/// What a function takes or gives, or a member is.
enum class ABIType : uint8_t { None, I32, I64, Address };

template <typename T> constexpr ABIType getABIType() {
  if constexpr (std::is_void_v<T>) {
    return ABIType::None;
  } else if constexpr (std::is_pointer_v<T>) {
    return ABIType::Address;
  } else {
    static_assert(std::is_integral_v<T> && (sizeof(T) == 4 || sizeof(T) == 8),
                  "generated code has numbers of 32 and 64 bits alone");
    return sizeof(T) == 4 ? ABIType::I32 : ABIType::I64;
  }
}

/// The type in the llvm dialect.
mlir::Type convertType(mlir::MLIRContext *context, ABIType type);

/// See PIKO_RUNTIME_FUNCTION.
struct RuntimeFunction {
  llvm::StringLiteral name;
  ABIType result;
  std::array<ABIType, 12> parameters;
  size_t count;
};

template <typename Result, typename... Parameters>
constexpr RuntimeFunction describeFunction(llvm::StringLiteral name,
                                           Result (*)(Parameters...)) {
  return {name,
          getABIType<Result>(),
          {getABIType<Parameters>()...},
          sizeof...(Parameters)};
}

/// A function of pikort/abi.h; nothing is called or linked.
#define PIKO_RUNTIME_FUNCTION(function)                                        \
  (::piko::describeFunction(#function,                                         \
                            static_cast<decltype(&function)>(nullptr)))

/// Whether it is one of those that report an error of a kernel's loop.
inline bool isFailure(llvm::StringRef function) {
  return function == PIKO_RUNTIME_FUNCTION(pikoir_fail).name ||
         function == PIKO_RUNTIME_FUNCTION(pikoir_fail_index).name ||
         function == PIKO_RUNTIME_FUNCTION(pikoir_fail_barrier).name;
}

/// See PIKO_RUNTIME_MEMBER.
struct RuntimeMember {
  int64_t offset; ///< In bytes.
  ABIType type;
};

/// A member of a struct of pikort/abi.h.
#define PIKO_RUNTIME_MEMBER(type, member)                                      \
  (::piko::RuntimeMember{offsetof(type, member),                               \
                         ::piko::getABIType<decltype(type::member)>()})

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_RUNTIMEABI_H
