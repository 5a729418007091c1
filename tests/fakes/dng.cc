#include "tests/fakes/dng.h"

#include <algorithm>
#include <cmath>

namespace luxfield::fakes {
namespace {

void Append(std::string& bytes, std::uint64_t value, int size) {
  for (int k = 0; k < size; ++k) bytes += static_cast<char>(value >> 8 * k);
}

// One TIFF directory, little-endian; values above four bytes lie behind it.
class Directory {
 public:
  enum Type { kByte = 1, kText = 2, kShort = 3, kLong = 4, kRational = 5 };

  void Add(int tag, Type type, const std::string& value) {
    const int unit = type == kShort ? 2 : type == kLong ? 4 : type == kRational ? 8 : 1;
    entries_.push_back({tag, type, static_cast<int>(value.size()) / unit, value});
  }
  void Add(int tag, Type type, std::initializer_list<std::uint32_t> values) {
    std::string bytes;
    for (const std::uint32_t value : values)
      Append(bytes, value, type == kShort ? 2 : type == kByte ? 1 : 4);
    Add(tag, type, bytes);
  }

  // The directory at offset 8, its values behind it, then `strip`, which tag 273 points to.
  std::string Encode(const std::string& strip) {
    Add(273, kLong, {0});
    std::sort(entries_.begin(), entries_.end(),
              [](const Entry& a, const Entry& b) { return a.tag < b.tag; });
    const std::size_t behind = 8 + 2 + 12 * entries_.size() + 4;
    std::string directory, values;
    std::size_t size = behind;
    for (const Entry& entry : entries_)
      size += Padded(entry.value).size() > 4 ? Padded(entry.value).size() : 0;
    Append(directory, entries_.size(), 2);
    for (const Entry& entry : entries_) {
      Append(directory, static_cast<std::uint64_t>(entry.tag), 2);
      Append(directory, entry.type, 2);
      Append(directory, static_cast<std::uint64_t>(entry.count), 4);
      const std::string value = Padded(entry.value);
      if (entry.tag == 273) {
        Append(directory, size, 4);
      } else if (value.size() <= 4) {
        directory += value;
      } else {
        Append(directory, behind + values.size(), 4);
        values += value;
      }
    }
    Append(directory, 0, 4);
    std::string file = "II";
    Append(file, 42, 2);
    Append(file, 8, 4);
    return file + directory + values + strip;
  }

 private:
  struct Entry {
    int tag;
    Type type;
    int count;
    std::string value;
  };
  static std::string Padded(std::string value) {
    value.resize((std::max<std::size_t>(value.size(), 4) + 1) / 2 * 2);
    return value;
  }
  std::vector<Entry> entries_;
};

}  // namespace

std::string EncodeDng(const Negative& negative) {
  constexpr std::uint32_t kMosaic = 32803, kLinear = 34892;
  const auto width = static_cast<std::uint32_t>(negative.width),
             height = static_cast<std::uint32_t>(negative.height);
  Directory d;
  d.Add(254, Directory::kLong, {0});
  d.Add(256, Directory::kLong, {width});
  d.Add(257, Directory::kLong, {height});
  d.Add(258, Directory::kShort, {16});
  d.Add(259, Directory::kShort, {1});
  d.Add(262, Directory::kShort, {negative.cfa.empty() ? kLinear : kMosaic});
  d.Add(271, Directory::kText, negative.make + '\0');
  d.Add(272, Directory::kText, negative.model + '\0');
  d.Add(277, Directory::kShort, {1});
  d.Add(278, Directory::kLong, {height});
  d.Add(279, Directory::kLong, {2 * width * height});
  d.Add(33434, Directory::kRational,
        {static_cast<std::uint32_t>(std::lround(1e6 * negative.exposure_s)), 1000000});
  d.Add(50706, Directory::kByte, {1, 4, 0, 0});
  d.Add(50708, Directory::kText, std::string("Luxfield Fake\0", 14));
  d.Add(50717, Directory::kLong, {65535});
  if (!negative.cfa.empty()) {
    d.Add(33421, Directory::kShort, {2, 2});
    std::string colours;
    for (const char c : negative.cfa) colours += static_cast<char>(c == 'R' ? 0 : c == 'G' ? 1 : 2);
    d.Add(33422, Directory::kByte, colours);
    d.Add(50710, Directory::kByte, {0, 1, 2});
    d.Add(50711, Directory::kShort, {1});
  }
  std::string strip;
  strip.reserve(2 * negative.dn.size());
  for (const std::uint16_t dn : negative.dn) Append(strip, dn, 2);
  return d.Encode(strip);
}

}  // namespace luxfield::fakes
