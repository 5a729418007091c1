// ZIP archives in memory, as GLDF containers are ("APPNOTE.TXT - .ZIP File Format Specification",
// PKWARE, 6.3): stored and deflated members, one disk, no ZIP64, no encryption.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace luxfield::formats {

struct ZipMember {
  std::string name, bytes;
};

// The archive's bytes, members stored as they are, dated 1980-01-01.
std::string FormatZip(const std::vector<ZipMember>& members);

// Reads members of bytes that outlive it, one at a time. Throws InputError naming `file` and the
// member for whatever is refused: more than 10000 members, names that lead out of the archive,
// members longer than 64 MiB, or than their own directory says, a wrong checksum.
class ZipReader {
 public:
  ZipReader(std::string_view bytes, std::string file);

  bool Has(std::string_view name) const { return Find(name) != nullptr; }
  // InputError where there is no such member.
  std::string Read(std::string_view name) const;

 private:
  struct Entry {
    std::string name;
    std::uint16_t flags = 0, method = 0;
    std::uint32_t checksum = 0, packed = 0, size = 0, at = 0;
  };
  const Entry* Find(std::string_view name) const;
  [[noreturn]] void Fail(const std::string& problem) const;

  std::string_view bytes_;
  std::string file_;
  std::vector<Entry> entries_;
};

}  // namespace luxfield::formats
