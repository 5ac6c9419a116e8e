// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- update.h - What update() calls -------------------------------------===//

#ifndef PIKO_UPDATE_H
#define PIKO_UPDATE_H

namespace piko::detail {

template <class T> inline constexpr bool isChangeable = false;
template <class T> inline constexpr bool isChangeable<T &> = true;
template <class T> inline constexpr bool isChangeable<const T &> = false;
template <class T> inline constexpr bool isNothing = false;
template <> inline constexpr bool isNothing<void> = true;

/// Whether a function gives nothing and takes a pixel that it cannot change:
/// not known of templates.
template <class F> struct PixelFunction {
  static constexpr bool isIdle = false;
};
template <class C, class R, class P> struct PixelFunction<R (C::*)(P)> {
  static constexpr bool isIdle = isNothing<R> && !isChangeable<P>;
};
template <class C, class R, class P>
struct PixelFunction<R (C::*)(P) const> : PixelFunction<R (C::*)(P)> {};
template <class F>
  requires requires { &F::operator(); }
struct PixelFunction<F> : PixelFunction<decltype(&F::operator())> {};

template <class F> struct PlainFunction {
  using type = F;
};
template <class F> struct PlainFunction<F &> : PlainFunction<F> {};
template <class F> struct PlainFunction<const F> : PlainFunction<F> {};

/// Whether update(image, at, f) cannot do anything.
template <class F>
inline constexpr bool isIdleUpdate =
    PixelFunction<typename PlainFunction<F>::type>::isIdle;

} // namespace piko::detail

#define PIKO_EXPECT_UPDATE(F)                                                  \
  static_assert(!::piko::detail::isIdleUpdate<F>,                              \
                "expected a function that takes the pixel by reference, as "   \
                "in [&](Pixel &p): it gives nothing, and what it changes is "  \
                "a copy")

#endif // PIKO_UPDATE_H
