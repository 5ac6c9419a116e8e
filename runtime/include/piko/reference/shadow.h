//===- piko/reference/shadow.h - Who touched an element of the state ------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// For checking mode: what is remembered of each element of a buffer or image.
//
// A reference to an element can be read and written without notice, so the
// element's bytes are compared: at the end of the strand that was given the
// reference, or when another strand comes to the element. A change was a store
// by the last strand that was given one; no change, a read.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_SHADOW_H
#define PIKO_REFERENCE_SHADOW_H

#include <piko/reference/strand.h>
#include <piko/reference/written.h>

namespace piko::reference {

enum class AccessKind { Read, Store, Update, Atomic };

struct Access {
  AccessKind kind;
  std::shared_ptr<const Strand> by;
  SourcePlace at;
};

/// "'depth'", or without a name "an image of 'float'".
inline std::string stateText(const std::string &name, bool isImage,
                             std::string_view elementType) {
  if (!name.empty())
    return "'" + name + "'";
  return (isImage ? "an image of '" : "a buffer of '") +
         std::string(elementType) + "'";
}

/// A buffer or an image.
struct Memory {
  Memory() = default;
  template <class T>
  Memory(T *elements, int64_t count)
      : elementType(typeName<T>()),
        data(reinterpret_cast<std::byte *>(elements)), elementSize(sizeof(T)),
        findUnwritten([](const std::byte *element) {
          return reference::findUnwritten(
              *reinterpret_cast<const T *>(element));
        }),
        elements(count) {
    extent[0] = count;
  }

  std::string name; ///< empty where it is not known
  std::string_view elementType;
  std::byte *data = nullptr;
  size_t elementSize = 0;
  const char *(*findUnwritten)(const std::byte *element) = nullptr;
  Cell extent{1, 1, 1, 1};
  int rank = 1;
  bool isImage = false;
  std::vector<std::unique_ptr<Element>> elements; ///< those that were touched

  std::string text() const { return stateText(name, isImage, elementType); }
};

/// Whether `count` bytes are not those of `before`.
PIKO_UNSANITIZED inline bool differ(const std::byte *before,
                                    const std::byte *now, size_t count) {
  for (size_t i = 0; i < count; ++i)
    if (before[i] != now[i])
      return true;
  return false;
}

/// What no phase changes: a stage, or the state but for what is in its buffers
/// and images.
struct Fixed {
  const void *address = nullptr;
  size_t size = 0;
  std::string_view type;
  std::vector<std::byte> content{}; ///< when the run began

  const std::byte *bytes() const {
    return static_cast<const std::byte *>(address);
  }
  void keepContent() { content.assign(bytes(), bytes() + size); }
  bool hasChanged() const { return differ(content.data(), bytes(), size); }
  /// Where it did.
  PIKO_UNSANITIZED size_t findChange() const {
    size_t i = 0;
    while (content[i] == bytes()[i])
      ++i;
    return i;
  }
};

struct Element {
  /// A strand that was given a reference.
  struct Holder {
    std::shared_ptr<Strand> strand;
    SourcePlace at;
    int64_t reads = 0;    ///< references given, less the atomics made of them
    bool changed = false; ///< stored or updated by this strand
  };

  Memory *memory = nullptr;
  int64_t index = 0;
  std::vector<std::byte> content; ///< when it was last looked at
  std::vector<Holder> holders;    ///< the innermost call last
  std::vector<Access> accesses;   ///< the first and the last of each kind

  std::byte *bytes() const {
    return memory->data + index * memory->elementSize;
  }
  bool hasChanged() const {
    return differ(content.data(), bytes(), content.size());
  }
  void keepContent() { content.assign(bytes(), bytes() + memory->elementSize); }

  /// "'depth[3, 4]'", or "[3, 4] of an image of 'float'".
  std::string text() const {
    Cell cell;
    int64_t rest = index;
    for (int d = 0; d < 4; ++d) {
      cell[d] = rest % memory->extent[d];
      rest /= memory->extent[d];
    }
    std::string place = reference::toText(cell, memory->rank);
    place.front() = '[';
    place.back() = ']';
    if (memory->name.empty())
      return place + " of " + memory->text();
    return "'" + memory->name + place + "'";
  }
};

/// What was done to an element. A reference to an element of a buffer that did
/// not change may have been written through, too.
inline std::string toPast(const Element &element, AccessKind kind) {
  switch (kind) {
  case AccessKind::Read:
    return element.memory->isImage ? "read" : "read or stored unchanged";
  case AccessKind::Store:
    return "stored";
  case AccessKind::Update:
    return "updated";
  case AccessKind::Atomic:
    return "changed atomically";
  }
  return "";
}

} // namespace piko::reference

#endif // PIKO_REFERENCE_SHADOW_H
