// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is a host's stays as it was, and what it is makes no difference: a test
// for each row of the table in docs/HostState.md.

#include "../Support/TemporaryFolder.h"

#include "Piko/Driver/PipelineLoader.h"

#include <pikort/pikort.hpp>

#include <array>
#include <cfenv>
#include <clocale>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <ucontext.h>
#include <unistd.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PIKO_SANITIZED
#endif
#endif

using namespace piko;
using namespace std::string_literals;
namespace fs = std::filesystem;

namespace {

constexpr int count = 40000;

/// Subnormal numbers, sums that are rounded, infinities and divisions by zero.
const char *const numbersText = R"(#include <piko.h>
struct State {
  piko::Buffer<float> values;
};
struct Set : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) {
    float tiny = float(i) * 1e-42f;
    float sum = 0;
    for (int k = 1; k <= 16; ++k)
      sum += 1.0f / (float(i % 7) - float(k)) + tiny * 0.3f * float(k);
    state().values[i] = i % 5 == 0 ? tiny * 0.7f : sum;
  }
};
struct Numbers : piko::Pipe<State> {
  Set set;
  Numbers() { source(set); }
};
)";

struct Outcome {
  std::vector<float> values = std::vector<float>(count);
  int32_t threads = 0;
  std::string error;

  bool operator==(const Outcome &other) const {
    return error == other.error &&
           std::memcmp(values.data(), other.values.data(),
                       count * sizeof(float)) == 0;
  }
};

Outcome runNumbers(const LoadedProgram &program, int threads = 4) {
  Outcome run;
  std::vector<int> indices(count);
  for (int i = 0; i < count; ++i)
    indices[i] = i;
  rt::Pipeline pipe(program.get());
  auto keep = [&](const rt::Status &status) {
    if (!status)
      run.error = status.message();
  };
  keep(pipe.domain({1, 1}));
  keep(pipe.threads(threads));
  keep(pipe.buffer("values", run.values));
  keep(pipe.source(0, indices));
  keep(pipe.run());
  run.threads = pikort_threads(pipe.get());
  return run;
}

/// `after` makes a text of its own of it, which is in no cache.
std::unique_ptr<LoadedProgram> load(const LoadOptions &options,
                                    std::string &diagnostics,
                                    const std::string &behind = "") {
  return loadPipelineText("numbers.piko.cpp", numbersText + behind, options,
                          diagnostics);
}

/// All tests' cache, so that piko.h is precompiled once.
class SharedCache {
public:
  static void make() {
    if (const char *known = std::getenv(variable)) { // of a death test's parent
      path = known;
      return;
    }
    path = fs::path(testing::TempDir()) /
           ("piko-host-state-" + std::to_string(getpid()));
    setenv(variable, path.c_str(), 1);
    isOwn = true;
  }
  static void remove() {
    if (isOwn)
      fs::remove_all(path);
  }
  static const fs::path &get() { return path; }

private:
  static constexpr const char *variable = "PIKO_TEST_HOST_STATE";
  static inline fs::path path;
  static inline bool isOwn = false;
};

class SharedCacheEnvironment : public testing::Environment {
public:
  void SetUp() override { SharedCache::make(); }
  void TearDown() override { SharedCache::remove(); }
};

[[maybe_unused]] const testing::Environment *const sharedCache =
    testing::AddGlobalTestEnvironment(new SharedCacheEnvironment);

/// What a host may have set; says what it is.
struct FloatingPoint {
  const char *name;
  void (*set)();
};

void setRounding() { std::fesetround(FE_TOWARDZERO); }
void setTraps() { feenableexcept(FE_DIVBYZERO | FE_OVERFLOW | FE_INVALID); }
void setFlush() {
#if defined(__x86_64__)
  _mm_setcsr(_mm_getcsr() | 0x8040); // flush to zero, denormals are zero
#endif
}
void setAll() {
  setFlush();
  std::fesetround(FE_UPWARD);
  setTraps();
}
constexpr FloatingPoint states[] = {{"rounding", setRounding},
                                    {"traps", setTraps},
                                    {"flush to zero", setFlush},
                                    {"all", setAll}};

class HostState : public TemporaryFolder {
protected:
  void SetUp() override {
    TemporaryFolder::SetUp();
    options.cache.directory = SharedCache::get();
  }
  std::unique_ptr<LoadedProgram> load(const std::string &behind = "") {
    auto program = ::load(options, diagnostics, behind);
    EXPECT_TRUE(program) << diagnostics;
    return program;
  }

  LoadOptions options;
  std::string diagnostics;
};

TEST_F(HostState, FloatingPointEnvironment) {
  for (auto target : {ExecutionTarget::CPU, ExecutionTarget::Reference}) {
    options.target = target;
    auto program = load();
    ASSERT_TRUE(program);
    Outcome expected = runNumbers(*program);
    EXPECT_EQ(expected.error, "");
    for (const FloatingPoint &state : states) {
      SCOPED_TRACE(state.name);
      std::fenv_t own, before, after;
      std::fegetenv(&own);
      state.set();
      std::fegetenv(&before);
      Outcome run = runNumbers(*program);
      std::fegetenv(&after);
      std::fesetenv(&own);
      EXPECT_TRUE(run == expected);
      EXPECT_EQ(std::memcmp(&before, &after, sizeof(before)), 0);
    }
  }
}

TEST_F(HostState, FloatingPointEnvironmentWhileItCompiles) {
  uint64_t expected = load()->codeHash();
  for (const FloatingPoint &state : states) {
    SCOPED_TRACE(state.name);
    if (state.set == setAll) // the header, too
      options.cache.directory = folder / "cache";
    std::fenv_t own, before, after;
    std::fegetenv(&own);
    state.set();
    std::fegetenv(&before);
    auto program = ::load(options, diagnostics, "// "s + state.name);
    std::fegetenv(&after);
    std::fesetenv(&own);
    ASSERT_TRUE(program) << diagnostics;
    EXPECT_EQ(program->codeHash(), expected);
    EXPECT_EQ(std::memcmp(&before, &after, sizeof(before)), 0);
  }
}

void ownHandler(int) {}

TEST_F(HostState, SignalHandlersAndMask) {
  const int signals[] = {SIGHUP,  SIGINT,  SIGPIPE, SIGTERM, SIGUSR1, SIGUSR2,
                         SIGXCPU, SIGXFSZ, SIGQUIT, SIGFPE,  SIGTRAP, SIGSYS};
  std::map<int, struct sigaction> before;
  for (int number : signals) {
    struct sigaction own = {};
    own.sa_handler = ownHandler;
    sigaction(number, &own, &before[number]);
  }
  sigset_t maskBefore, maskAfter;
  pthread_sigmask(SIG_SETMASK, nullptr, &maskBefore);
  for (auto target : {ExecutionTarget::CPU, ExecutionTarget::Reference}) {
    options.target = target;
    for (int pass = 0; pass < 2; ++pass) // without a cache's entry, and with it
      runNumbers(*load("// with handlers"));
  }
  pthread_sigmask(SIG_SETMASK, nullptr, &maskAfter);
  for (int number : signals) {
    struct sigaction after = {};
    sigaction(number, &before[number], &after);
    EXPECT_EQ(after.sa_handler, ownHandler) << strsignal(number);
  }
  for (int number = 1; number < 32; ++number)
    EXPECT_EQ(sigismember(&maskBefore, number),
              sigismember(&maskAfter, number));
}

TEST_F(HostState, Locale) {
  uint64_t expected = load()->codeHash();
  Outcome first = runNumbers(*load());
  // Numbers have commas there.
  std::string made = "localedef -i de_DE -f UTF-8 " + pathOf("de_DE.UTF-8");
  ASSERT_EQ(std::system(made.c_str()), 0);
  setenv("LOCPATH", folder.c_str(), 1);
  std::string name = "de_DE.UTF-8";
  ASSERT_TRUE(std::setlocale(LC_ALL, name.c_str()));
  ASSERT_STREQ(std::localeconv()->decimal_point, ",");
  auto program = load("// with commas");
  EXPECT_EQ(std::setlocale(LC_ALL, nullptr), name);
  std::setlocale(LC_ALL, "C");
  unsetenv("LOCPATH");
  ASSERT_TRUE(program);
  EXPECT_EQ(program->codeHash(), expected);
  EXPECT_TRUE(runNumbers(*program) == first);
}

// --- Processes of their own -------------------------------------------------

/// Each starts this program again.
class HostStateDeathTest : public testing::Test {
protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }

  /// In a process in which nobody has used OpenMP yet.
  static void runHere(
      int32_t threads, int32_t fewest, int32_t most,
      const std::function<void()> &before = [] {}) {
    LoadOptions options;
    options.cache.directory = SharedCache::get();
    std::string diagnostics;
    auto program = ::load(options, diagnostics);
    if (!program) {
      std::fprintf(stderr, "%s", diagnostics.c_str());
      std::_Exit(2);
    }
    before();
    Outcome run = runNumbers(*program, threads);
    if (!run.error.empty() || run.threads < fewest || run.threads > most) {
      std::fprintf(stderr, "%d threads %s", run.threads, run.error.c_str());
      std::_Exit(3);
    }
    std::_Exit(runNumbers(*program, 1) == run ? 0 : 4);
  }
};

TEST_F(HostStateDeathTest, VariablesOfOpenMP) {
  for (const char *setting :
       {"OMP_NUM_THREADS=", "OMP_NUM_THREADS= ", "OMP_NUM_THREADS=abc",
        "OMP_NUM_THREADS=-3", "OMP_NUM_THREADS=99999999999999999999",
        "OMP_NUM_THREADS=2,",
        "KMP_FORKJOIN_BARRIER=", "OMP_SCHEDULE=", "KMP_PLAIN_BARRIER=0,0",
        "KMP_INHERIT_FP_CONTROL=0", "OMP_STACKSIZE=1k"}) {
    SCOPED_TRACE(setting);
    std::string name(setting, std::strchr(setting, '='));
    setenv(name.c_str(), std::strchr(setting, '=') + 1, 1);
    // libomp may warn. The variables are the host's afterwards.
    EXPECT_EXIT(runHere(0, 1, 10000,
                        [=] {
                          const char *value = std::getenv(name.c_str());
                          if (!value || setting != name + "=" + value)
                            std::_Exit(5);
                        }),
                testing::ExitedWithCode(0), "");
    unsetenv(name.c_str());
  }
}

TEST_F(HostStateDeathTest, VariablesOfOpenMPWithOneThread) {
  setenv("OMP_NUM_THREADS", "abc", 1);
  EXPECT_EXIT(runHere(1, 1, 1), testing::ExitedWithCode(0), "");
  unsetenv("OMP_NUM_THREADS");
}

TEST_F(HostStateDeathTest, NumberOfThreads) {
  setenv("OMP_NUM_THREADS", "3", 1);
  EXPECT_EXIT(runHere(0, 3, 3), testing::ExitedWithCode(0), "");
  unsetenv("OMP_NUM_THREADS");
  EXPECT_EXIT(runHere(5, 5, 5), testing::ExitedWithCode(0), "");
}

TEST_F(HostStateDeathTest, Affinity) {
  cpu_set_t before;
  ASSERT_EQ(sched_getaffinity(0, sizeof(before), &before), 0);
  int first = 0;
  while (!CPU_ISSET(first, &before))
    ++first;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(first, &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
  EXPECT_EXIT(runHere(0, 1, 1), testing::ExitedWithCode(0), "");
  sched_setaffinity(0, sizeof(before), &before);
}

// A sanitizer has terabytes of addresses, and threads of its own.
#ifndef PIKO_SANITIZED
/// Bytes of addresses that the process has.
size_t countAddresses() {
  FILE *file = std::fopen("/proc/self/statm", "r");
  size_t pages = 0;
  if (!file || std::fscanf(file, "%zu", &pages) != 1)
    std::_Exit(6);
  std::fclose(file);
  return pages * size_t(sysconf(_SC_PAGESIZE));
}

void limitAddresses(size_t more) {
  rlimit limit;
  getrlimit(RLIMIT_AS, &limit);
  limit.rlim_cur = countAddresses() + more;
  setrlimit(RLIMIT_AS, &limit);
}

TEST_F(HostStateDeathTest, ThreadsThatTheSystemRefuses) {
  setenv("OMP_STACKSIZE", "8M", 1); // as usual, so that 64 do not fit
  for (size_t megabytes : {20, 60, 100, 200, 300, 500})
    EXPECT_EXIT(runHere(64, 1, 63, [=] { limitAddresses(megabytes << 20); }),
                testing::ExitedWithCode(0), "")
        << megabytes;
  unsetenv("OMP_STACKSIZE");
}

TEST_F(HostStateDeathTest, NoThreadToCompileIn) {
  auto compile = [] {
    LoadOptions options;
    options.cache.enabled = false;
    limitAddresses(size_t(8) << 20);
    std::string diagnostics;
    auto program = ::load(options, diagnostics);
    std::fprintf(stderr, "%s", diagnostics.c_str());
    std::_Exit(program ? 1 : 0);
  };
  EXPECT_EXIT(compile(), testing::ExitedWithCode(0),
              "error: cannot make a thread to compile in: ");
}
#endif

// --- Stacks -----------------------------------------------------------------

void runOnThread(size_t stackSize, const std::function<void()> &body) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  ASSERT_EQ(pthread_attr_setstacksize(&attributes, stackSize), 0);
  pthread_t thread;
  auto call = [](void *function) -> void * {
    (*static_cast<const std::function<void()> *>(function))();
    return nullptr;
  };
  ASSERT_EQ(pthread_create(&thread, &attributes, call,
                           const_cast<std::function<void()> *>(&body)),
            0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
}

TEST_F(HostState, SmallStacks) {
  auto program = load();
  Outcome expected = runNumbers(*program), small;
  runOnThread(128 << 10, [&] {
    small = runNumbers(*program);
    auto again = ::load(options, diagnostics, "// on a small stack");
    ASSERT_TRUE(again) << diagnostics;
    EXPECT_EQ(again->codeHash(), program->codeHash());
  });
  EXPECT_TRUE(small == expected);
}

#ifndef PIKO_SANITIZED
/// A stack that no thread knows of, as engines have them for their jobs.
struct HostFiber {
  static constexpr size_t size = 64 << 10;
  ucontext_t host{}, self{};
  std::function<void()> body;
  static inline HostFiber *current = nullptr;

  void run() {
    void *stack = mmap(nullptr, size, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    getcontext(&self);
    self.uc_stack.ss_sp = stack;
    self.uc_stack.ss_size = size;
    self.uc_link = &host;
    makecontext(&self, [] { current->body(); }, 0);
    current = this;
    swapcontext(&host, &self);
    munmap(stack, size);
  }
};

TEST_F(HostState, Fibers) {
  auto program = load();
  Outcome expected = runNumbers(*program), inFiber, twice;
  HostFiber fiber;
  fiber.body = [&] {
    inFiber = runNumbers(*program);
    twice = runNumbers(*program);
  };
  fiber.run();
  EXPECT_TRUE(inFiber == expected);
  EXPECT_TRUE(twice == expected);
}
#endif

// --- Processes --------------------------------------------------------------

// A sanitizer's runtime has threads of its own, which a child lacks.
#ifndef PIKO_SANITIZED
TEST_F(HostState, Fork) {
  auto program = load();
  Outcome expected = runNumbers(*program);
  std::vector<pid_t> children;
  for (int i = 0; i < 8; ++i) {
    pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      bool same = runNumbers(*program) == expected;
      auto again = ::load(options, diagnostics,
                          "// of a child " + std::to_string(i % 2));
      same = same && again && runNumbers(*again) == expected;
      std::_Exit(same ? 0 : 1);
    }
    children.push_back(child);
  }
  EXPECT_TRUE(runNumbers(*program) == expected);
  for (pid_t child : children) {
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
}
#endif

// --- What it prints ---------------------------------------------------------

/// What goes to a descriptor meanwhile goes to a file.
class Redirection {
public:
  Redirection(int descriptor, const fs::path &path)
      : descriptor(descriptor), before(dup(descriptor)) {
    int file = open(path.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
    dup2(file, descriptor);
    close(file);
  }
  ~Redirection() {
    std::fflush(nullptr);
    dup2(before, descriptor);
    close(before);
  }

private:
  int descriptor, before;
};

TEST_F(HostState, PrintsNothing) {
  std::string wrong = numbersText;
  wrong.replace(wrong.find("float tiny"), 5, "floot");
  {
    Redirection out(1, folder / "out"), error(2, folder / "error");
    runNumbers(*load("// which prints nothing"));
    loadPipelineText("wrong.piko.cpp", wrong, options, diagnostics);
    options.cpu = "no-such-processor";
    ::load(options, diagnostics);
    options.cpu = "native";
    options.pipeName = "None";
    ::load(options, diagnostics);
  }
  EXPECT_EQ(fs::file_size(folder / "out"), 0u);
  EXPECT_EQ(fs::file_size(folder / "error"), 0u);
  EXPECT_NE(diagnostics.find("floot"), std::string::npos) << diagnostics;
}

} // namespace
