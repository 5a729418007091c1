#include "luxfield/render/device/device.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/spare_descriptors.h"
#include "luxfield/render/device/kernel_profile.h"
#include "luxfield/render/device/opencl_check.h"
#include "luxfield/render/device/program_cache.h"

namespace luxfield::render {
namespace {

constexpr cl_int kPlatformNotFoundKhr =
    -1001;  // the ICD loader's code when no platform is installed

namespace fs = std::filesystem;

// Whether nobody else can put a kernel there, which would be run: a folder, no link, of this user, that
// no other may write to, with none above it in which everybody may rename what is not theirs.
bool IsOfThisUserAlone(const fs::path& folder) {
  struct stat status {};
  if (::lstat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) ||
      status.st_uid != ::geteuid() || (status.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    return false;
  std::error_code error;
  const fs::path whole = fs::canonical(folder, error);
  for (fs::path above = whole.parent_path(); !error; above = above.parent_path()) {
    if (::stat(above.c_str(), &status) != 0 ||
        ((status.st_mode & S_IWOTH) != 0 && (status.st_mode & S_ISVTX) == 0))
      return false;
    if (above == above.parent_path()) return true;
  }
  return false;
}

bool CanHoldKernels(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder.parent_path(), error);
  ::mkdir(folder.c_str(), S_IRWXU);
  return IsOfThisUserAlone(folder) && ::access(folder.c_str(), W_OK) == 0;
}

// PoCL offers no device at all where it cannot make its kernel cache, and uses one that another user may
// have filled: it gets another where its own cannot be written or is not this user's alone (a container, a
// service account). A name that another user has taken is passed over for the next. Acts before the first
// OpenCL call.
void GivePoclACache() {
  if (std::getenv("POCL_CACHE_DIR")) return;
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  fs::path cache = xdg && *xdg ? xdg : "";
  if (cache.empty() && home && *home) cache = fs::path(home) / ".cache";
  if (!cache.empty() && CanHoldKernels(cache / "pocl")) return;
  const auto give = [](const fs::path& folder) {
    return CanHoldKernels(folder) && ::setenv("POCL_CACHE_DIR", folder.c_str(), 0) == 0;
  };
  if (const fs::path own = core::CacheFile("pocl"); !own.empty() && give(own)) return;
  std::error_code error;
  for (int n = 0; n < 100; ++n)
    if (give(fs::temp_directory_path(error) / fmt::format("luxfield-pocl-{}-{}", ::getuid(), n)))
      return;
}

std::vector<cl_device_id> DeviceIds() {
  GivePoclACache();
  cl_uint platform_count = 0;
  const cl_int code = clGetPlatformIDs(0, nullptr, &platform_count);
  if (code == kPlatformNotFoundKhr || platform_count == 0) return {};
  Check(code, "clGetPlatformIDs");
  std::vector<cl_platform_id> platforms(platform_count);
  Check(clGetPlatformIDs(platform_count, platforms.data(), nullptr), "clGetPlatformIDs");
  std::vector<cl_device_id> ids;
  for (const cl_platform_id platform : platforms) {
    cl_uint count = 0;
    if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &count) != CL_SUCCESS) continue;
    const std::size_t first = ids.size();
    ids.resize(first + count);
    Check(clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, count, ids.data() + first, nullptr),
          "clGetDeviceIDs");
  }
  return ids;
}

template <typename T>
T Get(cl_device_id id, cl_device_info what) {
  T value{};
  Check(clGetDeviceInfo(id, what, sizeof(T), &value, nullptr), "clGetDeviceInfo");
  return value;
}

// OpenCL strings end in a NUL and, from some drivers, in blanks.
std::string Trimmed(std::string text) {
  while (!text.empty() &&
         (text.back() == '\0' || std::isspace(static_cast<unsigned char>(text.back()))))
    text.pop_back();
  return text;
}

std::string GetText(cl_device_id id, cl_device_info what) {
  std::size_t size = 0;
  Check(clGetDeviceInfo(id, what, 0, nullptr, &size), "clGetDeviceInfo");
  std::string text(size, '\0');
  Check(clGetDeviceInfo(id, what, size, text.data(), nullptr), "clGetDeviceInfo");
  return Trimmed(std::move(text));
}

std::string PlatformName(cl_device_id id) {
  const auto platform = Get<cl_platform_id>(id, CL_DEVICE_PLATFORM);
  std::size_t size = 0;
  Check(clGetPlatformInfo(platform, CL_PLATFORM_NAME, 0, nullptr, &size), "clGetPlatformInfo");
  std::string text(size, '\0');
  Check(clGetPlatformInfo(platform, CL_PLATFORM_NAME, size, text.data(), nullptr),
        "clGetPlatformInfo");
  return Trimmed(std::move(text));
}

DeviceInfo Describe(cl_device_id id, int index) {
  DeviceInfo info;
  info.index = index;
  info.platform = PlatformName(id);
  info.name = GetText(id, CL_DEVICE_NAME);
  info.version = GetText(id, CL_DEVICE_VERSION);
  info.driver = GetText(id, CL_DRIVER_VERSION);
  info.is_cpu = (Get<cl_device_type>(id, CL_DEVICE_TYPE) & CL_DEVICE_TYPE_CPU) != 0;
  info.compute_units = static_cast<int>(Get<cl_uint>(id, CL_DEVICE_MAX_COMPUTE_UNITS));
  info.max_work_group_size = Get<std::size_t>(id, CL_DEVICE_MAX_WORK_GROUP_SIZE);
  info.global_memory_bytes = Get<cl_ulong>(id, CL_DEVICE_GLOBAL_MEM_SIZE);
  info.max_allocation_bytes = Get<cl_ulong>(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE);
  info.native_float_lanes = static_cast<int>(Get<cl_uint>(id, CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT));
  info.has_exact_divide = (Get<cl_device_fp_config>(id, CL_DEVICE_SINGLE_FP_CONFIG) &
                           CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0;
  info.has_fp64 = Get<cl_device_fp_config>(id, CL_DEVICE_DOUBLE_FP_CONFIG) != 0;
  return info;
}

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool Matches(const DeviceInfo& info, const std::string& selector) {
  const bool is_index = std::all_of(selector.begin(), selector.end(),
                                    [](unsigned char c) { return std::isdigit(c); });
  if (is_index) return selector.size() < 10 && std::stoi(selector) == info.index;
  return Lower(info.name).find(Lower(selector)) != std::string::npos ||
         Lower(info.platform).find(Lower(selector)) != std::string::npos;
}

// PoCL has a linker make each kernel, and ends the program where that cannot open its libraries.
void RequireDescriptors() {
  constexpr int kOfALinker = 24;
  const int spare = core::SpareDescriptors(kOfALinker);
  if (spare < kOfALinker)
    throw DeviceError(fmt::format(
        "OpenCL needs {} file descriptors and only {} are left; raise the limit of open "
        "files (ulimit -n), or end what holds them",
        kOfALinker, spare));
}

}  // namespace

std::vector<DeviceInfo> ListDevices() {
  std::vector<DeviceInfo> devices;
  for (const cl_device_id id : DeviceIds())
    devices.push_back(Describe(id, static_cast<int>(devices.size())));
  return devices;
}

Device Device::Open(const std::string& selector, int threads) {
  if (threads > 0) ::setenv("POCL_MAX_PTHREAD_COUNT", std::to_string(threads).c_str(), 1);
  RequireDescriptors();
  const auto ids = DeviceIds();
  if (ids.empty())
    throw DeviceError(
        "no OpenCL device was found; install a driver, for a CPU the Debian package "
        "pocl-opencl-icd");
  const auto devices = ListDevices();
  const auto chosen =
      selector.empty() ? devices.begin()
                       : std::find_if(devices.begin(), devices.end(), [&](const DeviceInfo& info) {
                           return Matches(info, selector);
                         });
  if (chosen == devices.end()) {
    std::string names;
    for (const auto& info : devices)
      names += fmt::format("{}{} = {}", names.empty() ? "" : ", ", info.index, info.name);
    throw InputError(fmt::format(
        "--device '{}' is no OpenCL device of this machine; choose one of: {}", selector, names));
  }
  auto state = std::make_shared<State>();
  state->info = *chosen;
  state->id = ids[chosen->index];
  cl_int code = CL_SUCCESS;
  state->context.reset(clCreateContext(nullptr, 1, &state->id, nullptr, nullptr, &code));
  Check(code, "clCreateContext");
  state->queue.reset(
      clCreateCommandQueue(state->context.get(), state->id, CL_QUEUE_PROFILING_ENABLE, &code));
  Check(code, "clCreateCommandQueue");
  state->profile = std::make_shared<KernelProfile>();
  state->programs = std::make_shared<BuiltPrograms>();
  Device device(std::move(state));
  if (const char* text = std::getenv("LUXFIELD_TUNING"))
    device.tuning_ = ParseTuning(text, device.tuning_);
  return device;
}

Device Device::WithTuning(const DeviceTuning& tuning) const {
  Device device = *this;
  device.tuning_ = tuning;
  return device;
}

void Device::Finish() const { Check(clFinish(queue()), "clFinish"); }

std::vector<KernelTime> Device::TakeKernelTimes() const { return profile().Take(); }

Buffer::Buffer(const Device& device, std::size_t bytes)
    : device_(std::make_shared<Device>(device)), bytes_(bytes) {
  if (bytes > device.info().max_allocation_bytes)
    throw DeviceError(fmt::format(
        "a buffer of {} bytes exceeds the {} bytes that {} allows; use a smaller picture or "
        "light field, or another --device",
        bytes, device.info().max_allocation_bytes, device.info().name));
  cl_int code = CL_SUCCESS;
  // OpenCL has no empty buffers.
  memory_.reset(clCreateBuffer(device.context(), CL_MEM_READ_WRITE,
                               std::max<std::size_t>(bytes, 16), nullptr, &code));
  Check(code, fmt::format("clCreateBuffer of {} bytes", bytes));
}

void Buffer::UploadBytes(const void* data, std::size_t bytes, std::size_t offset) {
  if (bytes == 0) return;
  if (!memory_ || offset > bytes_ || bytes > bytes_ - offset)
    throw DeviceError(fmt::format("upload of {} bytes at {} does not fit a buffer of {} bytes",
                                  bytes, offset, bytes_));
  Check(clEnqueueWriteBuffer(device_->queue(), memory_.get(), CL_TRUE, offset, bytes, data, 0,
                             nullptr, nullptr),
        "clEnqueueWriteBuffer");
}

void Buffer::DownloadBytes(void* data, std::size_t bytes, std::size_t offset) const {
  if (bytes == 0) return;
  if (!memory_ || offset > bytes_ || bytes > bytes_ - offset)
    throw DeviceError(fmt::format("download of {} bytes at {} does not fit a buffer of {} bytes",
                                  bytes, offset, bytes_));
  Check(clEnqueueReadBuffer(device_->queue(), memory_.get(), CL_TRUE, offset, bytes, data, 0,
                            nullptr, nullptr),
        "clEnqueueReadBuffer");
}

void Buffer::FillZero() {
  if (bytes_ == 0) return;
  const cl_uchar zero = 0;
  Check(clEnqueueFillBuffer(device_->queue(), memory_.get(), &zero, sizeof zero, 0, bytes_, 0,
                            nullptr, nullptr),
        "clEnqueueFillBuffer");
}

MappedMemory::MappedMemory(const Buffer& buffer, bool writable) : buffer_(buffer) {
  if (!buffer || buffer.bytes() == 0) return;
  cl_int code = CL_SUCCESS;
  memory_ = clEnqueueMapBuffer(buffer.device_->queue(), buffer.get(), CL_TRUE,
                               writable ? CL_MAP_READ | CL_MAP_WRITE : CL_MAP_READ, 0,
                               buffer.bytes(), 0, nullptr, nullptr, &code);
  Check(code, "clEnqueueMapBuffer");
}

MappedMemory::~MappedMemory() {
  if (memory_)
    clEnqueueUnmapMemObject(buffer_.device_->queue(), buffer_.get(), memory_, 0, nullptr, nullptr);
}

void Event::Wait() const {
  const cl_event event = event_.get();
  Check(clWaitForEvents(1, &event), "clWaitForEvents");
}

double Event::Seconds() const {
  Wait();
  cl_ulong start = 0, end = 0;
  Check(clGetEventProfilingInfo(event_.get(), CL_PROFILING_COMMAND_START, sizeof start, &start,
                                nullptr),
        "clGetEventProfilingInfo");
  Check(clGetEventProfilingInfo(event_.get(), CL_PROFILING_COMMAND_END, sizeof end, &end, nullptr),
        "clGetEventProfilingInfo");
  return 1e-9 * static_cast<double>(end - start);
}

Kernel::Kernel(const Program& program, const std::string& name)
    : device_(program.device()), name_(name) {
  cl_int code = CL_SUCCESS;
  kernel_.reset(clCreateKernel(program.get(), name.c_str(), &code));
  Check(code, fmt::format("clCreateKernel '{}'", name));
  std::size_t limit = 1;
  Check(clGetKernelWorkGroupInfo(kernel_.get(), device_.id(), CL_KERNEL_WORK_GROUP_SIZE,
                                 sizeof limit, &limit, nullptr),
        "clGetKernelWorkGroupInfo");
  group_size_ = std::min<std::size_t>(device_.tuning().group_size, limit);
}

void Kernel::CheckArgumentCount(std::size_t count) const {
  cl_uint expected = 0;
  Check(clGetKernelInfo(kernel_.get(), CL_KERNEL_NUM_ARGS, sizeof expected, &expected, nullptr),
        "clGetKernelInfo");
  if (count != expected)
    throw DeviceError(
        fmt::format("kernel '{}' takes {} arguments, {} were set", name_, expected, count));
}

void Kernel::SetBytes(cl_uint index, std::size_t bytes, const void* value) {
  Check(clSetKernelArg(kernel_.get(), index, bytes, value),
        fmt::format("clSetKernelArg {} of kernel '{}'", index, name_));
}

Event Kernel::Enqueue(std::size_t items) const { return Enqueue({items}, {group_size_}); }

Event Kernel::Enqueue(WorkSize global, WorkSize local) const {
  if (global.x == 0 || global.y == 0 || local.x == 0 || local.y == 0)
    throw DeviceError(fmt::format("kernel '{}' was enqueued with an empty work size", name_));
  const auto rounded_up = [](std::size_t count, std::size_t step) {
    return (count + step - 1) / step * step;
  };
  const std::size_t global_size[2] = {rounded_up(global.x, local.x), rounded_up(global.y, local.y)};
  const std::size_t local_size[2] = {local.x, local.y};
  cl_event event = nullptr;
  Check(clEnqueueNDRangeKernel(device_.queue(), kernel_.get(), 2, nullptr, global_size, local_size,
                               0, nullptr, &event),
        fmt::format("kernel '{}', {} x {} work-items in groups of {} x {}", name_, global_size[0],
                    global_size[1], local.x, local.y));
  Event launched(event);
  device_.profile().Add(name_, event);
  return launched;
}

}  // namespace luxfield::render
