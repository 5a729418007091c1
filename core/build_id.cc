#include "luxfield/core/build_id.h"

#include <elf.h>
#include <fmt/format.h>
#include <link.h>

#include <cstring>
#include <string_view>

namespace luxfield::core {
namespace {

// Of one object; empty if it has none.
std::string IdOf(const dl_phdr_info& object) {
  for (int k = 0; k < object.dlpi_phnum; ++k) {
    const auto& header = object.dlpi_phdr[k];
    if (header.p_type != PT_NOTE) continue;
    const auto* at = reinterpret_cast<const char*>(object.dlpi_addr + header.p_vaddr);
    const char* const end = at + header.p_memsz;
    while (at + sizeof(ElfW(Nhdr)) <= end) {
      ElfW(Nhdr) note;
      std::memcpy(&note, at, sizeof note);
      const auto padded = [](std::size_t bytes) { return (bytes + 3) / 4 * 4; };
      const char* const name = at + sizeof note;
      const char* const id = name + padded(note.n_namesz);
      if (note.n_type == NT_GNU_BUILD_ID &&
          std::string_view(name, note.n_namesz) == std::string_view("GNU\0", 4)) {
        std::string text;
        for (std::size_t byte = 0; byte < note.n_descsz; ++byte)
          text += fmt::format("{:02x}", static_cast<unsigned char>(id[byte]));
        return text;
      }
      at = id + padded(note.n_descsz);
    }
  }
  return {};
}

struct Ids {
  std::string text;
  bool whole = true, first = true;
};

// The program comes first.
int Add(dl_phdr_info* object, std::size_t, void* data) {
  auto& ids = *static_cast<Ids*>(data);
  const std::string_view path = object->dlpi_name ? object->dlpi_name : "";
  const bool ours =
      ids.first || path.substr(path.rfind('/') + 1).find("luxfield") != std::string_view::npos;
  ids.first = false;
  if (!ours) return 0;
  const std::string id = IdOf(*object);
  ids.whole = ids.whole && !id.empty();
  ids.text += (ids.text.empty() ? "" : " ") + id;
  return 0;
}

}  // namespace

std::string BuildId() {
  static const std::string id = [] {
    Ids ids;
    dl_iterate_phdr(Add, &ids);
    return ids.whole ? ids.text : std::string();
  }();
  return id;
}

}  // namespace luxfield::core
