// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- GridBarriers.cpp - Ways in which blocks wait for each other --------===//
//
// Each kernel goes through rounds: a block writes the round's number to its
// slot, comes to a barrier of the grid, and counts the slots of blocks that
// have not yet come so far.
//
//===----------------------------------------------------------------------===//

#include "Device.h"

/// Runs the rounds with a barrier, which is called by all threads.
template <typename F>
static inline void runRounds(u32 *slots, u32 *missing, F barrier) {
  for (u32 round = 1; round <= 4; ++round) {
    if (threadX() == 0)
      __atomic_store_n(slots + blockX(), round, __ATOMIC_RELAXED);
    barrier(round);
    for (u32 i = threadX(); i < blocksX(); i += threadsX())
      if (__atomic_load_n(slots + i, __ATOMIC_RELAXED) < round)
        __nvvm_atom_add_gen_i(reinterpret_cast<int *>(missing), 1);
    barrier(round + 100);
  }
}

/// One block adds what makes the top bit flip when all others have added 1.
extern "C" kernel void topBit(u32 *slots, u32 *missing, u32 *state) {
  runRounds(slots, missing, [=](u32) {
    __syncthreads();
    if (threadX() == 0) {
      u32 mine = blockX() ? 1 : 0x80000000 - (blocksX() - 1);
      __nvvm_membar_gl();
      u32 old = __atomic_fetch_add(state, mine, __ATOMIC_RELAXED);
      while (!((old ^ *const_cast<volatile u32 *>(state)) & 0x80000000))
        ;
      __nvvm_membar_gl();
    }
    __syncthreads();
  });
}

/// The last that comes reverses what the others wait for.
extern "C" kernel void senseReversing(u32 *slots, u32 *missing, u32 *state) {
  u32 sense = 0;
  runRounds(slots, missing, [=](u32) mutable {
    __syncthreads();
    sense = !sense;
    if (threadX() == 0) {
      __nvvm_membar_gl();
      if (__atomic_fetch_add(state, 1, __ATOMIC_ACQ_REL) == blocksX() - 1) {
        __atomic_store_n(state, 0, __ATOMIC_RELAXED);
        __atomic_store_n(state + 1, sense, __ATOMIC_RELEASE);
      }
      for (u32 sleep = 8; __atomic_load_n(state + 1, __ATOMIC_ACQUIRE) != sense;
           sleep = sleep < 256 ? sleep * 2 : sleep)
        __nvvm_nanosleep(sleep);
    }
    __syncthreads();
  });
}

/// Every block has a flag that the first one collects; no atomic operation.
extern "C" kernel void flags(u32 *slots, u32 *missing, u32 *state) {
  auto *seen = const_cast<volatile u32 *>(state);
  u32 count = 0;
  runRounds(slots, missing, [=](u32) mutable {
    ++count;
    __syncthreads();
    if (blockX()) {
      if (threadX() == 0) {
        __nvvm_membar_gl();
        seen[blockX()] = count;
        while (seen[0] != count)
          __nvvm_nanosleep(20);
      }
    } else {
      for (u32 i = threadX() + 1; i < blocksX(); i += threadsX())
        while (seen[i] != count)
          __nvvm_nanosleep(20);
      __syncthreads();
      if (threadX() == 0)
        seen[0] = count;
    }
    __nvvm_membar_gl();
    __syncthreads();
  });
}

/// All threads of a block look, by an atomic operation that changes nothing.
extern "C" kernel void allThreads(u32 *slots, u32 *missing, u32 *state) {
  u32 target = 0;
  runRounds(slots, missing, [=](u32) mutable {
    target += blocksX() * threadsX();
    __nvvm_membar_gl();
    __nvvm_atom_add_gen_i(reinterpret_cast<int *>(state), 1);
    while (u32(__nvvm_atom_add_gen_i(reinterpret_cast<int *>(state), 0)) <
           target)
      asm volatile("nanosleep.u32 %0;" ::"r"(32u + threadX()));
    __nvvm_membar_gl();
  });
}

/// A lock that one thread of each block takes in turn, and a counter after it.
extern "C" kernel void lock(u32 *slots, u32 *missing, u32 *state) {
  u32 target = 0;
  runRounds(slots, missing, [=](u32) mutable {
    target += blocksX();
    __syncthreads();
    if (threadX() == 0) {
      for (bool first = true;; first = false) {
        while (__nvvm_atom_cas_gen_i(reinterpret_cast<int *>(state), 0, 1))
          __nvvm_nanosleep(10);
        __nvvm_membar_gl();
        u32 count = *const_cast<volatile u32 *>(state + 1) + (first ? 1 : 0);
        *const_cast<volatile u32 *>(state + 1) = count;
        __nvvm_membar_gl();
        __atomic_exchange_n(state, 0u, __ATOMIC_RELEASE);
        if (count >= target)
          break;
        __nvvm_nanosleep(50);
      }
    }
    __syncthreads();
  });
}

/// A block asks all threads with a barrier of its own whether it must wait.
extern "C" kernel void together(u32 *slots, u32 *missing, u32 *state) {
  u32 target = 0;
  runRounds(slots, missing, [=](u32) mutable {
    target += blocksX();
    __syncthreads();
    if (threadX() == 0) {
      __nvvm_membar_gl();
      __atomic_fetch_add(state, 1, __ATOMIC_RELAXED);
    }
    while (__nvvm_bar0_or(threadX() == 0 &&
                          __atomic_load_n(state, __ATOMIC_ACQUIRE) < target))
      __nvvm_nanosleep(40);
  });
}
