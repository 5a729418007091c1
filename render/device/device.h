// A thin layer over OpenCL 1.2: devices, buffers, programs from embedded sources, kernels, times.
//
// Every failing OpenCL call is a DeviceError that names the call, the code and, for builds, the
// compiler's log. One in-order queue with profiling per Device; a Device and what is made from it
// are used by one host thread at a time.
#pragma once

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "luxfield/render/device/device_tuning.h"

namespace luxfield::render {

// The text of a kernel file by its path inside render/ ("kernels/scene/bvh.clh"); empty if there is
// none.
std::string_view EmbeddedSource(std::string_view path);

struct DeviceInfo {
  int index = 0;  // over all platforms, as `--device` takes it
  std::string platform, name, version, driver;
  bool is_cpu = false;
  int compute_units = 0;
  std::size_t max_work_group_size = 0;
  std::uint64_t global_memory_bytes = 0, max_allocation_bytes = 0;
  bool has_fp64 = false;
  int native_float_lanes = 1;     // floats of its widest vector instruction
  bool has_exact_divide = false;  // -cl-fp32-correctly-rounded-divide-sqrt
};

// Every OpenCL device of every platform; empty if there is none.
std::vector<DeviceInfo> ListDevices();

// What a kernel's launches took on the device, from start to end of each.
struct KernelTime {
  std::string name;
  std::int64_t launches = 0;
  double device_s = 0;
};
// Adds to the entry of the same name, or as a new one.
void AddKernelTime(const KernelTime& time, std::vector<KernelTime>& times);
// {"name", "launches", "device_s"}
void to_json(nlohmann::json& json, const KernelTime& time);
class KernelProfile;
class BuiltPrograms;

// A cl_... handle that is released once.
template <typename Handle, auto Release>
struct Releaser {
  using pointer = Handle;
  void operator()(Handle handle) const { Release(handle); }
};
template <typename Handle, auto Release>
using Unique = std::unique_ptr<std::remove_pointer_t<Handle>, Releaser<Handle, Release>>;

// An opened device: context and queue. Copies share them.
class Device {
 public:
  // `selector`: empty = the first device, digits = an index of ListDevices(), else a part of its
  // name or its platform's (case ignored). InputError lists the devices if none fits; DeviceError
  // if the machine has none. `threads` > 0 bounds PoCL's CPU threads; it acts only before the first
  // OpenCL call of the process, so the first Open decides. The environment variable LUXFIELD_TUNING
  // overrides the device's tuning (ParseTuning).
  static Device Open(const std::string& selector = {}, int threads = 0);

  const DeviceInfo& info() const { return state_->info; }
  const DeviceTuning& tuning() const { return tuning_; }
  // The same device; programs and kernels made from the returned object are cut as `tuning` says.
  Device WithTuning(const DeviceTuning& tuning) const;
  cl_context context() const { return state_->context.get(); }
  cl_command_queue queue() const { return state_->queue.get(); }
  cl_device_id id() const { return state_->id; }
  void Finish() const;  // waits until all enqueued work is done

  // Every kernel launched since the last call, in the order of first launches; waits for them.
  std::vector<KernelTime> TakeKernelTimes() const;
  KernelProfile& profile() const { return *state_->profile; }
  // Those of this device and its copies, which are built once.
  BuiltPrograms& programs() const { return *state_->programs; }

 private:
  struct State {
    DeviceInfo info;
    cl_device_id id = nullptr;
    Unique<cl_context, clReleaseContext> context;
    Unique<cl_command_queue, clReleaseCommandQueue> queue;
    std::shared_ptr<KernelProfile> profile;
    std::shared_ptr<BuiltPrograms> programs;
  };
  explicit Device(std::shared_ptr<const State> state)
      : state_(std::move(state)), tuning_(TuningOf(state_->info)) {}
  std::shared_ptr<const State> state_;
  DeviceTuning tuning_;
};

// Device memory. Transfers block and check sizes. A default-constructed Buffer is a kernel's null
// pointer.
class Buffer {
 public:
  Buffer() = default;
  Buffer(const Device& device, std::size_t bytes);  // content undefined

  template <typename T>
  static Buffer From(const Device& device, std::span<const T> values) {
    Buffer buffer(device, values.size_bytes());
    buffer.Upload(values);
    return buffer;
  }
  template <typename T, typename Allocator>
  static Buffer From(const Device& device, const std::vector<T, Allocator>& values) {
    return From(device, std::span<const T>(values));
  }

  std::size_t bytes() const { return bytes_; }
  cl_mem get() const { return memory_.get(); }
  explicit operator bool() const { return memory_ != nullptr; }

  // Writes `values` from element `first` on; reads `values.size()` elements from `first` on.
  template <typename T>
  void Upload(std::span<const T> values, std::size_t first = 0) {
    static_assert(std::is_trivially_copyable_v<T>);
    UploadBytes(values.data(), values.size_bytes(), first * sizeof(T));
  }
  template <typename T>
  void Download(std::span<T> values, std::size_t first = 0) const {
    static_assert(std::is_trivially_copyable_v<T>);
    DownloadBytes(values.data(), values.size_bytes(), first * sizeof(T));
  }
  template <typename T>
  std::vector<T> Download() const {
    std::vector<T> values(bytes_ / sizeof(T));
    Download(std::span<T>(values));
    return values;
  }
  void FillZero();

 private:
  friend class MappedMemory;
  void UploadBytes(const void* data, std::size_t bytes, std::size_t offset);
  void DownloadBytes(void* data, std::size_t bytes, std::size_t offset) const;

  std::shared_ptr<Device> device_;
  Unique<cl_mem, clReleaseMemObject> memory_;
  std::size_t bytes_ = 0;
};

// A buffer's memory as the host sees it while this lives; see Mapped.
class MappedMemory {
 public:
  MappedMemory(const Buffer& buffer, bool writable);
  ~MappedMemory();
  MappedMemory(const MappedMemory&) = delete;
  MappedMemory& operator=(const MappedMemory&) = delete;

 protected:
  const Buffer& buffer_;
  void* memory_ = nullptr;  // null for a null buffer
};

// A buffer's elements, on a CPU in place, elsewhere in a copy; read-only for const T. Waits for what
// was enqueued before; what is enqueued later waits until this is gone. Kernels do not touch the
// buffer meanwhile.
//
//   {
//     const Mapped<const float> values(buffer);
//     Use(values.span());
//   }
template <typename T>
class Mapped : public MappedMemory {
 public:
  explicit Mapped(const Buffer& buffer) : MappedMemory(buffer, !std::is_const_v<T>) {}
  std::span<T> span() const {
    return {static_cast<T*>(memory_), memory_ ? buffer_.bytes() / sizeof(T) : 0};
  }
};

// A program as it was built.
struct BuiltProgram {
  Unique<cl_program, clReleaseProgram> program;
  bool from_cache = false;  // its binary was on disk
};

// A built program. An opened device builds it once and keeps it; its binary is kept on disk
// (render/device/program_cache.h), and one that the driver refuses is compiled anew.
class Program {
 public:
  // `path`: an embedded source, e.g. "kernels/scene/gbuffer.cl". `#include "x"` is resolved over
  // the embedded names, first beside the including file, then from render/ ("kernels/scene/bvh.clh"
  // and "luxfield/render/kernels/scene/bvh.clh" mean the same); a file is included once, and #line
  // keeps its name for the compiler's messages. The device's tuning adds its options.
  static Program Build(const Device& device, std::string_view path,
                       const std::string& options = {});
  // The same for a text of the caller's; `name` is for messages.
  static Program BuildText(const Device& device, std::string_view text, const std::string& name,
                           const std::string& options = {});

  const Device& device() const { return device_; }
  cl_program get() const { return built_->program.get(); }
  bool from_cache() const { return built_->from_cache; }

 private:
  Program(const Device& device, std::shared_ptr<const BuiltProgram> built)
      : device_(device), built_(std::move(built)) {}
  Device device_;
  std::shared_ptr<const BuiltProgram> built_;
};

// The text of an embedded source with its includes in place. DeviceError if a name is unknown.
std::string ResolveIncludes(std::string_view text, const std::string& name);

// An enqueued kernel.
class Event {
 public:
  explicit Event(cl_event event) : event_(event) {}
  void Wait() const;
  double Seconds() const;  // waits; device time from start to end

 private:
  Unique<cl_event, clReleaseEvent> event_;
};

struct WorkSize {
  std::size_t x = 1, y = 1;
};

// `bytes` of __local memory as a kernel argument.
struct LocalMemory {
  std::size_t bytes;
};

class Kernel {
 public:
  Kernel(const Program& program, const std::string& name);

  // Sets all arguments in order: Buffer, LocalMemory, or a trivially copyable value of the
  // parameter's exact size (cl_int, cl_float4, a struct shared through a .clh ...).
  template <typename... Args>
  Kernel& Set(const Args&... args) {
    CheckArgumentCount(sizeof...(args));
    cl_uint index = 0;
    (SetOne(index++, args), ...);
    return *this;
  }

  // Runs at least `global` work-items, rounded up to multiples of `local`: kernels check their
  // bounds.
  Event Enqueue(WorkSize global, WorkSize local) const;
  // The same in one dimension, in groups of the device's tuning or smaller where the kernel allows
  // no such.
  Event Enqueue(std::size_t items) const;

  const std::string& name() const { return name_; }

 private:
  template <typename T>
  void SetOne(cl_uint index, const T& value) {
    if constexpr (std::is_same_v<T, Buffer>) {
      const cl_mem memory = value.get();
      SetBytes(index, sizeof(cl_mem), &memory);
    } else if constexpr (std::is_same_v<T, LocalMemory>) {
      SetBytes(index, value.bytes, nullptr);
    } else {
      static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
      SetBytes(index, sizeof value, &value);
    }
  }
  void SetBytes(cl_uint index, std::size_t bytes, const void* value);
  void CheckArgumentCount(std::size_t count) const;

  Device device_;
  Unique<cl_kernel, clReleaseKernel> kernel_;
  std::string name_;
  std::size_t group_size_ = 1;
};

// "CL_OUT_OF_RESOURCES" for -5, "OpenCL error -9999" for unknown codes.
std::string ErrorName(cl_int code);

}  // namespace luxfield::render
