//===- piko/reference/state.h - Buffers, images, atomics ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The state of a pipeline is an aggregate: members of type Buffer and Image
// are what their names say, any other member is a constant that the host sets
// before a run.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_STATE_H
#define PIKO_REFERENCE_STATE_H

#include <piko/macros_begin.h>

#include <piko/reference/executor.h>

#include <cstring>
#include <span>

namespace piko {
namespace reference {

/// The phase that is running; null for the host.
inline CallFrame *currentFrame() {
  Executor *executor = Executor::current();
  return executor ? executor->frame : nullptr;
}

/// Throws for an index outside a list or, as `into` says, outside of state.
[[noreturn]] inline void failIndex(int64_t index, int64_t count,
                                   const SourcePlace &at,
                                   const std::string &into = "") {
  std::string message = "expected an index " + into + "in [0, " +
                        std::to_string(count) + "), but got " +
                        std::to_string(index);
  CallFrame *call = currentFrame();
  if (!call)
    throw Error(message);
  call->at = at;
  call->node->fail(call->phase == Phase::Assign ? -1 : call->bin, message);
}
/// The same for the Buffer or the Image at an address.
[[noreturn]] inline void failAccess(const void *handle, bool isImage,
                                    std::string_view elementType, int64_t index,
                                    int64_t count, const SourcePlace &at) {
  std::string into;
  if (currentFrame())
    into = "into " +
           stateText(Executor::current()->checker.nameOf(handle), isImage,
                     elementType) +
           " ";
  failIndex(index, count, at, into);
}

/// Throws for a phase that uses a Buffer to which the host has bound nothing.
[[noreturn]] inline void failUnbound(const void *handle,
                                     std::string_view elementType) {
  CallFrame &call = *currentFrame();
  std::string name = Executor::current()->checker.nameOf(handle);
  call.node->fail(call.phase == Phase::Assign ? -1 : call.bin,
                  (name.empty() ? stateText(name, false, elementType)
                                : "buffer '" + name + "'") +
                      " is not bound");
}

/// Throws if a phase makes a call that is the host's.
inline void expectHost(const char *what) {
  if (CallFrame *call = currentFrame())
    call->node->fail(call->phase == Phase::Assign ? -1 : call->bin,
                     std::string("expected ") + what +
                         " on the host's side, but a phase calls it: a phase "
                         "uses elements by their index");
}

/// The checker, while a phase runs in checking mode; else null.
inline Checker *activeChecker() {
  if constexpr (!checking)
    return nullptr;
  return currentFrame() ? &Executor::current()->checker : nullptr;
}

#ifdef PIKO_CHECK
/// An index, and the place in the user's file where it is used.
struct Index {
  template <class Integer>
    requires std::is_convertible_v<Integer, int64_t>
  Index(Integer value, SourcePlace at = SourcePlace::current())
      : value(static_cast<int64_t>(value)), at(at) {}
  operator int64_t() const { return value; }
  int64_t value;
  SourcePlace at;
};
inline SourcePlace placeOf(const Index &index) { return index.at; }
#else
using Index = int64_t;
inline SourcePlace placeOf(Index) { return {}; }
#endif

/// A vector, an array or a span.
template <class Range>
concept HostRange = requires(const Range &range) {
  std::data(range);
  std::size(range);
};

/// Whether its elements stay when an argument of that type goes.
template <class Range>
constexpr bool outlives = std::is_lvalue_reference_v<Range> ||
                          std::ranges::enable_borrowed_range<Range>;

/// Memory for elements, which goes with its owner; lighter to compile than
/// std::unique_ptr, of which every type of state would have its own.
template <class T> class OwnedArray {
public:
  OwnedArray() = default;
  OwnedArray(const OwnedArray &) = delete;
  OwnedArray &operator=(const OwnedArray &) = delete;
  ~OwnedArray() { delete[] elements; }
  /// Takes over an array that `new` made, or null.
  void reset(T *array = nullptr) {
    delete[] elements;
    elements = array;
  }
  T *get() const { return elements; }

private:
  T *elements = nullptr;
};

/// What the pipeline has to know of its images.
class ImageBase {
public:
  virtual void prepare(const Cell &domain) = 0;

  /// The images of the pipeline whose state is under construction.
  static std::vector<ImageBase *> *&registry() {
    static thread_local std::vector<ImageBase *> *images = nullptr;
    return images;
  }

protected:
  ImageBase() {
    if (registry())
      registry()->push_back(this);
  }
  ImageBase(const ImageBase &) = delete;
  ImageBase &operator=(const ImageBase &) = delete;
  ~ImageBase() = default;
};

/// What the pipeline has to know of a buffer.
class BufferBase {
public:
  /// The host's elements.
  struct View {
    const std::byte *data;
    int64_t count, size; ///< how many, and the bytes of one
    bool isBound;
    std::string_view type;
  };
  virtual void allocateZeroed(int64_t count) = 0;
  virtual View view() const = 0;

protected:
  BufferBase() = default;
  BufferBase(const BufferBase &) = delete;
  BufferBase &operator=(const BufferBase &) = delete;
  ~BufferBase() = default;
};

} // namespace reference

/// A one-dimensional array: bound by the host, or allocated by the pipeline
/// (Pipe::allocateForSource).
template <class T> class Buffer final : public reference::BufferBase {
  static_assert(std::is_trivially_copyable_v<T>,
                "the elements of a buffer must be trivially copyable");

public:
  Buffer() = default;

  int64_t size() const {
    if (!isBound)
      expectBound();
    return count;
  }
  T &operator[](reference::Index i) const {
    reference::SourcePlace at = reference::placeOf(i);
    if (!isBound)
      expectBound();
    if (i < 0 || i >= count)
      reference::failAccess(this, /*isImage=*/false, reference::typeName<T>(),
                            i, count, at);
    if (reference::Checker *checker = reference::activeChecker())
      checker->give(
          checker->element(this, i,
                           [&] { return reference::Memory(elements, count); }),
          at);
    return elements[i];
  }

  // For the host.

  using value_type = T;
  using const_iterator = const T *;

  /// Uses the caller's memory, which must outlive the runs.
  Status bind(T *data, int64_t n) {
    reference::expectHost("bind()");
    owned.reset();
    hold(data, n);
    return {};
  }
  template <class U>
    requires std::is_same_v<U, T>
  Status bind(const U *, int64_t) {
    static_assert(!std::is_same_v<U, T>,
                  "a pipeline may write to a buffer; assign copies");
    return {};
  }
  template <reference::HostRange Range> Status bind(Range &&range) {
    static_assert(reference::outlives<Range>,
                  "bind does not copy; the elements must outlive the runs");
    return bind(std::data(range), static_cast<int64_t>(std::size(range)));
  }
  /// Copies n elements.
  Status assign(const T *data, int64_t n) {
    reference::expectHost("assign()");
    T *copy = new T[n];
    std::copy(data, data + n, copy);
    owned.reset(copy);
    hold(copy, n);
    return {};
  }
  template <class Range> Status assign(const Range &range) {
    return assign(std::data(range), static_cast<int64_t>(std::size(range)));
  }
  Status assign(std::initializer_list<T> values) {
    return assign(values.begin(), static_cast<int64_t>(values.size()));
  }
  /// Makes n elements whose bytes are zero.
  Status allocate(int64_t n) {
    reference::expectHost("allocate()");
    allocateZeroed(n);
    return {};
  }
  void allocateZeroed(int64_t n) override {
    owned.reset(new T[n]);
    hold(owned.get(), n);
    if (n)
      std::memset(static_cast<void *>(elements), 0, n * sizeof(T));
  }
  T *data() const {
    reference::expectHost("data()");
    return elements;
  }
  View view() const override {
    return {reinterpret_cast<const std::byte *>(elements), count, sizeof(T),
            isBound, reference::typeName<T>()};
  }

  // For both: in a phase for the elements in order, `for (T &x : buffer)`.

  T *begin(
      reference::SourcePlace at = reference::SourcePlace::current()) const {
    if (!isBound)
      expectBound();
    if (reference::Checker *checker = reference::activeChecker())
      for (int64_t i = 0; i < count; ++i)
        checker->give(
            checker->element(
                this, i, [&] { return reference::Memory(elements, count); }),
            at);
    return elements;
  }
  T *end() const { return elements + count; }

private:
  void hold(T *data, int64_t n) {
    elements = data;
    count = n;
    isBound = true;
  }
  /// A phase needs the host's elements.
  void expectBound() const {
    if (reference::currentFrame())
      reference::failUnbound(this, reference::typeName<T>());
  }

  reference::OwnedArray<T> owned;
  T *elements = nullptr;
  int64_t count = 0;
  bool isBound = false;
};

/// A grid of pixels with the extent of the domain (of its first dimensions, if
/// the domain has more), cleared to T{} when a run begins.
template <class T, int Rank = 2>
class Image final : public reference::ImageBase {
  static_assert(std::is_trivially_copyable_v<T>,
                "the pixels of an image must be trivially copyable");
  static_assert(Rank >= 1 && Rank <= 4, "an image has one to four dimensions");

public:
  Image() = default;

  const T &operator()(
      const Cells<Rank> &at,
      reference::SourcePlace place = reference::SourcePlace::current()) const {
    T &found = pixel(at, place);
    if (reference::Checker *checker = reference::activeChecker())
      checker->give(element(*checker, found), place);
    return found;
  }
  void store(const Cells<Rank> &at, const T &value,
             reference::SourcePlace place = reference::SourcePlace::current()) {
    T &found = pixel(at, place);
    auto change = [&] { found = value; };
    if (reference::Checker *checker = reference::activeChecker())
      checker->access(element(*checker, found), reference::AccessKind::Store,
                      place, change);
    else
      change();
  }
  Cells<Rank> extent() const { return reference::fromCell<Rank>(cells); }

  // For the host.

  int64_t size() const {
    reference::expectHost("size() of an image");
    return countPixels();
  }
  /// The pixels, row-major, x fastest; for a host to change between runs, too.
  T *data() const {
    reference::expectHost("data()");
    return pixels.get();
  }

  /// Sizes and clears the image; its memory stays where its size does.
  void prepare(const reference::Cell &domain) override {
    int64_t before = countPixels();
    for (int d = 0; d < Rank; ++d)
      cells[d] = domain[d];
    int64_t count = countPixels();
    if (count != before)
      pixels.reset(new T[count]);
    std::fill_n(pixels.get(), count, T{});
  }

  /// f(pixel), for BasicStage::update.
  template <class F>
  auto update(const Cells<Rank> &at, const reference::SourcePlace &place,
              F &&f) {
    T &found = pixel(at, place);
    if (reference::Checker *checker = reference::activeChecker())
      return checker->access(element(*checker, found),
                             reference::AccessKind::Update, place,
                             [&] { return f(found); });
    return f(found);
  }

private:
  int64_t countPixels() const {
    return cells[0] * cells[1] * cells[2] * cells[3];
  }
  T &pixel(const Cells<Rank> &at, const reference::SourcePlace &place) const {
    int64_t index = 0;
    for (int d = Rank - 1; d >= 0; --d) {
      if (at[d] < 0 || at[d] >= cells[d])
        reference::failAccess(this, /*isImage=*/true, reference::typeName<T>(),
                              at[d], cells[d], place);
      index = index * cells[d] + at[d];
    }
    return pixels.get()[index];
  }

  reference::Element &element(reference::Checker &checker,
                              const T &pixel) const {
    return checker.element(this, &pixel - pixels.get(), [&] {
      reference::Memory memory(pixels.get(), countPixels());
      memory.extent = cells;
      memory.rank = Rank;
      memory.isImage = true;
      return memory;
    });
  }

  reference::Cell cells = [] {
    reference::Cell none{1, 1, 1, 1};
    for (int d = 0; d < Rank; ++d)
      none[d] = 0;
    return none;
  }();
  reference::OwnedArray<T> pixels;
};

} // namespace piko

#include <piko/macros_end.h>

#endif // PIKO_REFERENCE_STATE_H
