// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SUPPORT_HELDSIGNALS_H
#define PIKO_SUPPORT_HELDSIGNALS_H

#include <csignal>

namespace piko::support {

/// Holds back what would end the process between a file's first byte and its
/// last, on this thread. Beyond a limit on sizes a write is then an error.
class HeldSignals {
public:
  HeldSignals();
  HeldSignals(const HeldSignals &) = delete;
  HeldSignals &operator=(const HeldSignals &) = delete;
  ~HeldSignals();

private:
  /// Takes a signal that our own write raised.
  void drop(int number);

  sigset_t before;
  sigset_t pendingBefore;
};

} // namespace piko::support

#endif // PIKO_SUPPORT_HELDSIGNALS_H
