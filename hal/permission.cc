#include "luxfield/hal/permission.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace luxfield::hal {

bool IsForbidden(const std::string& node) {
  return ::faccessat(AT_FDCWD, node.c_str(), R_OK | W_OK, AT_EACCESS) != 0 && errno == EACCES;
}

}  // namespace luxfield::hal
