// Preloaded into the program: no kernel can be launched any more once the file is there that
// LUXFIELD_DEVICE_IS_LOST names, as on an OpenCL device that was unplugged or reset.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>
#include <unistd.h>

#include <cstdlib>

extern "C" cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel,
                                         cl_uint dimensions, const size_t* offset,
                                         const size_t* global, const size_t* local, cl_uint count,
                                         const cl_event* wait, cl_event* event) {
  static const char* const lost = std::getenv("LUXFIELD_DEVICE_IS_LOST");
  if (lost && access(lost, F_OK) == 0) return CL_DEVICE_NOT_AVAILABLE;
  static const auto next = reinterpret_cast<decltype(&clEnqueueNDRangeKernel)>(
      dlsym(RTLD_NEXT, "clEnqueueNDRangeKernel"));
  return next(queue, kernel, dimensions, offset, global, local, count, wait, event);
}
