#include "luxfield/core/exr_chunks.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfPartType.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstring>
#include <optional>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/exr_zip.h"
#include "luxfield/core/parallel.h"

namespace luxfield::core {
namespace {

// Chunks that follow each other in the file are read at once, some of them in a task.
constexpr std::size_t kBytesPerRead = std::size_t{1} << 18;

struct Channel {
  std::string name;
  Imf::PixelType type = Imf::FLOAT;
  std::size_t offset = 0;  // in a row, bytes
};

// A part of scan lines, in chunks of some rows each.
struct Part {
  int number = 0;
  std::int64_t top = 0, width = 0, height = 0;
  std::int64_t rows_per_chunk = 1;
  bool packed = false;
  std::vector<Channel> channels;
  std::size_t row_bytes = 0;
  std::uint64_t table_at = 0;  // of offsets, in the file

  std::int64_t chunks() const { return (height + rows_per_chunk - 1) / rows_per_chunk; }
  std::int64_t RowsOf(std::int64_t chunk) const {
    return std::min(rows_per_chunk, height - chunk * rows_per_chunk);
  }
  std::size_t BytesOf(std::int64_t chunk) const {
    return row_bytes * static_cast<std::size_t>(RowsOf(chunk));
  }
};

// None for what is left to the library.
std::optional<Part> Layout(const Imf::Header& header) {
  if (header.hasTileDescription() || (header.hasType() && header.type() != Imf::SCANLINEIMAGE))
    return {};
  Part part;
  switch (header.compression()) {
    case Imf::NO_COMPRESSION:
      break;
    case Imf::ZIPS_COMPRESSION:
      part.packed = true;
      break;
    case Imf::ZIP_COMPRESSION:
      part.packed = true;
      part.rows_per_chunk = 16;
      break;
    default:
      return {};
  }
  const auto& window = header.dataWindow();
  part.top = window.min.y;
  part.width = std::int64_t{window.max.x} - window.min.x + 1;
  part.height = std::int64_t{window.max.y} - window.min.y + 1;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    if (it.channel().xSampling != 1 || it.channel().ySampling != 1) return {};
    part.channels.push_back({it.name(), it.channel().type, part.row_bytes});
    part.row_bytes +=
        static_cast<std::size_t>(part.width) * (it.channel().type == Imf::HALF ? 2 : 4);
  }
  return part;
}

// A channel asked for, where it lies in a row of the file.
struct Wanted {
  std::size_t offset = 0;
  unsigned char* pixels = nullptr;
};

std::optional<std::vector<Wanted>> Find(const Part& part, std::span<const ExrTarget> targets) {
  std::vector<Wanted> wanted;
  for (const ExrTarget& target : targets) {
    const auto it = std::find_if(part.channels.begin(), part.channels.end(),
                                 [&](const Channel& c) { return c.name == target.channel; });
    if (it == part.channels.end() || it->type != (IsUint(target) ? Imf::UINT : Imf::FLOAT))
      return {};
    wanted.push_back({it->offset, reinterpret_cast<unsigned char*>(BytesOf(target))});
  }
  return wanted;
}

}  // namespace

struct ExrChunks::Impl {
  Descriptor file;
  bool several = false;  // parts, whose chunks say to which they belong
  std::vector<Part> parts;

  std::size_t chunk_header() const { return (several ? 3 : 2) * sizeof(std::int32_t); }

  // How many bytes there were of those asked for.
  std::size_t ReadAt(std::uint64_t at, std::span<unsigned char> to) const {
    std::size_t filled = 0;
    while (filled < to.size()) {
      const ssize_t count = ::pread(file.get(), to.data() + filled, to.size() - filled,
                                    static_cast<off_t>(at + filled));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) break;
      filled += static_cast<std::size_t>(count);
    }
    return filled;
  }

  // Of `bytes`, which begin with the chunk; empty where it is not that chunk.
  ExrBytes Content(const Part& part, std::int64_t chunk, ExrBytes bytes) const {
    std::int32_t fields[3];
    if (bytes.size() < chunk_header()) return {};
    std::memcpy(fields, bytes.data(), chunk_header());
    if (several && fields[0] != part.number) return {};
    const std::int32_t y = fields[several ? 1 : 0], size = fields[several ? 2 : 1];
    const std::size_t most = part.BytesOf(chunk);
    if (y != part.top + chunk * part.rows_per_chunk || size <= 0 ||
        static_cast<std::size_t>(size) > std::min(most, bytes.size() - chunk_header()) ||
        (!part.packed && static_cast<std::size_t>(size) != most))
      return {};
    return bytes.subspan(chunk_header(), static_cast<std::size_t>(size));
  }

  // Rows of one chunk, of those from `first` on, into the planes.
  static bool Unpack(const Part& part, std::int64_t chunk, ExrBytes content,
                     std::span<const Wanted> wanted, std::int64_t first, std::int64_t rows,
                     ExrUnzipper& unzipper) {
    const std::size_t bytes = part.BytesOf(chunk), width = 4 * static_cast<std::size_t>(part.width);
    const bool stored = content.size() == bytes;
    if (!stored && !unzipper.Take(content, bytes)) return false;
    const std::int64_t begin = chunk * part.rows_per_chunk;
    for (std::int64_t row = std::max(begin, first);
         row < std::min(begin + part.RowsOf(chunk), first + rows); ++row)
      for (const Wanted& plane : wanted) {
        const std::size_t from =
            static_cast<std::size_t>(row - begin) * part.row_bytes + plane.offset;
        unsigned char* to = plane.pixels + static_cast<std::size_t>(row - first) * width;
        if (stored)
          std::memcpy(to, content.data() + from, width);
        else
          unzipper.Copy(from, {to, width});
      }
    return true;
  }
};

ExrChunks::ExrChunks(const std::filesystem::path& path, std::span<const Imf::Header* const> headers,
                     std::uint64_t tables_at)
    : impl_(new Impl{
          Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC)), headers.size() > 1, {}}) {
  if (std::endian::native != std::endian::little || impl_->file.get() < 0) return;
  for (const Imf::Header* header : headers) {
    std::optional<Part> part = Layout(*header);
    if (!part) {
      impl_->parts.clear();
      return;
    }
    part->number = static_cast<int>(impl_->parts.size());
    part->table_at = tables_at;
    tables_at += sizeof(std::uint64_t) * static_cast<std::uint64_t>(part->chunks());
    impl_->parts.push_back(std::move(*part));
  }
}

ExrChunks::~ExrChunks() = default;

bool ExrChunks::Read(int number, std::span<const ExrTarget> targets, int first, int rows) const {
  if (static_cast<std::size_t>(number) >= impl_->parts.size() || rows < 1) return false;
  const Part& part = impl_->parts[number];
  const auto wanted = Find(part, targets);
  if (!wanted || first < 0 || std::int64_t{first} + rows > part.height) return false;
  const std::int64_t first_chunk = first / part.rows_per_chunk,
                     end_chunk = (std::int64_t{first} + rows - 1) / part.rows_per_chunk + 1;
  const auto chunks = static_cast<std::size_t>(end_chunk - first_chunk);
  // That of the chunk behind them as well, of this part or the next, where there is one.
  const bool more = end_chunk < part.chunks() || &part != &impl_->parts.back();
  std::vector<std::uint64_t> offsets(chunks + (more ? 1 : 0));
  const std::size_t table_bytes = offsets.size() * sizeof(std::uint64_t);
  if (impl_->ReadAt(part.table_at + sizeof(std::uint64_t) * static_cast<std::uint64_t>(first_chunk),
                    {reinterpret_cast<unsigned char*>(offsets.data()), table_bytes}) != table_bytes)
    return false;

  const std::size_t most = impl_->chunk_header() + part.BytesOf(0);  // of a chunk in the file
  // As far as the chunk behind begins, which holds less by far than `most` where it is well packed.
  const auto size_of = [&](std::size_t k) {
    const bool follows = k + 1 < offsets.size() && offsets[k + 1] > offsets[k];
    return follows ? std::min<std::uint64_t>(offsets[k + 1] - offsets[k], most) : most;
  };
  const std::size_t room = std::max(most, kBytesPerRead);
  std::atomic<bool> good = true;
  ParallelFor(
      chunks, std::max<std::size_t>(8 * kBytesPerRead / most, 1),
      [&](std::size_t begin, std::size_t end) {
        ExrUnzipper unzipper(part.BytesOf(0));
        const auto buffer = std::make_unique_for_overwrite<unsigned char[]>(room);
        for (std::size_t k = begin; k < end && good;) {
          // Chunks up to `next` follow each other and fit into the buffer.
          std::size_t next = k + 1;
          while (next < end && offsets[next] > offsets[next - 1] &&
                 offsets[next] - offsets[next - 1] <= most &&
                 offsets[next] - offsets[k] + size_of(next) <= room)
            ++next;
          const std::size_t asked = offsets[next - 1] - offsets[k] + size_of(next - 1);
          const ExrBytes bytes(buffer.get(), impl_->ReadAt(offsets[k], {buffer.get(), asked}));
          for (const std::uint64_t start = offsets[k]; k < next; ++k) {
            const std::int64_t chunk = first_chunk + static_cast<std::int64_t>(k);
            const std::size_t at = offsets[k] - start;
            const ExrBytes content =
                at < bytes.size() ? impl_->Content(part, chunk, bytes.subspan(at)) : ExrBytes();
            if (content.empty() ||
                !Impl::Unpack(part, chunk, content, *wanted, first, rows, unzipper))
              good = false;
          }
        }
      });
  return good;
}

}  // namespace luxfield::core
