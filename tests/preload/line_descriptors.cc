// Preloaded into programs that talk to a FakeGpioChip of another process. The kernel answers a
// request for lines with a descriptor; the fake, which has none in this process, names the node to
// open instead: -2 - number.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/gpio.h>

#include <cstdarg>
#include <string>

namespace {

template <typename Request>
int Open(void* argument) {
  int& descriptor = static_cast<Request*>(argument)->fd;
  if (descriptor < -1)
    descriptor =
        open(("/dev/gpioline" + std::to_string(-2 - descriptor)).c_str(), O_RDWR | O_CLOEXEC);
  return descriptor < 0 ? -1 : 0;
}

}  // namespace

extern "C" int ioctl(int descriptor, unsigned long request, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  using Ioctl = int (*)(int, unsigned long, ...);
  static const auto next = reinterpret_cast<Ioctl>(dlsym(RTLD_NEXT, "ioctl"));
  const int result = next(descriptor, request, argument);
  if (result != 0) return result;
  switch (request) {
    case GPIO_GET_LINEHANDLE_IOCTL:
      return Open<gpiohandle_request>(argument);
    case GPIO_GET_LINEEVENT_IOCTL:
      return Open<gpioevent_request>(argument);
    case GPIO_V2_GET_LINE_IOCTL:
      return Open<gpio_v2_line_request>(argument);
    default:
      return result;
  }
}
