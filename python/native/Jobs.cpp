// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Work in threads that a caller need not wait for.

#include "Core.h"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

using namespace piko::python;

namespace {

/// Whether something is so yet, for those who wait.
struct Gate {
  std::mutex mutex;
  std::condition_variable changed;
  int open = 0; ///< Jobs that have not ended.

  void enter() {
    std::lock_guard lock(mutex);
    ++open;
  }
  void leave() {
    std::lock_guard lock(mutex);
    --open;
    changed.notify_all();
  }
};

} // namespace

/// Of the process. A child leaves its parent's alone: a thread that is not
/// there may hold its lock.
static Gate *allJobs = new Gate;

struct Job::State {
  Gate gate;
};

std::shared_ptr<Job> Job::start(std::function<void(Job &)> work) {
  auto job = std::make_shared<Job>();
  job->state = std::make_shared<State>();
  job->state->gate.enter();
  Gate *all = allJobs;
  all->enter();
  std::thread([job, all, work = std::move(work)]() mutable {
    std::shared_ptr<State> state = job->state;
    try {
      work(*job);
    } catch (...) { // there is no memory for what was made
      job->status = PIKO_OUT_OF_MEMORY;
    }
    work = {};
    job.reset(); // what nobody waited for goes before the process may end
    state->gate.leave();
    all->leave();
  }).detach();
  return job;
}

bool Job::wait(double seconds) {
  std::unique_lock lock(state->gate.mutex);
  return state->gate.changed.wait_for(lock,
                                      std::chrono::duration<double>(seconds),
                                      [&] { return state->gate.open == 0; });
}

void piko::python::finishJobs() {
  std::unique_lock lock(allJobs->mutex);
  allJobs->changed.wait(lock, [] { return allJobs->open == 0; });
}

void piko::python::forgetJobs() { allJobs = new Gate; }
