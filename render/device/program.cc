// Programs: include resolution and building.
#include <fmt/format.h>

#include <cctype>
#include <cstdlib>
#include <set>

#include "luxfield/render/device/opencl_check.h"
#include "luxfield/render/device/program_cache.h"
#include "luxfield/render/device/program_list.h"

namespace luxfield::render {
namespace {

std::string FolderOf(const std::string& name) {
  const auto slash = name.rfind('/');
  return slash == std::string::npos ? std::string() : name.substr(0, slash + 1);
}

// The included name if `line` is `#include "name"`, else empty.
std::string IncludedName(std::string_view line) {
  const auto skip_blanks = [&] {
    while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
  };
  skip_blanks();
  if (!line.starts_with('#')) return {};
  line.remove_prefix(1);
  skip_blanks();
  if (!line.starts_with("include")) return {};
  line.remove_prefix(7);
  skip_blanks();
  if (!line.starts_with('"')) return {};
  line.remove_prefix(1);
  return std::string(line.substr(0, line.find('"')));
}

std::string FindEmbedded(const std::string& included, const std::string& from) {
  const std::string room = "luxfield/render/";
  const std::string plain = included.starts_with(room) ? included.substr(room.size()) : included;
  for (const std::string& candidate : {FolderOf(from) + plain, plain})
    if (!EmbeddedSource(candidate).empty()) return candidate;
  throw DeviceError(fmt::format("{}: no embedded source is called '{}'", from, included));
}

void AppendResolved(std::string_view text, const std::string& name, std::set<std::string>& seen,
                    std::string& out) {
  out += fmt::format("#line 1 \"{}\"\n", name);
  int line_number = 0;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++line_number;
    const std::string included = IncludedName(line);
    if (included.empty()) {
      out.append(line);
      out += '\n';
      continue;
    }
    const std::string found = FindEmbedded(included, name);
    if (seen.insert(found).second) AppendResolved(EmbeddedSource(found), found, seen, out);
    out += fmt::format("#line {} \"{}\"\n", line_number + 1, name);
  }
}

std::string BuildLog(cl_program program, cl_device_id id) {
  std::size_t size = 0;
  if (clGetProgramBuildInfo(program, id, CL_PROGRAM_BUILD_LOG, 0, nullptr, &size) != CL_SUCCESS)
    return {};
  std::string log(size, '\0');
  if (clGetProgramBuildInfo(program, id, CL_PROGRAM_BUILD_LOG, size, log.data(), nullptr) !=
      CL_SUCCESS)
    return {};
  while (!log.empty() &&
         (log.back() == '\0' || std::isspace(static_cast<unsigned char>(log.back()))))
    log.pop_back();
  return log;
}

using UniqueProgram = Unique<cl_program, clReleaseProgram>;

UniqueProgram FromBinary(const Device& device, const std::string& binary,
                         const std::string& options) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(binary.data());
  const std::size_t size = binary.size();
  const cl_device_id id = device.id();
  cl_int status = CL_SUCCESS, code = CL_SUCCESS;
  UniqueProgram program(
      clCreateProgramWithBinary(device.context(), 1, &id, &size, &bytes, &status, &code));
  if (code != CL_SUCCESS || status != CL_SUCCESS) return nullptr;
  if (clBuildProgram(program.get(), 1, &id, options.c_str(), nullptr, nullptr) != CL_SUCCESS)
    return nullptr;
  return program;
}

UniqueProgram FromSource(const Device& device, const std::string& source, const std::string& name,
                         const std::string& options) {
  const char* text = source.c_str();
  const std::size_t size = source.size();
  const cl_device_id id = device.id();
  cl_int code = CL_SUCCESS;
  UniqueProgram program(clCreateProgramWithSource(device.context(), 1, &text, &size, &code));
  Check(code, fmt::format("clCreateProgramWithSource of {}", name));
  code = clBuildProgram(program.get(), 1, &id, options.c_str(), nullptr, nullptr);
  if (code != CL_SUCCESS)
    throw DeviceError(fmt::format("OpenCL: building {} with '{}' on {} failed: {}\n{}", name,
                                  options, device.info().name, ErrorName(code),
                                  BuildLog(program.get(), id)));
  return program;
}

std::string BinaryOf(cl_program program) {
  std::size_t size = 0;
  if (clGetProgramInfo(program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size, nullptr) != CL_SUCCESS)
    return {};
  std::string binary(size, '\0');
  auto* bytes = reinterpret_cast<unsigned char*>(binary.data());
  if (clGetProgramInfo(program, CL_PROGRAM_BINARIES, sizeof bytes, &bytes, nullptr) != CL_SUCCESS)
    return {};
  return binary;
}

}  // namespace

std::string ResolveIncludes(std::string_view text, const std::string& name) {
  std::string out;
  std::set<std::string> seen = {name};
  AppendResolved(text, name, seen, out);
  return out;
}

bool KeepsKernelsItself(const DeviceInfo& device) {
  const char* const setting = std::getenv("POCL_KERNEL_CACHE");
  return device.platform == "Portable Computing Language" &&
         !(setting && std::string_view(setting) == "0");
}

Program Program::Build(const Device& device, std::string_view path, const std::string& options) {
  const ProgramName name{std::string(path), options};
  RequireListed(name);
  device.programs().AddAsked(name);
  return BuildText(device, EmbeddedSource(path), name.path, options);
}

Program Program::BuildText(const Device& device, std::string_view text, const std::string& name,
                           const std::string& own_options) {
  const std::string options = device.tuning().BuildOptions() + " " + own_options;
  const std::string source = ResolveIncludes(text, name);
  const core::CacheKey key = ProgramKey(device.info(), options, source);
  return {device, device.programs().FindOrBuild(key, [&] {
            BuiltProgram built;
            const bool keep = !KeepsKernelsItself(device.info());
            if (const auto binary = keep ? core::FindInCache(key) : std::nullopt) {
              built.program = FromBinary(device, *binary, options);
              built.from_cache = built.program != nullptr;
            }
            if (!built.program) {
              built.program = FromSource(device, source, name, options);
              if (const std::string binary = keep ? BinaryOf(built.program.get()) : "";
                  !binary.empty())
                core::PutIntoCache(key, binary);
            }
            return built;
          })};
}

std::string ErrorName(cl_int code) {
  switch (code) {
#define LUXFIELD_CODE(name) \
  case name:                \
    return #name;
    LUXFIELD_CODE(CL_SUCCESS)
    LUXFIELD_CODE(CL_DEVICE_NOT_FOUND)
    LUXFIELD_CODE(CL_DEVICE_NOT_AVAILABLE)
    LUXFIELD_CODE(CL_COMPILER_NOT_AVAILABLE)
    LUXFIELD_CODE(CL_MEM_OBJECT_ALLOCATION_FAILURE)
    LUXFIELD_CODE(CL_OUT_OF_RESOURCES)
    LUXFIELD_CODE(CL_OUT_OF_HOST_MEMORY)
    LUXFIELD_CODE(CL_PROFILING_INFO_NOT_AVAILABLE)
    LUXFIELD_CODE(CL_BUILD_PROGRAM_FAILURE)
    LUXFIELD_CODE(CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST)
    LUXFIELD_CODE(CL_INVALID_VALUE)
    LUXFIELD_CODE(CL_INVALID_PLATFORM)
    LUXFIELD_CODE(CL_INVALID_DEVICE)
    LUXFIELD_CODE(CL_INVALID_CONTEXT)
    LUXFIELD_CODE(CL_INVALID_COMMAND_QUEUE)
    LUXFIELD_CODE(CL_INVALID_MEM_OBJECT)
    LUXFIELD_CODE(CL_INVALID_BINARY)
    LUXFIELD_CODE(CL_INVALID_BUILD_OPTIONS)
    LUXFIELD_CODE(CL_INVALID_PROGRAM)
    LUXFIELD_CODE(CL_INVALID_PROGRAM_EXECUTABLE)
    LUXFIELD_CODE(CL_INVALID_KERNEL_NAME)
    LUXFIELD_CODE(CL_INVALID_KERNEL)
    LUXFIELD_CODE(CL_INVALID_ARG_INDEX)
    LUXFIELD_CODE(CL_INVALID_ARG_VALUE)
    LUXFIELD_CODE(CL_INVALID_ARG_SIZE)
    LUXFIELD_CODE(CL_INVALID_KERNEL_ARGS)
    LUXFIELD_CODE(CL_INVALID_WORK_DIMENSION)
    LUXFIELD_CODE(CL_INVALID_WORK_GROUP_SIZE)
    LUXFIELD_CODE(CL_INVALID_WORK_ITEM_SIZE)
    LUXFIELD_CODE(CL_INVALID_EVENT)
    LUXFIELD_CODE(CL_INVALID_OPERATION)
    LUXFIELD_CODE(CL_INVALID_BUFFER_SIZE)
    LUXFIELD_CODE(CL_INVALID_GLOBAL_WORK_SIZE)
#undef LUXFIELD_CODE
    default:
      return fmt::format("OpenCL error {}", code);
  }
}

}  // namespace luxfield::render
