// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Device.cpp - The CUDA driver and one of its devices ----------------===//

#include "cuda/Device.h"
#include "common/Pipeline.h"

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <map>

using namespace piko::cuda;
using piko::rt::Failure;

[[noreturn]] static void failNoDevice(const std::string &why) {
  throw Failure{PIKORT_NO_DEVICE, "no CUDA device: " + why};
}

// --- The driver --------------------------------------------------------------

static Driver openDriver() {
  const char *chosen = std::getenv("PIKO_CUDA_DRIVER");
  const char *name = chosen && *chosen ? chosen : "libcuda.so.1";
  // Never closed: its threads and handlers outlive us.
  void *library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    const char *why = dlerror();
    failNoDevice("cannot load the driver: " +
                 std::string(why ? why : "it has no text for the error"));
  }
  Driver driver;
  auto find = [&](const char *symbol) {
    void *address = dlsym(library, symbol);
    if (!address)
      failNoDevice(std::string("the driver '") + name + "' has no '" + symbol +
                   "'; expected one for CUDA 11 or later");
    return address;
  };
#define PIKO_CUDA_FUNCTION(NAME, SYMBOL, PARAMETERS)                           \
  driver.NAME = reinterpret_cast<CUresult(*) PARAMETERS>(find(SYMBOL));
#include "cuda/DriverAPI.def"
  if (CUresult result = driver.cuInit(0); result != CUDA_SUCCESS) {
    const char *text = nullptr;
    driver.cuGetErrorString(result, &text);
    failNoDevice("the driver does not start: " +
                 std::string(text ? text : "unknown error"));
  }
  return driver;
}

const Driver &piko::cuda::loadDriver() {
  static const Driver driver = openDriver(); // again if it throws
  return driver;
}

// --- Devices -----------------------------------------------------------------

/// The number that the environment gives.
static int chooseOrdinal(int count) {
  const char *text = std::getenv("PIKO_CUDA_DEVICE");
  if (!text || !*text)
    return 0;
  int ordinal = -1;
  const char *end = text + std::strlen(text);
  auto [stop, error] = std::from_chars(text, end, ordinal);
  if (error != std::errc() || stop != end || ordinal < 0 || ordinal >= count)
    failNoDevice("PIKO_CUDA_DEVICE: expected a number from 0 to " +
                 std::to_string(count - 1) + ", but got '" + text + "'");
  return ordinal;
}

static int countDevices(const Driver &driver) {
  int count = 0;
  if (driver.cuDeviceGetCount(&count) != CUDA_SUCCESS || count == 0)
    failNoDevice("the driver has none");
  return count;
}

static std::string nameOf(const Driver &driver, CUdevice device) {
  char name[256] = "";
  bool found =
      driver.cuDeviceGetName(name, sizeof(name), device) == CUDA_SUCCESS;
  return found ? name : "";
}

/// A device that pipelines can use.
static CUdevice findDevice(const Driver &driver, int ordinal) {
  CUdevice device = 0;
  std::string who = "device " + std::to_string(ordinal);
  if (driver.cuDeviceGet(&device, ordinal) != CUDA_SUCCESS)
    failNoDevice("the driver does not give " + who);
  who += " (" + nameOf(driver, device) + ")";
  auto get = [&](CUdevice_attribute which) {
    int value = 0;
    if (driver.cuDeviceGetAttribute(&value, which, device) != CUDA_SUCCESS)
      failNoDevice("the driver does not describe " + who);
    return value;
  };
  int major = get(CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR);
  int minor = get(CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR);
  if (major < 7)
    failNoDevice(who +
                 ": expected compute capability 7.0 or later, but it "
                 "has " +
                 std::to_string(major) + "." + std::to_string(minor));
  if (!get(CU_DEVICE_ATTRIBUTE_CONCURRENT_MANAGED_ACCESS))
    failNoDevice(who + ": expected managed memory that takes pages on demand, "
                       "which it, or this operating system, does not have");
  return device;
}

std::shared_ptr<Device> Device::open() {
  static std::mutex mutex;
  static std::map<int, std::weak_ptr<Device>> devices;
  const Driver &driver = loadDriver();
  int ordinal = chooseOrdinal(countDevices(driver));
  std::lock_guard<std::mutex> lock(mutex);
  std::shared_ptr<Device> device = devices[ordinal].lock();
  if (!device)
    devices[ordinal] = device = std::make_shared<Device>(driver, ordinal);
  return device;
}

bool piko::rt::hasDevice(std::string_view kind) noexcept {
  try {
    if (kind != "cuda")
      return false;
    const Driver &driver = loadDriver();
    findDevice(driver, chooseOrdinal(countDevices(driver)));
    return true;
  } catch (...) {
    return false;
  }
}

Device::Device(const Driver &driver, int ordinal)
    : driver(driver), ordinal(ordinal), device_(findDevice(driver, ordinal)),
      name_(nameOf(driver, device_)) {
  check(driver.cuDevicePrimaryCtxRetain(&context_, device_),
        "making its context");
}

Device::~Device() {
  if (context_)
    driver.cuDevicePrimaryCtxRelease(device_);
}

int Device::attribute(CUdevice_attribute which) const {
  int value = 0;
  check(driver.cuDeviceGetAttribute(&value, which, device_),
        "reading an attribute");
  return value;
}

std::string Device::describe(CUresult result, const std::string &doing) const {
  const char *name = nullptr, *text = nullptr;
  driver.cuGetErrorName(result, &name);
  driver.cuGetErrorString(result, &text);
  return "CUDA device " + std::to_string(ordinal) +
         (name_.empty() ? "" : " (" + name_ + ")") + ": " + doing + ": " +
         (name ? name : "error " + std::to_string(result)) +
         (text ? std::string(": ") + text : "");
}

void Device::check(CUresult result, const std::string &doing) const {
  if (result != CUDA_SUCCESS)
    throw Failure{result == CUDA_ERROR_OUT_OF_MEMORY ? PIKORT_OUT_OF_MEMORY
                                                     : PIKORT_DEVICE_FAILED,
                  describe(result, doing)};
}
