//===- piko/reference/written.h - Fields that were never written ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// MemorySanitizer knows of each byte whether it was written. In a build without
// it every field counts as written.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_WRITTEN_H
#define PIKO_REFERENCE_WRITTEN_H

#include <piko/status.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>

// A function that may look at bytes that were not written.
#ifdef PIKO_KNOWS_WRITTEN
#define PIKO_UNSANITIZED __attribute__((no_sanitize("memory")))
#else
#define PIKO_UNSANITIZED
#endif

namespace piko::reference {

#ifdef PIKO_KNOWS_WRITTEN
template <class T> bool isWritten(const T &value) {
  return __msan_test_shadow(&value, sizeof(T)) < 0;
}

/// A struct that is not a GLM vector or matrix, whose bytes are all fields'.
template <class T>
concept HasFields = std::is_class_v<T> && !requires(T t) { t.length(); };

template <class T> const char *findUnwritten(const T &value);

/// Called by __builtin_dump_struct for each field, and for what is around it.
struct FieldVisitor {
  const char *&unwritten;

  template <class... Args> void operator()(const char *, const Args &...) {}
  template <class V>
  void operator()(const char *format, const char *, const char *,
                  const char *name, const V &field) {
    bool ok = true;
    if constexpr (std::is_pointer_v<V>) {
      // Structs and arrays come as pointers and are to be printed as "*%p".
      if (__builtin_strchr(format, '*'))
        ok = !findUnwritten(*field);
      else
        ok = isWritten(field);
    } else {
      ok = isWritten(field);
    }
    if (!ok && !unwritten)
      unwritten = name;
  }
};

/// The name of the first field that was not written; null if there is none.
template <class T> const char *findUnwritten(const T &value) {
  const char *unwritten = nullptr;
  if constexpr (std::is_array_v<T>) {
    for (const auto &element : value)
      if (const char *name = findUnwritten(element))
        return name;
  } else if constexpr (HasFields<T>)
    __builtin_dump_struct(&value, FieldVisitor{unwritten});
  else if (!isWritten(value))
    unwritten = "value";
  return unwritten;
}
#else
template <class T> const char *findUnwritten(const T &) { return nullptr; }
#endif

inline std::string unwrittenText(const char *field, std::string_view record) {
  return "expected field '" + std::string(field) + "' of '" +
         std::string(record) + "' to be written, but it never was";
}

} // namespace piko::reference

#endif // PIKO_REFERENCE_WRITTEN_H
