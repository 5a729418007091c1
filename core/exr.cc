#include "luxfield/core/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfEnvmapAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr_bytes.h"
#include "luxfield/core/exr_chunks.h"
#include "luxfield/core/exr_precheck.h"
#include "luxfield/core/file.h"
#include "luxfield/core/file_kind.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/range.h"

namespace luxfield::core {
namespace {

std::string FirstLine(const char* text) {
  std::string line(text);
  if (const auto end = line.find('\n'); end != std::string::npos) line.resize(end);
  while (!line.empty() && (line.back() == '.' || line.back() == ' ')) line.pop_back();
  return line;
}

Imf::Header MakeHeader(const ExrPartView& part, ExrCompression compression) {
  Imf::Header header(part.width, part.height);
  header.compression() =
      compression == ExrCompression::kZip ? Imf::ZIP_COMPRESSION : Imf::NO_COMPRESSION;
  header.setType(Imf::SCANLINEIMAGE);
  if (!part.name.empty()) header.setName(part.name);
  for (const auto& channel : part.channels)
    header.channels().insert(channel.name,
                             Imf::Channel(channel.pixels.index() == 0 ? Imf::FLOAT : Imf::UINT));
  for (const auto& [name, value] : part.attributes) {
    if (const int* i = std::get_if<int>(&value)) header.insert(name, Imf::IntAttribute(*i));
    if (const double* d = std::get_if<double>(&value))
      header.insert(name, Imf::DoubleAttribute(*d));
    if (const auto* s = std::get_if<std::string>(&value))
      header.insert(name, Imf::StringAttribute(*s));
  }
  return header;
}

Imf::Slice MakeSlice(Imf::PixelType type, const void* pixels, int width, std::size_t element) {
  return Imf::Slice(type, const_cast<char*>(static_cast<const char*>(pixels)), element,
                    element * width);
}

std::string EnvmapName(Imf::Envmap value) {
  if (value == Imf::ENVMAP_LATLONG) return "latlong";
  if (value == Imf::ENVMAP_CUBE) return "cube";
  return fmt::format("unknown ({})", static_cast<int>(value));
}

std::string ChromaticitiesText(const Imf::Chromaticities& c) {
  return fmt::format("{} {} {} {} {} {} {} {}", c.red.x, c.red.y, c.green.x, c.green.y, c.blue.x,
                     c.blue.y, c.white.x, c.white.y);
}

ExrAttributes ReadAttributes(const Imf::Header& header) {
  ExrAttributes attributes;
  for (auto it = header.begin(); it != header.end(); ++it) {
    const Imf::Attribute& attribute = it.attribute();
    if (const auto* i = dynamic_cast<const Imf::IntAttribute*>(&attribute))
      attributes[it.name()] = i->value();
    if (const auto* f = dynamic_cast<const Imf::FloatAttribute*>(&attribute))
      attributes[it.name()] = static_cast<double>(f->value());
    if (const auto* d = dynamic_cast<const Imf::DoubleAttribute*>(&attribute))
      attributes[it.name()] = d->value();
    if (const auto* s = dynamic_cast<const Imf::StringAttribute*>(&attribute))
      attributes[it.name()] = s->value();
    if (const auto* e = dynamic_cast<const Imf::EnvmapAttribute*>(&attribute))
      attributes[it.name()] = EnvmapName(e->value());
    if (const auto* c = dynamic_cast<const Imf::ChromaticitiesAttribute*>(&attribute))
      attributes[it.name()] = ChromaticitiesText(c->value());
  }
  return attributes;
}

// What OpenEXR throws while it writes `path`, as our error.
template <typename Work>
void OrDeviceError(const std::filesystem::path& path, Work&& work) {
  try {
    work();
  } catch (const std::exception& error) {
    throw DeviceError(fmt::format("{}: cannot write: {}; free space or choose another folder",
                                  path.string(), FirstLine(error.what())));
  }
}

// The library's own stream is closed without a word where the last bytes do not fit on the disk.
class CheckedFile : public Imf::OStream {
 public:
  explicit CheckedFile(const std::filesystem::path& path)
      : Imf::OStream(path.c_str()), stream_(path, std::ios::binary) {
    Require();
  }
  void write(const char bytes[], int count) override {
    stream_.write(bytes, count);
    Require();
  }
  std::uint64_t tellp() override { return static_cast<std::uint64_t>(stream_.tellp()); }
  void seekp(std::uint64_t place) override {
    stream_.seekp(static_cast<std::streamoff>(place));
    Require();
  }
  // Fails for what failed before, too: the library's destructors throw nothing.
  void Close() {
    stream_.close();
    Require();
  }

 private:
  void Require() const {
    if (!stream_) throw std::runtime_error(errno ? std::strerror(errno) : "the disk took no more");
  }
  std::ofstream stream_;
};

}  // namespace

void WriteExr(const std::filesystem::path& path, std::span<const ExrPartView> parts,
              ExrCompression compression) {
  WriteExr(path, parts, compression, [&](int part) {
    std::vector<ExrPixels> pixels;
    for (const auto& channel : parts[part].channels) pixels.push_back(channel.pixels);
    return pixels;
  });
}

namespace {

std::vector<Imf::Header> MakeHeaders(std::span<const ExrPartView> parts,
                                     ExrCompression compression) {
  std::vector<Imf::Header> headers;
  headers.reserve(parts.size());
  for (const auto& part : parts) headers.push_back(MakeHeader(part, compression));
  // All parts of a file share one display window; their data windows may differ.
  for (auto& header : headers) header.displayWindow() = headers.front().displayWindow();
  return headers;
}

// Into `file`, of which messages say `path`; `write` is handed it with its headers.
void WriteZipInto(const std::filesystem::path& file, const std::filesystem::path& path,
                  std::span<const ExrPartView> parts,
                  const std::function<void(ExrZipWriter&)>& write) {
  const std::vector<Imf::Header> headers = MakeHeaders(parts, ExrCompression::kZip);
  OrDeviceError(path, [&] {
    const Imf::MultiPartOutputFile output(file.c_str(), headers.data(),
                                          static_cast<int>(headers.size()), false, Threads());
  });
  ExrZipWriter zip(path, file, parts);
  write(zip);
}

void WriteZip(const std::filesystem::path& path, std::span<const ExrPartView> parts,
              const std::function<void(ExrZipWriter&)>& write) {
  WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    WriteZipInto(temporary, path, parts, write);
  });
}

}  // namespace

void WriteExrPacked(
    const std::filesystem::path& path, std::span<const ExrPartView> parts,
    const std::function<std::span<const unsigned char>(int part, std::size_t chunk)>& content) {
  WriteZip(path, parts, [&](ExrZipWriter& zip) {
    for (int i = 0; i < static_cast<int>(parts.size()); ++i)
      zip.AddPacked(parts[i], [&](std::size_t chunk) { return content(i, chunk); });
  });
}

void WriteExr(const std::filesystem::path& path, std::span<const ExrPartView> parts,
              ExrCompression compression,
              const std::function<std::vector<ExrPixels>(int part)>& pixels) {
  if (compression == ExrCompression::kZip) {
    WriteZip(path, parts, [&](ExrZipWriter& zip) {
      for (int i = 0; i < static_cast<int>(parts.size()); ++i) zip.Add(parts[i], pixels(i));
    });
    return;
  }
  const std::vector<Imf::Header> headers = MakeHeaders(parts, compression);
  WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    std::optional<CheckedFile> stream;
    std::unique_ptr<Imf::MultiPartOutputFile> file;
    OrDeviceError(path, [&] {
      stream.emplace(temporary);
      file = std::make_unique<Imf::MultiPartOutputFile>(
          *stream, headers.data(), static_cast<int>(headers.size()), false, Threads());
    });
    for (int i = 0; i < static_cast<int>(parts.size()); ++i) {
      const ExrPartView& part = parts[i];
      const std::vector<ExrPixels> planes = pixels(i);
      OrDeviceError(path, [&] {
        Imf::FrameBuffer buffer;
        for (std::size_t n = 0; n < planes.size(); ++n) {
          const std::string& name = part.channels[n].name;
          if (const auto* f = std::get_if<std::span<const float>>(&planes[n]))
            buffer.insert(name, MakeSlice(Imf::FLOAT, f->data(), part.width, sizeof(float)));
          else
            buffer.insert(name, MakeSlice(Imf::UINT, std::get<1>(planes[n]).data(), part.width,
                                          sizeof(std::uint32_t)));
        }
        Imf::OutputPart output(*file, i);
        output.setFrameBuffer(buffer);
        output.writePixels(part.height);
      });
    }
    OrDeviceError(path, [&] {
      file.reset();
      stream->Close();
    });
  });
}

struct ExrReader::Impl {
  std::filesystem::path path;
  std::unique_ptr<Imf::MultiPartInputFile> file;
  std::unique_ptr<ExrChunks> chunks;
  std::vector<Part> parts;

  [[noreturn]] void Fail(const std::string& problem, const std::string& remedy) const {
    throw InputError(path.string(), problem, remedy);
  }
};

ExrReader::ExrReader(const std::filesystem::path& path) : impl_(std::make_unique<Impl>()) {
  impl_->path = path;
  std::error_code error_code;
  if (std::filesystem::is_directory(path, error_code))
    impl_->Fail(fmt::format("is {}, not an OpenEXR file", NameOf(WhatIs(path))),
                "name the .exr that is meant");
  if (!std::filesystem::exists(path, error_code)) impl_->Fail("no such file", "check the path");
  const std::uint64_t tables_at = CheckExrHeaders(path);
  try {
    impl_->file = std::make_unique<Imf::MultiPartInputFile>(path.c_str(), Threads());
  } catch (const std::exception& error) {
    impl_->Fail(fmt::format("not a readable OpenEXR file ({})", FirstLine(error.what())),
                "make it anew with the verb that wrote it");
  }
  std::vector<const Imf::Header*> headers;
  for (int i = 0; i < impl_->file->parts(); ++i) {
    const Imf::Header& header = impl_->file->header(i);
    headers.push_back(&header);
    const auto& window = header.dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
    const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
    Part part;
    part.name = header.hasName() ? header.name() : std::string();
    part.width = static_cast<int>(width);
    part.height = static_cast<int>(height);
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
      part.channels.emplace_back(it.name());
      part.channel_is_uint.push_back(it.channel().type == Imf::UINT);
    }
    part.attributes = ReadAttributes(header);
    impl_->parts.push_back(std::move(part));
  }
  impl_->chunks = std::make_unique<ExrChunks>(path, headers, tables_at);
}

ExrReader::~ExrReader() = default;
ExrReader::ExrReader(ExrReader&&) noexcept = default;
ExrReader& ExrReader::operator=(ExrReader&&) noexcept = default;

const std::vector<ExrReader::Part>& ExrReader::parts() const { return impl_->parts; }
const std::filesystem::path& ExrReader::path() const { return impl_->path; }

int ExrReader::find_part(const std::string& name) const {
  const auto it = std::find_if(impl_->parts.begin(), impl_->parts.end(),
                               [&](const Part& part) { return part.name == name; });
  return it == impl_->parts.end() ? -1 : static_cast<int>(it - impl_->parts.begin());
}

bool ExrReader::has_channel(int part, const std::string& channel) const {
  const auto& channels = impl_->parts.at(part).channels;
  return std::find(channels.begin(), channels.end(), channel) != channels.end();
}

namespace {

void ReadSlices(ExrReader& reader, Imf::MultiPartInputFile& file, const ExrChunks& chunks,
                int part_index, std::span<const ExrTarget> targets) {
  const auto& part = reader.parts().at(part_index);
  if (chunks.Read(part_index, targets, 0, part.height)) return;
  const auto& window = file.header(part_index).dataWindow();
  Imf::FrameBuffer buffer;
  for (const ExrTarget& target : targets) {
    if (!reader.has_channel(part_index, target.channel))
      throw InputError(reader.path().string(),
                       fmt::format("part '{}' has no channel '{}'", part.name, target.channel),
                       "check that this is the kind of file the verb expects");
    // OpenEXR addresses pixels by data-window coordinates.
    char* base = BytesOf(target) -
                 4 * (static_cast<std::ptrdiff_t>(window.min.y) * part.width + window.min.x);
    buffer.insert(target.channel, Imf::Slice(IsUint(target) ? Imf::UINT : Imf::FLOAT, base, 4,
                                             std::size_t{4} * part.width));
  }
  try {
    Imf::InputPart input(file, part_index);
    input.setFrameBuffer(buffer);
    input.readPixels(window.min.y, window.max.y);
  } catch (const std::exception& error) {
    throw InputError(
        reader.path().string(),
        fmt::format("part '{}' cannot be read ({})", part.name, FirstLine(error.what())),
        "the file is truncated or damaged: make it anew");
  }
}

}  // namespace

void ExrReader::Read(int part, std::span<const ExrTarget> targets) {
  const Part& p = impl_->parts.at(part);
  for (const ExrTarget& target : targets) {
    const auto it = std::find(p.channels.begin(), p.channels.end(), target.channel);
    if (it == p.channels.end() || p.channel_is_uint[it - p.channels.begin()] == IsUint(target))
      continue;
    impl_->Fail(fmt::format("channel '{}' holds {}", target.channel,
                            IsUint(target) ? "floats where integers belong"
                                           : "integers where floats belong"),
                "check that this is the kind of file the verb expects");
  }
  ReadSlices(*this, *impl_->file, *impl_->chunks, part, targets);
}

void ExrReader::ReadFloat(int part, const std::string& channel, std::span<float> pixels) {
  const ExrTarget target{channel, pixels};
  Read(part, std::span(&target, 1));
}

std::vector<float> ExrReader::ReadFloat(int part, const std::string& channel) {
  const Part& p = impl_->parts.at(part);
  std::vector<float> pixels(static_cast<std::size_t>(p.width) * p.height);
  ReadFloat(part, channel, pixels);
  return pixels;
}

std::vector<std::uint32_t> ExrReader::ReadUint(int part, const std::string& channel) {
  const Part& p = impl_->parts.at(part);
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(p.width) * p.height);
  const ExrTarget target{channel, std::span(pixels)};
  Read(part, std::span(&target, 1));
  return pixels;
}

namespace {

const ExrValue& FindAttribute(const ExrReader& reader, int part, const std::string& name) {
  const auto& attributes = reader.parts().at(part).attributes;
  const auto it = attributes.find(name);
  if (it == attributes.end())
    throw InputError(
        reader.path().string(),
        fmt::format("attribute '{}' of part '{}' is missing", name, reader.parts().at(part).name),
        "check that this is the kind of file the verb expects");
  return it->second;
}

[[noreturn]] void FailType(const ExrReader& reader, int part, const std::string& name,
                           const char* wanted) {
  throw InputError(reader.path().string(),
                   fmt::format("attribute '{}' of part '{}' is not {}", name,
                               reader.parts().at(part).name, wanted),
                   "make the file anew with the verb that wrote it");
}

}  // namespace

int ExrReader::GetInt(int part, const std::string& name) const {
  const ExrValue& value = FindAttribute(*this, part, name);
  if (const int* i = std::get_if<int>(&value)) return *i;
  FailType(*this, part, name, "an integer");
}

double ExrReader::GetDouble(int part, const std::string& name) const {
  const ExrValue& value = FindAttribute(*this, part, name);
  if (const double* d = std::get_if<double>(&value)) {
    if (Range{}.Holds(*d)) return *d;
    throw InputError(path().string(),
                     fmt::format("attribute '{}' = {:g} is beyond all that is measured", name, *d),
                     "make the file anew with the verb that wrote it");
  }
  if (const int* i = std::get_if<int>(&value)) return *i;
  FailType(*this, part, name, "a number");
}

std::string ExrReader::GetString(int part, const std::string& name) const {
  const ExrValue& value = FindAttribute(*this, part, name);
  if (const auto* s = std::get_if<std::string>(&value)) return *s;
  FailType(*this, part, name, "text");
}

Image ReadExrImage(const std::filesystem::path& path) {
  ExrReader reader(path);
  const auto& part = reader.parts().front();
  const bool rgb = reader.has_channel(0, "R");
  if (!rgb && !reader.has_channel(0, "Y"))
    throw InputError(path.string(), "has neither channels R, G, B nor Y", "name a picture");
  Image image(part.width, part.height, rgb ? 3 : 1);
  if (rgb) {
    const ExrTarget planes[] = {
        {"R", image.plane(0)}, {"G", image.plane(1)}, {"B", image.plane(2)}};
    reader.Read(0, planes);
  } else {
    reader.ReadFloat(0, "Y", image.plane(0));
  }
  return image;
}

namespace {

ExrPartView PartOf(const Image& image, const ExrAttributes& attributes) {
  ExrPartView part{"", image.width, image.height, {}, attributes};
  if (image.channels == 1) {
    part.channels.push_back({"Y", image.plane(0)});
  } else {
    const char* names[] = {"R", "G", "B"};
    for (int channel = 0; channel < 3; ++channel)
      part.channels.push_back({names[channel], image.plane(channel)});
  }
  return part;
}

}  // namespace

void WriteExrImage(const std::filesystem::path& path, const Image& image,
                   const ExrAttributes& attributes) {
  const ExrPartView part = PartOf(image, attributes);
  WriteExr(path, std::span(&part, 1));
}

std::string ExrImageBytes(const Image& image, const std::string& name) {
  const Descriptor memory(::memfd_create("luxfield", MFD_CLOEXEC));
  if (memory.get() < 0) FailWriting(name, "create");
  const ExrPartView part = PartOf(image, {});
  const std::string file = fmt::format("/proc/self/fd/{}", memory.get());
  WriteZipInto(file, name, std::span(&part, 1), [&](ExrZipWriter& zip) {
    std::vector<ExrPixels> pixels;
    pixels.reserve(part.channels.size());
    for (const auto& channel : part.channels) pixels.push_back(channel.pixels);
    zip.Add(part, pixels);
  });
  return ReadFile(file);
}

}  // namespace luxfield::core
