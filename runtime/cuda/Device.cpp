// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Device.cpp - The CUDA driver and one of its devices ----------------===//

#include "cuda/Device.h"
#include "common/Pipeline.h"
#include "cuda/OwnKernels.h"

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
#define PIKO_CUDA_OPTIONAL(NAME, SYMBOL, PARAMETERS)                           \
  driver.NAME =                                                                \
      reinterpret_cast<CUresult(*) PARAMETERS>(dlsym(library, SYMBOL));
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

/// The number that the host asks for, or else the environment.
static int chooseOrdinal(int32_t asked, int count) {
  if (asked >= count)
    failNoDevice("expected one from 0 to " + std::to_string(count - 1) +
                 ", but got " + std::to_string(asked));
  if (asked >= 0)
    return asked;
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
  if (!get(CU_DEVICE_ATTRIBUTE_UNIFIED_ADDRESSING))
    failNoDevice(who + ": expected one address space with the host, which it, "
                       "or this operating system, does not have");
  return device;
}

namespace {

/// Of the host's call that the thread is in.
struct Entered {
  int depth = 0;
  CUcontext now = nullptr;    ///< Null: not looked at.
  CUcontext before = nullptr; ///< That was current, where it is another one.
  const Driver *driver = nullptr; ///< Null: it is not.
};
thread_local Entered entered;

} // namespace

piko::rt::DeviceScope::DeviceScope() noexcept { ++entered.depth; }

piko::rt::DeviceScope::~DeviceScope() {
  if (--entered.depth > 0)
    return;
  if (entered.driver)
    entered.driver->cuCtxSetCurrent(entered.before);
  entered = {};
}

std::shared_ptr<Device> Device::open(int32_t number) {
  static std::mutex mutex;
  struct Slot {
    std::weak_ptr<Device> device;
    std::shared_ptr<Loss> loss; ///< Of that device, beyond its end.
  };
  static std::map<int, Slot> slots;
  if (number == PIKORT_PROCESSOR)
    failNoDevice("expected one, because the program has no code for a "
                 "processor alone, but got PIKORT_PROCESSOR");
  const Driver &driver = loadDriver();
  int ordinal = chooseOrdinal(number, countDevices(driver));
  std::lock_guard<std::mutex> lock(mutex);
  Slot &slot = slots[ordinal];
  std::shared_ptr<Device> device = slot.device.lock();
  bool isLost = slot.loss && slot.loss->result != CUDA_SUCCESS;
  if (!device || isLost) {
    auto loss = std::make_shared<Loss>();
    device = std::make_shared<Device>(driver, ordinal, loss, isLost);
    slot = {device, loss};
  }
  return device;
}

bool piko::rt::isDeviceKind(std::string_view name) noexcept {
  return name == "cuda";
}

void piko::rt::checkDevice(std::string_view, int32_t number) {
  if (number == PIKORT_PROCESSOR)
    failNoDevice("the host has chosen the processor");
  const Driver &driver = loadDriver();
  findDevice(driver, chooseOrdinal(number, countDevices(driver)));
}

Device::Device(const Driver &driver, int ordinal, std::shared_ptr<Loss> loss,
               bool reset)
    : driver(driver), ordinal(ordinal), loss_(std::move(loss)),
      device_(findDevice(driver, ordinal)), name_(nameOf(driver, device_)) {
  if (reset)
    check(driver.cuDevicePrimaryCtxReset(device_), "resetting its context");
  check(driver.cuDevicePrimaryCtxRetain(&context_, device_),
        "making its context");
  ownKernels_ = std::make_unique<OwnKernels>(*this);
}

Device::~Device() {
  rt::DeviceScope scope;
  if (enter() == CUDA_SUCCESS)
    ownKernels_->unload();
  driver.cuDevicePrimaryCtxRelease(device_);
}

int Device::attribute(CUdevice_attribute which) const {
  int value = 0;
  check(driver.cuDeviceGetAttribute(&value, which, device_),
        "reading an attribute");
  return value;
}

std::string Device::describe() const {
  return "CUDA device " + std::to_string(ordinal) +
         (name_.empty() ? "" : " (" + name_ + ")");
}

/// "doing: CUDA_ERROR_...: what that means"
static std::string describe(const Driver &driver, CUresult result,
                            const std::string &doing) {
  const char *name = nullptr, *text = nullptr;
  driver.cuGetErrorName(result, &name);
  driver.cuGetErrorString(result, &text);
  return doing + ": " + (name ? name : "error " + std::to_string(result)) +
         (text ? std::string(": ") + text : "");
}

CUresult Device::enter() const {
  if (CUresult lost = loss_->result)
    return lost;
  if (entered.depth == 0) // a thread of the runtime's
    return driver.cuCtxSetCurrent(context_);
  CUcontext current = entered.now;
  if (!current)
    if (CUresult error = driver.cuCtxGetCurrent(&current))
      return error;
  if (current != context_) {
    if (CUresult error = driver.cuCtxSetCurrent(context_))
      return error;
    if (!entered.driver)
      entered.before = current;
    entered.driver = &driver;
  }
  entered.now = context_;
  return CUDA_SUCCESS;
}

void Device::check(CUresult result, const std::string &doing) const {
  if (result == CUDA_SUCCESS)
    return;
  checkAlive();
  std::string text = ::describe(driver, result, doing);
  noteLoss(result, text);
  throw Failure{result == CUDA_ERROR_OUT_OF_MEMORY ? PIKORT_OUT_OF_MEMORY
                                                   : PIKORT_DEVICE_FAILED,
                describe() + ": " + text};
}

// --- Devices that are lost ---------------------------------------------------

/// Whether no later call can do anything.
static bool isLoss(CUresult result) {
  switch (result) {
  case CUDA_ERROR_DEINITIALIZED:
  case CUDA_ERROR_DEVICE_UNAVAILABLE:
  case CUDA_ERROR_ECC_UNCORRECTABLE:
  case CUDA_ERROR_NVLINK_UNCORRECTABLE:
  case CUDA_ERROR_CONTAINED:
  case CUDA_ERROR_ILLEGAL_ADDRESS:
  case CUDA_ERROR_LAUNCH_TIMEOUT:
  case CUDA_ERROR_CONTEXT_IS_DESTROYED:
  case CUDA_ERROR_ASSERT:
  case CUDA_ERROR_HARDWARE_STACK_ERROR:
  case CUDA_ERROR_ILLEGAL_INSTRUCTION:
  case CUDA_ERROR_MISALIGNED_ADDRESS:
  case CUDA_ERROR_INVALID_ADDRESS_SPACE:
  case CUDA_ERROR_INVALID_PC:
  case CUDA_ERROR_LAUNCH_FAILED:
  case CUDA_ERROR_TENSOR_MEMORY_LEAK:
  case CUDA_ERROR_MPS_CLIENT_TERMINATED:
  case CUDA_ERROR_EXTERNAL_DEVICE:
    return true;
  default:
    return false;
  }
}

void Device::noteLoss(CUresult result, const std::string &what) const {
  std::lock_guard<std::mutex> lock(loss_->mutex);
  if (!isLoss(result) || isLost())
    return;
  loss_->text = what;
  loss_->result = result;
}

void Device::checkAlive() const {
  if (!isLost())
    return;
  std::lock_guard<std::mutex> lock(loss_->mutex);
  throw Failure{PIKORT_DEVICE_FAILED,
                describe() +
                    " is lost, for this pipeline and others that are on it, "
                    "since " +
                    loss_->text};
}

// --- What hosts ask ----------------------------------------------------------

extern "C" {

int32_t pikort_device_count() {
  try {
    return countDevices(loadDriver());
  } catch (...) {
    return 0;
  }
}

int32_t pikort_get_device(int32_t device, pikort_device_info *info) {
  if (!info)
    return PIKORT_INVALID_ARGUMENT;
  *info = {};
  if (device < 0 || device >= pikort_device_count())
    return PIKORT_NOT_FOUND;
  try {
    const Driver &driver = loadDriver();
    CUdevice found = 0;
    size_t bytes = 0;
    int major = 0, minor = 0;
    if (driver.cuDeviceGet(&found, device) ||
        driver.cuDeviceGetName(info->name, sizeof(info->name), found) ||
        driver.cuDeviceTotalMem(&bytes, found) ||
        driver.cuDeviceGetAttribute(
            &major, CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR, found) ||
        driver.cuDeviceGetAttribute(
            &minor, CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR, found))
      return PIKORT_DEVICE_FAILED;
    info->capability = 10 * major + minor;
    info->memory = static_cast<int64_t>(bytes);
    findDevice(driver, device);
    info->usable = 1;
    return PIKORT_OK;
  } catch (const Failure &failure) {
    return failure.code == PIKORT_NO_DEVICE ? PIKORT_OK : failure.code;
  } catch (...) {
    return PIKORT_OUT_OF_MEMORY;
  }
}

} // extern "C"
