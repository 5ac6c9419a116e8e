// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- mpi.hpp - Ranks that MPI runs, for C++ -----------------------------===//
//
//   MPI_Init(&argc, &argv);
//   ...
//   pipe.ranks(piko::rt::MPICommunicator(MPI_COMM_WORLD));
//
// Of libpikort-mpi (find_package(Piko COMPONENTS mpi), Piko::mpi). All ranks
// make one, as it duplicates MPI's communicator, and all let it go, which frees
// that if MPI has not ended by then.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_MPI_HPP
#define PIKORT_MPI_HPP

#include <mpi.h>

#include <piko/macros_begin.h>

#include "pikort/mpi.h"
#include "pikort/ranks.hpp"

namespace piko::rt {

class MPICommunicator : public Communicator {
public:
  /// An exchange that takes longer than `seconds` fails; 0: no limit.
  explicit MPICommunicator(MPI_Comm communicator, double seconds = 60)
      : MPICommunicator(make(communicator, seconds)) {}

private:
  struct Made {
    Status status;
    SharedRanks ranks;
  };

  explicit MPICommunicator(Made made)
      : Communicator(std::move(made.status), std::move(made.ranks)) {}

  static Made make(MPI_Comm communicator, double seconds) {
    SharedRanks ranks(pikort_ranks{}, pikort_free_mpi_ranks);
    int32_t code = pikort_make_mpi_ranks(&communicator, seconds, ranks.get());
    const char *why =
        ranks.get()->message ? ranks.get()->message(ranks.get()->context)
                       : "MPI's communicator: expected a limit of at least 0 "
                         "seconds, and memory";
    return {Status(code, why), std::move(ranks)};
  }
};

} // namespace piko::rt

#include <piko/macros_end.h>

#endif // PIKORT_MPI_HPP
