// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- MPIFaults.cpp - MPI of which a chosen call fails -------------------===//
//
// Preloaded, it stands before MPI's own functions (MPI's profiling interface).
// PIKO_MPI_FAULT=RANK:NUMBER:KIND: on that rank the call of that number, from 1,
// of those that libpikort-mpi makes fails. KIND `error`: it returns an error;
// `exit`: the process ends without a word; `hang`: it never returns, until the
// others end the process.
//
//===----------------------------------------------------------------------===//

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mpi.h>
#include <unistd.h>

#define PIKO_EXPORT extern "C" __attribute__((visibility("default")))

static int calls = 0;

/// Whether this call is the one that returns an error.
static bool fails() {
  const char *setting = std::getenv("PIKO_MPI_FAULT");
  int rank = 0, number = 0, self = -1;
  char kind[16] = "";
  if (!setting ||
      std::sscanf(setting, "%d:%d:%15s", &rank, &number, kind) != 3 ||
      PMPI_Comm_rank(MPI_COMM_WORLD, &self) != MPI_SUCCESS || self != rank ||
      ++calls != number)
    return false;
  if (std::strcmp(kind, "exit") == 0)
    _exit(3);
  if (std::strcmp(kind, "hang") == 0)
    for (;;)
      pause();
  return true;
}

PIKO_EXPORT int MPI_Comm_idup(MPI_Comm from, MPI_Comm *to,
                              MPI_Request *request) {
  return fails() ? MPI_ERR_INTERN : PMPI_Comm_idup(from, to, request);
}
PIKO_EXPORT int MPI_Comm_size(MPI_Comm communicator, int *size) {
  return fails() ? MPI_ERR_COMM : PMPI_Comm_size(communicator, size);
}
PIKO_EXPORT int MPI_Isend(const void *data, int count, MPI_Datatype type,
                          int to, int tag, MPI_Comm communicator,
                          MPI_Request *request) {
  return fails()
             ? MPI_ERR_OTHER
             : PMPI_Isend(data, count, type, to, tag, communicator, request);
}
PIKO_EXPORT int MPI_Irecv(void *data, int count, MPI_Datatype type, int from,
                          int tag, MPI_Comm communicator,
                          MPI_Request *request) {
  return fails()
             ? MPI_ERR_OTHER
             : PMPI_Irecv(data, count, type, from, tag, communicator, request);
}
PIKO_EXPORT int MPI_Testall(int count, MPI_Request requests[], int *done,
                            MPI_Status statuses[]) {
  // A wait makes as many calls as it likes: the first of each counts.
  static bool waits = false;
  bool failed = !waits && fails();
  waits = true;
  int code =
      failed ? MPI_ERR_OTHER : PMPI_Testall(count, requests, done, statuses);
  if (code != MPI_SUCCESS || *done)
    waits = false;
  return code;
}
