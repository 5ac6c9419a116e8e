// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   PikoOtherLLVM llvm|mesa before|after
//
// A host that compiles pipelines has another release of LLVM in its process:
// one that it loads itself, as any plugin does, or Mesa's, which draws with it.
// The host uses it before Piko or after Piko, and then the other one and it
// again. `before` puts it before all other libraries, so that whatever it
// exports is found first. Exits with 77 and says why where there is no other
// LLVM.
//
//===----------------------------------------------------------------------===//
#include "Piko/Driver/PipelineLoader.h"

#include <pikort/pikort.hpp>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

using namespace piko;

namespace {

constexpr int skipped = 77;

struct Skip : std::runtime_error {
  using runtime_error::runtime_error;
};

void require(bool isSo, const std::string &what) {
  if (!isSo)
    throw std::runtime_error(what);
}

/// A function of a library, looked for there and in what it is linked to.
template <class Function> Function *find(void *library, const char *name) {
  auto *found = reinterpret_cast<Function *>(dlsym(library, name));
  require(found, std::string("no function ") + name);
  return found;
}

//===----------------------------------------------------------------------===//
// Piko
//===----------------------------------------------------------------------===//

/// Compiles a pipeline of its own and runs it: element i becomes i * factor.
void usePiko(int factor) {
  const std::string text = R"(#include <piko.h>
struct State { piko::Buffer<int> values; };
struct Set : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) { state().values[i] = i * )" +
                           std::to_string(factor) + R"(; }
};
struct Numbers : piko::Pipe<State> {
  Set set;
  Numbers() { source(set); }
};
)";
  LoadOptions options;
  options.cache.enabled = false;
  std::string diagnostics;
  auto program =
      loadPipelineText("numbers.piko.cpp", text, options, diagnostics);
  require(program != nullptr, "Piko: " + diagnostics);
  std::vector<int> values(1000), indices(1000);
  for (int i = 0; i < 1000; ++i)
    indices[size_t(i)] = i;
  rt::Pipeline pipe(program->get());
  for (const rt::Status &status :
       {pipe.domain({1, 1}), pipe.buffer("values", values),
        pipe.source(0, indices), pipe.run()})
    require(bool(status), "Piko: " + status.message());
  for (int i = 0; i < 1000; ++i)
    require(values[size_t(i)] == i * factor, "Piko: a wrong number");
  std::printf("Piko compiled and ran\n");
}

//===----------------------------------------------------------------------===//
// The other LLVM, by its C functions
//===----------------------------------------------------------------------===//

#if defined(__x86_64__)
#define HOST_TARGET "X86"
#elif defined(__aarch64__)
#define HOST_TARGET "AArch64"
#endif

void *openLLVM(int flags) {
  for (const char *name :
       {"libLLVM-15.so.1", "libLLVM-14.so.1", "libLLVM-16.so.1",
        "libLLVM-17.so.1", "libLLVM.so.18.1", "libLLVM.so.19.1",
        "libLLVM.so.20.1", "libLLVM.so.21.1"})
    if (void *library = dlopen(name, flags)) {
      std::printf("the other LLVM: %s\n", name);
      return library;
    }
  return nullptr;
}

/// Parses LLVM IR, makes code of it, and calls that.
void useLLVM() {
#ifdef HOST_TARGET
  static void *library = openLLVM(RTLD_NOW | RTLD_LOCAL);
  if (!library)
    throw Skip("no other release of LLVM is installed");
  struct Context;
  struct Module;
  struct Buffer;
  struct Engine;
  for (const char *part : {"TargetInfo", "Target", "TargetMC", "AsmPrinter"})
    find<void()>(library,
                 (std::string("LLVMInitialize" HOST_TARGET) + part).c_str())();
  find<void()>(library, "LLVMLinkInMCJIT")();
  Context *context = find<Context *()>(library, "LLVMContextCreate")();
  const std::string text = "define i32 @twice(i32 %x) {\n"
                           "  %y = mul i32 %x, 2\n"
                           "  ret i32 %y\n"
                           "}\n";
  Buffer *buffer = find<Buffer *(const char *, size_t, const char *)>(
      library, "LLVMCreateMemoryBufferWithMemoryRangeCopy")(
      text.data(), text.size(), "twice");
  Module *module = nullptr;
  char *message = nullptr;
  require(find<int(Context *, Buffer *, Module **, char **)>(
              library, "LLVMParseIRInContext")(context, buffer, &module,
                                               &message) == 0,
          "the other LLVM does not parse");
  Engine *engine = nullptr;
  require(find<int(Engine **, Module *, unsigned, char **)>(
              library, "LLVMCreateJITCompilerForModule")(&engine, module, 2,
                                                         &message) == 0,
          "the other LLVM makes no code");
  auto address = find<uint64_t(Engine *, const char *)>(
      library, "LLVMGetFunctionAddress")(engine, "twice");
  require(address != 0, "the other LLVM has no function");
  require(reinterpret_cast<int (*)(int)>(address)(21) == 42,
          "the other LLVM computes something else");
  find<void(Engine *)>(library, "LLVMDisposeExecutionEngine")(engine);
  find<void(Context *)>(library, "LLVMContextDispose")(context);
  std::printf("the other LLVM compiled and ran\n");
#else
  throw Skip("no name of this processor's target is known");
#endif
}

//===----------------------------------------------------------------------===//
// Mesa, by EGL
//===----------------------------------------------------------------------===//

/// Draws a triangle in software, with no window.
class Mesa {
public:
  void draw() {
    if (!egl)
      open();
    call<void(float, float, float, float)>("glClearColor")(0, 0, 1, 1);
    call<void(unsigned)>("glClear")(0x4000 /* the colours */);
    call<void(float, float, float)>("glColor3f")(1, 0, 0);
    call<void(unsigned)>("glBegin")(4 /* triangles */);
    auto *vertex = call<void(float, float)>("glVertex2f");
    vertex(-1, -1);
    vertex(3, -1);
    vertex(-1, 0);
    call<void()>("glEnd")();
    std::array<unsigned char, 4> below{}, above{};
    auto *read = call<void(int, int, int, int, unsigned, unsigned, void *)>(
        "glReadPixels");
    read(8, 1, 1, 1, 0x1908 /* RGBA */, 0x1401 /* bytes */, below.data());
    read(8, 62, 1, 1, 0x1908, 0x1401, above.data());
    require(below == std::array<unsigned char, 4>{255, 0, 0, 255} &&
                above == std::array<unsigned char, 4>{0, 0, 255, 255},
            "Mesa draws something else");
    std::printf("Mesa drew\n");
  }

private:
  template <class Function> Function *call(const char *name) {
    auto *found = reinterpret_cast<Function *>(
        find<void *(const char *)>(egl, "eglGetProcAddress")(name));
    require(found, std::string("no function ") + name);
    return found;
  }

  void open() {
    setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
    setenv("GALLIUM_DRIVER", "llvmpipe", 1);
    egl = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!egl)
      throw Skip("libEGL is not installed");
    constexpr unsigned surfaceless = 0x31DD, openGL = 0x30A2;
    void *display = call<void *(unsigned, void *, const intptr_t *)>(
        "eglGetPlatformDisplay")(surfaceless, nullptr, nullptr);
    if (!display || !call<unsigned(void *, int *, int *)>("eglInitialize")(
                        display, nullptr, nullptr))
      throw Skip("EGL has no display without a window");
    call<unsigned(unsigned)>("eglBindAPI")(openGL);
    void *context = call<void *(void *, void *, void *, const int *)>(
        "eglCreateContext")(display, nullptr, nullptr, nullptr);
    if (!context || !call<unsigned(void *, void *, void *, void *)>(
                        "eglMakeCurrent")(display, nullptr, nullptr, context))
      throw Skip("EGL makes no context of OpenGL");
    auto *renderer = call<const char *(unsigned)>("glGetString")(0x1F01);
    std::printf("Mesa: %s\n", renderer ? renderer : "?");
    if (!renderer || !std::strstr(renderer, "LLVM"))
      throw Skip("Mesa does not draw with LLVM");
    makePicture();
  }

  /// 64 x 64 pixels to draw to.
  void makePicture() {
    constexpr unsigned frame = 0x8D40, render = 0x8D41, color = 0x8CE0;
    unsigned names[2];
    call<void(int, unsigned *)>("glGenFramebuffers")(1, &names[0]);
    call<void(int, unsigned *)>("glGenRenderbuffers")(1, &names[1]);
    call<void(unsigned, unsigned)>("glBindFramebuffer")(frame, names[0]);
    call<void(unsigned, unsigned)>("glBindRenderbuffer")(render, names[1]);
    call<void(unsigned, unsigned, int, int)>("glRenderbufferStorage")(
        render, 0x8058 /* RGBA8 */, 64, 64);
    call<void(unsigned, unsigned, unsigned, unsigned)>(
        "glFramebufferRenderbuffer")(frame, color, render, names[1]);
    call<void(int, int, int, int)>("glViewport")(0, 0, 64, 64);
  }

  void *egl = nullptr;
};

/// Begins anew with the other LLVM before all other libraries.
void preload(char **argv) {
  if (std::getenv("LD_PRELOAD"))
    return;
  void *library = openLLVM(RTLD_LAZY | RTLD_LOCAL);
  if (!library)
    throw Skip("no other release of LLVM is installed");
  Dl_info where;
  require(dladdr(dlsym(library, "LLVMContextCreate"), &where) != 0,
          "the other LLVM has no place");
  setenv("LD_PRELOAD", where.dli_fname, 1);
  execv("/proc/self/exe", argv);
  throw std::runtime_error("cannot begin anew");
}

void run(const std::string &other, bool isBefore) {
  Mesa mesa;
  auto use = [&] { other == "mesa" ? mesa.draw() : useLLVM(); };
  if (isBefore)
    use();
  usePiko(3);
  use();
  usePiko(5);
  use();
}

} // namespace

int main(int argc, char **argv) {
  try {
    require(argc == 3, "expected llvm or mesa, and before or after");
    bool isBefore = argv[2] == std::string("before");
    if (isBefore)
      preload(argv);
    run(argv[1], isBefore);
    return 0;
  } catch (const Skip &skip) {
    std::printf("skipped: %s\n", skip.what());
    return skipped;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "PikoOtherLLVM: error: %s\n", error.what());
    return 1;
  }
}
