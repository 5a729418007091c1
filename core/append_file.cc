#include "luxfield/core/append_file.h"

#include <fcntl.h>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/file.h"

namespace luxfield::core {

void AppendToFile(const std::filesystem::path& path, std::string_view bytes) {
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC));
  if (file.get() < 0) FailWriting(path, "open");
  WriteAll(file.get(), bytes, path);
  StorageStep("line written");
  if (::fsync(file.get()) != 0) FailWriting(path, "sync");
  StorageStep("line synced");
}

}  // namespace luxfield::core
