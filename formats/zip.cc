#include "luxfield/formats/zip.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/text_reader.h"

namespace luxfield::formats {
namespace {

constexpr std::uint32_t kMemberMark = 0x04034b50, kEntryMark = 0x02014b50, kEndMark = 0x06054b50;
constexpr std::size_t kMemberHead = 30, kEntryHead = 46, kEndHead = 22, kMostComment = 65535;
constexpr std::size_t kMostMembers = 10000;
constexpr std::uint16_t kStored = 0, kDeflated = 8, kEncrypted = 1, kUtf8Names = 0x800;
constexpr std::uint16_t kVersion = 20, kDate1980 = 0x21;

template <typename T>
T Get(std::string_view bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

template <typename T>
void Put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::uint32_t Checksum(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

// From "version needed" to the length of the name, which member and entry share.
void PutCommon(std::string& out, const ZipMember& member) {
  Put(out, kVersion);
  Put(out, kUtf8Names);
  Put(out, kStored);
  Put(out, std::uint16_t{0});  // time
  Put(out, kDate1980);
  Put(out, Checksum(member.bytes));
  Put(out, static_cast<std::uint32_t>(member.bytes.size()));
  Put(out, static_cast<std::uint32_t>(member.bytes.size()));
  Put(out, static_cast<std::uint16_t>(member.name.size()));
  Put(out, std::uint16_t{0});  // extra field
}

bool LeadsOut(std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  return name.starts_with('/') || name.find(':') != std::string::npos || name == ".." ||
         name.starts_with("../") || name.find("/../") != std::string::npos || name.ends_with("/..");
}

// Exactly `size` bytes of a raw deflate stream, or nothing.
std::string Inflated(std::string_view packed, std::size_t size) {
  std::string out(size + 1, '\0');  // one more, to see what is longer
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return {};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int status = inflate(&stream, Z_FINISH);
  const std::size_t got = stream.total_out;
  inflateEnd(&stream);
  if (status != Z_STREAM_END || got != size) return {};
  out.resize(size);
  return out;
}

}  // namespace

std::string FormatZip(const std::vector<ZipMember>& members) {
  std::string out, directory;
  for (const ZipMember& member : members) {
    const auto at = static_cast<std::uint32_t>(out.size());
    Put(out, kMemberMark);
    PutCommon(out, member);
    out += member.name + member.bytes;
    Put(directory, kEntryMark);
    Put(directory, kVersion);  // made by, and needed to extract
    PutCommon(directory, member);
    directory.append(10, '\0');  // comment, disk, attributes
    Put(directory, at);
    directory += member.name;
  }
  const auto start = static_cast<std::uint32_t>(out.size());
  out += directory;
  Put(out, kEndMark);
  Put(out, std::uint32_t{0});  // disks
  Put(out, static_cast<std::uint16_t>(members.size()));
  Put(out, static_cast<std::uint16_t>(members.size()));
  Put(out, static_cast<std::uint32_t>(directory.size()));
  Put(out, start);
  Put(out, std::uint16_t{0});  // comment
  return out;
}

ZipReader::ZipReader(std::string_view bytes, std::string file)
    : bytes_(bytes), file_(std::move(file)) {
  std::size_t end = std::string_view::npos;
  const std::size_t most = std::min(bytes.size(), kEndHead + kMostComment);
  for (std::size_t back = kEndHead; back <= most && end == std::string_view::npos; ++back)
    if (Get<std::uint32_t>(bytes, bytes.size() - back) == kEndMark) end = bytes.size() - back;
  if (end == std::string_view::npos) Fail("is no ZIP archive, or is cut short");
  const auto disks = Get<std::uint32_t>(bytes, end + 4);
  const auto count = Get<std::uint16_t>(bytes, end + 10);
  std::size_t at = Get<std::uint32_t>(bytes, end + 16);
  if (disks != 0 || count == 0xFFFF || at == 0xFFFFFFFF)
    Fail("is a ZIP archive of several disks, or of ZIP64, which is not read");
  if (count > kMostMembers)
    Fail(fmt::format("has {} members; {} are the most", count, kMostMembers));
  for (std::size_t k = 0; k < count; ++k) {
    if (at > end || end - at < kEntryHead || Get<std::uint32_t>(bytes, at) != kEntryMark)
      Fail("its directory is damaged");
    Entry entry;
    entry.flags = Get<std::uint16_t>(bytes, at + 8);
    entry.method = Get<std::uint16_t>(bytes, at + 10);
    entry.checksum = Get<std::uint32_t>(bytes, at + 16);
    entry.packed = Get<std::uint32_t>(bytes, at + 20);
    entry.size = Get<std::uint32_t>(bytes, at + 24);
    entry.at = Get<std::uint32_t>(bytes, at + 42);
    const std::size_t name = Get<std::uint16_t>(bytes, at + 28);
    const std::size_t length =
        kEntryHead + name + Get<std::uint16_t>(bytes, at + 30) + Get<std::uint16_t>(bytes, at + 32);
    if (end - at < length) Fail("its directory is damaged");
    entry.name = bytes.substr(at + kEntryHead, name);
    if (LeadsOut(entry.name))
      Fail(fmt::format("its member '{}' leads out of the archive", core::Printable(entry.name)));
    entries_.push_back(std::move(entry));
    at += length;
  }
}

const ZipReader::Entry* ZipReader::Find(std::string_view name) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.name == name; });
  return found == entries_.end() ? nullptr : &*found;
}

std::string ZipReader::Read(std::string_view name) const {
  const std::string shown = core::Printable(std::string(name));
  const Entry* entry = Find(name);
  if (!entry) Fail(fmt::format("has no member '{}'", shown));
  if (entry->flags & kEncrypted) Fail(fmt::format("its member '{}' is encrypted", shown));
  if (entry->size > kMostText)
    Fail(fmt::format("its member '{}' has {} bytes; 64 MiB are the most", shown, entry->size));
  const std::size_t at = entry->at;
  if (at > bytes_.size() || bytes_.size() - at < kMemberHead ||
      Get<std::uint32_t>(bytes_, at) != kMemberMark)
    Fail(fmt::format("its member '{}' is not where the directory says", shown));
  const std::size_t data =
      at + kMemberHead + Get<std::uint16_t>(bytes_, at + 26) + Get<std::uint16_t>(bytes_, at + 28);
  if (data > bytes_.size() || bytes_.size() - data < entry->packed)
    Fail(fmt::format("its member '{}' is cut short", shown));
  const std::string_view packed = bytes_.substr(data, entry->packed);
  std::string out;
  if (entry->method == kStored)
    out = packed;
  else if (entry->method == kDeflated)
    out = Inflated(packed, entry->size);
  else
    Fail(fmt::format("its member '{}' is packed by method {}, which is not read", shown,
                     entry->method));
  if (out.size() != entry->size || Checksum(out) != entry->checksum)
    Fail(fmt::format("its member '{}' is damaged", shown));
  return out;
}

void ZipReader::Fail(const std::string& problem) const {
  throw InputError(file_, problem, "have it exported anew");
}

}  // namespace luxfield::formats
