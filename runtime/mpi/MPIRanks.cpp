// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- MPIRanks.cpp - Ranks that MPI runs ---------------------------------===//
//
// An exchange is messages that do not block, in both directions, and a wait
// with a limit: a rank that has stopped answering is an error that names it.
// MPI counts bytes by an int, so that what is longer goes in pieces.

#include "pikort/mpi.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <mpi.h>
#include <new>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr int64_t piece = int64_t(1) << 30;

struct Context {
  MPI_Comm communicator = MPI_COMM_NULL;
  double seconds = 0;
  std::string message;
  std::vector<MPI_Request> requests;
  std::vector<int> peers; ///< Of requests.
};

bool check(Context &context, const char *call, int code) {
  if (code == MPI_SUCCESS)
    return true;
  char text[MPI_MAX_ERROR_STRING];
  int length = 0;
  if (MPI_Error_string(code, text, &length) != MPI_SUCCESS)
    length = 0;
  context.message =
      std::string(call) + " failed: " + std::string(text, size_t(length));
  return false;
}

/// Waits for all requests; false on an error, and when the time is over.
bool wait(Context &context) {
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin = Clock::now();
  auto count = static_cast<int>(context.requests.size());
  for (int64_t turn = 0;; ++turn) {
    int done = 0;
    if (!check(context, "MPI_Testall",
               MPI_Testall(count, context.requests.data(), &done,
                           MPI_STATUSES_IGNORE)))
      return false;
    if (done)
      return true;
    // Others may need this core. To sleep takes 60 us at least.
    constexpr int64_t spins = 200;
    if (turn < spins)
      continue;
    std::this_thread::yield();
    if (turn % spins != 0)
      continue;
    double spent = std::chrono::duration<double>(Clock::now() - begin).count();
    if (context.seconds > 0 && spent > context.seconds)
      break;
    if (spent > 0.02)
      std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  std::string late;
  for (size_t i = 0; i < context.peers.size(); ++i) {
    std::string peer = std::to_string(context.peers[i]);
    if (context.requests[i] != MPI_REQUEST_NULL &&
        (late.empty() || context.peers[i] != context.peers[i - 1]))
      late += (late.empty() ? " from rank " : ", ") + peer;
  }
  char limit[32];
  std::snprintf(limit, sizeof limit, "%g", context.seconds);
  context.message = "expected all ranks to exchange what they have within " +
                    std::string(limit) + " s, but there is no answer" + late;
  return false;
}

bool post(Context &context, int rank, int64_t bytes, auto &&call) {
  for (int64_t at = 0; at < bytes; at += piece) {
    context.requests.push_back(MPI_REQUEST_NULL);
    context.peers.push_back(rank);
    if (!call(at, static_cast<int>(std::min(piece, bytes - at)),
              &context.requests.back()))
      return false;
  }
  return true;
}

bool exchangeAll(Context &context, const void *const *send,
                 const int64_t *sendBytes, void *const *receive,
                 const int64_t *receiveBytes) {
  int size = 0;
  if (!check(context, "MPI_Comm_size",
             MPI_Comm_size(context.communicator, &size)))
    return false;
  context.requests.clear();
  context.peers.clear();
  for (int r = 0; r < size; ++r)
    if (!post(context, r, receiveBytes[r],
              [&](int64_t at, int bytes, MPI_Request *request) {
                return check(context, "MPI_Irecv",
                             MPI_Irecv(static_cast<char *>(receive[r]) + at,
                                       bytes, MPI_BYTE, r, 0,
                                       context.communicator, request));
              }))
      return false;
  for (int r = 0; r < size; ++r)
    if (!post(context, r, sendBytes[r],
              [&](int64_t at, int bytes, MPI_Request *request) {
                return check(context, "MPI_Isend",
                             MPI_Isend(static_cast<const char *>(send[r]) + at,
                                       bytes, MPI_BYTE, r, 0,
                                       context.communicator, request));
              }))
      return false;
  return wait(context);
}

int32_t exchange(void *data, const void *const *send, const int64_t *sendBytes,
                 void *const *receive, const int64_t *receiveBytes) {
  return exchangeAll(*static_cast<Context *>(data), send, sendBytes, receive,
                     receiveBytes)
             ? 0
             : 1;
}

const char *message(void *data) {
  return static_cast<Context *>(data)->message.c_str();
}

} // namespace

extern "C" {

int32_t pikort_make_mpi_ranks(const void *communicator, double seconds,
                              pikort_ranks *ranks) {
  if (!communicator || !ranks || !(seconds >= 0))
    return PIKORT_INVALID_ARGUMENT;
  auto *context = new (std::nothrow) Context;
  if (!context)
    return PIKORT_OUT_OF_MEMORY;
  context->seconds = seconds;
  *ranks = {0, 1, context, exchange, message};
  MPI_Comm from = *static_cast<const MPI_Comm *>(communicator);
  context->requests.resize(1, MPI_REQUEST_NULL);
  bool made =
      check(*context, "MPI_Comm_rank", MPI_Comm_rank(from, &ranks->rank)) &&
      check(*context, "MPI_Comm_size", MPI_Comm_size(from, &ranks->size)) &&
      check(*context, "MPI_Comm_idup",
            MPI_Comm_idup(from, &context->communicator,
                          context->requests.data())) &&
      wait(*context) &&
      check(*context, "MPI_Comm_set_errhandler",
            MPI_Comm_set_errhandler(context->communicator, MPI_ERRORS_RETURN));
  return made ? PIKORT_OK : PIKORT_RANK_FAILED;
}

void pikort_free_mpi_ranks(pikort_ranks *ranks) {
  if (!ranks || !ranks->context)
    return;
  std::unique_ptr<Context> context(static_cast<Context *>(ranks->context));
  ranks->context = nullptr;
  int ended = 0;
  if (MPI_Finalized(&ended) == MPI_SUCCESS && !ended &&
      context->communicator != MPI_COMM_NULL)
    MPI_Comm_free(&context->communicator);
}

int32_t pikort_start_mpi(double seconds, pikort_ranks *ranks) {
  int started = 0, provided = 0;
  if (MPI_Initialized(&started) != MPI_SUCCESS ||
      (!started && MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED,
                                   &provided) != MPI_SUCCESS))
    return PIKORT_RANK_FAILED;
  MPI_Comm world = MPI_COMM_WORLD;
  if (MPI_Comm_set_errhandler(world, MPI_ERRORS_RETURN) != MPI_SUCCESS)
    return PIKORT_RANK_FAILED;
  return pikort_make_mpi_ranks(&world, seconds, ranks);
}

int32_t pikort_stop_mpi(pikort_ranks *ranks, int32_t fails) {
  int started = 0;
  if (MPI_Initialized(&started) != MPI_SUCCESS || !started)
    return PIKORT_OK;
  if (fails)
    MPI_Abort(MPI_COMM_WORLD, 1);
  // To finalize has no limit of time.
  auto &context = *static_cast<Context *>(ranks->context);
  context.peers.clear();
  context.requests.assign(1, MPI_REQUEST_NULL);
  if (!check(context, "MPI_Ibarrier",
             MPI_Ibarrier(context.communicator, context.requests.data())) ||
      !wait(context))
    return PIKORT_RANK_FAILED;
  pikort_free_mpi_ranks(ranks);
  MPI_Finalize();
  return PIKORT_OK;
}

} // extern "C"
